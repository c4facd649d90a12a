//! Sub-paths from both ends, and what lies between two vertices.

mod arrival;
mod camera;
mod context;
mod light;
mod passage;
mod photon;
mod site;
mod visibility;

pub use camera::{CameraWalk, trace_camera_path};
pub(crate) use camera::{Output, QueryEdge, QueryVertex};
pub use context::{Context, Scratch};
pub use light::trace_light_path;
pub use passage::{Extent, Passage, Span};
pub use photon::{EdgeSource, LightChunk, LightVertex, PhotonBeam, Splat};
pub use site::{Evaluation, Scattered, Sides, Site, SurfaceSite};
pub(crate) use visibility::ray_origin;
pub use visibility::{Target, clear_edge};

/// Directions closer to a tangent plane than this end a walk and forbid a connection, on both sides alike.
pub(crate) const MIN_COSINE: f32 = 1e-6;
