#![doc = include_str!("../README.md")]

pub mod check;
mod counters;
mod emission_guide;
mod emitter_choice;
mod film_sample;
mod iteration;
mod kernel;
mod light_map;
pub mod mis;
pub mod observer;
pub mod path;
mod periods;
mod prepared;
mod radius_field;
mod random;
mod roulette;
pub mod scene;
mod technique;
mod techniques;
pub mod trace;

pub use counters::Counters;
pub use emission_guide::{EmissionGuide, EmissionSample};
pub use emitter_choice::{EmitterChoice, EmitterShares};
pub use film_sample::CameraWalk;
pub use iteration::{IterationChoices, IterationPlan, Kernels, PathLengths};
pub use kernel::Kernel;
pub use light_map::LightMap;
pub use periods::MergePeriods;
pub use prepared::{PrepareError, PreparedScene};
pub use radius_field::{FootprintField, RadiusField};
pub use random::{Stream, StreamKind, half};
pub use roulette::{Roulette, Survival};
pub use technique::{Layer, PerMerge, Technique, TechniqueSet, UnknownTechnique};
pub use upbp_accel::{Ray, offset_origin};
pub use upbp_media::{BodyId, Interior, MediumId, MediumStack, Spectrum};
