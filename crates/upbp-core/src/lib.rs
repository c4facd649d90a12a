#![doc = include_str!("../README.md")]

mod auto;
mod deadline;
mod error;
mod files;
mod film;
mod output;
mod parallel;
mod plan;
mod radius_schedule;
mod render;
mod report;
mod settings;
mod state;

pub use glam;
/// Participating media, phase functions, spectra.
pub use upbp_media as media;

pub use auto::technique_support::TechniqueSupport;
pub use deadline::{Canceller, Preparing, Stop};
pub use error::{MemoryLimit, OutputError, RenderError, SettingsError, StateError, TextError, describe};
pub use files::{
    Content, Output, abandon_files, check_outputs, open_exr, open_file, read_text, remove_leftovers,
    write_text,
};
pub use film::{Doubt, ErrorEstimate, ErrorMap, FeatureImages, Film, Image, IterationSet, MAX_ITERATIONS};
pub use output::{ToneCurve, ToneMapping, read_exr, write_exr, write_image, write_png};
pub use plan::{FrozenPlan, Plan};
pub use radius_schedule::{Radii, Radius, RadiusSchedule};
pub use render::{Progress, Renderer, Start, StopReason};
pub use report::Report;
pub use settings::{CheckedSettings, LightPaths, Settings, Techniques, UnknownTechniques};
pub use state::{ErrorPoint, ErrorSeries, Identity, PassSeconds, State};
pub use upbp_estimators::mis::{BeamExtent, Heuristic, MisPlan, VolumeMerge, VolumeMerges};
pub use upbp_estimators::{
    BodyId, Counters, EmissionGuide, EmissionSample, EmitterChoice, EmitterChoiceError, FootprintField,
    GrowingRadius, Interior, IterationChoices, IterationPlan, Kernel, Kernels, Layer, MediumId, MediumStack,
    MergePeriods, PathLengths, PerMerge, PerTechnique, PrepareError, RAY_OFFSET, RadiusField, Ray, Roulette,
    SearchRadius, Spectrum, Technique, TechniqueSet, UnknownTechnique, check, offset_origin, scene,
};
