//! The triangle mesh.

use std::sync::{Arc, OnceLock};

use glam::{Affine3A, DVec3, Vec3};

use super::error::GeometryError;
use super::hierarchy::MAX_INDEX;
use super::model::Model;
use super::placement::{Placement, unit};
use super::surface::{Areas, Surface, cross, normal_cone};
use super::topology::Border;
use super::triangle::RayShear;
use super::volume_sampling::Cells;
use crate::ray::Ray;

/// Triangles over shared vertices.
///
/// The winding gives the normal: it points to where the vertices are seen counter-clockwise. A closed mesh
/// must be wound so that normals point outwards; [`TriangleMesh::signed_volume`] is negative otherwise.
///
/// Clones share the triangles, and so do copies that are [placed](Self::placed) elsewhere.
#[derive(Clone, Debug)]
pub struct TriangleMesh {
    surface: Arc<Surface>,
    placement: Option<Placement>,
    bounds: (Vec3, Vec3),
    /// Areas of the triangles of a copy, if they are not in proportion to those of the surface, once they are
    /// asked for.
    own_areas: OnceLock<Areas>,
}

impl TriangleMesh {
    /// The mesh of triangles that index `positions`; with `normals`, one per position and of any length, it
    /// is shaded smoothly. Normals of zero leave it to those of the other corners, or to the plane.
    ///
    /// Triangles without area are dropped and counted, see [`TriangleMesh::dropped_triangles`].
    pub fn new(
        positions: Vec<Vec3>,
        indices: Vec<[u32; 3]>,
        normals: Option<Vec<Vec3>>,
    ) -> Result<Self, GeometryError> {
        if let Some(index) = positions.iter().position(|position| !position.is_finite()) {
            return Err(GeometryError::NonFiniteElement { what: "position", index });
        }
        if let Some(normals) = &normals {
            if normals.len() != positions.len() {
                return Err(GeometryError::NormalCount {
                    positions: positions.len(),
                    normals: normals.len(),
                });
            }
            if let Some(index) = normals.iter().position(|normal| !normal.is_finite()) {
                return Err(GeometryError::NonFiniteElement { what: "normal", index });
            }
        }
        let vertices = positions.len();
        for (count, most) in [(indices.len(), MAX_INDEX), (vertices, u32::MAX as usize)] {
            if count > most {
                return Err(GeometryError::TooManyPrimitives { count });
            }
        }
        for (triangle, corners) in indices.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|&&vertex| vertex as usize >= vertices) {
                return Err(GeometryError::IndexOutOfRange { triangle, vertex, vertices });
            }
        }

        // Before anything is dropped: a triangle without area may still join its neighbours.
        let border = Border::of(&positions, &indices);
        let count = indices.len();
        let mut triangles = indices;
        let has_area =
            |triangle: &[u32; 3]| cross(triangle.map(|vertex| positions[vertex as usize])).length() > 0.0;
        triangles.retain(has_area);
        if triangles.is_empty() {
            return Err(GeometryError::Degenerate { what: "a mesh" });
        }
        let dropped = count - triangles.len();
        let normals = normals.map(|normals| normals.into_iter().map(unit).collect());
        Ok(Self::with_surface(Surface::new(positions, triangles, normals, border, dropped)))
    }

    fn with_surface(surface: Surface) -> Self {
        let bounds = surface.bounds();
        Self { surface: Arc::new(surface), placement: None, bounds, own_areas: OnceLock::new() }
    }

    /// A copy in another place, which shares the triangles. `to_scene` maps all corners from where they are
    /// in this mesh; it may mirror, stretch and shear, and the normals still point outwards.
    ///
    /// A scene with many copies of a mesh needs memory for one of them, and all but the first are made
    /// without a look at each triangle; rays take somewhat longer to find their way than to triangles of a
    /// mesh of its own, and meet the same.
    pub fn placed(&self, to_scene: &Affine3A) -> Result<Self, GeometryError> {
        let placement = self.placement_by(to_scene)?;
        let bounds = self.surface.model().bounds_of_copy(&placement);
        let (surface, placement) = (self.surface.clone(), Some(placement));
        Self { surface, placement, bounds, own_areas: OnceLock::new() }.checked()
    }

    /// The mesh in another place with triangles of its own: the corners are those of a copy that is
    /// [placed](Self::placed).
    pub fn transformed(&self, to_scene: &Affine3A) -> Result<Self, GeometryError> {
        let placement = self.placement_by(to_scene)?;
        let Surface { positions, triangles, normals, border, dropped, .. } = &*self.surface;
        let positions = positions.iter().map(|position| placement.point(*position)).collect();
        let triangles = triangles.iter().map(|triangle| placement.winding(*triangle)).collect();
        let normals = normals.as_ref();
        let normals = normals.map(|normals| normals.iter().map(|normal| placement.normal(*normal)).collect());
        let mut surface = Surface::new(positions, triangles, normals, *border, *dropped);
        surface.rounded = placement.rounded(self.surface.rounded.max(largest(self.surface.bounds())));
        if *border == Border::Nowhere {
            surface.set_signed_volume(self.surface.signed_volume() * placement.volume_ratio());
        }
        Self::with_surface(surface).checked()
    }

    /// The placement of a copy of this mesh.
    fn placement_by(&self, to_scene: &Affine3A) -> Result<Placement, GeometryError> {
        let placement = Placement::new(to_scene)?;
        match &self.placement {
            Some(first) => placement.after(first),
            None => Ok(placement),
        }
    }

    /// The mesh, unless it has been placed where it is lost in rounding.
    fn checked(self) -> Result<Self, GeometryError> {
        let (min, max) = self.bounds;
        if !(min.is_finite() && max.is_finite()) {
            return Err(GeometryError::NonFinite { what: "a corner of a placed mesh" });
        }
        if self.each().all(|corners| cross(corners) == DVec3::ZERO) {
            return Err(GeometryError::Degenerate { what: "a placed mesh" });
        }
        Ok(self)
    }

    pub(super) fn translated(mut self, by: Vec3) -> Self {
        self.bounds = if let Some(placement) = &mut self.placement {
            *placement = placement.translated(by);
            self.surface.model().bounds_of_copy(placement)
        } else {
            let surface = Arc::make_mut(&mut self.surface);
            surface.translate(by);
            surface.bounds()
        };
        self.own_areas = OnceLock::new();
        self
    }

    /// The number of triangles that are in use.
    #[must_use]
    pub fn triangle_count(&self) -> u32 {
        self.surface.count()
    }

    /// The map to the scene, of a copy.
    pub(super) fn placement(&self) -> Option<&Placement> {
        self.placement.as_ref()
    }

    /// The hierarchy over the triangles in coordinates of their own, which all copies share.
    pub(super) fn model(&self) -> &Arc<Model> {
        self.surface.model()
    }

    /// The least and the greatest coordinates before a copy is placed.
    pub(super) fn bounds_in_mesh(&self) -> (Vec3, Vec3) {
        self.surface.bounds()
    }

    /// Corners of a triangle as numbers of positions.
    fn vertices(&self, triangle: u32) -> [u32; 3] {
        let vertices = self.surface.triangles[triangle as usize];
        self.placement.map_or(vertices, |placement| placement.winding(vertices))
    }

    /// The number of triangles without area that were left out.
    #[must_use]
    pub fn dropped_triangles(&self) -> usize {
        self.surface.dropped
    }

    /// The corners of a triangle, counter-clockwise as seen from the front.
    ///
    /// # Panics
    /// If there is no such triangle.
    #[must_use]
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        let corners = self.vertices(triangle).map(|vertex| self.surface.positions[vertex as usize]);
        match &self.placement {
            None => corners,
            Some(placement) => corners.map(|corner| placement.point(corner)),
        }
    }

    fn each(&self) -> impl Iterator<Item = [Vec3; 3]> {
        (0..self.triangle_count()).map(|triangle| self.corners(triangle))
    }

    /// Surface area, square scene units.
    #[must_use]
    pub fn area(&self) -> f32 {
        let (areas, factor) = self.areas();
        (areas.total() * factor) as f32
    }

    /// Areas of the triangles, and the factor that they are still to be multiplied by.
    fn areas(&self) -> (&Areas, f64) {
        if self.placement.is_none() {
            return (self.surface.areas(), 1.0);
        }
        match self.even_factor() {
            Some(factor) => (self.surface.areas(), factor),
            None => (self.own_areas.get_or_init(|| Areas::of(self.each())), 1.0),
        }
    }

    /// Factor of all areas of a copy that is scaled evenly, in a place where its corners keep their digits.
    /// The area of a triangle under another map depends on its plane.
    fn even_factor(&self) -> Option<f64> {
        let placement = self.placement.as_ref()?;
        let factor = placement.squared_scale()?;
        self.surface.areas().allow(self.rounding(placement) / factor.sqrt()).then_some(factor)
    }

    /// The enclosed volume, cubic scene units: negative if the normals point inwards, and without meaning
    /// if the mesh is not closed.
    ///
    /// That of a mesh that is [placed](Self::placed) or [transformed](Self::transformed) is the volume of the
    /// first one times the determinant of the map: it does not depend on how corners are rounded in their
    /// place.
    #[must_use]
    pub fn signed_volume(&self) -> f32 {
        let volume = self.surface.signed_volume();
        // The corners of a mirrored copy go round the other way, so that the sign remains.
        self.placement.map_or(volume, |placement| volume * placement.volume_ratio()) as f32
    }

    /// The mean direction of the triangles' geometric normals, and the least cosine between it and any of
    /// them; `None` if the normals cancel.
    #[must_use]
    pub fn normal_cone(&self) -> Option<(Vec3, f32)> {
        let Some(placement) = &self.placement else { return self.surface.normal_cone() };
        if self.even_factor().is_none() {
            return normal_cone(|| self.each());
        }
        let (axis, cos) = self.surface.normal_cone()?;
        // Normals in the scene are rounded apart from those of the mesh.
        Some((placement.normal(axis), (cos - 8.0 * f32::EPSILON).max(-1.0)))
    }

    /// A point distributed uniformly over the surface, and the geometric normal; `u` in `[0, 1)²`.
    #[must_use]
    pub fn sample_area(&self, u: [f32; 2]) -> (Vec3, Vec3) {
        let (areas, _) = self.areas();
        let target = f64::from(u[0]) * areas.total();
        let areas = &areas.cumulative;
        let triangle = areas.partition_point(|&sum| sum <= target).min(areas.len() - 1);
        let before = if triangle == 0 { 0.0 } else { areas[triangle - 1] };
        // The rest of the random number inside the triangle is uniform again.
        let left = ((target - before) / (areas[triangle] - before)).clamp(0.0, 1.0);
        let root = left.sqrt();
        let (b, c) = (root * (1.0 - f64::from(u[1])), root * f64::from(u[1]));
        (self.point(triangle as u32, b, c).as_vec3(), self.geometric_normal(triangle as u32))
    }

    /// The cells that cover the inside of a closed mesh; those that all copies share where their corners keep
    /// enough digits, with the place of this one.
    pub(super) fn cells(&self) -> (Arc<Cells>, Option<Placement>) {
        let bounds = self.surface.bounds();
        let unplaced =
            || Self { surface: self.surface.clone(), placement: None, bounds, own_areas: OnceLock::new() };
        let cells = || self.surface.cells(|| Cells::cover(&unplaced())).clone();
        let Some(placement) = self.placement else { return (cells(), None) };
        // Of the placement and of what is drawn: a few roundings each.
        let error = placement.size_in_mesh(8.0 * self.rounding(&placement));
        let shared = Some(cells()).filter(|cells| cells.allow(error));
        shared.map_or_else(|| (Arc::new(Cells::cover(self)), None), |shared| (shared, Some(placement)))
    }

    /// Error of the corners of a copy, scene units.
    fn rounding(&self, placement: &Placement) -> f64 {
        let (min, max) = self.surface.bounds();
        f64::from(f32::EPSILON * placement.reach(min.abs().max(max.abs())))
    }

    /// Whether every edge joins exactly two triangles that are wound alike.
    ///
    /// Vertices at the same position count as one, so that seams of normals or textures do not matter.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.border() == Border::Nowhere
    }

    /// The edges that keep the mesh from being closed.
    #[must_use]
    pub fn border(&self) -> Border {
        self.surface.border
    }

    /// A point of each piece of the mesh, amid its largest triangle, and the unit normal there. Pieces have
    /// no corner in common.
    ///
    /// Found when they are first asked for, once for all copies.
    pub fn pieces(&self) -> impl ExactSizeIterator<Item = (Vec3, Vec3)> {
        let centre = |&triangle: &u32| {
            (self.point(triangle, 1.0 / 3.0, 1.0 / 3.0).as_vec3(), self.geometric_normal(triangle))
        };
        self.surface.pieces().iter().map(centre)
    }

    /// Whether `point` lies inside; `None` for a mesh that is not closed.
    ///
    /// Tests all triangles; [`SceneGeometry::contains`](super::SceneGeometry::contains) has a hierarchy.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> Option<bool> {
        self.contains_by(point, |ray| {
            let shear = RayShear::new(ray.origin, ray.direction);
            let met = self.each().filter_map(|corners| shear.intersect(corners));
            met.filter(|hit| hit.t > 0.0).count()
        })
    }

    /// [`contains`](Self::contains) by the number of times that a ray crosses the mesh, which is asked for
    /// only where it matters.
    ///
    /// The intersection test decides edges and corners consistently, so that any direction gives the right
    /// parity; but for a point of the surface, which a ray does not cross where it starts: amid a face two
    /// opposite directions differ. At the edge of a dent both may go inside, and the point counts as inside.
    pub(super) fn contains_by(&self, point: Vec3, crossings: impl Fn(Ray) -> usize) -> Option<bool> {
        if !self.is_closed() {
            return None;
        }
        let (min, max) = self.bounds;
        if !(min.cmple(point).all() && point.cmple(max).all()) {
            return Some(false);
        }
        let direction = Vec3::new(0.267_261_24, 0.534_522_5, 0.801_783_7);
        // No triangle is farther away than half of this.
        let farthest = 2.0 * (max - min).element_sum();
        let is_odd = |direction| crossings(Ray::new(point, direction).with_range(0.0, farthest)) % 2 == 1;
        Some(is_odd(direction) && is_odd(-direction))
    }

    /// The least and the greatest coordinates.
    #[must_use]
    pub fn aabb(&self) -> (Vec3, Vec3) {
        self.bounds
    }

    /// Along each axis the largest number that was rounded on the way to the coordinates of a triangle's
    /// corners: planes that are meant to be one differ by roundings of these.
    #[must_use]
    pub fn rounded(&self, triangle: u32) -> Vec3 {
        let [a, b, c] = self.corners(triangle).map(Vec3::abs);
        self.rounded_by_placing().max(a.max(b).max(c))
    }

    /// The most that [`rounded`](Self::rounded) is for any triangle.
    #[must_use]
    pub fn most_rounded(&self) -> Vec3 {
        self.rounded_by_placing().max(largest(self.bounds))
    }

    /// Numbers that were rounded when the mesh was placed or transformed; zero if it was not.
    fn rounded_by_placing(&self) -> Vec3 {
        let before = self.surface.rounded;
        self.placement
            .as_ref()
            .map_or(before, |placement| placement.rounded(before.max(largest(self.surface.bounds()))))
    }

    /// The point with weights `b` and `c` for the second and third corner.
    pub(super) fn point(&self, triangle: u32, b: f64, c: f64) -> DVec3 {
        let [p, q, r] = self.corners(triangle).map(Vec3::as_dvec3);
        // From one corner along the edges: the point stays in the plane whatever the weights' errors.
        p + (q - p) * b + (r - p) * c
    }

    /// A vector across the plane of a triangle, on the side of its unit normal.
    pub(super) fn across(&self, triangle: u32) -> DVec3 {
        cross(self.corners(triangle))
    }

    /// The unit normal of the plane of a triangle; zero for one that a copy has flattened.
    pub(super) fn geometric_normal(&self, triangle: u32) -> Vec3 {
        self.across(triangle).normalize_or_zero().as_vec3()
    }

    /// The interpolated normal, in the hemisphere of `geometric`.
    pub(super) fn shading_normal(&self, triangle: u32, b: f32, c: f32, geometric: Vec3) -> Vec3 {
        let Some(normals) = &self.surface.normals else { return geometric };
        let mut corners = self.vertices(triangle).map(|vertex| normals[vertex as usize]);
        if let Some(placement) = &self.placement {
            corners = corners.map(|normal| placement.normal(normal));
        }
        let [p, q, r] = corners;
        match (p * (1.0 - b - c) + q * b + r * c).try_normalize() {
            Some(normal) if normal.dot(geometric) < 0.0 => -normal,
            Some(normal) => normal,
            None => geometric,
        }
    }
}

/// The largest coordinate along each axis.
fn largest((min, max): (Vec3, Vec3)) -> Vec3 {
    min.abs().max(max.abs())
}

#[cfg(test)]
mod tests;
