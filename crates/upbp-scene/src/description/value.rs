//! Numbers that are checked when they are read.
//!
//! Each type accepts one range and refuses the rest, NaN and infinities included, with a message that says
//! what was expected; the reader adds line and column.

use std::fmt;

use glam::Vec3;
use serde::de::{Error as _, Expected, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use upbp_media::Spectrum;

/// Largest coordinate, in scene units: squares and cubes of lengths stay finite in single precision.
const MAX_COORDINATE: f32 = 1e12;

/// A value outside the range of its type.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("expected {expected}, found {found}")]
pub struct ValueError {
    /// The accepted range, in words.
    pub expected: &'static str,
    /// The value, as text.
    pub found: String,
}

/// Whether a field may be left out of a file.
pub(super) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// A number as a person would write it.
fn shown(value: f32) -> String {
    let plain = value == 0.0 || !value.is_finite() || (1e-4..1e7).contains(&value.abs());
    if plain { value.to_string() } else { format!("{value:e}") }
}

fn triple(values: [f32; 3]) -> String {
    format!("({})", values.map(shown).join(", "))
}

/// A number in a range.
macro_rules! number {
    ($(#[$doc:meta])* $name:ident($inner:ty), $expected:literal, $accepts:expr) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(try_from = "f32", into = "f32")]
        pub struct $name($inner);

        impl $name {
            /// Accepts a number in the range of the type.
            pub fn new(value: f32) -> Result<Self, ValueError> {
                let accepts: fn(f32) -> bool = $accepts;
                if accepts(value) {
                    Ok(Self(value))
                } else {
                    Err(ValueError { expected: $expected, found: shown(value) })
                }
            }

            /// The number.
            #[must_use]
            pub const fn get(self) -> f32 {
                self.0
            }
        }

        impl TryFrom<f32> for $name {
            type Error = ValueError;

            fn try_from(value: f32) -> Result<Self, ValueError> {
                Self::new(value)
            }
        }

        impl From<$name> for f32 {
            fn from(value: $name) -> Self {
                value.0
            }
        }
    };
}

number!(
    /// A number in `[0, 1e12]`.
    NonNegative(f32), "a number from 0 to 1e12", |x| (0.0..=MAX_COORDINATE).contains(&x)
);
number!(
    /// A number above zero, in `[1.2e-38, 1e12]`.
    Positive(f32), "a number above 0, from 1.2e-38 to 1e12", |x| (1.2e-38..=MAX_COORDINATE).contains(&x)
);
number!(
    /// A Henyey-Greenstein asymmetry, in `(-1, 1)`.
    Asymmetry(f32), "a mean cosine above -1 and below 1", |x| x > -1.0 && x < 1.0
);
number!(
    /// A share of a whole, in `(0, 1)`.
    Share(f32), "a share above 0 and below 1", |x| x > 0.0 && x < 1.0
);
number!(
    /// Diameter of water droplets in micrometres, in `(0, 50]`.
    Diameter(f32), "a diameter above 0 and up to 50 micrometres", |x| x > 0.0 && x <= 50.0
);
number!(
    /// An index of refraction, in `[0.1, 10]`.
    Ior(f32), "an index of refraction from 0.1 to 10", |x| (0.1..=10.0).contains(&x)
);
number!(
    /// Exponent of a glossy lobe, in `[0, 1e8]`: a narrower one is lost in single precision.
    Exponent(f32), "an exponent from 0 to 1e8 (for more, use a mirror)", |x| (0.0..=1e8).contains(&x)
);
number!(
    /// Width of the distribution of normals of a rough surface, in `[0.001, 1]`.
    Roughness(f32), "a roughness from 0.001 to 1 (for less, use a smooth material)", |x| (0.001..=1.0).contains(&x)
);
number!(
    /// Full horizontal angle of an image in degrees, in `[0.001, 179]`.
    FieldOfView(f32), "an angle from 0.001 to 179 degrees", |x| (0.001..=179.0).contains(&x)
);
number!(
    /// Half angle of a cone in degrees up to which a spot has its full intensity, in `[0, 180]`.
    BeamAngle(f32), "an angle from 0 to 180 degrees", |x| (0.0..=180.0).contains(&x)
);
number!(
    /// Half angle of a cone in degrees at which a spot ends, in `[0.01, 180]`.
    CutoffAngle(f32), "an angle from 0.01 to 180 degrees", |x| (0.01..=180.0).contains(&x)
);
number!(
    /// Full angle of a disc of the sky in degrees, in `[0.01, 180]`.
    AngularDiameter(f32), "an angle from 0.01 to 180 degrees", |x| (0.01..=180.0).contains(&x)
);
number!(
    /// The largest angle in degrees between planes that are shaded as one surface, in `[0, 180]`.
    SmoothingAngle(f32), "an angle from 0 to 180 degrees", |x| (0.0..=180.0).contains(&x)
);
number!(
    /// An angle in degrees, in `[-360, 360]`.
    Degrees(f32), "an angle from -360 to 360 degrees", |x| (-360.0..=360.0).contains(&x)
);

impl NonNegative {
    /// Zero.
    pub const ZERO: Self = Self(0.0);
}

impl AngularDiameter {
    /// The sun's from the earth, half a degree.
    pub const OF_THE_SUN: Self = Self(0.53);
}

impl Positive {
    /// One.
    pub const ONE: Self = Self(1.0);
}

impl SmoothingAngle {
    /// No smoothing.
    pub const ZERO: Self = Self(0.0);
}

impl Default for SmoothingAngle {
    fn default() -> Self {
        Self::ZERO
    }
}

impl Degrees {
    /// No rotation.
    pub const ZERO: Self = Self(0.0);
}

impl Default for Degrees {
    fn default() -> Self {
        Self::ZERO
    }
}

/// The format's version: 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(try_from = "u32", into = "u32")]
pub struct Version;

impl TryFrom<u32> for Version {
    type Error = ValueError;

    fn try_from(version: u32) -> Result<Self, ValueError> {
        if version == 1 {
            Ok(Self)
        } else {
            Err(ValueError { expected: "version 1 of the format", found: version.to_string() })
        }
    }
}

impl From<Version> for u32 {
    fn from(_: Version) -> Self {
        1
    }
}

/// A number of pixels along one side of an image, in `[1, 65536]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "u32", into = "u32")]
pub struct Count(u32);

impl Count {
    /// Accepts a number in the range of the type.
    pub fn new(value: u32) -> Result<Self, ValueError> {
        if (1..=65_536).contains(&value) {
            Ok(Self(value))
        } else {
            Err(ValueError { expected: "a number of pixels from 1 to 65536", found: value.to_string() })
        }
    }

    /// Width and height of an image whose file gives none.
    pub(super) const DEFAULT: Self = Self(512);

    /// The number.
    #[must_use]
    pub const fn get(self) -> u32 {
        self.0
    }
}

impl TryFrom<u32> for Count {
    type Error = ValueError;

    fn try_from(value: u32) -> Result<Self, ValueError> {
        Self::new(value)
    }
}

impl From<Count> for u32 {
    fn from(value: Count) -> Self {
        value.0
    }
}

/// Three finite numbers: a point or a direction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(into = "[f32; 3]")]
pub struct Vector(Vec3);

impl Vector {
    /// Upwards: +y.
    pub const UP: Self = Self(Vec3::Y);
    /// The origin.
    pub const ZERO: Self = Self(Vec3::ZERO);

    /// Accepts a vector whose coordinates are finite and at most 10¹² in size.
    pub fn new(value: Vec3) -> Result<Self, ValueError> {
        if value.is_finite() && value.abs().max_element() <= MAX_COORDINATE {
            Ok(Self(value))
        } else {
            let expected = "finite coordinates between -1e12 and 1e12";
            Err(ValueError { expected, found: triple(value.to_array()) })
        }
    }

    /// The coordinates.
    #[must_use]
    pub const fn get(self) -> Vec3 {
        self.0
    }
}

impl<'de> Deserialize<'de> for Vector {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = deserializer.deserialize_any(Coordinates)?;
        Self::new(value.into()).map_err(D::Error::custom)
    }
}

impl From<Vector> for [f32; 3] {
    fn from(value: Vector) -> Self {
        value.0.into()
    }
}

/// Red, green and blue, in a range. A single number stands for grey.
macro_rules! colour {
    ($(#[$doc:meta])* $name:ident, $expected:literal, $accepts:expr) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $name(Spectrum);

        impl $name {
            /// Black.
            pub const ZERO: Self = Self(Spectrum::ZERO);

            /// Accepts a spectrum whose channels are in the range of the type.
            pub fn new(value: Spectrum) -> Result<Self, ValueError> {
                let accepts: fn(f32) -> bool = $accepts;
                let [r, g, b] = value.to_array();
                if accepts(r) && accepts(g) && accepts(b) {
                    Ok(Self(value))
                } else {
                    let found = if [g, b] == [r; 2] { shown(r) } else { triple([r, g, b]) };
                    Err(ValueError { expected: $expected, found })
                }
            }

            /// The channels.
            #[must_use]
            pub const fn get(self) -> Spectrum {
                self.0
            }
        }

        impl Default for $name {
            fn default() -> Self {
                Self::ZERO
            }
        }

        impl Serialize for $name {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                let channels = self.0.to_array();
                if channels == [channels[0]; 3] {
                    channels[0].serialize(serializer)
                } else {
                    channels.serialize(serializer)
                }
            }
        }

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let value = deserializer.deserialize_any(Channels)?;
                Self::new(value).map_err(D::Error::custom)
            }
        }
    };
}

