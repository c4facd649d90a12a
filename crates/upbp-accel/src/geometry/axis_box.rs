//! The axis-aligned box.

use glam::Vec3;

use super::error::{GeometryError, finite};

/// An axis-aligned box; its normals point outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisBox {
    min: Vec3,
    max: Vec3,
}

impl AxisBox {
    /// The box between two corners; `min` must be less than `max` along every axis.
    pub fn new(min: Vec3, max: Vec3) -> Result<Self, GeometryError> {
        let min = finite(min, "the lower corner of a box")?;
        let max = finite(max, "the upper corner of a box")?;
        if min.cmplt(max).all() {
            Ok(Self { min, max })
        } else {
            Err(GeometryError::Degenerate { what: "a box" })
        }
    }

    pub(super) fn translated(self, by: Vec3) -> Self {
        Self { min: self.min + by, max: self.max + by }
    }

    /// The corner with the least coordinates.
    #[must_use]
    pub fn min(&self) -> Vec3 {
        self.min
    }

    /// The corner with the greatest coordinates.
    #[must_use]
    pub fn max(&self) -> Vec3 {
        self.max
    }

    /// Areas of the faces across x, y and z, square scene units.
    fn face_areas(&self) -> Vec3 {
        let size = self.max - self.min;
        Vec3::new(size.y * size.z, size.z * size.x, size.x * size.y)
    }

    /// Surface area, square scene units.
    #[must_use]
    pub fn area(&self) -> f32 {
        2.0 * self.face_areas().element_sum()
    }

    /// Volume, cubic scene units.
    #[must_use]
    pub fn volume(&self) -> f32 {
        (self.max - self.min).element_product()
    }

    /// A point distributed uniformly over the surface, and its normal; `u` in `[0, 1)²`.
    #[must_use]
    pub fn sample_area(&self, u: [f32; 2]) -> (Vec3, Vec3) {
        let areas = self.face_areas().to_array();
        let mut remaining = u[0] * 2.0 * (areas[0] + areas[1] + areas[2]);
        let mut face = 0;
        while face < 5 && remaining >= areas[face / 2] {
            remaining -= areas[face / 2];
            face += 1;
        }
        // The rest of the random number inside the face is uniform again.
        let first = (remaining / areas[face / 2]).clamp(0.0, 1.0);
        let axis = face / 2;
        let (min, max) = (self.min.to_array(), self.max.to_array());
        let mut position = [0.0; 3];
        position[axis] = if face % 2 == 0 { min[axis] } else { max[axis] };
        for (other, u) in [((axis + 1) % 3, first), ((axis + 2) % 3, u[1])] {
            position[other] = (min[other] + (max[other] - min[other]) * u).clamp(min[other], max[other]);
        }
        (position.into(), Self::face_normal(face as u32))
    }

    /// Whether `point` lies strictly inside.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        self.min.cmplt(point).all() && point.cmplt(self.max).all()
    }

    /// The least and the greatest coordinates.
    #[must_use]
    pub fn aabb(&self) -> (Vec3, Vec3) {
        (self.min, self.max)
    }

    /// Distances and faces at which the line enters and leaves. A face is `2·axis`, plus one on the upper
    /// side.
    #[inline(always)]
    pub(super) fn intersect(&self, origin: Vec3, direction: Vec3) -> Option<[(f64, u32); 2]> {
        let direction = direction.as_dvec3();
        let low = self.min.as_dvec3() - origin.as_dvec3();
        let high = self.max.as_dvec3() - origin.as_dvec3();
        let inverse = direction.recip();
        let (low, high) = (low * inverse, high * inverse);
        let (mut entry, mut exit) = ((f64::NEG_INFINITY, 0), (f64::INFINITY, 0));
        for (axis, face) in [(0, 0), (1, 2), (2, 4)] {
            // Along a face: in its plane, where the product is not a number, counts as inside; beside the box
            // both distances have the same sign and are infinite.
            let (near, far) = if inverse[axis].is_sign_positive() {
                ((low[axis], face), (high[axis], face + 1))
            } else {
                ((high[axis], face + 1), (low[axis], face))
            };
            if near.0 > entry.0 {
                entry = near;
            }
            if far.0 < exit.0 {
                exit = far;
            }
        }
        (entry.0 <= exit.0 && entry.0 < f64::INFINITY && exit.0 > f64::NEG_INFINITY).then_some([entry, exit])
    }

    /// The outward normal of a face.
    pub(super) fn face_normal(face: u32) -> Vec3 {
        let mut normal = [0.0; 3];
        normal[face as usize / 2] = if face.is_multiple_of(2) { -1.0 } else { 1.0 };
        normal.into()
    }

    /// The point of the face nearest to `position`.
    pub(super) fn on_face(&self, face: u32, position: Vec3) -> Vec3 {
        let axis = face as usize / 2;
        let mut position = position.clamp(self.min, self.max);
        position[axis] = if face.is_multiple_of(2) { self.min[axis] } else { self.max[axis] };
        position
    }

    /// Coordinates of a point of a face along the other two axes, each mapped to `[0, 1]`.
    pub(super) fn uv(&self, face: u32, position: Vec3) -> [f32; 2] {
        let relative = ((position - self.min) / (self.max - self.min)).clamp(Vec3::ZERO, Vec3::ONE);
        let axis = face as usize / 2;
        [relative[(axis + 1) % 3], relative[(axis + 2) % 3]]
    }
}
