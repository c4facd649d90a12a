//! The choice of techniques: it leaves out what a scene does not need, changes no expectation, and can be
//! repeated and frozen.

use std::num::NonZeroU32;
use std::path::Path;

use upbp_core::{
    FrozenPlan, LightPaths, Radii, Radius, Settings, Start, Stop, TechniqueSet, Techniques, read_exr,
};
use upbp_scene::ReadyScene;
use upbp_scene::description::{Count, Film};
use upbp_testing::{Estimate, assert_same, channels, renderer, short_renderer};

fn settings() -> Settings {
    Settings { deterministic: true, ..Settings::default() }
}

/// The plan that a render chooses.
fn frozen(scene: &ReadyScene, settings: Settings) -> FrozenPlan {
    renderer(scene, settings).state().identity().frozen_plan()
}

/// By a plan that is given.
fn by(plan: FrozenPlan) -> Start<'static> {
    Start { plan: Some(plan), ..Start::default() }
}

fn shipped(name: &str) -> ReadyScene {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    ReadyScene::load(root.join(format!("examples/scenes/{name}.ron"))).expect("a valid scene")
}

/// Mean of the reference image of a scene.
fn reference(name: &str) -> [Estimate; 3] {
    let path = format!("{}/tests/data/references/{name}.exr", env!("CARGO_MANIFEST_DIR"));
    read_exr(Path::new(&path)).expect("a reference").mean().map(Estimate::exactly)
}

/// Matt things under an overcast sky, in a picture that is large enough for a pilot render to tell.
const MATT: &str = r#"(
  version: 1,
  camera: Perspective(origin: (0, 1, 3.4), target: (0, 0.6, 0), fov_degrees: 40),
  film: (width: 96, height: 96),
  materials: { "white": Lambert(0.7), "red": Lambert((0.6, 0.1, 0.1)) },
  shapes: [
    (material: "white", geometry: Quad(origin: (-2, 0, -2), edge_u: (0, 0, 4), edge_v: (4, 0, 0))),
    (material: "red", geometry: Quad(origin: (-1, 0, -1), edge_u: (2, 0, 0), edge_v: (0, 2, 0))),
    (material: "white", geometry: Sphere(centre: (0, 0.5, 0), radius: 0.5)),
  ],
  lights: [ Constant(1) ],
)"#;

#[test]
fn camera_sub_paths_alone_where_they_suffice() {
    let scene = ReadyScene::from_ron_str(MATT, ".").expect("a valid scene");
    let mut auto = renderer(&scene, settings());
    let roulette = Some(auto.report().plan.roulette);
    let techniques = Techniques::Set(TechniqueSet::PT);
    let mut paths = renderer(&scene, Settings { techniques, roulette, ..settings() });
    for _ in 0..8 {
        assert!(auto.iterate() && paths.iterate());
    }
    let report = auto.report();
    assert_eq!(report.plan.techniques, TechniqueSet::PT, "{report}");
    let counters = report.counters;
    assert_eq!(
        [counters.light_edges, counters.light_vertices, counters.photon_beams, report.map_bytes],
        [0; 4],
        "no light sub-paths, nothing built"
    );
    // The same samples, at the same cost.
    assert_eq!(auto.film().image(), paths.film().image());
    assert_eq!(counters, paths.report().counters);
}

#[test]
fn light_that_only_merges_find_is_not_lost() {
    let scene = shipped("suite/surface_caustic");
    for seed in 0..4 {
        let plan = renderer(&scene, Settings { seed, ..settings() }).report().plan;
        assert!(plan.techniques.has(upbp_core::Technique::Surf) && plan.light_paths > 0, "{plan}");
    }
}

/// A preparation that met no light does not know which techniques find it.
#[test]
fn everything_looks_for_light_that_the_preparation_did_not_meet() {
    const SHINES_AWAY: &str = r#"(
        version: 1,
        camera: Perspective(origin: (0, 1, 3.4), target: (0, 0.6, 0), fov_degrees: 40),
        film: (width: 16, height: 16),
        materials: { "white": Lambert(0.7) },
        shapes: [
            (material: "white", geometry: Quad(origin: (-2, 0, -2), edge_u: (0, 0, 4), edge_v: (4, 0, 0))),
            (material: "white", emission: 1, geometry: Quad(origin: (0, 5, 0), edge_u: (0, 0, 1), edge_v: (1, 0, 0))),
        ],
    )"#;
    let scene = ReadyScene::from_ron_str(SHINES_AWAY, ".").expect("a valid scene");
    let plan = renderer(&scene, settings()).report().plan;
    assert_eq!(plan.techniques, TechniqueSet::BPT.with(upbp_core::Technique::Surf), "{plan}");
    assert!(plan.light_paths > 0, "{plan}");
}

