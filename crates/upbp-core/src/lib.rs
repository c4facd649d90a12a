#![doc = include_str!("../README.md")]

mod adapt;
mod budget;
mod census;
mod choices;
mod emitters;
mod engine;
mod error;
mod error_estimate;
mod film;
mod input;
mod interleave;
mod iterations;
mod memory;
mod neighbours;
mod output;
mod passes;
mod pilot;
mod planner;
mod prepare;
mod radius;
mod render;
mod report;
mod settings;
mod stage;
mod state;
mod stop;
mod sum;
mod techniques;

pub use glam;
/// Participating media, phase functions, spectra.
pub use upbp_media as media;

pub use census::Census;
pub use error::{OutputError, RenderError, SettingsError, StateError};
pub use error_estimate::{Doubt, ErrorEstimate, ErrorMap, HalfImage};
pub use film::{Film, Image, Pixel};
pub use input::{open_exr, open_file, read_text};
pub use iterations::{IterationSet, MAX_ITERATIONS};
pub use output::{
    Content, Metadata, Output, check_outputs, check_writable, read_exr, remove_leftovers, write_exr,
    write_png, write_text,
};
pub use prepare::{Preparing, Start};
pub use radius::{Radii, Radius, RadiusSchedule};
pub use render::Renderer;
pub use report::{ErrorPoint, ErrorSeries, PassSeconds, Report};
pub use settings::{CheckedSettings, LightPaths, Settings};
pub use stage::{RenderPlan, Stage};
pub use state::{Identity, State};
pub use stop::{Canceller, Outcome, Progress, Stop, StopReason};
pub use techniques::{Techniques, UnknownTechniques};
pub use upbp_estimators::mis::{BeamExtent, Heuristic};
pub use upbp_estimators::{
    BodyId, Counters, Interior, Layer, MediumId, MediumStack, Ray, Roulette, Spectrum, Technique,
    TechniqueSet, check, offset_origin, scene,
};
