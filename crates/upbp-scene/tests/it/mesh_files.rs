//! Mesh files of several parts, and meshes of several pieces whose insides contradict each other.

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use glam::Vec3;
use upbp_core::scene::Scene as _;
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
        [", part: \"b\", translate: (-5, 0, 0)", ", part: \"a\"", ", part: \"x\", translate: (5, 0, 0)"];
    let parts = parts.map(shape);
    let scene = folder.scene(&parts.join(", ")).unwrap();
    let boxes: Vec<_> = scene.geometry().shapes().iter().map(upbp_accel::Shape::aabb).collect();
    let half = Vec3::splat(0.5);
    let by = Vec3::new(5.0, 0.0, 0.0);
    assert_eq!(boxes, [(-by - half, half - by), (-Vec3::ONE, Vec3::ONE), (by - half, by + half)]);
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
        |part: &str| format!("(geometry: Mesh(file: \"m.obj\", part: \"{part}\"), material: \"white\")");
    let note = "mesh `m.obj`: has smoothing groups but no normals: it is rendered with flat facets, \
                unless `smooth_degrees` is given";
    assert_eq!(folder.notes(&[shape("a"), shape("b"), shape("a")].join(", ")), [note]);
    let smooth = |part: &str| shape(part).replace("part", "smooth_degrees: 30, part");
    assert!(folder.notes(&[smooth("a"), smooth("b")].join(", ")).is_empty());
}

/// A strip of 198 triangles from x = `offset` on. At 500 km from the origin, coordinates are no finer than
/// 1/32.
fn strip(offset: f64, step: f64) -> String {
    let mut text = String::new();
    for i in 0..100 {
        let x = offset + step * f64::from(i);
        writeln!(text, "v {x} 0 0\nv {x} 0 1").unwrap();
    }
    (1..199).for_each(|i| writeln!(text, "f {i} {} {}", i + 1, i + 2).unwrap());
    text
}

#[test]
fn triangles_that_coordinates_have_flattened_are_noted() {
    let shape = "(geometry: Mesh(file: \"m.obj\"), material: \"white\")";
    let notes = |offset: f64, step: f64| Folder::with("flattened", &strip(offset, step)).notes(shape);
    assert!(notes(0.0, 0.01).is_empty());
    assert!(notes(5e5, 0.0625).is_empty());
    let [note] = &notes(5e5, 0.02)[..] else { panic!("one note") };
    assert!(note.starts_with("mesh `m.obj`: ") && note.contains(" of 198 triangles have no area"), "{note}");
    assert!(note.ends_with("up to 500001.97: move the mesh near its origin before it is written"), "{note}");
}

#[test]
fn triangles_that_their_place_has_flattened_are_noted() {
    let folder = |step: f64| Folder::with("placed", &strip(0.0, step));
    let far = |name: &str| {
        format!(
            "(name: \"{name}\", geometry: Mesh(file: \"m.obj\", translate: (5e5, 0, 0)), material: \"white\"),"
        )
    };
    assert!(folder(0.0625).notes(&far("a")).is_empty());
    let [note] = &folder(0.02).notes(&(far("a") + &far("b")))[..] else { panic!("one note") };
    assert!(
        note.starts_with("shape `a`: about ") && note.contains(" % of its triangles have no area"),
        "{note}"
    );
    let end = "at coordinates up to 500001.97: move the scene near its origin (and so does 1 other)";
    assert!(note.ends_with(end), "{note}");
}

