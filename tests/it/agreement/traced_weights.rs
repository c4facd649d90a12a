//! Weights of real paths: every accepted sample is rebuilt from its vertices and weighed by enumeration
//! (`docs/theory.md`, section 9, item 2).
//!
//! The abstract test of the recursion takes densities as given. Here they are those of the walks: wrong
//! distances, stacks of bodies, reverse densities and thresholds show.

use std::num::NonZeroU32;
use std::sync::Arc;

use glam::Vec3;
use upbp_estimators::mis::{BeamExtent, ByTechnique, Densities, Heuristic, MisPlan, VolumeMerges, Weight};
use upbp_estimators::observer::{ObservedSample, Observer};
use upbp_estimators::path::{Context, EdgeTrace, Extent, WalkState};
use upbp_estimators::scene::{EmitterId, Scene, Walk};
use upbp_estimators::{
    EmissionGuide, EmissionSample, EmitterChoice, EmitterSample, FootprintField, IterationChoices,
    IterationPlan, Kernel, Kernels, MergePeriods, NO_LIMIT, PathLengths, PreparedScene, RadiusField, Ray,
    Roulette, Stream, StreamKind, Survival, Technique, TechniqueSet,
};
use upbp_media::{Medium as _, MediumId};
use upbp_testing::closed_form::fog::Fog;
use upbp_testing::closed_form::material::Material;
use upbp_testing::closed_form::scene::ClosedForm;

use super::audit::{audit_scene, run};

/// Radii of about two per cent of the part of the scene where things are.
fn kernels(scale: f32) -> Kernels {
    Kernels {
        surf: Kernel::disc(0.04 * scale),
        pp3d: Kernel::ball(0.08 * scale),
        pb2d: Kernel::parabolic_disc(0.04 * scale),
        bp2d: Kernel::parabolic_disc(0.04 * scale),
        bb1d: Kernel::parabolic_line(0.03 * scale),
    }
}

fn choices() -> IterationChoices {
    IterationChoices {
        seed: 1,
        iteration: 0,
        techniques: TechniqueSet::ALL,
        light_paths: 6000,
        beam_paths: 500,
        connections: 2.0,
        next_events: 1.0,
        camera_factor: 1.0,
        periods: MergePeriods::ONE,
        vertices_per_light_path: 2.3,
        lengths: PathLengths { min: 1, max: 8 },
        roulette: Roulette::Below(0.6),
        kernels: kernels(1.0),
        radius_field: RadiusField::Uniform,
        mean_free_paths: NO_LIMIT,
        heuristic: Heuristic::Balance,
        photon_beams: BeamExtent::Short,
        query_beams: BeamExtent::Long,
        lanes: None,
        features: false,
    }
}

/// Outside of all bodies, and in the fog.
const CAMERAS: [Vec3; 2] = [Vec3::new(0.2, 0.3, 3.0), Vec3::new(0.1, 0.4, 1.0)];

/// [Audits](audit_scene) the closed-form scene, seen from this camera.
fn audit(name: &str, camera: Vec3, size: u32, choices: &IterationChoices, at_least: usize) {
    audit_scene(name, &ClosedForm::new(camera, size), choices, at_least);
}

#[test]
fn all_techniques_with_the_balance_heuristic() {
    for (i, camera) in CAMERAS.into_iter().enumerate() {
        let choices = IterationChoices { light_paths: 24_000, beam_paths: 1000, ..choices() };
        audit(&format!("all techniques, camera {i}"), camera, 96, &choices, 3000);
    }
}

#[test]
fn emitters_out_of_focus() {
    for (i, camera) in CAMERAS.into_iter().enumerate() {
        let mut scene = ClosedForm::new(camera, 96);
        (scene.camera.radius, scene.camera.focus) = (0.15, 0.6);
        let choices = IterationChoices {
            techniques: TechniqueSet::BPT,
            light_paths: 1000,
            next_events: 1.5,
            camera_factor: 2.0,
            ..choices()
        };
        let lanes = IterationChoices { lanes: Some([0.2, 0.3, 0.5]), ..choices.clone() };
        let power = IterationChoices { heuristic: Heuristic::Power, ..choices.clone() };
        for (name, choices) in [("balance", choices), ("lanes", lanes), ("power", power)] {
            audit_scene(&format!("lens, {name}, camera {i}"), &scene, &choices, 100);
        }
    }
}

