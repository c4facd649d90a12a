//! What weights are made of: sums of densities, as a whole, in two parts or by technique.

use std::fmt;
use std::ops::{Add, Mul};

use crate::technique::Technique;

/// A sum of densities of techniques, with their counts, as the heuristic takes them.
///
/// The recursion is linear in the counts, so it can carry the sum of all techniques (`f64`, what a render needs) or every
/// technique for itself ([`ByTechnique`], from which the weights of any other counts follow).
pub trait Densities: Copy + fmt::Debug + Send + Sync + Add<Output = Self> + Mul<f64, Output = Self> {
    /// Of no technique.
    const ZERO: Self;

    /// Whether merges are told from the rest, as plans with [correlation](super::MisPlan::correlation) need.
    const KNOWS_MERGES: bool;

    /// Of one technique.
    fn of(technique: Technique, density: f64) -> Self;

    /// Of all together.
    fn total(&self) -> f64;

    /// With the densities of merges multiplied by a factor. A single sum does not know them and stays as it is: it serves plans without
    /// [correlation](super::MisPlan::correlation), all of whose factors are one.
    #[must_use]
    fn damped(self, merges: f64) -> Self;
}

impl Densities for f64 {
    const ZERO: Self = 0.0;
    const KNOWS_MERGES: bool = false;

    #[inline]
    fn of(_: Technique, density: f64) -> Self {
        density
    }

    #[inline]
    fn total(&self) -> f64 {
        *self
    }

    #[inline]
    fn damped(self, _: f64) -> Self {
        self
    }
}

/// Densities of merges, and those of all other techniques.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MergesApart {
    /// Of emission hits, next events, connections and light tracing.
    pub paths: f64,
    /// Of the five kinds of merges.
    pub merges: f64,
}

impl Add for MergesApart {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        Self { paths: self.paths + other.paths, merges: self.merges + other.merges }
    }
}

impl Mul<f64> for MergesApart {
    type Output = Self;

    #[inline]
    fn mul(self, factor: f64) -> Self {
        Self { paths: times(self.paths, factor), merges: times(self.merges, factor) }
    }
}

impl Densities for MergesApart {
    const ZERO: Self = Self { paths: 0.0, merges: 0.0 };
    const KNOWS_MERGES: bool = true;

    #[inline]
    fn of(technique: Technique, density: f64) -> Self {
        if technique.merges() {
            Self { merges: density, ..Self::ZERO }
        } else {
            Self { paths: density, ..Self::ZERO }
        }
    }

    #[inline]
    fn total(&self) -> f64 {
        self.paths + self.merges
    }

    #[inline]
    fn damped(self, merges: f64) -> Self {
        Self { merges: times(self.merges, merges), ..self }
    }
}

/// What does not run or does not count does not, whatever the other factor: zero times infinity is zero.
#[inline]
fn times(density: f64, factor: f64) -> f64 {
    if density == 0.0 || factor == 0.0 { 0.0 } else { density * factor }
}

/// Densities by technique.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ByTechnique {
    /// Of each, by its number.
    pub of: [f64; Technique::ALL.len()],
    /// Of all merges, each multiplied once more by what it is [damped](Densities::damped) by: it tells how much they are damped on average.
    pub merges_damped_again: f64,
}

impl Add for ByTechnique {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        Self {
            of: std::array::from_fn(|i| self.of[i] + other.of[i]),
            merges_damped_again: self.merges_damped_again + other.merges_damped_again,
        }
    }
}

impl Mul<f64> for ByTechnique {
    type Output = Self;

    #[inline]
    fn mul(self, factor: f64) -> Self {
        Self {
            of: self.of.map(|density| times(density, factor)),
            merges_damped_again: times(self.merges_damped_again, factor),
        }
    }
}

impl Densities for ByTechnique {
    const ZERO: Self = Self { of: [0.0; Technique::ALL.len()], merges_damped_again: 0.0 };
    const KNOWS_MERGES: bool = true;

    #[inline]
    fn of(technique: Technique, density: f64) -> Self {
        let mut densities = Self::ZERO;
        densities.of[technique as usize] = density;
        if technique.merges() {
            densities.merges_damped_again = density;
        }
        densities
    }

    #[inline]
    fn total(&self) -> f64 {
        self.of.iter().sum()
    }

    #[inline]
    fn damped(mut self, merges: f64) -> Self {
        for technique in Technique::ALL.into_iter().filter(|technique| technique.merges()) {
            let density = &mut self.of[technique as usize];
            *density = times(*density, merges);
        }
        self.merges_damped_again = times(self.merges_damped_again, merges * merges);
        self
    }
}

/// A technique's density among those of all that can make the same path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weight<D = f64> {
    /// Its own.
    pub own: f64,
    /// All, its own among them.
    pub all: D,
}

impl<D: Densities> Weight<D> {
    /// Of a technique that is the only one.
    #[inline]
    #[must_use]
    pub fn alone(technique: Technique) -> Self {
        Self { own: 1.0, all: D::of(technique, 1.0) }
    }

    /// The weight of the sample.
    #[inline]
    #[must_use]
    pub fn value(&self) -> f64 {
        self.own / self.all.total()
    }
}
