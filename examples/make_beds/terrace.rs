//! A terrace in the sun: glasses on a table, and a pool.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, dvec2, dvec3};

use crate::Bed;
use crate::mesh::{Mesh, Tiling, random, tiles};
use crate::milk::lump;
use crate::vessel::Vessel;

/// The pool: two opposite corners of its inside, from the floor to the top of the coping.
const POOL: [DVec3; 2] = [dvec3(-4.4, -1.3, -6.4), dvec3(1.4, 0.0, -0.9)];

/// Height of the water over its level: sixteen waves, 0.3 to 1.5 m long, that go in all directions.
fn waves(x: f64, z: f64) -> f64 {
    (0..16)
        .map(|wave| {
            let [angle, phase] = [0, 1].map(|part| TAU * random([wave, 99, part]));
            let length = 0.3 * 5.0_f64.powf(f64::from(wave) / 15.0);
            0.0028 * length.sqrt() * (TAU / length * (x * angle.cos() + z * angle.sin()) + phase).sin()
        })
        .sum()
}

/// Floor and walls of the pool in three blues.
fn mosaic() -> Vec<Mesh> {
    let [low, high] = POOL;
    let size = high - low;
    let (x, y, z) = (DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z);
    let side = |origin, edge_u: DVec3, edge_v: DVec3| Tiling {
        origin,
        edge_u,
        edge_v,
        count: [(edge_u.length() / 0.145) as u32, (edge_v.length() / 0.145) as u32],
        gap: 0.008,
        height: 0.006,
        bevel: 0.002,
        bond: 0.0,
        tilt: 0.0,
    };
    let sides = [
        side(low, z, x),
        side(low, x, y),
        side(low + x, z, y),
        side(low + x + z, -x, y),
        side(low + z, -z, y),
    ];
    let mut meshes = vec![Mesh::default(); 3];
    for (number, tiling) in (0..).zip(&sides) {
        let kind = |column, row| (random([column, row, 500 + number]).powf(0.8) * 3.0) as usize;
        for (own, mesh) in meshes.iter_mut().zip(tiles(tiling, 3, kind)) {
            *own = std::mem::take(own).and(mesh);
        }
    }
    meshes
}

/// Slabs of stone around the pool, in two tones.
fn paving() -> Vec<Mesh> {
    let [low, high] = POOL;
    let mut meshes = vec![Mesh::default(); 2];
    let areas = [
        [-7.0, high.z, 5.0, 3.5],
        [-7.0, low.z, low.x, high.z],
        [high.x, low.z, 5.0, high.z],
        [-7.0, -8.6, 5.0, low.z],
    ];
    for (number, [x0, z0, x1, z1]) in (0..).zip(areas) {
        let tiling = Tiling {
            origin: dvec3(x0, -0.03, z0),
            edge_u: DVec3::Z * (z1 - z0),
            edge_v: DVec3::X * (x1 - x0),
            count: [((z1 - z0) / 0.55_f64).round() as u32, ((x1 - x0) / 0.55_f64).round() as u32],
            gap: 0.008,
            height: 0.03,
            bevel: 0.006,
            bond: 0.0,
            tilt: 0.0015,
        };
        for (own, mesh) in
            meshes.iter_mut().zip(tiles(&tiling, 2, |a, b| usize::from(random([a, b, 70 + number]) > 0.6)))
        {
            *own = std::mem::take(own).and(mesh);
        }
    }
    meshes
}

/// One colour of a ball of six gores.
fn gores(radius: f64, parity: u32) -> Mesh {
    (0..3).fold(Mesh::default(), |all, gore| {
        let start = f64::from(2 * gore + parity) * PI / 3.0;
        all.and(Mesh::sheet([12, 32], |u, v| {
            let (longitude, latitude) = (start + u * PI / 3.0, PI * (0.5 - v));
            let ring = latitude.cos();
            radius * dvec3(-ring * longitude.cos(), latitude.sin(), ring * longitude.sin())
        }))
    })
}

