//! Reading files that others made: regular ones only, of bounded size.

use std::fs::{self, File};
use std::io::{self, BufReader, Read as _, Seek as _};
use std::path::Path;

/// The longest text that is read, in bytes.
const MAX_TEXT: u64 = 1 << 28;

/// Opens a regular file of at most `limit` bytes. Anything else is refused before it is opened: a device may
/// be without an end, and a pipe may never begin.
///
/// # Errors
/// The file system's own, or one that names what was found instead of such a file.
pub fn open_file(path: &Path, limit: u64) -> io::Result<File> {
    let metadata = fs::metadata(path)?;
    if !metadata.is_file() {
        let found = if metadata.is_dir() { "a folder" } else { "a device, a pipe or a socket" };
        let message = format!("expected a regular file, found {found}");
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    if metadata.len() > limit {
        let message = format!("has {} bytes, expected at most {limit}", metadata.len());
        return Err(io::Error::new(io::ErrorKind::InvalidData, message));
    }
    File::open(path)
}

/// Reads a text, such as a scene, settings or a plan, of at most 256 MiB. A byte order mark at its start is
/// left out.
///
/// # Errors
/// Those of [`open_file`]; or one that names the line that is not UTF-8.
pub fn read_text(path: &Path) -> io::Result<String> {
    let mut bytes = Vec::new();
    // Files that the system makes up have no size before they are read.
    open_file(path, MAX_TEXT)?.take(MAX_TEXT).read_to_end(&mut bytes)?;
    let mut text = String::from_utf8(bytes).map_err(|error| {
        let good = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = good.split(|&byte| byte == b'\n').count();
        io::Error::new(io::ErrorKind::InvalidData, format!("line {line}: expected UTF-8 text"))
    })?;
    if text.starts_with('\u{feff}') {
        text.remove(0);
    }
    Ok(text)
}

/// Opens an `OpenEXR` image. One that says it is larger than its file can hold is refused, since decoders
/// take all memory before they read the first pixel.
///
/// # Errors
/// Those of [`open_file`]; or one that says what is wrong with the header.
pub fn open_exr(path: &Path) -> io::Result<BufReader<File>> {
    // No compression of the format makes more of a byte, but for DWA of pictures that are nearly constant;
    // the rest is for small images.
    const BYTES_PER_BYTE: u64 = 1100;
    const SMALL: u64 = 1 << 16;
    let file = open_file(path, u64::MAX)?;
    let size = file.metadata()?.len();
    let mut reader = BufReader::new(file);
    let invalid = |error: exr::error::Error| io::Error::new(io::ErrorKind::InvalidData, error.to_string());
    let told = exr::meta::MetaData::read_from_buffered(&mut reader, false)
        .map_err(invalid)?
        .headers
        .iter()
        .map(|layer| (layer.layer_size.area() as u64).saturating_mul(layer.channels.bytes_per_pixel as u64))
        .fold(0, u64::saturating_add);
    if told > SMALL.saturating_add(BYTES_PER_BYTE.saturating_mul(size)) {
        return Err(io::Error::new(io::ErrorKind::InvalidData, "more pixels than the file can hold"));
    }
    reader.rewind()?;
    Ok(reader)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_lose_their_mark_and_errors_have_a_line() {
        let folder = std::env::temp_dir().join(format!("upbp-input-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join("a.ron");
        fs::write(&path, "\u{feff}(\n)").unwrap();
        assert_eq!(read_text(&path).unwrap(), "(\n)");
        fs::write(&path, b"(\n\xff)").unwrap();
        assert_eq!(read_text(&path).unwrap_err().to_string(), "line 2: expected UTF-8 text");
        assert_eq!(open_file(&path, 3).unwrap_err().to_string(), "has 4 bytes, expected at most 3");
        let error = read_text(&folder).unwrap_err();
        assert_eq!(error.to_string(), "expected a regular file, found a folder");
        assert_eq!(read_text(&folder.join("none")).unwrap_err().kind(), io::ErrorKind::NotFound);
        fs::remove_dir_all(&folder).unwrap();
    }

    /// None of these calls would return if it read.
    #[cfg(unix)]
    #[test]
    fn devices_and_pipes_are_refused_unread() {
        let pipe = std::env::temp_dir().join(format!("upbp-pipe-{}", std::process::id()));
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        for path in [Path::new("/dev/zero"), &pipe] {
            let expected = "expected a regular file, found a device, a pipe or a socket";
            assert_eq!(read_text(path).unwrap_err().to_string(), expected);
            assert_eq!(open_exr(path).unwrap_err().to_string(), expected);
            let state = crate::State::load(path).unwrap_err();
            assert_eq!(std::error::Error::source(&state).unwrap().to_string(), expected);
        }
        fs::remove_file(&pipe).unwrap();
    }
}
