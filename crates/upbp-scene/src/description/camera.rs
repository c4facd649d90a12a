//! The camera and the image.

use serde::{Deserialize, Serialize};

use super::value::{Count, FieldOfView, NonNegative, Positive, Vector, is_default};

/// The camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Camera {
    /// A pinhole or a thin lens.
    Perspective {
        /// Pinhole, or centre of the lens, scene units.
        origin: Vector,
        /// The point in the middle of the image, scene units.
        target: Vector,
        /// The direction that is upright in the image.
        #[serde(default = "default_up")]
        up: Vector,
        /// Full horizontal angle of the image, degrees.
        fov_degrees: FieldOfView,
        /// Radius of the lens, scene units; 0 for a pinhole.
        #[serde(default = "default_lens_radius")]
        lens_radius: NonNegative,
        /// Distance to the plane of focus, scene units; if absent, that of the target.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        focus_distance: Option<Positive>,
    },
}

fn default_up() -> Vector {
    Vector::UP
}

fn default_lens_radius() -> NonNegative {
    NonNegative::ZERO
}

/// Size of the image, and the part to render.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Film {
    /// Width, pixels.
    pub width: Count,
    /// Height, pixels.
    pub height: Count,
    /// The part to render; if absent, the whole image.
    #[serde(skip_serializing_if = "is_default")]
    pub crop: Option<Crop>,
}

impl Default for Film {
    fn default() -> Self {
        Self { width: Count::DEFAULT, height: Count::DEFAULT, crop: None }
    }
}

/// A part of the image, in pixels from the top left corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Crop {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Width, pixels.
    pub width: Count,
    /// Height, pixels.
    pub height: Count,
}