#[test]
fn volumes_that_emit() {
    for (i, camera) in CAMERAS.into_iter().enumerate() {
        let mut scene = ClosedForm::glowing(camera, 64);
        let choices = IterationChoices { light_paths: 16_000, beam_paths: 1000, ..choices() };
        audit_scene(&format!("volumes beside other lights, camera {i}"), &scene, &choices, 1000);
        for light in &mut scene.lights[..5] {
            light.power = 0.1;
        }
        let power = IterationChoices { heuristic: Heuristic::Power, ..choices.clone() };
        for (name, choices) in [("balance", choices), ("power", power)] {
            audit_scene(&format!("volumes, {name}, camera {i}"), &scene, &choices, 1000);
        }
        scene.guides = guides(&scene);
        let short = (BeamExtent::Long, BeamExtent::Short);
        let choices = IterationChoices { photon_beams: short.0, query_beams: short.1, ..self::choices() };
        audit_scene(&format!("volumes, guided, other beams, camera {i}"), &scene, &choices, 300);
    }
}

/// A guide for every light, to uneven light over the random numbers that it tells.
fn guides(scene: &ClosedForm) -> Vec<Option<EmissionGuide>> {
    let world = PreparedScene::new(scene).expect("the scene is in order");
    let guide = |light: u32| {
        let mut stream = Stream::new(3, 0, StreamKind::Light, u64::from(light));
        let samples: Vec<_> = (0..4096)
            .filter_map(|_| {
                let start = world.sample_emission(EmitterId(light), [stream.pair(), stream.pair()])?;
                let (point, direction) = (start.point, start.direction);
                let at = world.emission_coordinates(EmitterId(light), &point, direction, point.position)?;
                let light = at.iter().map(|u| (1.0 + (4.0 * u).sin()).powi(4)).product::<f32>();
                Some(EmissionSample { at, light: f64::from(light) })
            })
            .collect();
        EmissionGuide::fit(&samples, world.emission_axes(EmitterId(light))?)
    };
    (0..scene.lights.len() as u32).map(guide).collect()
}

#[test]
fn guided_light_sub_paths() {
    for (camera, focus) in CAMERAS.into_iter().zip([None, Some(Vec3::new(0.4, -0.2, 0.3))]) {
        let mut scene = ClosedForm::new(camera, 64);
        scene.guides = guides(&scene);
        scene.focus = focus;
        assert!(scene.guides.iter().all(Option::is_some), "every light is guided");
        let choices = IterationChoices { light_paths: 12_000, beam_paths: 1000, ..choices() };
        audit_scene("guided light sub-paths", &scene, &choices, 1000);
    }
}

/// Radii by the distance from a point beside the camera: some vertices have bounds, most are in between.
fn footprint() -> RadiusField {
    let eye = [0.3, 0.1, 2.0];
    RadiusField::Footprint(FootprintField { eye, offset: 0.05, slope: 0.4, least: 0.3, most: 1.4 })
}

#[test]
fn radii_that_are_a_function_of_place() {
    for (camera, query_beams) in CAMERAS.into_iter().zip([BeamExtent::Long, BeamExtent::Short]) {
        for heuristic in [Heuristic::Balance, Heuristic::Power] {
            let radius_field = footprint();
            let choices = IterationChoices { radius_field, query_beams, heuristic, ..choices() };
            audit("radii by place", camera, 64, &choices, 500);
            // Below and above the radii.
            let mean_free_paths = VolumeMerges { pp3d: 0.05, pb2d: 0.03, bp2d: 0.5, bb1d: 0.01 };
            audit("radii by medium", camera, 64, &IterationChoices { mean_free_paths, ..choices }, 500);
        }
    }
}

