//! Triangle meshes made by code: turned bodies, tubes, blocks with a relief, tiles.
//!
//! Lengths are metres. All meshes but [`tiles`] and [`Mesh::sheet`] are closed, with normals outwards.

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::fmt::Write as _;

use glam::{DVec2, DVec3};

/// Triangles over shared corners, counter-clockwise as seen from outside.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mesh {
    pub(crate) positions: Vec<DVec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// The body that a profile of (radius, height) sweeps about the y axis.
    ///
    /// The profile starts and ends on the axis and leaves the body on its left: up on the outer side.
    pub(crate) fn revolve(profile: &[DVec2], segments: u32) -> Self {
        let mut mesh = Self::default();
        // The first corner of each ring, and its number of corners: one on the axis.
        let rings: Vec<(u32, u32)> = profile
            .iter()
            .map(|point| {
                let first = mesh.positions.len() as u32;
                let corners = if point.x == 0.0 { 1 } else { segments };
                mesh.positions.extend((0..corners).map(|corner| {
                    let angle = TAU * f64::from(corner) / f64::from(segments);
                    DVec3::new(point.x * angle.cos(), point.y, point.x * angle.sin())
                }));
                (first, corners)
            })
            .collect();
        for pair in rings.windows(2) {
            let at = |(first, corners): (u32, u32), corner: u32| first + corner % corners;
            for corner in 0..segments {
                let [below, above] = [pair[0], pair[1]];
                mesh.quad([
                    at(below, corner),
                    at(above, corner),
                    at(above, corner + 1),
                    at(below, corner + 1),
                ]);
            }
        }
        mesh
    }

    /// A tube of round cross-section along a path, closed at both ends.
    pub(crate) fn tube(path: &[DVec3], radius: f64, sides: u32) -> Self {
        let mut mesh = Self::default();
        let last = path.len() - 1;
        let mut side = (path[1] - path[0]).any_orthonormal_vector();
        for (index, &point) in path.iter().enumerate() {
            let along = (path[(index + 1).min(last)] - path[index.saturating_sub(1)]).normalize();
            // Carried along the path, so that the tube does not twist.
            side = (side - along * side.dot(along)).normalize();
            let up = along.cross(side);
            mesh.positions.extend((0..sides).map(|corner| {
                let angle = TAU * f64::from(corner) / f64::from(sides);
                point + radius * (side * angle.cos() + up * angle.sin())
            }));
        }
        for ring in 0..last as u32 {
            for corner in 0..sides {
                let at = |ring: u32, corner: u32| ring * sides + corner % sides;
                mesh.quad([
                    at(ring, corner),
                    at(ring, corner + 1),
                    at(ring + 1, corner + 1),
                    at(ring + 1, corner),
                ]);
            }
        }
        let end = last as u32 * sides;
        for corner in 1..sides - 1 {
            mesh.triangles.push([0, corner + 1, corner]);
            mesh.triangles.push([end, end + corner, end + corner + 1]);
        }
        mesh
    }

    /// An open surface: the points of a grid of `cells`, wound for a normal ∂u × ∂v; arguments in `[0, 1]`.
    pub(crate) fn sheet(cells: [u32; 2], point: impl Fn(f64, f64) -> DVec3) -> Self {
        let [columns, rows] = cells;
        let mut mesh = Self::default();
        for row in 0..=rows {
            let v = f64::from(row) / f64::from(rows);
            mesh.positions
                .extend((0..=columns).map(|column| point(f64::from(column) / f64::from(columns), v)));
        }
        for row in 0..rows {
            for column in 0..columns {
                let at = |column: u32, row: u32| row * (columns + 1) + column;
                mesh.quad([
                    at(column, row),
                    at(column + 1, row),
                    at(column + 1, row + 1),
                    at(column, row + 1),
                ]);
            }
        }
        mesh
    }

    /// The block between the corners `min` and `max` whose top is raised by `relief(x, z)`.
    pub(crate) fn block(min: DVec3, max: DVec3, cells: [u32; 2], relief: impl Fn(f64, f64) -> f64) -> Self {
        let [columns, rows] = cells;
        let size = max - min;
        // u along z and v along x: the normal points up.
        let mut mesh = Self::sheet([rows, columns], |u, v| {
            let [x, z] = [min.x + v * size.x, min.z + u * size.z];
            DVec3::new(x, max.y + relief(x, z), z)
        });
        let count = mesh.positions.len() as u32;
        mesh.positions.extend_from_within(..);
        mesh.positions[count as usize..].iter_mut().for_each(|corner| corner.y = min.y);
        let top = mesh.triangles.clone();
        mesh.triangles.extend(top.iter().map(|&[a, b, c]| [count + a, count + c, count + b]));
        let at = |row: u32, column: u32| column * (rows + 1) + row;
        let forward = (0..rows)
            .flat_map(|row| [[at(row, 0), at(row + 1, 0)], [at(row + 1, columns), at(row, columns)]]);
        let sideways = (0..columns).flat_map(|column| {
            [[at(0, column + 1), at(0, column)], [at(rows, column), at(rows, column + 1)]]
        });
        for [a, b] in forward.chain(sideways).collect::<Vec<_>>() {
            mesh.quad([b, a, count + a, count + b]);
        }
        mesh
    }

    /// A box with chamfered edges.
    pub(crate) fn chamfered(min: DVec3, max: DVec3, chamfer: f64) -> Self {
        // Rings from the bottom to the top: the faces of the box shrunk, and at its full width.
        let ring = |y: f64, inset: f64| {
            let [a, b, c, d] = [min.x + inset, max.x - inset, min.z + inset, max.z - inset];
            [[a, d], [b, d], [b, c], [a, c]].map(|[x, z]| DVec3::new(x, y, z))
        };
        let rings = [
            ring(min.y, chamfer),
            ring(min.y + chamfer, 0.0),
            ring(max.y - chamfer, 0.0),
            ring(max.y, chamfer),
        ];
        let mut mesh = Self { positions: rings.concat(), triangles: Vec::new() };
        for base in [0, 4, 8] {
            for corner in 0..4 {
                let next = (corner + 1) % 4;
                mesh.quad([base + corner, base + next, base + 4 + next, base + 4 + corner]);
            }
        }
        mesh.quad([3, 2, 1, 0]);
        mesh.quad([12, 13, 14, 15]);
        mesh
    }

    /// Two triangles; those without area, at the tip of a fan, are left out.
    fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        let triangles = [[a, b, c], [a, c, d]];
        self.triangles.extend(triangles.iter().filter(|[p, q, r]| p != q && q != r && r != p));
    }

    /// Both meshes together.
    #[must_use]
    pub(crate) fn and(mut self, other: Self) -> Self {
        let count = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|corner| count + corner)));
        self
    }

    /// Moved.
    #[must_use]
    pub(crate) fn moved(mut self, by: DVec3) -> Self {
        self.positions.iter_mut().for_each(|corner| *corner += by);
        self
    }

    /// The text of an OBJ file.
    ///
    /// Normals are interpolated where neighbouring triangles meet at less than `crease` degrees: 0 for flat
    /// triangles, 180 for none but round edges. Lengths are rounded to a hundredth of a millimetre.
    pub(crate) fn to_obj(&self, crease: f64) -> String {
        let mut text = String::new();
        for corner in &self.positions {
            writeln!(text, "v {:.5} {:.5} {:.5}", corner.x, corner.y, corner.z).expect("a string takes all");
        }
        if crease == 0.0 {
            for [a, b, c] in self.triangles.iter().map(|triangle| triangle.map(|corner| corner + 1)) {
                writeln!(text, "f {a} {b} {c}").expect("a string takes all");
            }
            return text;
        }
        let mut numbers = HashMap::new();
        let mut faces = String::new();
        for (triangle, normals) in self.triangles.iter().zip(self.normals(crease)) {
            faces.push('f');
            for (corner, normal) in triangle.iter().zip(normals) {
                let line = format!("vn {:.4} {:.4} {:.4}\n", normal.x, normal.y, normal.z);
                let next = numbers.len() + 1;
                let number = *numbers.entry(line).or_insert_with_key(|line| {
                    text.push_str(line);
                    next
                });
                write!(faces, " {}//{number}", corner + 1).expect("a string takes all");
            }
            faces.push('\n');
        }
        text + &faces
    }

    /// Normals of the corners of all triangles: means of those around, by area, up to the crease angle.
    fn normals(&self, crease: f64) -> Vec<[DVec3; 3]> {
        let areas: Vec<DVec3> = self
            .triangles
            .iter()
            .map(|triangle| triangle.map(|corner| self.positions[corner as usize]))
            .map(|[a, b, c]| (b - a).cross(c - a))
            .collect();
        let mut around = vec![Vec::new(); self.positions.len()];
        for (index, triangle) in self.triangles.iter().enumerate() {
            for &corner in triangle {
                around[corner as usize].push(index);
            }
        }
        let least = crease.to_radians().cos();
        let normal = |own: DVec3, corner: u32| {
            let alike = around[corner as usize]
                .iter()
                .map(|&other| areas[other])
                .filter(|other| other.normalize_or_zero().dot(own.normalize_or_zero()) >= least);
            alike.sum::<DVec3>().normalize_or(own.normalize_or(DVec3::Y))
        };
        self.triangles
            .iter()
            .zip(&areas)
            .map(|(triangle, &own)| triangle.map(|corner| normal(own, corner)))
            .collect()
    }
}

