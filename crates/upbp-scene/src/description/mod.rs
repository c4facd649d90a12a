//! The contents of a scene file, as plain data.
//!
//! One type per part of the file; the crate's README documents the format. Numbers are checked by their types
//! while a file is read, so that an error has a line and a column; an error that takes two places of the file
//! (a name that nobody defines, a quad without area) is found when the scene is
//! [built](crate::ReadyScene::build).
//!
//! The types can also be put together by hand, and written back with [`SceneDescription::to_ron`].

mod camera;
mod light;
mod material;
mod medium;
mod named_map;
mod scene;
mod shape;
mod single_value;
mod spelling;
mod text;
mod value;

pub use self::camera::{Camera, Crop, Film};
pub use self::light::Light;
pub use self::material::Material;
pub(crate) use self::medium::tabulated;
pub use self::medium::{Medium, Phase};
pub use self::named_map::Named;
pub use self::scene::SceneDescription;
pub use self::shape::{Geometry, Rotation, Shape};
pub(crate) use self::text::Fnv1a;
pub use self::value::{
    AngularDiameter, Asymmetries, Asymmetry, BeamAngle, Colour, Count, CutoffAngle, Degrees, Diameter,
    Exponent, FieldOfView, Ior, NonNegative, Positive, Reflectance, Roughness, Share, SmoothingAngle,
    ValueError, Vector, Version,
};
