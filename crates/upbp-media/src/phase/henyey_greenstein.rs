//! The Henyey-Greenstein phase function, in forms that survive `|g| → 1`.
//!
//! Source: Henyey and Greenstein, "Diffuse radiation in the Galaxy", 1941, in the rearrangement of
//! `docs/theory.md`, section 7. Oracle: `tests` of the parent module.

use serde::{Deserialize, Serialize};

use super::deflection::{Deflection, UNIFORM};
use crate::MediaError;

/// The asymmetry of a phase function: its mean cosine, in `(-1, 1)`.
#[derive(Copy, Clone, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
#[serde(try_from = "f32", into = "f32")]
pub struct Asymmetry(f32);

impl Asymmetry {
    /// Accepts `-1 < g < 1`.
    ///
    /// # Errors
    ///
    /// Otherwise, and for NaN.
    pub fn new(g: f32) -> Result<Self, MediaError> {
        if g.abs() < 1.0 {
            Ok(Self(g))
        } else {
            let (what, expected) = ("the asymmetry", "a number above -1 and below 1");
            Err(MediaError::OutOfRange { what, value: g, expected })
        }
    }

    /// The mean cosine.
    #[inline]
    #[must_use]
    pub const fn get(self) -> f32 {
        self.0
    }
}

impl TryFrom<f32> for Asymmetry {
    type Error = MediaError;

    fn try_from(g: f32) -> Result<Self, MediaError> {
        Self::new(g)
    }
}

impl From<Asymmetry> for f32 {
    fn from(g: Asymmetry) -> Self {
        g.0
    }
}

/// `(1 − g²) / (4π (1 + g² − 2 g cos θ)^{3/2})` per steradian.
#[inline]
pub(super) fn value(g: Asymmetry, deflection: Deflection<f32>) -> f32 {
    // 1 + g² − 2 g cos θ as a sum of two terms of one sign, for either sign of g.
    let g = g.0;
    let spread = 1.0 - g.abs();
    let away = if g > 0.0 { deflection.one_minus_cos } else { deflection.one_plus_cos };
    let distance2 = spread * spread + 2.0 * g.abs() * away;
    UNIFORM * spread * (1.0 + g.abs()) / (distance2 * distance2.sqrt())
}

/// The angle at the fraction `u` of the distribution, counted from straight back.
#[inline]
pub(super) fn sample(g: Asymmetry, u: f64) -> Deflection<f64> {
    // The usual cosine, 1 + g² − s² over 2g, cancels for |g| → 1 and divides by g → 0; these two do
    // neither. Their sum is 2.
    let g = f64::from(g.0);
    let root = (1.0 - g + 2.0 * g * u).recip();
    let backward = (1.0 - g) * root;
    let forward = (1.0 + g) * root;
    Deflection {
        one_minus_cos: 2.0 * backward * backward * (1.0 - u) * (1.0 + g * u),
        one_plus_cos: 2.0 * forward * forward * u * (1.0 - g * (1.0 - u)),
    }
}
