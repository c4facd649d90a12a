//! What a scene file says, as plain data.
//!
//! One type per part of the file; the crate's README documents the format. Numbers are checked by their
//! types while a file is read, so that an error has a line and a column; what needs two places of the file
//! to be wrong (a name that nobody defines, a quad without area) is checked when the scene is
//! [built](crate::ReadyScene::build).
//!
//! The types can also be put together by hand, and written back with [`SceneDescription::to_ron`].

mod camera;
mod light;
mod material;
mod medium;
mod named;
mod shape;
mod single;
mod spelling;
mod text;
mod value;

use serde::{Deserialize, Serialize};

pub use self::camera::{Camera, Crop, Film};
pub use self::light::Light;
pub use self::material::Material;
pub use self::medium::{Medium, Phase};
pub use self::named::Named;
pub use self::shape::{Geometry, Shape};
pub(crate) use self::text::Fnv1a;
pub use self::value::{
    Asymmetry, BeamAngle, Colour, Count, CutoffAngle, Degrees, FieldOfView, Ior, NonNegative, Positive,
    Reflectance, Roughness, ValueError, Vector, Version,
};

/// A whole scene file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename = "Scene", deny_unknown_fields)]
pub struct SceneDescription {
    /// Version of the format: 1.
    pub version: Version,
    /// The camera.
    pub camera: Camera,
    /// The image.
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
    /// Surfaces.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shapes: Vec<Shape>,
    /// Lights that are no surfaces.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lights: Vec<Light>,
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}
