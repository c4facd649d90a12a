//! Kernel radii that are a function of place: what the plan gives to a picture of near and far things.

use upbp_core::glam::Vec3;
use upbp_core::{FrozenPlan, LightPaths, Plan, Radii, Radius, RadiusField, Settings, State, StateError};
use upbp_scene::ReadyScene;
use upbp_testing::renderer;

/// Balls of glass on a plain, one next to the camera, and the sun.
fn landscape() -> ReadyScene {
    let text = r#"(
  version: 1,
  camera: Perspective(origin: (0, 0.5, 0.6), target: (0, 0.25, -1), fov_degrees: 50),
  film: (width: 40, height: 30),
  materials: { "stone": Lambert(0.5), "glass": Dielectric(1.5) },
  shapes: [
    (material: "stone", geometry: Quad(origin: (-200, 0, -300), edge_u: (0, 0, 400), edge_v: (400, 0, 0))),
    (material: "glass", geometry: Sphere(centre: (-0.12, 0.11, 0.1), radius: 0.1)),
    (material: "glass", geometry: Sphere(centre: (3, 2, -12), radius: 2)),
  ],
  lights: [ Directional(direction: (0.4, -1, 0.3), irradiance: 5), Constant(0.3) ],
)"#;
    ReadyScene::from_ron_str(text, ".").expect("a valid scene")
}

/// A drop on a leaf, seen from 2 cm away, in surroundings of 40 m.
fn microscope() -> ReadyScene {
    microscope_in(20.0)
}

/// A drop on a leaf, seen from 2 cm away, in surroundings of some radius in metres.
fn microscope_in(radius: f32) -> ReadyScene {
    let text = r#"(
  version: 1,
  camera: Perspective(origin: (0, 0.02, 0.012), target: (0, 0.0, -0.001), fov_degrees: 35),
  film: (width: 40, height: 40),
  materials: { "leaf": Lambert(0.3), "water": Dielectric(1.33) },
  shapes: [
    (material: "leaf", geometry: Quad(origin: (-RADIUS, -1, -RADIUS), edge_u: (0, 0, SIDE), edge_v: (SIDE, 0, 0))),
    (material: "leaf", geometry: Box(min: (-0.05, -0.001, -0.05), max: (0.05, 0, 0.05))),
    (material: "water", geometry: Sphere(centre: (0, 0.0012, 0), radius: 0.0011)),
  ],
  lights: [ Directional(direction: (0.3, -1, -0.4), irradiance: 5), Constant(0.3) ],
)"#;
    let text = text.replace("RADIUS", &format!("{radius:?}")).replace("SIDE", &format!("{:?}", 2.0 * radius));
    ReadyScene::from_ron_str(&text, ".").expect("a valid scene")
}

fn settings() -> Settings {
    Settings { techniques: "all".parse().expect("techniques"), deterministic: true, ..Settings::default() }
}

fn plan(scene: &ReadyScene, settings: Settings) -> Plan {
    renderer(scene, settings).state().identity().frozen_plan().plan
}

/// Width of a pixel at a distance, for a horizontal angle of the picture in degrees.
fn pixel(distance: f32, degrees: f32, pixels: f32) -> f32 {
    2.0 * distance * (0.5 * degrees.to_radians()).tan() / pixels
}

#[test]
fn a_landscape_and_a_microscope_get_the_kernels_that_pixels_ask_for() {
    let scene = landscape();
    let radii = plan(&scene, settings()).radii;
    let eye = Vec3::new(0.0, 0.5, 0.6);
    for (place, distance) in [(Vec3::new(0.0, 0.0, -0.5), 1.21), (Vec3::new(0.0, 0.0, -4.0), 4.63)] {
        assert!(((place - eye).length() - distance).abs() < 0.01);
        let pixels = radii.surf * radii.field.at(place) / pixel(distance, 50.0, 40.0);
        assert!((0.01..=0.14).contains(&pixels), "{pixels} pixels at {place}: {radii:?}");
    }
    let scene = microscope();
    let radii = plan(&scene, settings()).radii;
    assert_eq!(radii.field, RadiusField::Uniform, "all is as far away");
    let pixels = radii.surf / pixel(0.0236, 35.0, 40.0);
    assert!((0.01..=0.14).contains(&pixels), "{pixels} pixels: {radii:?}");
}

/// Walks get lost in haze that has no end: what they meet there needs no kernels.
#[test]
fn radii_do_not_depend_on_how_far_walks_get() {
    let at_the_ball = |sigma_s: &str| {
        let text = r#"(version: 1, outside: "haze", media: { "haze": Homogeneous(sigma_s: SIGMA) },
            camera: Perspective(origin: (0, 1.6, 4), target: (0, 0.5, 0), fov_degrees: 40),
            film: (width: 64, height: 48), materials: { "stone": Lambert(0.5), "glass": Dielectric(1.5) },
            shapes: [
                (geometry: Quad(origin: (-5, 0, -5), edge_u: (0, 0, 10), edge_v: (10, 0, 0)), material: "stone"),
                (geometry: Sphere(centre: (0, 0.5, 0), radius: 0.5), material: "glass"),
            ],
            lights: [Point(position: (1, 3, 1), intensity: 40)])"#;
        let scene = ReadyScene::from_ron_str(&text.replace("SIGMA", sigma_s), ".").expect("a valid scene");
        let radii = plan(&scene, settings()).radii;
        let there = radii.field.at(Vec3::new(0.0, 0.5, 0.0));
        println!("{sigma_s}: {radii:?}");
        [there * radii.surf, there * radii.pb2d, there * radii.bb1d, radii.floor]
    };
    let clear = at_the_ball("1e-2");
    for sigma_s in ["1e-4", "1e-6"] {
        let thin = at_the_ball(sigma_s);
        assert!(thin.iter().zip(clear).all(|(thin, clear)| *thin < 2.0 * clear), "{thin:?} and {clear:?}");
    }
}

