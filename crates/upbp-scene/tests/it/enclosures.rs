//! Bodies that no straight line leaves without meeting a surface, and what is in them.

use glam::Vec3;
use proptest::prelude::*;
use upbp_estimators::PreparedScene;
use upbp_estimators::path::{Target, clear_edge};
use upbp_estimators::scene::{Camera as _, Enclosure, Scene};
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
fn milk_is_enclosed_unless_a_cloud_reaches_out_and_what_is_in_it_is_told() {
    const FAR: &str = "(0, 0, 9)";
    const EMPTY: Option<Enclosure> = Some(Enclosure { lights: false, lens: false });
    const LIT: Option<Enclosure> = Some(Enclosure { lights: true, lens: false });
    const SEEN: Option<Enclosure> = Some(Enclosure { lights: false, lens: true });
    const BOTH: Option<Enclosure> = Some(Enclosure { lights: true, lens: true });
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
    for (what, eye, shapes, lights, expected) in [
        ("alone", FAR, milk.clone(), "", EMPTY),
        ("in haze", FAR, milk.clone() + haze, "", EMPTY),
        ("with ice", FAR, milk.clone() + &ice, "", EMPTY),
        ("a cloud above it", FAR, milk.clone() + &cloud(0), "", None),
        ("a cloud below it", FAR, milk.clone() + &cloud(-1), "", EMPTY),
        ("a lamp", FAR, milk.clone() + lamp, "", LIT),
        ("a point", FAR, milk.clone(), point, LIT),
        ("the lens", "(0, 0.5, 0)", milk.clone(), "", SEEN),
        ("a point in its surface", FAR, milk.clone(), "Point(position: (0, 1, 0), intensity: 1)", BOTH),
        ("the lens in its surface", "(0.6, 0.8, 0)", milk.clone(), "", BOTH),
        ("glowing", FAR, glowing, "", LIT),
        ("index-matched", FAR, ball(1.0, 0.0, "material: \"null\", interior: \"milk\""), "", None),
    ] {
        let scene = scene(eye, &shapes, lights);
        let inside = scene.stack_at(Vec3::new(-0.5, 0.0, 0.0)).top().expect("a body");
        assert_eq!(scene.enclosure(inside.body), expected, "{what}");
        let is_enclosed = expected.is_some();
        let medium = inside.medium.expect("a medium");
        let extent = scene.medium_extent(medium);
        assert_eq!(extent < 4.0, is_enclosed, "{what}: {extent}");
        // A mean free path of a hundredth is short on the ground, not in the milk.
        let prepared = PreparedScene::new(&scene).expect("a valid scene");
        assert_eq!(prepared.is_dense(medium), !is_enclosed, "{what}");
    }
    let outside = scene(FAR, &(milk + haze), "");
    let haze = outside.stack_at(Vec3::new(5.0, 0.0, 0.0)).medium().expect("haze");
    assert!(outside.medium_extent(haze) == outside.bounds().radius && haze != MediumId(u32::MAX));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    /// As connections see it: however bodies overlap, nothing is seen from an enclosed one.
    #[test]
    fn nothing_is_seen_from_within_enclosed_bodies(
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
        let points: Vec<Vec3> = points.into_iter().map(Vec3::from).collect();
        let body_at = |point: Vec3| scene.stack_at(point).top().map(|top| top.body);
        for (place, (&point, direction)) in points.iter().zip(directions).enumerate() {
            let stack = scene.stack_at(point);
            let Some(body) = body_at(point).filter(|&body| scene.enclosure(body).is_some()) else { continue };
            let others = points.iter().cycle().skip(place + 1).take(8).filter(|&&other| body_at(other) != Some(body));
            let targets = others.map(|&other| Target::Medium(other)).chain([
                Target::Infinity(Vec3::from(direction).normalize_or(Vec3::X)),
                Target::Pinpoint(lens),
            ]);
            for target in targets {
                let edge = clear_edge::<_, f64>(&scene, &stack, point, &target, &mut crossings);
                prop_assert!(edge.is_none(), "{body:?} {point} {target:?}\n{text}");
            }
        }
    }
}
