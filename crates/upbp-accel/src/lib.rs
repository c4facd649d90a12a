#![doc = include_str!("../README.md")]

mod geometry;
mod lookup;
mod ray;

pub use glam;

pub use geometry::{
    AxisBox, Candidate, GeometryError, Quad, SceneGeometry, Shape, ShapeId, Sphere, SurfacePoint,
    TriangleMesh, Visit,
};
pub use lookup::{
    ClosestApproach, PARALLEL_SIN2, PointTree, Segment, SegmentTree, SplitParams, closest_approach,
};
pub use ray::{Ray, offset_origin};
