//! A bathroom: a hundred thousand triangles, most of them tiles.

use std::f64::consts::PI;

use glam::{DVec3, dvec2, dvec3};

use crate::Bed;
use crate::mesh::{Mesh, Tiling, spline, tiles};
use crate::milk::lump;
use crate::vessel::Vessel;

/// The room, from corner to corner.
const ROOM: DVec3 = dvec3(3.2, 2.5, 3.6);

/// Wall tiles: those below the border, and above it.
fn walls() -> Vec<Mesh> {
    let (x, y, z) = (DVec3::X * ROOM.x, DVec3::Y * ROOM.y, DVec3::Z * ROOM.z);
    let corner = dvec3(-0.5 * ROOM.x, 0.0, -0.5 * ROOM.z);
    let mut meshes = vec![Mesh::default(); 2];
    for (origin, edge_u) in [(corner, x), (corner + x, z), (corner + z, -z)] {
        let tiling = Tiling {
            origin,
            edge_u,
            edge_v: y,
            count: [(edge_u.length() / 0.1).round() as u32, 42],
            gap: 0.003,
            height: 0.008,
            bevel: 0.003,
            bond: 0.5,
            tilt: 0.0006,
        };
        for (own, mesh) in meshes.iter_mut().zip(tiles(&tiling, 2, |_, row| usize::from(row >= 22))) {
            *own = std::mem::take(own).and(mesh);
        }
    }
    meshes
}

/// The floor, a chequer of small tiles.
fn floor() -> Vec<Mesh> {
    let tiling = Tiling {
        origin: dvec3(-0.5 * ROOM.x, 0.0, -0.5 * ROOM.z),
        edge_u: DVec3::Z * ROOM.z,
        edge_v: DVec3::X * ROOM.x,
        count: [24, 21],
        gap: 0.003,
        height: 0.008,
        bevel: 0.002,
        bond: 0.0,
        tilt: 0.0004,
    };
    tiles(&tiling, 2, |column, row| ((column + row) % 2) as usize)
}

/// A wash basin: a thick shell, turned and stretched.
fn basin() -> Mesh {
    let outside = spline(&[dvec2(0.1, 0.0), dvec2(0.2, 0.03), dvec2(0.265, 0.1), dvec2(0.28, 0.15)], 8);
    let rim = [dvec2(0.279, 0.156), dvec2(0.27, 0.16), dvec2(0.262, 0.157)];
    let inside = spline(&[dvec2(0.256, 0.15), dvec2(0.235, 0.09), dvec2(0.16, 0.04), dvec2(0.03, 0.025)], 8);
    let profile =
        [vec![dvec2(0.0, 0.0)], outside, rim.to_vec(), inside, vec![dvec2(0.028, 0.018), dvec2(0.0, 0.018)]]
            .concat();
    let mut basin = Mesh::revolve(&profile, 128);
    basin.positions.iter_mut().for_each(|corner| corner.z *= 0.75);
    basin
}

/// A tap: a foot, a bent spout, a lever.
fn tap() -> Mesh {
    let foot = [
        [0.0, 0.0],
        [0.026, 0.0],
        [0.026, 0.008],
        [0.019, 0.014],
        [0.018, 0.12],
        [0.014, 0.125],
        [0.0, 0.126],
    ];
    let bend = |step: u32| {
        let angle = PI * f64::from(step) / 24.0;
        dvec3(0.0, 0.2 + 0.07 * angle.sin(), 0.07 - 0.07 * angle.cos())
    };
    let path: Vec<DVec3> = [dvec3(0.0, 0.1, 0.0)]
        .into_iter()
        .chain((0..=24).map(bend))
        .chain([dvec3(0.0, 0.17, 0.14)])
        .collect();
    let lever =
        Mesh::tube(&[dvec3(0.0, 0.1, 0.0), dvec3(0.04, 0.105, 0.0), dvec3(0.075, 0.12, 0.0)], 0.006, 16);
    Mesh::revolve(&foot.map(Into::into), 48).and(Mesh::tube(&path, 0.011, 32)).and(lever)
}

