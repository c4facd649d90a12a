//! Triangle meshes from Wavefront OBJ files.
//!
//! Read are vertices (`v`), normals (`vn`) and faces (`f`), with the names of objects (`o`), groups (`g`) and
//! materials (`usemtl`) that they belong to; polygons become triangles. Texture coordinates, lines and points
//! are skipped; anything else, such as a free-form surface, is an error.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead, Read as _};
use std::sync::Arc;

use glam::Vec3;

mod polygon;
mod smooth;

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
    /// In the order of their triangles; what is before the first has no name.
    sections: Vec<Section>,
    /// The number of each name.
    names: BTreeMap<String, u32>,
    /// Whether some faces are in a smoothing group (`s`).
    has_smoothing_groups: bool,
}

/// Triangles one after the other that have the same names.
#[derive(Clone, Debug, Default)]
struct Section {
    first: usize,
    object: Option<u32>,
    groups: Arc<[u32]>,
    material: Option<u32>,
}

impl Section {
    fn names(&self) -> impl Iterator<Item = u32> {
        self.groups.iter().copied().chain(self.object).chain(self.material)
    }

    /// Whether a statement of this kind gives the triangles this name.
    fn has(&self, statement: &str, name: u32) -> bool {
        match statement {
            "o" => self.object == Some(name),
            "g" => self.groups.contains(&name),
            _ => self.material == Some(name),
        }
    }
}

