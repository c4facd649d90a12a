//! The memory of a render is what was expected, and what was allowed, within a tenth; its preparation takes
//! no more than is allowed.
//!
//! Each case is a process of its own, so that nothing of another is counted. `UPBP_VERTICES=1e7` measures
//! another number of light vertices than the usual ones, and only that.
#![cfg(target_os = "linux")]

use std::fs;
use std::path::{Path, PathBuf};

use upbp_core::{FrozenPlan, LightPaths, Settings, Start, write_exr};
use upbp_scene::ReadyScene;
use upbp_scene::description::Count;

use super::own_process;

const MIB: f64 = 1_048_576.0;

/// Variables by which the GNU allocator gives back what was freed, so that what is measured is what a render
/// holds: by itself it keeps some MiB, now more, now less.
const GIVE_BACK: [(&str, &str); 2] =
    [("MALLOC_MMAP_THRESHOLD_", "131072"), ("MALLOC_TRIM_THRESHOLD_", "131072")];

/// A number of bytes out of `/proc/self/status`.
fn status(name: &str) -> f64 {
    let text = fs::read_to_string("/proc/self/status").expect("Linux");
    let line = text.lines().find_map(|line| line.strip_prefix(name)).expect("a known name");
    let kib: f64 = line.trim_start_matches(':').trim().trim_end_matches(" kB").parse().expect("a number");
    kib * 1024.0
}

fn settings(light_paths: u32, beams: f64, memory: u32) -> Settings {
    Settings {
        beams: (beams > 0.0).then_some((beams * f64::from(light_paths)) as u32),
        techniques: "all".parse().expect("technique names"),
        light_paths: LightPaths::Count(light_paths),
        memory: Some(memory),
        ..Settings::default()
    }
}

/// Calls a function with a shipped scene of `side` x `side` pixels.
fn with_scene<R: Send>(name: &str, side: u32, function: impl FnOnce(&ReadyScene) -> R + Send) -> R {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes").join(name);
    let side = Count::new(side).expect("a positive count");
    let scene = ReadyScene::load_with(path, |description| {
        description.film.width = side;
        description.film.height = side;
    })
    .expect("a shipped scene");
    on_one_thread(|| function(&scene))
}

/// Calls a function on one thread: how many have buffers of their own at the same time is up to the system's
/// scheduler.
fn on_one_thread<R: Send>(function: impl FnOnce() -> R + Send) -> R {
    rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread pool").install(function)
}

/// The file of the plan that a case is rendered by.
fn plan_path() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("memory_plan.ron")
}

/// Writes the plan for about as many light vertices as wanted.
fn make_plan(memory: u32, vertices: f64, beams: f64) {
    with_scene("cornell_media.ron", 64, |scene| {
        let prepare = |paths, memory| {
            let checked = settings(paths, beams, memory).validate().expect("valid settings");
            scene.renderer(checked).expect("a renderer").state().identity().clone()
        };
        let paths = (vertices / prepare(1000, 100).plan.vertices_per_light_path) as u32;
        let plan = prepare(paths, memory).frozen_plan();
        fs::write(plan_path(), plan.to_ron()).expect("a folder for tests");
    });
}

/// Renders two iterations; prints what was expected and what it took, bytes, and the numbers of light
/// vertices and photon beams.
fn measure(memory: u32, beams: f64) {
    let text = fs::read_to_string(plan_path()).expect("the plan that was made");
    let plan = FrozenPlan::from_ron(&text).expect("a plan");
    with_scene("cornell_media.ron", 64, |scene| {
        let render = |plan: FrozenPlan| {
            let checked = settings(plan.plan.light_paths, beams, memory).validate().expect("valid settings");
            let start = Start { plan: Some(plan), ..Start::default() };
            let mut renderer = scene.start_renderer(checked, start).expect("a renderer");
            assert!(renderer.iterate() && renderer.iterate());
            renderer
        };
        // A small one first: the program's own pages come into memory where they are used.
        let mut small = plan.clone();
        small.plan.light_paths = 10;
        small.plan.beam_paths = small.plan.beam_paths.min(5);
        drop(render(small));
        let before = status("VmRSS");
        let renderer = render(plan);
        let report = renderer.report();
        println!(
            "case {} {} {} {}",
            report.expected_bytes,
            status("VmHWM") - before,
            report.counters.light_vertices / 2,
            report.counters.photon_beams / 2
        );
    });
}

