//! Triangle meshes from Wavefront OBJ files.
//!
//! Read are vertices (`v`), normals (`vn`) and faces (`f`); polygons become fans of triangles. Everything
//! else (texture coordinates, groups, materials) is skipped. Memory is bounded by the size of the file.

use std::collections::BTreeMap;

use glam::Vec3;

/// Corners, triangles and normals of a mesh.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct ObjMesh {
    /// Corners.
    pub positions: Vec<Vec3>,
    /// Triangles as indices of corners.
    pub indices: Vec<[u32; 3]>,
    /// One per corner, if every face has normals.
    pub normals: Option<Vec<Vec3>>,
}

/// What is wrong with an OBJ file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {message}")]
pub struct ObjError {
    /// Line, from 1.
    pub line: usize,
    /// What was expected and found.
    pub message: String,
}

/// A corner of a face: indices of its position and its normal.
type Corner = (u32, Option<u32>);

impl ObjMesh {
    /// Reads the text of an OBJ file.
    pub fn parse(text: &str) -> Result<Self, ObjError> {
        let mut parser = Parser::default();
        for (index, line) in text.lines().enumerate() {
            parser.line(line).map_err(|message| ObjError { line: index + 1, message })?;
        }
        Ok(parser.finish())
    }
}

#[derive(Default)]
struct Parser {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    triangles: Vec<[Corner; 3]>,
}

impl Parser {
    fn line(&mut self, line: &str) -> Result<(), String> {
        let mut words = line.split('#').next().unwrap_or("").split_whitespace();
        match words.next() {
            Some("v") => self.positions.push(vector(words)?),
            Some("vn") => self.normals.push(vector(words)?),
            Some("f") => {
                let corners = words.map(|word| self.corner(word)).collect::<Result<Vec<_>, _>>()?;
                if corners.len() < 3 {
                    return Err(format!("a face needs at least 3 corners, found {}", corners.len()));
                }
                self.triangles.extend(corners[1..].windows(2).map(|pair| [corners[0], pair[0], pair[1]]));
            }
            _ => {}
        }
        Ok(())
    }

    /// `v`, `v/vt`, `v//vn` or `v/vt/vn`, from 1, negative from the end.
    fn corner(&self, word: &str) -> Result<Corner, String> {
        let mut parts = word.split('/');
        let position = parts.next().unwrap_or("");
        let position = index(position, self.positions.len(), "vertex")?;
        let normal = match parts.nth(1) {
            Some(normal) if !normal.is_empty() => Some(index(normal, self.normals.len(), "normal")?),
            _ => None,
        };
        Ok((position, normal))
    }

    fn finish(self) -> ObjMesh {
        let Self { positions, normals, triangles } = self;
        let smooth = !triangles.is_empty() && triangles.iter().flatten().all(|corner| corner.1.is_some());
        if !smooth {
            let indices = triangles.iter().map(|triangle| triangle.map(|corner| corner.0)).collect();
            return ObjMesh { positions, indices, normals: None };
        }
        // A mesh has one normal per corner: corners that share a position but not a normal are told apart.
        let mut numbers = BTreeMap::new();
        let mut mesh = ObjMesh { normals: Some(Vec::new()), ..ObjMesh::default() };
        for triangle in &triangles {
            mesh.indices.push(triangle.map(|(position, normal)| {
                *numbers.entry((position, normal)).or_insert_with(|| {
                    let number = mesh.positions.len() as u32;
                    mesh.positions.push(positions[position as usize]);
                    let normal = normal.map_or(Vec3::ZERO, |normal| normals[normal as usize]);
                    mesh.normals.get_or_insert_default().push(normal);
                    number
                })
            }));
        }
        mesh
    }
}

fn vector<'a>(mut words: impl Iterator<Item = &'a str>) -> Result<Vec3, String> {
    let mut coordinates = [0.0; 3];
    for coordinate in &mut coordinates {
        let word = words.next().ok_or("expected three coordinates")?;
        *coordinate = word
            .parse()
            .ok()
            .filter(|value: &f32| value.is_finite())
            .ok_or_else(|| format!("expected a finite coordinate, found `{word}`"))?;
    }
    Ok(coordinates.into())
}

fn index(word: &str, count: usize, what: &str) -> Result<u32, String> {
    let number: i64 = word.parse().map_err(|_| format!("expected the number of a {what}, found `{word}`"))?;
    let place = usize::try_from(number.unsigned_abs()).unwrap_or(usize::MAX);
    let index = if number < 0 { count.checked_sub(place) } else { place.checked_sub(1) };
    index
        .filter(|&index| index < count)
        .and_then(|index| u32::try_from(index).ok())
        .ok_or_else(|| format!("there is no {what} {number} among the {count} before this line"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polygons_become_fans() {
        let mesh =
            ObjMesh::parse("# a square\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0 # last\nf 1 2 3 4\n").unwrap();
        assert_eq!(mesh.indices, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.normals, None);
    }

    #[test]
    fn negative_numbers_count_from_the_end() {
        let mesh = ObjMesh::parse("v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3/1 -2/1 -1/1").unwrap();
        assert_eq!(mesh.indices, [[0, 1, 2]]);
    }

    #[test]
    fn corners_with_several_normals_are_told_apart() {
        let text =
            "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nvn 0 1 0\nf 1//1 2//1 3//1\nf 1//2 3//1 4//1";
        let mesh = ObjMesh::parse(text).unwrap();
        assert_eq!(mesh.indices, [[0, 1, 2], [3, 2, 4]]);
        assert_eq!(mesh.positions[3], mesh.positions[0]);
        assert_eq!(mesh.normals.unwrap()[3], Vec3::Y);
    }

    #[test]
    fn errors_have_a_line() {
        let cases = [
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
        ];
        for (text, message) in cases {
            assert_eq!(ObjMesh::parse(text).unwrap_err().to_string(), message);
        }
    }
}
