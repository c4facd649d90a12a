//! Look-up structures: photon points and photon beams near a point or a ray.
//!
//! Both rest on one [packed tree](tree), items sorted into blocks of eight and blocks into nodes of eight,
//! and on one [traversal](query). The search radius belongs to the query, which widens the boxes that it
//! tests.

#![expect(clippy::inline_always, reason = "only what is inlined is compiled for the instruction set at hand")]

mod boxes;
mod closest_approach;
mod point_tree;
mod query;
mod radius;
mod region;
mod segment_tree;
mod sort;
mod split;
mod split_choice;
mod tree;

pub use closest_approach::{ClosestApproach, PARALLEL_SIN2, Segment, closest_approach};
pub use point_tree::PointTree;
pub use radius::{GrowingRadius, SearchRadius};
pub use segment_tree::SegmentTree;
pub use split::SplitParams;

#[cfg(test)]
mod tests;