/// A cylinder without normals in a file and in the scene.
#[test]
fn meshes_without_normals_become_smooth_bodies() {
    let (mut positions, mut indices, mut faces) = (String::new(), String::new(), String::new());
    let sides = 12;
    for (number, y) in [0.0, 2.0].into_iter().flat_map(|y| (0..sides).map(move |side| (side, y))) {
        let (sin, cos) = (number as f32 / sides as f32 * std::f32::consts::TAU).sin_cos();
        write!(positions, "({cos}, {y}, {sin}),").unwrap();
        writeln!(faces, "v {cos} {y} {sin}").unwrap();
    }
    let mut face = |corners: [u32; 3]| {
        let [a, b, c] = corners;
        write!(indices, "({a}, {b}, {c}),").unwrap();
        writeln!(faces, "f {} {} {}", a + 1, b + 1, c + 1).unwrap();
    };
    for a in 0..sides {
        let b = (a + 1) % sides;
        face([a, a + sides, b]);
        face([b, a + sides, b + sides]);
    }
    for a in 2..sides {
        face([0, a - 1, a]);
        face([sides, sides + a, sides + a - 1]);
    }
    let folder = Folder::with("smooth", &faces);
    let here = format!("positions: [{positions}], indices: [{indices}]");
    for source in ["file: \"m.obj\"", &here] {
        // A ray onto a ridge of the side, a little beside it, and onto the cap.
        let normals = |smooth: &str| {
            let rest = format!("(geometry: Mesh({source}, {smooth} scale: 2), material: \"glass\")");
            let scene = folder.scene(&rest).unwrap_or_else(|error| panic!("{error}"));
            let upbp_accel::Shape::Mesh(mesh) = &scene.geometry().shapes()[0] else { panic!("no mesh") };
            assert!(mesh.is_closed() && mesh.signed_volume() > 0.0);
            [(Vec3::new(9.0, 1.3, 0.01), Vec3::NEG_X), (Vec3::new(1.0, 9.0, 0.3), Vec3::NEG_Y)].map(
                |(origin, direction)| {
                    let hit = scene.intersect(&upbp_accel::Ray::new(origin, direction)).expect("a hit");
                    hit.shading_normal
                },
            )
        };
        let [side, cap] = normals("smooth_degrees: 40,");
        assert!(side.distance(Vec3::new(1.0, 0.0, 0.005).normalize()) < 1e-3, "{side}");
        assert_eq!(cap, Vec3::Y);
        let [side, _] = normals("");
        assert!(side.distance(Vec3::X) > 0.2, "{side}");
    }
    let with_normals = "(geometry: Mesh(positions: [(0, 0, 0), (1, 0, 0), (0, 1, 0)], indices: [(0, 1, 2)],
        normals: [(0, 0, 1), (0, 0, 1), (0, 0, 1)], smooth_degrees: 30), material: \"white\")";
    let error = folder.scene(with_normals).unwrap_err().to_string();
    let expected = "shape 1: has normals of its own, and `smooth_degrees` is for meshes without";
    assert!(error.ends_with(expected), "{error}");
}

/// The scenes with which the page of the format begins, as they are there.
#[test]
fn the_scenes_of_the_readme_are_ready() {
    let page = upbp_scene::scene_format();
    let blocks = page.split("```ron\n").skip(1).map(|rest| rest.split("```").next().unwrap());
    let [alone, with_files]: [&str; 2] = blocks.collect::<Vec<_>>().try_into().expect("two scenes");
    assert_eq!(alone.lines().count(), 12);
    let small = alone.replace("width: 640, height: 480", "width: 16, height: 12");
    assert_ne!(small, alone);
    let scene = ReadyScene::from_ron_str(&small, "").unwrap();
    assert!(scene.notes().is_empty(), "{:?}", scene.notes());
    let settings = upbp_core::Settings::default().validate().unwrap();
    assert!(scene.renderer(settings).unwrap().iterate());

    let (wall, milk) = (cube("Glass", 0.05, false, 0), cube("Milk", 0.046, false, 2));
    let folder = Folder::with("readme", &[wall, cube("Glass", 0.045, true, 1), milk].concat());
    let sky = |_, _| (1.0_f32, 1.0_f32, 1.0_f32);
    exr::prelude::write_rgb_file(folder.0.join("sky.exr"), 4, 2, sky).unwrap();
    fs::rename(folder.0.join("m.obj"), folder.0.join("glass.obj")).unwrap();
    let scene = ReadyScene::from_ron_str(with_files, &folder.0).unwrap_or_else(|error| panic!("{error}"));
    assert!(scene.notes().is_empty(), "{:?}", scene.notes());
    let is_milk = |x: f32| scene.stack_at(Vec3::new(x, 0.01, 0.0)).medium().is_some();
    assert!([0.0, 0.0449, 0.0455, 0.0505].map(is_milk) == [true, true, false, false]);
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
    assert!(note.starts_with("shape `bulb`: the piece of the mesh at ["), "{note}");
    // Opaque walls have no inside.
    let opaque = glass.replace("\"glass", "\"white");
    assert!(wrong.notes(&opaque).is_empty());
    assert_eq!(wrong.notes(&(opaque + copy)).len(), 1);
    // Coordinates have few digits there, but enough for the wall.
    let far = glass.replace("m.obj\"", "m.obj\", translate: (1.5e5, 0, 0)");
    assert!(hollow.notes(&far).is_empty());
    let [note] = &wrong.notes(&far)[..] else { panic!("far away") };
    assert!(note.starts_with("shape `bulb`: the piece of the mesh at [1"), "{note}");
    // As bodies of their own both are right.
    let parts = glass.replace("m.obj\"", "m.obj\", part: \"outer\"")
        + &copy.replace("m.obj\"", "m.obj\", part: \"inner\"");
    assert!(wrong.notes(&parts).is_empty());
}
