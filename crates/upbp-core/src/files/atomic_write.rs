//! Files that are there as a whole or not at all.

use std::fs::{self, File, OpenOptions};
use std::hash::{BuildHasher, RandomState};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::error::OutputError;

/// End of the names of unfinished files.
const UNFINISHED: &str = ".part";

/// The age at which an unfinished file is no longer being written.
const LEFTOVER: Duration = Duration::from_secs(3600);

/// Checks that a file can be written: that it is not read-only, and no folder.
pub(super) fn check_writable(path: &Path) -> Result<(), OutputError> {
    let check = || {
        if path.is_dir() {
            return Err(io::ErrorKind::IsADirectory.into());
        }
        if is_special(path) {
            // Opening a pipe would wait for its reader.
            return Ok(());
        }
        let target = target(path)?;
        check_not_protected(&target)?;
        Unfinished::beside(&target).map(drop)
    };
    check().map_err(|source| OutputError::Write { path: path.to_owned(), source })
}

/// Writes a file beside its place, forces it to the disk and moves it there: whoever looks, whenever the
/// process or the machine stops, finds the old file or the new one, which has the permissions of the old. A
/// read-only file stays. What is no regular file, such as a pipe, is written to directly, and so is, once the
/// content is complete, a file that can be written and not replaced: one that is a mount point, or another
/// user's in a folder like `/tmp`.
pub(crate) fn write_whole(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<File>) -> Result<(), OutputError>,
) -> Result<(), OutputError> {
    let fail = |source| OutputError::Write { path: path.to_owned(), source };
    if is_special(path) {
        let mut writer = BufWriter::new(OpenOptions::new().write(true).open(path).map_err(fail)?);
        content(&mut writer)?;
        return writer.flush().map_err(fail);
    }
    let target = target(path).map_err(fail)?;
    check_not_protected(&target).map_err(fail)?;
    let (unfinished, file) = Unfinished::beside(&target).map_err(fail)?;
    if let Ok(old) = fs::metadata(&target) {
        // Best effort: not all file systems have any.
        let _ = file.set_permissions(old.permissions());
    }
    let mut writer = BufWriter::new(file);
    content(&mut writer)?;
    let file = writer.into_inner().map_err(|error| fail(error.into_error()))?;
    file.sync_all().map_err(fail)?;
    unfinished.move_to(&target).map_err(fail)?;
    sync_folder(&target).map_err(fail)
}

/// Writes a text as a whole or not at all.
///
/// # Errors
/// The file system's own.
pub fn write_text(path: &Path, text: &str) -> Result<(), OutputError> {
    write_whole(path, |writer| {
        let fail = |source| OutputError::Write { path: path.to_owned(), source };
        writer.write_all(text.as_bytes()).map_err(fail)
    })
}

/// Removes the files that this process has not finished, for one that is about to end. No file is written
/// after that: who tries waits for the end of the process.
pub fn abandon_files() {
    let unfinished = unfinished_files();
    for path in unfinished.iter() {
        // Best effort: there is nobody left to tell.
        let _ = fs::remove_file(path);
    }
    std::mem::forget(unfinished);
}

/// Removes what processes that were killed while they wrote `path` have left beside it, once it is an hour
/// old. Failures do not matter: there is nothing to remove then, or nothing to be done.
pub fn remove_leftovers(path: &Path) {
    let Ok(target) = target(path) else { return };
    let (Some(name), Ok(entries)) = (target.file_name(), fs::read_dir(folder(&target))) else { return };
    let prefix = format!("{}.", name.to_string_lossy());
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let unfinished =
            name.strip_prefix(&prefix).and_then(|rest| rest.strip_suffix(UNFINISHED)).is_some_and(is_mark);
        let age = entry.metadata().and_then(|metadata| metadata.modified()).map(|at| at.elapsed());
        if unfinished && matches!(age, Ok(Ok(age)) if age > LEFTOVER) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Whether there is something that is neither a file nor a folder.
fn is_special(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|metadata| !metadata.is_file() && !metadata.is_dir())
}

