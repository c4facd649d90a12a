//! The files that come of a render.

use std::path::{Path, PathBuf};

use clap::builder::{PathBufValueParser, TypedValueParser};
use upbp_core::{Content, Metadata, Output, OutputError, Report, State, write_exr, write_png, write_text};

/// Where images go: an OpenEXR image and a PNG beside it, or a PNG alone.
#[derive(Clone, Debug)]
pub(crate) struct Images {
    exr: Option<PathBuf>,
    png: PathBuf,
}

impl Images {
    /// By the ending of a name.
    pub(crate) fn named(path: PathBuf) -> Result<Self, String> {
        match ending(&path).as_deref() {
            Some("exr") => Ok(Self { png: path.with_extension("png"), exr: Some(path) }),
            Some("png") => Ok(Self { exr: None, png: path }),
            _ => Err(
                "expected a name that ends in .exr (OpenEXR, and a PNG beside it) or in .png (a PNG alone)"
                    .to_owned(),
            ),
        }
    }

    pub(crate) fn outputs(&self) -> impl Iterator<Item = Output<'_>> {
        let exr = self.exr.as_deref().map(|path| Output { role: "the image", path, content: Content::Exr });
        let role = if exr.is_some() { "the PNG beside the image" } else { "the image" };
        exr.into_iter().chain([Output { role, path: &self.png, content: Content::Png }])
    }

    pub(crate) fn write(&self, state: &State, report: &Report) -> Result<(), OutputError> {
        if let Some(path) = &self.exr {
            let identity = state.identity();
            let metadata = Metadata { scene: &identity.scene, settings: &identity.settings, report };
            write_exr(path, state.film(), &metadata)?;
        }
        write_png(&self.png, &state.film().image(), 1.0)
    }
}

/// Reads a path of the command line.
pub(crate) fn path<T: Clone + Send + Sync + 'static>(
    read: fn(PathBuf) -> Result<T, String>,
) -> impl TypedValueParser<Value = T> {
    PathBufValueParser::new().try_map(read)
}

/// A report to write: `.json`, or no ending.
pub(crate) fn report(path: PathBuf) -> Result<PathBuf, String> {
    ends_in(path, &["json"])
}

/// A state to write: `.state`, or no ending.
pub(crate) fn state(path: PathBuf) -> Result<PathBuf, String> {
    ends_in(path, &["state"])
}

/// Content goes with the ending of a name, so that nobody takes it for something else. A name may have none,
/// as those of devices.
pub(crate) fn ends_in(path: PathBuf, endings: &[&str]) -> Result<PathBuf, String> {
    match ending(&path) {
        Some(ending) if !endings.contains(&ending.as_str()) => {
            Err(format!("expected a name that ends in .{}, or has no ending", endings.join(" or .")))
        }
        _ => Ok(path),
    }
}

/// What follows the last dot of a name, in small letters.
fn ending(path: &Path) -> Option<String> {
    path.extension().map(|ending| ending.to_string_lossy().to_lowercase())
}

/// Writes a report as JSON.
pub(crate) fn write_report(report: &Report, path: &Path) -> Result<(), OutputError> {
    let text = serde_json::to_string_pretty(report)
        .map_err(|error| OutputError::Encode { path: path.to_owned(), reason: error.to_string() })?;
    write_text(path, &(text + "\n"))
}
