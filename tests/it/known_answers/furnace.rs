//! Nothing absorbs, or what is absorbed is emitted again: every ray has radiance 1.

use upbp_testing::analytic::{Case, Table, cases, scene, settings, vector};
use upbp_testing::{render, render_channels, renderer};

/// The part that merges may lose at boundaries, where a kernel sticks out of its medium; falls with the
/// radius.
const BOUNDARY_LOSS: f64 = 0.005;

fn describe(case: &Case) -> String {
    let albedo = case.optional("albedo").unwrap_or(1.0);
    let sigma_t = case.optional("sigma_t").unwrap_or(0.0);
    let g = case.optional("g").unwrap_or(0.0);
    let emission = case.optional("Le").unwrap_or(0.0);
    let medium = format!(
        "media: {{\"m\": Homogeneous(sigma_a: {:?}, sigma_s: {:?}, phase: HenyeyGreenstein({g:?}), emission: {emission:?})}},",
        (1.0 - albedo) * sigma_t,
        albedo * sigma_t
    );
    let ball = |material: &str, interior: &str| {
        format!(
            "(geometry: Sphere(centre: (0.0, 0.0, 0.0), radius: 1.0), material: \"{material}\"{interior}),"
        )
    };
    let inside = ", interior: \"m\"";
    let (camera, shapes) = match case.id.as_str() {
        "furnace_closed_emitter" => ("(0.1, 0.2, 0.7)", closed_box()),
        "furnace_env_dielectric_clear" => ("(0.0, 0.0, 3.0)", ball("glass", "")),
        "furnace_env_mirror_and_fog" => {
            let mirror = "(geometry: Sphere(centre: (0.0, 0.0, 0.0), radius: 0.4), material: \"mirror\"),";
            ("(0.0, 0.0, 3.0)", ball("null", inside) + mirror)
        }
        id if id.contains("dielectric") => ("(0.0, 0.0, 3.0)", ball("glass", inside)),
        _ => ("(0.0, 0.0, 3.0)", ball("null", inside)),
    };
    let (lights, outside) = if case.id == "furnace_closed_emitter" {
        ("", "outside: \"m\",")
    } else {
        ("lights: [Constant(1.0)],", "")
    };
    format!(
        "camera: Perspective(origin: {camera}, target: (0.0, 0.0, 0.0), fov_degrees: 26.0),
        film: (width: 24, height: 24), {outside} {medium}
        materials: {{\"null\": Null, \"mirror\": Mirror(1.0), \"glass\": Dielectric(ior: 1.5), \"grey\": Lambert(0.5)}},
        shapes: [{shapes}], {lights}"
    )
}

/// A room of side 2 whose walls shine inwards and reflect one half.
fn closed_box() -> String {
    let wall = |axis: usize, side: f64| {
        // The normal, u × v, points inwards.
        let (u, v) = if side < 0.0 { (axis + 1, axis + 2) } else { (axis + 2, axis + 1) };
        let edge = |along: usize| std::array::from_fn(|i| if i == along % 3 { 2.0 } else { 0.0 });
        let origin = std::array::from_fn(|i| if i == axis { side } else { -1.0 });
        format!(
            "(geometry: Quad(origin: {}, edge_u: {}, edge_v: {}), material: \"grey\", emission: 0.5),",
            vector(origin),
            vector(edge(u)),
            vector(edge(v))
        )
    };
    (0..3).flat_map(|axis| [wall(axis, -1.0), wall(axis, 1.0)]).collect()
}

#[test]
fn white_furnace() {
    let mut table = Table::new(0.02);
    for case in cases("white_furnace") {
        let scene = scene(&describe(&case));
        for techniques in ["hit", "pt", "bpt", "bpt+surf+pp3d+pb2d+bb1d", "hit+surf+pb2d"] {
            let settings = settings(techniques, None);
            let merges = techniques.contains("surf");
            let (result, _) = render(&scene, &settings, 12);
            let slack = if merges { BOUNDARY_LOSS } else { 0.0 };
            table.check(&format!("{} {techniques}", case.id), result, 1.0, slack);
        }
    }
    table.finish();
}

/// A white furnace whose channels differ by `ratio`: a ball with two mean free paths per radius in the middle
/// channel.
fn chromatic(ratio: f64, body: &str) -> String {
    let sigma = vector([2.0 / ratio.sqrt(), 2.0, 2.0 * ratio.sqrt()]);
    let ball = |radius: f64, material: &str, interior: &str| {
        format!(
            "(geometry: Sphere(centre: (0.0, 0.0, 0.0), radius: {radius:?}), material: \"{material}\", interior: \"{interior}\"),"
        )
    };
    let shapes = match body {
        "dielectric" => ball(1.0, "glass", "m"),
        "nested" => ball(1.0, "null", "m") + &ball(0.5, "null", "n"),
        _ => ball(1.0, "null", "m"),
    };
    format!(
        "camera: Perspective(origin: (0.0, 0.0, 3.0), target: (0.0, 0.0, 0.0), fov_degrees: 26.0),
        film: (width: 24, height: 24),
        media: {{\"m\": Homogeneous(sigma_a: 0.0, sigma_s: {sigma}), \"n\": Homogeneous(sigma_a: 0.0, sigma_s: (3.0, 0.0, 0.5))}},
        materials: {{\"null\": Null, \"glass\": Dielectric(ior: 1.5)}},
        shapes: [{shapes}], lights: [Constant(1.0)]"
    )
}

/// Every channel is within four standard errors of one, and those are below two per cent, where channels
/// scatter into other directions: with directions from the mean of their phase functions, drawn anew at each
/// collision, the ball is up to 30 % too dark but for a few pixels that are many times too bright.
#[test]
fn channels_that_scatter_into_other_directions_are_white() {
    for g in [[0.9, 0.7, 0.5], [0.7, 0.3, -0.4]] {
        let phase = format!(
            "PerChannel(r: HenyeyGreenstein({:?}), g: HenyeyGreenstein({:?}), b: HenyeyGreenstein({:?}))",
            g[0], g[1], g[2]
        );
        let scene = scene(&format!(
            "camera: Perspective(origin: (0, 0, 3), target: (0, 0, 0), fov_degrees: 26), film: (width: 16, height: 16),
            media: {{\"m\": Homogeneous(sigma_a: 0, sigma_s: 16, phase: {phase})}}, materials: {{\"null\": Null}},
            shapes: [(geometry: Sphere(centre: (0, 0, 0), radius: 1), material: \"null\", interior: \"m\")], lights: [Constant(1)]"
        ));
        for (techniques, iterations) in [("hit", 100), ("bpt", 40)] {
            let settings = settings(techniques, None);
            for (channel, found) in render_channels(&scene, &settings, iterations).iter().enumerate() {
                let sigmas = (found.mean - 1.0) / found.error;
                println!("{g:?}, {techniques}, channel {channel}: {found:?}, {sigmas:+.2}");
                assert!(
                    sigmas.abs() < 4.0 && found.error < 0.02,
                    "{g:?}, {techniques}, {channel}: {found:?}"
                );
            }
        }
    }
}

/// Every channel is within four standard errors of one, and those are below one per cent.
#[test]
fn chromatic_white_furnace() {
    for body in ["homogeneous", "dielectric", "nested"] {
        for ratio in [3.0, 200.0] {
            let scene = scene(&chromatic(ratio, body));
            for techniques in ["pt", "bpt"] {
                let settings = settings(techniques, None);
                for (channel, found) in render_channels(&scene, &settings, 100).iter().enumerate() {
                    let sigmas = (found.mean - 1.0) / found.error;
                    let case = format!("{body}, ratio {ratio}, {techniques}, channel {channel}");
                    println!("{case}: {:.5} ± {:.5}, {sigmas:+.2}", found.mean, found.error);
                    assert!(sigmas.abs() < 4.0 && found.error < 0.01, "{case}: {found:?}");
                }
            }
        }
    }
}

#[test]
fn a_dense_ball_keeps_its_light() {
    // 200 mean free paths from the centre to the surface, where merges take place.
    let text = "camera: Perspective(origin: (0.0, 0.0, 6.0), target: (0.0, 0.0, 0.0), fov_degrees: 8.0),
        film: (width: 16, height: 16), media: {\"m\": Homogeneous(sigma_s: 200)}, materials: {\"null\": Null},
        shapes: [(geometry: Sphere(centre: (0.0, 0.0, 0.0), radius: 1.0), material: \"null\", interior: \"m\")],
        lights: [Constant(1.0)],";
    // Kernels that stick out of it lose light, so that automatic ones are at most a part of a mean free path.
    let limit = |radius| {
        let scene = scene(text);
        renderer(&scene, settings("hit+pp3d", radius)).report().plan.radii.most_mean_free_paths
    };
    assert_eq!([limit(None), limit(Some(0.01))], [Some(0.3), None]);
    let mut table = Table::new(0.02);
    for techniques in ["hit+pp3d", "hit+pb2d"] {
        let (result, _) = render(&scene(text), &settings(techniques, None), 24);
        table.check(techniques, result, 1.0, 0.01);
    }
    table.finish();
}