/// A wall or floor of tiles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tiling {
    /// A corner of the tiled rectangle, on the ground that the tiles rest on.
    pub(crate) origin: DVec3,
    /// Edges of the rectangle; the tiles face along `edge_u × edge_v`.
    pub(crate) edge_u: DVec3,
    pub(crate) edge_v: DVec3,
    /// Tiles along both edges.
    pub(crate) count: [u32; 2],
    /// Width of the joints.
    pub(crate) gap: f64,
    /// Height of the tiles over the ground.
    pub(crate) height: f64,
    /// Width and height of the bevel.
    pub(crate) bevel: f64,
    /// Shift of every second row, as a part of a tile.
    pub(crate) bond: f64,
    /// Largest difference in height within a tile: no two lie quite alike.
    pub(crate) tilt: f64,
}

/// Tiles with bevelled edges, open at the back, each in the mesh that `kind(column, row)` names.
pub(crate) fn tiles(tiling: &Tiling, kinds: usize, kind: impl Fn(u32, u32) -> usize) -> Vec<Mesh> {
    let Tiling { origin, edge_u, edge_v, count: [columns, rows], gap, height, bevel, bond, tilt } = *tiling;
    let normal = edge_u.cross(edge_v).normalize();
    let (u, v) = (edge_u.normalize(), edge_v.normalize());
    let (width, depth) = (edge_u.length() / f64::from(columns), edge_v.length() / f64::from(rows));
    let mut meshes = vec![Mesh::default(); kinds];
    for row in 0..rows {
        let shift = if row % 2 == 1 { bond } else { 0.0 };
        // A shifted row has a part of a tile at both ends.
        for column in 0..columns + u32::from(shift > 0.0) {
            let left = ((f64::from(column) - shift) * width).max(0.0) + 0.5 * gap;
            let right = ((f64::from(column) + 1.0 - shift) * width).min(edge_u.length()) - 0.5 * gap;
            let (near, far) = ((f64::from(row) * depth) + 0.5 * gap, f64::from(row + 1) * depth - 0.5 * gap);
            let tilted = |corner: u32| tilt * random([column, row, corner]);
            let mut mesh = Mesh::default();
            for (inset, rise, is_tilted) in
                [(0.0, 0.0, 0.0), (0.0, height - bevel, 1.0), (bevel, height, 1.0)]
            {
                let corners = [[left, near], [right, near], [right, far], [left, far]];
                let signs = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
                mesh.positions.extend((0..4).map(|corner| {
                    let [[x, y], [sx, sy]] = [corners[corner], signs[corner]];
                    let rise = rise + is_tilted * tilted(corner as u32);
                    origin + u * (x + sx * inset) + v * (y + sy * inset) + normal * rise
                }));
            }
            for base in [0, 4] {
                for corner in 0..4 {
                    let next = (corner + 1) % 4;
                    mesh.quad([base + corner, base + next, base + 4 + next, base + 4 + corner]);
                }
            }
            mesh.quad([8, 9, 10, 11]);
            let own = &mut meshes[kind(column, row)];
            *own = std::mem::take(own).and(mesh);
        }
    }
    meshes
}

