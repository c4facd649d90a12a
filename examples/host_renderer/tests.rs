//! The foreign scene of this example: every way to compute its picture gives the same picture.

use upbp_core::{Image, Radii, Radius, Renderer, Settings};
use upbp_testing::{Estimate, render, render_by};

use crate::scene;

fn settings(techniques: &str) -> Settings {
    let radius = Radius::Absolute(0.01);
    Settings {
        techniques: techniques.parse().expect("technique names"),
        radii: Radii::all(radius),
        progressive: false,
        min_length: 2,
        light_paths: upbp_core::LightPaths::Count(2000),
        beams: Some(100),
        ..Settings::default()
    }
}

fn render_room(room: &scene::Room, settings: &Settings, iterations: u64) -> (Estimate, Image) {
    let checked = settings.clone().validate().expect("valid settings");
    render_by(Renderer::new(room, checked).expect("a renderer"), iterations)
}

#[test]
fn all_subsets_agree() {
    let room = scene::Room::new(24).expect("valid coefficients");
    let (reference, _) = render_room(&room, &settings("pt"), 150);
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
        let (estimate, _) = render_room(&room, &settings(techniques), 40);
        let sigmas = estimate.sigmas(&reference);
        let error = estimate.error.hypot(reference.error);
        // Few walks meet the lamp by chance.
        let noise = if techniques == "hit" { 0.06 } else { 0.02 };
        assert!(error < noise * reference.mean, "{techniques}: too noisy to tell, {estimate:?}");
        println!("{techniques:12} {:.5} ± {:.5}  {sigmas:+.2} sigma", estimate.mean, estimate.error);
        worst = worst.max(sigmas.abs());
    }
    assert!(worst < 4.0, "worst: {worst:.2} sigma");
}

#[test]
fn the_ready_made_scene_looks_the_same() {
    let room = scene::Room::new(24).expect("valid coefficients");
    let ready_made = upbp_testing::room(24);
    for techniques in ["bpt", "bpt+surf+pp3d+pb2d+bb1d"] {
        let (theirs, their_image) = render_room(&room, &settings(techniques), 60);
        let (ours, our_image) = render(&ready_made, &settings(techniques), 60);
        let sigmas = theirs.sigmas(&ours);
        let difference = their_image.relative_mse(&our_image);
        println!(
            "{techniques}: {theirs:?} {ours:?} {sigmas:+.2} sigma, relMSE between them {difference:.2e}"
        );
        assert!(sigmas.abs() < 4.0, "{techniques}: {theirs:?} against {ours:?}");
        let error = theirs.error.hypot(ours.error);
        assert!(error < 0.02 * ours.mean, "{techniques}: too noisy to tell, {theirs:?} against {ours:?}");
        // Two independent images with a relMSE of about 3e-3 each: a shifted or mirrored one is far beyond.
        assert!(difference < 2e-2, "{techniques}: {difference}");
    }
}
