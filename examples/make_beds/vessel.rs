//! Vessels of glass, and what stands in them.

use glam::{DVec2, dvec2};

use crate::mesh::{Mesh, spline};

/// Corners of a turned body.
const SEGMENTS: u32 = 96;

/// A turned vessel: a wall between two surfaces.
pub(crate) struct Vessel {
    /// From the middle of the base up to the rim, (radius, height).
    outer: Vec<DVec2>,
    /// From the middle of the floor up to the rim.
    inner: Vec<DVec2>,
}

impl Vessel {
    /// A tumbler that is wider at the top, with a thick floor and a round rim.
    pub(crate) fn tumbler(base: f64, rim: f64, height: f64, wall: f64, floor: f64) -> Self {
        let edge = 0.12 * base;
        let outer = vec![
            dvec2(0.0, 0.0),
            dvec2(base - edge, 0.0),
            dvec2(base - 0.3 * edge, 0.3 * edge),
            dvec2(base, edge),
            dvec2(rim, height - 0.4 * wall),
            dvec2(rim - 0.15 * wall, height - 0.1 * wall),
            dvec2(rim - 0.5 * wall, height),
        ];
        let (inside, round) = (base - wall, 0.25 * base);
        let inner = [
            vec![dvec2(0.0, floor), dvec2(inside - round, floor)],
            spline(
                &[
                    dvec2(inside - 0.95 * round, floor),
                    dvec2(inside - 0.3 * round, floor + 0.3 * round),
                    dvec2(inside + 0.02 * (rim - base), floor + round),
                ],
                4,
            ),
            vec![dvec2(rim - wall, height - 0.4 * wall), dvec2(rim - 0.85 * wall, height - 0.1 * wall)],
        ]
        .concat();
        Self { outer, inner }
    }

    /// A wine glass of that height: foot, stem and bowl.
    pub(crate) fn goblet(height: f64) -> Self {
        let scaled =
            |points: &[[f64; 2]]| points.iter().map(|&[r, y]| dvec2(r, y) * height).collect::<Vec<_>>();
        let foot = scaled(&[[0.0, 0.0], [0.17, 0.0], [0.18, 0.006]]);
        let stem = scaled(&[
            [0.175, 0.014],
            [0.09, 0.03],
            [0.03, 0.06],
            [0.02, 0.14],
            [0.019, 0.34],
            [0.03, 0.43],
            [0.11, 0.5],
            [0.18, 0.6],
            [0.195, 0.7],
            [0.18, 0.85],
            [0.163, 0.995],
        ]);
        let bowl = scaled(&[
            [0.03, 0.452],
            [0.105, 0.515],
            [0.172, 0.605],
            [0.186, 0.7],
            [0.171, 0.85],
            [0.155, 0.995],
        ]);
        let outer = [foot, spline(&stem, 6), scaled(&[[0.159, 1.0]])].concat();
        let inner = [scaled(&[[0.0, 0.447]]), spline(&bowl, 6)].concat();
        Self { outer, inner }
    }

    /// A bottle or carafe of a body radius and a height, with a neck that opens to a lip.
    pub(crate) fn bottle(radius: f64, height: f64, neck: f64, wall: f64) -> Self {
        let curve = |inset: f64| {
            spline(
                &[
                    dvec2(radius - inset, 0.12 * height),
                    dvec2(radius - inset, 0.45 * height),
                    dvec2(0.93 * radius - inset, 0.56 * height),
                    dvec2(0.5 * (radius + neck) - inset, 0.69 * height),
                    dvec2(neck - inset, 0.82 * height),
                    dvec2(neck - inset, 0.94 * height),
                    dvec2(1.16 * neck - inset, 0.985 * height),
                ],
                6,
            )
        };
        let (floor, round) = (3.0 * wall, 0.1 * radius);
        let base = |inset: f64, y: f64| {
            let side = radius - inset;
            vec![
                dvec2(0.0, y),
                dvec2(side - 2.0 * round, y),
                dvec2(side - 0.6 * round, y + 0.5 * round),
                dvec2(side, y + 2.0 * round),
            ]
        };
        let outer = [base(0.0, 0.0), curve(0.0), vec![dvec2(1.16 * neck - 0.5 * wall, height)]].concat();
        Self { outer, inner: [base(wall, floor), curve(wall)].concat() }
    }

    /// The wall, a closed body.
    pub(crate) fn wall(&self) -> Mesh {
        let profile = [self.outer.clone(), self.inner.iter().rev().copied().collect()].concat();
        Mesh::revolve(&profile, SEGMENTS)
    }

    /// Liquid that fills the vessel up to `level`, with a meniscus; it reaches `into` the wall, which needs
    /// the higher priority.
    pub(crate) fn filling(&self, level: f64, into: f64) -> Mesh {
        let reach = |point: DVec2| dvec2(if point.x > 0.0 { point.x + into } else { 0.0 }, point.y - into);
        let below: Vec<DVec2> =
            self.inner.iter().copied().filter(|point| point.y < level - 2.0 * into).collect();
        let next = self.inner[below.len()];
        let last = below[below.len() - 1];
        let side = last.x + (next.x - last.x) * (level - last.y) / (next.y - last.y);
        let rise = 0.04 * side;
        let meniscus = [
            [into, rise],
            [0.0, 0.9 * rise],
            [-0.4 * rise, 0.45 * rise],
            [-rise, 0.12 * rise],
            [-2.0 * rise, 0.0],
        ];
        let profile: Vec<DVec2> = below
            .into_iter()
            .map(reach)
            .chain(meniscus.map(|[x, y]| dvec2(side + x, level + y)))
            .chain([dvec2(0.0, level)])
            .collect();
        Mesh::revolve(&profile, SEGMENTS)
    }
}
