#![doc = include_str!("../README.md")]

mod census;
mod emitters;
mod error;
mod film;
mod output;
mod passes;
mod pilot;
mod radius;
mod render;
mod report;
mod settings;

pub use glam;
/// Participating media, phase functions, spectra.
pub use upbp_media as media;

pub use census::Census;
pub use error::{OutputError, RenderError, SettingsError};
pub use film::{Film, Image, Pixel};
pub use output::{Metadata, check_writable, read_exr, write_exr, write_png};
pub use radius::{Radii, Radius, RadiusSchedule};
pub use render::{Canceller, Outcome, Progress, Renderer, Stop, StopReason};
pub use report::{ErrorPoint, PassSeconds, Report};
pub use settings::{CheckedSettings, LightPaths, Settings};
pub use upbp_estimators::mis::{BeamExtent, Heuristic};
pub use upbp_estimators::{
    BodyId, Counters, Interior, Layer, MediumId, MediumStack, Ray, Spectrum, Technique, TechniqueSet, check,
    offset_origin, scene,
};
