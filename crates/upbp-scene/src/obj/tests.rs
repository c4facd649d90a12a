//! Meshes and errors of OBJ files.

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
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nvn 0 1 0\nf 1//1 2//1 3//1\nf 1//2 3//1 4//1";
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
    let file = ObjFile::parse(&text).unwrap();
    assert_eq!(file.ranges.iter().flatten().flatten().collect::<Vec<_>>(), [&(0..1); 3]);
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
        ("\0\u{7}v\n", "line 1: expected a statement about polygons, such as `v` or `f`, found `\\0\\u{7}v`"),
        ("surf 0 1 0 1 1", "line 1: expected a statement about polygons, such as `v` or `f`, found `surf`"),
        ("call part.obj", "line 1: expected a statement about polygons, such as `v` or `f`, found `call`"),
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
