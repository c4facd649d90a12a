//! Hosts that break the contract of their scene: the renderer drops and counts, or refuses, and never panics;
//! what reaches the film is finite and not negative; and the contract checkers find every kind of fault.

use std::ops::ControlFlow;
use std::sync::atomic::Ordering;

use glam::Vec3;
use upbp_core::check::{check_bsdf, check_camera, check_emitter, check_medium, check_scene};
use upbp_core::scene::{Interface, Scene};
use upbp_core::{Canceller, Counters, Ray, RenderError, Renderer, Settings, Start, Stop, StopReason};

use super::faulty_host::{Fault, Fault as F, GEOMETRY, Hostile, Part, faults};

/// Renders a little; what was dropped, or the reason not to start.
fn render(fault: Fault, techniques: &str) -> Result<Counters, String> {
    const ITERATIONS: u64 = 2;
    let scene = Hostile::new(fault);
    let settings = Settings {
        techniques: techniques.parse().expect("technique names"),
        light_paths: upbp_core::LightPaths::Count(256),
        max_length: 20,
        ..Settings::default()
    };
    let settings = settings.validate().expect("valid settings");
    let stop = Stop { iterations: Some(ITERATIONS), ..Stop::default() };
    let mut renderer = Renderer::start(&scene, settings, Start { stop, ..Start::default() })
        .map_err(|error| error.to_string())?;
    for _ in 0..ITERATIONS {
        renderer.iterate();
    }
    let film = renderer.film();
    for (name, image) in film.layers().filter_map(|layer| Some((layer.name(), film.layer(layer)?))) {
        let fine = image.pixels.iter().flatten().all(|value| value.is_finite() && *value >= 0.0);
        assert!(fine, "{fault:?}: {name}");
    }
    Ok(renderer.report().counters)
}

#[test]
fn nothing_bad_reaches_the_film_and_nothing_panics() {
    for techniques in ["all", "auto", "bpt", "hit+nee+lt", "hit+nee"] {
        let good = render(F::None, techniques).expect("a good scene");
        assert_eq!((good.dropped, good.lost_walks), (0, 0));
        let mut faults = match techniques {
            "all" => faults(),
            "hit+nee+lt" => vec![F::EndlessBodies],
            // Without light sub-paths, which drop as much.
            "hit+nee" => vec![F::BsdfWeight(f32::NAN), F::BsdfWeight(f32::INFINITY)],
            _ => GEOMETRY.to_vec(),
        };
        // Seconds for each set: every ray meets as many boundaries as are followed at all, and stacks of
        // bodies become as long.
        faults.retain(|fault| match fault {
            F::Endless => techniques == "auto",
            F::EndlessBodies => techniques == "hit+nee+lt",
            _ => true,
        });
        for fault in faults {
            let outcome = std::panic::catch_unwind(|| render(fault, techniques));
            let counters = outcome.unwrap_or_else(|_| panic!("{fault:?} panics"));
            println!("{fault:?}, {techniques}: {counters:?}");
            // Values that take part in a contribution are dropped there, and counted. Walks that are told
            // what cannot be are lost.
            match fault {
                F::BsdfNan | F::BsdfNegative | F::BsdfInfinite | F::Radiance(_) => {
                    assert!(counters.expect("renders").dropped > 0, "{fault:?}");
                }
                F::BsdfWeight(weight) if !weight.is_finite() => {
                    assert!(counters.expect("renders").dropped > 0, "{fault:?}");
                }
                F::NormalNan
                | F::ShadingNan
                | F::HitBehind
                | F::HitNan
                | F::HitInfinite
                | F::PositionNan
                | F::PositionInfinite
                | F::BoundaryNan
                | F::Endless
                | F::EndlessBodies
                | F::NewBodies
                | F::LightDirection
                | F::CameraDirection => assert!(counters.expect("renders").lost_walks > 0, "{fault:?}"),
                _ => {}
            }
        }
    }
}