/// A number in `[0, 1)` that the integers fix (the finaliser of `SplitMix64`).
pub(crate) fn random(key: [u32; 3]) -> f64 {
    let mut z = key.iter().fold(0x9e37_79b9_7f4a_7c15_u64, |z, &part| {
        (z ^ u64::from(part)).wrapping_mul(0xbf58_476d_1ce4_e5b9).rotate_left(31)
    });
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (z ^ (z >> 31)) as f64 / 2.0_f64.powi(64)
}

/// Points on smooth curves through those given (Catmull–Rom), `steps` to each span, the ends included.
pub(crate) fn spline(points: &[DVec2], steps: u32) -> Vec<DVec2> {
    let at = |index: isize| points[index.clamp(0, points.len().cast_signed() - 1) as usize];
    let spans = points.len().cast_signed() - 1;
    let mut curve: Vec<DVec2> = (0..spans)
        .flat_map(|span| (0..steps).map(move |step| (span, f64::from(step) / f64::from(steps))))
        .map(|(span, t)| {
            let [a, b, c, d] = [span - 1, span, span + 1, span + 2].map(at);
            0.5 * (2.0 * b
                + (c - a) * t
                + (2.0 * a - 5.0 * b + 4.0 * c - d) * t * t
                + (3.0 * b - a - 3.0 * c + d) * t * t * t)
        })
        .collect();
    curve.push(at(spans));
    curve
}
