//! What can go wrong, for people.

use std::path::PathBuf;

use upbp_estimators::WorldError;

/// A setting that makes no sense.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("setting `{name}`: expected {expected}, found {found}")]
pub struct SettingsError {
    /// Name of the setting.
    pub name: &'static str,
    /// What would have been right.
    pub expected: &'static str,
    /// What was there.
    pub found: String,
}

/// A render that cannot start.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// A setting.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The scene.
    #[error("scene: {0}")]
    World(#[from] WorldError),
    /// The film does not fit.
    #[error("film of {width} x {height} pixels: its {needed} MiB exceed the memory budget of {budget} MiB")]
    Memory {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// What the film takes.
        needed: u64,
        /// The setting.
        budget: u64,
    },
}

/// A file that cannot be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The file system refuses.
    #[error("cannot write {}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The image cannot be encoded.
    #[error("cannot encode {}: {reason}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The image cannot be read.
    #[error("cannot read {} as an OpenEXR image: {reason}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
}
