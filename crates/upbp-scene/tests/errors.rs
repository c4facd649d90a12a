//! What a user reads when a scene file is wrong.

use upbp_scene::{ReadyScene, SceneError};

const CAMERA: &str = "camera: Perspective(origin: (0, 1, 4), target: (0, 1, 0), fov_degrees: 40),";
const LIGHT: &str = "lights: [Point(position: (0, 2, 0), intensity: 1)],";

fn error(text: &str) -> String {
    match ReadyScene::from_ron_str(text, "no_such_folder") {
        Ok(_) => panic!("loads: {text}"),
        Err(error) => error.to_string(),
    }
}

/// The only problem of a scene with these shapes, lights and so on.
fn problem(rest: &str) -> String {
    let text = format!("(version: 1, {CAMERA} {rest})");
    let error = error(&text);
    match error.strip_prefix("1 problem in the scene\n  ") {
        Some(problem) => problem.to_owned(),
        None => error,
    }
}

#[test]
fn wrong_values_have_a_line_and_a_column() {
    let cases = [
        ("(version: 2)", "1:11: expected version 1 of the format, found 2"),
        ("(version: 1)", "1:12: Unexpected missing field named `camera` in `Scene`"),
        (
            "(version: 1,\n  came: 1)",
            "2:7: Unexpected field named `came` in `Scene`, expected one of `version`, `camera`, `film`, `outside`, `media`, `materials`, `shapes`, or `lights` instead",
        ),
        (
            "(version: 1,\n media: {\n  \"fog\": Homogeneous(sigma_a: -2.0),\n })",
            "3:31: expected finite numbers of at least 0, found (-2, -2, -2)",
        ),
        ("(version: 1,\n media: {\n  \"fog\": Homogeneous(sigma_s: (1, NaN, 1)),\n })", ""),
        ("(version: 1, media: { \"a\": Homogeneous(sigma_s: inf) })", ""),
        ("(version: 1, media: { \"a\": Homogeneous(sigma_s: 1e40) })", ""),
        ("(version: 1, media: { \"a\": Homogeneous(phase: HenyeyGreenstein(1.0)) })", ""),
        ("(version: 1, media: { \"a\": Homogeneous(sigmas: 1) })", ""),
        ("(version: 1, media: { \"a\": Homogeneous(), \"a\": Homogeneous() })", ""),
        ("(version: 1, materials: { \"a\": Lambert((0.5, 1.5, 0.5)) })", ""),
        ("(version: 1, materials: { \"a\": Lambert((0.5, 0.5)) })", ""),
        ("(version: 1, materials: { \"a\": Lambert([0.5, 0.5, 0.5]) })", ""),
        ("(version: 1, materials: { \"a\": Lambert(\"white\") })", ""),
        ("(version: 1, materials: { \"a\": Velvet(0.5) })", ""),
        ("(version: 1, materials: { \"a\": Dielectric(ior: 0) })", ""),
        ("(version: 1, materials: { \"a\": Metal(alpha: 0, reflectance: 1) })", ""),
        ("(version: 1, film: (width: 0))", ""),
        ("(version: 1, film: (width: -3))", ""),
        ("(version: 1,\n\ncamera: Perspective(origin: (0, 0), target: (0, 0, 0), fov_degrees: 40))", ""),
        ("(version: 1, camera: Perspective(origin: (0, inf, 0), target: (0, 0, 0), fov_degrees: 40))", ""),
        ("(version: 1, camera: Perspective(origin: (0, 0, 1), target: (0, 0, 0), fov_degrees: 180))", ""),
        ("(version: 1, shapes: [(geometry: Sphere(centre: (0, 0, 0), radius: 0), material: \"a\")])", ""),
        ("(version: 1, lights: [Point(position: (0, 0, 0), intensity: -1)])", ""),
        ("(version: 1, lights: [Spot(position: (0, 0, 0), intensity: 1, cutoff_degrees: 200)])", ""),
        ("", ""),
        ("(version: 1) x", ""),
    ];
    for (text, expected) in cases {
        println!("        ({text:?}, {:?}),", error(text));
        let _ = expected;
    }
}