/// Kernels of surface photons may be as wide as a pixel, where that is more than usual and nobody asked for a
/// radius.
#[test]
fn surface_photons_blur_what_a_pixel_blurs() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes/suite/surface_caustic.ron");
    let first = |settings: Settings, side| {
        let side = Count::new(side).expect("a positive number");
        let film = Film { width: side, height: side, crop: None };
        let scene = ReadyScene::load_with(&path, |description| description.film = film);
        renderer(&scene.expect("a valid scene"), settings).report().plan.radii.surf
    };
    let fixed = || Settings { techniques: "bpt+surf".parse().expect("names"), ..settings() };
    let usual = first(fixed(), 96);
    let wide = first(settings(), 96);
    assert!((1.5..=4.0).contains(&(wide / usual)), "{wide}, usually {usual}");
    assert_eq!(first(settings(), 960), first(fixed(), 960), "pixels are small");
    let radii = Radii { surf: Radius::Absolute(0.01), ..Radii::default() };
    assert_eq!(first(Settings { radii, ..settings() }, 96), 0.01);
}

/// Mean over 20 seeds, each of which chooses for itself, with its standard error, against the reference.
///
/// Kernels have a fifth of their usual width: wider ones blur light, whoever chose them, and this is about
/// what choosing does.
#[test]
fn no_bias_in_fog() {
    const SEEDS: u64 = 20;
    const ITERATIONS: u64 = 4;
    let scene = shipped("reference/fog_cornell");
    let expected = reference("fog_cornell");
    let radii = Radii::all(Radius::Scene(6e-4));
    let mut plans = std::collections::BTreeSet::new();
    let means: Vec<[f64; 3]> = (0..SEEDS)
        .map(|seed| {
            let settings = Settings { seed, radii, ..Settings::default() };
            let mut renderer = short_renderer(&scene, settings, ITERATIONS);
            for _ in 0..ITERATIONS {
                assert!(renderer.iterate());
            }
            plans.insert(renderer.report().plan.to_string());
            renderer.film().image().mean()
        })
        .collect();
    println!("{} plans: {plans:#?}", plans.len());
    assert_same(channels(&means), expected, 2e-3, "fog_cornell");
}

/// A render of few iterations where one pixel in eight makes the queries of surface merging is as bright as
/// one where all do. If whole iterations took turns, three of them would have all light that merges find
/// times 8/3, or none.
#[test]
fn few_iterations_with_queries_in_some_pixels_are_as_bright() {
    let scene = shipped("suite/surface_caustic");
    let techniques = "hit+nee+surf".parse::<TechniqueSet>().expect("names").into();
    let always = frozen(&scene, Settings { techniques, ..settings() });
    let mut in_some_pixels = always.clone();
    in_some_pixels.plan.periods.surf = NonZeroU32::new(8).expect("a period");
    let differences: Vec<f64> = (0..12)
        .map(|seed| {
            let render = |plan: &FrozenPlan| {
                let settings = Settings { seed, ..settings() }.validate().expect("valid settings");
                let mut renderer = scene.start_renderer(settings, by(plan.clone())).expect("a plan for it");
                (0..3).for_each(|_| assert!(renderer.iterate()));
                renderer.film().image().mean()[1]
            };
            render(&in_some_pixels) / render(&always) - 1.0
        })
        .collect();
    let square = differences.iter().map(|x| x * x).sum::<f64>() / differences.len() as f64;
    assert!(square.sqrt() < 0.1, "{differences:?}");
}

/// A render by the plan that its own seed has chosen against one by the plan of the next seed, with kernels
/// of the usual width: plans of all seeds blur alike on average, so that what is left is what a plan and the
/// samples that it serves have to do with each other.
#[test]
fn a_plan_knows_nothing_of_the_samples_that_it_serves() {
    const SEEDS: u64 = 12;
    const ITERATIONS: u64 = 4;
    let scene = shipped("reference/forward_hg_box");
    let settings = |seed| Settings { seed, ..Settings::default() };
    let plan = |seed| short_renderer(&scene, settings(seed), ITERATIONS).state().identity().frozen_plan();
    let plans: Vec<FrozenPlan> = (0..=SEEDS).map(plan).collect();
    let render = |seed, plan: &FrozenPlan| {
        let settings = settings(seed).validate().expect("valid settings");
        let mut renderer = scene.start_renderer(settings, by(plan.clone())).expect("a plan of this scene");
        for _ in 0..ITERATIONS {
            assert!(renderer.iterate());
        }
        renderer.film().image().mean()
    };
    let expected = reference("forward_hg_box");
    let pairs = plans.windows(2).zip(0..);
    let differences: Vec<[f64; 3]> = pairs
        .map(|(plans, seed)| {
            let (own, other) = (render(seed, &plans[0]), render(seed, &plans[1]));
            std::array::from_fn(|c| (own[c] - other[c]) / expected[c].mean)
        })
        .collect();
    assert!(differences.iter().any(|difference| *difference != [0.0; 3]), "all seeds choose the same");
    let ratios: Vec<_> = differences.iter().map(|difference| difference.map(|d| 1.0 + d)).collect();
    assert_same(channels(&ratios), [Estimate::exactly(1.0); 3], 2e-3, "own plan against another's");
}