/// A choice by the place of the receiver that differs much from one place to the next.
fn by_receiver(scene: &ClosedForm) -> Arc<EmitterChoice> {
    let mut world = PreparedScene::new(scene).expect("the scene is in order");
    let lights = scene.lights.len() as f32;
    let mut stream = Stream::new(4, 0, StreamKind::Light, 0);
    let mut sample = || {
        let receiver = Vec3::from([0; 3].map(|_| 3.0 * stream.uniform() - 1.5));
        let emitter =
            EmitterId(((receiver.x + receiver.y + 5.0 * receiver.z).rem_euclid(1.0) * lights) as u32);
        (receiver, EmitterSample { emitter, light: f64::from(stream.uniform()), others: 0.0 })
    };
    world.choose_by_receiver(&(0..20_000).map(|_| sample()).collect::<Vec<_>>());
    world.emitter_choice().clone()
}

#[test]
fn emitters_chosen_by_receiver() {
    for camera in CAMERAS {
        let mut scene = ClosedForm::new(camera, 64);
        scene.choice = Some(by_receiver(&scene));
        let choices = IterationChoices { light_paths: 12_000, beam_paths: 1000, ..choices() };
        audit_scene("emitters chosen by receiver", &scene, &choices, 1000);
    }
}

#[test]
fn the_power_heuristic() {
    let choices = IterationChoices { heuristic: Heuristic::Power, ..choices() };
    audit("power heuristic", CAMERAS[1], 48, &choices, 1000);
}

#[test]
fn a_camera_factor() {
    for heuristic in [Heuristic::Balance, Heuristic::Power] {
        let choices = IterationChoices { camera_factor: 4.0, heuristic, ..choices() };
        audit(&format!("camera factor, {heuristic:?}"), CAMERAS[1], 48, &choices, 1000);
    }
}

#[test]
fn beams_of_all_extents() {
    let (short, long) = (BeamExtent::Short, BeamExtent::Long);
    for (photon_beams, query_beams) in [(short, short), (long, short), (long, long)] {
        let name = format!("{photon_beams:?} photon beams, {query_beams:?} query beams");
        let choices = IterationChoices { photon_beams, query_beams, ..choices() };
        audit(&name, CAMERAS[1], 48, &choices, 1000);
    }
}

#[test]
fn some_path_lengths_only() {
    // Two edges have no connection, so that it takes four for one to be too short.
    for (min, max, at_least) in [(3, 4, 400), (4, 5, 200), (2, 2, 0), (1, 20, 400)] {
        let choices = IterationChoices { lengths: PathLengths { min, max }, ..choices() };
        audit(&format!("lengths {min} to {max}"), CAMERAS[1], 48, &choices, at_least);
    }
    let choices = IterationChoices { lengths: PathLengths { min: 2, max: 4 }, ..choices() };
    audit_scene("lengths 2 to 4, volumes", &ClosedForm::glowing(CAMERAS[1], 48), &choices, 100);
}

#[test]
fn subsets_of_techniques() {
    for names in [
        "hit+nee+surf",
        "nee+connect+lt+pb2d",
        "hit+lt+pp3d+bb1d",
        "connect+bp2d+bb1d+surf",
        "bpt",
        "pb2d+pp3d+surf",
        "hit+connect+pp3d",
        "lt+bp2d",
    ] {
        let techniques = names.parse().expect("names");
        audit(names, CAMERAS[1], 48, &IterationChoices { techniques, ..choices() }, 1000);
    }
}

/// The scene with stronger colours: a channel that passes one of the media unseen, one that another only
/// absorbs, channels that scatter into other directions.
fn colourful(camera: Vec3, size: u32) -> ClosedForm {
    let mut scene = ClosedForm::new(camera, size);
    scene.media[0] = Fog::new([0.05, 0.02, 0.0], [0.4, 2.5, 0.0], 0.6).with_mean_cosines([0.6, 0.2, -0.3]);
    scene.media[3] = Fog::new([0.3, 0.1, 1.5], [0.2, 0.8, 0.0], 0.3).with_mean_cosines([-0.5, 0.3, 0.3]);
    scene
}

