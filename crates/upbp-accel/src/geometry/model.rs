//! The hierarchy over the triangles of a mesh in coordinates of its own, which all copies of it share.

use std::array;

use glam::Vec3;
use rayon::prelude::*;

use super::build::{Boxed, Leaves, build};
use super::hierarchy::{BlockRef, Hierarchy, Kind};
use super::placement::Placement;
use super::primitive::{Blocks, Name, Packing};
use super::primitive_block::Triangles;
use super::surface::Surface;
use crate::simd::set_lanes;

/// A mesh in coordinates of its own.
#[derive(Debug)]
pub(super) struct Model {
    pub(super) hierarchy: Hierarchy,
    pub(super) triangles: Blocks<Triangles>,
    bounds: (Vec3, Vec3),
}

impl Model {
    /// The hierarchy over at most [`MAX_INDEX`](super::hierarchy::MAX_INDEX) triangles.
    pub(super) fn build(surface: &Surface) -> Self {
        let boxed = |triangle| Boxed::triangle(surface.corners(triangle));
        let boxes: Vec<_> = (0..surface.count()).into_par_iter().with_min_len(1024).map(boxed).collect();
        let mut packing = Packing::default();
        let hierarchy = build(&boxes, Leaves::PRIMITIVES, &mut |kind, members| packing.add(kind, members));
        let triangles = packing.pack(Kind::Triangle, |triangle| {
            // Each copy is a shape of its own.
            Some((Name { shape: u32::MAX, triangle }, surface.corners(triangle)))
        });
        Self { hierarchy, triangles, bounds: surface.bounds() }
    }

    /// The least and the greatest coordinates of a copy: exactly those of its corners.
    pub(super) fn bounds_of_copy(&self, placement: &Placement) -> (Vec3, Vec3) {
        let bound = |sign| array::from_fn(|axis| sign * self.greatest(placement, axis, sign));
        (Vec3::from_array(bound(-1.0)), Vec3::from_array(bound(1.0)))
    }

    /// The greatest coordinate of a corner in the scene, or with a negative sign the least, negated.
    fn greatest(&self, placement: &Placement, axis: usize, sign: f32) -> f32 {
        self.hierarchy.greatest(self.most_of_box(placement, axis, sign), |block| {
            self.corners(block)
                .map(|corner| sign * placement.point(corner)[axis])
                .fold(f32::NEG_INFINITY, f32::max)
        })
    }

    /// The function that bounds what [`greatest`](Self::greatest) finds in a box.
    fn most_of_box(&self, placement: &Placement, axis: usize, sign: f32) -> impl Fn((Vec3, Vec3)) -> f32 {
        let (least, greatest) = self.bounds;
        let rises = (sign * placement.gradient(axis)).cmpge(Vec3::ZERO);
        // Rounded products and sums rise where the exact ones do, so that no point of a box exceeds this
        // corner of it. Boxes are wider than their triangles by a rounding, and cut to the mesh: otherwise
        // all blocks on a side of a tessellated cube would seem to reach farther than its corners.
        move |(min, max)| sign * placement.point(Vec3::select(rises, max, min).clamp(least, greatest))[axis]
    }

    fn corners(&self, block: BlockRef) -> impl Iterator<Item = Vec3> {
        let triangles = &self.triangles.0[block.index].block;
        set_lanes(block.used).flat_map(|lane| triangles.corners(lane))
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use glam::{Affine3A, Quat};

    use super::*;
    use crate::geometry::topology::Border;

    /// A cube of `12 n²` triangles, blown up to a ball or not.
    fn cube(n: u32, is_ball: bool) -> Surface {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for face in 0..6_u32 {
            let axes = [[0, 1, 2], [1, 2, 0], [2, 0, 1]][face as usize % 3];
            let first = positions.len() as u32;
            for i in 0..=n {
                for j in 0..=n {
                    let mut corner = Vec3::splat(if face < 3 { 1.0 } else { -1.0 });
                    corner[axes[1]] = 2.0 * i as f32 / n as f32 - 1.0;
                    corner[axes[2]] = 2.0 * j as f32 / n as f32 - 1.0;
                    positions.push(if is_ball { corner.normalize() } else { corner });
                }
            }
            let at = |i: u32, j: u32| first + i * (n + 1) + j;
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        let border = Border::of(&positions, &triangles);
        Surface::new(positions, triangles, None, border)
    }

    #[test]
    fn bounds_of_a_copy_are_found_among_few_triangles() {
        let turned = Quat::from_axis_angle(Vec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
        for (is_ball, rotation) in
            [(true, Quat::IDENTITY), (true, turned), (false, Quat::IDENTITY), (false, turned)]
        {
            let surface = cube(40, is_ball);
            let to_scene = Affine3A::from_scale_rotation_translation(Vec3::splat(0.3), rotation, Vec3::ONE);
            let placement = Placement::new(&to_scene).unwrap();
            let model = surface.model();
            for (axis, sign) in (0..3).flat_map(|axis| [(axis, -1.0), (axis, 1.0)]) {
                let blocks = Cell::new(0);
                let found = model.hierarchy.greatest(model.most_of_box(&placement, axis, sign), |block| {
                    blocks.set(blocks.get() + 1);
                    let places = model.corners(block).map(|corner| sign * placement.point(corner)[axis]);
                    places.fold(f32::NEG_INFINITY, f32::max)
                });
                let each = surface.positions.iter().map(|corner| sign * placement.point(*corner)[axis]);
                assert_eq!(found, each.fold(f32::NEG_INFINITY, f32::max));
                // On a ball, as many as are in a cap as high as their boxes.
                let most = model.triangles.0.len() / 10;
                assert!(blocks.get() < most, "{is_ball} {rotation} {axis} {sign}: {}", blocks.get());
            }
        }
    }
}