/// Most edges in a room are in the air, where no photons are looked up: kernels suit the many photons in the
/// juice, and are not as wide as they may be, 0.3 % of the picture.
#[test]
fn radii_are_those_for_bodies_in_a_room_and_not_for_the_air() {
    let text = r#"(version: 1, media: { "juice": Homogeneous(sigma_s: 4, sigma_a: 0.2) },
        camera: Perspective(origin: (0, 0.3, 1.5), target: (0, 0, 0), fov_degrees: 60),
        film: (width: 64, height: 48), materials: { "white": Lambert(0.7), "clear": Null },
        shapes: [
            (geometry: Box(min: (-2, -0.3, -2), max: (2, -0.28, 2)), material: "white"),
            (geometry: Quad(origin: (-2, -0.3, -2), edge_u: (4, 0, 0), edge_v: (0, 3, 0)), material: "white"),
            (geometry: Quad(origin: (-2, -0.3, -2), edge_u: (0, 3, 0), edge_v: (0, 0, 4)), material: "white"),
            (geometry: Sphere(centre: (0, 0, 0), radius: 0.25), material: "clear", interior: "juice"),
        ],
        lights: [Point(position: (0, 0, 0), intensity: 5)])"#;
    let scene = ReadyScene::from_ron_str(text, ".").expect("a valid scene");
    let radii = plan(&scene, Settings { light_paths: LightPaths::Count(400_000), ..settings() }).radii;
    println!("{radii:?}");
    // On surfaces photons are rare.
    assert!(radii.pb2d < 0.5 * radii.surf, "{radii:?}");
}

#[test]
fn radii_that_are_given_are_the_same_everywhere() {
    let scene = landscape();
    let radii = Radii { surf: Radius::Absolute(0.01), ..Radii::default() };
    let plan = plan(&scene, Settings { radii, ..settings() });
    assert_eq!((plan.radii.surf, plan.radii.field), (0.01, RadiusField::Uniform));
}

/// Half of what the picture shows scatters first where coordinates have no digits for any kernel.
#[test]
fn radii_that_are_given_may_be_below_what_coordinates_tell_apart() {
    let text = r#"(version: 1, camera: Perspective(origin: (0, 1, 6), target: (0, 1, 0), fov_degrees: 60),
        film: (width: 16, height: 16), outside: "haze", media: { "haze": Homogeneous(sigma_s: 1e-18) },
        materials: { "white": Lambert(0.7) },
        shapes: [(geometry: Quad(origin: (-1, 0, -1), edge_u: (0, 0, 2), edge_v: (2, 0, 0)), material: "white")],
        lights: [Point(position: (0, 2, 0), intensity: 5)])"#;
    let scene = ReadyScene::from_ron_str(text, ".").expect("a valid scene");
    let settings = Settings {
        techniques: "nee+surf".parse().expect("technique names"),
        light_paths: LightPaths::Count(100),
        radii: Radii::all(Radius::Scene(0.001)),
        ..settings()
    };
    let mut renderer = renderer(&scene, settings);
    assert!(renderer.iterate());
    assert!(renderer.film().image().mean().iter().all(|mean| *mean > 0.0));
}

#[test]
fn a_field_is_part_of_plans_and_states() {
    let scene = landscape();
    let mut first = renderer(&scene, settings());
    let frozen = first.state().identity().frozen_plan();
    assert_ne!(frozen.plan.radii.field, RadiusField::Uniform);
    assert_eq!(FrozenPlan::from_ron(&frozen.to_ron()), Ok(frozen.clone()));
    assert!(first.iterate());
    let mut bytes = Vec::new();
    first.state().write(&mut bytes).expect("a vector takes all");
    let state = State::read(bytes.as_slice()).expect("what was written");
    assert_eq!(state.identity().plan, frozen.plan);

    let plan = state.identity().plan;
    let mut uniform = plan;
    uniform.radii.field = RadiusField::Uniform;
    let in_lanes = Plan { lanes: Some([0.5, 0.25, 0.25]), ..plan };
    for (name, plan) in [("radii.field", uniform), ("lanes", in_lanes)] {
        let mut other = state.identity().clone();
        other.plan = plan;
        let different = other.check_same(state.identity());
        assert!(
            matches!(&different, Err(StateError::Different { differences }) if differences[0].contains(name))
        );
    }

    let mut steep = frozen;
    steep.plan.radii.surf = 1.001 * steep.plan.radii.field.largest_radius();
    assert!(FrozenPlan::from_ron(&steep.to_ron()).unwrap_err().to_string().contains("radii.field"));
}

#[test]
fn radii_shrink_however_far_away_things_are() {
    // The drop, and surroundings of 40 km.
    let scene = microscope_in(2e4);
    let renderer = renderer(&scene, settings());
    let [first, last] = [0, 1_000_000].map(|i| renderer.iteration_plan(i).kernels.surf.radius());
    assert!((last / first / 0.1 - 1.0).abs() < 0.01, "{first} becomes {last}");
}
