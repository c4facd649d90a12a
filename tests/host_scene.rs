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
    }
    assert!(worst < 4.0, "worst: {worst:.2} sigma");
}

/// The same room as a scene file: other geometry code, other materials, lights and camera.
const READY_MADE: &str = r#"(
  version: 1,
  camera: Perspective(origin: (0, 0, 0.95), target: (0, 0, 0), fov_degrees: 77.319616508),
  film: (width: 24, height: 24),
  outside: "haze",
  media: {
    "haze": Homogeneous(sigma_a: 0.05, sigma_s: 0.25, phase: HenyeyGreenstein(0.3)),
    "milk": Homogeneous(sigma_a: (0.05, 0.1, 0.2), sigma_s: 8, phase: HenyeyGreenstein(0.5)),
  },
  materials: {
    "white": Lambert(0.7),
    "red": Lambert((0.6, 0.1, 0.1)),
    "green": Lambert((0.1, 0.5, 0.1)),
    "black": Lambert(0),
    "boundary": Null,
  },
  shapes: [
    (name: "left", material: "red", geometry: Quad(origin: (-1, -1, -1), edge_u: (0, 2, 0), edge_v: (0, 0, 2))),
    (name: "right", material: "green", geometry: Quad(origin: (1, -1, -1), edge_u: (0, 0, 2), edge_v: (0, 2, 0))),
    (name: "floor", material: "white", geometry: Quad(origin: (-1, -1, -1), edge_u: (0, 0, 2), edge_v: (2, 0, 0))),
    (name: "ceiling", material: "white", geometry: Quad(origin: (-1, 1, -1), edge_u: (2, 0, 0), edge_v: (0, 0, 2))),
    (name: "back", material: "white", geometry: Quad(origin: (-1, -1, -1), edge_u: (2, 0, 0), edge_v: (0, 2, 0))),
    (name: "front", material: "white", geometry: Quad(origin: (-1, -1, 1), edge_u: (0, 2, 0), edge_v: (2, 0, 0))),
    (name: "milk", material: "boundary", interior: "milk", geometry: Sphere(centre: (-0.35, -0.5, -0.2), radius: 0.4)),
    (name: "lamp", material: "black", emission: (14, 12, 9), geometry: Sphere(centre: (0.45, 0.5, -0.3), radius: 0.12)),
  ],
)"#;

#[test]
fn the_ready_made_scene_looks_the_same() {
    let room = scene::Room::new(24).expect("valid coefficients");
    let ready_made = upbp_scene::ReadyScene::from_ron_str(READY_MADE, "").expect("a valid scene");
    for techniques in ["bpt", "bpt+surf+pp3d+pb2d+bb1d"] {
        let (theirs, their_image) = render(&room, &settings(techniques), 150);
        let (ours, our_image) = render(&ready_made, &settings(techniques), 150);
        let sigmas = theirs.sigmas(&ours);
        let difference = their_image.relative_mse(&our_image);
        println!(
            "{techniques}: {theirs:?} {ours:?} {sigmas:+.2} sigma, relMSE between them {difference:.2e}"
        );
        assert!(sigmas.abs() < 4.0, "{techniques}: {theirs:?} against {ours:?}");
        // Two independent images with a relMSE of about 3e-3 each: a shifted or mirrored one is far beyond.
        assert!(difference < 2e-2, "{techniques}: {difference}");
    }
}
