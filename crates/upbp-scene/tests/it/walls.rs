//! Bodies that no straight line leaves for a light or the lens without meeting a surface.

use glam::Vec3;
use proptest::prelude::*;
use upbp_estimators::PreparedScene;
use upbp_estimators::path::{Target, clear_edge};
use upbp_estimators::scene::{Camera as _, Scene};
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
          lights: [Constant(1), {lights}])"
    );
    ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn ball(radius: f32, x: f32, rest: &str) -> String {
    format!("(geometry: Sphere(centre: ({x:?}, 0, 0), radius: {radius:?}), {rest}),")
}

#[test]
fn milk_is_sealed_unless_light_or_the_lens_is_in_it_or_a_cloud_reaches_out() {
    const FAR: &str = "(0, 0, 9)";
    let milk = ball(1.0, 0.0, "material: \"liquid\", interior: \"milk\"");
    let haze = "(geometry: Box(min: (-9, -3, -9), max: (9, 9, 9)), material: \"null\", interior: \"haze\"),";
    let ice = ball(0.3, 0.2, "material: \"glass\"");
    let cloud = |priority: i32| {
        ball(0.4, 0.9, &format!("material: \"null\", interior: \"haze\", priority: {priority}"))
    };
    let lamp =
        "(geometry: Quad(origin: (0, 0.5, 0), edge_u: (0.1, 0, 0), edge_v: (0, 0, 0.1)), material: \"black\",
          emission: 1),";
    let glowing = ball(1.0, 0.0, "material: \"liquid\", interior: \"glow\"");
    let point = "Point(position: (0, 0.5, 0), intensity: 1)";
    for (what, eye, shapes, lights, is_sealed, has_walls) in [
        ("alone", FAR, milk.clone(), "", true, true),
        ("in haze", FAR, milk.clone() + haze, "", true, true),
        ("with ice", FAR, milk.clone() + &ice, "", true, true),
        ("a cloud above it", FAR, milk.clone() + &cloud(0), "", false, false),
        ("a cloud below it", FAR, milk.clone() + &cloud(-1), "", true, true),
        ("a lamp", FAR, milk.clone() + lamp, "", false, true),
        ("a point", FAR, milk.clone(), point, false, true),
        ("the lens", "(0, 0.5, 0)", milk.clone(), "", false, true),
        ("glowing", FAR, glowing, "", false, true),
        ("index-matched", FAR, ball(1.0, 0.0, "material: \"null\", interior: \"milk\""), "", false, false),
    ] {
        let scene = scene(eye, &shapes, lights);
        let inside = scene.stack_at(Vec3::new(-0.5, 0.0, 0.0)).top().expect("a body");
        assert_eq!(scene.is_sealed(inside.body), is_sealed, "{what}");
        let medium = inside.medium.expect("a medium");
        let extent = scene.medium_extent(medium);
        assert_eq!(extent < 4.0, has_walls, "{what}: {extent}");
        // A mean free path of a hundredth is short on the ground, not in the milk.
        let prepared = PreparedScene::new(&scene).expect("a valid scene");
        assert_eq!(prepared.is_dense(medium), !has_walls, "{what}");
    }
    let outside = scene(FAR, &(milk + haze), "");
    let haze = outside.stack_at(Vec3::new(5.0, 0.0, 0.0)).medium().expect("haze");
    assert!(outside.medium_extent(haze) == outside.bounds().radius && haze != MediumId(u32::MAX));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    /// As connections see it: however bodies overlap, nothing is seen from a sealed one.
    #[test]
    fn nothing_is_seen_from_sealed_bodies(
        bodies in prop::collection::vec(([-1.0_f32..1.0, -1.0..1.0, -1.0..1.0], 0.1_f32..1.0, 0..4, -1..2), 1..7),
        points in prop::collection::vec([-1.5_f32..1.5, -1.5..1.5, -1.5..1.5], 64),
        directions in prop::collection::vec([-1.0_f32..1.0, -1.0..1.0, -1.0..1.0], 64),
    ) {
        let shape = |&([x, y, z], size, kind, priority): &([f32; 3], f32, i32, i32)| {
            let material = ["liquid", "glass", "glass", "null"][kind as usize];
            let geometry = if kind == 1 {
                let [a, b, c] = [x, y, z].map(|centre| centre - size);
                let [d, e, f] = [x, y, z].map(|centre| centre + size);
                format!("Box(min: ({a:?}, {b:?}, {c:?}), max: ({d:?}, {e:?}, {f:?}))")
            } else {
                format!("Sphere(centre: ({x:?}, {y:?}, {z:?}), radius: {size:?})")
            };
            format!("(geometry: {geometry}, material: \"{material}\", interior: \"milk\", priority: {priority}),")
        };
        let shapes: String = bodies.iter().map(shape).collect();
        let text = format!(
            "(version: 1, camera: Perspective(origin: (0, 0, 9), target: (0, 0, 0), fov_degrees: 30),
              media: {{ \"milk\": Homogeneous(sigma_s: 100) }},
              materials: {{ \"liquid\": Dielectric(1.35), \"glass\": Dielectric(1.5), \"null\": Null }},
              shapes: [{shapes}], lights: [Constant(1)])"
        );
        // Bodies that are all inside of stronger ones are errors.
        let Ok(scene) = ReadyScene::from_ron_str(&text, "") else { return Ok(()) };
        let lens = scene.camera().ray(glam::Vec2::ZERO, [0.5; 2]).expect("a ray").origin;
        let mut crossings = Vec::new();
        for (point, direction) in points.into_iter().map(Vec3::from).zip(directions.into_iter().map(Vec3::from)) {
            let stack = scene.stack_at(point);
            let Some(top) = stack.top().filter(|top| scene.is_sealed(top.body)) else { continue };
            for target in [Target::Infinity(direction.normalize_or(Vec3::X)), Target::Pinpoint(lens)] {
                let edge = clear_edge::<_, f64>(&scene, &stack, point, &target, &mut crossings);
                prop_assert!(edge.is_none(), "{top:?} {point} {target:?}\n{text}");
            }
        }
    }
}
