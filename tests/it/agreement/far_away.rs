//! Scenes far from the origin of their coordinates, and scenes of any size.

use upbp_core::{LightPaths, Radii, Radius, Roulette, Settings, TechniqueSet};
use upbp_estimators::observer::NoObserver;
use upbp_estimators::path::{Context, LightChunk, Scratch};
use upbp_estimators::trace::trace_light_path;
use upbp_estimators::{PreparedScene, StreamKind};
use upbp_scene::ReadyScene;
use upbp_testing::{render, render_channels, renderer};

/// A glass ball in a box of fog under a lamp, and perhaps another light.
fn scene(scale: f32, offset: f32, light: &str) -> ReadyScene {
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
        lights: [{light}])",
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
    let at = |offset: f32| {
        let [x, y, z] = [offset + 2.0, offset + 1.5, offset + 1.0];
        scene(1.0, offset, &format!("Point(position: ({x:?}, {y:?}, {z:?}), intensity: 1)"))
    };
    let (_, expected) = render(&at(0.0), &settings, 2);
    for offset in [1024.0, 1_048_576.0] {
        let far = at(offset);
        assert_ne!(far.origin(), glam::Vec3::ZERO);
        assert!(render(&far, &settings, 2).1 == expected, "offset {offset}");
    }
}

#[test]
fn a_scene_of_any_size_has_the_same_light() {
    for techniques in ["bpt", "pp3d+pb2d+hit+nee"] {
        let settings = Settings {
            techniques: techniques.parse().expect("technique names"),
            light_paths: LightPaths::Count(1000),
            max_length: 50,
            roulette: Some(Roulette::Below(0.5)),
            radii: Radii::all(Radius::Scene(0.01)),
            ..Settings::default()
        };
        let mean = |exponent| render_channels(&scene(2_f32.powi(exponent), 0.0, ""), &settings, 20);
        let expected = mean(0);
        for exponent in [-36, -20, 20, 36] {
            let found = mean(exponent);
            for (found, expected) in found.iter().zip(&expected) {
                let sigmas = found.sigmas(expected);
                assert!(sigmas.abs() < 4.0, "{techniques}, 2^{exponent}: {found:?}, {expected:?}");
            }
        }
    }
}