/// The statements that give triangles a name, and what they name.
const STATEMENTS: [(&str, &str); 3] = [("o", "an object"), ("g", "a group"), ("usemtl", "a material")];

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

    /// Reads an OBJ file line by line, of at most 1 MiB each; one that ends in a backslash goes on in the
    /// next. A byte order mark at the start of the file is left out.
    ///
    /// # Errors
    ///
    /// The first line that cannot be read or is no statement, or the last one of a file without faces.
    pub fn read(mut file: impl BufRead) -> Result<Self, ObjError> {
        let mut parsed = Self::default();
        let mut bytes = Vec::new();
        // Of the first line of a statement, and of the last one that was read.
        let (mut first, mut line) = (1, 0);
        let mut has_comment = false;
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
            let has_numbers = matches!(text.trim_ascii_start().first(), Some(b'v' | b'f' | b'l' | b'p'));
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
        Ok(parsed)
    }

    /// Names of objects, groups and materials that have triangles.
    pub fn parts(&self) -> impl Iterator<Item = &str> {
        let used: BTreeSet<u32> = self.named_ranges().flat_map(|(section, _)| section.names()).collect();
        self.names.iter().filter(move |(_, number)| used.contains(number)).map(|(name, _)| name.as_str())
    }

    /// The number of materials that have triangles.
    #[must_use]
    pub fn material_count(&self) -> usize {
        self.named_ranges().filter_map(|(section, _)| section.material).collect::<BTreeSet<_>>().len()
    }

    /// Whether faces are meant to look smooth, in smoothing groups, and the file has no normals for it.
    #[must_use]
    pub fn lacks_normals(&self) -> bool {
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
        let of = |statement: &str, name: &str| -> Vec<_> {
            let number = self.names.get(name);
            let named = |section: &Section| number.is_some_and(|number| section.has(statement, *number));
            self.named_ranges().filter(|(section, _)| named(section)).map(|(_, range)| range).collect()
        };
        let mut found = STATEMENTS.map(|(statement, what)| (statement, what, of(statement, name))).to_vec();
        found.retain(|(_, _, ranges)| !ranges.is_empty());
        if let [(_, _, first), others @ ..] = &found[..]
            && others.iter().any(|(_, _, ranges)| ranges != first)
        {
            let whats: Vec<&str> = found.iter().map(|(_, what, _)| *what).collect();
            let lines: Vec<String> =
                found.iter().map(|(statement, ..)| format!("`part: \"{statement} {name}\"`")).collect();
            return Err(PartError::SeveralKinds(format!(
                "`{name}` is the name of {} with different triangles: {}, the line as in the file, tells which",
                whats.join(" and "),
                lines.join(" or ")
            )));
        }
        let statement = || {
            let (statement, name) = name.split_once(char::is_whitespace)?;
            STATEMENTS.iter().find(|(known, _)| *known == statement).map(|_| of(statement, name.trim()))
        };
        let ranges = found.pop().map(|(_, _, ranges)| ranges).or_else(statement).unwrap_or_default();
        if ranges.is_empty() {
            return Err(PartError::Unknown);
        }
        Ok(self.mesh_of(ranges.iter().flat_map(|range| &self.triangles[range.clone()])))
    }

    /// Sections with the numbers of their triangles.
    fn named_ranges(&self) -> impl Iterator<Item = (&Section, std::ops::Range<usize>)> + Clone {
        let ends = self.sections.iter().skip(1).map(|next| next.first).chain([self.triangles.len()]);
        let ranges = self.sections.iter().zip(ends).map(|(section, end)| (section, section.first..end));
        ranges.filter(|(_, range)| !range.is_empty())
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
                let triangles = polygon::triangles(&places)?;
                self.triangles.extend(triangles.iter().map(|triangle| triangle.map(|place| corners[place])));
            }
            Some(kind @ ("o" | "g" | "usemtl")) => self.begin(kind, &line[kind.len()..])?,
            Some("s") => self.has_smoothing_groups |= words.next().is_some_and(|s| s != "off" && s != "0"),
            Some(word) if !SKIPPED.contains(&word) => {
                return Err(format!(
                    "expected a statement about polygons, such as `v` or `f`, found `{}`",
                    beginning(word)
                ));
            }
            _ => {}
        }
        Ok(())
    }

    /// Begins triangles under another name.
    fn begin(&mut self, kind: &str, name: &str) -> Result<(), String> {
        // Within a name no comment begins.
        let name = name.split(" #").next().unwrap_or("").trim();
        if kind == "g" {
            self.section().groups =
                name.split_whitespace().map(|name| self.number(name)).collect::<Result<_, _>>()?;
            return Ok(());
        }
        let number = if name.is_empty() { None } else { Some(self.number(name)?) };
        let section = self.section();
        *(if kind == "o" { &mut section.object } else { &mut section.material }) = number;
        Ok(())
    }

    /// The section of the next triangles.
    fn section(&mut self) -> &mut Section {
        let first = self.triangles.len();
        let last = self.sections.last().cloned().unwrap_or_default();
        // Names without a triangle are forgotten.
        if self.sections.last().is_none_or(|section| section.first < first) {
            self.sections.push(Section { first, ..last });
        }
        self.sections.last_mut().expect("there is one")
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

#[cfg(test)]
mod tests {
    use super::*;

    fn whole(text: &str) -> ObjMesh {
        ObjFile::parse(text).unwrap().mesh()
    }

    #[test]
    fn polygons_become_fans() {
        let mesh = whole("# a square\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0 # last\nf 1 2 3 4\n");
        assert_eq!(mesh.indices, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.normals, None);
    }

    #[test]
    fn polygons_with_reflex_corners_do_not_fold() {
        let text = "v 2 0 0\nv 2 0 -1\nv 1 0 -1\nv 1 0 -2\nv 0 0 -2\nv 0 0 0\nf 1 2 3 4 5 6\n";
        let ObjMesh { positions, indices, normals } = whole(text);
        let mesh = upbp_accel::TriangleMesh::new(positions, indices, normals).unwrap();
        assert_eq!((mesh.triangle_count(), mesh.area()), (4, 3.0));
    }

    #[test]
    fn statements_go_on_after_a_backslash() {
        let text = "# made in C:\\rooms\\\no C:\\rooms\\\nv 0 0 0\nv 1 0 \\\r\n0\nv 1 1 0\nv 0 1 0\nvt 0 \\\n1\nf 1 2 \\ \n3 \\\n4\n";
        assert_eq!(whole(text).indices, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(whole("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3 \\").indices, [[0, 1, 2]]);
        let error = ObjFile::parse(&text.replace('4', "x")).unwrap_err();
        // By its first line.
        assert_eq!(error.line, 10, "{error}");
        let long = format!("v 0 0 \\\n{}0", " \\\n".repeat(MAX_LINE as usize / 2));
        assert_eq!(ObjFile::parse(&long).unwrap_err().line, 1);
    }

    #[test]
    fn negative_numbers_count_from_the_end() {
        let mesh = whole("v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3/1 -2/1 -1/1");
        assert_eq!(mesh.indices, [[0, 1, 2]]);
    }

    #[test]
    fn corners_with_several_normals_are_told_apart() {
        let text =
            "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nvn 0 1 0\nf 1//1 2//1 3//1\nf 1//2 3//1 4//1";
        let mesh = whole(text);
        assert_eq!(mesh.indices, [[0, 1, 2], [3, 2, 4]]);
        assert_eq!(mesh.positions[3], mesh.positions[0]);
        assert_eq!(mesh.normals.unwrap()[3], Vec3::Y);
    }

    #[test]
    fn corners_without_a_normal_have_that_of_their_triangle() {
        // A smooth triangle, a flat one beside it, and one with a single normal.
        let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 0 2\nvn 0 1 1\nf 1//1 2//1 3//1\nf 1 4 2\nf 3//1 2 1";
        let ObjMesh { positions, indices, normals } = whole(text);
        let normals = normals.unwrap();
        let given = Vec3::new(0.0, 1.0, 1.0);
        let normals = indices.iter().map(|triangle| triangle.map(|corner| normals[corner as usize]));
        let expected = [[given; 3], [Vec3::Y; 3], [given, -Vec3::Z, -Vec3::Z]];
        assert_eq!(normals.collect::<Vec<_>>(), expected);
        let places = indices.iter().map(|triangle| triangle.map(|corner| positions[corner as usize]));
        let places: Vec<_> = places.collect();
        assert_eq!(places[1], [Vec3::ZERO, 2.0 * Vec3::Z, Vec3::X]);
        assert_eq!(places[2], [Vec3::new(1.0, 1.0, 0.0), Vec3::X, Vec3::ZERO]);
    }

    #[test]
    fn parts_are_chosen_by_the_names_of_objects_groups_and_materials() {
        let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 9\nf 1 2 3\no wine glass\nusemtl clear\nf 2 3 4\n\
                    g stem base # two\nf 3 4 5\no wine\nusemtl\nf 4 5 1\ng\nusemtl red\no empty\n";
        let file = ObjFile::parse(text).unwrap();
        assert_eq!(file.parts().collect::<Vec<_>>(), ["base", "clear", "stem", "wine", "wine glass"]);
        assert_eq!((file.material_count(), file.mesh().indices.len()), (1, 4));
        let corners = |part: &str| {
            let ObjMesh { positions, indices, .. } = file.part(part).ok()?;
            let places = indices.iter().flatten().map(|corner| positions[*corner as usize]);
            let places = places.map(|place| file.positions.iter().position(|p| *p == place).unwrap() + 1);
            Some((positions.len(), places.collect::<Vec<_>>()))
        };
        assert_eq!(corners("wine glass"), Some((4, vec![2, 3, 4, 3, 4, 5])));
        assert_eq!(corners("clear"), corners("wine glass"));
        assert_eq!(corners("base"), Some((4, vec![3, 4, 5, 4, 5, 1])));
        assert_eq!(corners("wine"), Some((3, vec![4, 5, 1])));
        for none in ["red", "empty", "glass", ""] {
            assert_eq!(corners(none), None, "{none}");
        }
        let text = "v 0 0 0\nusemtl Mat#1 # one\nf 1 1 1\nusemtl Mat#2\t\nf 1 1 1\ng #\nf 1 1 1";
        assert_eq!(ObjFile::parse(text).unwrap().parts().collect::<Vec<_>>(), ["Mat#1", "Mat#2"]);
    }

    #[test]
    fn names_of_objects_and_materials_with_different_triangles_are_told_apart() {
        let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\no Glass\nusemtl Glass\nf 1 2 3\no Carafe\nf 2 3 4\n\
                    o Mug\nusemtl Mug\ng Mug\nf 3 4 1\n";
        let file = ObjFile::parse(text).unwrap();
        let count = |part: &str| file.part(part).map(|mesh| mesh.indices.len());
        let message = "`Glass` is the name of an object and a material with different triangles: \
                       `part: \"o Glass\"` or `part: \"usemtl Glass\"`, the line as in the file, tells which";
        assert_eq!(count("Glass").unwrap_err().to_string(), message);
        assert_eq!((count("o Glass"), count("usemtl\t Glass ")), (Ok(1), Ok(2)));
        for same in ["Mug", "o Mug", "g Mug", "usemtl Mug", "o Carafe"] {
            assert_eq!(count(same), Ok(1), "{same}");
        }
        for none in ["g Glass", "usemtl Carafe", "f 1 2 3", "o", "o "] {
            assert_eq!(count(none), Err(PartError::Unknown), "{none}");
        }
        // An object that is really called so.
        let file = ObjFile::parse(&(text.to_owned() + "o usemtl Glass\nf 1 2 4\nf 1 2 4\nf 1 2 4")).unwrap();
        assert_eq!(file.part("usemtl Glass").unwrap().indices.len(), 3);
    }

    #[test]
    fn smoothing_groups_without_normals_are_found() {
        let lacks =
            |begin: &str| ObjFile::parse(&(begin.to_owned() + "\nv 0 0 0\nf 1 1 1")).unwrap().lacks_normals();
        assert!(lacks("s 1") && lacks("s on") && lacks("s 2\ns off"));
        assert!(!lacks("") && !lacks("s") && !lacks("s off") && !lacks("s 0") && !lacks("vn 0 0 1\ns 1"));
    }

    #[test]
    fn names_do_not_take_all_memory() {
        let text = "v 0 0 0\n".to_owned() + &"o a\ng b\nusemtl c\n".repeat(1000) + "f 1 1 1";
        assert_eq!(ObjFile::parse(&text).unwrap().sections.len(), 1);
        let names = |count: usize| (0..count).fold("g".to_owned(), |line, i| line + " " + &i.to_string());
        let with = |count| ObjFile::parse(&("v 0 0 0\nf 1 1 1\n".to_owned() + &names(count)));
        assert!(with(MAX_NAMES).is_ok());
        let error = with(MAX_NAMES + 1).unwrap_err().to_string();
        assert_eq!(
            error,
            format!("line 3: the mesh has more than {MAX_NAMES} names of objects, groups and materials")
        );
    }

    #[test]
    fn a_byte_order_mark_and_other_encodings_do_no_harm() {
        let mesh = b"\xef\xbb\xbfv 0 0 0\r\nv 1 0 0\r\n# caf\xe9\r\ng caf\xe9\r\nv 1 1 0\r\nf 1 2 3";
        let mesh = ObjFile::read(&mesh[..]).unwrap().mesh();
        assert_eq!(mesh.positions.len(), 3);
        assert_eq!(mesh.indices, [[0, 1, 2]]);
    }

    /// Without an end, and without a line's end.
    #[test]
    fn endless_files_end_at_their_first_line() {
        for byte in [0, b' ', b'#', b'f', 0xff] {
            let error = ObjFile::read(std::io::BufReader::new(std::io::repeat(byte))).unwrap_err();
            assert_eq!(error.to_string(), "line 1: is longer than 1048576 bytes");
        }
    }

    #[test]
    fn corners_that_are_repeated_do_not_take_all_memory() {
        let polygon = "v 0 0 0\nf".to_owned() + &" 1".repeat(MAX_TRIANGLES / 2);
        assert!(ObjFile::parse(&polygon).is_ok());
        let error = ObjFile::parse(&(polygon.clone() + &polygon[7..] + &polygon[7..])).unwrap_err();
        assert_eq!(error.to_string(), format!("line 4: the mesh has more than {MAX_TRIANGLES} triangles"));
        // The most that is allowed, and one more.
        let all = "v 0 0 0\nf".to_owned() + &" 1".repeat(MAX_TRIANGLES + 2);
        assert_eq!(whole(&all).indices.len(), MAX_TRIANGLES);
        assert!(ObjFile::parse(&(all + " 1")).is_err());
    }

    #[test]
    fn errors_have_a_line() {
        let cases = [
            ("", "line 1: the file ends without a face (`f`)"),
            ("# nothing\nv 0 0 0\ng a\n", "line 3: the file ends without a face (`f`)"),
            (
                "v 0 0 0\nLorem ipsum",
                "line 2: expected a statement about polygons, such as `v` or `f`, found `Lorem`",
            ),
            (
                "\0\u{7}v\n",
                "line 1: expected a statement about polygons, such as `v` or `f`, found `\\0\\u{7}v`",
            ),
            (
                "surf 0 1 0 1 1",
                "line 1: expected a statement about polygons, such as `v` or `f`, found `surf`",
            ),
            (
                "call part.obj",
                "line 1: expected a statement about polygons, such as `v` or `f`, found `call`",
            ),
            ("v 0 0\n", "line 1: expected three coordinates"),
            ("\nv 0 x 0\n", "line 2: expected a finite coordinate, found `x`"),
            ("v 0 NaN 0\n", "line 1: expected a finite coordinate, found `NaN`"),
            ("v 0 0 0\nf 1 1\n", "line 2: a face needs at least 3 corners, found 2"),
            ("v 0 0 0\nf 1 1 2\n", "line 2: there is no vertex 2 among the 1 before this line"),
            ("v 0 0 0\nf 1 1 0\n", "line 2: there is no vertex 0 among the 1 before this line"),
            ("v 0 0 0\nf 1 1 -2\n", "line 2: there is no vertex -2 among the 1 before this line"),
            (
                "v 0 0 0\nf 1 1 -9223372036854775808\n",
                "line 2: there is no vertex -9223372036854775808 among the 1 before this line",
            ),
            ("v 0 0 0\nf 1 1 a/b\n", "line 2: expected the number of a vertex, found `a`"),
            ("v 0 0 0\nf 1//1 1//1 1//1\n", "line 2: there is no normal 1 among the 0 before this line"),
            (
                "v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 0\nf 1 2 3 4\n",
                "line 5: the polygon crosses itself: triangulate it",
            ),
        ];
        for (text, message) in cases {
            assert_eq!(ObjFile::parse(text).unwrap_err().to_string(), message);
        }
    }
}
