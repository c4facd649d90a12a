//! Street lamps in fog over a wet square.

use glam::{DVec3, dvec2, dvec3};

use crate::Bed;
use crate::mesh::{Mesh, Tiling, random, spline, tiles};

/// Height of the paving over the level of the puddles.
fn unevenness(x: f64, z: f64) -> f64 {
    let wave = |kx: f64, kz: f64, phase: f64| (kx * x + kz * z + phase).sin();
    0.006
        + 0.011
            * (wave(0.55, 0.3, 0.0)
                + wave(-0.35, 0.6, 2.0)
                + 0.7 * wave(0.9, -0.75, 4.0)
                + 0.5 * wave(1.7, 1.4, 1.0))
}

/// Setts in two tones.
fn setts() -> Vec<Mesh> {
    let tiling = Tiling {
        origin: dvec3(-11.0, 0.0, -12.0),
        edge_u: DVec3::Z * 21.0,
        edge_v: DVec3::X * 22.0,
        count: [52, 88],
        gap: 0.02,
        height: 0.03,
        bevel: 0.015,
        bond: 0.5,
        tilt: 0.006,
    };
    let mut meshes = tiles(&tiling, 2, |column, row| usize::from(random([column, row, 8]) > 0.55));
    for corner in meshes.iter_mut().flat_map(|mesh| &mut mesh.positions) {
        corner.y += unevenness(corner.x, corner.z) - 0.035;
    }
    meshes
}

/// A cast-iron post with an arm that carries the globe.
fn post() -> Mesh {
    let profile = spline(
        &[
            dvec2(0.14, 0.12),
            dvec2(0.1, 0.3),
            dvec2(0.085, 0.7),
            dvec2(0.1, 0.82),
            dvec2(0.06, 0.9),
            dvec2(0.05, 1.6),
            dvec2(0.04, 3.1),
            dvec2(0.06, 3.16),
            dvec2(0.045, 3.24),
            dvec2(0.12, 3.34),
            dvec2(0.14, 3.38),
        ],
        5,
    );
    let foot = vec![dvec2(0.0, -0.1), dvec2(0.2, -0.1), dvec2(0.2, 0.08)];
    Mesh::revolve(&[foot, profile, vec![dvec2(0.13, 3.4), dvec2(0.0, 3.4)]].concat(), 40)
}

/// The cap over the globe, with a knob.
fn cap() -> Mesh {
    let profile = spline(
        &[
            dvec2(0.235, 0.11),
            dvec2(0.2, 0.19),
            dvec2(0.11, 0.265),
            dvec2(0.03, 0.3),
            dvec2(0.03, 0.33),
            dvec2(0.0, 0.36),
        ],
        5,
    );
    let inside = vec![dvec2(0.0, 0.25), dvec2(0.1, 0.245), dvec2(0.19, 0.17), dvec2(0.225, 0.105)];
    Mesh::revolve(&[inside, profile].concat(), 48)
}

/// A bench: slats on two stands.
fn bench() -> Mesh {
    let slats = (0..4).map(|slat| {
        let z = -0.2 + 0.1 * f64::from(slat);
        Mesh::chamfered(dvec3(-0.9, 0.43, z), dvec3(0.9, 0.465, z + 0.085), 0.005)
    });
    let back = (0..3).map(|slat| {
        let y = 0.55 + 0.11 * f64::from(slat);
        Mesh::chamfered(
            dvec3(-0.9, y, -0.29 - 0.02 * f64::from(slat)),
            dvec3(0.9, y + 0.085, -0.26 - 0.02 * f64::from(slat)),
            0.005,
        )
    });
    let stands = [-0.7, 0.7].into_iter().flat_map(|x| {
        [
            Mesh::chamfered(dvec3(x - 0.03, -0.05, -0.22), dvec3(x + 0.03, 0.43, -0.17), 0.004),
            Mesh::chamfered(dvec3(x - 0.03, -0.05, 0.13), dvec3(x + 0.03, 0.43, 0.18), 0.004),
            Mesh::chamfered(dvec3(x - 0.025, 0.42, -0.345), dvec3(x + 0.025, 0.87, -0.315), 0.004),
        ]
    });
    slats.chain(back).chain(stands).fold(Mesh::default(), Mesh::and)
}

/// The houses on the far sides of the square: walls, and panes of windows that are lit.
fn houses() -> [Mesh; 2] {
    let mut walls = Mesh::default();
    let mut panes = Mesh::default();
    for house in 0..14 {
        let [width, height, depth] = [0, 1, 2].map(|part| random([house, 60, part]));
        let x = -70.0 + 10.0 * f64::from(house);
        let (z, height) = (-48.0 - 6.0 * depth, 10.0 + 6.0 * height);
        walls = walls.and(Mesh::chamfered(dvec3(x, -0.5, z - 10.0), dvec3(x + 9.0 + width, height, z), 0.05));
        for (column, floor) in (0..4).flat_map(|column| (0..3).map(move |floor| (column, floor))) {
            if random([house, column, 80 + floor]) < 0.22 {
                let corner = dvec3(x + 1.2 + 2.1 * f64::from(column), 1.6 + 3.1 * f64::from(floor), z + 0.02);
                panes = panes.and(Mesh::sheet([1, 1], |u, v| corner + dvec3(1.1 * u, 1.7 * v, 0.0)));
            }
        }
    }
    [walls, panes]
}

pub(crate) fn bed() -> Bed {
    let [walls, panes] = houses();
    let mut meshes = vec![
        ("post", post(), 60.0),
        ("cap", cap(), 50.0),
        ("bench", bench(), 0.0),
        ("houses", walls, 0.0),
        ("panes", panes, 0.0),
    ];
    meshes
        .extend(["setts_grey", "setts_dark"].into_iter().zip(setts()).map(|(name, mesh)| (name, mesh, 50.0)));
    Bed { name: "street_lamp", scene: include_str!("../scenes/beds/street_lamp.ron"), meshes }
}
