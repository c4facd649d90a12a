//! Scenes far from the origin of their coordinates, and scenes of any size.

use upbp_core::{LightPaths, Settings, TechniqueSet};
use upbp_scene::ReadyScene;
use upbp_testing::render;

fn scene(scale: f32, offset: f32) -> ReadyScene {
    let p = |x: f32, y: f32, z: f32| {
        format!("({:?}, {:?}, {:?})", scale * (x + offset), scale * (y + offset), scale * (z + offset))
    };
    let v = |x: f32, y: f32, z: f32| format!("({:?}, {:?}, {:?})", scale * x, scale * y, scale * z);
    let text = format!(
        "(version: 1, camera: Perspective(origin: {}, target: {}, fov_degrees: 50), film: (width: 12, height: 12),
        media: {{\"m\": Homogeneous(sigma_a: {:?}, sigma_s: {:?})}},
        materials: {{\"null\": Null, \"grey\": Lambert(0.5), \"glass\": Dielectric(ior: 1.5)}},
        shapes: [
            (geometry: Box(min: {}, max: {}), material: \"null\", interior: \"m\"),
            (geometry: Sphere(centre: {}, radius: {:?}), material: \"glass\"),
            (geometry: Quad(origin: {}, edge_u: {}, edge_v: {}), material: \"grey\"),
            (geometry: Mesh(positions: [{}, {}, {}], indices: [(0, 1, 2)]), material: \"grey\", emission: 1.0),
        ],
        lights: [Point(position: {}, intensity: {:?})])",
        p(0.0, 0.5, 4.0),
        p(0.0, 0.0, 0.0),
        0.25 / scale,
        0.75 / scale,
        p(-1.0, -1.0, -1.0),
        p(1.0, 1.0, 1.0),
        p(0.25, 0.0, 0.0),
        0.5 * scale,
        p(-2.0, -1.0, -2.0),
        v(0.0, 0.0, 4.0),
        v(4.0, 0.0, 0.0),
        p(-1.0, 2.0, -1.0),
        p(1.0, 2.0, -1.0),
        p(0.0, 2.0, 1.0),
        p(2.0, 1.5, 1.0),
        scale * scale
    );
    match ReadyScene::from_ron_str(&text, "") {
        Ok(scene) => scene,
        Err(error) => panic!("{error}\n{text}"),
    }
}

#[test]
fn a_translation_by_a_million_radii_changes_no_bit() {
    let settings = Settings {
        techniques: TechniqueSet::STANDARD.into(),
        light_paths: LightPaths::Count(1000),
        max_length: 50,
        ..Settings::default()
    };
    let (_, expected) = render(&scene(1.0, 0.0), &settings, 2);
    for offset in [1024.0, 1_048_576.0] {
        let far = scene(1.0, offset);
        assert_ne!(far.origin(), glam::Vec3::ZERO);
        assert!(render(&far, &settings, 2).1 == expected, "offset {offset}");
    }
}

/// A glass ball on a floor under a lamp, and whatever else.
fn with(floor: f32, more: &str) -> ReadyScene {
    let side = 2.0 * floor;
    let text = format!(
        "(version: 1, camera: Perspective(origin: (0, 1, 4), target: (0, 1, 0), fov_degrees: 40),
        film: (width: 16, height: 16),
        materials: {{\"grey\": Lambert(0.5), \"glass\": Dielectric(1.5)}},
        shapes: [
            (geometry: Quad(origin: (-{floor:?}, 0, -{floor:?}), edge_u: (0, 0, {side:?}), edge_v: ({side:?}, 0, 0)),
             material: \"grey\"),
            (geometry: Sphere(centre: (0, 1, 0), radius: 0.5), material: \"glass\"),
            {more}
        ],
        lights: [Point(position: (0, 3, 0), intensity: 5)])"
    );
    ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{error}\n{text}"))
}

#[test]
fn light_is_as_right_beside_things_that_are_far_away() {
    let estimate = |scene: &ReadyScene, techniques: &str| {
        let techniques = techniques.parse().expect("technique names");
        let settings = Settings { techniques, light_paths: LightPaths::Count(4096), ..Settings::default() };
        render(scene, &settings, 100).0
    };
    let ball = "(geometry: Sphere(centre: (1e9, 1, 0), radius: 0.4), material: \"glass\")";
    // What is lit of the ground is near; on the wider ones photons lie where coordinates have no digits for
    // kernels.
    let (near, wide) = (with(4.0, ""), with(1e3, ""));
    for (what, scene, expected) in [
        ("a ball out of sight", with(4.0, ball), &near),
        ("a wide ground", with(1e5, ""), &wide),
        ("a wider ground", with(1e7, ""), &wide),
    ] {
        let expected = estimate(expected, "bpt");
        for techniques in ["bpt", "bpt+surf"] {
            let found = estimate(&scene, techniques);
            let (sigmas, percent) = (found.sigmas(&expected), found.percent(&expected));
            println!("{what}, {techniques}: {found:?}, {expected:?}, {sigmas:.2} sigma, {percent:+.2} %");
            // Kernels blur the caustic over the edges of the picture.
            assert!(sigmas.abs() < 4.5 || percent.abs() < 0.5, "{what}, {techniques}: {sigmas} sigma");
        }
    }
}
