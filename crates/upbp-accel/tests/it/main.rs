//! Shapes and hierarchies, and the trees of points and segments, against brute force.

mod points;
#[cfg(feature = "geometry")]
mod scene;
mod segments;
#[cfg(feature = "geometry")]
mod shapes;
mod support;
