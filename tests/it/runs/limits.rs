//! Renders that may not take long: what is there when they end, and how they go on.

use std::ops::ControlFlow;

use upbp_core::{Canceller, Preparing, RenderError, Renderer, Settings, Start, State, Stop, StopReason};

fn settings() -> Settings {
    Settings { deterministic: true, ..Settings::default() }
}

#[test]
fn the_preparation_says_what_it_does_and_can_be_cancelled() {
    let room = upbp_testing::room(8);
    let mut steps: Vec<Preparing> = Vec::new();
    let mut note = |step| steps.push(step);
    let start = Start { progress: Some(&mut note), ..Start::default() };
    assert!(room.start_renderer(settings().validate().unwrap(), start).is_ok());
    assert!(steps.len() >= 3 && steps.is_sorted_by(|a, b| a.fraction < b.fraction), "{steps:?}");
    // Before it, and at each of its steps.
    for end in 0..=steps.len() {
        let (canceller, mut seen) = (Canceller::default(), 0);
        let copy = canceller.clone();
        let mut progress = |_| {
            seen += 1;
            if seen == end {
                copy.cancel();
            }
        };
        if end == 0 {
            canceller.cancel();
        }
        let start = Start { canceller, progress: Some(&mut progress), ..Start::default() };
        let error = room.start_renderer(settings().validate().unwrap(), start).unwrap_err();
        assert_eq!(error, RenderError::Cancelled);
        assert_eq!(seen, end.max(1), "nothing is begun after it");
    }
}

#[test]
fn a_render_without_time_has_a_picture_and_goes_on_from_there() {
    let room = upbp_testing::room(40);
    let go_on = |_: &upbp_core::Progress<'_>| ControlFlow::Continue(());
    let render = |renderer: &mut Renderer<'_>, stop: Stop| renderer.render(&stop, go_on);
    let renderer = || upbp_testing::renderer(&room, settings());
    let mut whole = renderer();
    assert_eq!(render(&mut whole, Stop { iterations: Some(3), ..Stop::default() }), StopReason::Iterations);

    let mut short = renderer();
    assert_eq!(render(&mut short, Stop { seconds: Some(1e-9), ..Stop::default() }), StopReason::Time);
    assert!(!short.film().is_empty());
    assert!(short.film().image().pixels.iter().all(|pixel| pixel.iter().all(|value| *value > 0.0)));
    // Time is up: nothing more is done.
    let before = short.film().fingerprint();
    assert_eq!(render(&mut short, Stop { seconds: Some(1e-9), ..Stop::default() }), StopReason::Time);
    assert_eq!(short.film().fingerprint(), before);

    let mut file = Vec::new();
    short.state().write(&mut file).expect("a file in memory");
    let mut resumed = renderer();
    resumed.resume(State::read(file.as_slice()).expect("a whole state")).expect("the same render");
    assert_eq!(render(&mut resumed, Stop { iterations: Some(3), ..Stop::default() }), StopReason::Iterations);
    assert!(resumed.film() == whole.film());
    assert_eq!(resumed.report().counters, whole.report().counters);
}
