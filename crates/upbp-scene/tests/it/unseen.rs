//! Notes about surfaces that are not seen.

use upbp_scene::ReadyScene;

/// The notes about a scene with shapes like these: name, material and other fields of each.
fn notes(shapes: &[(&str, &str, &str)]) -> Vec<String> {
    let materials = [
        ("white", "Lambert(0.5)"),
        ("glass", "Dielectric(1.5)"),
        ("air", "Dielectric(1)"),
        ("water", "Dielectric(1.33)"),
        ("null", "Null"),
    ];
    let used = |(name, _): &(&str, &str)| shapes.iter().any(|(_, material, _)| material == name);
    let materials = materials.into_iter().filter(used).map(|(name, value)| format!("\"{name}\": {value},"));
    let media = if shapes.iter().any(|(.., rest)| rest.contains("\"fog\"")) {
        "media: { \"fog\": Homogeneous(sigma_s: 1) },"
    } else {
        ""
    };
    let shapes = shapes
        .iter()
        .map(|(name, material, rest)| format!("(name: \"{name}\", material: \"{material}\", {rest}),"));
    let text = format!(
        "(version: 1, camera: Perspective(origin: (0, 0, 9), target: (0, 0, 0), fov_degrees: 30), {media}
          materials: {{ {} }}, shapes: [{}], lights: [Constant(1)])",
        materials.collect::<String>(),
        shapes.collect::<String>()
    );
    let scene = ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{error}\n{text}"));
    scene.notes().iter().map(ToString::to_string).collect()
}

fn ball(radius: f32) -> String {
    format!("geometry: Sphere(centre: (0, 0, 0), radius: {radius:?})")
}

fn cuboid(min: [f32; 3], max: [f32; 3]) -> String {
    let [[a, b, c], [d, e, f]] = [min, max];
    format!("geometry: Box(min: ({a:?}, {b:?}, {c:?}), max: ({d:?}, {e:?}, {f:?}))")
}

#[test]
fn a_hollow_of_the_same_glass_is_noted() {
    let (outer, inner) = (ball(1.0), ball(0.9));
    let note = "shape `hollow`: has the index of refraction of shape `globe` around it, so that nothing is seen \
                of its surface: air or gas inside of glass is `Dielectric(1)`, and what bounds a medium alone is \
                `Null`";
    let hollow = |material: &str, rest: &str| {
        notes(&[("globe", "glass", &outer), ("hollow", material, &format!("{inner}, {rest}"))])
    };
    assert_eq!(hollow("glass", ""), [note]);
    assert!(hollow("air", "").is_empty());
    assert!(hollow("null", "").is_empty());
    // Its medium is seen: but gas in a tube is not meant to have the index of the glass.
    assert_eq!(hollow("glass", "interior: \"fog\""), [note]);
    // In tinted glass there is a medium that it does not have.
    let tinted = format!("{outer}, interior: \"fog\"");
    assert_eq!(notes(&[("hollow", "glass", &inner), ("globe", "glass", &tinted)]), [note]);
    // The hollow of a hollow is glass in air.
    let shapes = [("globe", "glass", &*outer), ("hollow", "air", &inner), ("bulb", "glass", &ball(0.3))];
    assert!(notes(&shapes).is_empty());
    let half = "geometry: Sphere(centre: (0.9, 0, 0), radius: 0.5)";
    assert!(notes(&[("globe", "glass", &outer), ("half out", "glass", half)]).is_empty());
    let two = [("globe", "glass", &*outer), ("hollow", "glass", &inner), ("b", "glass", &ball(0.3))];
    assert_eq!(notes(&two), [format!("{note} (and so has 1 other)")]);
}

#[test]
fn walls_between_bodies_too_thin_to_be_seen_are_noted() {
    let spheres = |radius: f32| notes(&[("ball", "glass", &ball(1.0)), ("core", "water", &ball(radius))]);
    assert!(spheres(0.9999).is_empty());
    assert!(spheres(1.0).is_empty());
    let [note] = &spheres(0.999_997)[..] else { panic!("one note") };
    assert!(note.starts_with("shape `core`: the wall of shape `ball` around it is 0.00000"), "{note}");
    assert!(note.contains("thick, and is not seen at coordinates up to 1"), "{note}");
    let tank = |far: f32, top: f32| {
        let glass = cuboid([far, 0.0, 0.0], [far + 1.0, 1.0, 1.0]);
        let water = cuboid([far + 0.01, 0.01, 0.01], [far + 0.99, top, 0.99]);
        let ground = "geometry: Quad(origin: (0, -0.5, -1), edge_u: (0, 0, 2), edge_v: (1000, 0, 0))";
        notes(&[("tank", "glass", &glass), ("water", "water", &water), ("ground", "white", ground)])
    };
    // Faces may coincide.
    assert!(tank(0.0, 1.0).is_empty());
    assert!(tank(500.0, 0.99).is_empty());
    assert!(tank(0.0, 0.999).is_empty());
    assert_eq!(tank(500.0, 0.999).len(), 1);
}

