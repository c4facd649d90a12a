#![doc = include_str!("../README.md")]

mod camera_output;
pub mod check;
mod counters;
mod emission_guide;
mod emitter_choice;
mod emitter_selection;
mod emitter_tree;
mod emitters_by_receiver;
mod features;
mod iteration;
mod kernel;
mod lens_emitters;
mod light_map;
mod merge_periods;
pub mod mis;
pub mod observer;
pub mod path;
mod prepared_scene;
mod radius_field;
mod random;
mod roulette;
pub mod scene;
mod technique;
mod techniques;
pub mod trace;

/// The vector math of this crate's interface.
pub use glam;
/// Participating media, phase functions, spectra.
pub use upbp_media as media;

pub use camera_output::CameraWalk;
pub use counters::Counters;
pub use emission_guide::{EmissionGuide, EmissionSample};
pub use emitter_choice::{EmitterChoice, EmitterChoiceError};
pub use emitter_selection::{EmitterSample, EmitterShares, effective_samples};
pub use features::Features;
pub use iteration::{IterationChoices, IterationPlan, Kernels, LEAST_RADIUS, NO_LIMIT, PathLengths};
pub use kernel::Kernel;
pub use light_map::LightMap;
pub use merge_periods::MergePeriods;
pub use prepared_scene::{PrepareError, PreparedScene};
pub use radius_field::{FootprintField, RadiusField};
pub use random::{Decision, Stream, StreamKind, half, pixel_index};
pub use roulette::{Roulette, Surroundings, Survival};
pub use technique::{Layer, PerMerge, PerTechnique, Technique, TechniqueSet, UnknownTechnique};
pub use upbp_accel::{GrowingRadius, RAY_OFFSET, Ray, SearchRadius, Segment, offset_origin};
pub use upbp_media::{BodyId, Interior, MediumId, MediumStack, Spectrum};