colour!(
    /// Three numbers in `[0, 1e12]`: radiance, intensity, a coefficient.
    Colour, "numbers from 0 to 1e12", |x| (0.0..=MAX_COORDINATE).contains(&x)
);
colour!(
    /// Three numbers in `[0, 1]`: the share of light that is reflected.
    Reflectance, "numbers from 0 to 1", |x| (0.0..=1.0).contains(&x)
);

colour!(
    /// Three numbers in `(-1, 1)`: the mean cosine of each channel.
    Asymmetries, "a mean cosine above -1 and below 1", |x| x > -1.0 && x < 1.0
);

impl Reflectance {
    /// The reflectance of a surface that absorbs nothing.
    pub const ONE: Self = Self(Spectrum::ONE);
}

/// Reads `(r, g, b)` or a single number.
struct Channels;

impl<'de> Visitor<'de> for Channels {
    type Value = Spectrum;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a colour: a number, or three in parentheses (r, g, b)")
    }

    fn visit_f64<E>(self, grey: f64) -> Result<Spectrum, E> {
        Ok(Spectrum::splat(grey as f32))
    }

    fn visit_f32<E>(self, grey: f32) -> Result<Spectrum, E> {
        Ok(Spectrum::splat(grey))
    }

    fn visit_u64<E>(self, grey: u64) -> Result<Spectrum, E> {
        Ok(Spectrum::splat(grey as f32))
    }

    fn visit_i64<E>(self, grey: i64) -> Result<Spectrum, E> {
        Ok(Spectrum::splat(grey as f32))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, channels: A) -> Result<Spectrum, A::Error> {
        three(channels, &self).map(Spectrum::from_array)
    }
}