/// Refuses a file that is not to be changed. A new one in its place is a change, too, for which the file
/// system asks the folder only.
fn check_not_protected(target: &Path) -> io::Result<()> {
    let metadata = match fs::metadata(target) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        known => known?,
    };
    // Who may do everything may open it all the same.
    if metadata.permissions().readonly() {
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, "the file is read-only"));
    }
    OpenOptions::new().write(true).open(target).map(drop)
}

/// The file itself, where `path` is a link to it, also if it is not there yet.
pub(super) fn target(path: &Path) -> io::Result<PathBuf> {
    let known = fs::canonicalize(path);
    if !known.as_ref().is_err_and(|error| error.kind() == io::ErrorKind::NotFound) {
        return known;
    }
    if let Ok(link) = fs::read_link(path) {
        return target(&folder(path).join(link));
    }
    let name = path.file_name().ok_or(io::ErrorKind::InvalidInput)?;
    Ok(fs::canonicalize(folder(path))?.join(name))
}

pub(super) fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Files that are being written.
static UNFINISHED_FILES: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn unfinished_files() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED_FILES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A new file in the folder of another, so that moving is a rename. Removed if it is not moved.
struct Unfinished(PathBuf);

impl Unfinished {
    /// Creates a file under a name that no other process chooses, on this machine or on another that shares
    /// the folder.
    fn beside(path: &Path) -> io::Result<(Self, File)> {
        let temporary = beside(path, mark())?;
        let mut files = unfinished_files();
        let file = OpenOptions::new().write(true).create_new(true).open(&temporary)?;
        files.push(temporary.clone());
        Ok((Self(temporary), file))
    }

    fn move_to(self, target: &Path) -> io::Result<()> {
        use io::ErrorKind::{PermissionDenied, ResourceBusy};
        // Not while all are abandoned.
        let mut files = unfinished_files();
        match fs::rename(&self.0, target) {
            Err(error) if matches!(error.kind(), ResourceBusy | PermissionDenied) && target.is_file() => {
                write_in_place(&self.0, target).map_err(|error| {
                    // The old content may be gone: the new one stays where it is.
                    files.retain(|path| *path != self.0);
                    let message = format!("{error}; all of it is in `{}`", self.0.display());
                    std::mem::forget(self);
                    io::Error::new(error.kind(), message)
                })
            }
            moved => moved,
        }
    }
}

/// Gives a file the content of another one, and keeps what it is.
fn write_in_place(from: &Path, target: &Path) -> io::Result<()> {
    let mut new = File::open(from)?;
    let mut old = OpenOptions::new().write(true).truncate(true).open(target)?;
    io::copy(&mut new, &mut old)?;
    old.sync_all()
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        let mut files = unfinished_files();
        files.retain(|path| *path != self.0);
        // Best effort: the first error is the one to report. After the move there is nothing to remove.
        let _ = fs::remove_file(&self.0);
    }
}

/// Whether the file system takes two names in one folder for the same, as where case does not count: it is
/// asked.
pub(super) fn is_one_name(path: &Path, other: &Path) -> io::Result<bool> {
    let mark = mark();
    let (temporary, other) = (beside(path, mark)?, beside(other, mark)?);
    OpenOptions::new().write(true).create_new(true).open(&temporary)?;
    let same = other.exists();
    fs::remove_file(temporary)?;
    Ok(same)
}

/// A number that no other process chooses.
fn mark() -> u64 {
    RandomState::new().hash_one(std::process::id())
}

/// The name of an unfinished file.
fn beside(path: &Path, mark: u64) -> io::Result<PathBuf> {
    let mut name = path.file_name().ok_or(io::ErrorKind::InvalidInput)?.to_owned();
    name.push(format!(".{mark:016x}{UNFINISHED}"));
    Ok(path.with_file_name(name))
}