/// The shower: a pipe along the wall with a rose at its end.
fn shower() -> Mesh {
    let pipe = Mesh::tube(
        &[
            dvec3(0.0, 1.0, 0.0),
            dvec3(0.0, 1.9, 0.0),
            dvec3(0.0, 2.08, 0.03),
            dvec3(0.0, 2.15, 0.12),
            dvec3(0.0, 2.16, 0.3),
            dvec3(0.0, 2.1, 0.36),
            dvec3(0.0, 2.05, 0.36),
        ],
        0.011,
        32,
    );
    let rose = [[0.0, 0.0], [0.1, 0.0], [0.104, 0.006], [0.1, 0.014], [0.03, 0.03], [0.0, 0.032]];
    pipe.and(Mesh::revolve(&rose.map(Into::into), 64).moved(dvec3(0.0, 2.03, 0.36)))
}

/// A towel over a rail: a folded sheet with some thickness.
fn towel() -> Mesh {
    Mesh::sheet([40, 60], |u, v| {
        let (x, fall) = (0.5 * (u - 0.5), 1.1 * (v - 0.5));
        let over = 0.02;
        let wave = 0.006 * (u * 19.0).sin() * (fall.abs() * 3.0).min(1.0);
        let side = (fall / over).clamp(-1.0, 1.0);
        dvec3(
            x,
            -(fall.abs() - over).max(0.0) + over * (1.0 - side * side).max(0.0).sqrt(),
            side * over + wave,
        )
    })
}

pub(crate) fn bed() -> Bed {
    let bottle = Vessel::bottle(0.035, 0.2, 0.012, 0.0025);
    let tumbler = Vessel::tumbler(0.03, 0.036, 0.1, 0.0025, 0.01);
    let brushes = [[0.3, 0.2], [-0.35, 0.1]].into_iter().fold(Mesh::default(), |all, [x, z]| {
        let lean = dvec3(x, 1.0, z).normalize();
        all.and(Mesh::tube(
            &[0.014 * DVec3::Y, 0.014 * DVec3::Y + 0.1 * lean, 0.014 * DVec3::Y + 0.16 * lean],
            0.0035,
            14,
        ))
    });
    let frame = {
        let bar = |min: [f64; 2], max: [f64; 2]| {
            Mesh::chamfered(dvec3(min[0], min[1], 0.0), dvec3(max[0], max[1], 0.03), 0.006)
        };
        bar([-0.6, -0.45], [0.6, -0.42])
            .and(bar([-0.6, 0.42], [0.6, 0.45]))
            .and(bar([-0.6, -0.42], [-0.57, 0.42]))
            .and(bar([0.57, -0.42], [0.6, 0.42]))
    };
    let mut meshes = vec![
        ("basin", basin(), 50.0),
        ("tap", tap(), 50.0),
        ("shower", shower(), 50.0),
        ("towel", towel(), 180.0),
        ("frame", frame, 0.0),
        ("bottle", bottle.wall(), 50.0),
        ("shampoo", bottle.filling(0.09, 0.0008), 50.0),
        ("tumbler", tumbler.wall(), 50.0),
        ("brushes", brushes, 60.0),
        ("plant", lump(dvec3(0.1, 0.1, 0.1), 5, 0.2), 60.0),
    ];
    meshes.extend(
        ["tiles_below", "tiles_above"].into_iter().zip(walls()).map(|(name, mesh)| (name, mesh, 0.0)),
    );
    meshes
        .extend(["floor_pale", "floor_dark"].into_iter().zip(floor()).map(|(name, mesh)| (name, mesh, 0.0)));
    Bed { name: "bathroom", scene: include_str!("../scenes/beds/bathroom.ron"), meshes }
}
