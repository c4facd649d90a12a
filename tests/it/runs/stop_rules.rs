//! Renders stop when they are told to.

use std::ops::ControlFlow;

use upbp_core::{Canceller, Image, Renderer, Settings, Start, Stop, StopReason};
use upbp_scene::ReadyScene;

fn renderer(room: &ReadyScene) -> Renderer<'_> {
    let settings = Settings { techniques: "bpt".parse().expect("a technique"), ..Settings::default() };
    upbp_testing::renderer(room, settings)
}

#[test]
fn each_rule_stops() {
    let room = upbp_testing::room(12);
    let go_on = |_: &upbp_core::Progress<'_>| ControlFlow::Continue(());

    let mut by_count = renderer(&room);
    let stop = Stop { iterations: Some(5), ..Stop::default() };
    assert_eq!(by_count.render(&stop, go_on), StopReason::Iterations);
    assert_eq!(by_count.film().iterations(), 5);
    // Already there: nothing more is rendered. A higher limit goes on from here.
    assert_eq!(by_count.render(&stop, go_on), StopReason::Iterations);
    assert_eq!(by_count.film().iterations(), 5);

    let mut by_error = renderer(&room);
    let stop = Stop { error: Some(1e9), ..Stop::default() };
    assert_eq!(by_error.render(&stop, go_on), StopReason::Error);
    assert_eq!(by_error.film().iterations(), 8, "fewer tell nothing of rare light");

    let mut by_time = renderer(&room);
    let stop = Stop { seconds: Some(1e-6), ..Stop::default() };
    assert_eq!(by_time.render(&stop, go_on), StopReason::Time);
    assert!(!by_time.film().is_empty(), "there is always a picture");
    assert!(by_time.film().image().pixels.iter().all(|pixel| pixel.iter().all(|value| *value > 0.0)));

    let mut by_callback = renderer(&room);
    let reason = by_callback.render(&Stop::default(), |now| {
        if now.iterations < 3 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    assert_eq!(reason, StopReason::Cancelled);
    assert_eq!(by_callback.film().iterations(), 3);

    let canceller = Canceller::default();
    let settings = Settings { techniques: "bpt".parse().expect("a technique"), ..Settings::default() };
    let start = Start { canceller: canceller.clone(), ..Start::default() };
    let by_handle = room.start_renderer(settings.validate().expect("valid settings"), start);
    let mut by_handle = by_handle.expect("a scene that can be rendered");
    let reason = by_handle.render(&Stop::default(), |now| {
        if now.iterations == 2 {
            canceller.cancel();
        }
        ControlFlow::Continue(())
    });
    assert_eq!(reason, StopReason::Cancelled);
    assert_eq!(by_handle.film().iterations(), 2, "an abandoned iteration leaves no trace");
}

/// One iteration that would take most of a minute.
#[test]
fn long_iterations_are_shown_while_they_last() {
    let room = upbp_testing::room(128);
    let settings = Settings {
        techniques: "bpt".parse().expect("technique names"),
        connections: Some(1000.0),
        ..Settings::default()
    };
    let mut renderer = upbp_testing::renderer(&room, settings);
    let stop = Stop { iterations: Some(1), ..Stop::default() };
    let (mut shown, mut last) = (0, 0.0);
    let reason = renderer.render(&stop, |now| {
        shown += 1;
        assert_eq!(now.iterations, 0);
        let done: f64 = now.film.begun().values().sum();
        assert!(last < done && done < 1.0, "{done} after {last}");
        assert_eq!(now.fraction, done);
        last = done;
        if shown < 2 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    assert_eq!((reason, shown), (StopReason::Cancelled, 2));
    assert_eq!(renderer.film().begun().values().sum::<f64>(), last, "what was shown is on the film");
    // What is given to another renderer is gone on with.
    let state = renderer.state().clone();
    let mut other = upbp_testing::renderer(&room, renderer.state().identity().settings.clone());
    other.resume(state).expect("a state of the same render");
    assert_eq!(other.film().begun().values().sum::<f64>(), last);
}

#[test]
fn references_of_another_size_are_refused() {
    let room = upbp_testing::room(4);
    for (width, height, pixels, message) in [
        (5, 4, 20, "expected a reference of 4 x 4 pixels, found 5 x 4"),
        (4, 4, 15, "expected a reference of 4 x 4 pixels, found 15 in all"),
    ] {
        let settings = Settings::default().validate().expect("valid settings");
        let reference = Some(Image { width, height, pixels: vec![[0.0; 3]; pixels] });
        let error = room.start_renderer(settings, Start { reference, ..Start::default() });
        assert_eq!(error.expect_err("another size").to_string(), message);
    }
}

#[test]
fn limits_that_are_no_numbers_are_refused() {
    let room = upbp_testing::room(4);
    for (stop, name) in [
        (Stop { seconds: Some(f64::NAN), ..Stop::default() }, "stop.seconds"),
        (Stop { seconds: Some(-1.0), ..Stop::default() }, "stop.seconds"),
        (Stop { error: Some(f64::NAN), ..Stop::default() }, "stop.error"),
    ] {
        let settings = Settings::default().validate().expect("valid settings");
        let error = room.start_renderer(settings, Start { stop, ..Start::default() });
        assert!(error.expect_err("no limit").to_string().contains(name), "{stop:?}");
    }
}
