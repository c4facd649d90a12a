//! Renders of very many iterations: nothing grows, nothing overflows, nothing underflows.
//!
//! `UPBP_ITERATIONS=100000` sets how many; a few thousand by default.
#![cfg(target_os = "linux")]

use std::fs;
use std::ops::ControlFlow;
use std::time::Instant;

use upbp_core::{LightPaths, MAX_ITERATIONS, Radius, Renderer, Settings, State, Stop};
use upbp_scene::ReadyScene;

use super::own_process;

/// Resident memory, KiB.
fn resident() -> i64 {
    let text = fs::read_to_string("/proc/self/status").expect("Linux");
    let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:")).expect("a known name");
    line.trim().trim_end_matches(" kB").parse().expect("a number")
}

fn renderer(room: &ReadyScene, change: impl Fn(&mut Settings)) -> Renderer<'_> {
    let mut settings = Settings {
        techniques: "all".parse().expect("technique names"),
        light_paths: LightPaths::Count(16),
        beams: Some(4),
        ..Settings::default()
    };
    change(&mut settings);
    upbp_testing::comparing_renderer(room, settings)
}

#[test]
fn nothing_grows_with_the_number_of_iterations() {
    if own_process::case().is_none() {
        // Memory of other tests would count.
        print!(
            "{}",
            own_process::run("runs::long_run::nothing_grows_with_the_number_of_iterations", "", &[])
        );
        return;
    }
    let wanted: u64 = std::env::var("UPBP_ITERATIONS").map_or(4000, |text| text.parse().expect("a number"));
    let room = upbp_testing::room(4);
    let mut renderer = renderer(&room, |_| ());
    let start = Instant::now();
    let mut early = 0;
    let mut early_size = 0;
    let size = |state: &State| {
        let mut bytes = Vec::new();
        state.write(&mut bytes).expect("a vector takes all");
        bytes.len()
    };
    renderer.render(&Stop { iterations: Some(wanted), ..Stop::default() }, |now| {
        if now.iterations == (wanted / 4).min(1000) {
            early_size = size(now.state);
            early = resident();
        }
        ControlFlow::Continue(())
    });
    let (late, late_size) = (resident(), size(renderer.state()));
    let report = renderer.report();
    println!(
        "{wanted} iterations in {:.1} s: resident {early} KiB early, {late} KiB at the end; state {early_size} and \
         {late_size} bytes; {} points of error; {} dropped; mean {:?}; last radii {:?}",
        start.elapsed().as_secs_f64(),
        report.series.points().len(),
        report.counters.dropped,
        renderer.film().image().mean(),
        report.last_radii,
    );
    assert!(late < early + 1024, "{early} KiB became {late} KiB");
    assert!(report.series.points().len() < 1700);
    assert_eq!(report.series.points().last().map(|point| point.iterations), Some(wanted));
    assert_eq!(report.iterations, wanted);
    assert_eq!(report.counters.dropped, 0);
    assert!(renderer.film().image().pixels.iter().flatten().all(|v| v.is_finite() && *v > 0.0));
    assert!(renderer.film().variance().pixels.iter().flatten().all(|v| v.is_finite() && *v > 0.0));
}

#[test]
fn the_last_iterations_have_kernels_and_finite_pixels() {
    let room = upbp_testing::room(4);
    for (what, radius) in
        [("auto", Radius::Auto), ("tiny", Radius::Absolute(1e-30)), ("scene", Radius::Scene(1e-12))]
    {
        let mut renderer = renderer(&room, |settings| {
            settings.radii = upbp_core::Radii::all(radius);
        });
        renderer.set_range(MAX_ITERATIONS - 20..u64::MAX);
        while renderer.iterate() {}
        assert_eq!(renderer.film().iterations(), 20, "{what}: the range ends at the last iteration");
        let plan = renderer.iteration_plan(MAX_ITERATIONS - 1);
        let kernels =
            [plan.kernels.surf, plan.kernels.pp3d, plan.kernels.pb2d, plan.kernels.bp2d, plan.kernels.bb1d];
        for kernel in kernels {
            assert!(kernel.radius() > 1e-7 && kernel.radius().is_normal(), "{what}: {kernel:?}");
            assert!(kernel.value(0.0).is_finite() && kernel.effective_volume() > 0.0, "{what}: {kernel:?}");
        }
        assert_eq!(renderer.report().counters.dropped, 0, "{what}");
        assert!(renderer.film().image().pixels.iter().flatten().all(|v| v.is_finite()), "{what}");
    }
}
