//! Triangle meshes from Wavefront OBJ files.
//!
//! Read are vertices (`v`), normals (`vn`) and faces (`f`), with the names of objects (`o`), groups (`g`) and
//! materials (`usemtl`) that they belong to; polygons become triangles. Statements that leave the polygons as
//! they are, such as texture coordinates, lines and libraries of materials, are skipped; anything else, such
//! as a free-form surface, is an error.

use std::collections::BTreeMap;
use std::io::{BufRead, Read as _};
use std::ops::Range;

use glam::Vec3;

use crate::error::Shortened;

mod polygon;
mod smooth;
#[cfg(test)]
mod tests;

/// Corners, triangles and normals of a mesh.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct ObjMesh {
    /// Positions of the corners.
    pub positions: Vec<Vec3>,
    /// Triangles as indices of corners.
    pub indices: Vec<[u32; 3]>,
    /// One per corner, if any has one: the others have that of the plane of their triangle.
    pub normals: Option<Vec<Vec3>>,
}

/// An OBJ file: one mesh, or several by the names of their objects, groups or materials.
#[derive(Clone, Debug, Default)]
pub struct ObjFile {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    triangles: Vec<[Corner; 3]>,
    /// The number of each name: after reading, of those that have triangles.
    names: BTreeMap<String, u32>,
    /// Triangles that have a name, by its number and by the statement that gives it.
    ranges: Vec<[Vec<Range<u32>>; 3]>,
    /// The names that the next triangles have, by the statement.
    current: [Names; 3],
    /// Whether some faces are in a smoothing group (`s`).
    has_smoothing_groups: bool,
    budget: polygon::Budget,
}

/// The names that the last statement of a kind gives.
#[derive(Clone, Debug, Default)]
struct Names {
    /// The first triangle that has them.
    first: u32,
    /// By number.
    names: Vec<u32>,
}

/// The statements that give triangles a name, and what they name.
const STATEMENTS: [(&str, &str); 3] = [("o", "an object"), ("g", "a group"), ("usemtl", "a material")];

/// The place of groups among [`STATEMENTS`].
const GROUP: usize = 1;
/// The place of materials among [`STATEMENTS`].
const MATERIAL: usize = 2;

/// The reason for which a name does not tell triangles of an OBJ file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PartError {
    /// No triangles have it.
    #[error("no triangles have this name")]
    Unknown,
    /// It is that of things of several kinds, with different triangles.
    #[error("{0}")]
    SeveralKinds(String),
}

/// The first error of an OBJ file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {message}")]
pub struct ObjError {
    /// Line, from 1.
    pub line: usize,
    /// The expected and the found text.
    pub message: String,
}

/// A corner of a face: indices of its position and its normal.
type Corner = (u32, u32);

/// The index of the normal that a corner does not have.
const NONE: u32 = u32::MAX;

/// The longest line, in bytes.
const MAX_LINE: u64 = 1 << 20;

/// The most triangles of a mesh: a corner of a polygon takes two bytes of a file and twenty-four of memory.
const MAX_TRIANGLES: usize = if cfg!(test) { 1 << 12 } else { 1 << 25 };

/// The most names of objects, groups and materials.
const MAX_NAMES: usize = if cfg!(test) { 1 << 8 } else { 1 << 20 };

/// Statements that do not change the surface, which are skipped.
const SKIPPED: [&str; 16] = [
    "vt",
    "vp",
    "mg",
    "mtllib",
    "usemap",
    "maplib",
    "l",
    "p",
    "lod",
    "bevel",
    "c_interp",
    "d_interp",
    "shadow_obj",
    "trace_obj",
    "ctech",
    "stech",
];

impl ObjFile {
    /// Reads the text of an OBJ file.
    pub fn parse(text: &str) -> Result<Self, ObjError> {
        Self::read(text.as_bytes())
    }

