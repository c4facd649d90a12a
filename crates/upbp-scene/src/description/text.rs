//! Scenes as RON text, and their fingerprints.

use ron::Options;
use ron::error::SpannedError;
use ron::extensions::Extensions;
use ron::ser::PrettyConfig;

use super::scene::SceneDescription;
use super::spelling;
use crate::error::SceneError;

/// The options for writing: without `Some` and without the parentheses of single values.
fn options() -> Options {
    Options::default()
        .with_default_extension(Extensions::IMPLICIT_SOME)
        .with_default_extension(Extensions::UNWRAP_NEWTYPES)
}

/// The options for reading: those for writing, and kinds with a single value see the inside of their
/// parentheses (`single`).
fn reading() -> Options {
    options().with_default_extension(Extensions::UNWRAP_VARIANT_NEWTYPES)
}

impl SceneDescription {
    /// Reads a scene file's text.
    ///
    /// # Errors
    ///
    /// [`SceneError::Syntax`] with line and column of the first place that is wrong.
    pub fn from_ron(text: &str) -> Result<Self, SceneError> {
        reading().from_str(text).map_err(|error| syntax_error(text, &error))
    }

    /// The scene as the text of a file.
    ///
    /// # Errors
    ///
    /// [`SceneError::Unwritable`]; no description that came from a file causes it.
    pub fn to_ron(&self) -> Result<String, SceneError> {
        let pretty =
            PrettyConfig::new().new_line("\n").indentor("  ").depth_limit(4).separate_tuple_members(false);
        options().to_string_pretty(self, pretty).map_err(|error| SceneError::Unwritable(error.to_string()))
    }

    /// A fingerprint, equal for equal descriptions on any machine: FNV-1a over the compact text. The contents
    /// of files that the scene refers to do not enter.
    #[must_use]
    pub fn hash(&self) -> u64 {
        let mut hash = Fnv1a::default();
        // The fingerprint of a description that cannot be written is that of the error.
        hash.write(options().to_string(self).unwrap_or_else(|error| error.to_string()).as_bytes());
        hash.0
    }
}

fn syntax_error(text: &str, error: &SpannedError) -> SceneError {
    let start = error.span.start;
    let message = spelling::message(text, error);
    SceneError::Syntax { path: None, line: start.line, column: start.col, message }
}

/// Fowler, Noll and Vo's hash, variant 1a with 64 bits: stable across versions, unlike the standard
/// library's.
pub(crate) struct Fnv1a(pub(crate) u64);

impl Default for Fnv1a {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv1a {
    pub(crate) fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
}
