//! A dark hall with a projector.

use glam::dvec3;

use crate::Bed;
use crate::mesh::Mesh;

/// Letters of the slide: an opening per `#`.
const LETTERS: [&str; 7] = [
    "#..#.###..###..###.",
    "#..#.#..#.#..#.#..#",
    "#..#.#..#.#..#.#..#",
    "#..#.###..###..###.",
    "#..#.#....#..#.#...",
    "#..#.#....#..#.#...",
    ".##..#....###..#...",
];

/// Width of an opening.
const CELL: f64 = 0.0055;

/// Middle of the letters, and of the hole for the ball of glass, in cells above the axis of the lamp.
const LETTERS_AT: i32 = 6;
const HOLE_AT: i32 = -8;

/// The slide: a sheet with openings in the plane z = 0; the lamp is at +z, and its axis is the z axis.
fn slide() -> Mesh {
    let columns = LETTERS[0].len().cast_signed() as i32;
    let is_open = |column: i32, row: i32| {
        let letter = LETTERS.get((LETTERS_AT + 3 - row) as usize);
        let letter = letter.and_then(|line| line.as_bytes().get((column + columns / 2) as usize));
        let (across, up) = (column, row - HOLE_AT);
        letter == Some(&b'#') || across * across + up * up <= 4
    };
    let cells = (-17..=17).flat_map(|column| (-17..=17).map(move |row| (column, row)));
    cells.filter(|&(column, row)| !is_open(column, row)).fold(Mesh::default(), |sheet, (column, row)| {
        let corner = CELL * dvec3(f64::from(column) - 0.5, f64::from(row) - 0.5, 0.0);
        sheet.and(Mesh::sheet([1, 1], |u, v| corner + CELL * dvec3(u, v, 0.0)))
    })
}

/// A chair: seat, back and legs.
fn chair() -> Mesh {
    let seat = Mesh::chamfered(dvec3(-0.23, 0.4, -0.22), dvec3(0.23, 0.47, 0.22), 0.02);
    let back = Mesh::chamfered(dvec3(-0.23, 0.5, 0.2), dvec3(0.23, 0.92, 0.26), 0.025);
    let legs = [[-0.2, -0.19], [0.2, -0.19], [-0.2, 0.22], [0.2, 0.22]].map(|[x, z]| {
        let top = if z > 0.0 { 0.7 } else { 0.42 };
        Mesh::tube(&[dvec3(x, 0.0, z), dvec3(x, 0.3, z), dvec3(x, top, z)], 0.012, 10)
    });
    legs.into_iter().fold(seat.and(back), Mesh::and)
}

/// Rows of chairs on both sides of an aisle.
fn chairs() -> Mesh {
    let places = (0..5).flat_map(|row| (0..10).map(move |seat| (row, seat)));
    places.fold(Mesh::default(), |all, (row, seat)| {
        let aisle = if seat < 5 { -0.75 } else { 0.75 };
        let x = 0.56 * (f64::from(seat) - 4.5) + aisle;
        all.and(chair().moved(dvec3(x, 0.0, -6.4 + 1.15 * f64::from(row))))
    })
}

pub(crate) fn bed() -> Bed {
    let pedestal = [
        [0.0, 0.0],
        [0.2, 0.0],
        [0.2, 0.05],
        [0.11, 0.09],
        [0.09, 0.8],
        [0.14, 0.86],
        [0.14, 0.9],
        [0.0, 0.9],
    ];
    let curtain = |x: f64, mirrored: f64| {
        Mesh::sheet([160, 2], move |u, v| {
            let fold = 0.09 * (u * 52.0).sin() + 0.03 * (u * 117.0).sin();
            dvec3(x + mirrored * 2.1 * (u - 0.5), 5.2 * v, -11.6 + fold)
        })
    };
    let stand = [-1.0, 1.0].into_iter().fold(Mesh::default(), |all, side| {
        all.and(Mesh::tube(
            &[dvec3(0.28 * side, 0.0, 0.2), dvec3(0.2 * side, 0.8, 0.1), dvec3(0.1 * side, 1.5, 0.0)],
            0.018,
            12,
        ))
    });
    let third =
        Mesh::tube(&[dvec3(0.0, 0.0, -0.35), dvec3(0.0, 0.8, -0.15), dvec3(0.0, 1.5, 0.0)], 0.018, 12);
    Bed {
        name: "hall",
        scene: include_str!("../scenes/beds/hall.ron"),
        meshes: vec![
            ("slide", slide(), 0.0),
            ("chairs", chairs(), 0.0),
            ("pedestal", Mesh::revolve(&pedestal.map(Into::into), 64), 40.0),
            ("curtains", curtain(-4.6, 1.0).and(curtain(4.6, 1.0)), 80.0),
            ("stand", stand.and(third), 60.0),
        ],
    }
}
