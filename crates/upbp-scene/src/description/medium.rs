//! Media.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use upbp_media::{PhaseFunction, Spectrum};

use super::single_value;
use super::value::{Asymmetries, Asymmetry, Colour, Diameter, NonNegative, Positive, Share, is_default};

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
        /// Radiance per length that the medium emits whether or not it absorbs, W m⁻² sr⁻¹ per scene unit,
        /// on top of `emission`.
        #[serde(default, skip_serializing_if = "is_default")]
        glow: Colour,
    },
}

/// A phase function: the distribution of directions after scattering.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Phase {
    /// Equal in all directions.
    #[default]
    Isotropic,
    /// Rayleigh scattering, by particles much smaller than the wavelength.
    Rayleigh,
    /// The function of Henyey and Greenstein, by its mean cosine: above 0 forward, below 0 backward. It may
    /// differ between the channels.
    #[serde(deserialize_with = "single_value::asymmetries")]
    HenyeyGreenstein(Asymmetries),
    /// Two lobes of Henyey and Greenstein.
    TwoLobes {
        /// Mean cosine of each.
        g: [Asymmetry; 2],
        /// Share of the first.
        share: Share,
    },
    /// The function of Draine: that of Henyey and Greenstein times `1 + alpha cos²`.
    Draine {
        /// The asymmetry of the factor that is Henyey and Greenstein's.
        g: Asymmetry,
        /// The factor of the squared cosine.
        alpha: NonNegative,
    },
    /// Water droplets in air, by their diameter in micrometres.
    #[serde(deserialize_with = "single_value::diameter")]
    Droplets(Diameter),
    /// A table of angles in degrees and values, linear in the cosine between them.
    #[serde(deserialize_with = "rows")]
    Table(Vec<(f32, Colour)>),
    /// A table in a file.
    TableFile {
        /// Path, relative to the scene's file.
        file: String,
    },
    /// A weighted sum: pairs of a weight and a phase function. The weights need not add up to one.
    #[serde(deserialize_with = "parts")]
    Blend(Vec<(Positive, Phase)>),
    /// One for each channel.
    PerChannel {
        /// Phase function of the red channel.
        r: Box<Phase>,
        /// Phase function of the green channel.
        g: Box<Phase>,
        /// Phase function of the blue channel.
        b: Box<Phase>,
    },
}

fn parts<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<(Positive, Phase)>, D::Error> {
    single_value::read(deserializer, &["parts"])
}

fn rows<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<(f32, Colour)>, D::Error> {
    let rows: Vec<(f32, Colour)> = single_value::read(deserializer, &["rows"])?;
    tabulated(&rows).map_err(D::Error::custom)?;
    Ok(rows)
}

/// The phase function of a table.
pub(crate) fn tabulated(rows: &[(f32, Colour)]) -> Result<PhaseFunction, upbp_media::MediaError> {
    let rows: Vec<(f32, Spectrum)> = rows.iter().map(|(degrees, value)| (*degrees, value.get())).collect();
    PhaseFunction::tabulated(&rows)
}
