#![doc = include_str!("../README.md")]

mod error;
mod frame;
mod homogeneous;
mod medium;
mod mixture;
mod phase;
mod segment;
mod spectrum;
mod stack;
#[cfg(test)]
mod testing;

/// The vector math of this crate's interface.
pub use glam;

pub use self::error::MediaError;
pub use self::frame::orthonormal_basis;
pub use self::homogeneous::Homogeneous;
pub use self::medium::Medium;
pub use self::phase::{Asymmetry, Blend, PhaseFunction, PhaseSample};
pub use self::segment::{EdgeDensity, RaySegment, SegmentDensity};
pub use self::spectrum::Spectrum;
pub use self::stack::{BodyId, Crossing, Interior, MediumId, MediumStack};
