//! Meshes and boxes that are turned and moved, and mesh files that several shapes share.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use glam::Vec3;
use upbp_accel::Ray;
use upbp_core::scene::Scene as _;
use upbp_scene::ReadyScene;

fn scene(folder: &Path, shapes: &str) -> ReadyScene {
    let text = format!(
        "(version: 1, camera: Perspective(origin: (0, 0, 9), target: (0, 0, 0), fov_degrees: 30),
          materials: {{ \"white\": Lambert(0.5), \"glass\": Dielectric(1.5) }},
          shapes: [{shapes}],
          lights: [Constant(1)])"
    );
    ReadyScene::from_ron_str(&text, folder).unwrap_or_else(|error| panic!("{error}"))
}

/// A ball with a dent, smooth, of `2 n²` triangles, as a mesh file.
fn dented_ball(n: u32) -> String {
    let mut text = String::new();
    let corner = |ring: u32, side: u32| {
        if ring == n {
            return Vec3::NEG_Y;
        }
        let (theta, phi) =
            (ring as f32 / n as f32 * std::f32::consts::PI, side as f32 / n as f32 * std::f32::consts::TAU);
        let towards = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
        towards * (1.0 - 0.4 * (towards.x - 0.7).max(0.0))
    };
    for ring in 0..=n {
        for side in 0..n {
            let Vec3 { x, y, z } = corner(ring, side);
            let normal = corner(ring, side).normalize();
            writeln!(text, "v {x} {y} {z}\nvn {} {} {}", normal.x, normal.y, normal.z).unwrap();
        }
    }
    let number = |ring: u32, side: u32| ring * n + side % n + 1;
    for ring in 0..n {
        for side in 0..n {
            let [a, b] = [number(ring, side), number(ring, side + 1)];
            let [c, d] = [number(ring + 1, side + 1), number(ring + 1, side)];
            writeln!(text, "f {a}//{a} {b}//{b} {c}//{c} {d}//{d}").unwrap();
        }
    }
    text
}

/// Rays from all around to all places.
fn rays() -> impl Iterator<Item = Ray> {
    (0..4000_u32).map(|i| {
        let part = |step: f64| (f64::from(i) * step).fract() as f32 * 2.0 - 1.0;
        let origin = Vec3::new(part(0.754_877), part(0.569_840), part(0.430_159)) * 12.0;
        let target = Vec3::new(part(0.819_172), part(0.671_043), part(0.549_700)) * 3.0;
        Ray::new(origin, (target - origin).normalize())
    })
}

/// All that a scene says of a ray.
fn answers(scene: &ReadyScene, ray: &Ray) -> String {
    let (mut met, mut crossed) = (Vec::new(), Vec::new());
    let hits = (scene.intersect(ray), scene.trace(ray, &mut met));
    let is_clear = scene.is_clear(ray, &mut crossed);
    let inside = scene.stack_at(ray.at(9.0));
    format!("{hits:?} {met:?} {is_clear} {crossed:?} {inside:?}")
}

#[test]
fn shapes_that_share_a_mesh_file_are_what_they_are_with_files_of_their_own() {
    let folder = std::env::temp_dir().join(format!("upbp placement {}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    let ball = dented_ball(48);
    let places = [
        ("", Vec3::ZERO),
        (", rotate: [(axis: (0, 1, 0), degrees: 40)]", Vec3::new(2.1, 0.0, 0.0)),
        (", scale: 0.5, rotate: [(axis: (0, 1, 0), degrees: 40), (axis: (1, 0, 2), degrees: -70)]", Vec3::Y),
        (", scale: 1.5", Vec3::new(-1.3, 2.2, 0.4)),
    ];
    let shapes = |shared: bool, material: &str, offset: Vec3| {
        let shape = |(number, (place, at)): (usize, &(&str, Vec3))| {
            let file = format!("{}.obj", if shared { 0 } else { number });
            fs::write(folder.join(&file), &ball).unwrap();
            let Vec3 { x, y, z } = *at + offset;
            let place = format!("{place}, translate: ({x}, {y}, {z})");
            format!("(geometry: Mesh(file: \"{file}\"{place}), material: \"{material}\"),")
        };
        places.iter().enumerate().map(shape).collect::<String>()
    };
    // The second scene is moved near the origin.
    let far = Vec3::new(3e5, -2e5, 1e5);
    for (material, offset) in [("white", Vec3::ZERO), ("glass", far), ("glass", Vec3::ZERO)] {
        let [shared, own] = [true, false].map(|shared| scene(&folder, &shapes(shared, material, offset)));
        assert_eq!(shared.origin() == Vec3::ZERO, offset == Vec3::ZERO);
        assert_eq!((shared.files().len(), own.files().len()), (1, places.len()));
        let mut hits = 0;
        for mut ray in rays() {
            ray.origin += offset - shared.origin();
            assert_eq!(answers(&shared, &ray), answers(&own, &ray), "{ray:?}");
            hits += usize::from(shared.intersect(&ray).is_some());
        }
        assert!(hits > 1000, "{hits}");
    }
    fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn small_mesh_files_are_shared_if_there_are_very_many_copies() {
    let folder = std::env::temp_dir().join(format!("upbp many copies {}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    let ball = dented_ball(32);
    let triangles = ball.lines().filter(|line| line.starts_with('f')).count() * 2;
    fs::write(folder.join("ball.obj"), ball).unwrap();
    let is_shared = |copies: usize| {
        let shape =
            |i| format!("(geometry: Mesh(file: \"ball.obj\", translate: ({i}, 0, 0)), material: \"white\"),");
        let scene = scene(&folder, &(0..copies).map(shape).collect::<String>());
        format!("{:?}", scene.geometry().shapes()[copies - 1]).contains("placement: Some")
    };
    assert!(triangles < 4096, "{triangles}");
    // Both ends of the rings are points: there are fewer triangles with an area.
    let with_area = triangles - 64;
    assert!(!is_shared(16) && is_shared((1 << 20) / with_area + 1));
    fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn rotations_go_counter_clockwise_about_their_axis_in_turn() {
    let triangle = |rest: &str| {
        let shape = format!(
            "(geometry: Mesh(positions: [(1, 0, 0), (3, 0, 0), (1, 0, -2)], indices: [(0, 1, 2)]{rest}),
              material: \"white\")"
        );
        scene(Path::new(""), &shape)
    };
    // About y: x goes to −z, and −z to −x. Then about x: −z goes to y.
    let turned = triangle(
        ", scale: 0.5, rotate: [(axis: (0, 1, 0), degrees: 90), (axis: (2, 0, 0), degrees: 90)], translate: (5, 0, 0)",
    );
    let upbp_accel::Shape::Mesh(mesh) = &turned.geometry().shapes()[0] else { panic!("no mesh") };
    assert_eq!(
        mesh.corners(0),
        [Vec3::new(5.0, 0.5, 0.0), Vec3::new(5.0, 1.5, 0.0), Vec3::new(4.0, 0.5, 0.0)]
    );
}

#[test]
fn a_box_is_rotated_about_its_centre() {
    let cuboid = |rest: &str| {
        let shape = format!("(geometry: Box(min: (1, 0, 0), max: (5, 1, 2){rest}), material: \"glass\")");
        scene(Path::new(""), &shape)
    };
    let turned = cuboid(", rotate: [(axis: (0, 1, 0), degrees: 90)]");
    let (min, max) = turned.geometry().bounds();
    assert_eq!((min, max), (Vec3::new(2.0, 0.0, -1.0), Vec3::new(4.0, 1.0, 3.0)));
    assert_eq!(turned.geometry().shapes()[0].contains(Vec3::new(2.5, 0.5, 2.5)), Some(true));
    let whole = cuboid(", rotate: [(axis: (0, 1, 0), degrees: 200), (axis: (0, 1, 0), degrees: 160)]");
    assert!(matches!(whole.geometry().shapes()[0], upbp_accel::Shape::Box(_)));
}