#[test]
fn a_frozen_plan_makes_the_same_iterations() {
    let scene = shipped("reference/mirror_fog");
    let measured = Settings { light_paths: LightPaths::Count(2000), ..Settings::default() };
    let mut first = renderer(&scene, measured.clone());
    for _ in 0..4 {
        assert!(first.iterate());
    }
    let plan = FrozenPlan::from_ron(&first.state().identity().frozen_plan().to_ron()).expect("a plan");
    let checked = || measured.clone().validate().expect("valid settings");
    let part = |range: std::ops::Range<u64>| {
        let mut renderer = scene.start_renderer(checked(), by(plan.clone())).expect("the plan fits");
        renderer.set_range(range);
        while renderer.iterate() {}
        renderer.state().clone()
    };
    let mut whole = part(2..4);
    whole.merge(part(0..2)).expect("parts of one render");
    assert_eq!(whole.report().film_fingerprint, first.report().film_fingerprint);

    // A state takes its plan along.
    let mut resumed = renderer(&scene, measured.clone());
    resumed.resume(part(0..2)).expect("the same render");
    assert!(resumed.iterate() && resumed.iterate());
    assert_eq!(resumed.report().film_fingerprint, first.report().film_fingerprint);
    assert_eq!(resumed.state().identity().frozen_plan(), plan);
}

/// A plan that the render would not have chosen is kept when it is resumed, whatever its limits are then. The
/// scene has two lights, whose shares depend on whether there are light sub-paths.
#[test]
fn a_render_that_is_resumed_keeps_its_plan() {
    let scene = shipped("reference/chromatic_sphere");
    let auto = || Settings::default().validate().expect("valid settings");
    for names in ["hit+nee", "bpt", "bpt+surf+pb2d"] {
        let techniques = names.parse::<TechniqueSet>().expect("names").into();
        let plan = frozen(&scene, Settings { techniques, ..settings() });
        let run = |iterations| {
            let mut renderer = scene.start_renderer(auto(), by(plan.clone())).expect("a plan for it");
            (0..iterations).for_each(|_| assert!(renderer.iterate()));
            renderer
        };
        let state = run(2).state().clone();
        let stop = Stop { iterations: Some(5), ..Stop::default() };
        let start = Start { stop, ..by(state.identity().frozen_plan()) };
        let mut resumed = scene.start_renderer(auto(), start).expect("a valid render");
        resumed.resume(state).expect("the same render");
        (0..3).for_each(|_| assert!(resumed.iterate()));
        assert_eq!(resumed.film().fingerprint(), run(5).film().fingerprint(), "{names}");
    }
}

/// A limit of time cuts the measurement of lights short, by the clock: the render that goes on does not
/// measure them again.
#[test]
fn a_render_that_is_resumed_keeps_its_choice_of_emitters() {
    let scene = shipped("suite/many_lights");
    let checked = || Settings::default().validate().expect("valid settings");
    let within = |seconds, start| Start { stop: Stop { seconds: Some(seconds), ..Stop::default() }, ..start };
    let mut first = scene.start_renderer(checked(), within(0.01, Start::default())).expect("a valid render");
    assert!(first.iterate());
    let state = first.state().clone();
    let start = within(100.0, by(state.identity().frozen_plan()));
    let mut resumed = scene.start_renderer(checked(), start).expect("a valid render");
    resumed.resume(state).expect("the same render");
    assert!(resumed.iterate());
}

#[test]
fn a_plan_that_does_not_fit_is_refused() {
    let fog = shipped("reference/mirror_fog");
    let everything = Settings { techniques: TechniqueSet::STANDARD.into(), ..settings() };
    let plan = frozen(&fog, everything);
    let checked = || {
        let settings = Settings { memory: Some(2048), ..settings() };
        settings.validate().expect("valid settings")
    };
    let greedy = plan.to_ron().replace("light_paths: 4096,", "light_paths: 4000000000,");
    let greedy = FrozenPlan::from_ron(&greedy).expect("a plan");
    let error = fog.start_renderer(checked(), by(greedy)).expect_err("too much").to_string();
    assert!(error.starts_with("plan: needs") && error.contains("2048"), "{error}");
    let matt = ReadyScene::from_ron_str(MATT, ".").expect("a valid scene");
    let error = matt.start_renderer(checked(), by(plan)).expect_err("no media here").to_string();
    assert!(error.contains("pb2d") && error.contains("cannot be used"), "{error}");
    let lamps = frozen(&shipped("suite/many_lights"), settings());
    let plan = FrozenPlan { emitters: lamps.emitters, ..frozen(&matt, settings()) };
    let error = matt.start_renderer(checked(), by(plan)).expect_err("other lights").to_string();
    assert!(error.contains("among the 1 emitters"), "{error}");
    let mut endless = frozen(&matt, settings());
    endless.plan.connections = 1e9;
    let error = matt.start_renderer(checked(), by(endless)).expect_err("not a plan").to_string();
    assert!(error.starts_with("plan: connections") && error.contains("1000000000"), "{error}");
}
