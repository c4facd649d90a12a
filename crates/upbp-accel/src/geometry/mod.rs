//! Surfaces: shapes, meshes, and the hierarchy by which rays find them.

mod axis_box;
mod error;
mod hierarchy;
mod hit;
mod mesh;
mod primitive;
mod quad;
mod scene;
mod shape;
mod sphere;
mod triangle;
mod volume;

pub use axis_box::AxisBox;
pub use error::GeometryError;
pub use hit::{Candidate, ShapeId, SurfacePoint, Visit};
pub use mesh::TriangleMesh;
pub use quad::Quad;
pub use scene::SceneGeometry;
pub use shape::Shape;
pub use sphere::Sphere;
pub use volume::ShapeVolume;
