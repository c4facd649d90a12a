//! Messages about wrong scene files, as a user reads them.

use std::path::Path;

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
        ("(version: 1)", "1:12: Missing field `camera` of `Scene`"),
        (
            "(version: 1,\n  came: 1)",
            "2:3: Unexpected field named `came` in `Scene`, expected one of `version`, `camera`, `film`, `outside`, `media`, `materials`, `shapes`, or `lights` instead",
        ),
        (
            "(version: 1,\n media: {\n  \"fog\": Homogeneous(sigma_a: -2.0),\n })",
            "3:31: expected numbers from 0 to 1e12, found -2",
        ),
        (
            "(version: 1,\n media: {\n  \"fog\": Homogeneous(sigma_s: (1, NaN, 1)),\n })",
            "3:41: expected numbers from 0 to 1e12, found (1, NaN, 1)",
        ),
        (
            "(version: 1, media: { \"a\": Homogeneous(sigma_s: inf) })",
            "1:49: expected numbers from 0 to 1e12, found inf",
        ),
        (
            "(version: 1, media: { \"a\": Homogeneous(sigma_s: 1e40) })",
            "1:49: expected numbers from 0 to 1e12, found inf",
        ),
        (
            "(version: 1, media: { \"a\": Homogeneous(phase: HenyeyGreenstein(1.0)) })",
            "1:64: expected a mean cosine above -1 and below 1, found 1",
        ),
        (
            "(version: 1, media: { \"a\": Homogeneous(sigmas: 1) })",
            "1:40: Unexpected field named `sigmas` in `Homogeneous`, expected one of `sigma_a`, `sigma_s`, `phase`, `emission`, or `glow` instead",
        ),
        (
            "(version: 1, media: { \"a\": Homogeneous(), \"a\": Homogeneous() })",
            "1:44: the name `a` is given twice",
        ),
        (
            "(version: 1, materials: { \"a\": Lambert((0.5, 1.5, 0.5)) })",
            "1:54: expected numbers from 0 to 1, found (0.5, 1.5, 0.5)",
        ),
        (
            "(version: 1, materials: { \"a\": Lambert((0.5, 0.5)) })",
            "1:49: Expected a colour: a number, or three in parentheses (r, g, b) but found 2 elements instead",
        ),
        (
            "(version: 1, materials: { \"a\": Lambert([0.5, 0.5, 0.5]) })",
            "1:58: Missing field `camera` of `Scene`",
        ),
        (
            "(version: 1, materials: { \"a\": Lambert(\"white\") })",
            "1:41: Expected a colour: a number, or three in parentheses (r, g, b) but found the string \"white\" instead",
        ),
        (
            "(version: 1, materials: { \"a\": Velvet(0.5) })",
            "1:32: Unexpected variant named `Velvet` in enum `Material`, expected one of `Lambert`, `Phong`, `Mirror`, `Conductor`, `Metal`, `Dielectric`, `RoughDielectric`, or `Null` instead",
        ),
        (
            "(version: 1, materials: { \"a\": Dielectric(ior: 0) })",
            "1:48: expected an index of refraction from 0.1 to 10, found 0",
        ),
        (
            "(version: 1, materials: { \"a\": Metal(alpha: 0, reflectance: 1) })",
            "1:45: expected a roughness from 0.001 to 1 (for less, use a smooth material), found 0",
        ),
        (
            "(version: 1, media: { \"a\": Homogeneous(phase: TwoLobes(g: (0.9, -0.3), share: 0.8, weight: 0.1)) })",
            "1:84: Unexpected field named `weight` in `TwoLobes`, expected either `g` or `share` instead",
        ),
        (
            "(version: 1, materials: { \"a\": Phong(diffuse: 0, specular: 1, exponent: 1e9) })",
            "1:73: expected an exponent from 0 to 1e8 (for more, use a mirror), found 1e9",
        ),
        ("(version: 1, film: (width: 0))", "1:28: expected a number of pixels from 1 to 65536, found 0"),
        ("(version: 1, film: (width: -3))", "1:29: The whole number is too large or negative"),
        (
            "(version: 1,\n\ncamera: Perspective(origin: (0, 0), target: (0, 0, 0), fov_degrees: 40))",
            "3:34: Expected three numbers in parentheses (x, y, z) but found 2 elements instead",
        ),
        (
            "(version: 1, camera: Perspective(origin: (0, inf, 0), target: (0, 0, 0), fov_degrees: 40))",
            "1:52: expected finite coordinates between -1e12 and 1e12, found (0, inf, 0)",
        ),
        (
            "(version: 1, camera: Perspective(origin: (0, 0, 1), target: (0, 0, 0), fov_degrees: 180))",
            "1:85: expected an angle from 0.001 to 179 degrees, found 180",
        ),
        (
            "(version: 1, shapes: [(geometry: Sphere(centre: (0, 0, 0), radius: 0), material: \"a\")])",
            "1:68: expected a number above 0, from 1.2e-38 to 1e12, found 0",
        ),
        (
            "(version: 1, lights: [Point(position: (0, 0, 0), intensity: -1)])",
            "1:62: expected numbers from 0 to 1e12, found -1",
        ),
        (
            "(version: 1, lights: [Spot(position: (0, 0, 0), intensity: 1, cutoff_degrees: 200)])",
            "1:79: expected an angle from 0.01 to 180 degrees, found 200",
        ),
        ("", "1:1: Expected opening `(` for struct `Scene`"),
        ("(version: 1) x", "1:12: Missing field `camera` of `Scene`"),
    ];
    for (text, expected) in cases {
        assert_eq!(error(text), expected, "{text}");
    }
}

