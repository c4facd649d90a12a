//! A glass of milk on a table outdoors, in haze.

use glam::{DVec3, dvec2, dvec3};

use crate::Bed;
use crate::mesh::{Mesh, random, spline};
use crate::vessel::Vessel;

/// A table top of planks, in two tones.
pub(crate) fn planks(min: DVec3, max: DVec3, count: u32) -> [Mesh; 2] {
    let width = (max.z - min.z) / f64::from(count);
    let mut tones = [Mesh::default(), Mesh::default()];
    for plank in 0..count {
        let z = min.z + f64::from(plank) * width;
        let own = &mut tones[(random([plank, 7, 0]) * 2.0) as usize];
        let piece = Mesh::chamfered(
            dvec3(min.x - 0.01 * random([plank, 1, 0]), min.y, z + 0.0006),
            dvec3(
                max.x + 0.01 * random([plank, 2, 0]),
                max.y - 0.0006 * random([plank, 3, 0]),
                z + width - 0.0006,
            ),
            0.0025,
        );
        *own = std::mem::take(own).and(piece);
    }
    tones
}

/// A crown of leaves or a stone: a lumpy ball.
pub(crate) fn lump(radius: DVec3, seed: u32, roughness: f64) -> Mesh {
    let wave = |point: DVec3, index: u32| {
        let [x, y, z, phase] = [0, 1, 2, 3].map(|part| random([seed, index, part]) - 0.5);
        let frequency = 1.5 + 1.1 * f64::from(index);
        (12.0 * frequency * dvec3(x, y, z).dot(point) + 20.0 * phase).sin() / frequency
    };
    let rings: Vec<_> = (0..=32)
        .map(|ring| {
            let angle = std::f64::consts::PI * f64::from(ring) / 32.0;
            dvec2(if ring % 32 == 0 { 0.0 } else { angle.sin() }, -angle.cos())
        })
        .collect();
    let mut mesh = Mesh::revolve(&rings, 64);
    for corner in &mut mesh.positions {
        let lumps: f64 = (0..7).map(|index| wave(*corner, index)).sum();
        *corner *= radius * (1.0 + roughness * lumps);
    }
    mesh
}

pub(crate) fn bed() -> Bed {
    let glass = Vessel::tumbler(0.029, 0.037, 0.125, 0.0022, 0.008);
    let bottle = Vessel::bottle(0.045, 0.235, 0.019, 0.0028);
    let [pale, dark] = planks(dvec3(-0.75, 0.72, -0.42), dvec3(0.75, 0.75, 0.42), 7);
    let plate = [
        [0.0, 0.0],
        [0.05, 0.0],
        [0.055, 0.004],
        [0.1, 0.014],
        [0.101, 0.0155],
        [0.1, 0.017],
        [0.056, 0.008],
        [0.048, 0.006],
        [0.0, 0.006],
    ];
    let biscuit = spline(
        &[
            dvec2(0.0, 0.0),
            dvec2(0.03, 0.0),
            dvec2(0.033, 0.004),
            dvec2(0.029, 0.009),
            dvec2(0.015, 0.0115),
            dvec2(0.0, 0.012),
        ],
        5,
    );
    let biscuits = [[0.0, 0.006, 0.012], [-0.03, 0.012, -0.025], [0.028, 0.0135, -0.02]];
    let biscuits = biscuits
        .into_iter()
        .fold(Mesh::default(), |all, at| all.and(Mesh::revolve(&biscuit, 48).moved(at.into())));
    let trees = (0..26).fold(Mesh::default(), |all, tree| {
        let [x, z, size] = [0, 1, 2].map(|part| random([tree, 40, part]));
        let radius = dvec3(1.8 + size, 1.6 + 1.8 * size, 1.8 + size);
        let place = dvec3(-26.0 + 2.1 * f64::from(tree), radius.y * 0.85, -34.0 - 24.0 * z + 3.0 * x);
        all.and(lump(radius, tree, 0.13).moved(place))
    });
    Bed {
        name: "milk",
        scene: include_str!("../scenes/beds/milk.ron"),
        meshes: vec![
            ("glass", glass.wall(), 50.0),
            ("milk", glass.filling(0.096, 0.0008), 50.0),
            ("bottle", bottle.wall(), 50.0),
            ("bottled_milk", bottle.filling(0.105, 0.001), 50.0),
            ("pale_planks", pale, 0.0),
            ("dark_planks", dark, 0.0),
            ("plate", Mesh::revolve(&plate.map(Into::into), 96), 40.0),
            ("biscuits", biscuits, 60.0),
            ("trees", trees, 80.0),
        ],
    }
}
