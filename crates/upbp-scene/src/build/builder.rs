//! The state that all steps of a build share.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use upbp_core::open_file;
use upbp_media::{MediumId, PhaseFunction};

use super::surfaces::MeshFiles;
use crate::description::{Fnv1a, SceneDescription};
use crate::error::{Problem, Shortened};
use crate::light::EnvironmentImage;

/// A description on its way to a scene, with the problems that were found.
pub(super) struct Builder<'a> {
    pub(super) description: &'a SceneDescription,
    pub(super) base_dir: &'a Path,
    pub(super) problems: Problems,
    pub(super) notes: Problems,
    /// Notes that are not to be made again, by item and message.
    pub(super) noted: BTreeSet<(String, String)>,
    /// Fingerprint of the description and of the files that were read.
    pub(super) hash: Fnv1a,
    /// The files that were read.
    pub(super) files: Vec<PathBuf>,
    pub(super) meshes: MeshFiles,
    /// Images, or why there are none, by file: each is read once.
    pub(super) images: BTreeMap<String, Result<Arc<EnvironmentImage>, String>>,
    /// Phase functions of tables, or why there are none, by file.
    pub(super) tables: BTreeMap<String, Result<PhaseFunction, String>>,
}

impl Builder<'_> {
    /// Notes a problem of a part of the scene.
    pub(super) fn problem(&mut self, item: impl Into<String>, message: impl Display) {
        self.problems.add(item.into(), message);
    }

    /// The name of a shape in messages: its own, or its place from 1.
    pub(super) fn shape_item(&self, index: usize) -> String {
        match self.description.shapes.get(index).and_then(|shape| shape.name.as_deref()) {
            Some(name) => format!("shape `{}`", Shortened(name)),
            None => format!("shape {}", index + 1),
        }
    }

    /// The path of a file that will be read, which is noted.
    pub(super) fn path(&mut self, file: &str) -> PathBuf {
        let path = self.base_dir.join(file);
        self.files.push(path.clone());
        path
    }

    /// The path of a file in messages.
    pub(super) fn shown_path(&self, file: &str) -> String {
        self.base_dir.join(Shortened(file).to_string()).display().to_string()
    }

    /// A file of at most so many bytes, which go into the fingerprint as they are read.
    pub(super) fn open(&mut self, path: &Path, max_bytes: u64) -> io::Result<impl io::BufRead> {
        let bytes = open_file(path, max_bytes)?.take(max_bytes);
        Ok(BufReader::new(Hashed { bytes, hash: &mut self.hash }))
    }

    /// The medium of that name, or a problem of `item`.
    pub(super) fn medium(
        &mut self,
        item: &str,
        name: &str,
        ids: &BTreeMap<&str, MediumId>,
    ) -> Option<MediumId> {
        let id = ids.get(name).copied();
        if id.is_none() {
            let media = &self.description.media;
            self.problem(item, unknown("medium", name, media.len(), media.names()));
        }
        id
    }
}

/// Problems or notes, of which there may be as many as shapes: the first ones, and how many others there are.
#[derive(Default)]
pub(super) struct Problems {
    first: Vec<Problem>,
    others: usize,
}

impl Problems {
    /// Problems that are told.
    const MOST: usize = 1000;

    pub(super) fn add(&mut self, item: String, message: impl Display) {
        if self.first.len() < Self::MOST {
            self.first.push(Problem { item, message: message.to_string() });
        } else {
            self.others += 1;
        }
    }

    pub(super) const fn is_empty(&self) -> bool {
        self.first.is_empty()
    }

    /// All of them as a list, whose last item tells how many more there are of `what`.
    pub(super) fn list(self, what: &str) -> Vec<Problem> {
        let others =
            Problem { item: "scene".to_owned(), message: format!("has {} more {what}", self.others) };
        self.first.into_iter().chain((self.others > 0).then_some(others)).collect()
    }
}

/// A reader whose bytes go into a fingerprint.
struct Hashed<'h, R> {
    bytes: R,
    hash: &'h mut Fnv1a,
}

impl<R: Read> Read for Hashed<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.bytes.read(buffer)?;
        self.hash.write(&buffer[..count]);
        Ok(count)
    }
}

/// The message about a name that is not defined, with the first of the `count` names that are. It looks at no
/// more than it names: there may be as many unknown names as known ones.
pub(super) fn unknown<'n>(
    what: &str,
    name: &str,
    count: usize,
    known: impl Iterator<Item = &'n str>,
) -> String {
    /// Names in a message.
    const MOST: usize = 20;
    let name = Shortened(name);
    let some: Vec<_> = known.take(MOST).map(|name| format!("`{}`", Shortened(name))).collect();
    let others = match count - some.len() {
        0 => String::new(),
        count => format!(" and {count} others"),
    };
    if some.is_empty() {
        format!("unknown {what} `{name}`; there are none")
    } else {
        format!("unknown {what} `{name}`, known: {}{others}", some.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::{Problems, unknown};

    #[test]
    fn messages_name_no_more_than_some() {
        let names: Vec<String> = (0..500).map(|i| format!("n{i}")).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let message = |count| unknown("material", "x", count, names.iter().copied().take(count));
        assert_eq!(message(0), "unknown material `x`; there are none");
        assert_eq!(message(2), "unknown material `x`, known: `n0`, `n1`");
        assert!(message(20).ends_with("`n19`") && message(500).ends_with("`n19` and 480 others"));
    }

    #[test]
    fn neither_long_names_nor_many_problems_make_long_messages() {
        let long = "ß".repeat(100_000);
        let message = unknown("material", &long, 30, [long.as_str(); 30].into_iter());
        assert!(message.len() < 10_000 && message.contains("ß…`, known: `ß"), "{}", message.len());
        let mut problems = Problems::default();
        (0..1002).for_each(|i| problems.add(format!("shape {i}"), "is wrong"));
        let list = problems.list("problems");
        assert_eq!(list.len(), 1001);
        assert_eq!(list[1000].to_string(), "scene: has 2 more problems");
    }

    #[test]
    fn names_in_messages_do_not_move_the_cursor() {
        let message = unknown("material", "red\u{1b}[2J", 1, ["white\nlights"].into_iter());
        assert_eq!(message, "unknown material `red\\u{1b}[2J`, known: `white\\nlights`");
    }
}
