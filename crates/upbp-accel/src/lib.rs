#![doc = include_str!("../README.md")]

mod error;
mod lookup;
mod ray;
mod scene;
mod shape;

pub use glam;

pub use error::GeometryError;
pub use lookup::{
    ClosestApproach, PARALLEL_SIN2, PointTree, Segment, SegmentTree, SplitParams, closest_approach,
};
pub use ray::{Ray, offset_origin};
pub use scene::{Candidate, SceneGeometry, ShapeId, SurfacePoint, Visit};
pub use shape::{AxisBox, Quad, Shape, Sphere, TriangleMesh};
