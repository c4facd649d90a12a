//! Light that was scattered exactly once.

use std::f64::consts::PI;

use upbp_core::{LightPaths, Settings};
use upbp_testing::analytic::{Case, Table, cases, medium, narrow_camera, scene, settings, vector};
use upbp_testing::render;

/// Cases, each of another medium, that merges can be asked in a test's time: the light neither hidden behind
/// many mean free paths nor so close, or the phase function so peaked, that few photons carry all of it.
const MERGED: [&str; 4] = [FIRST, "single_point_4", "single_point_6", "single_point_20"];

/// The case of [`bias_falls_with_the_square_of_the_radius`], where merges but BP2D are compared with more.
const FIRST: &str = "single_point_0";

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
    let mut table = Table::new(0.06);
    for case in cases("single_scatter_point_light") {
        let expected = case.expected(&["L_single"]);
        let target = <[f64; 3]>::try_from(case.inputs("ray_direction")).expect("three numbers");
        let origin = <[f64; 3]>::try_from(case.inputs("ray_origin")).expect("three numbers");
        let many = scene(&point_light(&case, &narrow_camera(origin, target, 64)));
        let (result, _) = render(&many, &once("nee", None), 10);
        table.check(&format!("{} nee", case.id), result, expected, case.accuracy);
        assert!(result.error < 1e-3 * expected, "{}: too noisy to tell", case.id);

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
        if case.id != FIRST {
            merge("pb2d", &one, radius, 1, 60, 0.015);
            merge("bb1d", &one, radius, 20_000, 20, 0.015);
            merge("pp3d", &many, 1.5 * radius, 1, 20, 0.03);
        }
        merge("bp2d", &many, radius, 2_000, 30, 0.015);
    }
    table.finish();
}

/// The mean of a merge with a kernel of some radius, by quadrature: along the ray, the light of the point
/// source is averaged over the kernel instead of taken at the point. Isotropic scattering; the kernel does
/// not reach the light.
fn smoothed(technique: &str, case: &Case, radius: f64) -> f64 {
    let sigma_t = case.input("sigma_a") + case.input("sigma_s");
    let fluence = |d: f64| (-sigma_t * d).exp() / (d * d);
    let at: [f64; 3] = case.inputs("light_position").try_into().expect("three numbers");
    // The ray starts in the origin and runs along z.
    let across = at[0].hypot(at[1]);
    let steps = |n: u32| move |i: u32| (f64::from(i) + 0.5) / f64::from(n);
    let average = |t: f64| -> f64 {
        let along = at[2] - t;
        let distance = across.hypot(along);
        if technique == "pp3d" {
            // Shells around the light: their area within a ball at this distance.
            let shell = |u: f64| {
                let d = distance + (2.0 * u - 1.0) * radius;
                fluence(d) * PI * d / distance * (radius.powi(2) - (distance - d).powi(2)) * 2.0 * radius
            };
            (0..1000).map(steps(1000)).map(shell).sum::<f64>() / 1000.0 * 3.0 / (4.0 * PI * radius.powi(3))
        } else {
            // A parabolic disc across the ray: rings of equal weight per area, times 2 (1 − u²).
            let ring = |i: u32| {
                let area = steps(60)(i);
                let r = radius * area.sqrt();
                let point = |j: u32| {
                    let phi = 2.0 * PI * steps(60)(j);
                    fluence((across - r * phi.cos()).hypot(r * phi.sin()).hypot(along))
                };
                2.0 * (1.0 - area) * (0..60).map(point).sum::<f64>() / 60.0
            };
            (0..60).map(ring).sum::<f64>() / 60.0
        }
    };
    // t = tan of an angle: even steps near the light, the tail to infinity.
    let integrand = |u: f64| {
        let angle = 0.5 * PI * u;
        let t = angle.tan() * at[2];
        (-sigma_t * t).exp() * average(t) * at[2] * 0.5 * PI / angle.cos().powi(2)
    };
    case.input("sigma_s") / (4.0 * PI) * (0..2000).map(steps(2000)).map(integrand).sum::<f64>() / 2000.0
}

/// Far from all boundaries the bias of a merge falls like the square of its radius: PP3D and PB2D have the
/// bias that quadrature predicts, whose exponent comes to two as the radius shrinks. BB1D smooths across both
/// beams at once, which is not predicted here; a bias of 10 % and more contains the next order, and its
/// exponent is above two.
#[test]
fn bias_falls_with_the_square_of_the_radius() {
    let case = cases("single_scatter_point_light").remove(0);
    assert_eq!(case.id, FIRST);
    let expected = case.expected(&["L_single"]);
    let camera = |size| narrow_camera([0.0; 3], [0.0, 0.0, 1.0], size);
    let one = scene(&point_light(&case, &camera(1)));
    let many = scene(&point_light(&case, &camera(64)));
    let mut table = Table::new(0.01);
    for technique in ["pp3d", "pb2d"] {
        let bias = |radius: f64| smoothed(technique, &case, radius) / expected - 1.0;
        let biases = [0.8, 0.4, 0.2, 0.1].map(bias);
        let exponents = [0, 1, 2].map(|i| (biases[i] / biases[i + 1]).log2());
        println!("{technique}: predicted exponents {exponents:.3?}");
        assert!((exponents[2] - 2.0).abs() < 0.05);
        assert!(exponents[0] > exponents[1] && exponents[1] > exponents[2]);
    }
    let mut measured = |technique: &str, scene, radius: f64, light_paths, iterations| {
        let settings = Settings {
            light_paths: LightPaths::Count(light_paths),
            beams: Some(50_000),
            ..once(technique, Some(radius * distance(&case)))
        };
        let (result, _) = render(scene, &settings, iterations);
        if technique != "bb1d" {
            let predicted = smoothed(technique, &case, radius * distance(&case));
            table.check(&format!("{technique}, radius {radius}"), result, predicted, 1e-4 * predicted);
        }
        (result.mean / expected - 1.0, result.error / expected)
    };
    // Of the wide one a larger error is as small a part of the bias.
    for (technique, scene, light_paths) in
        [("pp3d", &many, [10_000, 25_000]), ("pb2d", &one, [50_000; 2]), ("bb1d", &one, [50_000; 2])]
    {
        let wide = measured(technique, scene, 0.8, light_paths[0], 20);
        let narrow = measured(technique, scene, 0.4, light_paths[1], 60);
        let exponent = (wide.0 / narrow.0).log2();
        let error = (wide.1 / wide.0).hypot(narrow.1 / narrow.0) / std::f64::consts::LN_2;
        println!(
            "{technique}: {:+.2} ± {:.2} %, {:+.2} ± {:.2} % with half the radius, exponent {exponent:.2} ± {error:.2}",
            100.0 * wide.0,
            100.0 * wide.1,
            100.0 * narrow.0,
            100.0 * narrow.1,
        );
        assert!(
            exponent > 2.0 - 4.0 * error && exponent < 2.5 + 4.0 * error,
            "{technique}: {exponent} ± {error}"
        );
    }
    table.finish();
}

#[test]
fn slab_reflection() {
    let mut table = Table::new(1e-3);
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
