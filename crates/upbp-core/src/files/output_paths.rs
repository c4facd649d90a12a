//! Files to write: told apart whatever they are called, and from those that hold something else.

use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use self::platform::{FileId, file_id, is_block_device, is_character_device};
use super::atomic_write::{check_writable, folder, is_one_name, target};
use crate::error::OutputError;
use crate::plan::FrozenPlan;
use crate::state::MAGIC;

/// Kinds of files. One that is there and holds something else is not overwritten.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// An OpenEXR image.
    Exr,
    /// A PNG image.
    Png,
    /// A report as JSON with indents, its version first.
    Report,
    /// A plan as RON text.
    Plan,
    /// A state.
    State,
    /// Another text, which begins like this.
    Text(&'static str),
}

impl Content {
    /// With its article.
    fn name(self) -> String {
        match self {
            Self::Exr => "an OpenEXR image".to_owned(),
            Self::Png => "a PNG image".to_owned(),
            Self::Report => "a report".to_owned(),
            Self::Plan => "a plan".to_owned(),
            Self::State => "a state".to_owned(),
            Self::Text(beginning) => format!("a text that begins with `{beginning}`"),
        }
    }

    /// First bytes of such a file.
    const fn beginning(self) -> &'static [u8] {
        match self {
            Self::Exr => b"\x76\x2f\x31\x01",
            Self::Png => b"\x89PNG\r\n\x1a\n",
            Self::Report => b"{\n  \"version\":",
            Self::Plan => FrozenPlan::BEGINNING.as_bytes(),
            Self::State => &MAGIC,
            Self::Text(beginning) => beginning.as_bytes(),
        }
    }
}

/// A file that is going to be written.
#[derive(Clone, Copy, Debug)]
pub struct Output<'a> {
    /// Name in messages, such as the option that names the file.
    pub role: &'a str,
    /// Path of the file.
    pub path: &'a Path,
    /// Kind of its content.
    pub content: Content,
}

/// Checks, before hours are spent on their content, that `outputs` can be written, and that this destroys
/// nothing else: that they are different files, none of `inputs`, and that those that are there already hold
/// what will be in them, or nothing. Links are followed, and hard links to a file are the same file. An input
/// is its role and its path; a file that is read and written on purpose is an output only.
///
/// Hard links are not noticed on platforms that have no numbers of files (all but Unix).
///
/// # Errors
/// [`SameFile`](OutputError::SameFile), [`Overwrites`](OutputError::Overwrites), or what the file system
/// says; or a file is read-only, or a folder.
pub fn check_outputs(outputs: &[Output<'_>], inputs: &[(&str, &Path)]) -> Result<(), OutputError> {
    // An input that is not there cannot be destroyed.
    let mut taken: Vec<_> =
        inputs.iter().filter_map(|&(role, path)| Some((role, path, FileIdentity::of(path).ok()?))).collect();
    for &Output { role, path, content } in outputs {
        let fail = |source| OutputError::Write { path: path.to_owned(), source };
        let metadata = fs::metadata(path).ok();
        if metadata.as_ref().is_some_and(is_character_device) {
            // A terminal or a sink: it keeps nothing that could be destroyed.
            continue;
        }
        if metadata.as_ref().is_some_and(is_block_device) {
            return Err(fail(io::Error::new(io::ErrorKind::InvalidInput, "it is a disk")));
        }
        let identity = FileIdentity::of(path).map_err(fail)?;
        for &(other_role, other_path, ref other) in &taken {
            if identity.is(other).map_err(fail)? {
                return Err(OutputError::SameFile {
                    role: role.to_owned(),
                    path: path.to_owned(),
                    other_role: other_role.to_owned(),
                    other_path: other_path.to_owned(),
                });
            }
        }
        taken.push((role, path, identity));
        if metadata.is_some_and(|metadata| metadata.is_file()) && !holds(path, content).map_err(fail)? {
            return Err(OutputError::Overwrites {
                role: role.to_owned(),
                path: path.to_owned(),
                expected: content.name(),
            });
        }
    }
    outputs.iter().try_for_each(|output| check_writable(output.path))
}

/// Whether a file begins as `content` does, or is empty.
fn holds(path: &Path, content: Content) -> io::Result<bool> {
    let beginning = content.beginning();
    let mut found = Vec::new();
    File::open(path)?.take(beginning.len() as u64).read_to_end(&mut found)?;
    Ok(found.is_empty() || found == beginning)
}

/// Identity of a file.
enum FileIdentity {
    /// One that is there.
    There(FileId),
    /// One to come, in a folder that is there.
    New { folder: FileId, path: PathBuf },
}

impl FileIdentity {
    fn of(path: &Path) -> io::Result<Self> {
        match file_id(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                let path = target(path)?;
                Ok(Self::New { folder: file_id(folder(&path))?, path })
            }
            known => known.map(Self::There),
        }
    }

    fn is(&self, other: &Self) -> io::Result<bool> {
        match (self, other) {
            (Self::There(id), Self::There(other)) => Ok(id == other),
            (Self::New { folder, path }, Self::New { folder: other, path: other_path })
                if folder == other =>
            {
                Ok(path.file_name() == other_path.file_name()
                    || are_alike(path, other_path) && is_one_name(path, other_path)?)
            }
            _ => Ok(false),
        }
    }
}

/// Whether there are file systems that take the names for one: those that ignore case or the composition of
/// letters.
fn are_alike(path: &Path, other: &Path) -> bool {
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let (name, other) = (name(path), name(other));
    name == other || !name.is_ascii() || !other.is_ascii()
}

