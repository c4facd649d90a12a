#![cfg_attr(feature = "geometry", doc = include_str!("../README.md"))]
#![cfg_attr(not(feature = "geometry"), doc = "Look-up structures for photon points and beams.")]

#[cfg(feature = "geometry")]
mod geometry;
mod lookup;
mod ray;
mod simd;

pub use glam;

#[cfg(feature = "geometry")]
pub use geometry::{
    AxisBox, Border, BoxTree, Candidate, Edges, GeometryError, Quad, SceneGeometry, Shape, ShapeId,
    ShapeVolume, Sphere, SurfacePoint, TriangleMesh, Visit,
};
pub use lookup::{
    ClosestApproach, GrowingRadius, PARALLEL_SIN2, PointTree, SearchRadius, Segment, SegmentTree,
    SplitParams, closest_approach,
};
pub use ray::{RAY_OFFSET, Ray, offset_origin};
