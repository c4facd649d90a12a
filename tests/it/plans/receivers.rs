//! Many lamps in many rooms: next events choose those that arrive.

use std::fmt::Write as _;

use upbp_core::{FrozenPlan, Settings, Start, TechniqueSet, Techniques};
use upbp_scene::ReadyScene;
use upbp_testing::{Estimate, assert_same, channels, renderer};

/// Cells without a lid, `side` by `side`, each with two lamps;
/// seen from above, with the same pixels per cell.
fn cells(side: u32) -> ReadyScene {
    let mut shapes = String::new();
    for (x, z) in (0..side).flat_map(|x| (0..side).map(move |z| (x, z))) {
        let (x, z) = (x as f32, z as f32);
        for (u, edge) in
            [(0.98, "(0, 0.5, 0), edge_v: (0, 0, 0.96)"), (0.02, "(0, 0, 0.96), edge_v: (0, 0.5, 0)")]
        {
            let _ = write!(
                shapes,
                "(material: \"grey\", geometry: Quad(origin: ({}, 0, {}), edge_u: {edge})),",
                x + u,
                z + 0.02
            );
        }
        for (w, edge) in
            [(0.98, "(0.96, 0, 0), edge_v: (0, 0.5, 0)"), (0.02, "(0, 0.5, 0), edge_v: (0.96, 0, 0)")]
        {
            let _ = write!(
                shapes,
                "(material: \"grey\", geometry: Quad(origin: ({}, 0, {}), edge_u: {edge})),",
                x + 0.02,
                z + w
            );
        }
        for lamp in [0.2, 0.8] {
            let _ = write!(
                shapes,
                "(material: \"black\", emission: 40, geometry: Sphere(centre: ({}, 0.2, {}), radius: 0.02)),",
                x + lamp,
                z + 0.3 * lamp + 0.1
            );
        }
    }
    let text = format!(
        r#"(
  version: 1,
  camera: Perspective(origin: ({half}, 40, {half}), target: ({half}, 0, {half}), up: (0, 0, 1), fov_degrees: {fov}),
  film: (width: {pixels}, height: {pixels}),
  materials: {{ "grey": Lambert(0.4), "black": Lambert(0.0) }},
  shapes: [ (material: "grey", geometry: Quad(origin: (0, 0, 0), edge_u: (0, 0, {side}), edge_v: ({side}, 0, 0))), {shapes} ],
)"#,
        half = 0.5 * side as f32,
        fov = 2.0 * (0.5 * side as f32 / 40.0).atan().to_degrees(),
        pixels = 12 * side,
    );
    ReadyScene::from_ron_str(&text, ".").expect("a valid scene")
}

/// Mean over a picture after some iterations, by seeds.
fn picture(scene: &ReadyScene, techniques: Techniques, iterations: u32) -> [Estimate; 3] {
    let means: Vec<[f64; 3]> = (0..6)
        .map(|seed| {
            let settings = Settings { seed, techniques, ..Settings::default() };
            let mut renderer = renderer(scene, Settings { deterministic: true, ..settings });
            (0..iterations).for_each(|_| assert!(renderer.iterate()));
            renderer.film().image().mean()
        })
        .collect();
    channels(&means)
}

/// The plan of path tracing, with the text of its choice of emitters.
fn plan(scene: &ReadyScene) -> (FrozenPlan, String) {
    let settings = Settings { techniques: Techniques::Set(TechniqueSet::PT), ..Settings::default() };
    let plan = renderer(scene, settings).state().identity().frozen_plan();
    let text = plan.to_ron();
    (plan, text)
}

/// Estimated relMSE of path tracing after some iterations.
fn error(scene: &ReadyScene) -> f64 {
    let settings = Settings { techniques: Techniques::Set(TechniqueSet::PT), ..Settings::default() };
    let mut renderer = renderer(scene, settings);
    (0..64).for_each(|_| assert!(renderer.iterate()));
    renderer.film().estimated_error().relative_mse
}

/// Alike for all receivers, one next event in 36 would choose a lamp of the cell at hand, for 36 times the
/// variance. By receiver it is at most a third of that.
#[test]
fn the_error_of_a_cell_depends_little_on_the_number_of_others() {
    let [one, many] = [1, 6].map(|side| error(&cells(side)));
    println!("{one}, {many}");
    assert!(many < 12.0 * one, "{one}, {many}");
}

#[test]
fn a_choice_by_receiver_is_part_of_the_plan() {
    let scene = cells(4);
    let (frozen, text) = plan(&scene);
    assert!(text.contains("receivers"), "{text}");
    assert_eq!(FrozenPlan::from_ron(&text).as_ref(), Ok(&frozen));
    // A render by this plan is the render that made it.
    let settings = || Settings { techniques: Techniques::Set(TechniqueSet::PT), ..Settings::default() };
    let mut own = renderer(&scene, settings());
    let start = Start { plan: Some(frozen.clone()), ..Start::default() };
    let mut given = scene.start_renderer(settings().validate().unwrap(), start).unwrap();
    (0..3).for_each(|_| assert!(own.iterate() && given.iterate()));
    assert_eq!(own.film().image().mean(), given.film().image().mean());
    // It is of no use to another scene.
    let other = cells(2);
    let start = Start { plan: Some(frozen), ..Start::default() };
    assert!(other.start_renderer(settings().validate().unwrap(), start).is_err());
}

#[test]
fn subsets_of_techniques_agree_where_receivers_choose() {
    let scene = cells(3);
    let set = |names: &str| Techniques::Set(names.parse().expect("names"));
    let expected = picture(&scene, set("hit+lt"), 64);
    for names in ["pt", "bpt", "hit+nee+surf"] {
        assert_same(picture(&scene, set(names), 64), expected, 0.01, names);
    }
}
