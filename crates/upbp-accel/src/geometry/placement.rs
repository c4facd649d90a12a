//! The place of a mesh that several shapes share.

use glam::{Affine3A, DMat3, DVec3, Mat3, Vec3};

use super::error::GeometryError;
use crate::simd::Wide;

/// A map from the coordinates of a mesh to those of the scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placement {
    to_scene: Mat3,
    translation: Vec3,
    /// Added last, so that copies are moved as exactly as other shapes.
    moved: Vec3,
    to_mesh: DMat3,
    /// Map of normals, without the scale.
    normals: Mat3,
    /// Factor of all areas, if it is the same for all.
    squared_scale: Option<f64>,
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
        let columns = to_mesh.to_cols_array();
        let largest = columns.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
        Ok(Self {
            to_scene: linear,
            translation: to_scene.translation.into(),
            moved: Vec3::ZERO,
            to_mesh,
            normals: (to_mesh.transpose() * largest.recip()).as_mat3(),
            squared_scale: squared_scale(linear.as_dmat3()),
            mirrors: to_mesh.determinant() < 0.0,
        })
    }

    /// The placement that applies another one first.
    pub(super) fn after(&self, first: &Self) -> Result<Self, GeometryError> {
        let affine = |placement: &Self| {
            Affine3A::from_mat3_translation(placement.to_scene, placement.translation + placement.moved)
        };
        Self::new(&(affine(self) * affine(first)))
    }

    pub(super) fn translated(self, by: Vec3) -> Self {
        Self { moved: self.moved + by, ..self }
    }

    /// A point in the scene. [`points`](Self::points) gives the same bits.
    #[inline]
    pub(super) fn point(&self, p: Vec3) -> Vec3 {
        let [a, b, c] = self.to_scene.to_cols_array_2d();
        let [x, y, z] = p.to_array();
        let placed = |i: usize| a[i] * x + b[i] * y + c[i] * z + self.translation[i];
        Vec3::from_array(std::array::from_fn(placed)) + self.moved
    }

    /// A point in the scene in double precision, which no corner is.
    pub(super) fn point_in_scene(&self, p: DVec3) -> DVec3 {
        self.to_scene.as_dmat3() * p + self.translation.as_dvec3() + self.moved.as_dvec3()
    }

    /// Eight points in the scene.
    #[inline(always)]
    pub(super) fn points<W: Wide>(&self, wide: W, p: [W::F; 3]) -> [W::F; 3] {
        let columns = self.to_scene.to_cols_array_2d();
        let mut sums = wide.scale3(wide.splat3(columns[0]), p[0]);
        for axis in 1..3 {
            sums = wide.add3(sums, wide.scale3(wide.splat3(columns[axis]), p[axis]));
        }
        let placed = wide.add3(sums, wide.splat3(self.translation.to_array()));
        wide.add3(placed, wide.splat3(self.moved.to_array()))
    }

    /// Change of a coordinate in the scene with those in the mesh.
    pub(super) fn gradient(&self, axis: usize) -> Vec3 {
        self.to_scene.row(axis)
    }

    /// The corners of a triangle in the order in which they go round in the scene.
    pub(super) const fn winding(&self, [a, b, c]: [u32; 3]) -> [u32; 3] {
        if self.mirrors { [a, c, b] } else { [a, b, c] }
    }

    /// Factor of areas, if it does not depend on their plane: the map turns, mirrors and scales evenly.
    pub(super) const fn squared_scale(&self) -> Option<f64> {
        self.squared_scale
    }

    /// Factor of volumes.
    pub(super) fn volume_ratio(&self) -> f64 {
        self.to_scene.as_dmat3().determinant().abs()
    }

    /// A normal in the scene, of unit length, or zero.
    pub(super) fn normal(&self, normal: Vec3) -> Vec3 {
        unit(self.normals * normal)
    }

    /// A point of the scene in the coordinates of the mesh.
    pub(super) fn point_in_mesh(&self, point: DVec3) -> DVec3 {
        self.to_mesh * (point - self.moved.as_dvec3() - self.translation.as_dvec3())
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
        (self.rounded(largest) + self.moved.abs()).max_element()
    }

    /// Along each axis of the scene the size of what adds up to a coordinate, and is rounded, of a point
    /// with coordinates up to `largest`. What is moved is moved exactly.
    pub(super) fn rounded(&self, largest: Vec3) -> Vec3 {
        let Mat3 { x_axis, y_axis, z_axis } = self.to_scene;
        let sum = x_axis.abs() * largest.x + y_axis.abs() * largest.y + z_axis.abs() * largest.z;
        sum + self.translation.abs()
    }
}

/// Factor of areas under a linear map that keeps angles, as far as its elements in single precision tell.
fn squared_scale(linear: DMat3) -> Option<f64> {
    /// Roundings of three elements, each twice in a product: that of the rotation and that of its scale.
    const ROUNDING: f64 = 6.0 * f32::EPSILON as f64;
    let products = linear.transpose() * linear;
    let scale2 = (products.x_axis.x + products.y_axis.y + products.z_axis.z) / 3.0;
    products.abs_diff_eq(DMat3::from_diagonal(DVec3::splat(scale2)), ROUNDING * scale2).then_some(scale2)
}

/// The unit vector along a normal of any length; zero stays zero.
pub(super) fn unit(normal: Vec3) -> Vec3 {
    normal.as_dvec3().normalize_or_zero().as_vec3()
}