#[cfg(unix)]
mod platform {
    use std::fs::{Metadata, metadata};
    use std::io;
    use std::os::unix::fs::{FileTypeExt as _, MetadataExt as _};
    use std::path::Path;

    /// Device and number of a file.
    pub(super) type FileId = (u64, u64);

    pub(super) fn file_id(path: &Path) -> io::Result<FileId> {
        metadata(path).map(|metadata| (metadata.dev(), metadata.ino()))
    }

    pub(super) fn is_character_device(metadata: &Metadata) -> bool {
        metadata.file_type().is_char_device()
    }

    pub(super) fn is_block_device(metadata: &Metadata) -> bool {
        metadata.file_type().is_block_device()
    }
}

#[cfg(not(unix))]
mod platform {
    use std::fs::{Metadata, canonicalize};
    use std::io;
    use std::path::{Path, PathBuf};

    pub(super) type FileId = PathBuf;

    pub(super) fn file_id(path: &Path) -> io::Result<FileId> {
        canonicalize(path)
    }

    pub(super) fn is_character_device(_: &Metadata) -> bool {
        false
    }

    pub(super) fn is_block_device(_: &Metadata) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("upbp-paths-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(folder.join("sub")).unwrap();
        folder
    }

    /// Whether writing `output` would destroy `input`, or the other output.
    fn clash(output: &Path, input: Option<&Path>, other: Option<&Path>) -> bool {
        let file = |path| Output { role: "output", path, content: Content::Text("") };
        let outputs: Vec<_> = other.into_iter().chain([output]).map(file).collect();
        let inputs: Vec<_> = input.map(|path| ("input", path)).into_iter().collect();
        match check_outputs(&outputs, &inputs) {
            Ok(()) => false,
            Err(OutputError::SameFile { path, .. }) => path == output,
            Err(error) => panic!("{error}"),
        }
    }

    #[test]
    fn one_file_has_many_names() {
        let folder = folder("names");
        let file = folder.join("a.ron");
        fs::write(&file, "(").unwrap();
        let detour = folder.join("sub/../a.ron");
        assert!(clash(&file, Some(&file), None) && clash(&detour, Some(&file), None));
        assert!(!clash(&folder.join("sub/a.ron"), Some(&file), None));
        assert!(!clash(&folder.join("b.ron"), Some(&file), None));
        // Files to come.
        let (new, detour) = (folder.join("new.exr"), folder.join("sub/../new.exr"));
        assert!(clash(&new, None, Some(&detour)) && !clash(&new, None, Some(&folder.join("sub/new.exr"))));
        // What is not there is no input.
        assert!(!clash(&file, Some(&folder.join("none/x")), None));
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn case_counts_where_the_file_system_says_so() {
        let folder = folder("case");
        for (name, other) in
            [("a.exr", "A.EXR"), ("\u{e9}.exr", "e\u{301}.exr"), ("\u{e4}.exr", "\u{c4}.exr")]
        {
            let (path, other) = (folder.join(name), folder.join(other));
            let found = clash(&path, None, Some(&other));
            fs::write(&path, "").unwrap();
            assert_eq!(found, other.exists(), "{name}");
            assert_eq!(clash(&path, None, Some(&other)), found, "{name}: with one of them there");
            fs::remove_file(&path).unwrap();
        }
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "nothing is left");
        fs::remove_dir_all(&folder).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed() {
        use std::os::unix::fs::symlink;
        let folder = folder("links");
        let at = |name: &str| folder.join(name);
        fs::write(at("a.ron"), "(").unwrap();
        fs::hard_link(at("a.ron"), at("hard")).unwrap();
        symlink("a.ron", at("soft")).unwrap();
        symlink("../soft", at("sub/soft")).unwrap();
        for name in ["hard", "soft", "sub/soft"] {
            assert!(clash(&at(name), Some(&at("a.ron")), None), "{name}");
            assert!(clash(&at("a.ron"), Some(&at(name)), None), "{name}");
        }
        // Links to a file and by a folder that is to come.
        symlink("new", at("to_come")).unwrap();
        symlink("sub", at("folder")).unwrap();
        assert!(clash(&at("to_come"), None, Some(&at("new"))));
        assert!(clash(&at("folder/new"), None, Some(&at("sub/new"))));
        assert!(!clash(&at("to_come"), None, Some(&at("sub/new"))));
        // A sink is no file.
        assert!(!clash(Path::new("/dev/null"), Some(Path::new("/dev/null")), Some(Path::new("/dev/null"))));
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn what_is_something_else_is_not_overwritten() {
        let folder = folder("kinds");
        let path = folder.join("file");
        let may = |content| match check_outputs(&[Output { role: "output", path: &path, content }], &[]) {
            Ok(()) => true,
            Err(OutputError::Overwrites { .. }) => false,
            Err(error) => panic!("{error}"),
        };
        let kinds = [Content::Exr, Content::Png, Content::Report, Content::Plan, Content::State];
        for there in kinds {
            fs::write(&path, [there.beginning(), b"rest"].concat()).unwrap();
            assert_eq!(kinds.map(may), kinds.map(|content| content == there), "{there:?}");
            assert!(may(Content::Text("")) && !may(Content::Text("rest")));
        }
        fs::write(&path, "( version: 1 )").unwrap();
        assert_eq!(kinds.map(may), [false; 5]);
        fs::write(&path, b"").unwrap();
        assert_eq!(kinds.map(may), [true; 5]);
        fs::remove_dir_all(&folder).unwrap();
    }
}
