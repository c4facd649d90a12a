//! The foreign scene of `examples/host_renderer`: every way to compute its picture gives the same picture.

mod support;

#[path = "../examples/host_renderer/scene.rs"]
mod scene;

use support::{Estimate, render};
use upbp_core::{Radii, Radius, Settings};

fn settings(techniques: &str) -> Settings {
    let radius = Radius::Absolute(0.01);
    Settings {
        techniques: techniques.parse().expect("technique names"),
        radii: Radii { surf: radius, pp3d: radius, pb2d: radius, bp2d: radius, bb1d: radius },
        progressive: false,
        min_length: 2,
        light_paths: upbp_core::LightPaths::Count(2000),
        beams: Some(100),
        ..Settings::default()
    }
}

#[test]
fn all_subsets_agree() {
    let room = scene::Room::new(24).expect("valid coefficients");
    let (reference, _) = render(&room, &settings("pt"), 400);
    let mut worst = 0.0_f64;
    for techniques in [
        "hit+nee",
        "hit",
        "hit+nee+lt",
        "bpt",
        "bpt+surf",
        "bpt+pp3d",
        "bpt+pb2d",
        "bpt+bp2d",
        "bpt+bb1d",
        "all",
    ] {
        let (estimate, _): (Estimate, _) = render(&room, &settings(techniques), 100);
        let sigmas = estimate.sigmas(&reference);
        println!("{techniques:12} {:.5} ± {:.5}  {sigmas:+.2} sigma", estimate.mean, estimate.error);
        worst = worst.max(sigmas.abs());
    }    assert!(worst < 4.0, "worst: {worst:.2} sigma");
}
