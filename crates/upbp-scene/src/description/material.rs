//! Materials.

use serde::{Deserialize, Serialize};

use super::single_value;
use super::value::{Colour, Exponent, Ior, Reflectance, Roughness};

/// A surface material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Material {
    /// A matt surface, by its albedo; both sides reflect.
    #[serde(deserialize_with = "single_value::reflectance")]
    Lambert(Reflectance),
    /// A matt surface with a glossy lobe; both sides reflect.
    Phong {
        /// Albedo of the matt part.
        diffuse: Reflectance,
        /// Albedo of the lobe; with the matt part at most 1.
        specular: Reflectance,
        /// Exponent of the lobe: the higher, the narrower.
        exponent: Exponent,
    },
    /// A perfectly smooth metal, by its reflectance; both sides reflect.
    #[serde(deserialize_with = "single_value::reflectance")]
    Mirror(Reflectance),
    /// Rough metal by its complex index of refraction; both sides reflect.
    Conductor {
        /// Width of the distribution of normals.
        alpha: Roughness,
        /// Real part of the index.
        eta: Colour,
        /// Imaginary part of the index.
        k: Colour,
    },
    /// Rough metal by its colour at normal incidence; both sides reflect.
    Metal {
        /// Width of the distribution of normals.
        alpha: Roughness,
        /// Share of the light that is reflected at normal incidence.
        reflectance: Reflectance,
    },
    /// Smooth glass: bounds a body.
    #[serde(deserialize_with = "single_value::ior")]
    Dielectric {
        /// Index of refraction of the body.
        ior: Ior,
    },
    /// Rough glass: bounds a body.
    RoughDielectric {
        /// Width of the distribution of normals.
        alpha: Roughness,
        /// Index of refraction of the body.
        ior: Ior,
    },
    /// An invisible boundary of a body that does not refract.
    Null,
}
