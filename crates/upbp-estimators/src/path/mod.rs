//! Sub-paths as data: edges, the vertices at their ends, what lies between two vertices.

mod arrival;
mod context;
mod crossing;
mod edge;
mod interaction;
mod vertex;
mod visibility;
mod walk_state;

pub(crate) use arrival::{Arrival, Arrived, arrive, depart};
pub use context::{Context, Scratch};
pub(crate) use crossing::{cross_all, has_surface};
pub use edge::{EdgeTrace, Extent, MediumSpan};
pub(crate) use interaction::MIN_COSINE;
pub use interaction::{Evaluation, Interaction, MediumInterface, Scattered, SurfaceInteraction};
pub(crate) use vertex::{CameraEdge, CameraVertex, LightEdge};
pub use vertex::{EdgeSource, LightChunk, LightVertex, PhotonBeam, Splat};
pub(crate) use visibility::ray_origin;
pub use visibility::{Target, clear_edge};
pub use walk_state::WalkState;
