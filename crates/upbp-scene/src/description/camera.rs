//! Camera and image.

use serde::{Deserialize, Serialize};

use super::is_default;
use super::value::{Count, FieldOfView, NonNegative, Positive, Vector};

/// What looks at the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Camera {
    /// A pinhole or a thin lens.
    Perspective {
        /// Pinhole, or centre of the lens.
        origin: Vector,
        /// The point in the middle of the image.
        target: Vector,
        /// The direction that is upright in the image.
        #[serde(default = "default_up")]
        up: Vector,
        /// Full horizontal angle of the image.
        fov_degrees: FieldOfView,
        /// Radius of the lens; 0 for a pinhole.
        #[serde(default = "default_lens_radius")]
        lens_radius: NonNegative,
        /// Distance to the plane of focus; if absent, that of the target.
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

/// The image.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Film {
    /// Columns.
    pub width: Count,
    /// Rows.
    pub height: Count,
    /// The part to render; if absent, all of it.
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
    /// Columns.
    pub width: Count,
    /// Rows.
    pub height: Count,
}
