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