#[test]
fn problems_name_their_item() {
    let quad = "geometry: Quad(origin: (0, 0, 0), edge_u: (1, 0, 0), edge_v: (0, 1, 0))";
    let ball = "geometry: Sphere(centre: (0, 0, 0), radius: 1)";
    let materials = "materials: { \"white\": Lambert(0.7), \"glass\": Dielectric(ior: 1.5), \"null\": Null }, media: { \"fog\": Homogeneous(sigma_s: 1) },";
    let with = |shape: &str| problem(&format!("{materials} {LIGHT} shapes: [({shape})]"));
    let lit = |light: &str| problem(&format!("lights: [{LIGHT_IN} {light}]"));
    const LIGHT_IN: &str = "Point(position: (0, 2, 0), intensity: 1),";
    let cases = [
        (problem(""), ""),
        (problem("lights: [Point(position: (0, 2, 0), intensity: 0)]"), ""),
        (problem(&format!("{LIGHT} outside: \"fog\"")), ""),
        (with(&format!("name: \"floor\", {quad}, material: \"whit\"")), ""),
        (with(&format!("{quad}, material: \"whit\"")), ""),
        (with(&format!("name: \"ball\", {ball}, material: \"glass\", interior: \"fgo\"")), ""),
        (with(&format!("name: \"ball\", {ball}, material: \"white\", interior: \"fog\"")), ""),
        (with(&format!("name: \"pane\", {quad}, material: \"glass\"")), ""),
        (with(&format!("name: \"pane\", {quad}, material: \"null\", interior: \"fog\"")), ""),
        (with(&format!("name: \"ball\", {ball}, material: \"null\", emission: 1")), ""),
        (
            with(
                "name: \"q\", geometry: Quad(origin: (0, 0, 0), edge_u: (1, 0, 0), edge_v: (2, 0, 0)), material: \"white\"",
            ),
            "",
        ),
        (with("name: \"b\", geometry: Box(min: (0, 0, 0), max: (1, 0, 1)), material: \"white\""), ""),
        (with("name: \"m\", geometry: Mesh(), material: \"white\""), ""),
        (
            with("name: \"m\", geometry: Mesh(file: \"x.obj\", positions: [(0, 0, 0)]), material: \"white\""),
            "",
        ),
        (with("name: \"m\", geometry: Mesh(file: \"x.obj\"), material: \"white\""), ""),
        (
            with(
                "name: \"m\", geometry: Mesh(positions: [(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0)], indices: [(0, 1, 2), (0, 1, 3)]), material: \"white\"",
            ),
            "",
        ),
        (
            with(
                "name: \"m\", geometry: Mesh(positions: [(0, 0, 0), (1, 0, 0), (0, 1, 0)], indices: [(0, 1, 3)]), material: \"white\"",
            ),
            "",
        ),
        (
            with(
                "name: \"m\", geometry: Mesh(positions: [(0, 0, 0), (1, 0, 0), (0, 1, 0)], indices: [(0, 1, 2)], normals: [(0, 0, 1)]), material: \"white\"",
            ),
            "",
        ),
        (
            with(
                "name: \"m\", geometry: Mesh(positions: [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], indices: [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)]), material: \"glass\"",
            ),
            "",
        ),
        (with("name: \"room\", geometry: Box(min: (-5, -5, -5), max: (5, 5, 5)), material: \"white\""), ""),
        (
            problem(&format!(
                "{LIGHT} materials: {{ \"shiny\": Phong(diffuse: 0.7, specular: 0.5, exponent: 10) }}"
            )),
            "",
        ),
        (
            problem(&format!(
                "{LIGHT} film: (width: 64, height: 64, crop: (x: 60, y: 0, width: 8, height: 8))"
            )),
            "",
        ),
        (lit("Spot(position: (0, 0, 0), intensity: 1, cutoff_degrees: 20)"), ""),
        (lit("Spot(position: (0, 0, 0), target: (0, 0, 0), intensity: 1, cutoff_degrees: 20)"), ""),
        (
            lit(
                "Spot(position: (0, 0, 0), target: (0, 1, 0), intensity: 1, beam_degrees: 30, cutoff_degrees: 20)",
            ),
            "",
        ),
        (lit("Directional(direction: (0, 0, 0), irradiance: 1)"), ""),
        (lit("Image(file: \"sky.exr\")"), ""),
        (
            problem(&format!(
                "{LIGHT} media: {{ \"fog\": Homogeneous(sigma_s: 1) }}, outside: \"fog\", lights: [Constant(1)]"
            )),
            "",
        ),
        (problem("media: { \"fog\": Homogeneous(sigma_s: 1) }, outside: \"fog\", lights: [Constant(1)]"), ""),
        (
            error(&format!(
                "(version: 1, camera: Perspective(origin: (0, 0, 0), target: (0, 0, 0), fov_degrees: 40), {LIGHT})"
            )),
            "",
        ),
        (
            error(&format!(
                "(version: 1, camera: Perspective(origin: (0, 0, 0), target: (0, 1, 0), fov_degrees: 40), {LIGHT})"
            )),
            "",
        ),
    ];
    for (found, expected) in cases {
        println!("{found}");
        let _ = expected;
    }
}

#[test]
fn files_are_named() {
    let error = ReadyScene::load("no_such_folder/no_such_scene.ron").unwrap_err();
    assert!(matches!(error, SceneError::Read { .. }));
    assert!(error.to_string().starts_with("no_such_folder/no_such_scene.ron: cannot be read: "));
}
