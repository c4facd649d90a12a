//! The place of a mesh that several shapes share.

use glam::{Affine3A, DMat3, DVec3, Mat3, Vec3};

use super::error::GeometryError;
use crate::simd::Wide;

/// A map from the coordinates of a mesh to those of the scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placement {
    to_scene: Mat3,
    translation: Vec3,
    to_mesh: DMat3,
    /// Whether left and right are exchanged.
    pub(super) mirrors: bool,
}

impl Placement {
    pub(super) fn new(to_scene: &Affine3A) -> Result<Self, GeometryError> {
        if !to_scene.is_finite() {
            return Err(GeometryError::NonFinite { what: "the placement of a mesh" });
        }
        let linear = Mat3::from(to_scene.matrix3);
        let to_mesh = linear.as_dmat3().inverse();
        // Not only zero determinants: the inverse must have its digits in single precision, too.
        let is_map = (linear.as_dmat3() * to_mesh).abs_diff_eq(DMat3::IDENTITY, 1e-6);
        if !(is_map && to_mesh.as_mat3().is_finite()) {
            return Err(GeometryError::Degenerate { what: "a mesh that is placed flat" });
        }
        let mirrors = to_mesh.determinant() < 0.0;
        Ok(Self { to_scene: linear, translation: to_scene.translation.into(), to_mesh, mirrors })
    }

    /// What is placed by another one first.
    pub(super) fn after(&self, first: &Self) -> Result<Self, GeometryError> {
        Self::new(&(self.as_affine() * first.as_affine()))
    }

    fn as_affine(&self) -> Affine3A {
        Affine3A::from_mat3_translation(self.to_scene, self.translation)
    }

    pub(super) fn translated(self, by: Vec3) -> Self {
        Self { translation: self.translation + by, ..self }
    }

    /// A point in the scene. [`points`](Self::points) gives the same bits.
    #[inline]
    pub(super) fn point(&self, p: Vec3) -> Vec3 {
        let [a, b, c] = self.to_scene.to_cols_array_2d();
        let [x, y, z] = p.to_array();
        Vec3::from_array(std::array::from_fn(|i| a[i] * x + b[i] * y + c[i] * z + self.translation[i]))
    }

    /// Eight points in the scene.
    #[inline(always)]
    pub(super) fn points<W: Wide>(&self, wide: W, p: [W::F; 3]) -> [W::F; 3] {
        let columns = self.to_scene.to_cols_array_2d();
        let mut sums = wide.scale3(wide.splat3(columns[0]), p[0]);
        for axis in 1..3 {
            sums = wide.add3(sums, wide.scale3(wide.splat3(columns[axis]), p[axis]));
        }
        wide.add3(sums, wide.splat3(self.translation.to_array()))
    }

    /// A normal in the scene, of any length.
    pub(super) fn normal(&self, normal: Vec3) -> Vec3 {
        (self.to_mesh.transpose() * normal.as_dvec3()).as_vec3()
    }

    /// A point of the scene in the coordinates of the mesh.
    pub(super) fn point_in_mesh(&self, point: DVec3) -> DVec3 {
        self.to_mesh * (point - self.translation.as_dvec3())
    }

    /// A direction of the scene in the coordinates of the mesh, with the length that it has there.
    pub(super) fn direction_in_mesh(&self, direction: Vec3) -> DVec3 {
        self.to_mesh * direction.as_dvec3()
    }

    /// The size in the coordinates of the mesh of a box that is `2 size` wide in the scene, as half widths.
    pub(super) fn size_in_mesh(&self, size: f64) -> DVec3 {
        let [a, b, c] = [self.to_mesh.x_axis, self.to_mesh.y_axis, self.to_mesh.z_axis].map(DVec3::abs);
        (a + b + c) * size
    }

    /// The largest number that adds to a coordinate in the scene of a point with coordinates up to `largest`.
    pub(super) fn reach(&self, largest: Vec3) -> f32 {
        let Mat3 { x_axis, y_axis, z_axis } = self.to_scene;
        let sum = x_axis.abs() * largest.x + y_axis.abs() * largest.y + z_axis.abs() * largest.z;
        (sum + self.translation.abs()).max_element()
    }
}