#[test]
fn light_whose_place_on_the_film_is_no_number_falls_on_no_pixel() {
    let mean = |fault| {
        let scene = Hostile::new(fault);
        let settings = Settings { techniques: "lt".parse().expect("a technique"), ..Settings::default() };
        let mut renderer =
            Renderer::new(&scene, settings.validate().expect("valid settings")).expect("starts");
        renderer.iterate();
        renderer.film().image().mean()
    };
    assert!(mean(F::None).iter().all(|mean| *mean > 0.0));
    assert!(mean(F::CameraFilm).iter().all(|mean| *mean == 0.0));
}

#[test]
fn light_that_is_never_chosen_is_hit() {
    let scene = Hostile::new(F::Power(0.0));
    for techniques in ["auto", "all", "hit+nee"] {
        let settings = Settings { techniques: techniques.parse().expect("names"), ..Settings::default() };
        let mut renderer =
            Renderer::new(&scene, settings.validate().expect("valid settings")).expect("starts");
        assert_eq!(renderer.support().techniques.to_string(), "hit", "{techniques}");
        renderer.iterate();
        assert!(renderer.film().image().mean().iter().all(|mean| *mean > 0.0), "{techniques}");
    }
}

#[test]
fn scenes_without_bounds_or_power_are_refused() {
    for bad in [f32::NAN, f32::INFINITY, -1.0] {
        assert!(render(F::Bounds(bad), "all").unwrap_err().contains("bounds"), "{bad}");
        assert!(render(F::Power(bad), "all").unwrap_err().contains("power"), "{bad}");
    }
    assert!(render(F::Bounds(0.0), "all").unwrap_err().contains("bounds"));
}

/// The verdict of the checkers on a scene, each asked for what it is about. Those of parts without a fault
/// have nothing to find.
fn check(fault: Fault) -> Result<(), String> {
    let scene = Hostile::new(fault);
    let bounds = scene.bounds();
    let has = |part| fault == F::None || fault.part() == part;
    if has(Part::Scene) || has(Part::Light) {
        check_scene(&scene).map_err(|violation| violation.to_string())?;
    }
    if has(Part::Medium) {
        for medium in scene.media() {
            check_medium(medium, &bounds).map_err(|violation| violation.to_string())?;
        }
    }
    if has(Part::Light) {
        for light in scene.emitters() {
            let receivers = [Vec3::new(0.0, -0.9, 0.0), Vec3::new(0.5, 0.0, 0.0)];
            check_emitter(light, &bounds, &receivers).map_err(|violation| violation.to_string())?;
        }
    }
    if has(Part::Bsdf) {
        let down = Ray::new(Vec3::new(1.5, 0.0, 1.5), -Vec3::Y);
        let floor = scene.intersect(&down).and_then(|hit| hit.boundary.bsdf().copied()).ok_or("no floor")?;
        check_bsdf(&floor, Interface::MATCHED).map_err(|violation| violation.to_string())?;
    }
    if has(Part::Camera) {
        check_camera(scene.camera()).map_err(|violation| violation.to_string())?;
    }
    Ok(())
}

#[test]
fn the_checkers_find_every_fault() {
    check(F::None).expect("a good scene");
    let mut unseen = Vec::new();
    for fault in faults() {
        let outcome = std::panic::catch_unwind(|| check(fault));
        match outcome.unwrap_or_else(|_| panic!("{fault:?}: a checker panics")) {
            Ok(()) => unseen.push(fault),
            Err(violation) => println!("{fault:?}: {violation}"),
        }
    }
    assert!(unseen.is_empty(), "not found: {unseen:?}");
    for (fault, named) in [
        (F::NormalInwards, "geometric normals point out of a body"),
        (F::NormalTurned, "does not turn towards the ray"),
        (F::InteriorMissing, "a surface that refracts encloses a body"),
        (F::EmitterMissing, "rays meet lights that have an area"),
        (F::OutsideVaries, "lets light from infinity pass alike everywhere"),
    ] {
        let violation = check(fault).unwrap_err();
        assert!(violation.contains(named), "{fault:?}: {violation}");
    }
    for bad in [f32::NAN, f32::INFINITY, -1.0] {
        assert!(check(F::Bounds(bad)).is_err() && check(F::Power(bad)).is_err(), "{bad}");
    }
}

