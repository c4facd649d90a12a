//! The files that come of a render.

use std::path::{Path, PathBuf};

use upbp_core::{Metadata, OutputError, Report, State, write_exr, write_png, write_text};

/// The picture beside an OpenEXR image.
pub(crate) fn picture(image: &Path) -> PathBuf {
    image.with_extension("png")
}

/// Writes an OpenEXR image, and a PNG beside it.
pub(crate) fn write_images(state: &State, report: &Report, image: &Path) -> Result<(), OutputError> {
    let identity = state.identity();
    let metadata = Metadata { scene: &identity.scene, settings: &identity.settings, report };
    write_exr(image, state.film(), &metadata)?;
    write_png(&picture(image), &state.film().image(), 1.0)
}

/// Writes a report as JSON.
pub(crate) fn write_report(report: &Report, path: &Path) -> Result<(), OutputError> {
    let text = serde_json::to_string_pretty(report)
        .map_err(|error| OutputError::Encode { path: path.to_owned(), reason: error.to_string() })?;
    write_text(path, &(text + "\n"))
}