#[test]
fn sub_paths_in_lanes() {
    let (short, long) = (BeamExtent::Short, BeamExtent::Long);
    let lanes = Some([0.5, 0.2, 0.3]);
    for camera in CAMERAS {
        let choices = IterationChoices { light_paths: 12_000, beam_paths: 1000, lanes, ..choices() };
        audit_scene("lanes", &colourful(camera, 64), &choices, 1000);
    }
    for (photon_beams, query_beams) in [(short, short), (long, short), (long, long)] {
        let name = format!("lanes, {photon_beams:?} photon beams, {query_beams:?} query beams");
        let choices = IterationChoices { photon_beams, query_beams, lanes, ..choices() };
        audit_scene(&name, &colourful(CAMERAS[1], 48), &choices, 1000);
    }
    audit_scene("colours without lanes", &colourful(CAMERAS[1], 48), &choices(), 1000);
    for camera in CAMERAS {
        let choices = IterationChoices { light_paths: 16_000, beam_paths: 1000, lanes, ..choices() };
        audit_scene("lanes, glowing bodies", &ClosedForm::glowing(camera, 64), &choices, 1000);
    }
    let choices = IterationChoices { lanes: Some([0.5, 0.5, 0.0]), roulette: Roulette::Off, ..choices() };
    audit_scene("two lanes", &colourful(CAMERAS[1], 48), &choices, 500);
}

#[test]
fn walks_without_roulette() {
    audit("no roulette", CAMERAS[0], 48, &IterationChoices { roulette: Roulette::Off, ..choices() }, 500);
}

/// Samples with their weights.
struct Weights<D>(Vec<(Technique, Weight<D>)>);

impl<B, D: Densities> Observer<B> for Weights<D> {
    type Densities = D;

    fn sample(&mut self, sample: &ObservedSample<B, D>) {
        self.0.push((sample.technique, sample.weight));
    }
}

fn weights<D: Densities>(plan: &IterationPlan) -> Vec<(Technique, Weight<D>)> {
    let scene = ClosedForm::new(CAMERAS[1], 24);
    let world = PreparedScene::new(&scene).expect("the scene is in order");
    let context = Context { prepared: &world, plan };
    let mut weights = Weights(Vec::new());
    run::<_, f64>(&context, 24, &mut weights);
    weights.0
}

#[test]
fn parts_of_techniques_are_what_counting_one_twice_shows() {
    for heuristic in [Heuristic::Balance, Heuristic::Power] {
        let plan = IterationPlan::new(
            &ClosedForm::new(CAMERAS[1], 24),
            &IterationChoices { heuristic, ..choices() },
        );
        let parts = weights::<ByTechnique>(&plan);
        assert!(parts.len() > 10_000, "{}", parts.len());
        let squared = if heuristic == Heuristic::Power { 2 } else { 1 };
        for counted in Technique::ALL {
            let mut twice = plan.clone();
            let MisPlan { hit, nee, connect, light_tracing, surf, volume, .. } = &mut twice.mis;
            match counted {
                Technique::Hit => *hit *= 2.0,
                Technique::Nee => *nee *= 2.0,
                Technique::Connect => *connect *= 2.0,
                Technique::LightTracing => *light_tracing *= 2.0,
                Technique::Surf => *surf *= 2.0,
                Technique::Pp3d => volume.iter_mut().for_each(|v| v.pp3d.count *= 2.0),
                Technique::Pb2d => volume.iter_mut().for_each(|v| v.pb2d.count *= 2.0),
                Technique::Bp2d => volume.iter_mut().for_each(|v| v.bp2d.count *= 2.0),
                Technique::Bb1d => volume.iter_mut().for_each(|v| v.bb1d.count *= 2.0),
            }
            let found = weights::<f64>(&twice);
            assert_eq!(found.len(), parts.len());
            let mut seen = 0;
            for ((technique, found), (_, weight)) in found.iter().zip(&parts) {
                let part = weight.all.of[counted as usize] / weight.all.total();
                // A light that is seen directly has no other technique.
                if part == 1.0 && *technique == Technique::Hit && found.value() == 1.0 {
                    continue;
                }
                let factor = 2.0_f64.powi(squared);
                let own = if *technique == counted { factor } else { 1.0 };
                let expected = own * weight.value() / (1.0 + (factor - 1.0) * part);
                let found = found.value();
                assert!(
                    (found / expected - 1.0).abs() < 1e-9,
                    "{technique:?}, {counted:?}: {found}, {expected}"
                );
                seen += usize::from(part > 1e-3);
            }
            assert!(seen > 100, "{counted:?}: {seen}");
        }
    }
}

