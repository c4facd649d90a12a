//! A medium around everything: beams that end nowhere, and light from infinity that gets through in some
//! channels only.

use std::f64::consts::PI;

use upbp_core::{BeamExtent, Heuristic, LightPaths, Radii, Radius, Settings};
use upbp_scene::ReadyScene;
use upbp_testing::{Estimate, assert_same, render_channels};

/// Per channel: red, green, blue.
type Rgb = [f64; 3];

fn scene(parts: &str) -> ReadyScene {
    let text = format!("(version: 1, {parts})");
    ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn fixed_radii(radius: f32) -> Radii {
    let radius = Radius::Absolute(radius);
    Radii::all(radius)
}

/// Share of what is extinguished that is scattered.
const ALBEDO: f64 = 0.8;

/// Place of the light, seen from the camera that looks along z.
const LIGHT: [f64; 2] = [1.0, 2.0];

/// A point light of intensity 1 in fog without an end, and a black ball beside it, which makes the scene half
/// a unit large. All pixels see the same.
fn fog(sigma_t: Rgb) -> ReadyScene {
    let [a, s] = [1.0 - ALBEDO, ALBEDO].map(|share| sigma_t.map(|sigma| share * sigma));
    scene(&format!(
        "camera: Perspective(origin: (0, 0, 0), target: (0, 0, 1), up: (0, 1, 0), fov_degrees: 0.02), film: (width: 8, height: 8),
        outside: \"m\", media: {{\"m\": Homogeneous(sigma_a: ({}, {}, {}), sigma_s: ({}, {}, {}))}},
        materials: {{\"black\": Lambert(0.0)}},
        shapes: [(geometry: Sphere(centre: ({}, -0.9, {}), radius: 0.1), material: \"black\")],
        lights: [Point(position: ({}, 0, {}), intensity: 1)]",
        a[0], a[1], a[2], s[0], s[1], s[2], LIGHT[0], LIGHT[1], LIGHT[0], LIGHT[1],
    ))
}

/// The light that was scattered once, by quadrature: `∫ σ_s/4π e^{−σ_t (t + d)}/d² dt` with t along the ray
/// and d from there to the light.
fn once(sigma_t: f64) -> f64 {
    const STEPS: u32 = 100_000;
    let [across, along] = LIGHT;
    // Even steps of the angle under which the light sees the ray.
    let first = (-along / across).atan();
    let step = (0.5 * PI - first) / f64::from(STEPS);
    let integrand = |i: u32| {
        let angle = first + (f64::from(i) + 0.5) * step;
        let t = along + across * angle.tan();
        let distance = across / angle.cos();
        (-sigma_t * (t + distance)).exp() / across * step
    };
    ALBEDO * sigma_t / (4.0 * PI) * (0..STEPS).map(integrand).sum::<f64>()
}

fn beams(techniques: &str, extent: BeamExtent, max_length: u32) -> Settings {
    Settings {
        techniques: techniques.parse().expect("technique names"),
        photon_beams: extent,
        radii: fixed_radii(0.03),
        progressive: false,
        min_length: 2,
        max_length,
        light_paths: LightPaths::Count(10_000),
        beams: Some(10_000),
        ..Settings::default()
    }
}

/// Beams would have to be as long as light gets, and weights to know where they end.
#[test]
fn no_light_of_beams_is_lost_in_fog_without_an_end() {
    let mut failures = Vec::new();
    for sigma_t in [[0.04; 3], [0.01, 0.2, 2.0], [0.0, 0.04, 0.8]] {
        let fog = fog(sigma_t);
        let expected = sigma_t.map(once);
        for (techniques, extent) in [
            ("bb1d", BeamExtent::Long),
            ("bb1d", BeamExtent::Short),
            ("nee+bb1d", BeamExtent::Long),
            ("bp2d", BeamExtent::Long),
            ("all", BeamExtent::Long),
        ] {
            let found = render_channels(&fog, &beams(techniques, extent, 2), 40);
            for c in 0..3 {
                let Estimate { mean, error } = found[c];
                // A kernel blurs by a tenth of a per cent.
                let difference = ((mean - expected[c]).abs() - 2e-3 * expected[c]).max(0.0);
                let row = format!(
                    "{sigma_t:?} {techniques} {extent:?} {c}: {:+.2} ± {:.2} % of {:.3e}",
                    100.0 * (mean / expected[c] - 1.0),
                    100.0 * error / expected[c],
                    expected[c],
                );
                println!("{row}");
                if difference > 4.0 * error || error > 0.06 * expected[c] {
                    failures.push(row);
                }
            }
        }
    }
    assert!(failures.is_empty(), "beyond four standard errors:\n{}", failures.join("\n"));
}

#[test]
fn all_beams_agree_with_next_events_after_several_scatterings() {
    let fog = fog([0.01, 0.2, 2.0]);
    let expected = render_channels(&fog, &beams("nee", BeamExtent::Short, 5), 400);
    for techniques in ["nee+bb1d", "all"] {
        let found = render_channels(&fog, &beams(techniques, BeamExtent::Long, 5), 60);
        // Next events find little of the blue light, which does not get far.
        assert_same(found, expected, 0.25, techniques);
    }
}

/// A white ball that all pixels show, under a sky of radiance 1, maybe in a medium; and what else there is.
fn sky(outside: &str, lights: &str, shapes: &str) -> ReadyScene {
    scene(&format!(
        "camera: Perspective(origin: (0, 0, 3), target: (0, 0, 0), fov_degrees: 20), film: (width: 8, height: 8), {outside}
        media: {{
            \"red passes\": Homogeneous(sigma_a: (0, 0.1, 0.2), sigma_s: (0, 0.5, 0.1)),
            \"milk\": Homogeneous(sigma_a: 0.2, sigma_s: (1.5, 1.0, 0.5)),
        }},
        materials: {{\"white\": Lambert(0.5), \"null\": Null}},
        shapes: [(geometry: Sphere(centre: (0, 0, 0), radius: 1), material: \"white\"), {shapes}],
        lights: [Constant(1), {lights}]",
    ))
}

fn sky_settings(techniques: &str) -> Settings {
    Settings { techniques: techniques.parse().expect("technique names"), ..Settings::default() }
}

const RED_PASSES: &str = "outside: \"red passes\",";

#[test]
fn light_from_infinity_arrives_in_the_channels_that_let_it_through() {
    let scene = sky(RED_PASSES, "", "");
    for (techniques, iterations) in
        [("hit", 600), ("nee", 200), ("lt", 100), ("surf", 150), ("pt", 200), ("all", 60)]
    {
        let settings = Settings {
            light_paths: LightPaths::Count(10_000),
            beams: Some(2_000),
            radii: fixed_radii(0.05),
            ..sky_settings(techniques)
        };
        let found = render_channels(&scene, &settings, iterations);
        let sigmas = found[0].sigmas(&Estimate::exactly(0.5));
        println!("{techniques}: {found:?}, {sigmas:+.2} sigma");
        assert!(found[0].error < 0.05 && sigmas.abs() < 4.0, "{techniques}: {found:?}");
        assert_eq!([found[1].mean, found[2].mean], [0.0; 2], "{techniques}");
    }
}

/// A walk from infinity arrives with some probability, which a long beam would have to know of.
#[test]
fn beams_of_light_that_arrives_in_part_lose_none() {
    let sun = "Directional(direction: (1, -2, -1), irradiance: 2)";
    let ball =
        "(geometry: Sphere(centre: (0, 0.6, 1.2), radius: 0.3), material: \"null\", interior: \"milk\")";
    let [without, within] = ["", RED_PASSES].map(|outside| sky(outside, sun, ball));
    // The power heuristic has no lanes.
    for (techniques, heuristic, iterations) in
        [("bp2d", Heuristic::Balance, 300), ("bb1d", Heuristic::Power, 200)]
    {
        let settings = Settings {
            photon_beams: BeamExtent::Long,
            heuristic,
            radii: fixed_radii(0.03),
            progressive: false,
            light_paths: LightPaths::Count(10_000),
            beams: Some(10_000),
            ..sky_settings(techniques)
        };
        let [[expected, ..], [found, ..]] =
            [&without, &within].map(|scene| render_channels(scene, &settings, iterations));
        let sigmas = found.sigmas(&expected);
        let case = format!("{techniques}, {heuristic:?}: {found:?}, expected {expected:?}");
        println!("{case}, {sigmas:+.2} sigma");
        assert!(found.error.max(expected.error) < 0.1 * expected.mean && sigmas.abs() < 4.0, "{case}");
    }
}

#[test]
fn and_there_is_as_if_there_were_no_medium() {
    let sun = "Directional(direction: (1, -2, -1), irradiance: 2)";
    let ball =
        "(geometry: Sphere(centre: (0, 0.6, 1.2), radius: 0.3), material: \"null\", interior: \"milk\")";
    let [expected, ..] = render_channels(&sky("", sun, ball), &sky_settings("pt"), 600);
    let scene = sky(RED_PASSES, sun, ball);
    for techniques in ["pt", "lt+hit", "bpt", "bpt+pp3d+pb2d+bp2d+bb1d"] {
        let settings = Settings { radii: fixed_radii(0.01), progressive: false, ..sky_settings(techniques) };
        let found = render_channels(&scene, &settings, 200);
        let sigmas = found[0].sigmas(&expected);
        println!("{techniques}: {found:?}, expected {expected:?}, {sigmas:+.2} sigma");
        assert!(sigmas.abs() < 4.0, "{techniques}: {found:?}, expected {expected:?}");
        let error = found[0].error.hypot(expected.error);
        assert!(error < 0.04 * expected.mean, "{techniques}: too noisy to tell, {error} of {expected:?}");
        assert_eq!([found[1].mean, found[2].mean], [0.0; 2], "{techniques}");
    }
}
