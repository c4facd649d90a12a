//! Light that was scattered exactly once.

use crate::cases::{Case, Table, cases, medium, narrow_camera, scene, settings, vector};
use crate::support::{Estimate, render};
use upbp_core::{LightPaths, Settings};

fn once(settings: Settings) -> Settings {
    Settings { min_length: 2, max_length: 2, ..settings }
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

/// Distance of the light from the line of sight, and from the nearest end of it if the foot is beyond.
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
        let (result, _) = render(&many, &once(settings("nee", None)), 60);
        table.check(&format!("{} nee", case.id), result, expected, case.accuracy);

        // Fluence around the light goes like 1/r²: at a tenth of the distance a kernel's bias is below 1 %.
        let radius = 0.1 * distance(&case);
        let one = scene(&point_light(&case, &narrow_camera(origin, target, 1)));
        for (techniques, iterations) in [("pb2d", 40), ("bb1d", 40)] {
            let settings = Settings {
                light_paths: LightPaths::Count(20_000),
                beams: Some(20_000),
                ..once(settings(techniques, Some(radius)))
            };
            let (result, _): (Estimate, _) = render(&one, &settings, iterations);
            table.check(&format!("{} {techniques}", case.id), result, expected, 0.01 * expected);
        }
        // Points of the camera: many of them.
        for techniques in ["pp3d", "bp2d"] {
            let settings = Settings {
                light_paths: LightPaths::Count(20_000),
                beams: Some(2_000),
                ..once(settings(techniques, Some(2.0 * radius)))
            };
            let (result, _): (Estimate, _) = render(&many, &settings, 20);
            table.check(&format!("{} {techniques}", case.id), result, expected, 0.04 * expected);
        }
    }
    table.finish();
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
        let (result, _) = render(&scene, &once(settings("nee", None)), 60);
        table.check(&case.id, result, case.expected(&["L_single"]), case.accuracy);
    }
    table.finish();
}
