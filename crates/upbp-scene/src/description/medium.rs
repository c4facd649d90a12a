//! Media.

use serde::{Deserialize, Deserializer, Serialize};

use super::single;
use super::value::{Asymmetry, Colour, Positive, is_default};

/// A participating medium, in a body or around everything.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Medium {
    /// A medium with the same coefficients everywhere.
    Homogeneous {
        /// Absorption coefficient, inverse scene units.
        #[serde(default)]
        sigma_a: Colour,
        /// Scattering coefficient, inverse scene units.
        #[serde(default)]
        sigma_s: Colour,
        /// Phase function.
        #[serde(default, skip_serializing_if = "is_default")]
        phase: Phase,
        /// Radiance of an opaque stretch of the medium if it did not scatter, W m⁻² sr⁻¹.
        #[serde(default, skip_serializing_if = "is_default")]
        emission: Colour,
    },
}

/// A phase function: the distribution of directions after scattering.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
pub enum Phase {
    /// Equal in all directions.
    #[default]
    Isotropic,
    /// Rayleigh scattering, by particles much smaller than the wavelength.
    Rayleigh,
    /// The function of Henyey and Greenstein, by its mean cosine: above 0 forward, below 0 backward.
    #[serde(deserialize_with = "single::g")]
    HenyeyGreenstein(Asymmetry),
    /// A weighted sum: pairs of a weight and a phase function. The weights need not add up to one.
    #[serde(deserialize_with = "parts")]
    Blend(Vec<(Positive, Phase)>),
}

fn parts<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<(Positive, Phase)>, D::Error> {
    single::read(deserializer, &["parts"])
}
