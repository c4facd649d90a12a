//! Phase functions from text files: rows of an angle in degrees and a value, or one value per channel.
//!
//! Numbers are parted by spaces, tabs or commas; what follows a `#` is a comment.

use std::io::BufRead;

use upbp_media::{MediaError, PhaseFunction, Spectrum};

/// The largest file that is read, in bytes.
pub(crate) const MAX_FILE: u64 = 1 << 24;

/// Reads a table.
///
/// # Errors
///
/// The first line that is no row, or whose row cannot follow the one before.
pub fn read(mut file: impl BufRead) -> Result<PhaseFunction, String> {
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(|error| error.to_string())?;
    // Comments in other encodings do not matter.
    let text = String::from_utf8_lossy(&bytes);
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let (mut rows, mut lines) = (Vec::new(), Vec::new());
    for (index, line) in text.lines().enumerate() {
        let data = line.split('#').next().unwrap_or("");
        let words = data.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty());
        let numbers = words.map(str::parse).collect::<Result<Vec<f32>, _>>();
        rows.push(match numbers.as_deref() {
            Ok([]) => continue,
            Ok(&[degrees, value]) => (degrees, Spectrum::splat(value)),
            Ok(&[degrees, r, g, b]) => (degrees, Spectrum::new(r, g, b)),
            _ => {
                let found: String = data.trim().chars().take(40).flat_map(char::escape_debug).collect();
                let expected = "expected an angle in degrees and one value or three";
                return Err(format!("line {}: {expected}, found `{found}`", index + 1));
            }
        });
        lines.push(index + 1);
    }
    PhaseFunction::tabulated(&rows).map_err(|error| match error {
        MediaError::EntryOutOfRange { what, index, value, expected } => {
            format!("line {}: {what} is {value}, expected {expected}", lines[index])
        }
        other => other.to_string(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<PhaseFunction, String> {
        super::read(text.as_bytes())
    }

    #[test]
    fn rows_may_have_commas_comments_and_colours() {
        let plain = read("0 2\n90 1\n180 2\n").unwrap();
        assert_eq!(read("\u{feff}# angle, value\r\n0, 2\r\n\r\n 90,1 # side\n180\t2"), Ok(plain.clone()));
        assert_eq!(read("0 2 2 2\n90 1 1 1\n180 2 2 2"), Ok(plain));
        assert!(matches!(read("0 2 2 1\n180 1 1 1"), Ok(PhaseFunction::PerChannel(_))));
    }

    #[test]
    fn wrong_lines_are_named() {
        for (text, expected) in [
            ("", "the table of a phase function is empty, expected at least the angles 0 and 180 degrees"),
            ("0 1\nx 1", "line 2: expected an angle in degrees and one value or three, found `x 1`"),
            ("0 1 2", "line 1: expected an angle in degrees and one value or three, found `0 1 2`"),
            ("#\n0 1\n\n90 -1\n180 1", "line 4: value is -1, expected a finite number of at least zero"),
            ("0 1\n90 1\n", "line 2: angle is 90, expected 180 degrees, where tables end"),
            ("0 NaN\n180 1", "line 1: value is NaN, expected a finite number of at least zero"),
            ("0 0\n180 0", "the integral of the table is 0, expected a number above zero"),
        ] {
            assert_eq!(read(text).unwrap_err(), expected);
        }
    }
}