/// The iterations of a render that is cancelled.
const ITERATIONS: u64 = 8;

/// A renderer of a scene that is cancelled by one of its rays.
fn begin(scene: &Hostile) -> Result<Renderer<'_>, RenderError> {
    let canceller = scene.end.as_ref().map(|(_, canceller)| canceller.clone()).unwrap_or_default();
    let stop = Stop { iterations: Some(ITERATIONS), ..Stop::default() };
    start(scene, Start { canceller, stop, ..Start::default() })
}

fn start<'a>(scene: &'a Hostile, start: Start<'_>) -> Result<Renderer<'a>, RenderError> {
    let settings = Settings { max_length: 20, ..Settings::default() };
    Renderer::start(scene, settings.validate().expect("good settings"), start)
}

#[test]
fn cancelled_at_any_ray_it_ends_at_once_and_what_is_done_is_not_lost() {
    let scene = Hostile::new(F::None);
    let mut whole = begin(&scene).expect("a good scene");
    let of_preparation = scene.rays.load(Ordering::Relaxed);
    while whole.film().iterations() < ITERATIONS {
        assert!(whole.iterate());
    }
    let of_iterations = scene.rays.load(Ordering::Relaxed) - of_preparation;
    let (mut refused, mut parts) = (0, 0);
    // Not in the last iteration, whose last sub-paths end with the render.
    let of_iterations = of_iterations - of_iterations / ITERATIONS;
    let in_iterations = (0..of_iterations).step_by((of_iterations / 24).max(1) as usize);
    let in_preparation = (0..of_preparation).step_by((of_preparation / 20) as usize);
    for last in in_preparation.chain(in_iterations.map(|ray| of_preparation + ray)) {
        let mut cancelled = Hostile::new(F::None);
        cancelled.end = Some((last, Canceller::default()));
        match begin(&cancelled) {
            Err(error) => {
                assert_eq!(error, RenderError::Cancelled);
                refused += 1;
            }
            Ok(mut renderer) => {
                let stop = Stop { iterations: Some(ITERATIONS), ..Stop::default() };
                let reason = renderer.render(&stop, |_| ControlFlow::Continue(()));
                assert_eq!(reason, StopReason::Cancelled);
                parts += renderer.film().begun().len();
                let mut resumed = begin(&scene).expect("a good scene");
                resumed.resume(renderer.state().clone()).expect("the same render");
                while resumed.film().iterations() < ITERATIONS {
                    assert!(resumed.iterate());
                }
                assert!(resumed.film() == whole.film(), "{last}");
            }
        }
        // The sub-paths in hand, of every thread.
        let more = cancelled.rays.load(Ordering::Relaxed) - last;
        assert!(more < 1000 * rayon::current_num_threads() as u64, "{more} rays more than {last}");
    }
    println!("{of_preparation} and {of_iterations} rays, {refused} refused, {parts} parts");
    assert!(refused > 0 && parts > 0, "{refused} refused, {parts} parts");
}

#[test]
fn a_render_that_is_resumed_does_not_choose_again() {
    let scene = Hostile::new(F::None);
    let mut first = begin(&scene).expect("a good scene");
    let of_choice = scene.rays.load(Ordering::Relaxed);
    assert!(first.iterate() && first.iterate());
    let state = first.state().clone();

    let again = Hostile::new(F::None);
    let plan = Some(state.identity().frozen_plan());
    let mut resumed = start(&again, Start { plan, ..Start::default() }).expect("a good scene");
    let rays = again.rays.load(Ordering::Relaxed);
    assert!(rays < of_choice, "{rays} rays, {of_choice} with a choice");
    resumed.resume(state).expect("the same render");
    assert!(resumed.iterate() && first.iterate());
    assert!(resumed.film() == first.film());
}
