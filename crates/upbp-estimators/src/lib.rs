#![doc = include_str!("../README.md")]

pub mod check;
mod counters;
mod estimate;
mod kernel;
mod light_map;
mod look_ups;
pub mod mis;
pub mod observer;
mod plan;
mod random;
mod roulette;
pub mod scene;
mod technique;
pub mod walk;
mod world;

pub use counters::Counters;
pub use kernel::Kernel;
pub use light_map::LightMap;
pub use look_ups::LookUps;
pub use plan::{Kernels, PathLengths, Plan, PlanChoices};
pub use random::{Stream, StreamKind, half};
pub use roulette::{Roulette, Survival};
pub use technique::{Layer, Technique, TechniqueSet, UnknownTechnique};
pub use upbp_accel::{Ray, offset_origin};
pub use upbp_media::{BodyId, Interior, MediumId, MediumStack, Spectrum};
pub use world::{EmitterShares, World, WorldError};
