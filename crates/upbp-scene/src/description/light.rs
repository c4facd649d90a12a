//! Lights that are no surfaces.

use serde::{Deserialize, Serialize};

use super::value::{BeamAngle, Colour, CutoffAngle, Degrees, Positive, Vector};
use super::{is_default, single};

/// A light. Surfaces that shine are [shapes](super::Shape) with an emission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Light {
    /// A point.
    Point {
        /// Where it is.
        position: Vector,
        /// Radiant intensity, W sr⁻¹.
        intensity: Colour,
    },
    /// A point that shines into a cone. Either `target` or `direction` says where.
    Spot {
        /// Where it is.
        position: Vector,
        /// A point on the axis.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        target: Option<Vector>,
        /// The axis, of any length.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        direction: Option<Vector>,
        /// Radiant intensity inside the beam, W sr⁻¹.
        intensity: Colour,
        /// Angle from the axis up to which the intensity is full; if absent, the cutoff.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        beam_degrees: Option<BeamAngle>,
        /// Angle from the axis at which it has fallen to zero, linearly with the angle.
        cutoff_degrees: CutoffAngle,
    },
    /// Parallel light from infinitely far away.
    Directional {
        /// Where the light goes, of any length.
        direction: Vector,
        /// Irradiance on a plane perpendicular to it, W m⁻².
        irradiance: Colour,
    },
    /// The same radiance from all directions, infinitely far away.
    #[serde(deserialize_with = "single::radiance")]
    Constant(Colour),
    /// Radiance from all directions, infinitely far away, by an image.
    Image {
        /// Path of a latitude-longitude `OpenEXR` image, relative to the scene file.
        file: String,
        /// Factor for its values.
        #[serde(default = "default_scale", skip_serializing_if = "is_default_scale")]
        scale: Positive,
        /// Turns it about +y, counter-clockwise as seen from above.
        #[serde(default = "default_rotation", skip_serializing_if = "is_default")]
        rotation_degrees: Degrees,
    },
}

fn default_scale() -> Positive {
    Positive::ONE
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn is_default_scale(scale: &Positive) -> bool {
    *scale == Positive::ONE
}

fn default_rotation() -> Degrees {
    Degrees::ZERO
}
