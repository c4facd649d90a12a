#![doc = include_str!("../README.md")]

mod build;
mod camera;
pub mod description;
mod error;
pub mod light;
pub mod material;
pub mod obj;
pub mod phase_table;
#[cfg(not(test))] // The unit tests render nothing, and are built in a minute less.
mod render;
mod sampling;
mod scene;

pub use self::camera::{PerspectiveCamera, PerspectiveView};
pub use self::description::SceneDescription;
pub use self::error::{Problem, SceneError};
pub use self::light::Light;
pub use self::material::Material;
pub use self::scene::ReadyScene;

/// The scene format, as Markdown: what a scene file may hold, with examples and defaults.
#[must_use]
pub fn scene_format() -> &'static str {
    let readme = include_str!("../README.md");
    &readme[readme.find("## The scene format").unwrap_or(0)..]
}