    /// Reads an OBJ file by statements of at most 1 MiB each. Those with numbers go on in the next line after
    /// a backslash. A byte order mark at the start of the file is left out.
    ///
    /// # Errors
    ///
    /// The first line that cannot be read or is no statement, or the last one of a file without faces.
    pub fn read(mut file: impl BufRead) -> Result<Self, ObjError> {
        let mut parsed = Self::default();
        let mut bytes = Vec::new();
        // Numbers of the first line of a statement, and of the last line that was read.
        let (mut first, mut line) = (1, 0);
        let (mut has_numbers, mut has_comment) = (false, false);
        let fail = |line, message| ObjError { line, message };
        loop {
            let known = bytes.len();
            let room = MAX_LINE + 1 - known as u64;
            let count = (&mut file).take(room).read_until(b'\n', &mut bytes);
            let is_end = count.map_err(|error| fail(line + 1, error.to_string()))? == 0;
            if is_end && bytes.is_empty() {
                break;
            }
            line += usize::from(!is_end);
            if bytes.len() as u64 > MAX_LINE {
                return Err(fail(first, format!("is longer than {MAX_LINE} bytes")));
            }
            // Statements with numbers go on after a backslash. Names and comments may end in one, as the path
            // of a folder, or as a letter of another encoding.
            has_comment |= bytes[known..].contains(&b'#');
            let text = bytes.trim_ascii_end();
            if known == 0 {
                has_numbers = matches!(text.trim_ascii_start().first(), Some(b'v' | b'f' | b'l' | b'p'));
            }
            if !is_end && text.last() == Some(&b'\\') && has_numbers && !has_comment {
                let end = text.len() - 1;
                bytes.truncate(end);
                bytes.push(b' ');
                continue;
            }
            has_comment = false;
            // Comments in other encodings do not matter.
            let text = String::from_utf8_lossy(&bytes);
            let marked = if first == 1 { text.strip_prefix('\u{feff}') } else { None };
            parsed.line(marked.unwrap_or(&text)).map_err(|message| fail(first, message))?;
            bytes.clear();
            first = line + 1;
        }
        if parsed.triangles.is_empty() {
            return Err(ObjError { line: line.max(1), message: "the file ends without a face (`f`)".into() });
        }
        (0..STATEMENTS.len()).for_each(|statement| parsed.end(statement));
        let Self { names, ranges, .. } = &mut parsed;
        names.retain(|_, number| ranges[*number as usize].iter().any(|ranges| !ranges.is_empty()));
        Ok(parsed)
    }

    /// Names of objects, groups and materials that have triangles.
    pub fn parts(&self) -> impl ExactSizeIterator<Item = &str> {
        self.names.keys().map(String::as_str)
    }

    /// The number of materials that have triangles.
    #[must_use]
    pub(crate) fn material_count(&self) -> usize {
        self.ranges.iter().filter(|ranges| !ranges[MATERIAL].is_empty()).count()
    }

    /// Whether faces are meant to look smooth, in smoothing groups, and the file has no normals for it.
    #[must_use]
    pub(crate) fn lacks_normals(&self) -> bool {
        self.has_smoothing_groups && self.normals.is_empty()
    }

    /// The mesh of all triangles.
    #[must_use]
    pub fn mesh(&self) -> ObjMesh {
        self.mesh_of(self.triangles.iter())
    }

