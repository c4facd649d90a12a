//! The state that all steps of a build share.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use upbp_core::open_file;
use upbp_media::{MediumId, PhaseFunction};

use super::surfaces::MeshFiles;
use crate::description::{Fnv1a, SceneDescription};
use crate::error::Problem;
use crate::light::EnvironmentImage;

/// A description on its way to a scene, with the problems that were found.
pub(super) struct Builder<'a> {
    pub(super) description: &'a SceneDescription,
    pub(super) base_dir: &'a Path,
    pub(super) problems: Vec<Problem>,
    pub(super) notes: Vec<Problem>,
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
        self.problems.push(Problem { item: item.into(), message: message.to_string() });
    }

    /// The name of a shape in messages: its own, or its place from 1.
    pub(super) fn shape_item(&self, index: usize) -> String {
        match self.description.shapes.get(index).and_then(|shape| shape.name.as_deref()) {
            Some(name) => format!("shape `{name}`"),
            None => format!("shape {}", index + 1),
        }
    }

    /// The path of a file that will be read, which is noted.
    pub(super) fn path(&mut self, file: &str) -> PathBuf {
        let path = self.base_dir.join(file);
        self.files.push(path.clone());
        path
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
            self.problem(item, unknown("medium", name, self.description.media.names()));
        }
        id
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

/// The message about a name that is not defined, with those that are, or some of them.
pub(super) fn unknown<'n>(what: &str, name: &str, known: impl Iterator<Item = &'n str>) -> String {
    /// Names in a message: there may be as many messages as shapes.
    const MOST: usize = 20;
    let mut known = known.map(|name| format!("`{name}`"));
    let some: Vec<String> = known.by_ref().take(MOST).collect();
    let others = match known.count() {
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
    use super::unknown;

    #[test]
    fn messages_name_no_more_than_some() {
        let names: Vec<String> = (0..500).map(|i| format!("n{i}")).collect();
        let message = |count| unknown("material", "x", names.iter().take(count).map(String::as_str));
        assert_eq!(message(0), "unknown material `x`; there are none");
        assert_eq!(message(2), "unknown material `x`, known: `n0`, `n1`");
        assert!(message(20).ends_with("`n19`") && message(500).ends_with("`n19` and 480 others"));
    }
}
