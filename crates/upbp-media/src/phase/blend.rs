//! Weighted sums of phase functions.

use super::deflection::Deflection;
use super::{ONE_MINUS_EPSILON, PhaseFunction, PhaseValue};
use crate::{MediaError, Spectrum};

/// A weighted sum of phase functions, made by [`PhaseFunction::blend`]. The weights add up to one; no
/// part is itself a blend.
#[derive(Clone, Debug, PartialEq)]
pub struct Blend {
    parts: Box<[(f32, PhaseFunction)]>,
}

impl Blend {
    pub(super) fn new(parts: Vec<(f32, PhaseFunction)>) -> Result<Self, MediaError> {
        if parts.is_empty() {
            let (what, expected) = ("the blend of phase functions", "at least one part");
            return Err(MediaError::Empty { what, expected });
        }
        for (index, &(value, _)) in parts.iter().enumerate() {
            if !(value.is_finite() && value > 0.0) {
                let (what, expected) = ("blend weight", "a finite number above zero");
                return Err(MediaError::EntryOutOfRange { what, index, value, expected });
            }
        }
        // In double precision: the sum of finite weights must not overflow.
        let sum: f64 = parts.iter().map(|&(weight, _)| f64::from(weight)).sum();
        let mut flat = Vec::with_capacity(parts.len());
        for (weight, part) in parts {
            let weight = (f64::from(weight) / sum) as f32;
            match part {
                PhaseFunction::Blend(inner) => {
                    flat.extend(inner.parts.into_iter().map(|(share, part)| (weight * share, part)));
                }
                part => flat.push((weight, part)),
            }
        }
        // A part that rounds to nothing beside the others is never chosen, and must not be divided by.
        flat.retain(|&(weight, _)| weight > 0.0);
        Ok(Self { parts: flat.into_boxed_slice() })
    }

    /// The parts with their weights, which add up to one.
    #[must_use]
    pub fn parts(&self) -> &[(f32, PhaseFunction)] {
        &self.parts
    }

    pub(super) fn value(&self, deflection: Deflection<f32>) -> PhaseValue {
        let mut sum = PhaseValue::grey(0.0);
        for (weight, part) in &self.parts {
            let PhaseValue { value, pdf } = part.value(deflection);
            sum.value += *weight * value;
            sum.pdf += weight * pdf;
        }
        sum
    }

    pub(super) fn mean_cosine(&self) -> Spectrum {
        self.parts.iter().map(|(weight, part)| *weight * part.mean_cosine()).sum()
    }

    /// The blend that one channel sees.
    pub(super) fn channel(&self, channel: usize) -> Self {
        Self { parts: self.parts.iter().map(|(weight, part)| (*weight, part.channel(channel))).collect() }
    }

    /// Chooses a part by its weight; also returns the rest of the random number, again in `[0, 1)`.
    ///
    /// Takes the number of the azimuth: the bits that a part of small weight loses would coarsen a narrow
    /// peak, but the azimuth does not miss them.
    pub(super) fn choose(&self, u: f32) -> (&PhaseFunction, f32) {
        let mut rest = u;
        let mut chosen = (1.0, &PhaseFunction::Isotropic);
        for (index, (weight, part)) in self.parts.iter().enumerate() {
            chosen = (*weight, part);
            // The weights add up to one but for rounding: a number beyond their sum chooses the last part.
            if rest < *weight || index + 1 == self.parts.len() {
                break;
            }
            rest -= weight;
        }
        (chosen.1, (rest / chosen.0).clamp(0.0, ONE_MINUS_EPSILON))
    }
}
