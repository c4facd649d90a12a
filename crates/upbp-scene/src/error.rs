//! Errors of scenes.

use std::fmt::{self, Write as _};
use std::path::{Path, PathBuf};

/// The reason for which a scene cannot be rendered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The file cannot be read.
    #[error("{}: cannot be read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: std::io::Error,
    },
    /// The text is not a scene: the first place that is wrong.
    #[error("{}{line}:{column}: {message}", prefix(path.as_deref()))]
    Syntax {
        /// The file, if the text came from one.
        path: Option<PathBuf>,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// The expected and the found text.
        message: String,
    },
    /// The text is read, but describes no scene.
    #[error("{}", Listing { path: path.as_deref(), problems })]
    Invalid {
        /// The file, if the description came from one.
        path: Option<PathBuf>,
        /// At least one; beyond a thousand the last one says how many more there are.
        problems: Vec<Problem>,
    },
    /// A description cannot be written as text.
    #[error("the scene cannot be written: {0}")]
    Unwritable(String),
}

impl SceneError {
    /// Adds the file to an error about text.
    pub(crate) fn in_file(mut self, file: &Path) -> Self {
        if let Self::Syntax { path, .. } | Self::Invalid { path, .. } = &mut self {
            path.get_or_insert_with(|| file.to_owned());
        }
        self
    }
}

/// An error of a description, or a [note](crate::ReadyScene::notes) about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// The part of the scene: ``shape `floor` ``, `light 2 (Spot)`.
    pub item: String,
    /// The error, the expected and the found value; or the note.
    pub message: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.item, self.message)
    }
}

/// A name of a scene in a message: cut if it is long, with its control characters escaped, which a terminal
/// would obey.
pub(crate) struct Shortened<'n>(pub(crate) &'n str);

impl fmt::Display for Shortened<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const MOST: usize = 200;
        let mut letters = self.0.chars();
        for letter in letters.by_ref().take(MOST) {
            if letter.is_control() {
                write!(f, "{}", letter.escape_debug())?;
            } else {
                f.write_char(letter)?;
            }
        }
        if letters.next().is_some() { f.write_char('…') } else { Ok(()) }
    }
}

fn prefix(path: Option<&Path>) -> String {
    path.map_or_else(String::new, |path| format!("{}:", path.display()))
}

struct Listing<'a> {
    path: Option<&'a Path>,
    problems: &'a [Problem],
}

impl fmt::Display for Listing<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = self.problems.len();
        let what = if count == 1 { "problem" } else { "problems" };
        match self.path {
            Some(path) => write!(f, "{}: {count} {what}", path.display())?,
            None => write!(f, "{count} {what} in the scene")?,
        }
        self.problems.iter().try_for_each(|problem| write!(f, "\n  {problem}"))
    }
}
