//! Kernel radii as a function of place (`docs/theory.md`, section 5.4).
//!
//! A picture shows things near the camera larger than things far away. A radius that suits one blurs the
//! other, or finds no photons there. The field follows the width of a pixel at a point, as far as the
//! distance to the camera tells it: walks from either side know it, whatever mirrors are in between.

use glam::Vec3;
use serde::{Deserialize, Serialize};
use upbp_accel::Ray;

/// Kernel radii at a point, relative to those of the plan: the same factor for all techniques.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum RadiusField {
    /// One everywhere.
    #[default]
    Uniform,
    /// As the width of a pixel.
    Footprint(FootprintField),
}

/// A factor that grows with the distance to the camera, within bounds:
/// `clamp(offset + slope · |x − eye|, least, most)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FootprintField {
    /// Where the rays of the camera start, scene units.
    pub eye: [f32; 3],
    /// Factor next to the eye.
    pub offset: f32,
    /// Growth per scene unit; positive.
    pub slope: f32,
    /// Least factor; positive.
    pub least: f32,
    /// Greatest factor.
    pub most: f32,
}

/// Radii differ by at most this much per distance: so that within a kernel they are about the same.
const LIPSCHITZ: f32 = 0.1;
/// Greatest ratio of factors within a [piece](RadiusField::pieces).
const STEP: f32 = 1.5;
/// Steps that make up more than the range.
const LEVELS: usize = 12;

impl RadiusField {
    /// The factor at a point.
    #[inline]
    #[must_use]
    pub fn at(&self, position: Vec3) -> f32 {
        match self {
            Self::Uniform => 1.0,
            Self::Footprint(field) => field.at_distance((position - Vec3::from(field.eye)).length()),
        }
    }

    /// The least factor anywhere.
    #[must_use]
    pub const fn least(&self) -> f32 {
        match self {
            Self::Uniform => 1.0,
            Self::Footprint(field) => field.least,
        }
    }

    /// The largest radius, where the factor is one, that the field does not change by more than a tenth of
    /// the distance; scene units.
    #[must_use]
    pub fn largest_radius(&self) -> f32 {
        match self {
            Self::Uniform => f32::INFINITY,
            Self::Footprint(field) => LIPSCHITZ / field.slope,
        }
    }

    /// Whether radii up to `radius` (scene units, where the factor is one) may follow this field.
    #[must_use]
    pub fn is_valid(&self, radius: f32) -> bool {
        let Self::Footprint(FootprintField { eye, offset, slope, least, most }) = *self else { return true };
        Vec3::from(eye).is_finite()
            && offset >= 0.0
            && slope > 0.0
            && least > 0.0
            && (least..=1.001 * FootprintField::RANGE * least).contains(&most)
            && (offset + slope + most).is_finite()
            && radius <= self.largest_radius()
    }

    /// Parts of a ray that make it up, each with a bound of the factors on it that exceeds none of them by
    /// more than half.
    pub fn pieces(&self, ray: &Ray) -> impl Iterator<Item = (Ray, f32)> {
        let (ray, field) = (*ray, *self);
        let along = match &field {
            Self::Uniform => None,
            Self::Footprint(field) => Some(Along::new(field, &ray)),
        };
        let cuts = along.as_ref().map_or([ray.t_max; 2 * LEVELS + 1], Along::cuts);
        let mut start = ray.t_min;
        cuts.into_iter().filter_map(move |cut| {
            let piece = Ray { t_min: start, t_max: cut.min(ray.t_max), ..ray };
            // Farther from the eye than both ends is nothing in between.
            let most = |along: &Along| along.at(piece.t_min).max(along.at(piece.t_max)) * 1.0001;
            (piece.t_max > start).then(|| {
                start = piece.t_max;
                (piece, along.as_ref().map_or(1.0, most))
            })
        })
    }
}

impl FootprintField {
    /// The greatest factor of a field over the least.
    pub const RANGE: f32 = 100.0;

    fn at_distance(&self, distance: f32) -> f32 {
        (self.offset + self.slope * distance).clamp(self.least, self.most)
    }
}

/// A field along a ray.
struct Along {
    field: FootprintField,
    /// Distance along the ray to the point nearest to the eye.
    nearest: f32,
    /// Square of the distance of that point from the eye.
    height2: f32,
}

impl Along {
    fn new(field: &FootprintField, ray: &Ray) -> Self {
        let to_eye = Vec3::from(field.eye) - ray.origin;
        let nearest = to_eye.dot(ray.direction);
        Self { field: *field, nearest, height2: (to_eye - nearest * ray.direction).length_squared() }
    }

    fn at(&self, t: f32) -> f32 {
        self.field.at_distance(((t - self.nearest).powi(2) + self.height2).sqrt())
    }

    /// Distances in ascending order where the factor is `least` times a power of the step, and behind all.
    fn cuts(&self) -> [f32; 2 * LEVELS + 1] {
        let FootprintField { offset, slope, least, most, .. } = self.field;
        let mut cuts = [f32::INFINITY; 2 * LEVELS + 1];
        for level in 0..LEVELS {
            let factor = least * STEP.powi(level.cast_signed() as i32);
            let distance = (factor.min(most) - offset) / slope;
            let half = (distance * distance - self.height2).max(0.0).sqrt();
            let half = if distance > 0.0 { half } else { 0.0 };
            cuts[LEVELS - 1 - level] = self.nearest - half;
            cuts[LEVELS + level] = self.nearest + half;
        }
        cuts
    }
}
