//! Kinds with a single value, which may be written with its name or without: `Dielectric(ior: 1.5)` and
//! `Dielectric(1.5)`.

use std::fmt;
use std::marker::PhantomData;

use serde::de::value::SeqAccessDeserializer;
use serde::de::{Error, IntoDeserializer, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::value::{Asymmetries, Colour, Diameter, Ior, Reflectance};

/// One function per name, for `deserialize_with`.
macro_rules! single {
    ($($name:ident: $value:ty),* $(,)?) => {$(
        pub(super) fn $name<'de, D: Deserializer<'de>>(deserializer: D) -> Result<$value, D::Error> {
            read(deserializer, &[stringify!($name)])
        }
    )*};
}

single! {
    diameter: Diameter,
    ior: Ior,
    radiance: Colour,
    reflectance: Reflectance,
}

/// Asymmetries, whose name is short.
pub(super) fn asymmetries<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Asymmetries, D::Error> {
    read(deserializer, &["g"])
}

/// Reads a value with or without its `name`.
pub(super) fn read<'de, D: Deserializer<'de>, T: Deserialize<'de>>(
    deserializer: D,
    name: &'static [&'static str; 1],
) -> Result<T, D::Error> {
    deserializer.deserialize_any(Single { name, value: PhantomData })
}

/// Reads the value in the parentheses of a kind, with or without its name.
struct Single<T> {
    name: &'static [&'static str; 1],
    value: PhantomData<T>,
}

impl<'de, T: Deserialize<'de>> Visitor<'de> for Single<T> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a value, or `{}: value`", self.name[0])
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<T, E> {
        T::deserialize(value.into_deserializer())
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<T, E> {
        T::deserialize(value.into_deserializer())
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<T, E> {
        T::deserialize(value.into_deserializer())
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<T, E> {
        T::deserialize(value.into_deserializer())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, values: A) -> Result<T, A::Error> {
        T::deserialize(SeqAccessDeserializer::new(values))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut fields: A) -> Result<T, A::Error> {
        let mut value = None;
        while let Some(field) = fields.next_key::<String>()? {
            if field != self.name[0] {
                return Err(A::Error::unknown_field(&field, self.name));
            }
            if value.replace(fields.next_value()?).is_some() {
                return Err(A::Error::duplicate_field(self.name[0]));
            }
        }
        value.ok_or_else(|| A::Error::missing_field(self.name[0]))
    }
}