    /// The mesh of the triangles whose object, material or one of whose groups has this name. A statement as
    /// in the file, such as `usemtl glass`, tells a material from an object of the same name.
    ///
    /// # Errors
    ///
    /// If no triangles have this name; or if an object, a group or a material have it, and not the same
    /// triangles.
    pub fn part(&self, name: &str) -> Result<ObjMesh, PartError> {
        let of = |statement: usize, name: &str| match self.names.get(name) {
            Some(number) => &self.ranges[*number as usize][statement][..],
            None => &[],
        };
        let found = STATEMENTS.iter().enumerate().map(|(place, statement)| (statement, of(place, name)));
        let found: Vec<_> = found.filter(|(_, ranges)| !ranges.is_empty()).collect();
        if let [(_, first), others @ ..] = &found[..]
            && others.iter().any(|(_, ranges)| ranges != first)
        {
            let shown = Shortened(name);
            let whats: Vec<&str> = found.iter().map(|((_, what), _)| *what).collect();
            let lines: Vec<String> =
                found.iter().map(|((statement, _), _)| format!("`part: \"{statement} {shown}\"`")).collect();
            return Err(PartError::SeveralKinds(format!(
                "`{shown}` is the name of {} with different triangles: {}, the line as in the file, tells which",
                whats.join(" and "),
                lines.join(" or ")
            )));
        }
        let statement = || {
            let (statement, name) = name.split_once(char::is_whitespace)?;
            let place = STATEMENTS.iter().position(|(known, _)| *known == statement)?;
            Some(of(place, name.trim()))
        };
        let ranges = found.first().map(|(_, ranges)| *ranges).or_else(statement).unwrap_or_default();
        if ranges.is_empty() {
            return Err(PartError::Unknown);
        }
        let triangles = |range: &Range<u32>| &self.triangles[range.start as usize..range.end as usize];
        Ok(self.mesh_of(ranges.iter().flat_map(triangles)))
    }

    fn line(&mut self, line: &str) -> Result<(), String> {
        let line = line.trim();
        let mut words = line.split('#').next().unwrap_or("").split_whitespace();
        match words.next() {
            Some("v") => self.positions.push(vector(words)?),
            Some("vn") => self.normals.push(vector(words)?),
            Some("f") => {
                let corners = words.map(|word| self.corner(word)).collect::<Result<Vec<_>, _>>()?;
                if corners.len() < 3 {
                    return Err(format!("a face needs at least 3 corners, found {}", corners.len()));
                }
                if self.triangles.len() + corners.len() - 2 > MAX_TRIANGLES {
                    return Err(format!("the mesh has more than {MAX_TRIANGLES} triangles"));
                }
                if let [a, b, c] = corners[..] {
                    self.triangles.push([a, b, c]);
                    return Ok(());
                }
                let places: Vec<Vec3> =
                    corners.iter().map(|corner| self.positions[corner.0 as usize]).collect();
                let triangles = polygon::triangles(&places, &mut self.budget)?;
                self.triangles.extend(triangles.iter().map(|triangle| triangle.map(|place| corners[place])));
            }
            Some("s") => self.has_smoothing_groups |= words.next().is_some_and(|s| s != "off" && s != "0"),
            Some(word) => {
                if let Some(statement) = STATEMENTS.iter().position(|(known, _)| *known == word) {
                    self.begin(statement, &line[word.len()..])?;
                } else if !SKIPPED.contains(&word) {
                    return Err(format!(
                        "expected a statement about polygons, such as `v` or `f`, found `{}`",
                        beginning(word)
                    ));
                }
            }
            None => {}
        }
        Ok(())
    }

    /// Begins triangles under other names of a kind of [`STATEMENTS`].
    fn begin(&mut self, statement: usize, names: &str) -> Result<(), String> {
        self.end(statement);
        // Within a name no comment begins.
        let names = names.split(" #").next().unwrap_or("").trim();
        let first = self.triangles.len() as u32;
        let names = if statement == GROUP {
            names.split_whitespace().map(|name| self.number(name)).collect::<Result<_, _>>()?
        } else if names.is_empty() {
            Vec::new()
        } else {
            vec![self.number(names)?]
        };
        self.current[statement] = Names { first, names };
        Ok(())
    }

    /// Ends the triangles under the names of a kind. Ranges are as long as they can be, so that those of two
    /// names are equal if their triangles are.
    fn end(&mut self, statement: usize) {
        let Names { first, names } = std::mem::take(&mut self.current[statement]);
        let end = self.triangles.len() as u32;
        for name in names.into_iter().filter(|_| first < end) {
            let ranges = &mut self.ranges[name as usize][statement];
            match ranges.last_mut() {
                Some(last) if last.end >= first => last.end = end,
                _ => ranges.push(first..end),
            }
        }
    }

