//! The triangle mesh.

use glam::{DVec3, Vec3};

use super::error::GeometryError;
use super::triangle::RayShear;

/// Triangles over shared vertices.
///
/// The winding gives the normal: it points to where the vertices are seen counter-clockwise. A closed mesh
/// must be wound so that normals point outwards; [`TriangleMesh::signed_volume`] is negative otherwise.
#[derive(Clone, Debug)]
pub struct TriangleMesh {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    normals: Option<Vec<Vec3>>,
    /// Area of the triangles up to and including each.
    cumulative_area: Vec<f64>,
    bounds: (Vec3, Vec3),
    closed: bool,
    dropped: usize,
}

impl TriangleMesh {
    /// The mesh of triangles that index `positions`; with `normals`, one per position, it is shaded smoothly.
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
        let closed = is_closed(&positions, &indices);
        let count = indices.len();
        let mut triangles = indices;
        triangles.retain(|&triangle| doubled_area(&positions, triangle) > 0.0);
        if triangles.is_empty() {
            return Err(GeometryError::Degenerate { what: "a mesh" });
        }
        let mut total = 0.0;
        let cumulative_area = triangles
            .iter()
            .map(|&triangle| {
                total += 0.5 * doubled_area(&positions, triangle);
                total
            })
            .collect();
        let mut bounds = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &vertex in triangles.iter().flatten() {
            let position = positions[vertex as usize];
            bounds = (bounds.0.min(position), bounds.1.max(position));
        }
        let dropped = count - triangles.len();
        Ok(Self { positions, triangles, normals, cumulative_area, bounds, closed, dropped })
    }

    pub(super) fn translated(mut self, by: Vec3) -> Self {
        self.positions.iter_mut().for_each(|position| *position += by);
        let (min, max) = self.bounds;
        Self { bounds: (min + by, max + by), ..self }
    }

    /// The vertex positions.
    #[must_use]
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// The triangles that are in use, as indices of positions.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The number of triangles without area that were left out.
    #[must_use]
    pub fn dropped_triangles(&self) -> usize {
        self.dropped
    }

    /// The corners of a triangle.
    pub(super) fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|vertex| self.positions[vertex as usize])
    }

    /// Surface area, square scene units.
    #[must_use]
    pub fn area(&self) -> f32 {
        self.cumulative_area.last().copied().unwrap_or(0.0) as f32
    }

    /// The enclosed volume, cubic scene units: negative if the normals point inwards, and without meaning
    /// if the mesh is not closed.
    #[must_use]
    pub fn signed_volume(&self) -> f32 {
        // From a point near the mesh: from a far one the terms cancel.
        let from = self.bounds.0.as_dvec3();
        let sum: f64 = (0..self.triangles.len() as u32)
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
        let total = self.cumulative_area.last().copied().unwrap_or(0.0);
        let target = f64::from(u[0]) * total;
        let triangle =
            self.cumulative_area.partition_point(|&sum| sum <= target).min(self.triangles.len() - 1);
        let before = if triangle == 0 { 0.0 } else { self.cumulative_area[triangle - 1] };
        // The rest of the random number inside the triangle is uniform again.
        let left = ((target - before) / (self.cumulative_area[triangle] - before)).clamp(0.0, 1.0);
        let root = left.sqrt();
        let (b, c) = (root * (1.0 - f64::from(u[1])), root * f64::from(u[1]));
        (self.point(triangle as u32, b, c), self.geometric_normal(triangle as u32))
    }

    /// Whether every edge joins exactly two triangles that are wound alike.
    ///
    /// Vertices at the same position count as one, so that seams of normals or textures do not matter.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// Whether `point` lies inside; `None` for a mesh that is not closed.
    ///
    /// Counts the crossings of a ray. The intersection test decides edges and corners consistently, so
    /// that any direction gives the right parity.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> Option<bool> {
        if !self.closed {
            return None;
        }
        if !(self.bounds.0.cmple(point).all() && point.cmple(self.bounds.1).all()) {
            return Some(false);
        }
        let shear = RayShear::new(point, Vec3::new(0.267_261_24, 0.534_522_5, 0.801_783_7));
        let crossings = (0..self.triangles.len() as u32)
            .filter_map(|triangle| shear.intersect(self.corners(triangle)))
            .filter(|hit| hit.t > 0.0)
            .count();
        Some(crossings % 2 == 1)
    }

    /// The least and the greatest coordinates.
    #[must_use]
    pub fn aabb(&self) -> (Vec3, Vec3) {
        self.bounds
    }

    /// The point with weights `b` and `c` for the second and third corner, rounded once.
    pub(super) fn point(&self, triangle: u32, b: f64, c: f64) -> Vec3 {
        let [p, q, r] = self.corners(triangle).map(Vec3::as_dvec3);
        // From one corner along the edges: the point stays in the plane whatever the weights' errors.
        (p + (q - p) * b + (r - p) * c).as_vec3()
    }

    /// The unit normal of the plane of a triangle.
    pub(super) fn geometric_normal(&self, triangle: u32) -> Vec3 {
        cross(&self.positions, self.triangles[triangle as usize]).normalize().as_vec3()
    }

    /// The interpolated normal, in the hemisphere of `geometric`.
    pub(super) fn shading_normal(&self, triangle: u32, b: f32, c: f32, geometric: Vec3) -> Vec3 {
        let Some(normals) = &self.normals else { return geometric };
        let [p, q, r] = self.triangles[triangle as usize].map(|vertex| normals[vertex as usize]);
        match (p * (1.0 - b - c) + q * b + r * c).try_normalize() {
            Some(normal) if normal.dot(geometric) < 0.0 => -normal,
            Some(normal) => normal,
            None => geometric,
        }
    }
}

/// The normal of a triangle, of twice its area in length; in double precision, so that that of a small
/// triangle does not vanish.
fn cross(positions: &[Vec3], triangle: [u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|vertex| positions[vertex as usize].as_dvec3());
    (b - a).cross(c - a)
}

fn doubled_area(positions: &[Vec3], triangle: [u32; 3]) -> f64 {
    cross(positions, triangle).length()
}

/// Whether every edge joins exactly two triangles that are wound alike; equal positions count as one.
fn is_closed(positions: &[Vec3], triangles: &[[u32; 3]]) -> bool {
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
    !pairs.is_empty()
        && rest.is_empty()
        && pairs.iter().all(|[first, second]| {
            (first.0, first.1) == (second.0, second.1) && first.2 != second.2
        })
        // The same edge in two pairs would join four triangles.
        && pairs.windows(2).all(|two| (two[0][0].0, two[0][0].1) != (two[1][0].0, two[1][0].1))
}
