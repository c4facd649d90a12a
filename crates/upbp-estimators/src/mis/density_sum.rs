//! Sums of densities that weights are made of, as a whole or by technique.

use std::fmt;
use std::ops::{Add, Mul};

use crate::technique::{PerTechnique, Technique};

mod sealed {
    /// The sums of densities that there are.
    #[expect(unnameable_types, reason = "no other crate is to implement it")]
    pub trait Sealed {}

    impl Sealed for f64 {}
    impl Sealed for super::ByTechnique {}
}

/// A sum of densities of techniques, with their counts, as the heuristic takes them.
///
/// The recursion is linear in the counts, so it can carry the sum of all techniques (`f64`, what a render
/// needs) or every technique for itself ([`ByTechnique`], from which the weights of any other counts follow).
/// Nothing else implements it.
pub trait Densities:
    sealed::Sealed + Copy + fmt::Debug + Send + Sync + Add<Output = Self> + Mul<f64, Output = Self>
{
    /// Densities of no technique.
    const ZERO: Self;

    /// Densities of one technique.
    fn of(technique: Technique, density: f64) -> Self;

    /// Density of all together.
    fn total(&self) -> f64;
}

impl Densities for f64 {
    const ZERO: Self = 0.0;

    #[inline]
    fn of(_: Technique, density: f64) -> Self {
        density
    }

    #[inline]
    fn total(&self) -> f64 {
        *self
    }
}

/// A product in which zero times infinity is zero: a technique that does not run does not count.
#[inline]
fn times(density: f64, factor: f64) -> f64 {
    if density == 0.0 || factor == 0.0 { 0.0 } else { density * factor }
}

/// Densities by technique.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ByTechnique {
    /// Density of each technique.
    pub of: PerTechnique<f64>,
}

impl Add for ByTechnique {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        Self { of: std::array::from_fn(|i| self.of[i] + other.of[i]) }
    }
}

impl Mul<f64> for ByTechnique {
    type Output = Self;

    #[inline]
    fn mul(self, factor: f64) -> Self {
        Self { of: self.of.map(|density| times(density, factor)) }
    }
}

impl Densities for ByTechnique {
    const ZERO: Self = Self { of: [0.0; Technique::COUNT] };

    #[inline]
    fn of(technique: Technique, density: f64) -> Self {
        let mut densities = Self::ZERO;
        densities.of[technique as usize] = density;
        densities
    }

    #[inline]
    fn total(&self) -> f64 {
        self.of.iter().sum()
    }
}

/// A technique's density among those of all that can make the same path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weight<D = f64> {
    /// Density of the technique that made the sample.
    pub own: f64,
    /// Densities of all techniques, that one among them.
    pub all: D,
}

impl<D: Densities> Weight<D> {
    /// Densities of a technique that is the only one.
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
