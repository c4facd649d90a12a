//! Errors, with messages for people.

use std::error::Error;
use std::fmt;
use std::path::PathBuf;

use upbp_estimators::{EmitterChoiceError, PrepareError, TechniqueSet};

/// Describes an error with all its causes, each on a line of its own: the messages of this library do not
/// repeat those of their [sources](Error::source).
#[must_use]
pub fn describe(error: &dyn Error) -> String {
    match error.source() {
        Some(cause) => format!("{error}\n  because: {}", describe(cause)),
        None => error.to_string(),
    }
}

/// A setting that makes no sense.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("setting `{name}`: expected {expected}, found {found}")]
pub struct SettingsError {
    /// Name of the setting.
    pub name: &'static str,
    /// The values that are allowed.
    pub expected: &'static str,
    /// The value that was given.
    pub found: String,
}

/// Text of settings or of a plan that is not understood.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{line}:{column}: {message}")]
pub struct TextError {
    /// Line of the first place that is wrong, from 1.
    pub line: usize,
    /// Column of that place, from 1.
    pub column: usize,
    /// Description of the mistake, or of what was expected.
    pub message: String,
}

impl From<ron::error::SpannedError> for TextError {
    fn from(error: ron::error::SpannedError) -> Self {
        use ron::error::Error;
        let message = match &error.code {
            // Those of the parser speak of its own language.
            Error::InvalidIdentifier(_) | Error::SuggestRawIdentifier(_) | Error::ExpectedIdentifier => {
                "expected a word, as `Auto` is one; numbers go with words, as in `Count(1000)` or `Absolute(0.01)`"
                    .to_owned()
            }
            Error::ExpectedInteger | Error::InvalidIntegerDigit { .. } => {
                "expected a whole number".to_owned()
            }
            Error::IntegerOutOfBounds => "the whole number is too large or negative".to_owned(),
            code => code.to_string(),
        };
        Self { line: error.span.start.line, column: error.span.start.col, message }
    }
}

/// A render that does not start.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// A plan whose light sub-paths leave more than there is room for.
    #[error("plan: needs {needed} MiB, {limit}")]
    PlanMemory {
        /// MiB that an iteration needs.
        needed: u64,
        /// MiB that are allowed.
        limit: MemoryLimit,
    },
    /// A plan whose choice of emitters does not go with the scene.
    #[error("plan: {0}")]
    PlanEmitters(EmitterChoiceError),
    /// A value of a plan is out of its range.
    #[error("plan: {0}")]
    PlanValue(String),
    /// A plan that does not go with the scene or the settings.
    #[error("plan: {extra} cannot be used here, expected techniques of {techniques}")]
    Plan {
        /// The techniques that are ruled out.
        extra: TechniqueSet,
        /// The techniques that are not ruled out.
        techniques: TechniqueSet,
    },
    /// A reference image of another size than what is rendered, without all of its pixels, or with one that
    /// is not finite.
    #[error("expected a reference of {} x {} pixels, found {found}", expected[0], expected[1])]
    Reference {
        /// Width and height of what is rendered.
        expected: [u32; 2],
        /// The size of the reference, the number of its pixels, or the place of one that is not finite.
        found: String,
    },
    /// The render was cancelled before there was anything to show.
    #[error("cancelled before the first iteration")]
    Cancelled,
    /// Techniques of which none can make any light in the scene.
    #[error("techniques `{chosen}`: none of them can make any light in this scene ({reasons}); expected {}", expected_light(*possible))]
    NoLight {
        /// The techniques that were chosen.
        chosen: TechniqueSet,
        /// The techniques that can; none if nothing can be seen in the scene at all.
        possible: TechniqueSet,
        /// The reasons for which the chosen ones cannot.
        reasons: String,
    },
    /// A setting or a stop rule that makes no sense.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// A scene that cannot be rendered.
    #[error(transparent)]
    Scene(#[from] PrepareError),
    /// The film, with what writing it takes, does not fit.
    #[error(
        "film of {width} x {height} pixels: needs {needed} MiB, {limit}; a smaller film or fewer techniques take less"
    )]
    Memory {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// MiB that the film takes.
        needed: u64,
        /// MiB that are allowed.
        limit: MemoryLimit,
    },
}

