//! Mesh files of several parts: those that shapes take, and those whose insides contradict each other.

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use glam::Vec3;
use upbp_scene::{ReadyScene, SceneError};

/// A cube around the origin as an object of a mesh file, of which `before` are there already. Inwards its
/// normals point into it.
fn cube(name: &str, half: f32, inwards: bool, before: u32) -> String {
    let mut text = format!("o {name}\n");
    for corner in 0..8 {
        let side = |axis: u32| if corner >> axis & 1 == 0 { -half } else { half };
        writeln!(text, "v {} {} {}", side(0), side(1), side(2)).unwrap();
    }
    for [a, b, c, d] in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
        let face = if inwards { [d, c, b, a] } else { [a, b, c, d] };
        let [a, b, c, d] = face.map(|corner: u32| 8 * before + corner + 1);
        writeln!(text, "f {a} {b} {c} {d}").unwrap();
    }
    text
}

/// A folder with a mesh file, `m.obj`.
struct Folder(PathBuf);

impl Folder {
    fn with(name: &str, mesh: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("upbp mesh files {name} {}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("m.obj"), mesh).unwrap();
        Self(folder)
    }

    fn scene(&self, shapes: &str) -> Result<ReadyScene, SceneError> {
        // One that no shape has would be noted.
        let materials = ["\"white\": Lambert(0.5),", "\"glass\": Dielectric(1.5),"];
        let used = |material: &&str| shapes.contains(material.split(':').next().unwrap());
        let materials: String = materials.into_iter().filter(used).collect();
        let text = format!(
            "(version: 1, camera: Perspective(origin: (0, 0, 9), target: (0, 0, 0), fov_degrees: 30),
              materials: {{ {materials} }},
              shapes: [{shapes}],
              lights: [Constant(1)])"
        );
        ReadyScene::from_ron_str(&text, &self.0)
    }

    fn notes(&self, shapes: &str) -> Vec<String> {
        let scene = self.scene(shapes).unwrap_or_else(|error| panic!("{error}"));
        scene.notes().iter().map(ToString::to_string).collect()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn a_part_of_a_file_is_a_shape() {
    let mesh = cube("a", 1.0, false, 0) + "usemtl x\n" + &cube("b", 0.5, false, 1);
    let folder = Folder::with("parts", &mesh);
    let shape = |part: &str| format!("(geometry: Mesh(file: \"m.obj\"{part}), material: \"glass\")");
    let parts =
        [shape(", part: \"b\""), shape(", part: \"a\""), shape(", part: \"x\", translate: (5, 0, 0)")];
    let scene = folder.scene(&parts.join(", ")).unwrap();
    let boxes: Vec<_> = scene.geometry().shapes().iter().map(upbp_accel::Shape::aabb).collect();
    let half = Vec3::splat(0.5);
    let by = Vec3::new(5.0, 0.0, 0.0);
    assert_eq!(boxes, [(-half, half), (-Vec3::ONE, Vec3::ONE), (by - half, by + half)]);
    assert_eq!((scene.files().len(), scene.notes()), (1, &[][..]));

    let error = |part: &str| folder.scene(&shape(part)).unwrap_err().to_string();
    assert_eq!(
        error(", part: \"glass\""),
        "1 problem in the scene\n  shape 1: mesh `m.obj`: unknown part `glass`, known: `a`, `b`, `x`"
    );
    let without_file = "(geometry: Mesh(part: \"a\"), material: \"glass\")";
    let error = folder.scene(without_file).unwrap_err().to_string();
    assert_eq!(error, "1 problem in the scene\n  shape 1: has a `part`, but no `file`");
}

#[test]
fn files_of_several_materials_are_noted_once() {
    let mesh = format!("usemtl x\n{}usemtl y\n{}", cube("a", 1.0, false, 0), cube("b", 0.5, true, 1));
    let folder = Folder::with("materials", &mesh);
    let shape = "(geometry: Mesh(file: \"m.obj\"), material: \"glass\")";
    let moved = "(geometry: Mesh(file: \"m.obj\", translate: (5, 0, 0)), material: \"glass\")";
    let note = "mesh `m.obj`: has 2 materials, and all of it is one shape: with `part` a shape takes the \
                triangles of one of them";
    assert_eq!(folder.notes(&[shape, moved].join(", ")), [note]);
}

#[test]
fn smoothing_groups_without_normals_are_noted_once() {
    let mesh = format!("s 1\n{}{}", cube("a", 1.0, false, 0), cube("b", 0.5, false, 1));
    let folder = Folder::with("smoothing", &mesh);
    let shape =
        |part: &str| format!("(geometry: Mesh(file: \"m.obj\", part: \"{part}\"), material: \"glass\")");
    let note = "mesh `m.obj`: has smoothing groups but no normals: it is rendered with flat facets";
    assert_eq!(folder.notes(&[shape("a"), shape("b"), shape("a")].join(", ")), [note]);
}

#[test]
fn hollows_that_are_wound_the_wrong_way_round_are_noted() {
    let glass = "(name: \"bulb\", geometry: Mesh(file: \"m.obj\"), material: \"glass\")";
    let copy = ", (geometry: Mesh(file: \"m.obj\", translate: (5, 0, 0)), material: \"glass\")";
    let wall = cube("outer", 1.0, false, 0);
    let hollow = Folder::with("hollow", &(wall.clone() + &cube("inner", 0.9, true, 1)));
    assert!(hollow.notes(glass).is_empty());
    let wrong = Folder::with("wrong", &(wall.clone() + &cube("inner", 0.9, false, 1)));
    let notes = wrong.notes(&(glass.to_owned() + copy));
    let [note] = &notes[..] else { panic!("{notes:?}") };
    assert!(note.starts_with("shape `bulb`: the part of the mesh at ["), "{note}");
    // Opaque walls have no inside.
    let opaque = glass.replace("\"glass", "\"white");
    assert!(wrong.notes(&opaque).is_empty());
    assert_eq!(wrong.notes(&(opaque + copy)).len(), 1);
    // Coordinates have few digits there.
    let far = glass.replace("m.obj\"", "m.obj\", translate: (3e5, 0, 0)");
    assert!(hollow.notes(&far).is_empty());
    let [note] = &wrong.notes(&far)[..] else { panic!("far away") };
    assert!(note.starts_with("shape `bulb`: the part of the mesh at [3"), "{note}");
    // As bodies of their own both are right.
    let parts = glass.replace("m.obj\"", "m.obj\", part: \"outer\"")
        + &copy.replace("m.obj\"", "m.obj\", part: \"inner\"");
    assert!(wrong.notes(&parts).is_empty());
}
