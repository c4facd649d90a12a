//! Light that was scattered exactly once.

use crate::cases::{Case, Table, cases, medium, narrow_camera, scene, settings, vector};
use crate::support::render;
use upbp_core::{LightPaths, Settings};

/// Cases that merges can be asked in a test's time: the light neither hidden behind many mean free paths nor so close, or
/// the phase function so peaked, that few photons carry all of it.
const MERGED: [&str; 7] = [
    "single_point_0",
    "single_point_2",
    "single_point_4",
    "single_point_6",
    "single_point_18",
    "single_point_20",
    "single_point_22",
];

/// Settings for paths of two edges.
fn once(techniques: &str, radius: Option<f64>) -> Settings {
    Settings { min_length: 2, max_length: 2, ..settings(techniques, radius) }
}

fn point_light(case: &Case, camera: &str) -> String {
    let array = |name| <[f64; 3]>::try_from(case.inputs(name)).expect("three numbers");
    let (origin, direction, light) = (array("ray_origin"), array("ray_direction"), array("light_position"));
    // A black wall ends the ray.
    let wall = case.optional("t_max").map_or(String::new(), |t| {
        let centre = [0, 1, 2].map(|i| origin[i] + t * direction[i]);
        let (u, v) = ([-direction[2], 0.0, direction[0]], [0.0, 1.0, 0.0]);
        format!(
            "(geometry: Quad(origin: {}, edge_u: {}, edge_v: {}), material: \"black\"),",
            vector([0, 1, 2].map(|i| centre[i] - 0.1 * u[i] - 0.1 * v[i])),
            vector(u.map(|x| 0.2 * x)),
            vector(v.map(|x| 0.2 * x)),
        )
    });
    format!(
        "{camera} outside: \"m\", media: {{\"m\": {}}}, materials: {{\"black\": Lambert(0.0)}}, shapes: [{wall}],
        lights: [Point(position: {}, intensity: {:?})],",
        medium(case.input("sigma_a"), case.input("sigma_s"), case.input("g")),
        vector(light),
        case.input("radiant_intensity"),
    )
}

/// Distance of the light from the line of sight.
fn distance(case: &Case) -> f64 {
    let (d, light) = (case.inputs("ray_direction"), case.inputs("light_position"));
    let t: f64 = d.iter().zip(&light).map(|(a, b)| a * b).sum();
    let square: f64 = light.iter().map(|x| x * x).sum();
    (square - t * t).sqrt()
}

#[test]
fn point_light_seen_through_fog() {
    let mut table = Table::default();
    for case in cases("single_scatter_point_light") {
        let expected = case.expected(&["L_single"]);
        let target = <[f64; 3]>::try_from(case.inputs("ray_direction")).expect("three numbers");
        let origin = <[f64; 3]>::try_from(case.inputs("ray_origin")).expect("three numbers");
        let many = scene(&point_light(&case, &narrow_camera(origin, target, 64)));
        let (result, _) = render(&many, &once("nee", None), 60);
        table.check(&format!("{} nee", case.id), result, expected, case.accuracy);

        if !MERGED.contains(&case.id.as_str()) {
            continue;
        }
        // Fluence around the light goes like 1/r²: at a tenth of the distance a kernel's bias is about 1 %.
        let radius = 0.1 * distance(&case);
        let one = scene(&point_light(&case, &narrow_camera(origin, target, 1)));
        let mut merge = |techniques, scene, radius, beams, iterations, bias| {
            let settings = Settings {
                light_paths: LightPaths::Count(20_000),
                beams: Some(beams),
                ..once(techniques, Some(radius))
            };
            let (result, _) = render(scene, &settings, iterations);
            table.check(&format!("{} {techniques}", case.id), result, expected, bias * expected);
        };
        // Every query beam is the same, and long: one is enough. Points are random: many of them.
        merge("pb2d", &one, radius, 1, 120, 0.015);
        merge("bb1d", &one, radius, 20_000, 40, 0.015);
        merge("pp3d", &many, 1.5 * radius, 1, 20, 0.03);
        merge("bp2d", &many, radius, 2_000, 30, 0.015);
    }
    table.finish();
}

/// Far from all boundaries the bias of a merge falls like the square of its radius. Kernels whose bias stands out of the
/// noise are nearly as wide as the light is far away: the next order adds something.
#[test]
fn bias_falls_with_the_square_of_the_radius() {
    let case = cases("single_scatter_point_light").remove(0);
    let expected = case.expected(&["L_single"]);
    let camera = |size| narrow_camera([0.0; 3], [0.0, 0.0, 1.0], size);
    let one = scene(&point_light(&case, &camera(1)));
    let many = scene(&point_light(&case, &camera(64)));
    for (techniques, scene) in [("pp3d", &many), ("pb2d", &one), ("bb1d", &one)] {
        let bias = [0.8, 0.4].map(|radius| {
            let settings = Settings {
                light_paths: LightPaths::Count(50_000),
                beams: Some(50_000),
                ..once(techniques, Some(radius * distance(&case)))
            };
            let (result, _) = render(scene, &settings, 60);
            (result.mean / expected - 1.0, result.error / expected)
        });
        let exponent = (bias[0].0 / bias[1].0).log2();
        let error = (bias[0].1 / bias[0].0).hypot(bias[1].1 / bias[1].0) / std::f64::consts::LN_2;
        println!(
            "{techniques}: {:+.2} ± {:.2} %, {:+.2} ± {:.2} % with half the radius, exponent {exponent:.2} ± {error:.2}",
            100.0 * bias[0].0,
            100.0 * bias[0].1,
            100.0 * bias[1].0,
            100.0 * bias[1].1,
        );
        assert!((exponent - 2.0).abs() < 0.5, "{techniques}: {exponent} ± {error}");
    }
}

#[test]
fn slab_reflection() {
    let mut table = Table::default();
    for case in cases("single_scatter_slab_reflection") {
        let (mu0, mu, tau) = (case.input("mu0"), case.input("mu"), case.input("tau"));
        let sine = |mu: f64| (1.0 - mu * mu).sqrt();
        // The ray leaves towards +x and upwards, the light travels at an angle to it and downwards.
        let (sin_phi, cos_phi) = case.input("delta_phi").sin_cos();
        let eye = [sine(mu), 0.0, mu];
        let scene = scene(&format!(
            "{} media: {{\"m\": {}}}, materials: {{\"null\": Null}},
            shapes: [(geometry: Box(min: (-100.0, -100.0, {:?}), max: (100.0, 100.0, 0.0)), material: \"null\", interior: \"m\")],
            lights: [Directional(direction: {}, irradiance: 1.0)],",
            narrow_camera(eye, [0.0; 3], 64),
            medium(1.0 - case.input("albedo"), case.input("albedo"), case.input("g")),
            -tau,
            vector([sine(mu0) * cos_phi, sine(mu0) * sin_phi, -mu0]),
        ));
        let (result, _) = render(&scene, &once("nee", None), 60);
        table.check(&case.id, result, case.expected(&["L_single"]), case.accuracy);
    }
    table.finish();
}