/// Runs a case in a process of its own: expected and measured bytes. `memory` is what is allowed in MiB,
/// `beams` the part of the light sub-paths that leaves beams.
///
/// The plan is made before: a preparation leaves some MiB with the allocator, which the render then takes
/// again or not.
fn run(memory: u32, vertices: f64, beams: f64) -> [f64; 2] {
    make_plan(memory, vertices, beams);
    let case = format!("{memory} {beams}");
    let text = own_process::run("runs::memory::memory_is_what_was_expected", &case, &GIVE_BACK);
    let line = text.lines().find_map(|line| line.split_once("case ").map(|(_, rest)| rest));
    let Some(line) = line else { panic!("{text}") };
    let numbers: Vec<f64> = line.split(' ').map(|word| word.parse().expect("a number")).collect();
    println!(
        "budget {memory} MiB, {} vertices, {} beams: expected {:.1} MiB, measured {:.1} MiB, ratio {:.3}",
        numbers[2],
        numbers[3],
        numbers[0] / MIB,
        numbers[1] / MIB,
        numbers[1] / numbers[0]
    );
    [numbers[0], numbers[1]]
}

#[test]
fn memory_is_what_was_expected() {
    // What is allowed in MiB, which part of the light sub-paths leaves beams.
    if let Some(case) = own_process::case() {
        let numbers: Vec<f64> = case.split(' ').map(|word| word.parse().expect("a number")).collect();
        return measure(numbers[0] as u32, numbers[1]);
    }
    let close = |[expected, measured]: [f64; 2]| {
        assert!((measured / expected - 1.0).abs() < 0.1, "expected {expected} bytes, measured {measured}");
    };
    if let Ok(vertices) = std::env::var("UPBP_VERTICES") {
        close(run(1 << 20, vertices.parse().expect("a number"), 0.0));
        return;
    }
    // As many beams as the pilot finds useful, and one for every second sub-path. Large enough for the
    // 1.5 MiB or so by which less is measured at any size to be no tenth.
    close(run(1 << 20, 2e5, 0.0));
    close(run(1 << 20, 1e6, 0.0));
    close(run(1 << 20, 1e5, 0.5));
    // As much as is allowed, no more and not much less.
    let [expected, measured] = run(150, 1e7, 0.0);
    close([expected, measured]);
    close([150.0 * MIB, measured]);
}

/// Milk in a ball of glass, of hundreds of mean free paths, under a small lamp: a few sub-paths are very long
/// and merge very often.
const MILK: &str = r#"(version: 1,
  camera: Perspective(origin: (0, 0, 5), target: (0, 0, 0), fov_degrees: 30), film: (width: 64, height: 64),
  media: { "milk": Homogeneous(sigma_s: 340) },
  materials: { "glass": Dielectric(1.5), "white": Lambert(0.7) },
  shapes: [
    (material: "glass", interior: "milk", geometry: Sphere(centre: (0, 0, 0), radius: 1)),
    (material: "white", geometry: Quad(origin: (-5, -1.2, -5), edge_u: (0, 0, 10), edge_v: (10, 0, 0))),
  ],
  lights: [Point(position: (2, 3, 3), intensity: 50)])"#;

