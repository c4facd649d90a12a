//! The whole scene file.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::camera::{Camera, Film};
use super::light::Light;
use super::material::Material;
use super::medium::Medium;
use super::named_map::Named;
use super::shape::Shape;
use super::value::Version;

/// The contents of a scene file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename = "Scene", deny_unknown_fields)]
pub struct SceneDescription {
    /// Version of the format: 1.
    pub version: Version,
    /// The camera.
    pub camera: Camera,
    /// Size of the image, and the part of it to render.
    #[serde(default)]
    pub film: Film,
    /// Name of the medium around everything; vacuum if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outside: Option<String>,
    /// Media by name.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    pub media: Named<Medium>,
    /// Materials by name.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    pub materials: Named<Material>,
    /// Surfaces and bodies, in any order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shapes: Vec<Shape>,
    /// Lights that are no surfaces.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lights: Vec<Light>,
}

impl SceneDescription {
    /// Names of the media that something is filled with.
    pub(crate) fn used_media(&self) -> BTreeSet<&str> {
        let interiors = self.shapes.iter().filter_map(|shape| shape.interior.as_deref());
        interiors.chain(self.outside.as_deref()).collect()
    }
}
