//! The triangles of a mesh in coordinates of their own, with what all copies of the mesh share.

use std::sync::{Arc, OnceLock};

use glam::{DVec3, Vec3};

use super::model::Model;
use super::topology::{Border, pieces};
use super::volume_sampling::Cells;

/// Triangles in coordinates of their own.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    pub(super) positions: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) normals: Option<Vec<Vec3>>,
    pub(super) border: Border,
    /// Triangles without area that were left out.
    pub(super) dropped: usize,
    /// [`rounded`](super::TriangleMesh::rounded) where corners were transformed or moved, else zero.
    pub(super) rounded: Vec3,
    bounds: (Vec3, Vec3),
    measures: Measures,
}

/// Properties of the surface as a whole: each costs a pass over all triangles, once, when it is first asked
/// for.
#[derive(Clone, Debug, Default)]
struct Measures {
    areas: OnceLock<Areas>,
    signed_volume: OnceLock<f64>,
    normal_cone: OnceLock<Option<(Vec3, f32)>>,
    pieces: OnceLock<Vec<u32>>,
    model: OnceLock<Arc<Model>>,
    cells: OnceLock<Arc<Cells>>,
}

/// Areas of the triangles of a surface.
#[derive(Clone, Debug)]
pub(super) struct Areas {
    /// That of the triangles up to and including each.
    pub(super) cumulative: Vec<f64>,
    /// Sum of the lengths of all edges, those that two triangles share twice.
    edges: f64,
}

impl Areas {
    /// Those of triangles one after the other.
    pub(super) fn of(triangles: impl Iterator<Item = [Vec3; 3]>) -> Self {
        let (mut total, mut edges) = (0.0, 0.0);
        let up_to = |corners: [Vec3; 3]| {
            let [a, b, c] = corners;
            edges += f64::from(a.distance(b) + b.distance(c) + c.distance(a));
            total += 0.5 * cross(corners).length();
            total
        };
        let cumulative = triangles.map(up_to).collect();
        Self { cumulative, edges }
    }

    pub(super) fn total(&self) -> f64 {
        self.cumulative.last().copied().unwrap_or(0.0)
    }

    /// Whether corners may be off by as much, in some direction, and triangles are about as large as before.
    pub(super) fn allow(&self, error: f64) -> bool {
        /// The most by which areas may change relative to all: not all in the same sense, since errors of
        /// rounding have either.
        const PART: f64 = 0.03;
        self.edges * error <= PART * self.total()
    }
}

impl Surface {
    pub(super) fn new(
        positions: Vec<Vec3>,
        triangles: Vec<[u32; 3]>,
        normals: Option<Vec<Vec3>>,
        border: Border,
        dropped: usize,
    ) -> Self {
        let mut bounds = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for corner in triangles.iter().flatten().map(|&vertex| positions[vertex as usize]) {
            bounds = (bounds.0.min(corner), bounds.1.max(corner));
        }
        let (rounded, measures) = (Vec3::ZERO, Measures::default());
        Self { positions, triangles, normals, border, dropped, rounded, bounds, measures }
    }

    /// The least and the greatest coordinates.
    pub(super) const fn bounds(&self) -> (Vec3, Vec3) {
        self.bounds
    }

    pub(super) fn count(&self) -> u32 {
        self.triangles.len() as u32
    }

    pub(super) fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|vertex| self.positions[vertex as usize])
    }

    fn each(&self) -> impl Iterator<Item = [Vec3; 3]> {
        (0..self.count()).map(|triangle| self.corners(triangle))
    }

    pub(super) fn areas(&self) -> &Areas {
        self.measures.areas.get_or_init(|| Areas::of(self.each()))
    }

    /// The enclosed volume: negative if the normals point inwards.
    pub(super) fn signed_volume(&self) -> f64 {
        *self.measures.signed_volume.get_or_init(|| {
            // From a point near the mesh: from a far one the terms cancel.
            let from = self.bounds.0.as_dvec3();
            let sum: f64 = self
                .each()
                .map(|corners| {
                    let [a, b, c] = corners.map(|corner| corner.as_dvec3() - from);
                    a.dot(b.cross(c))
                })
                .sum();
            sum / 6.0
        })
    }

    /// Gives the volume, where it is known from elsewhere.
    pub(super) fn set_signed_volume(&self, volume: f64) {
        self.measures.signed_volume.get_or_init(|| volume);
    }

    /// The cone of the normals, see [`normal_cone`].
    pub(super) fn normal_cone(&self) -> Option<(Vec3, f32)> {
        *self.measures.normal_cone.get_or_init(|| normal_cone(|| self.each()))
    }

    /// The largest triangle of each [piece](super::TriangleMesh::pieces).
    pub(super) fn pieces(&self) -> &[u32] {
        self.measures.pieces.get_or_init(|| pieces(&self.positions, &self.triangles))
    }

    /// The hierarchy over the triangles.
    pub(super) fn model(&self) -> &Arc<Model> {
        let model = &self.measures.model;
        if let Some(built) = model.get() {
            return built;
        }
        // Not inside of the cell: while a thread builds in parallel it may take up the work of another copy,
        // and would wait for itself.
        let built = Arc::new(Model::build(self));
        model.get_or_init(|| built)
    }

    /// The cells of its inside, which `cover` finds.
    pub(super) fn cells(&self, cover: impl FnOnce() -> Cells) -> &Arc<Cells> {
        let cells = &self.measures.cells;
        if let Some(found) = cells.get() {
            return found;
        }
        // Not inside of the cell, as with the hierarchy.
        let found = Arc::new(cover());
        cells.get_or_init(|| found)
    }

    /// Adds a vector to all positions. They remain as coarse as they were in their old place.
    pub(super) fn translate(&mut self, by: Vec3) {
        self.rounded = self.rounded.max(self.bounds.0.abs().max(self.bounds.1.abs()));
        self.positions.iter_mut().for_each(|position| *position += by);
        self.bounds = (self.bounds.0 + by, self.bounds.1 + by);
        // The volume does not depend on how corners are rounded in their place.
        let signed_volume = std::mem::take(&mut self.measures.signed_volume);
        self.measures = Measures { signed_volume, ..Measures::default() };
    }
}

/// The mean of the unit normals of triangles, of unit length, and the least cosine between it and any of
/// them; `None` if they cancel.
pub(super) fn normal_cone<I: Iterator<Item = [Vec3; 3]>>(triangles: impl Fn() -> I) -> Option<(Vec3, f32)> {
    let normals = || triangles().map(|[a, b, c]| (b - a).cross(c - a).normalize_or_zero());
    let axis = normals().sum::<Vec3>().try_normalize()?;
    Some((axis, normals().map(|normal| normal.dot(axis)).fold(1.0, f32::min).max(-1.0)))
}

/// The normal of a triangle, of twice its area in length; in double precision, so that that of a small
/// triangle does not vanish.
pub(super) fn cross(corners: [Vec3; 3]) -> DVec3 {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    (b - a).cross(c - a)
}
