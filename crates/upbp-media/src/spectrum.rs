//! Linear RGB: radiance, throughput, transmittance and coefficients.

use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Index, Mul, MulAssign, Sub};

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Linear RGB with Rec. 709 primaries.
///
/// The unit is that of the quantity: W m⁻² sr⁻¹ for radiance, inverse scene units for coefficients, none
/// for transmittance and throughput. All operators work channel by channel. Serialised as a tuple of
/// three numbers.
#[derive(Copy, Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[repr(transparent)]
#[serde(transparent)]
pub struct Spectrum(Vec3);

impl Spectrum {
    /// All channels zero.
    pub const ZERO: Self = Self::splat(0.0);
    /// All channels one.
    pub const ONE: Self = Self::splat(1.0);
    /// Weights of the channels in [`luminance`](Self::luminance): those of the Rec. 709 primaries.
    pub const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

    /// Creates a spectrum from its red, green and blue channels.
    #[inline]
    #[must_use]
    pub const fn new(r: f32, g: f32, b: f32) -> Self {
        Self(Vec3::new(r, g, b))
    }

    /// Creates a spectrum with the same value in all channels.
    #[inline]
    #[must_use]
    pub const fn splat(value: f32) -> Self {
        Self(Vec3::splat(value))
    }

    /// Creates a spectrum from `[red, green, blue]`.
    #[inline]
    #[must_use]
    pub const fn from_array(rgb: [f32; 3]) -> Self {
        Self(Vec3::from_array(rgb))
    }

    /// The channels as `[red, green, blue]`.
    #[inline]
    #[must_use]
    pub const fn to_array(self) -> [f32; 3] {
        self.0.to_array()
    }

    /// The red channel.
    #[inline]
    #[must_use]
    pub const fn r(self) -> f32 {
        self.0.x
    }

    /// The green channel.
    #[inline]
    #[must_use]
    pub const fn g(self) -> f32 {
        self.0.y
    }

    /// The blue channel.
    #[inline]
    #[must_use]
    pub const fn b(self) -> f32 {
        self.0.z
    }

    /// The largest channel; a NaN beside a number is ignored.
    #[inline]
    #[must_use]
    pub const fn max_component(self) -> f32 {
        self.r().max(self.g()).max(self.b())
    }

    /// The unweighted mean of the channels.
    #[inline]
    #[must_use]
    pub const fn mean(self) -> f32 {
        (self.r() + self.g() + self.b()) * (1.0 / 3.0)
    }

    /// Relative luminance of the Rec. 709 primaries: 0.2126 R + 0.7152 G + 0.0722 B.
    #[inline]
    #[must_use]
    pub const fn luminance(self) -> f32 {
        let [r, g, b] = Self::LUMINANCE;
        r as f32 * self.r() + g as f32 * self.g() + b as f32 * self.b()
    }

    /// Whether no channel is infinite or NaN.
    #[inline]
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.0.is_finite()
    }

    /// Whether every channel is exactly zero.
    #[inline]
    #[must_use]
    pub fn is_black(self) -> bool {
        // Not all at once: of most, the first channel tells.
        self.0.x == 0.0 && self.0.y == 0.0 && self.0.z == 0.0
    }

    /// Whether every channel is at least zero; NaN is not.
    #[inline]
    #[must_use]
    pub fn is_non_negative(self) -> bool {
        self.0.cmpge(Vec3::ZERO).all()
    }

    /// Applies `f` to every channel.
    #[inline]
    #[must_use]
    pub fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Self::new(f(self.r()), f(self.g()), f(self.b()))
    }

    /// The larger of the two values, channel by channel; a NaN beside a number is ignored.
    #[inline]
    #[must_use]
    pub const fn max(self, other: Self) -> Self {
        Self::new(self.r().max(other.r()), self.g().max(other.g()), self.b().max(other.b()))
    }
}

impl From<[f32; 3]> for Spectrum {
    #[inline]
    fn from(rgb: [f32; 3]) -> Self {
        Self::from_array(rgb)
    }
}

impl From<Spectrum> for [f32; 3] {
    #[inline]
    fn from(spectrum: Spectrum) -> Self {
        spectrum.to_array()
    }
}

impl Index<usize> for Spectrum {
    type Output = f32;

    /// Channel 0 is red, 1 green, 2 blue.
    ///
    /// # Panics
    ///
    /// On a channel above 2.
    #[inline]
    fn index(&self, channel: usize) -> &f32 {
        &self.0[channel]
    }
}