/// Whether a part of a name is one of [`mark`].
fn is_mark(text: &str) -> bool {
    text.len() == 16 && text.bytes().all(|byte| byte.is_ascii_hexdigit())
}

/// Forces a rename to the disk, where folders can be opened and forced: the file is in its place in any case.
fn sync_folder(path: &Path) -> io::Result<()> {
    use io::ErrorKind::{InvalidInput, PermissionDenied, Unsupported};
    if !cfg!(unix) {
        return Ok(());
    }
    match File::open(folder(path)).and_then(|folder| folder.sync_all()) {
        Err(error) if matches!(error.kind(), PermissionDenied | InvalidInput | Unsupported) => Ok(()),
        done => done,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_failure_leaves_the_old_file_and_nothing_else() {
        let folder = std::env::temp_dir().join(format!("upbp-whole-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join("a.txt");
        write_text(&path, "old").unwrap();
        let reason = || OutputError::Encode { path: path.clone(), reason: "no".into() };
        write_whole(&path, |writer| {
            writer.write_all(b"new").unwrap();
            Err(reason())
        })
        .unwrap_err();
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(files(&folder), ["a.txt"]);
        check_writable(&path).unwrap();
        check_writable(&folder).unwrap_err();
        check_writable(&folder.join("none/a.txt")).unwrap_err();
        assert_eq!(files(&folder), ["a.txt"]);

        // Of others' files and of young ones nothing is removed.
        let (young, _) = Unfinished::beside(&path).unwrap();
        let (old, file) = Unfinished::beside(&path).unwrap();
        file.set_modified(std::time::SystemTime::now() - 2 * LEFTOVER).unwrap();
        let other = folder.join("a.txt.mine.part");
        File::create(&other).unwrap().set_modified(std::time::UNIX_EPOCH).unwrap();
        remove_leftovers(&path);
        assert!(young.0.exists() && other.exists() && path.exists() && !old.0.exists());
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_read_only_file_stays() {
        let folder = std::env::temp_dir().join(format!("upbp-protected-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join("a.txt");
        write_text(&path, "old").unwrap();
        let writable = fs::metadata(&path).unwrap().permissions();
        let mut protected = writable.clone();
        protected.set_readonly(true);
        fs::set_permissions(&path, protected).unwrap();
        for error in [check_writable(&path).unwrap_err(), write_text(&path, "new").unwrap_err()] {
            let OutputError::Write { source, .. } = error else { panic!("{error}") };
            assert!(source.to_string().contains("read-only"), "{source}");
        }
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(files(&folder), ["a.txt"]);
        fs::set_permissions(&path, writable).unwrap();
        fs::remove_dir_all(&folder).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn permissions_are_passed_on() {
        use std::os::unix::fs::PermissionsExt;
        let folder = std::env::temp_dir().join(format!("upbp-permissions-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join("a.txt");
        write_text(&path, "old").unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
        write_text(&path, "new").unwrap();
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        // What cannot be replaced gets the content, and is the same file as before.
        let other = folder.join("b.txt");
        fs::write(&other, "a longer text").unwrap();
        write_in_place(&path, &other).unwrap();
        assert_eq!(fs::read_to_string(&other).unwrap(), "new");
        fs::remove_dir_all(&folder).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn links_and_devices_stay_what_they_are() {
        let folder = std::env::temp_dir().join(format!("upbp-link-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let (file, link) = (folder.join("file"), folder.join("link"));
        write_text(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_text(&link, "new").unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read_to_string(&file).unwrap(), "new");
        write_text(Path::new("/dev/null"), "text").unwrap();
        assert!(is_special(Path::new("/dev/null")));
        // A link to a file to come makes that file.
        let (new, link) = (folder.join("new"), folder.join("to_come"));
        std::os::unix::fs::symlink("new", &link).unwrap();
        write_text(&link, "new").unwrap();
        assert!(link.is_symlink() && new.is_file());
        fs::remove_dir_all(&folder).unwrap();
    }
}
