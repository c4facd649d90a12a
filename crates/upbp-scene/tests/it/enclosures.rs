//! Lights and the lens that surfaces all around bodies hide.

use glam::Vec3;
use proptest::prelude::*;
use upbp_estimators::PreparedScene;
use upbp_estimators::path::{Target, clear_edge};
use upbp_estimators::scene::{Camera as _, Emitter as _, EmitterId, EmitterKind, PathEnd, Scene};
use upbp_media::MediumId;
use upbp_scene::ReadyScene;

/// A scene with these shapes and lights on a wide ground, seen from some place.
fn scene(eye: &str, shapes: &str, lights: &str) -> ReadyScene {
    let text = format!(
        "(version: 1, camera: Perspective(origin: {eye}, target: (0, 0.1, 0.2), fov_degrees: 30),
          media: {{ \"milk\": Homogeneous(sigma_s: 100), \"haze\": Homogeneous(sigma_s: 0.001),
                    \"glow\": Homogeneous(sigma_s: 100, glow: 1) }},
          materials: {{ \"black\": Lambert(0), \"liquid\": Dielectric(1.35), \"glass\": Dielectric(1.5),
                        \"null\": Null }},
          shapes: [
            (geometry: Quad(origin: (-50, -3, -50), edge_u: (0, 0, 100), edge_v: (100, 0, 0)), material: \"black\"),
            {shapes}
          ],
          lights: [{lights}])"
    );
    ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn ball(radius: f32, x: f32, rest: &str) -> String {
    format!("(geometry: Sphere(centre: ({x:?}, 0, 0), radius: {radius:?}), {rest}),")
}

/// A pyramid of glass, twice, with its tip up and down.
const CRYSTAL: &str = "(geometry: Mesh(
    positions: [(1, 0, 0), (0, 0, -1), (-1, 0, 0), (0, 0, 1), (0, 1, 0), (0, -1, 0)],
    indices: [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4), (1, 0, 5), (2, 1, 5), (3, 2, 5), (0, 3, 5)]),
  material: \"liquid\", interior: \"milk\"),";

/// A ball of ice.
const ICE: &str = "(geometry: Sphere(centre: (0, 2, 0), radius: 0.5), material: \"liquid\", priority: 1),";

/// A square lamp of a tenth.
fn lamp(x: f32, y: f32) -> String {
    format!(
        "(geometry: Quad(origin: ({x:?}, {y:?}, 0), edge_u: (0.1, 0, 0), edge_v: (0, 0, 0.1)),
          material: \"black\", emission: 1),"
    )
}

#[test]
fn milk_hides_what_is_out_of_it_and_the_rest_what_is_in_it_unless_a_cloud_reaches_out() {
    const FAR: &str = "(0, 0, 9)";
    const OPEN: [bool; 4] = [false; 4];
    // All lights and the lens, from the milk; the last light and the lens, from outside.
    const EMPTY: [bool; 4] = [true, true, false, false];
    const LIT: [bool; 4] = [false, true, true, false];
    const LIT_PERHAPS: [bool; 4] = [false, true, false, false];
    const SEEN: [bool; 4] = [true, false, false, true];
    const LIT_IN_ICE: [bool; 4] = [true, true, true, false];
    let milk = ball(1.0, 0.0, "material: \"liquid\", interior: \"milk\"");
    let haze = "(geometry: Box(min: (-9, -3, -9), max: (9, 9, 9)), material: \"null\", interior: \"haze\"),";
    let ice = ball(0.3, 0.2, "material: \"glass\"");
    let cube =
        "(geometry: Box(min: (-1, -1, -1), max: (1, 1, 1)), material: \"liquid\", interior: \"milk\"),";
    let cloud = |priority: i32| {
        ball(0.4, 0.9, &format!("material: \"null\", interior: \"haze\", priority: {priority}"))
    };
    let glowing = ball(1.0, 0.0, "material: \"liquid\", interior: \"glow\"");
    let point = |x: f32, y: f32| format!("Point(position: ({x:?}, {y:?}, 0), intensity: 1)");
    for (what, eye, shapes, lights, is_enclosed, expected) in [
        ("alone", FAR, milk.clone(), String::new(), true, EMPTY),
        ("in haze", FAR, milk.clone() + haze, String::new(), true, EMPTY),
        ("with ice", FAR, milk.clone() + &ice, String::new(), true, EMPTY),
        ("a cloud above it", FAR, milk.clone() + &cloud(0), String::new(), false, OPEN),
        ("a cloud below it", FAR, milk.clone() + &cloud(-1), String::new(), true, EMPTY),
        ("a lamp", FAR, milk.clone() + &lamp(0.0, 0.5), String::new(), true, LIT),
        ("a lamp in a cube", FAR, lamp(0.8, -0.9) + cube, String::new(), true, LIT),
        ("a lamp in a crystal", FAR, lamp(0.2, 0.2) + CRYSTAL, String::new(), true, LIT),
        ("a lamp out of a crystal", FAR, lamp(0.42, 0.45) + CRYSTAL, String::new(), true, OPEN),
        ("a lamp beside a crystal", FAR, lamp(0.7, 0.7) + CRYSTAL, String::new(), true, LIT_PERHAPS),
        ("a lamp that reaches out", FAR, milk.clone() + &lamp(0.95, 0.0), String::new(), true, OPEN),
        ("a lamp in ice", FAR, milk.clone() + &ice + &lamp(0.2, 0.0), String::new(), true, LIT_IN_ICE),
        ("a point", FAR, milk.clone(), point(0.0, 0.5), true, LIT),
        ("a point below a cloud", FAR, milk.clone() + &cloud(0), point(0.0, 0.5), false, OPEN),
        ("a point near ice", FAR, milk.clone() + &ice, point(0.0, 0.25), true, LIT_PERHAPS),
        ("the lens", "(0, 0.5, 0)", milk.clone(), String::new(), true, SEEN),
        ("a point in its surface", FAR, milk.clone(), point(0.0, 1.0), true, OPEN),
        ("the lens in its surface", "(0.6, 0.8, 0)", milk.clone(), String::new(), true, OPEN),
        ("the same and a point", "(0.6, 0.8, 0)", milk.clone(), point(0.0, 0.5), true, OPEN),
        ("the lens and a point in the surface", "(0, 0.5, 0)", milk.clone(), point(0.0, 1.0), true, OPEN),
        ("glowing", FAR, glowing, String::new(), true, LIT),
        (
            "index-matched",
            FAR,
            ball(1.0, 0.0, "material: \"null\", interior: \"milk\""),
            point(0.0, 0.5),
            false,
            OPEN,
        ),
    ] {
        let scene = scene(eye, &shapes, &format!("Constant(1), {lights}"));
        let inside = scene.stack_at(Vec3::new(-0.5, 0.0, 0.0)).top().expect("a body");
        let last = PathEnd::Light(EmitterId(scene.emitters().len() as u32 - 1));
        let hides = [
            scene.hides(Some(inside.body), PathEnd::Lights),
            scene.hides(Some(inside.body), PathEnd::Lens),
            scene.hides(None, last),
            scene.hides(None, PathEnd::Lens),
        ];
        assert_eq!(hides, expected, "{what}");
        let medium = inside.medium.expect("a medium");
        let extent = scene.medium_extent(medium);
        assert_eq!(extent < 4.0, is_enclosed, "{what}: {extent}");
        // A mean free path of a hundredth is short on the ground, not in the milk.
        let prepared = PreparedScene::new(&scene).expect("a valid scene");
        assert_eq!(prepared.is_dense(medium), !is_enclosed, "{what}");
    }
    let outside = scene(FAR, &(milk + haze), "Constant(1)");
    let haze = outside.stack_at(Vec3::new(5.0, 0.0, 0.0)).medium().expect("haze");
    let of_scene = outside.bounds().largest_coordinate();
    assert!(outside.medium_extent(haze) == of_scene && haze != MediumId(u32::MAX));
}

#[test]
fn all_is_dark_around_bulbs_unless_the_lens_is_in_some_surface() {
    let glass = |x: f32| ball(0.5, x, "material: \"glass\"");
    let lights = "Point(position: (0, 0, 0), intensity: 1), Point(position: (2, 0, 0), intensity: 1)";
    for (what, eye, shapes, lights, is_dark) in [
        ("two bulbs", "(0, 1, 8)", glass(0.0) + &glass(2.0), lights, true),
        ("a bulb and a lamp", "(0, 1, 8)", glass(0.0), lights, false),
        ("with a sky", "(0, 1, 8)", glass(0.0) + &glass(2.0), &format!("{lights}, Constant(1)"), false),
        // Paths that start there may miss other surfaces.
        ("the lens in ice", "(0, 2, 0.5)", glass(0.0) + &glass(2.0) + ICE, lights, false),
    ] {
        let haze =
            "(geometry: Box(min: (-9, -3, -9), max: (9, 9, 9)), material: \"null\", interior: \"haze\"),";
        let scene = scene(eye, &(shapes + haze), lights);
        let body_at = |point: [f32; 3]| scene.stack_at(point.into()).top().map(|top| top.body);
        assert_eq!(body_at([0.0, 0.0, 20.0]), None);
        for around in [[0.0, 0.0, 20.0], [0.0, 1.0, 0.0]] {
            assert_eq!(scene.hides(body_at(around), PathEnd::Lights), is_dark, "{what}, {around:?}");
        }
        let [first, second] = [0, 1].map(|light| PathEnd::Light(EmitterId(light)));
        let bulb = body_at([0.2, 0.0, 0.0]);
        assert!(!scene.hides(bulb, PathEnd::Lights) && !scene.hides(bulb, first), "{what}");
        assert!(scene.hides(bulb, second), "{what}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]
    /// As connections see it: however bodies overlap, no line leads to what is hidden.
    #[test]
    fn what_is_hidden_is_not_seen(
        bodies in prop::collection::vec(([-1.0_f32..1.0, -1.0..1.0, -1.0..1.0], 0.1_f32..1.0, 0..5, -1..2), 1..7),
        points in prop::collection::vec([-1.5_f32..1.5, -1.5..1.5, -1.5..1.5], 64),
        lamps in prop::collection::vec([-1.0_f32..1.0, -1.0..1.0, -1.0..1.0], 12),
        eye in [-1.5_f32..1.5, -1.5..1.5, -1.5..1.5],
        numbers in prop::collection::vec([0.0_f32..1.0, 0.0..1.0], 64),
    ) {
        let shape = |&([x, y, z], size, kind, priority): &([f32; 3], f32, i32, i32)| {
            let material = ["liquid", "glass", "glass", "null", "liquid"][kind as usize];
            let geometry = if kind == 1 {
                let [a, b, c] = [x, y, z].map(|centre| centre - size);
                let [d, e, f] = [x, y, z].map(|centre| centre + size);
                format!("Box(min: ({a:?}, {b:?}, {c:?}), max: ({d:?}, {e:?}, {f:?}))")
            } else {
                format!("Sphere(centre: ({x:?}, {y:?}, {z:?}), radius: {size:?})")
            };
            let medium = if kind == 4 { "glow" } else { "milk" };
            format!(
                "(geometry: {geometry}, material: \"{material}\", interior: \"{medium}\", priority: {priority}),"
            )
        };
        let shapes: String = bodies.iter().map(shape).collect();
        let light = |(place, [x, y, z]): (usize, &[f32; 3])| if place < 8 {
            (String::new(), format!("Point(position: ({x:?}, {y:?}, {z:?}), intensity: 1),"))
        } else {
            let ball = format!(
                "(geometry: Sphere(centre: ({x:?}, {y:?}, {z:?}), radius: 0.05), material: \"black\", emission: 1),"
            );
            (ball, String::new())
        };
        let (balls, lights): (String, String) = lamps.iter().enumerate().map(light).unzip();
        let text = format!(
            "(version: 1, camera: Perspective(origin: {eye:?}, target: (0, 0, 9), fov_degrees: 30),
              media: {{ \"milk\": Homogeneous(sigma_s: 100), \"glow\": Homogeneous(sigma_s: 1, glow: 1) }},
              materials: {{ \"liquid\": Dielectric(1.35), \"glass\": Dielectric(1.5), \"null\": Null,
                            \"black\": Lambert(0) }},
              shapes: [{shapes} {balls}], lights: [Constant(1), {lights}])"
        )
        .replace("origin: [", "origin: (")
        .replace("], target", "), target");
        // Bodies that are all inside of stronger ones, and lamps inside of others, are errors.
        let Ok(scene) = ReadyScene::from_ron_str(&text, "") else { return Ok(()) };
        let lens = scene.camera().ray(glam::Vec2::ZERO, [0.5; 2]).expect("a ray").origin;
        let mut crossings = Vec::new();
        let body_at = |point: Vec3| scene.stack_at(point).top().map(|top| top.body);
        let ends = (0..scene.emitters().len() as u32).map(EmitterId).map(PathEnd::Light);
        let ends: Vec<PathEnd> = ends.chain([PathEnd::Lens]).collect();
        for (point, number) in points.into_iter().map(Vec3::from).zip(numbers) {
            let (stack, body) = (scene.stack_at(point), body_at(point));
            let hides_all = ends.iter().all(|&end| end == PathEnd::Lens || scene.hides(body, end));
            prop_assert_eq!(scene.hides(body, PathEnd::Lights), hides_all);
            for &end in ends.iter().filter(|&&end| scene.hides(body, end)) {
                let target = match end {
                    PathEnd::Light(EmitterId(light)) => {
                        let light = &scene.emitters()[light as usize];
                        let Some(seen) = light.sample_incident(&scene.bounds(), point, number) else { continue };
                        let place = seen.point.position;
                        match light.kind() {
                            EmitterKind::Directional | EmitterKind::Environment => Target::Infinity(seen.towards_light),
                            EmitterKind::Point => Target::Pinpoint(place),
                            EmitterKind::Area => Target::Surface(place, seen.point.normal),
                            // Where another body counts, nothing shines.
                            EmitterKind::Volume(body) if body_at(place) != Some(body) => continue,
                            EmitterKind::Volume(_) => Target::Medium(place),
                        }
                    }
                    PathEnd::Lens | PathEnd::Lights => Target::Pinpoint(lens),
                };
                let edge = clear_edge::<_, f64>(&scene, &stack, point, &target, &mut crossings);
                prop_assert!(edge.is_none(), "{body:?} {point} {end:?} {target:?}\n{text}");
            }
        }
    }
}
