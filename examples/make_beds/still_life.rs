//! A still life by a window: juice, milk, oil, a candle, soap.

use glam::{DVec2, dvec2, dvec3};

use crate::Bed;
use crate::mesh::{Mesh, random, spline};
use crate::milk::{lump, planks};
use crate::vessel::Vessel;

/// A candle: the body of wax with a dip where it has burnt, the wick, and the flame.
fn candle() -> [Mesh; 3] {
    let profile = [
        vec![dvec2(0.0, 0.0), dvec2(0.029, 0.0), dvec2(0.0305, 0.0015)],
        spline(
            &[
                dvec2(0.0305, 0.09),
                dvec2(0.03, 0.0945),
                dvec2(0.0275, 0.096),
                dvec2(0.022, 0.092),
                dvec2(0.012, 0.0885),
                dvec2(0.0, 0.088),
            ],
            6,
        ),
    ]
    .concat();
    let mut wax = Mesh::revolve(&profile, 96);
    for corner in &mut wax.positions {
        // The rim has melted lower on one side.
        corner.y -= 0.12 * (corner.y - 0.06).max(0.0) * (1.0 + corner.x / 0.03);
    }
    let wick =
        Mesh::tube(&[dvec3(0.0, 0.08, 0.0), dvec3(0.0002, 0.09, 0.0), dvec3(0.001, 0.0985, 0.0)], 0.0009, 10);
    let flame = spline(
        &[dvec2(0.0, 0.0), dvec2(0.0042, 0.004), dvec2(0.0052, 0.01), dvec2(0.0032, 0.02), dvec2(0.0, 0.031)],
        8,
    );
    [wax, wick, Mesh::revolve(&flame, 32)]
}

/// A bar of soap: a superellipsoid.
fn soap() -> Mesh {
    let power = |x: f64, exponent: f64| x.abs().powf(exponent).copysign(x);
    let rings: Vec<DVec2> = (0..=40)
        .map(|ring| {
            let angle = std::f64::consts::PI * f64::from(ring) / 40.0;
            dvec2(if ring % 40 == 0 { 0.0 } else { angle.sin() }, -angle.cos())
        })
        .collect();
    let mut bar = Mesh::revolve(&rings, 96);
    for corner in &mut bar.positions {
        let ring = corner.x.hypot(corner.z);
        let (cos, sin) = if ring > 0.0 { (corner.x / ring, corner.z / ring) } else { (0.0, 0.0) };
        let wide = power(ring, 0.45);
        *corner = dvec3(
            0.042 * wide * power(cos, 0.55),
            0.013 * power(corner.y, 0.6),
            0.028 * wide * power(sin, 0.55),
        );
    }
    bar
}

pub(crate) fn bed() -> Bed {
    let tumbler = Vessel::tumbler(0.028, 0.035, 0.115, 0.0022, 0.008);
    let goblet = Vessel::goblet(0.17);
    let bottle = Vessel::bottle(0.034, 0.24, 0.013, 0.0026);
    let [pale, dark] = planks(dvec3(-1.0, 0.71, -0.55), dvec3(1.0, 0.75, 0.55), 8);
    let [wax, wick, flame] = candle();
    let saucer = [
        [0.0, 0.0],
        [0.028, 0.0],
        [0.03, 0.003],
        [0.054, 0.011],
        [0.055, 0.0125],
        [0.054, 0.0135],
        [0.03, 0.006],
        [0.0, 0.005],
    ];
    let lemon = |seed: u32| {
        let outline = spline(
            &[
                dvec2(0.0, -0.041),
                dvec2(0.006, -0.0385),
                dvec2(0.017, -0.028),
                dvec2(0.0265, 0.0),
                dvec2(0.019, 0.026),
                dvec2(0.008, 0.036),
                dvec2(0.005, 0.041),
                dvec2(0.0, 0.0425),
            ],
            8,
        );
        let mut lemon = Mesh::revolve(&outline, 64);
        for (index, corner) in (0..).zip(&mut lemon.positions) {
            *corner *= 1.0 + 0.006 * random([index, seed, 0]);
        }
        lemon
    };
    let cloth = Mesh::block(dvec3(-0.2, 0.0, -0.13), dvec3(0.2, 0.0015, 0.13), [80, 52], |x, z| {
        0.003 * (1.0 + (24.0 * x + 9.0 * z).sin() * (19.0 * z - 6.0 * x + 1.0).sin())
    });
    let pears = lump(dvec3(0.036, 0.034, 0.036), 4, 0.012);
    Bed {
        name: "still_life",
        scene: include_str!("../scenes/beds/still_life.ron"),
        meshes: vec![
            ("tumbler", tumbler.wall(), 50.0),
            ("juice", tumbler.filling(0.08, 0.0008), 50.0),
            ("goblet", goblet.wall(), 50.0),
            ("milk", goblet.filling(0.125, 0.0006), 50.0),
            ("bottle", bottle.wall(), 50.0),
            ("oil", bottle.filling(0.1, 0.0008), 50.0),
            ("wax", wax, 60.0),
            ("wick", wick, 60.0),
            ("flame", flame, 60.0),
            ("saucer", Mesh::revolve(&saucer.map(Into::into), 96), 40.0),
            ("soap", soap(), 60.0),
            ("lemon", lemon(1), 70.0),
            ("apple", pears, 70.0),
            ("cloth", cloth, 50.0),
            ("pale_planks", pale, 0.0),
            ("dark_planks", dark, 0.0),
        ],
    }
}
