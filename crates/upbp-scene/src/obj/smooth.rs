//! Normals at corners, for meshes that come without.

use glam::DVec3;

use super::ObjMesh;

/// The most triangles around a vertex: each is compared with each.
const MAX_AROUND: usize = if cfg!(test) { 1 << 8 } else { 1 << 12 };

/// The most of these comparisons in a mesh.
const MAX_COMPARISONS: u64 = if cfg!(test) { 1 << 18 } else { 1 << 32 };

impl ObjMesh {
    /// The mesh with normals: at each corner of a triangle the mean, by angle, of those of the triangles
    /// around the vertex whose planes differ from the triangle's own by at most so many degrees. A vertex
    /// whose triangles do not agree becomes several in one place.
    ///
    /// # Errors
    ///
    /// If the mesh has normals, more than 4096 triangles around a vertex, or many vertices with nearly as
    /// many.
    ///
    /// # Panics
    ///
    /// If a triangle has a vertex that does not exist.
    pub fn smoothed(self, degrees: f32) -> Result<Self, String> {
        if self.normals.is_some() {
            return Err("has normals of its own, and `smooth_degrees` is for meshes without".into());
        }
        let vertices = self.indices.as_flattened();
        let place = |corner: usize| self.positions[vertices[corner] as usize].as_dvec3();
        // Zero for triangles without area, which count for nothing.
        let plane = |triangle| {
            let [a, b, c] = [0, 1, 2].map(|corner| place(3 * triangle + corner));
            (b - a).cross(c - a).normalize_or_zero()
        };
        let planes: Vec<DVec3> = (0..self.indices.len()).map(plane).collect();
        let angle = |corner: usize| {
            let [at, next, last] = [0, 1, 2].map(|step| place(corner - corner % 3 + (corner + step) % 3));
            let (u, v) = (next - at, last - at);
            u.cross(v).length().atan2(u.dot(v))
        };
        // The chord between unit normals keeps its digits at small angles; the rest is rounding.
        let farthest = 2.0 * (0.5 * f64::from(degrees).to_radians()).sin() + 1e-6;

        let mut order: Vec<usize> = (0..vertices.len()).collect();
        order.sort_by_key(|&corner| vertices[corner]);
        let (mut positions, mut normals) = (Vec::new(), Vec::new());
        let mut indices = vec![[0; 3]; self.indices.len()];
        let mut comparisons = 0;
        for around in order.chunk_by(|&a, &b| vertices[a] == vertices[b]) {
            let position = self.positions[vertices[around[0]] as usize];
            if around.len() > MAX_AROUND {
                let count = around.len();
                return Err(format!(
                    "{count} triangles meet at {position}, and `smooth_degrees` compares at most {MAX_AROUND}"
                ));
            }
            comparisons += (around.len() * around.len()) as u64;
            if comparisons > MAX_COMPARISONS {
                return Err(format!(
                    "too many triangles meet at its vertices, {} at {position}, for `smooth_degrees`",
                    around.len()
                ));
            }
            let weighted: Vec<_> = around.iter().map(|&corner| (planes[corner / 3], angle(corner))).collect();
            let first = normals.len();
            for (&corner, (own, _)) in around.iter().zip(&weighted) {
                let alike = weighted.iter().filter(|(plane, _)| plane.distance(*own) <= farthest);
                let sum: DVec3 = alike.map(|(plane, angle)| *plane * *angle).sum();
                // What cancels has no direction.
                let normal = if sum.dot(*own) > 1e-6 { sum.normalize() } else { *own }.as_vec3();
                let known = normals[first..].iter().position(|known| *known == normal);
                if known.is_none() {
                    positions.push(position);
                    normals.push(normal);
                }
                let number = known.map_or(normals.len() - 1, |known| first + known);
                indices.as_flattened_mut()[corner] = number as u32;
            }
        }
        Ok(Self { positions, indices, normals: Some(normals) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// A cylinder about the y axis with caps, of quads and two polygons as a file would have them.
    fn cylinder(sides: u32) -> ObjMesh {
        let ring = |y: f32| {
            (0..sides).map(move |side| {
                let (sin, cos) = (side as f32 / sides as f32 * std::f32::consts::TAU).sin_cos();
                Vec3::new(cos, y, sin)
            })
        };
        let positions = ring(0.0).chain(ring(3.0)).collect();
        let next = |side: u32| (side + 1) % sides;
        let wall = (0..sides).flat_map(|a| [[a, a + sides, next(a)], [next(a), a + sides, next(a) + sides]]);
        let caps = (2..sides).flat_map(|a| [[0, a - 1, a], [sides, sides + a, sides + a - 1]]);
        ObjMesh { positions, indices: wall.chain(caps).collect(), normals: None }
    }

    /// Position, normal and the normal of the plane at each corner of a triangle.
    fn corners(mesh: &ObjMesh) -> impl Iterator<Item = (Vec3, Vec3, Vec3)> {
        let normals = mesh.normals.as_ref().unwrap();
        mesh.indices.iter().flat_map(move |triangle| {
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
            let plane = (b - a).cross(c - a).normalize();
            triangle.map(|vertex| (mesh.positions[vertex as usize], normals[vertex as usize], plane))
        })
    }

    #[test]
    fn a_cylinder_is_round_at_its_side_and_flat_at_its_caps() {
        let smooth = cylinder(24).smoothed(30.0).unwrap();
        // Every vertex has a normal of the side and one of a cap.
        assert_eq!(smooth.positions.len(), 4 * 24);
        for (position, normal, plane) in corners(&smooth) {
            let expected = if plane.y.abs() > 0.5 { plane } else { position.with_y(0.0) };
            assert!(normal.distance(expected) < 1e-6, "{position}: {normal}, expected {expected}");
        }
        // The planes of the side differ by 15 degrees, and those of the caps from them by 90.
        let count = |degrees: f32| cylinder(24).smoothed(degrees).unwrap().positions.len();
        assert_eq!([14.9, 15.0, 89.9, 90.0].map(count), [6 * 24, 4 * 24, 4 * 24, 2 * 24]);
        let flat = cylinder(24).smoothed(0.0).unwrap();
        assert!(corners(&flat).all(|(_, normal, plane)| normal.distance(plane) < 1e-6));
    }

    #[test]
    fn a_regular_solid_looks_like_a_sphere() {
        let positions = [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|axis| [axis, -axis]).collect();
        let mut indices = Vec::new();
        for [x, y, z] in [[0_u32, 2, 4], [0, 3, 5], [1, 2, 5], [1, 3, 4]] {
            indices.extend([[x, y, z], [x ^ 1, z ^ 1, y ^ 1]]);
        }
        let octahedron = ObjMesh { positions, indices, normals: None };
        let smooth = octahedron.smoothed(110.0).unwrap();
        assert_eq!(smooth.positions.len(), 6);
        for (position, normal, plane) in corners(&smooth) {
            assert!(plane.dot(position) > 0.5, "wound outwards");
            assert!(normal.distance(position) < 1e-6, "{position}: {normal}");
        }
    }

    #[test]
    fn normals_that_cancel_are_those_of_the_planes() {
        // The front and the back of one triangle.
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        let sheet = ObjMesh { positions, indices: vec![[0, 1, 2], [0, 2, 1]], normals: None };
        let smooth = sheet.smoothed(180.0).unwrap();
        assert!(corners(&smooth).all(|(_, normal, plane)| normal == plane));
    }

    #[test]
    fn what_cannot_be_smoothed_is_refused() {
        let normals = Some(vec![Vec3::Y; 48]);
        let error = ObjMesh { normals, ..cylinder(24) }.smoothed(30.0).unwrap_err();
        assert_eq!(error, "has normals of its own, and `smooth_degrees` is for meshes without");
        let fan = |count: usize| {
            let indices = vec![[0, 1, 2]; count];
            ObjMesh { positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y], indices, normals: None }.smoothed(1.0)
        };
        assert!(fan(MAX_AROUND).is_ok());
        let expected = format!(
            "{} triangles meet at [0, 0, 0], and `smooth_degrees` compares at most {MAX_AROUND}",
            MAX_AROUND + 1
        );
        assert_eq!(fan(MAX_AROUND + 1).unwrap_err(), expected);
        // Fans beside each other.
        let fans = |count: u32| {
            let indices = (0..count).flat_map(|fan| vec![[3 * fan, 3 * fan + 1, 3 * fan + 2]; MAX_AROUND]);
            let positions = vec![[Vec3::ZERO, Vec3::X, Vec3::Y]; count as usize].concat();
            ObjMesh { positions, indices: indices.collect(), normals: None }.smoothed(1.0)
        };
        assert!(fans(1).is_ok());
        let expected = "too many triangles meet at its vertices, 256 at [1, 0, 0], for `smooth_degrees`";
        assert_eq!(fans(2).unwrap_err(), expected);
    }
}
