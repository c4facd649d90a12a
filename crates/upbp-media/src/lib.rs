#![doc = include_str!("../README.md")]

mod basis;
mod channel_mixture;
mod error;
mod homogeneous;
mod lane_values;
mod lanes;
mod medium;
mod medium_stack;
mod phase;
mod segment;
mod spectrum;
#[cfg(test)]
mod testing;

/// The vector math of this crate's interface.
pub use glam;

pub use self::basis::orthonormal_basis;
pub use self::error::MediaError;
pub use self::homogeneous::Homogeneous;
pub use self::lane_values::LaneValues;
pub use self::lanes::{Lanes, lane_probabilities, lanes_cover};
pub use self::medium::Medium;
pub use self::medium_stack::{BodyId, Crossed, Interior, MediumId, MediumStack};
pub use self::phase::{
    Asymmetry, Blend, Draine, PerChannel, PhaseFunction, PhaseSample, PhaseValue, Tabulated,
};
pub use self::segment::{EdgeDensity, RaySegment, SegmentDensity};
pub use self::spectrum::Spectrum;
