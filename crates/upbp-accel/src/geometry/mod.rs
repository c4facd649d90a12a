//! Surfaces: shapes, meshes, and the hierarchy by which rays find them.

#![expect(clippy::inline_always, reason = "only what is inlined is compiled for the instruction set at hand")]

mod axis_box;
mod box_tree;
mod build;
mod error;
mod hierarchy;
mod hit;
mod instances;
mod lane_ray;
mod mesh;
mod model;
mod placement;
mod primitive;
mod primitive_block;
mod quad;
mod scene;
mod shape;
mod sphere;
mod surface;
mod topology;
mod triangle;
mod volume_sampling;

pub use axis_box::AxisBox;
pub use box_tree::BoxTree;
pub use error::GeometryError;
pub use hit::{Candidate, ShapeId, SurfacePoint, Visit};
pub use mesh::TriangleMesh;
pub use quad::Quad;
pub use scene::SceneGeometry;
pub use shape::Shape;
pub use sphere::Sphere;
pub use topology::{Border, Edges};
pub use volume_sampling::ShapeVolume;