const MATERIALS: &str = r#"materials: { "white": Lambert(0.7), "glass": Dielectric(ior: 1.5), "null": Null },
    media: { "fog": Homogeneous(sigma_s: 1) },"#;

#[test]
fn scenes_without_light_are_refused() {
    let nothing = "scene: nothing in it shines: no light, no shape with an emission, no medium that emits";
    assert_eq!(problem(""), nothing);
    assert_eq!(problem("lights: [Point(position: (0, 2, 0), intensity: 0)]"), nothing);
    assert_eq!(
        problem("media: { \"a\": Homogeneous(sigma_s: 1, emission: 1) }, lights: [Constant(1)]"),
        "medium `a`: `emission` is that of what absorbs, and `sigma_a` is 0 there; a `glow` needs none"
    );
    let unused = "media: { \"a\": Homogeneous(sigma_a: 1, emission: 1) }";
    assert_eq!(problem(unused), nothing);
    assert_eq!(
        problem("media: { \"fog\": Homogeneous(sigma_s: 1) }, outside: \"fog\", lights: [Constant(1)]"),
        "light 1 (Constant): comes from infinitely far away and does not reach into the medium `fog` around everything; instead of `outside`, let it be the interior of a body with a `Null` material, with `priority: -1` if that reaches into others"
    );
    assert_eq!(
        problem("media: { \"fog\": Homogeneous(sigma_a: (1, 0, 1), glow: 1) }, outside: \"fog\""),
        "scene, outside: the medium `fog` glows in a channel whose absorption is nothing beside its scattering: without an end it is infinitely bright"
    );
}

