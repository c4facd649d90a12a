//! The triangle mesh.

use std::sync::{Arc, OnceLock};

use glam::{Affine3A, DVec3, Vec3};

use super::error::GeometryError;
use super::placement::{Placement, unit};
use super::triangle::RayShear;
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
    /// Area of the triangles up to and including each, once it is asked for.
    cumulative_area: OnceLock<Vec<f64>>,
}

/// Triangles in coordinates of their own.
#[derive(Clone, Debug)]
struct Surface {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    normals: Option<Vec<Vec3>>,
    border: Border,
    dropped: usize,
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
        let surface = Arc::new(Surface { positions, triangles, normals, border, dropped });
        Ok(Self::with_surface(surface, None))
    }

    fn with_surface(surface: Arc<Surface>, placement: Option<Placement>) -> Self {
        let mut mesh = Self {
            surface,
            placement,
            bounds: (Vec3::INFINITY, Vec3::NEG_INFINITY),
            cumulative_area: OnceLock::new(),
        };
        for triangle in 0..mesh.triangle_count() {
            for corner in mesh.corners(triangle) {
                mesh.bounds = (mesh.bounds.0.min(corner), mesh.bounds.1.max(corner));
            }
        }
        mesh
    }

    /// A copy in another place, which shares the triangles. `to_scene` maps all corners from where they are
    /// in this mesh; it may mirror, stretch and shear, and the normals still point outwards.
    ///
    /// A scene with many copies of a mesh needs memory for one of them; rays take somewhat longer to find
    /// their way than to triangles of a mesh of its own, and meet the same.
    pub fn placed(&self, to_scene: &Affine3A) -> Result<Self, GeometryError> {
        let mut placement = Placement::new(to_scene)?;
        if let Some(first) = &self.placement {
            placement = placement.after(first)?;
        }
        let mesh = Self::with_surface(self.surface.clone(), Some(placement));
        let (min, max) = mesh.bounds;
        if !(min.is_finite() && max.is_finite()) {
            return Err(GeometryError::NonFinite { what: "a corner of a placed mesh" });
        }
        if (0..mesh.triangle_count()).all(|triangle| cross(mesh.corners(triangle)) == DVec3::ZERO) {
            return Err(GeometryError::Degenerate { what: "a placed mesh" });
        }
        Ok(mesh)
    }

    /// The same mesh with triangles of its own, in the same place: no copy any more.
    #[must_use]
    pub fn unshared(self) -> Self {
        let Some(placement) = self.placement else { return self };
        let Surface { positions, triangles, normals, border, dropped } = &*self.surface;
        let surface = Surface {
            positions: positions.iter().map(|position| placement.point(*position)).collect(),
            triangles: (0..triangles.len() as u32).map(|triangle| self.vertices(triangle)).collect(),
            normals: normals
                .as_ref()
                .map(|normals| normals.iter().map(|normal| placement.normal(*normal)).collect()),
            border: *border,
            dropped: *dropped,
        };
        Self { surface: Arc::new(surface), placement: None, ..self }
    }

    pub(super) fn translated(mut self, by: Vec3) -> Self {
        match &mut self.placement {
            Some(placement) => *placement = placement.translated(by),
            None => {
                Arc::make_mut(&mut self.surface).positions.iter_mut().for_each(|position| *position += by);
            }
        }
        let (min, max) = self.bounds;
        Self { bounds: (min + by, max + by), ..self }
    }

    /// The number of triangles that are in use.
    #[must_use]
    pub fn triangle_count(&self) -> u32 {
        self.surface.triangles.len() as u32
    }

    /// The map to the scene, of a copy.
    pub(super) fn placement(&self) -> Option<&Placement> {
        self.placement.as_ref()
    }

    /// The mesh in coordinates of its own.
    pub(super) fn model(&self) -> Self {
        Self::with_surface(self.surface.clone(), None)
    }

    /// A number that all copies share, and no other mesh that exists.
    pub(super) fn number(&self) -> usize {
        Arc::as_ptr(&self.surface) as usize
    }

    /// Corners of a triangle as numbers of positions.
    fn vertices(&self, triangle: u32) -> [u32; 3] {
        let [a, b, c] = self.surface.triangles[triangle as usize];
        if self.placement.is_some_and(|placement| placement.mirrors) { [a, c, b] } else { [a, b, c] }
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

    /// Surface area, square scene units.
    #[must_use]
    pub fn area(&self) -> f32 {
        self.cumulative_area().last().copied().unwrap_or(0.0) as f32
    }

    fn cumulative_area(&self) -> &[f64] {
        self.cumulative_area.get_or_init(|| {
            let mut total = 0.0;
            let up_to = |triangle| {
                total += 0.5 * cross(self.corners(triangle)).length();
                total
            };
            (0..self.triangle_count()).map(up_to).collect()
        })
    }

    /// The enclosed volume, cubic scene units: negative if the normals point inwards, and without meaning
    /// if the mesh is not closed.
    #[must_use]
    pub fn signed_volume(&self) -> f32 {
        // From a point near the mesh: from a far one the terms cancel.
        let from = self.bounds.0.as_dvec3();
        let sum: f64 = (0..self.triangle_count())
            .map(|triangle| {
                let [a, b, c] = self.corners(triangle).map(|corner| corner.as_dvec3() - from);
                a.dot(b.cross(c))
            })
            .sum();
        (sum / 6.0) as f32
    }

    /// A point distributed uniformly over the surface, and the geometric normal; `u` in `[0, 1)²`.
    #[must_use]
    pub fn sample_area(&self, u: [f32; 2]) -> (Vec3, Vec3) {
        let areas = self.cumulative_area();
        let total = areas.last().copied().unwrap_or(0.0);
        let target = f64::from(u[0]) * total;
        let triangle = areas.partition_point(|&sum| sum <= target).min(areas.len() - 1);
        let before = if triangle == 0 { 0.0 } else { areas[triangle - 1] };
        // The rest of the random number inside the triangle is uniform again.
        let left = ((target - before) / (areas[triangle] - before)).clamp(0.0, 1.0);
        let root = left.sqrt();
        let (b, c) = (root * (1.0 - f64::from(u[1])), root * f64::from(u[1]));
        (self.point(triangle as u32, b, c).as_vec3(), self.geometric_normal(triangle as u32))
    }

    /// Whether every edge joins exactly two triangles that are wound alike.
    ///
    /// Vertices at the same position count as one, so that seams of normals or textures do not matter.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.surface.border == Border::Nowhere
    }

    /// Whether the mesh would be closed if some of its triangles were wound the other way.
    #[must_use]
    pub fn has_mixed_winding(&self) -> bool {
        self.surface.border == Border::BetweenWindings
    }

    /// Whether `point` lies inside; `None` for a mesh that is not closed.
    ///
    /// Tests all triangles; [`SceneGeometry::contains`](super::SceneGeometry::contains) has a hierarchy.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> Option<bool> {
        self.contains_by(point, |ray| {
            let shear = RayShear::new(ray.origin, ray.direction);
            let met =
                (0..self.triangle_count()).filter_map(|triangle| shear.intersect(self.corners(triangle)));
            met.filter(|hit| hit.t > 0.0).count()
        })
    }

    /// [`contains`](Self::contains) by the number of times that a ray crosses the mesh, which is asked for
    /// only where it matters.
    ///
    /// The intersection test decides edges and corners consistently, so that any direction gives the right
    /// parity.
    pub(super) fn contains_by(&self, point: Vec3, crossings: impl FnOnce(Ray) -> usize) -> Option<bool> {
        if !self.is_closed() {
            return None;
        }
        let (min, max) = self.bounds;
        if !(min.cmple(point).all() && point.cmple(max).all()) {
            return Some(false);
        }
        let ray = Ray::new(point, Vec3::new(0.267_261_24, 0.534_522_5, 0.801_783_7));
        // No triangle is farther away than half of this.
        let ray = ray.with_range(0.0, 2.0 * (max - min).element_sum());
        Some(crossings(ray) % 2 == 1)
    }

    /// The least and the greatest coordinates.
    #[must_use]
    pub fn aabb(&self) -> (Vec3, Vec3) {
        self.bounds
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

    /// The unit normal of the plane of a triangle.
    pub(super) fn geometric_normal(&self, triangle: u32) -> Vec3 {
        self.across(triangle).normalize().as_vec3()
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

/// The normal of a triangle, of twice its area in length; in double precision, so that that of a small
/// triangle does not vanish.
fn cross(corners: [Vec3; 3]) -> DVec3 {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    (b - a).cross(c - a)
}

/// The edges at which a mesh ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Border {
    /// Every edge joins exactly two triangles that are wound alike.
    Nowhere,
    /// Every edge joins exactly two triangles, but not all are wound alike.
    BetweenWindings,
    /// There are edges of one triangle, or of more than two.
    Somewhere,
}

impl Border {
    /// The border of these triangles; equal positions count as one.
    fn of(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        // Adding zero turns −0 into +0, which is the same place.
        let key = |vertex: u32| positions[vertex as usize].to_array().map(|x| (x + 0.0).to_bits());
        let mut order: Vec<u32> = (0..positions.len() as u32).collect();
        order.sort_unstable_by_key(|&vertex| key(vertex));
        let mut place = vec![0; positions.len()];
        for pair in order.windows(2) {
            let step = u32::from(key(pair[0]) != key(pair[1]));
            place[pair[1] as usize] = place[pair[0] as usize] + step;
        }

        let mut edges: Vec<(u32, u32, bool)> = Vec::with_capacity(3 * triangles.len());
        for triangle in triangles {
            let [a, b, c] = triangle.map(|vertex| place[vertex as usize]);
            if a == b || b == c || c == a {
                continue;
            }
            edges.extend([(a, b), (b, c), (c, a)].map(|(from, to)| (from.min(to), from.max(to), from < to)));
        }
        edges.sort_unstable();
        let (pairs, rest) = edges.as_chunks::<2>();
        // The same edge in two pairs would join four triangles.
        let joins_two = !pairs.is_empty()
            && rest.is_empty()
            && pairs.iter().all(|[first, second]| (first.0, first.1) == (second.0, second.1))
            && pairs.windows(2).all(|two| (two[0][0].0, two[0][0].1) != (two[1][0].0, two[1][0].1));
        if !joins_two {
            Self::Somewhere
        } else if pairs.iter().all(|[first, second]| first.2 != second.2) {
            Self::Nowhere
        } else {
            Self::BetweenWindings
        }
    }
}