/// Implements operators channel by channel, and their forms that assign.
macro_rules! operators {
    ($($operator:ident<$other:ty>::$method:ident = |$a:ident, $b:ident| $result:expr;)*) => {$(
        impl $operator<$other> for Spectrum {
            type Output = Self;

            #[inline]
            fn $method(self, $b: $other) -> Self {
                let $a = self;
                Self($result)
            }
        }
    )*};
    (assign: $($operator:ident<$other:ty>::$method:ident = |$a:ident, $b:ident| $result:expr;)*) => {$(
        impl $operator<$other> for Spectrum {
            #[inline]
            fn $method(&mut self, $b: $other) {
                let $a = *self;
                *self = $result;
            }
        }
    )*};
}

operators! {
    Add<Self>::add = |a, b| a.0 + b.0;
    Sub<Self>::sub = |a, b| a.0 - b.0;
    Mul<Self>::mul = |a, b| a.0 * b.0;
    Div<Self>::div = |a, b| a.0 / b.0;
    Mul<f32>::mul = |a, b| a.0 * b;
    Div<f32>::div = |a, b| a.0 / b;
}

operators! { assign:
    AddAssign<Self>::add_assign = |a, b| a + b;
    MulAssign<Self>::mul_assign = |a, b| a * b;
    MulAssign<f32>::mul_assign = |a, b| a * b;
}

impl Mul<Spectrum> for f32 {
    type Output = Spectrum;

    #[inline]
    fn mul(self, spectrum: Spectrum) -> Spectrum {
        spectrum * self
    }
}

impl Sum for Spectrum {
    fn sum<I: Iterator<Item = Self>>(terms: I) -> Self {
        terms.fold(Self::ZERO, Add::add)
    }
}

#[cfg(test)]
mod tests {
    use serde::de::value::{Error, SeqDeserializer};

    use super::*;

    const COLOUR: Spectrum = Spectrum::new(0.25, 2.0, -4.0);

    #[test]
    fn operators_work_channel_by_channel() {
        let other = Spectrum::new(2.0, 0.5, 8.0);
        assert_eq!(COLOUR + other, Spectrum::new(2.25, 2.5, 4.0));
        assert_eq!(COLOUR - other, Spectrum::new(-1.75, 1.5, -12.0));
        assert_eq!(COLOUR * other, Spectrum::new(0.5, 1.0, -32.0));
        assert_eq!(COLOUR / other, Spectrum::new(0.125, 4.0, -0.5));
        assert_eq!(2.0 * COLOUR, COLOUR * 2.0);
        assert_eq!(COLOUR / 0.5, COLOUR * 2.0);
        assert_eq!([COLOUR, other, other].into_iter().sum::<Spectrum>(), COLOUR + other + other);
        let mut assigned = COLOUR;
        assigned += other;
        assigned *= other;
        assigned *= 2.0;
        assert_eq!(assigned, 2.0 * ((COLOUR + other) * other));
    }

    #[test]
    fn summaries_see_the_right_channels() {
        assert_eq!(COLOUR.max_component(), 2.0);
        assert_eq!((COLOUR[0], COLOUR[1], COLOUR[2]), (COLOUR.r(), COLOUR.g(), COLOUR.b()));
        assert!((COLOUR.mean() + 1.75 / 3.0).abs() < 1e-6);
        assert!((Spectrum::ONE.luminance() - 1.0).abs() < 1e-6);
        assert_eq!(Spectrum::LUMINANCE.map(|weight| weight as f32), [0.2126, 0.7152, 0.0722]);
        assert_eq!(COLOUR.max(Spectrum::ZERO), Spectrum::new(0.25, 2.0, 0.0));
    }

    #[test]
    fn predicates_catch_non_numbers() {
        let nan = Spectrum::new(0.0, f32::NAN, 0.0);
        assert!(!nan.is_finite() && !nan.is_non_negative() && !nan.is_black());
        assert!(!Spectrum::splat(f32::INFINITY).is_finite());
        assert!(!COLOUR.is_non_negative() && COLOUR.is_finite());
        assert!(Spectrum::new(0.0, -0.0, 0.0).is_black() && Spectrum::ZERO.is_non_negative());
    }

    #[test]
    fn reads_from_three_numbers() {
        let read =
            |numbers: Vec<f32>| Spectrum::deserialize(SeqDeserializer::<_, Error>::new(numbers.into_iter()));
        assert_eq!(read(vec![0.25, 2.0, -4.0]), Ok(COLOUR));
        assert!(read(vec![0.25, 2.0]).is_err());
    }
}