/// Reads `(x, y, z)`.
struct Coordinates;

impl<'de> Visitor<'de> for Coordinates {
    type Value = [f32; 3];

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("three numbers in parentheses (x, y, z)")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, coordinates: A) -> Result<[f32; 3], A::Error> {
        three(coordinates, &self)
    }
}

/// Reads three numbers and no more.
fn three<'de, A: SeqAccess<'de>>(mut numbers: A, expected: &dyn Expected) -> Result<[f32; 3], A::Error> {
    let mut three = [0.0; 3];
    for (index, number) in three.iter_mut().enumerate() {
        *number = numbers.next_element()?.ok_or_else(|| A::Error::invalid_length(index, expected))?;
    }
    if numbers.next_element::<f32>()?.is_some() {
        return Err(A::Error::invalid_length(4, expected));
    }
    Ok(three)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_in_range_is_refused() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1e-30] {
            assert!(NonNegative::new(bad).is_err());
            assert!(Positive::new(bad).is_err());
            assert!(Reflectance::new(Spectrum::new(0.5, bad, 0.5)).is_err());
        }
        assert!(NonNegative::new(0.0).is_ok());
        assert!(Positive::new(0.0).is_err());
        assert!(Positive::new(1e-40).is_err());
        assert!(Vector::new(Vec3::new(0.0, f32::NAN, 0.0)).is_err());
        assert!(Asymmetry::new(1.0).is_err());
        assert!(Count::new(0).is_err());
    }
}