/// Sample counts in weights, relative to the usual choices (`docs/theory.md`, sections 2.1, 3.4 and 6.5).
#[test]
fn weights_count_the_samples_that_are_asked_for() {
    use Technique::{Bb1d, Bp2d, Connect, Hit, LightTracing, Nee, Pb2d, Pp3d, Surf};
    let scene = ClosedForm::new(CAMERAS[0], 1);
    let counts = |choices: &IterationChoices| {
        let mis = IterationPlan::new(&scene, choices).mis;
        let VolumeMerges { pp3d, pb2d, bp2d, bb1d } = mis.volume[0].map(|merge| merge.count);
        [mis.hit, mis.nee, mis.connect, mis.light_tracing, mis.surf, pp3d, pb2d, bp2d, bb1d]
    };
    let usual = counts(&choices());
    let check = |choices: IterationChoices, factors: &[(Technique, f64)]| {
        let found = counts(&choices);
        for technique in Technique::ALL {
            let factor = factors.iter().find(|(other, _)| *other == technique).map_or(1.0, |found| found.1);
            let ratio = found[technique as usize] / usual[technique as usize];
            assert!((ratio / factor - 1.0).abs() < 1e-4, "{technique:?}: {ratio}, not {factor}: {choices:?}");
        }
    };
    check(IterationChoices { camera_factor: 4.0, ..choices() }, &[(Hit, 4.0), (Nee, 4.0), (Connect, 4.0)]);
    check(IterationChoices { next_events: 2.5, ..choices() }, &[(Nee, 2.5)]);
    check(IterationChoices { connections: 1.0, ..choices() }, &[(Connect, 0.5)]);
    check(
        IterationChoices { light_paths: 3000, ..choices() },
        &[(LightTracing, 0.5), (Surf, 0.5), (Pp3d, 0.5), (Pb2d, 0.5)],
    );
    check(IterationChoices { beam_paths: 250, ..choices() }, &[(Bp2d, 0.5), (Bb1d, 0.5)]);
    let periods = MergePeriods::from_fn(|technique| {
        NonZeroU32::new(if technique == Surf { 2 } else { 1 }).expect("not zero")
    });
    check(IterationChoices { periods, ..choices() }, &[(Surf, 0.5)]);
    // Kernels as wide as a mean free path; those of `pp3d` and `bb1d` twice and three quarters of that.
    let scale = scene.media[0].mean_free_path() / 0.04;
    let wide = IterationChoices { kernels: kernels(scale), ..choices() };
    let scale = f64::from(scale);
    let square = scale * scale;
    check(
        wide,
        &[
            (Surf, square),
            (Pp3d, scale * square / 17.0),
            (Pb2d, square / 2.0),
            (Bp2d, square / 2.0),
            (Bb1d, scale / (1.0 + 0.75_f64.powi(4))),
        ],
    );
}