#[test]
fn problems_of_shapes_name_the_shape() {
    let cases = [
        (
            r#"name: "a", geometry: QUAD, material: "whit""#,
            "shape `a`: unknown material `whit`, known: `glass`, `null`, `white`",
        ),
        (
            r#"geometry: QUAD, material: "whit""#,
            "shape 1: unknown material `whit`, known: `glass`, `null`, `white`",
        ),
        (
            r#"name: "a", geometry: BALL, material: "glass", interior: "fgo""#,
            "shape `a`: unknown medium `fgo`, known: `fog`",
        ),
        (
            r#"name: "a", geometry: BALL, material: "white", interior: "fog""#,
            "shape `a`: the material `white` is opaque, so that there is no interior for `fog`",
        ),
        (
            r#"name: "a", geometry: QUAD, material: "glass""#,
            "shape `a`: the material `glass` bounds a body, but a quad is not closed: a pane is a `Box` as thick as it is",
        ),
        (
            r#"name: "a", geometry: QUAD, material: "null", interior: "fog""#,
            "shape `a`: the material `null` bounds a body, but a quad is not closed: a pane is a `Box` as thick as it is",
        ),
        (
            r#"name: "a", geometry: BALL, material: "null", emission: 1"#,
            "shape `a`: has an emission, but light passes its material `null`; use an opaque one",
        ),
        (
            r#"name: "a", geometry: Quad(origin: (0, 0, 0), edge_u: (1, 0, 0), edge_v: (2, 0, 0)), material: "white""#,
            "shape `a`: a quad has no extent",
        ),
        (
            r#"name: "a", geometry: Box(min: (0, 0, 0), max: (1, 0, 1)), material: "white""#,
            "shape `a`: `min` [0, 0, 0] is not below `max` [1, 0, 1] on every axis",
        ),
        (
            r#"name: "a", geometry: Box(min: (-1, 1.5, -1), max: (1, 2.5, 1)), material: "white""#,
            "light 1 (Point): lies inside of the opaque shape `a`, and the camera does not",
        ),
        (
            r#"name: "a", geometry: Box(min: (-1, 0, 3), max: (1, 2, 5)), material: "white""#,
            "camera: lies inside of the opaque shape `a`, and nothing that shines does",
        ),
        (
            r#"name: "a", geometry: BALL, material: "glass"),
               (name: "basin", geometry: Box(min: (-1.5, -1.5, -1.5), max: (1.5, 1.5, 1.5)), material: "white""#,
            "shape `a`: lies inside of the opaque shape `basin`: it would be nowhere (a basin is made of quads)",
        ),
        (
            r#"name: "lamp", geometry: BALL, material: "white", emission: 1),
               (name: "a", geometry: Box(min: (-1.5, -1.5, -1.5), max: (1.5, 1.5, 1.5)), material: "white""#,
            "shape `lamp`: lies inside of the opaque shape `a`, and the camera does not",
        ),
    ];
    for (shape, expected) in cases {
        let shape = shape
            .replace("QUAD", "Quad(origin: (0, 0, 0), edge_u: (1, 0, 0), edge_v: (0, 1, 0))")
            .replace("BALL", "Sphere(centre: (0, 0, 0), radius: 1)");
        assert_eq!(problem(&format!("{MATERIALS} {LIGHT} shapes: [({shape})]")), expected);
    }
}

/// The corners of a quad come out of the ball, and the point of a needle.
#[test]
fn lamps_that_come_out_of_an_opaque_shape_are_seen() {
    let loads = |lamp: &str| {
        let text = format!(
            "(version: 1, {CAMERA} {MATERIALS} shapes: [
               (name: \"ball\", geometry: Sphere(centre: (0, 0, 0), radius: 1), material: \"white\"),
               (geometry: {lamp}, material: \"white\", emission: 5)])"
        );
        ReadyScene::from_ron_str(&text, "").is_ok()
    };
    let quad = |half: f32| {
        let side = 2.0 * half;
        format!("Quad(origin: (-{half}, -{half}, 0), edge_u: ({side}, 0, 0), edge_v: (0, {side}, 0))")
    };
    assert!(loads(&quad(0.9)));
    assert!(!loads(&quad(0.7)));
    let needle = |length: f32| {
        format!("Mesh(positions: [(0, 0, 0), (0.1, 0, 0), ({length}, {length}, 0)], indices: [(0, 1, 2)])")
    };
    assert!(loads(&needle(0.8)));
    assert!(!loads(&needle(0.7)));
    // Its box comes out of the ball, the lamp does not.
    for radius in [0.7, 0.99] {
        assert!(!loads(&format!("Sphere(centre: (0, 0, 0), radius: {radius})")));
    }
}

/// Of an opaque sphere of radius 2 that the camera is in, and what else there is.
#[test]
fn a_room_may_be_a_closed_shape() {
    let room = |shapes: &str, rest: &str| {
        let text = format!(
            r#"(version: 1, camera: Perspective(origin: (0, 0, 1), target: (0, 0, 0), fov_degrees: 40), {MATERIALS}
                shapes: [(name: "room", geometry: Sphere(centre: (0, 0, 0), radius: 2), material: "white"), {shapes}], {rest})"#
        );
        let text = text.replace("sigma_s: 1", "glow: 1");
        ReadyScene::from_ron_str(&text, "").map(drop).map_err(|error| error.to_string())
    };
    let light = |y: f32| format!("lights: [Point(position: (0, {y:?}, 0), intensity: 1)]");
    let ball = |y: f32, material: &str| {
        format!(
            r#"(name: "ball", geometry: Sphere(centre: (0, {y:?}, 0), radius: 0.1), material: {material}),"#
        )
    };
    assert_eq!(room("", &light(1.0)), Ok(()));
    assert_eq!(room(&ball(1.0, r#""white", emission: 1"#), ""), Ok(()));
    assert_eq!(room(&ball(0.0, r#""glass""#), &light(1.0)), Ok(()));
    // A lamp in its wall, and fog that glows.
    let lamp = r#"(geometry: Quad(origin: (-0.5, 1.9, -0.5), edge_u: (1, 0, 0), edge_v: (0, 0, 1)), material: "white", emission: 1)"#;
    assert_eq!(room(lamp, ""), Ok(()));
    let fog = |y: f32| room(&ball(y, r#""null", interior: "fog""#), "").map_err(|_| ());
    assert_eq!((fog(0.0), fog(3.0)), (Ok(()), Err(())));
    let nothing = Err("1 problem in the scene
  camera: lies inside of the opaque shape `room`, and nothing that shines does"
        .to_owned());
    assert_eq!(room("", &light(3.0)), nothing);
    assert_eq!(room("", "lights: [Constant(1)]"), nothing);
    assert_eq!(room(&ball(3.0, r#""white", emission: 1"#), ""), nothing);
    // A light that the camera does not share a room with is no harm outside of it, but in another.
    let both = "lights: [Point(position: (0, 1, 0), intensity: 1), Constant(1)]";
    assert_eq!(room("", both), Ok(()));
    assert_eq!(
        room(&ball(1.0, r#""white""#), &light(1.0)).unwrap_err(),
        "1 problem in the scene
  light 1 (Point): lies inside of the opaque shape `ball`, and the camera does not"
    );
}

#[test]
fn a_lamp_wound_inside_out_is_refused_unless_the_camera_is_inside() {
    let lamp = |indices: &str, scale: f32| {
        problem(&format!(
            r#"{MATERIALS} {LIGHT} shapes: [(name: "lamp", material: "white", emission: 1, geometry: Mesh(
                positions: [(-1, -1, -1), (3, -1, -1), (-1, 3, -1), (-1, -1, 3)], indices: [{indices}], scale: {scale:?}))]"#
        ))
    };
    let inwards = "(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)";
    assert_eq!(
        lamp(inwards, 0.1),
        "shape `lamp`: the triangles are wound the wrong way round: it shines on the side of its normals, which must point out of it"
    );
    assert_eq!(
        lamp("(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 3, 2)", 0.1),
        "shape `lamp`: has an emission, but some triangles are wound the other way round than those next to them, at 3 edges, one of them from [3, -1, -1] to [-1, 3, -1]"
    );
    let text = format!(
        r#"(version: 1, {CAMERA} {MATERIALS} shapes: [(material: "white", emission: 1, geometry: Mesh(
            positions: [(-1, -1, -1), (3, -1, -1), (-1, 3, -1), (-1, -1, 3)], indices: [{inwards}], scale: 10))])"#
    );
    assert!(ReadyScene::from_ron_str(&text, "").is_ok());
}

#[test]
fn pixels_narrower_than_directions_are_refused() {
    let camera = |degrees: &str, width: u32| {
        error(&format!(
            "(version: 1, camera: Perspective(origin: (0, 1, 4), target: (0, 1, 0), fov_degrees: {degrees}),
              film: (width: {width}, height: 4), lights: [])"
        ))
    };
    let narrow = "camera: `fov_degrees` over the width of the film makes pixels 3.4e-8 radians wide, expected at least 4.8e-7: narrower ones are lost in single precision";
    assert!(camera("0.001", 512).contains(narrow), "{}", camera("0.001", 512));
    assert!(!camera("0.001", 8).contains("camera"));
    assert!(!camera("0.05", 512).contains("camera"));
}

#[test]
fn scenes_in_which_light_from_infinity_has_no_density_are_refused() {
    let scene = |radius: &str, light: &str| {
        let text = format!(
            "(version: 1, {CAMERA} materials: {{\"white\": Lambert(0.5)}}, lights: [{light}],
              shapes: [(material: \"white\", geometry: Sphere(centre: (0, 0, 0), radius: {radius}))])"
        );
        ReadyScene::from_ron_str(&text, "").map(|_| ()).map_err(|error| error.to_string())
    };
    for light in ["Constant(1)", "Directional(direction: (0, -1, 0), irradiance: 1)"] {
        let error = scene("1e-20", light).unwrap_err();
        let message = "too small or too large for light from infinity";
        assert!(error.contains("scene: has a radius of 1.0") && error.contains(message), "{error}");
        assert_eq!(scene("1e-15", light), Ok(()));
    }
    assert_eq!(scene("1e-20", "Point(position: (0, 2, 0), intensity: 1)"), Ok(()));
}

#[test]
fn a_body_that_another_hides_is_refused() {
    let outer = ["Box(min: (-1, -1, -1), max: (1, 1, 1))", "Sphere(centre: (0, 0, 0), radius: 1)"];
    let cases = [
        (outer[0], "Box(min: (-1, -1, -0.5), max: (0.5, 0.5, 0.5))", 1, true),
        (outer[0], "Box(min: (-1.1, -1, -0.5), max: (0.5, 0.5, 0.5))", 1, false),
        (outer[0], "Sphere(centre: (0, 0, 0), radius: 0.5)", 1, true),
        (outer[1], "Sphere(centre: (0.5, 0, 0), radius: 0.5)", 1, true),
        (outer[1], "Sphere(centre: (0.6, 0, 0), radius: 0.5)", 1, false),
        (outer[1], "Box(min: (0, 0, 0), max: (0.5, 0.5, 0.5))", 1, true),
        (outer[1], "Box(min: (0, 0, 0), max: (0.9, 0.5, 0.5))", 1, false),
        // Without a number the smaller one counts.
        (outer[0], "Box(min: (-1, -1, -0.5), max: (0.5, 0.5, 0.5))", 0, false),
    ];
    for (outer, inner, priority, refused) in cases {
        let text = format!(
            r#"(version: 1, {CAMERA} {MATERIALS} {LIGHT} shapes: [
                (name: "vessel", geometry: {outer}, material: "glass", priority: {priority}),
                (name: "water", geometry: {inner}, material: "null", interior: "fog")])"#
        );
        match ReadyScene::from_ron_str(&text, "") {
            Ok(_) => assert!(!refused, "{outer} {inner}"),
            Err(error) => {
                let expected = "shape `water`: lies inside of shape `vessel`, whose priority 1 is higher than its own 0: it would be nowhere";
                assert!(refused && error.to_string().ends_with(expected), "{outer} {inner}: {error}");
            }
        }
    }
}

#[test]
fn problems_of_meshes_name_the_triangle() {
    const CORNERS: &str = "positions: [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (2, 0, 0)]";
    let cases = [
        ("", "white", "needs a `file`, or `positions` and `indices`"),
        ("CORNERS", "white", "needs a `file`, or `positions` and `indices`"),
        ("file: \"x.obj\", CORNERS", "white", "has a `file` as well as triangles of its own"),
        ("CORNERS, indices: [(0, 1, 2), (0, 1, 4)]", "white", "triangle 1 has no area"),
        (
            "CORNERS, indices: [(0, 1, 5)]",
            "white",
            "triangle 0 has corners [0, 1, 5], but there are 5 positions",
        ),
        (
            "CORNERS, indices: [(0, 1, 2)], normals: [(0, 0, 1)]",
            "white",
            "a mesh of 5 positions has 1 normals",
        ),
        (
            "CORNERS, indices: [(0, 1, 2), (0, 4, 2)], scale: 1e12, translate: (1, 1, 1)",
            "white",
            "triangle 1: expected finite coordinates between -1e12 and 1e12, found (2e12, 1, 1)",
        ),
        (
            "CORNERS, indices: [(0, 1, 2)], scale: 1e-20, translate: (1, 1, 1)",
            "white",
            "a placed mesh has no extent",
        ),
        (
            "CORNERS, indices: [(0, 1, 2)], rotate: [(axis: (1, 0, 0), degrees: 9), (axis: (0, 0, 0), degrees: 9)]",
            "white",
            "rotation 2: its axis has no direction",
        ),
        (
            "CORNERS, indices: [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)]",
            "glass",
            "the triangles are wound the wrong way round: normals must point out of the body",
        ),
        (
            "CORNERS, indices: [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 3, 2)]",
            "glass",
            "the material `glass` bounds a body, but some triangles are wound the other way round than those next to them, at 3 edges, one of them from [1, 0, 0] to [0, 1, 0]",
        ),
        (
            "CORNERS, indices: [(0, 2, 1), (0, 1, 3), (0, 3, 2)]",
            "glass",
            "the material `glass` bounds a body, but the mesh is not closed: only one triangle is at 3 edges, one of them from [1, 0, 0] to [0, 1, 0]",
        ),
    ];
    for (mesh, material, expected) in cases {
        let mesh = mesh.replace("CORNERS", CORNERS);
        let rest = format!(
            "{MATERIALS} {LIGHT} shapes: [(name: \"m\", geometry: Mesh({mesh}), material: \"{material}\")]"
        );
        assert_eq!(problem(&rest), format!("shape `m`: {expected}"));
    }
    let rest =
        format!("{MATERIALS} {LIGHT} shapes: [(geometry: Mesh(file: \"x.obj\"), material: \"white\")]");
    assert!(problem(&rest).starts_with("shape 1: mesh `no_such_folder/x.obj`: "));
}

#[test]
fn problems_of_lights_materials_and_film_name_them() {
    let lights =
        |light: &str| problem(&format!("lights: [Point(position: (0, 2, 0), intensity: 1), {light}]"));
    let cases = [
        (
            "Spot(position: (0, 0, 0), intensity: 1, cutoff_degrees: 20)",
            "needs either `target` or `direction`",
        ),
        (
            "Spot(position: (0, 0, 0), target: (1, 0, 0), direction: (1, 0, 0), intensity: 1, cutoff_degrees: 20)",
            "has both `target` and `direction`: expected one",
        ),
        (
            "Spot(position: (0, 0, 0), target: (0, 0, 0), intensity: 1, cutoff_degrees: 20)",
            "`position` and `target` are the same point",
        ),
        (
            "Spot(position: (0, 0, 0), direction: (0, 1, 0), intensity: 1, beam_degrees: 30, cutoff_degrees: 20)",
            "`beam_degrees` 30 is more than `cutoff_degrees` 20",
        ),
    ];
    for (light, expected) in cases {
        assert_eq!(lights(light), format!("light 2 (Spot): {expected}"));
    }
    let directional = lights("Directional(direction: (0, 0, 0), irradiance: 1)");
    assert_eq!(directional, "light 2 (Directional): `direction` is zero");
    let image = lights("Image(file: \"sky.exr\")");
    let expected = "light 2 (Image): image `no_such_folder/sky.exr` cannot be read as an OpenEXR image";
    assert!(image.starts_with(expected), "{image}");
    let phong = "materials: { \"a\": Phong(diffuse: 0.7, specular: 0.5, exponent: 10) }";
    assert_eq!(
        problem(&format!("{LIGHT} {phong}")),
        "material `a`: `diffuse` and `specular` reflect 1.2 in one channel, expected at most 1"
    );
    let crop = "film: (width: 64, height: 64, crop: (x: 60, y: 0, width: 8, height: 8))";
    let outside = "film: the crop ends at (68, 8), outside of the 64 x 64 pixels";
    assert_eq!(problem(&format!("{LIGHT} {crop}")), outside);
    assert_eq!(
        problem(&format!("{LIGHT} outside: \"fog\"")),
        "scene, outside: unknown medium `fog`; there are none"
    );
    // No complaint of darkness where the medium that shines is among others.
    let media = r#"media: {"a": Homogeneous(phase: TableFile(file: "none.txt")), "b": Homogeneous(sigma_a: 1, emission: 1)},
        materials: {"null": Null},
        shapes: [(geometry: Sphere(centre: (0, 0, 0), radius: 1), material: "null", interior: "b")],"#;
    let found = problem(media);
    assert!(found.starts_with("medium `a`: table `no_such_folder/none.txt`: "), "{found}");
}

#[test]
fn all_problems_are_reported_at_once() {
    let text = format!(
        r#"(version: 1, camera: Perspective(origin: (0, 0, 0), target: (0, 1, 0), fov_degrees: 40), {MATERIALS}
            outside: "steam",
            shapes: [
              (name: "floor", geometry: Quad(origin: (0, 0, 0), edge_u: (0, 0, 0), edge_v: (0, 1, 0)), material: "wood"),
              (geometry: Sphere(centre: (0, 0, 0), radius: 1), material: "white"),
            ])"#
    );
    let expected = "5 problems in the scene
  scene, outside: unknown medium `steam`, known: `fog`
  camera: `up` is zero or along the direction of view
  shape `floor`: a quad has no extent
  shape `floor`: unknown material `wood`, known: `glass`, `null`, `white`
  scene: nothing in it shines: no light, no shape with an emission, no medium that emits";
    assert_eq!(error(&text), expected);
}

/// None of these scenes would be refused if it was read to its end.
#[cfg(unix)]
#[test]
fn devices_and_pipes_are_refused() {
    let pipe = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("pipe-{}", std::process::id()));
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for path in ["/dev/zero", "/dev/urandom", pipe.to_str().unwrap()] {
        let expected = "expected a regular file, found a device, a pipe or a socket";
        let mesh =
            format!("{MATERIALS} {LIGHT} shapes: [(geometry: Mesh(file: \"{path}\"), material: \"white\")]");
        assert_eq!(problem(&mesh), format!("shape 1: mesh `{path}`: {expected}"));
        let image = problem(&format!("lights: [Image(file: \"{path}\")]"));
        assert!(image.starts_with("light 1 (Image): ") && image.ends_with(expected), "{image}");
        let scene = ReadyScene::load(path).unwrap_err();
        assert_eq!(scene.to_string(), format!("{path}: cannot be read"));
        assert_eq!(std::error::Error::source(&scene).unwrap().to_string(), expected);
    }
    std::fs::remove_file(&pipe).unwrap();
}

#[test]
fn meshes_that_are_none_are_refused_by_line() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("meshes-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let read = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.join(name), bytes).unwrap();
        let rest =
            format!("{MATERIALS} {LIGHT} shapes: [(geometry: Mesh(file: \"{name}\"), material: \"white\")]");
        ReadyScene::from_ron_str(&format!("(version: 1, {CAMERA} {rest})"), &folder)
    };
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let marked = read("marked.obj", format!("\u{feff}{corners}f 1 2 3\n").as_bytes());
    assert!(marked.is_ok(), "{}", marked.unwrap_err());
    let garbage = read("garbage.obj", b"v 0 0 0\n\x8f\x12garbage").unwrap_err().to_string();
    assert!(garbage.contains("garbage.obj`: line 2: expected a statement about polygons"), "{garbage}");
    let points = read("points.obj", corners.as_bytes()).unwrap_err().to_string();
    assert!(points.ends_with("points.obj`: line 3: the file ends without a face (`f`)"), "{points}");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn files_of_other_formats_are_told_from_broken_ones() {
    let mesh = |name: &str| {
        problem(&format!(
            "{MATERIALS} {LIGHT} shapes: [(geometry: Mesh(file: \"{name}\"), material: \"white\")]"
        ))
    };
    for (name, format) in [
        ("bunny.ply", "PLY"),
        ("bunny.STL", "STL"),
        ("bunny.gltf", "glTF"),
        ("bunny.glb", "GLB"),
        ("bunny.fbx", "FBX"),
    ] {
        let expected = format!(
            "shape 1: mesh `no_such_folder/{name}`: meshes are Wavefront OBJ files, not {format}: export it as \
             OBJ, with normals"
        );
        assert_eq!(mesh(name), expected);
    }
    assert!(!mesh("bunny.ply.obj").contains("Wavefront"));

    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("formats-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let image = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.join(name), bytes).unwrap();
        let text = format!("(version: 1, {CAMERA} lights: [Image(file: \"{name}\")])");
        let Err(error) = ReadyScene::from_ron_str(&text, &folder) else { panic!("a sky: {name}") };
        error
            .to_string()
            .contains("is a Radiance picture, and skies are OpenEXR images: convert it to .exr first")
    };
    assert!(image("sky.hdr", b"") && image("sky.HDR", b"#?RADIANCE\n"));
    assert!(image("sky.exr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n") && image("sky.pic", b"#?RGBE\n"));
    assert!(!image("sky.png", b"\x89PNG\r\n\x1a\n") && !image("short.exr", b"#?"));
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn files_are_named() {
    let error = ReadyScene::load("no_such_folder/no_such_scene.ron").unwrap_err();
    assert!(matches!(error, SceneError::Read { .. }));
    assert_eq!(error.to_string(), "no_such_folder/no_such_scene.ron: cannot be read");
    let cause = std::error::Error::source(&error).expect("why it cannot be read");
    assert!(cause.is::<std::io::Error>(), "{cause}");
}