/// A ladder over the edge of the pool: two rails and three steps.
fn ladder() -> Mesh {
    let rail = |z: f64| {
        let bend = |step: u32| {
            let angle = PI * f64::from(step) / 20.0;
            dvec3(0.22 * angle.cos(), 0.62 + 0.22 * angle.sin(), z)
        };
        let path: Vec<DVec3> = [dvec3(0.22, -0.02, z)]
            .into_iter()
            .chain((0..=20).map(bend))
            .chain([dvec3(-0.22, -1.0, z)])
            .collect();
        Mesh::tube(&path, 0.02, 20)
    };
    let steps = [-0.25, -0.55, -0.85]
        .map(|y| Mesh::chamfered(dvec3(-0.26, y, -0.22), dvec3(-0.18, y + 0.03, 0.22), 0.004));
    steps.into_iter().fold(rail(-0.22).and(rail(0.22)), Mesh::and)
}

/// A round table on one leg.
fn table() -> Mesh {
    let profile = [
        [0.0, 0.0],
        [0.2, 0.0],
        [0.2, 0.012],
        [0.03, 0.03],
        [0.022, 0.06],
        [0.022, 0.69],
        [0.05, 0.698],
        [0.335, 0.698],
        [0.34, 0.703],
        [0.34, 0.715],
        [0.335, 0.72],
        [0.0, 0.72],
    ];
    Mesh::revolve(&profile.map(Into::into), 128)
}

pub(crate) fn bed() -> Bed {
    let [low, high] = POOL;
    let reach = dvec3(0.05, 0.0, 0.05);
    let water =
        Mesh::block(low - reach - 0.05 * DVec3::Y, dvec3(high.x, -0.1, high.z) + reach, [177, 168], waves);
    let goblet = Vessel::goblet(0.19);
    let tumbler = Vessel::tumbler(0.03, 0.036, 0.1, 0.0025, 0.01);
    let carafe = Vessel::bottle(0.055, 0.27, 0.024, 0.003);
    let pot = [
        [0.0, 0.0],
        [0.2, 0.0],
        [0.28, 0.42],
        [0.3, 0.43],
        [0.3, 0.5],
        [0.27, 0.5],
        [0.25, 0.45],
        [0.0, 0.45],
    ];
    let cypresses = (0..7).fold(Mesh::default(), |all, tree| {
        let size = 1.0 + 0.5 * random([tree, 3, 3]);
        let place = dvec3(
            -16.0 + 5.0 * f64::from(tree) + 2.0 * random([tree, 4, 4]),
            1.7 * size,
            -17.0 - 3.0 * random([tree, 5, 5]),
        );
        all.and(lump(dvec3(0.75, 3.4, 0.75) * size, tree, 0.09).moved(place))
    });
    let hill = Mesh::sheet([24, 96], |u, v| {
        let x = 400.0 * (v - 0.5);
        let crest = 15.0 + 7.0 * (x * 0.021).sin() + 3.0 * (x * 0.06 + 1.0).sin();
        dvec3(x, crest * (u * PI).sin() - 1.0, -90.0 - 60.0 * (1.0 - u))
    });
    let mut meshes = vec![
        ("water", water, 60.0),
        ("ladder", ladder(), 60.0),
        ("table", table(), 40.0),
        ("goblet", goblet.wall(), 50.0),
        ("wine", goblet.filling(0.127, 0.0006), 50.0),
        ("tumbler", tumbler.wall(), 50.0),
        ("juice", tumbler.filling(0.07, 0.0008), 50.0),
        ("carafe", carafe.wall(), 50.0),
        ("carafe_water", carafe.filling(0.115, 0.001), 50.0),
        ("red_gores", gores(0.24, 0), 180.0),
        ("white_gores", gores(0.24, 1), 180.0),
        ("pot", Mesh::revolve(&pot.map(|[r, y]| dvec2(r, y)), 64), 40.0),
        ("bush", lump(dvec3(0.42, 0.42, 0.42), 9, 0.12), 70.0),
        ("cypresses", cypresses, 80.0),
        ("hill", hill, 60.0),
    ];
    meshes.extend(
        ["mosaic_pale", "mosaic_blue", "mosaic_deep"]
            .into_iter()
            .zip(mosaic())
            .map(|(name, mesh)| (name, mesh, 0.0)),
    );
    meshes
        .extend(["slabs_pale", "slabs_warm"].into_iter().zip(paving()).map(|(name, mesh)| (name, mesh, 0.0)));
    Bed { name: "terrace", scene: include_str!("../scenes/beds/terrace.ron"), meshes }
}
