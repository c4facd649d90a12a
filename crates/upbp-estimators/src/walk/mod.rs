//! Sub-paths from both ends, and what lies between two vertices.

mod camera;
mod context;
mod light;
mod passage;
mod site;
mod visibility;

pub use camera::{CameraWalk, trace_camera_path};
pub(crate) use camera::{Output, QueryEdge, QueryVertex};
pub use context::{Context, Scratch};
pub use light::{EdgeSource, LightChunk, LightVertex, PhotonBeam, Splat, trace_light_path};
pub use passage::{Passage, Span};
pub use site::{Evaluation, Scattered, Site, SurfaceSite};
pub(crate) use visibility::ray_origin;
pub use visibility::{Target, clear_edge};

/// Directions closer to a tangent plane than this end a walk and forbid a connection, on both sides alike.
pub(crate) const MIN_COSINE: f32 = 1e-6;
