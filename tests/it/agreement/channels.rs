//! Colours are three numbers and no more: which of them is called red makes no difference.

use upbp_core::{FrozenPlan, Heuristic, LightPaths, RenderError, Settings, Start, TechniqueSet};
use upbp_scene::ReadyScene;
use upbp_testing::{render, render_channels};

/// A scene whose colours are given as a function of the channel.
fn scene(sigma_s: [f32; 3], colour: [f32; 3]) -> ReadyScene {
    let rgb = |[r, g, b]: [f32; 3]| format!("({r:?}, {g:?}, {b:?})");
    let text = format!(
        "(version: 1, camera: Perspective(origin: (0, 0.5, 4), target: (0, 0, 0), fov_degrees: 50),
        film: (width: 16, height: 16),
        media: {{\"m\": Homogeneous(sigma_a: 0.25, sigma_s: {})}},
        materials: {{\"null\": Null, \"floor\": Lambert({}), \"lamp\": Lambert(0)}},
        shapes: [
            (geometry: Box(min: (-1, -1, -1), max: (1, 1, 1)), material: \"null\", interior: \"m\"),
            (geometry: Quad(origin: (-2, -1, -2), edge_u: (0, 0, 4), edge_v: (4, 0, 0)), material: \"floor\"),
            (geometry: Quad(origin: (-1, 2, -1), edge_u: (2, 0, 0), edge_v: (0, 0, 2)), material: \"lamp\",
             emission: {}),
        ],
        lights: [Point(position: (2, 1.5, 1), intensity: {})])",
        rgb(sigma_s),
        rgb(colour),
        rgb(colour),
        rgb(colour),
    );
    match ReadyScene::from_ron_str(&text, "") {
        Ok(scene) => scene,
        Err(error) => panic!("{error}\n{text}"),
    }
}

fn settings() -> Settings {
    Settings {
        techniques: TechniqueSet::STANDARD.into(),
        light_paths: LightPaths::Count(1000),
        max_length: 50,
        ..Settings::default()
    }
}

#[test]
fn exchanged_colours_in_grey_media_exchange_the_image_to_the_bit() {
    let image = |colour| render(&scene([0.75; 3], colour), &settings(), 2).1;
    let one = image([0.25, 0.75, 0.5]);
    let other = image([0.75, 0.25, 0.5]);
    assert_eq!(one.pixels.len(), other.pixels.len());
    for (a, b) in one.pixels.iter().zip(&other.pixels) {
        assert_eq!([a[0], a[1], a[2]], [b[1], b[0], b[2]]);
    }
}

#[test]
fn exchanged_channels_of_a_chromatic_medium_exchange_the_means() {
    let means = |sigma_s, colour| render_channels(&scene(sigma_s, colour), &settings(), 200);
    let one = means([0.5, 1.5, 1.0], [0.25, 0.75, 0.5]);
    let other = means([1.0, 0.5, 1.5], [0.5, 0.25, 0.75]);
    for (c, permuted) in [(0, 1), (1, 2), (2, 0)] {
        let (a, b) = (&one[c], &other[permuted]);
        let sigmas = (a.mean - b.mean) / a.error.hypot(b.error);
        println!("channel {c}: {:.5} and {:.5}, {sigmas:.2} standard errors", a.mean, b.mean);
        assert!(sigmas.abs() < 4.0, "channel {c}: {} and {}, {sigmas} standard errors", a.mean, b.mean);
        assert!(a.error.hypot(b.error) < 0.02 * a.mean, "channel {c}: too noisy to tell");
    }
}

/// Lanes are weighted by the balance heuristic: a plan has none with the other one, and is refused if it has.
#[test]
fn lanes_have_no_power_heuristic() {
    let scene = scene([0.5, 1.5, 1.0], [0.5; 3]);
    let plan_with = |heuristic, plan: Option<FrozenPlan>| {
        let settings = Settings { heuristic, ..settings() }.validate().expect("settings");
        let start = Start { plan, ..Start::default() };
        Ok::<_, RenderError>(scene.start_renderer(settings, start)?.state().identity().frozen_plan())
    };
    let in_lanes = plan_with(Heuristic::Balance, None).expect("a plan");
    assert!(in_lanes.plan.lanes.is_some());
    assert_eq!(plan_with(Heuristic::Power, None).expect("a plan").plan.lanes, None);
    let refused = plan_with(Heuristic::Power, Some(in_lanes.clone())).expect_err("lanes").to_string();
    assert!(refused.contains("`heuristic`: expected Balance, since the plan has lanes"), "{refused}");
    assert_eq!(plan_with(Heuristic::Balance, Some(in_lanes.clone())).expect("the same"), in_lanes);
}
