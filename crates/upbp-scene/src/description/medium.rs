//! Media.

use serde::{Deserialize, Serialize};

use super::value::{Asymmetry, Colour, Positive};
use super::{is_default, single};

/// What fills a body, or everything.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Medium {
    /// The same everywhere.
    Homogeneous {
        /// Absorption coefficient per scene unit.
        #[serde(default)]
        sigma_a: Colour,
        /// Scattering coefficient per scene unit.
        #[serde(default)]
        sigma_s: Colour,
        /// Phase function.
        #[serde(default, skip_serializing_if = "is_default")]
        phase: Phase,
        /// Radiance that an opaque stretch of the medium would show if it did not scatter.
        #[serde(default, skip_serializing_if = "is_default")]
        emission: Colour,
    },
}

/// Where a medium scatters light.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
pub enum Phase {
    /// In all directions alike.
    #[default]
    Isotropic,
    /// As particles much smaller than the wavelength.
    Rayleigh,
    /// By Henyey and Greenstein, with this mean cosine: above 0 forward.
    #[serde(deserialize_with = "single::g")]
    HenyeyGreenstein(Asymmetry),
    /// A mixture: weights, which need not add up to one, and parts.
    #[serde(deserialize_with = "single::parts")]
    Blend(Vec<(Positive, Phase)>),
}