#[test]
fn fog_that_takes_the_surface_of_water_away_is_noted() {
    let water = cuboid([-9.0, -3.0, -9.0], [9.0, 0.0, 9.0]);
    let fog = |bottom: f32, rest: &str| {
        let fog = cuboid([-5.0, bottom, -5.0], [5.0, 2.0, 5.0]);
        let fog = format!("{fog}, interior: \"fog\", {rest}");
        notes(&[("fog", "null", &fog), ("water", "water", &water)])
    };
    assert_eq!(
        fog(-0.5, ""),
        ["shape `fog`: reaches out of shape `water` and counts more, so that the surface of that is not \
          seen inside of it: fog over water has `priority: -1`"]
    );
    assert!(fog(-0.5, "priority: -1").is_empty());
    // It rests on the water, or is above it.
    assert!(fog(0.0, "").is_empty());
    assert!(fog(0.5, "").is_empty());
    // It is all in the water, to its bottom and sides.
    for [half, bottom] in [[5.0, -2.0], [9.0, -3.0]] {
        let inside = cuboid([-half, bottom, -half], [half, 0.0, half]) + ", interior: \"fog\"";
        assert!(notes(&[("fog", "null", &inside), ("water", "water", &water)]).is_empty(), "{half}");
    }
    let in_ball = ball(1.0) + ", interior: \"fog\"";
    assert!(notes(&[("fog", "null", &in_ball), ("ball", "glass", &ball(1.0))]).is_empty());
    // A patch that reaches into a small part of the surface.
    let patch = "geometry: Sphere(centre: (0.1, 0, 0), radius: 0.5), interior: \"fog\"";
    assert_eq!(notes(&[("fog", "null", patch), ("water", "water", &water)]).len(), 1);
}

#[test]
fn quads_in_the_plane_of_what_comes_before_them_are_noted() {
    let floor = "geometry: Quad(origin: (-4, 0, -4), edge_u: (0, 0, 8), edge_v: (8, 0, 0))";
    let rug = |y: f32, width: f32| {
        format!("geometry: Quad(origin: (-1, {y:?}, -1), edge_u: (0, 0, 2), edge_v: ({width:?}, 0, 0))")
    };
    let on_floor = |rug: &str| notes(&[("floor", "white", floor), ("rug", "white", rug)]);
    let note = "shape `rug`: lies in the plane of shape `floor`, which comes before it and hides it, in whole or \
                in patches: move it a little off that plane";
    assert_eq!(on_floor(&rug(0.0, 2.0)), [note]);
    assert!(on_floor(&rug(0.001, 2.0)).is_empty());
    assert!(on_floor(&rug(0.0, 6.0)).is_empty(), "it is in part beside the floor");
    assert!(on_floor(&(rug(0.0, 2.0) + ", emission: 1")).is_empty(), "lamps are seen");
    assert!(notes(&[("rug", "white", &rug(0.0, 2.0)), ("floor", "white", floor)]).is_empty());
    let slab = cuboid([-4.0, -1.0, -4.0], [4.0, 0.0, 4.0]);
    assert_eq!(notes(&[("floor", "white", &slab), ("rug", "white", &rug(0.0, 2.0))]), [note]);
    // What is inside of glass is not in its plane.
    assert!(notes(&[("floor", "glass", &slab), ("rug", "white", &rug(0.0, 2.0))]).is_empty());
    let wall = "geometry: Quad(origin: (0, 0, 0), edge_u: (3, 1, 0), edge_v: (0, 2, 5))";
    let picture = "geometry: Quad(origin: (0.6, 0.4, 0.5), edge_u: (1.5, 0.5, 0), edge_v: (0, 1, 2.5))";
    assert_eq!(notes(&[("wall", "white", wall), ("picture", "white", picture)]).len(), 1);
}