#[test]
fn pilot_runs_have_fewer_paths_and_wider_kernels() {
    let scene = ClosedForm::new(CAMERAS[0], 1);
    let plan = IterationPlan::new(&scene, &choices());
    // Beams of no more paths than the plan has, nor than run.
    assert_eq!((plan.thinned(1000, 800).beam_paths, plan.thinned(300, 400).beam_paths), (500, 300));
    // With an eighth of the paths as many photons are on a surface, in a disc and in a ball.
    let blurred = plan.blurred(750, 100);
    let ratio = |of: fn(&Kernels) -> f32| of(&blurred.kernels) / of(&plan.kernels);
    let ratios = [ratio(|k| k.surf.radius()), ratio(|k| k.pb2d.radius()), ratio(|k| k.pp3d.radius())];
    for (ratio, power) in ratios.into_iter().zip([2, 2, 3]) {
        assert!((ratio.powi(power) - 8.0).abs() < 1e-4, "{ratio}");
    }
    assert_eq!([ratio(|k| k.bp2d.radius()), ratio(|k| k.bb1d.radius())], [1.0; 2]);
    // Without merges there is no radius.
    let of = |techniques| IterationChoices { techniques, radius_field: footprint(), ..choices() };
    let field = |techniques| IterationPlan::new(&scene, &of(techniques)).radius_field;
    assert_eq!([field(TechniqueSet::ALL), field(TechniqueSet::BPT)], [footprint(), RadiusField::Uniform]);
}

#[test]
fn radii_in_a_medium_are_at_most_so_many_mean_free_paths() {
    let scene = ClosedForm::new(CAMERAS[0], 1);
    let radii = |mean_free_paths: VolumeMerges<f32>| {
        let plan = IterationPlan::new(&scene, &IterationChoices { mean_free_paths, ..choices() });
        let of = move |(id, medium): (u32, &Fog)| {
            let merges = plan.mis.merges_in(MediumId(id));
            VolumeMerges::from_fn(|technique| {
                let radius = plan.kernels.get(technique).expect("it merges").radius();
                merges.get(technique).unwrap().greatest_scale * radius / medium.mean_free_path()
            })
        };
        (0..).zip(scene.media()).map(of).collect::<Vec<_>>()
    };
    let most = VolumeMerges { pp3d: 0.05, pb2d: 0.03, bp2d: 0.5, bb1d: 0.01 };
    for found in radii(most) {
        for technique in [Technique::Pp3d, Technique::Pb2d, Technique::Bp2d, Technique::Bb1d] {
            let (found, most) = (found.get(technique).unwrap(), most.get(technique).unwrap());
            assert!((found / most - 1.0).abs() < 1e-5, "{technique:?}: {found}, {most}");
        }
    }
    assert!(radii(NO_LIMIT).iter().all(|found| found.pp3d == f32::INFINITY));
}

#[test]
fn bodies_around_a_point_on_the_way_are_those_that_contain_it() {
    // The fog's boundary runs through the glass, where it is hidden: it changes no medium, but what is behind
    // the glass.
    let scene = ClosedForm::new(CAMERAS[0], 1);
    let mut edge_trace = EdgeTrace::<Material>::default();
    let mut state = WalkState::<f64> {
        walk: Walk::Camera,
        stream: Stream::new(2, 0, StreamKind::Camera, 0),
        survival: Survival::of_camera(Roulette::Off, None),
        hero: (),
        stops: 0,
    };
    let mut random = Stream::new(1, 0, StreamKind::Camera, 0);
    let mut hidden = 0;
    for _ in 0..20_000 {
        let mut point = || 3.0 * Vec3::new(random.uniform(), random.uniform(), random.uniform()) - 1.5;
        let (from, towards) = (point(), point());
        let ray = Ray::new(from, (towards - from).normalize());
        edge_trace.trace(&scene, &ray, &scene.stack_at(from), Extent::ToSurface, &mut state);
        for span in &edge_trace.spans {
            let t = span.start + (span.end.min(10.0) - span.start) * random.uniform();
            let found = edge_trace.stack_in(span, t);
            assert_eq!(found, scene.stack_at(ray.at(t)), "{ray:?}, {t}");
            hidden += usize::from(found.len() > 1 && found.top().is_some_and(|body| body.priority == 10));
        }
    }
    assert!(hidden > 100, "only {hidden} points in fog and glass");
}