/// Photons of the sun have the digits of the place where they are, not those of a start beyond the horizon.
#[test]
fn sunlight_scatters_at_any_height_of_a_thin_layer() {
    const PHOTONS: usize = 1000;
    for sun in ["(0, -1, 0)", "(0.3, -1, 0.2)"] {
        let text = format!(
            "(version: 1, camera: Perspective(origin: (0, 0, 2), target: (0, 0, 0), fov_degrees: 20),
            film: (width: 8, height: 8), media: {{\"mist\": Homogeneous(sigma_s: 5)}},
            materials: {{\"null\": Null}},
            shapes: [(geometry: Box(min: (-1e5, -0.2, -1e5), max: (1e5, 0.2, 1e5)), material: \"null\",
                      interior: \"mist\")],
            lights: [Directional(direction: {sun}, irradiance: 1)])"
        );
        let scene = ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{error}\n{text}"));
        let settings = Settings {
            techniques: "pb2d".parse().expect("a technique"),
            radii: Radii::all(Radius::Absolute(1e-2)),
            ..Settings::default()
        };
        let plan = renderer(&scene, settings).iteration_plan(0);
        let prepared = PreparedScene::new(&scene).expect("a valid scene");
        let context = Context { prepared: &prepared, plan: &plan };
        let (mut scratch, mut chunk) = (Scratch::default(), LightChunk::<_, f64, f64>::default());
        let mut heights = Vec::new();
        for path in 0.. {
            trace_light_path(&context, StreamKind::Light, path, &mut scratch, &mut chunk, &mut NoObserver);
            let vertices = chunk.vertices.drain(..).filter(|vertex| vertex.depth == 1);
            heights.extend(vertices.map(|vertex| vertex.position.y));
            if heights.len() >= PHOTONS {
                break;
            }
        }
        assert!(heights.iter().all(|height| height.abs() <= 0.2 + 1e-6), "sun {sun}");
        heights.sort_unstable_by(f32::total_cmp);
        heights.dedup();
        assert!(heights.len() > PHOTONS * 9 / 10, "sun {sun}: {} heights", heights.len());
    }
}

/// A lamp over a floor, with what is a millimetre before it, all else `distance` away.
fn under_a_lamp(distance: f32, is_point: bool, cover: &str) -> ReadyScene {
    let (emission, light) =
        if is_point { (0, "Point(position: (0, 0, 0), intensity: 1)") } else { (100, "") };
    let (floor, side) = (-distance, 2.0 * distance);
    let text = format!(
        "(version: 1, camera: Perspective(origin: (0, {:?}, {:?}), target: (0, {floor:?}, 0), fov_degrees: 10),
        film: (width: 8, height: 8),
        materials: {{\"black\": Lambert(0), \"white\": Lambert(0.7), \"glass\": Dielectric(1.5)}},
        shapes: [
            (geometry: Quad(origin: ({floor:?}, {floor:?}, {floor:?}), edge_u: (0, 0, {side:?}), edge_v: ({side:?}, 0, 0)),
             material: \"white\"),
            (geometry: Quad(origin: (-0.1, 0, -0.1), edge_u: (0.2, 0, 0), edge_v: (0, 0, 0.2)),
             material: \"black\", emission: {emission}),
            {cover}
        ], lights: [{light}])",
        0.5 * floor,
        0.3 * distance,
    );
    ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{error}\n{text}"))
}

#[test]
fn what_is_just_before_a_lamp_blocks_at_any_distance() {
    const COVER: &str =
        "(geometry: Box(min: (-0.15, -0.0025, -0.15), max: (0.15, -0.0015, 0.15)), material: \"glass\"),";
    let settings = Settings { techniques: "nee".parse().expect("a technique"), ..Settings::default() };
    // A point may lie in a plane at any angle, so that covers are not told from it as far.
    for (is_point, distances) in [(false, &[5.0, 50.0, 500.0, 1000.0][..]), (true, &[5.0, 50.0, 100.0])] {
        for &distance in distances {
            let mean = |cover| render(&under_a_lamp(distance, is_point, cover), &settings, 4).1.mean();
            assert!(mean("").iter().all(|mean| *mean > 0.0), "{distance}");
            assert_eq!(mean(COVER), [0.0; 3], "{distance}: next events go straight through glass");
        }
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

/// Both faces of a pane would be at one distance from a start as far away as the ground is wide.
#[test]
fn the_sun_shines_through_a_pane_above_a_ground_of_any_width() {
    let scene = |floor: f32| {
        let side = 2.0 * floor;
        let text = format!(
            "(version: 1, camera: Perspective(origin: (0, 0.4, 1), target: (0, 0, 0), fov_degrees: 30),
            film: (width: 16, height: 16),
            materials: {{\"grey\": Lambert(0.5), \"glass\": Dielectric(1.5)}},
            shapes: [
                (geometry: Quad(origin: (-{floor:?}, 0, -{floor:?}), edge_u: (0, 0, {side:?}), edge_v: ({side:?}, 0, 0)),
                 material: \"grey\"),
                (geometry: Box(min: (-0.6, 0.5, -0.6), max: (0.6, 0.503, 0.6)), material: \"glass\"),
            ],
            lights: [Directional(direction: (0.1, -1, 0.05), irradiance: 3)])"
        );
        ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{error}\n{text}"))
    };
    let estimate = |scene: &ReadyScene| {
        let techniques = "bpt+surf".parse().expect("technique names");
        let settings = Settings { techniques, light_paths: LightPaths::Count(1024), ..Settings::default() };
        render(scene, &settings, 100).0
    };
    let expected = estimate(&scene(4.0));
    for floor in [1e3, 1e4, 1e5] {
        let found = estimate(&scene(floor));
        let (sigmas, percent) = (found.sigmas(&expected), found.percent(&expected));
        println!("{floor}: {found:?}, {expected:?}, {sigmas:.2} sigma, {percent:+.2} %");
        assert!(sigmas.abs() < 4.5, "{floor}: {found:?}, expected {expected:?}");
    }
}
