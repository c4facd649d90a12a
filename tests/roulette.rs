//! Where sub-paths end changes what an image costs and how noisy it is, and not what it shows.

use std::ops::ControlFlow;
use std::path::Path;

use glam::DVec3;
use upbp_core::{Renderer, Roulette, Settings, Stop, Techniques};
use upbp_scene::ReadyScene;

/// Mean of the picture, three iterations, over seeds, and its squared standard error.
fn mean(scene: &ReadyScene, settings: &Settings, seeds: std::ops::Range<u64>) -> (DVec3, DVec3) {
    let n = (seeds.end - seeds.start) as f64;
    let means: Vec<DVec3> = seeds
        .map(|seed| {
            let settings = Settings { seed, ..settings.clone() }.validate().expect("valid settings");
            let mut renderer = Renderer::new(scene, settings).expect("a scene that can be rendered");
            renderer.render(&Stop { iterations: Some(3), ..Stop::default() }, |_| ControlFlow::Continue(()));
            let pixels = renderer.film().image().pixels;
            let sum: DVec3 = pixels.iter().map(|p| DVec3::from(p.map(f64::from))).sum();
            sum / pixels.len() as f64
        })
        .collect();
    let mean = means.iter().sum::<DVec3>() / n;
    let squares = means.iter().map(|m| (*m - mean).powf(2.0)).sum::<DVec3>();
    (mean, squares / (n * (n - 1.0)))
}

/// 16 seeds each: walks by the albedo at every vertex against walks that are spared, and that never end.
#[test]
fn means_do_not_depend_on_the_roulette() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let scene =
        ReadyScene::load(root.join("examples/scenes/reference/fog_cornell.ron")).expect("a valid scene");
    for techniques in ["pt", "bpt+surf+pb2d"] {
        let settings = Settings {
            techniques: techniques.parse::<Techniques>().expect("techniques"),
            max_length: 10,
            ..Settings::default()
        };
        let of = |roulette, first| {
            mean(&scene, &Settings { roulette: Some(roulette), ..settings.clone() }, first..first + 16)
        };
        let (expected, variance) = of(Roulette::Below(1.0), 0);
        for (index, roulette) in
            [Roulette::Below(0.5), Roulette::Below(0.05), Roulette::Off].into_iter().enumerate()
        {
            let (found, own) = of(roulette, 100 * (index as u64 + 1));
            let sigmas = (found - expected) / (variance + own).map(f64::sqrt);
            println!("{techniques}, {roulette:?}: {found:.5}, expected {expected:.5}, {sigmas:.2} sigma");
            assert!(sigmas.abs().cmple(DVec3::splat(4.0)).all(), "{roulette:?}: {found}, {expected}");
        }
    }
}