    fn number(&mut self, name: &str) -> Result<u32, String> {
        if let Some(number) = self.names.get(name) {
            return Ok(*number);
        }
        let number = self.names.len();
        if number == MAX_NAMES {
            return Err(format!("the mesh has more than {MAX_NAMES} names of objects, groups and materials"));
        }
        self.names.insert(name.to_owned(), number as u32);
        self.ranges.push(<[_; 3]>::default());
        Ok(number as u32)
    }

    /// `v`, `v/vt`, `v//vn` or `v/vt/vn`, from 1, negative from the end.
    fn corner(&self, word: &str) -> Result<Corner, String> {
        let mut parts = word.split('/');
        let position = parts.next().unwrap_or("");
        let position = index(position, self.positions.len(), "vertex")?;
        let normal = match parts.nth(1) {
            Some(normal) if !normal.is_empty() => index(normal, self.normals.len(), "normal")?,
            _ => NONE,
        };
        Ok((position, normal))
    }

    fn mesh_of<'a>(&self, triangles: impl Iterator<Item = &'a [Corner; 3]> + Clone) -> ObjMesh {
        let Self { positions, normals, .. } = self;
        let corners = || triangles.clone().flatten();
        let mut mesh = ObjMesh::default();
        if corners().all(|corner| corner.1 == NONE) {
            // In their order, without those that are not used.
            let first = corners().map(|corner| corner.0).min().unwrap_or(0);
            let last = corners().map(|corner| corner.0).max().unwrap_or(0);
            let mut numbers = vec![NONE; (last - first) as usize + 1];
            corners().for_each(|corner| numbers[(corner.0 - first) as usize] = 0);
            for (number, position) in numbers.iter_mut().zip(&positions[first as usize..]) {
                if *number != NONE {
                    *number = mesh.positions.len() as u32;
                    mesh.positions.push(*position);
                }
            }
            let number = |corner: Corner| numbers[(corner.0 - first) as usize];
            mesh.indices = triangles.map(|triangle| triangle.map(number)).collect();
            return mesh;
        }
        // A mesh has one normal per corner: corners that share a position but not a normal are told apart.
        let mut numbers = BTreeMap::new();
        let mut smooth = Vec::new();
        for triangle in triangles {
            let [a, b, c] = triangle.map(|(position, _)| positions[position as usize].as_dvec3());
            let flat = (b - a).cross(c - a).normalize_or_zero().as_vec3();
            mesh.indices.push(triangle.map(|corner @ (position, normal)| {
                let mut add = |normal| {
                    mesh.positions.push(positions[position as usize]);
                    smooth.push(normal);
                    mesh.positions.len() as u32 - 1
                };
                match normals.get(normal as usize) {
                    Some(normal) => *numbers.entry(corner).or_insert_with(|| add(*normal)),
                    None => add(flat),
                }
            }));
        }
        ObjMesh { normals: Some(smooth), ..mesh }
    }
}

/// The beginning of a word, which may be of any length and of any characters, for a message.
fn beginning(word: &str) -> String {
    word.chars().take(20).flat_map(char::escape_debug).collect()
}

fn vector<'a>(mut words: impl Iterator<Item = &'a str>) -> Result<Vec3, String> {
    let mut coordinates = [0.0; 3];
    for coordinate in &mut coordinates {
        let word = words.next().ok_or("expected three coordinates")?;
        *coordinate = word
            .parse()
            .ok()
            .filter(|value: &f32| value.is_finite())
            .ok_or_else(|| format!("expected a finite coordinate, found `{}`", beginning(word)))?;
    }
    Ok(coordinates.into())
}

fn index(word: &str, count: usize, what: &str) -> Result<u32, String> {
    let number: i64 =
        word.parse().map_err(|_| format!("expected the number of a {what}, found `{}`", beginning(word)))?;
    let place = usize::try_from(number.unsigned_abs()).unwrap_or(usize::MAX);
    let index = if number < 0 { count.checked_sub(place) } else { place.checked_sub(1) };
    index
        .filter(|&index| index < count)
        .and_then(|index| u32::try_from(index).ok().filter(|&index| index != NONE))
        .ok_or_else(|| format!("there is no {what} {number} among the {count} before this line"))
}
