//! Lights that are no surfaces.

use serde::{Deserialize, Serialize};

use super::shape::Rotation;
use super::single_value;
use super::value::{AngularDiameter, BeamAngle, Colour, CutoffAngle, Degrees, Positive, Vector, is_default};

/// A light. Surfaces that shine are [shapes](super::Shape) with an emission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Light {
    /// A point that shines equally in all directions.
    Point {
        /// Position of the light, scene units.
        position: Vector,
        /// Radiant intensity, W sr⁻¹.
        intensity: Colour,
    },
    /// A point that shines into a cone, towards either `target` or `direction`.
    Spot {
        /// Position of the light, scene units.
        position: Vector,
        /// A point on the axis.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        target: Option<Vector>,
        /// The axis, of any length.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        direction: Option<Vector>,
        /// Radiant intensity inside the beam, W sr⁻¹.
        intensity: Colour,
        /// Angle from the axis up to which the intensity is full, degrees; if absent, the cutoff.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        beam_degrees: Option<BeamAngle>,
        /// Angle from the axis at which the intensity has fallen to zero, linearly with the angle, degrees.
        cutoff_degrees: CutoffAngle,
    },
    /// Parallel light from infinitely far away.
    Directional {
        /// Direction of propagation, a vector of any length.
        direction: Vector,
        /// Irradiance on a plane perpendicular to the direction, W m⁻².
        irradiance: Colour,
    },
    /// A disc of the sky of even radiance, infinitely far away.
    Sun {
        /// Direction of propagation from its middle, a vector of any length.
        direction: Vector,
        /// Irradiance on a plane perpendicular to the direction, W m⁻².
        irradiance: Colour,
        /// Angle that the disc takes up, degrees.
        #[serde(default = "default_diameter", skip_serializing_if = "is_default_diameter")]
        diameter_degrees: AngularDiameter,
    },
    /// A constant environment: the same radiance, W m⁻² sr⁻¹, from all directions, infinitely far away.
    #[serde(deserialize_with = "single_value::radiance")]
    Constant(Colour),
    /// An environment given by an image: radiance from all directions, infinitely far away.
    Image {
        /// Path of a latitude-longitude `OpenEXR` image, relative to the scene file.
        file: String,
        /// Factor on the values of the image.
        #[serde(default = "default_scale", skip_serializing_if = "is_default_scale")]
        scale: Positive,
        /// Rotation about +y, counter-clockwise as seen from above, degrees.
        #[serde(default = "default_rotation", skip_serializing_if = "is_default")]
        rotation_degrees: Degrees,
        /// Rotations about axes through the origin, applied after that, one after the other.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        rotate: Vec<Rotation>,
    },
}

fn default_diameter() -> AngularDiameter {
    AngularDiameter::OF_THE_SUN
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn is_default_diameter(diameter: &AngularDiameter) -> bool {
    *diameter == AngularDiameter::OF_THE_SUN
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
