//! Bodies that overlap as the README says: water in glass, from boxes.

use glam::Vec3;
use upbp_core::Settings;
use upbp_core::scene::Scene as _;
use upbp_scene::ReadyScene;

/// Half the sides of the glass and of the water in it.
const OUTER: f32 = 1.0;
const INNER: f32 = 0.8;

fn scene(water: &str, shapes: &str) -> ReadyScene {
    let text = format!(
        "(version: 1, camera: Perspective(origin: (2, 1.5, 4), target: (0, 0, 0), fov_degrees: 30),
          film: (width: 16, height: 16),
          media: {{ \"water\": Homogeneous({water}) }},
          materials: {{ \"glass\": Dielectric(1.5), \"water\": Dielectric(1.33) }},
          shapes: [{shapes}],
          lights: [Constant(1)])"
    );
    ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{error}"))
}

fn cuboid(min: Vec3, max: Vec3, rest: &str) -> String {
    format!("(geometry: Box(min: {min:?}, max: {max:?}), {rest}),").replace("Vec3", "")
}

/// A box of water in a box of glass.
fn nested() -> String {
    cuboid(Vec3::splat(-OUTER), Vec3::splat(OUTER), "material: \"glass\"")
        + &cuboid(Vec3::splat(-INNER), Vec3::splat(INNER), "material: \"water\", interior: \"water\"")
}

/// A glass with six walls that overlap at the edges, each wider than the one before, so that no faces
/// coincide; and water up to `level` that reaches into them.
fn walls(level: f32) -> String {
    let wall = |axis: usize, side: f32| {
        let width = OUTER + 4e-3 * (2.0 * axis as f32 + 0.5 * side);
        let (mut min, mut max) = (Vec3::splat(-width), Vec3::splat(width));
        (min[axis], max[axis]) = if side > 0.0 { (INNER, OUTER) } else { (-OUTER, -INNER) };
        cuboid(min, max, "material: \"glass\", priority: 1")
    };
    let reach = 0.5 * (INNER + OUTER);
    let water = cuboid(
        Vec3::splat(-reach),
        Vec3::new(reach, level, reach),
        "material: \"water\", interior: \"water\"",
    );
    (0..3).flat_map(|axis| [wall(axis, -1.0), wall(axis, 1.0)]).collect::<String>() + &water
}

/// The mean of each iteration, of all channels; and the last picture.
fn render(scene: &ReadyScene, iterations: u64) -> (Vec<f64>, Vec<[f32; 3]>) {
    let settings = Settings { techniques: "pt".parse().unwrap(), ..Settings::default() };
    let mut renderer = scene.renderer(settings.validate().unwrap()).unwrap();
    let mut sums = vec![0.0];
    for n in 1..=iterations {
        assert!(renderer.iterate());
        sums.push(renderer.film().image().mean().iter().sum::<f64>() / 3.0 * n as f64);
    }
    assert_eq!(renderer.report().counters.lost_walks, 0);
    (sums.windows(2).map(|pair| pair[1] - pair[0]).collect(), renderer.film().image().pixels.clone())
}

/// Nothing absorbs, and the same light comes from everywhere: it is seen in every pixel.
#[test]
fn clear_bodies_in_a_white_furnace_are_not_seen() {
    for shapes in [nested(), walls(0.5 * (INNER + OUTER)), walls(0.1)] {
        let (_, pixels) = render(&scene("sigma_s: 0.5", &shapes), 4);
        for value in pixels.iter().flatten() {
            assert!((value - 1.0).abs() < 1e-4, "{value} in {shapes}");
        }
    }
}

#[test]
fn water_that_reaches_into_its_walls_is_water_in_a_box_of_glass() {
    let shapes = [nested(), walls(0.5 * (INNER + OUTER))];
    let [nested, walls] = shapes.map(|shapes| scene("sigma_a: (0.5, 1, 2)", &shapes));
    let fraction = |i: u32, alpha: f64| (f64::from(i) * alpha).fract() as f32 * 2.4 - 1.2;
    for i in 0..5000 {
        let point = Vec3::new(fraction(i, 0.819_172_5), fraction(i, 0.671_043_6), fraction(i, 0.549_700_5));
        // The walls that are wider stick out.
        if (point.abs().max_element() - OUTER).abs() < 0.03 {
            continue;
        }
        let [a, b] = [&nested, &walls].map(|scene| scene.stack_at(point));
        assert_eq!((a.medium(), a.ior()), (b.medium(), b.ior()), "{point}");
    }
    let [a, b] = [&nested, &walls].map(|scene| {
        let (means, _) = render(scene, 64);
        let n = means.len() as f64;
        let mean = means.iter().sum::<f64>() / n;
        let variance = means.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (mean, (variance / n).sqrt())
    });
    let bar = 5.0 * a.1.hypot(b.1);
    assert!(bar < 0.02 && (a.0 - b.0).abs() < bar, "{a:?} against {b:?}");
}
