//! Rooms that are closed shapes.

use std::fmt::Write as _;

use glam::Vec3;
use proptest::prelude::*;
use upbp_accel::TriangleMesh;
use upbp_core::Settings;
use upbp_core::check::check_scene;
use upbp_scene::{ReadyScene, SceneError};

/// Radiance in a sphere of radius R and albedo ρ around a light of intensity I is `ρ I / (π R² (1 − ρ))`
/// everywhere, by camera and by light sub-paths.
#[test]
fn light_in_an_integrating_sphere_is_even() {
    let text = "(version: 1, camera: Perspective(origin: (0, 0, 1), target: (0, 0, 0), fov_degrees: 40),
        film: (width: 8, height: 8), materials: { \"white\": Lambert(0.9) },
        shapes: [(geometry: Sphere(centre: (0, 0, 0), radius: 2), material: \"white\")],
        lights: [Point(position: (0, 0, 0), intensity: 1)])";
    let scene = ReadyScene::from_ron_str(text, "").unwrap_or_else(|error| panic!("{error}"));
    check_scene(&scene).unwrap();
    let expected = 0.9 / (std::f64::consts::PI * 4.0 * 0.1);
    for techniques in ["pt", "bpt"] {
        let settings = Settings { techniques: techniques.parse().unwrap(), ..Settings::default() };
        let mut renderer = scene.renderer(settings.validate().unwrap()).unwrap();
        for _ in 0..256 {
            assert!(renderer.iterate());
        }
        let mean = renderer.film().image().mean()[1];
        assert!((mean / expected - 1.0).abs() < 0.02, "{techniques}: {mean} instead of {expected}");
        assert_eq!(renderer.report().counters.lost_walks, 0);
    }
}

/// The problem of a room around the camera with this light, or the notes about it.
fn verdict(room: &str, light: &str) -> Result<Vec<String>, String> {
    let text = format!(
        "(version: 1, camera: Perspective(origin: (0, 0, 1), target: (0, 0, 0), fov_degrees: 40),
          materials: {{ \"white\": Lambert(0.5) }},
          shapes: [(name: \"room\", material: \"white\", {room})], lights: [{light}])"
    );
    match ReadyScene::from_ron_str(&text, "") {
        Ok(scene) => Ok(scene.notes().iter().map(ToString::to_string).collect()),
        Err(SceneError::Invalid { problems, .. }) => Err(problems[0].to_string()),
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn a_lamp_in_the_ceiling_of_a_room_lights_it() {
    let point = |y: f32| format!("Point(position: (0.5, {y:?}, 0.25), intensity: 1)");
    let dark = "camera: lies inside of the opaque shape `room`, and nothing that shines does";
    let cuboid = "geometry: Box(min: (-2, -2, -2), max: (2, 2, 2))";
    let rotated =
        "geometry: Box(min: (-2, -2, -2), max: (2, 2, 2), rotate: [(axis: (0, 1, 0), degrees: 30)])";
    for room in [cuboid, rotated] {
        assert_eq!(verdict(room, &point(2.0)), Ok(Vec::new()));
        assert_eq!(verdict(room, &point(2.01)), Err(dark.to_owned()));
    }
}

/// The lamp in the lower face of a closed housing is not inside of it, on whichever side the camera is.
#[test]
fn a_lamp_in_a_face_of_a_closed_mesh_is_not_inside_of_it() {
    let housing = |degrees: u32| {
        format!(
            "geometry: Box(min: (-0.3, 1.4, -0.3), max: (0.3, 1.7, 0.3), rotate: [(axis: (0, 1, 0), degrees: {degrees})])"
        )
    };
    let light = |y: f32| {
        format!("Spot(position: (0.1, {y:?}, 0.05), direction: (0, -1, 0), intensity: 1, cutoff_degrees: 60)")
    };
    let inside = "light 1 (Spot): lies inside of the opaque shape `room`, and the camera does not";
    for degrees in [30, 90, 200] {
        for (y, is_inside) in [(1.4, false), (1.7, false), (1.41, true), (1.55, true)] {
            let expected = if is_inside { Err(inside.to_owned()) } else { Ok(Vec::new()) };
            assert_eq!(verdict(&housing(degrees), &light(y)), expected, "{degrees} {y}");
        }
    }
}

#[test]
fn a_lamp_in_a_small_housing_far_from_the_origin_is_inside_of_it() {
    let ground = "geometry: Quad(origin: (-2000, -1, -2000), edge_u: (0, 0, 4000), edge_v: (4000, 0, 0))";
    let housing =
        format!("geometry: Sphere(centre: (1000, 1, 0), radius: 0.008)), (material: \"white\", {ground}");
    let light = |y: f32| format!("Point(position: (1000, {y:?}, 0), intensity: 1)");
    let inside = "light 1 (Point): lies inside of the opaque shape `room`, and the camera does not";
    assert_eq!(verdict(&housing, &light(1.0)), Err(inside.to_owned()));
    assert_eq!(verdict(&housing, &light(1.008)), Ok(Vec::new()));
}

#[test]
fn a_dome_that_shines_outwards_is_told() {
    let dome = "geometry: Sphere(centre: (0, 0, 0), radius: 100), emission: 1";
    let outwards =
        "shines outwards only: light from all around is a `Constant`, or a mesh whose normals point inwards";
    assert_eq!(
        verdict(dome, ""),
        Err(format!(
            "camera: lies inside of the opaque shape `room`, and nothing that shines does: that {outwards}"
        ))
    );
    let light = "Point(position: (0, 2, 0), intensity: 1)";
    assert_eq!(verdict(dome, light), Ok(vec![format!("shape `room`: is around the camera, and {outwards}")]));
    let inwards = "geometry: Mesh(positions: [(-9, -9, -9), (30, -9, -9), (-9, 30, -9), (-9, -9, 30)],
        indices: [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)]), emission: 1";
    assert_eq!(verdict(inwards, ""), Ok(Vec::new()));
    assert_eq!(verdict(inwards, light), Ok(Vec::new()));
}

/// A closed surface with deep dents, of `8 n` triangles.
fn star(dents: &[f32]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let n = 4 * dents.len() as u32;
    let around = |i: u32| {
        let (sin, cos) = (i as f32 / n as f32 * std::f32::consts::TAU).sin_cos();
        Vec3::new(cos, 0.0, -sin) * dents[i as usize % dents.len()]
    };
    let positions = [Vec3::Y, -Vec3::Y].into_iter().chain((0..n).map(around)).collect();
    let triangles = (0..n).flat_map(|i| {
        let [here, next] = [2 + i, 2 + (i + 1) % n];
        [[0, here, next], [1, next, here]]
    });
    (positions, triangles.collect())
}

proptest! {
    /// By rays and after the scene has been moved near its origin as by all triangles where it is.
    #[test]
    fn lights_are_in_a_room_if_all_of_its_triangles_say_so(
        dents in prop::collection::vec(0.1_f32..1.0, 2..40),
        places in prop::collection::vec([-1.0_f32..1.0, -1.0..1.0, -1.0..1.0], 60),
        is_far: bool,
    ) {
        // Far away coordinates are no finer than 1/32.
        let (offset, size) = if is_far { (Vec3::new(3e5, -2e5, 1e5), 100.0) } else { (Vec3::ZERO, 1.0) };
        let (positions, triangles) = star(&dents);
        let positions: Vec<_> = positions.into_iter().map(|position| position * size + offset).collect();
        let vector = |Vec3 { x, y, z }: Vec3| format!("({x:?}, {y:?}, {z:?}),");
        let mesh = TriangleMesh::new(positions.clone(), triangles.clone(), None).unwrap();
        let (mut lights, mut expected) = (String::new(), Vec::new());
        // A lamp in the surface is on either side of it.
        let is_off = |place: &Vec3| {
            (0..mesh.triangle_count()).all(|triangle| {
                let [a, b, c] = mesh.corners(triangle).map(|corner| (corner - place) / size);
                a.dot((b - a).cross(c - a).normalize()).abs() > 3e-4
            })
        };
        let places = places.into_iter().map(|place| Vec3::from(place) * size + offset).filter(is_off);
        for (number, place) in (1..).zip(places) {
            write!(lights, "Point(position: {} intensity: 1),", vector(place)).unwrap();
            if mesh.contains(place) == Some(true) {
                let item = format!("light {number} (Point)");
                expected.push(format!(
                    "{item}: lies inside of the opaque shape `star`, and the camera does not"
                ));
            }
        }
        let positions: String = positions.into_iter().map(vector).collect();
        let triangle = |[a, b, c]: [u32; 3]| format!("({a}, {b}, {c}),");
        let indices: String = triangles.into_iter().map(triangle).collect();
        let text = format!(
            "(version: 1, camera: Perspective(origin: {} target: {} fov_degrees: 40),
              materials: {{ \"white\": Lambert(0.5) }}, lights: [{lights}],
              shapes: [(name: \"star\", geometry: Mesh(positions: [{positions}], indices: [{indices}]), material: \"white\")])",
            vector(offset + Vec3::Z * 4.0 * size),
            vector(offset)
        );
        let found: Vec<_> = match ReadyScene::from_ron_str(&text, "") {
            Ok(_) => Vec::new(),
            Err(SceneError::Invalid { problems, .. }) => problems.iter().map(ToString::to_string).collect(),
            Err(error) => panic!("{error}"),
        };
        prop_assert_eq!(found, expected);
    }
}
