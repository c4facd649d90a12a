//! Kernel radii as a function of place (`docs/theory.md`, section 5.4).
//!
//! A picture shows things near the camera larger than things far away. A radius that suits one blurs the
//! other, or finds no photons there. The field follows the width of a pixel at a point, as far as the
//! distance to the camera tells it: walks from either side know it, whatever mirrors are in between.

use glam::Vec3;
use serde::{Deserialize, Serialize};
use upbp_accel::{GrowingRadius, SearchRadius};

/// Kernel radii at a point, relative to those of the plan: the same factor for all techniques.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum RadiusField {
    /// One everywhere.
    #[default]
    Uniform,
    /// A factor like the width of a pixel.
    Footprint(FootprintField),
}

/// A factor that grows with the distance to the camera, within bounds:
/// `clamp(offset + slope · |x − eye|, least, most)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FootprintField {
    /// Start of the camera's rays, scene units.
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

    /// The greatest factor anywhere.
    #[must_use]
    pub const fn greatest(&self) -> f32 {
        match self {
            Self::Uniform => 1.0,
            Self::Footprint(field) => field.most,
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

    /// Radii along a ray, of searches for what a kernel reaches; `radius` (scene units) is that where the
    /// factor is one, and `greatest` is what the factor is where it would be more.
    #[must_use]
    pub fn search_radius(&self, radius: f32, greatest: f32) -> SearchRadius {
        match *self {
            Self::Uniform => SearchRadius::Constant(radius * greatest.min(1.0)),
            Self::Footprint(field) => SearchRadius::Growing(GrowingRadius {
                centre: field.eye.into(),
                offset: radius * field.offset,
                slope: radius * field.slope,
                least: radius * field.least.min(greatest),
                most: radius * field.most.min(greatest),
            }),
        }
    }
}

impl FootprintField {
    /// The greatest factor of a field over the least.
    pub const RANGE: f32 = 100.0;

    fn at_distance(&self, distance: f32) -> f32 {
        (self.offset + self.slope * distance).clamp(self.least, self.most)
    }
}
