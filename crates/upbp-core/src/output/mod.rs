//! Image files. Written beside their place and moved there when complete: nobody ever sees half a file.

mod exr_file;
mod png_file;

use std::fs;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

pub use exr_file::{Metadata, read_exr, write_exr};
pub use png_file::write_png;

use crate::error::OutputError;

/// Checks that a file can be written, before hours are spent on its content.
///
/// # Errors
/// What the file system says.
pub fn check_writable(path: &Path) -> Result<(), OutputError> {
    let fail = |source| OutputError::Write { path: path.to_owned(), source };
    if path.is_dir() {
        return Err(fail(std::io::Error::from(std::io::ErrorKind::IsADirectory)));
    }
    let temporary = beside(path);
    fs::File::create(&temporary).map_err(fail)?;
    fs::remove_file(&temporary).map_err(fail)
}

/// Writes a file as a whole or not at all.
fn write_whole(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<fs::File>) -> Result<(), OutputError>,
) -> Result<(), OutputError> {
    let fail = |source| OutputError::Write { path: path.to_owned(), source };
    let temporary = beside(path);
    let written = (|| {
        let mut writer = BufWriter::new(fs::File::create(&temporary).map_err(fail)?);
        content(&mut writer)?;
        let file = writer.into_inner().map_err(|error| fail(error.into_error()))?;
        file.sync_all().map_err(fail)?;
        fs::rename(&temporary, path).map_err(fail)
    })();
    if written.is_err() {
        // Best effort: the first error is the one to report.
        let _ = fs::remove_file(&temporary);
    }
    written
}

/// A name in the same folder, so that moving is a rename.
fn beside(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.part", std::process::id()));
    path.with_file_name(name)
}