#[test]
fn films_take_what_was_expected() {
    /// Pixels of each side: so many that nothing else is of any size.
    const SIDE: u32 = 1000;
    let render = |side: u32| {
        with_scene("suite/bare_surfaces.ron", side, |scene| {
            let settings =
                Settings { techniques: "pt".parse().expect("technique names"), ..Settings::default() };
            let mut renderer =
                scene.renderer(settings.validate().expect("valid settings")).expect("a renderer");
            assert!(renderer.iterate() && renderer.iterate());
            let report = renderer.report();
            assert!(report.estimated_over_scales.is_some(), "two halves are compared");
            let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("memory_film.exr");
            write_exr(&path, renderer.state(), &report).expect("a folder for tests");
            report.expected_bytes as f64
        })
    };
    if own_process::case().is_none() {
        own_process::run("runs::memory::films_take_what_was_expected", "film", &GIVE_BACK);
        return;
    }
    // The program's own pages come into memory where they are used.
    render(10);
    let before = status("VmRSS");
    let expected = render(SIDE);
    let measured = status("VmHWM") - before;
    println!("expected {:.1} MiB, measured {:.1} MiB", expected / MIB, measured / MIB);
    // Less, since pages of sums that nothing was added to are never touched.
    assert!((0.6..1.1).contains(&(measured / expected)), "expected {expected} bytes, measured {measured}");
}

/// Fog that absorbs nothing, around everything, of which the scene is two hundred free paths wide: sub-paths
/// hardly ever get away from it.
const FOG: &str = r#"(version: 1,
  camera: Perspective(origin: (0, 0, 5), target: (0, 0, 0), fov_degrees: 30), film: (width: 64, height: 64),
  media: { "fog": Homogeneous(sigma_s: 40) }, outside: "fog",
  materials: { "white": Lambert(1.0) },
  shapes: [(material: "white", geometry: Sphere(centre: (0, 0, 0), radius: 1))],
  lights: [Point(position: (2, 3, 3), intensity: 50)])"#;

#[test]
fn preparations_take_what_is_allowed() {
    const MEMORY: u32 = 60;
    /// Prepares a render by some techniques, with paths of up to `longest` edges.
    fn prepare(scene: &ReadyScene, techniques: &str, longest: u32) {
        let before = status("VmRSS");
        let techniques = techniques.parse().expect("technique names");
        let settings =
            Settings { techniques, memory: Some(MEMORY), max_length: longest, ..Settings::default() };
        let renderer = scene.renderer(settings.validate().expect("valid settings")).expect("a renderer");
        let taken = (status("VmHWM") - before) / MIB;
        println!("{taken:.1} MiB");
        assert!(taken < f64::from(MEMORY), "{taken} MiB of {MEMORY}");
        assert!(renderer.report().plan.light_paths > 0, "techniques are chosen all the same");
    }
    let usual = Settings::default().max_length;
    let prepare_text = |text, techniques, longest| {
        let scene = ReadyScene::from_ron_str(text, ".").expect("a valid scene");
        on_one_thread(|| prepare(&scene, techniques, longest));
    };
    match own_process::case().as_deref() {
        // Thick clusters of photons: without a limit the preparation takes 108 MiB.
        Some("clusters") => with_scene("suite/dense_marble.ron", 200, |scene| prepare(scene, "auto", usual)),
        // Emitters are measured: without a limit up to 500 MiB.
        Some("milk") => prepare_text(MILK, "auto", usual),
        // Beams alone are stored, no vertices.
        Some("beams") => prepare_text(FOG, "hit+nee+bb1d", 1024),
        // Long walks: with all of their queries the preparation takes a hundred MiB.
        Some(_) => prepare_text(FOG, "auto", 4096),
        None => {
            // At the same time: each has one thread, and reads its own numbers.
            std::thread::scope(|scope| {
                for case in ["clusters", "milk", "fog", "beams"] {
                    let test = "runs::memory::preparations_take_what_is_allowed";
                    scope.spawn(move || own_process::run(test, case, &GIVE_BACK));
                }
            });
        }
    }
}