/// MiB that a render may take, by what they come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MemoryLimit {
    /// The setting `memory`.
    Setting(u64),
    /// Half of what is free.
    HalfOfFree(u64),
    /// All that is free, for a plan that is given.
    Free(u64),
    /// A number for all systems that do not tell what is free.
    Unknown(u64),
}

impl fmt::Display for MemoryLimit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (mebibytes, reason) = match self {
            Self::Setting(mebibytes) => (mebibytes, "are allowed by the setting"),
            Self::HalfOfFree(mebibytes) => (mebibytes, "are taken, half of what is free"),
            Self::Free(mebibytes) => (mebibytes, "are free"),
            Self::Unknown(mebibytes) => {
                (mebibytes, "are taken, since this system does not tell what is free")
            }
        };
        write!(f, "{mebibytes} MiB {reason}; `memory` in the settings allows more")
    }
}

fn expected_light(possible: TechniqueSet) -> String {
    if possible.is_empty() {
        "a scene with a light that can be hit, or with a light and a surface or a medium that scatters it in many directions".to_owned()
    } else {
        format!("some of `{possible}`")
    }
}

/// A state that cannot be read, resumed or merged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StateError {
    /// The source cannot be read.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// The source holds something else, or nothing.
    #[error("not a state of a render: it does not begin as one")]
    NotAState,
    /// A state of another version of the format.
    #[error("format of version {found}: expected {expected}")]
    Version {
        /// The version that is known.
        expected: u32,
        /// The version found.
        found: u32,
    },
    /// Cut off, or changed since it was written.
    #[error("damaged at its {place}: {reason}")]
    Damaged {
        /// The part of the file.
        place: String,
        /// Description of the damage.
        reason: String,
    },
    /// Two states, or a state and a render, are not of the same scene and settings.
    #[error("of another render: {}", list(differences))]
    Different {
        /// Names of all differences, with both values.
        differences: Vec<String>,
    },
    /// Iterations would count twice.
    #[error("iterations {start}..{end} are in both")]
    Overlap {
        /// The first common iteration.
        start: u64,
        /// The first one that is not common any more.
        end: u64,
    },
}

/// The first few, since one cause has many effects.
fn list(differences: &[String]) -> String {
    /// Differences that are shown.
    const SHOWN: usize = 4;
    let text = differences.iter().take(SHOWN).map(String::as_str).collect::<Vec<_>>().join("; ");
    match differences.len().saturating_sub(SHOWN) {
        0 => text,
        more => format!("{text}; and {more} differences more"),
    }
}

/// A file that cannot be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// A state cannot be used.
    #[error("cannot use the state {}", path.display())]
    State {
        /// The file.
        path: PathBuf,
        /// Problem that was found.
        source: StateError,
    },
    /// The file system refuses.
    #[error("cannot write {}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Error of the file system.
        source: std::io::Error,
    },
    /// The image cannot be encoded.
    #[error("cannot encode {}: {reason}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// Problem that was found.
        reason: String,
    },
    /// The image cannot be read.
    #[error("cannot read {} as an OpenEXR image: {reason}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Problem that was found.
        reason: String,
    },
    /// Writing a file would destroy another one that is read or written.
    #[error("{role}, {}, and {other_role}, {}, are the same file", path.display(), other_path.display())]
    SameFile {
        /// Name of the output that would be written.
        role: String,
        /// Path of the file.
        path: PathBuf,
        /// Name of the other file.
        other_role: String,
        /// Path of the same file in that role.
        other_path: PathBuf,
    },
    /// Something else would be overwritten.
    #[error("{role}: {} is there and is not {expected}; remove it, or choose another name", path.display())]
    Overwrites {
        /// Name of the output that would be written.
        role: String,
        /// The file.
        path: PathBuf,
        /// Kind of files that may be overwritten.
        expected: String,
    },
}
