//! Every reference scene, by bidirectional path tracing, by the whole mixture and by what the program
//! chooses, against an image of an independent renderer: short renders, errors in standard deviations.
//! `examples/validate` does the same with more time and all techniques.

use upbp_core::Settings;
use upbp_scene::ReadyScene;
use upbp_testing::reference::{Comparison, Reference, Spread};
use upbp_testing::shipped::Shipped;
use upbp_testing::short_renderer;

/// Iterations of each render: enough for the spread to be known.
const ITERATIONS: u64 = 28;

/// Standard errors that the mean of an image may be off. Of 30 renders with independent errors one is beyond
/// with a probability of 0.1 %.
const MEAN: f64 = 4.0;

/// Standard errors that one of some 100 tiles of 3 channels may be off in 30 renders. The spread of 28
/// iterations with a skew distribution has heavier tails than a normal one.
const TILE: f64 = 6.0;

fn check(scene_name: &str) {
    let shipped = Shipped::find(scene_name).expect("a shipped scene");
    let scene = ReadyScene::load(shipped.scene()).expect("a valid scene");
    let reference = Reference::read(&shipped.reference()).expect("an image with standard errors");
    let mut failures = Vec::new();
    for techniques in ["bpt", "bpt+surf+pp3d+pb2d+bb1d", "auto"] {
        let techniques_named = techniques.parse().expect("technique names");
        let settings = Settings { techniques: techniques_named, ..Settings::default() };
        let mut renderer = short_renderer(&scene, settings, ITERATIONS);
        let mut spread = Spread::default();
        for _ in 0..ITERATIONS {
            assert!(renderer.iterate());
            spread.add(renderer.film());
        }
        let result = Comparison::new(renderer.film(), &spread, &reference);
        let [r, g, b] = result.sigmas;
        println!(
            "{scene_name:18} {techniques:24} mean {r:+.2} {g:+.2} {b:+.2} sigma ({:.2} %), tiles {:.2}, relMSE {:.1e} \
             (floor {:.1e})",
            result.worst_percent(),
            result.tile,
            result.relative_mse,
            reference.floor().relative_mse,
        );
        if result.worst_sigmas() > MEAN || result.tile > TILE {
            failures.push(techniques);
        }
    }
    assert!(failures.is_empty(), "{scene_name}: {failures:?} differ from the reference");
}

#[test]
fn absorb_only() {
    check("absorb_only");
}

#[test]
fn chromatic_sphere() {
    check("chromatic_sphere");
}

#[test]
fn emission_grey() {
    check("emission_grey");
}

#[test]
fn fog_cornell() {
    check("fog_cornell");
}

#[test]
fn fog_two_spheres() {
    check("fog_two_spheres");
}

#[test]
fn forward_hg_box() {
    check("forward_hg_box");
}

#[test]
fn glass_env() {
    check("glass_env");
}

#[test]
fn high_albedo_cube() {
    check("high_albedo_cube");
}

#[test]
fn mirror_fog() {
    check("mirror_fog");
}

#[test]
fn point_bubble_fog() {
    check("point_bubble_fog");
}
