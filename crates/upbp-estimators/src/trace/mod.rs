//! The two walks, on top of everything else.

mod camera;
mod first_seen;
mod light;

pub use camera::trace_camera_path;
pub use light::trace_light_path;
