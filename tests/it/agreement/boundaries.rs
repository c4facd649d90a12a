//! Starts of rays on, or within rounding of, the boundary of a body.

use glam::Vec3;
use upbp_core::check::check_scene;
use upbp_core::scene::{BoundingSphere, Hit, Scene};
use upbp_core::{MediumStack, Ray, Renderer, Settings};
use upbp_scene::ReadyScene;
use upbp_testing::{assert_same, render, render_channels};

fn scene(text: &str) -> ReadyScene {
    match ReadyScene::from_ron_str(text, "") {
        Ok(scene) => scene,
        Err(error) => panic!("{error}\n{text}"),
    }
}

fn settings(techniques: &str) -> Settings {
    Settings { techniques: techniques.parse().expect("technique names"), ..Settings::default() }
}

/// A glowing cube of side 2 that a narrow camera looks into from `(0, 0, z)`.
fn glow(z: f32) -> f64 {
    let scene = scene(&format!(
        "(version: 1, camera: Perspective(origin: (0.0, 0.0, {z:?}), target: (0.0, 0.0, {:?}), fov_degrees: 0.01),
        film: (width: 4, height: 4), media: {{\"m\": Homogeneous(sigma_a: 0.5, emission: 1.0)}}, materials: {{\"null\": Null}},
        shapes: [(geometry: Box(min: (-1, -1, -1), max: (1, 1, 1)), material: \"null\", interior: \"m\")])",
        z - 1.0
    ));
    render(&scene, &settings("hit"), 2).0.mean
}

#[test]
fn a_camera_on_a_boundary_looks_into_the_body() {
    let through = 1.0 - (-1.0_f64).exp();
    for z in [3.0, 1.0_f32.next_up(), 1.0, 1.0_f32.next_down()] {
        assert!((glow(z) - through).abs() < 1e-5, "z = {z}: {} instead of {through}", glow(z));
    }
    // On the far side, looking away from it.
    assert_eq!(glow(-1.0), 0.0);
}

#[test]
fn a_camera_on_a_boundary_is_inside_even_if_no_ray_gets_out() {
    let mean = |z: f32| {
        let scene = scene(&format!(
            "(version: 1, camera: Perspective(origin: (0.0, 0.0, {z:?}), target: (0.0, 0.0, {:?}), fov_degrees: 0.01),
            film: (width: 4, height: 4), media: {{\"m\": Homogeneous(sigma_a: 1.0)}},
            materials: {{\"null\": Null, \"black\": Lambert(0.0)}},
            shapes: [
                (geometry: Box(min: (-1, -1, -1), max: (1, 1, 1)), material: \"null\", interior: \"m\"),
                (geometry: Sphere(centre: (0, 0, 0), radius: 0.5), material: \"black\", emission: 1.0),
            ])",
            z - 1.0
        ));
        render(&scene, &settings("hit"), 2).0.mean
    };
    for z in [3.0, 1.0_f32.next_up(), 1.0, 1.0_f32.next_down()] {
        assert!((mean(z) - (-0.5_f64).exp()).abs() < 1e-5, "z = {z}: {}", mean(z));
    }
}

/// A scene that takes every start of a walk for one within its first body.
struct Misled(ReadyScene);

impl Scene for Misled {
    type Bsdf = <ReadyScene as Scene>::Bsdf;
    type Emitter = <ReadyScene as Scene>::Emitter;
    type Medium = <ReadyScene as Scene>::Medium;
    type Camera = <ReadyScene as Scene>::Camera;

    fn intersect(&self, ray: &Ray) -> Option<Hit<Self::Bsdf>> {
        self.0.intersect(ray)
    }

    fn bounds(&self) -> BoundingSphere {
        self.0.bounds()
    }

    fn emitters(&self) -> &[Self::Emitter] {
        self.0.emitters()
    }

    fn media(&self) -> &[Self::Medium] {
        self.0.media()
    }

    fn camera(&self) -> &Self::Camera {
        self.0.camera()
    }

    fn stack_at(&self, _: Vec3) -> MediumStack {
        self.0.stack_at(Vec3::ZERO)
    }
}

#[test]
fn a_walk_in_fog_finds_out_that_there_is_none() {
    let scene = Misled(scene(
        "(version: 1, camera: Perspective(origin: (0, 0, 3), target: (0, 0, 6), fov_degrees: 40),
        film: (width: 16, height: 16), media: {\"m\": Homogeneous(sigma_s: 2)}, materials: {\"null\": Null},
        shapes: [(geometry: Sphere(centre: (0, 0, 0), radius: 1), material: \"null\", interior: \"m\")],
        lights: [Constant(1)])",
    ));
    let settings = Settings { max_length: 100, ..settings("hit") };
    let mut renderer = Renderer::new(&scene, settings.validate().expect("valid settings")).expect("a scene");
    for _ in 0..4 {
        renderer.iterate();
    }
    // Nothing absorbs: whoever is not cut sees the sky.
    assert_eq!(renderer.report().counters.cut_walks, 0);
    let mean = renderer.film().image().mean()[0];
    assert!((mean - 1.0).abs() < 1e-6, "{mean}");
}

/// A box of white fog, two thirds of a mean free path wide and 100 units from the origin: of some hundred
/// thousand vertices one would come out beyond its boundary.
#[test]
fn no_walk_scatters_for_ever_beyond_a_boundary_that_rounding_took_it_across() {
    let scene = scene(
        "(version: 1, camera: Perspective(origin: (100, 0, 0.5), target: (100, 0, 0), fov_degrees: 23),
        film: (width: 64, height: 64), media: {\"m\": Homogeneous(sigma_s: 8)},
        materials: {\"null\": Null, \"black\": Lambert(0)},
        shapes: [
            (geometry: Box(min: (99.9, -0.1, -0.1), max: (100.1, 0.1, 0.1)), material: \"null\", interior: \"m\"),
            // The scene is moved to its middle.
            (geometry: Sphere(centre: (-100, 0, 0), radius: 0.01), material: \"black\"),
        ],
        lights: [Constant(1), Spot(position: (100, 0, 0.5), target: (100, 0, 0), intensity: 1, cutoff_degrees: 12)])",
    );
    let rendered = |techniques: &str, max_length: u32| {
        let settings = Settings { max_length, ..settings(techniques) };
        let mut renderer = scene.renderer(settings.validate().expect("valid settings")).expect("a scene");
        for _ in 0..100 {
            renderer.iterate();
        }
        (renderer.film().image().mean()[0], renderer.report().counters)
    };
    // Nothing absorbs: whoever is not cut sees the light.
    let (mean, counters) = rendered("hit", 100);
    assert_eq!(counters.cut_walks, 0);
    assert!((mean - 1.0).abs() < 1e-6, "{mean}");
    // Light sub-paths of the lamp and of the sky: none has a hundred edges.
    let edges = |max_length| rendered("lt", max_length).1.light_edges;
    assert_eq!(edges(100), edges(200));
}

/// A room of black walls without thickness, 300 units from the origin and full of white fog, with a lamp
/// in it or a sky around it: of some fifty thousand walks one would be seen to come out behind a wall.
#[test]
fn fog_does_not_carry_light_through_walls() {
    let mean = |techniques: &str, eye: &str, light: &str, iterations| {
        // They go past the edges of the room.
        let wall = |origin: &str, u: &str, v: &str| {
            format!(
                "(geometry: Quad(origin: ({origin}), edge_u: ({u}), edge_v: ({v})), material: \"black\"),"
            )
        };
        let walls = [
            wall("299, -1.1, -1.1", "0, 2.2, 0", "0, 0, 2.2"),
            wall("301, -1.1, -1.1", "0, 2.2, 0", "0, 0, 2.2"),
            wall("298.9, -1, -1.1", "2.2, 0, 0", "0, 0, 2.2"),
            wall("298.9, 1, -1.1", "2.2, 0, 0", "0, 0, 2.2"),
            wall("298.9, -1.1, -1", "2.2, 0, 0", "0, 2.2, 0"),
            wall("298.9, -1.1, 1", "2.2, 0, 0", "0, 2.2, 0"),
        ];
        let scene = scene(&format!(
            "(version: 1, camera: Perspective(origin: ({eye}), target: (300, 0, 0), fov_degrees: 60),
            film: (width: 16, height: 16), media: {{\"m\": Homogeneous(sigma_s: 6)}},
            materials: {{\"null\": Null, \"black\": Lambert(0)}},
            shapes: [
                {}
                (geometry: Box(min: (299, -1, -1), max: (301, 1, 1)), material: \"null\", interior: \"m\"),
                // The scene is moved to its middle.
                (geometry: Sphere(centre: (-300, 0, 0), radius: 0.01), material: \"black\"),
            ],
            lights: [{light}])",
            walls.concat()
        ));
        render(&scene, &settings(techniques), iterations).0.mean
    };
    assert_eq!(mean("pt", "300.3, 0, 0.9", "Constant(1)", 1000), 0.0);
    let lamp = "Point(position: (300, 0.5, 0), intensity: 1)";
    let inside = mean("nee+lt", "300.3, 0, 0.9", lamp, 2);
    let outside = mean("nee+lt", "303, 0.2, 0.3", lamp, 1000);
    assert!(inside > 0.01 && outside == 0.0, "{inside} {outside}");
}

#[test]
fn no_walk_is_lost_where_free_paths_are_as_short_as_roundings() {
    let scene = scene(
        "(version: 1, camera: Perspective(origin: (0, 0, 3), target: (0, 0, 0), fov_degrees: 40),
        film: (width: 16, height: 16), media: {\"m\": Homogeneous(sigma_s: 5e5)}, materials: {\"null\": Null},
        shapes: [(geometry: Sphere(centre: (0, 0, 0), radius: 1), material: \"null\", interior: \"m\")],
        lights: [Constant(1)])",
    );
    let settings = Settings { max_length: 200, ..settings("hit") };
    let mut renderer = scene.renderer(settings.validate().expect("valid settings")).expect("a scene");
    for _ in 0..16 {
        renderer.iterate();
    }
    let counters = renderer.report().counters;
    assert_eq!(counters.lost_walks, 0);
    // Nothing absorbs: whoever is not cut sees the light.
    let [mean, ..] = renderer.film().image().mean();
    let cut = counters.cut_walks as f64 / (16.0 * 256.0);
    assert!((mean + cut - 1.0).abs() < 1e-5, "{mean} + {cut}");
}

#[test]
fn kernels_wider_than_a_free_path_do_not_darken_a_boundary() {
    let scene = scene(
        "(version: 1, camera: Perspective(origin: (0, 0, 3), target: (0, 0, 0), fov_degrees: 30),
        film: (width: 12, height: 12), media: {\"m\": Homogeneous(sigma_a: 5e4, sigma_s: 4.5e5)}, materials: {\"null\": Null},
        shapes: [(geometry: Sphere(centre: (0, 0, 0), radius: 1), material: \"null\", interior: \"m\")],
        lights: [Constant(1)])",
    );
    let (expected, _) = render(&scene, &settings("hit"), 64);
    let (found, _) = render(&scene, &settings("all"), 16);
    let slack = 5.0 * found.error.hypot(expected.error) + 0.005;
    assert!((found.mean - expected.mean).abs() < slack, "{found:?} {expected:?}");
}

/// Balls in balls, of radius 1 and less, each of the next of `media` names.
fn nested(count: u32, media: &str, name: impl Fn(u32) -> String, fov: f32) -> ReadyScene {
    let shapes: Vec<String> = (0..count)
        .map(|i| {
            let radius = 1.0 - 0.9 * f64::from(i) / f64::from(count);
            let name = name(i);
            format!("(geometry: Sphere(centre: (0, 0, 0), radius: {radius:?}), material: \"null\", interior: \"{name}\"),")
        })
        .collect();
    let shapes = shapes.concat();
    scene(&format!(
        "(version: 1, camera: Perspective(origin: (0, 0, 3), target: (0, 0, 0), fov_degrees: {fov:?}),
        film: (width: 8, height: 8), media: {{{media}}}, materials: {{\"null\": Null}}, shapes: [{shapes}],
        lights: [Constant(1), Point(position: (0.2, 0.3, 0.1), intensity: 1)])"
    ))
}

#[test]
fn light_crosses_any_number_of_nested_bodies() {
    for count in [6_u32, 7, 8, 9, 40] {
        let sigma = |i: u32| 0.02 * f64::from(i % 5 + 1);
        let media: Vec<String> =
            (0..count).map(|i| format!("\"{i}\": Homogeneous(sigma_a: {:?}),", sigma(i))).collect();
        let balls = nested(count, &media.concat(), |i| i.to_string(), 0.001);
        check_scene(&balls).expect("a scene that keeps its contract");
        let (found, _) = render(&balls, &settings("hit"), 2);
        // Each ball ends 0.9/count before the next, on both sides; the last has a radius of its own.
        let shell = |i: u32| {
            if i + 1 < count { 0.9 / f64::from(count) } else { 1.0 - 0.9 * f64::from(i) / f64::from(count) }
        };
        let depth: f64 = (0..count).map(|i| 2.0 * sigma(i) * shell(i)).sum();
        assert!(
            (found.mean - (-depth).exp()).abs() < 1e-5,
            "{count}: {} instead of {}",
            found.mean,
            (-depth).exp()
        );
    }
}

#[test]
fn nested_bodies_of_equal_media_are_as_one() {
    let fog = "Homogeneous(sigma_a: (0.1, 0.2, 0.3), sigma_s: (2, 1, 0.5))";
    let media = format!("\"even\": {fog}, \"odd\": {fog}");
    let name = |i: u32| if i.is_multiple_of(2) { "even" } else { "odd" }.to_owned();
    let expected = render_channels(&nested(1, &media, name, 40.0), &settings("bpt"), 300);
    for count in [9, 40] {
        let balls = nested(count, &media, name, 40.0);
        let mut renderer =
            balls.renderer(settings("bpt").validate().expect("valid settings")).expect("a scene");
        renderer.iterate();
        let counters = renderer.report().counters;
        assert_eq!((counters.lost_walks, counters.boundary_conflicts), (0, 0));
        assert_same(
            render_channels(&balls, &settings("bpt"), 200),
            expected,
            0.01,
            &format!("{count} balls"),
        );
    }
}
