//! Every accepted sample, rebuilt from its vertices and weighed by enumeration.

use glam::{Vec2, Vec3};
use upbp_estimators::mis::oracle::{Path, Strategy};
use upbp_estimators::mis::{Heuristic, MisPlan};
use upbp_estimators::observer::{Completion, LightEnd, ObservedSample, ObservedVertex, Observer};
use upbp_estimators::path::{Context, Interaction, LightChunk, Scratch};
use upbp_estimators::scene::CameraRay;
use upbp_estimators::trace::{trace_camera_path, trace_light_path};
use upbp_estimators::{
    Counters, IterationChoices, IterationPlan, LightMap, PreparedScene, StreamKind, Technique,
};
use upbp_media::Lanes;
use upbp_testing::closed_form::material::Material;
use upbp_testing::closed_form::scene::ClosedForm;

use super::rebuild::{Trace, Vertex};

/// Weights below this are compared with nothing: they are rounding of others.
const SMALLEST_WEIGHT: f64 = 1e-6;

/// Relative agreement of a weight where rounding is not amplified.
const TOLERANCE: f64 = 1e-4;

/// The share of the weights that agree to [`TOLERANCE`] without further ado.
const REGULAR: f64 = 0.98;

/// No difference exceeds this many times the tolerance and what moving the vertices by rounding does to the
/// weight.
const LARGEST_EXCESS: f64 = 2.0;

/// Weights of each technique that are all compared; of further ones, one in [`EVERY`].
const ALL_OF_FIRST: u64 = 20_000;
const EVERY: u64 = 7;

/// Differences of one technique.
#[derive(Clone, Debug, Default)]
struct Comparison {
    seen: u64,
    /// Those that were rebuilt, or could not be.
    tried: u64,
    doubtful: u64,
    differences: Vec<f64>,
    /// The largest ratio to what rounding explains, and the path where.
    worst: (f64, String),
}

/// Compares samples with the enumeration: all, up to a number of each technique, and a part of the others.
struct Auditor<'a> {
    scene: &'a ClosedForm,
    plan: &'a IterationPlan,
    light_ends: Vec<Option<LightEnd>>,
    light_vertices: Vec<Vec<Vertex>>,
    lens: Vec3,
    /// Place on the film of the camera sub-path at hand.
    film: Vec2,
    camera_vertices: Vec<Vertex>,
    comparisons: [Comparison; 9],
}

fn vertex(observed: &ObservedVertex<Material>) -> Vertex {
    let position = observed.position.as_dvec3();
    Vertex {
        light: position,
        camera: position,
        in_medium: matches!(observed.interaction, Interaction::Medium(_)),
        delta: observed.delta,
    }
}

fn joint(light: Vec3, camera: Vec3, interaction: &Interaction<Material>) -> Vertex {
    Vertex {
        light: light.as_dvec3(),
        camera: camera.as_dvec3(),
        in_medium: matches!(interaction, Interaction::Medium(_)),
        delta: false,
    }
}

impl<'a> Auditor<'a> {
    fn new(scene: &'a ClosedForm, plan: &'a IterationPlan) -> Self {
        let paths = plan.light_paths as usize;
        Self {
            scene,
            plan,
            light_ends: vec![None; paths],
            light_vertices: vec![Vec::new(); paths],
            lens: Vec3::ZERO,
            film: Vec2::ZERO,
            camera_vertices: Vec::new(),
            comparisons: Default::default(),
        }
    }

    /// The path of a sample, and which strategy made it.
    fn trace(&self, sample: &ObservedSample<Material>) -> (Trace, Strategy) {
        let prefix = |path: u32, vertices: u32| {
            let path = path as usize;
            let light = self.light_ends[path].expect("a light sub-path has a start");
            (light, self.light_vertices[path][..vertices as usize].to_vec())
        };
        let suffix = |vertices: u32| self.camera_vertices[..vertices as usize].iter().rev().copied();
        let depth = sample.camera_depth;
        let (light, interior, lens, strategy) = match sample.completion {
            Completion::Emission => unreachable!("looked at before"),
            Completion::Hit(light) => (light, suffix(depth - 1).collect(), self.lens, Strategy::Hit),
            Completion::Nee { light, camera: (position, interaction) } => {
                let interior = [joint(position, position, &interaction)].into_iter().chain(suffix(depth - 1));
                (light, interior.collect(), self.lens, Strategy::Nee)
            }
            Completion::Lens { light, lens, film } => {
                assert_eq!((film, depth), (self.film, 0));
                (light, Vec::new(), lens, Strategy::Nee)
            }
            Completion::Connect { path, light: (from, from_site, from_depth), camera: (to, to_site) } => {
                let (light, mut interior) = prefix(path, from_depth - 1);
                interior.extend([joint(from, from, &from_site), joint(to, to, &to_site)]);
                interior.extend(suffix(depth - 1));
                (light, interior, self.lens, Strategy::Connect(from_depth as usize + 1))
            }
            Completion::LightTracing { path, light: (from, interaction, from_depth), lens, .. } => {
                let (light, mut interior) = prefix(path, from_depth - 1);
                interior.push(joint(from, from, &interaction));
                (light, interior, lens, Strategy::LightTracing)
            }
            Completion::Merge {
                path, light: (photon, photon_depth), camera: (query, interaction), ..
            } => {
                let (light, mut interior) = prefix(path, photon_depth - 1);
                interior.push(joint(photon, query, &interaction));
                interior.extend(suffix(depth - 1));
                let at = photon_depth as usize;
                let strategy = match sample.technique {
                    Technique::Surf => Strategy::Surf(at),
                    Technique::Pp3d => Strategy::Pp3d(at),
                    Technique::Pb2d => Strategy::Pb2d(at),
                    Technique::Bp2d => Strategy::Bp2d(at),
                    Technique::Bb1d => Strategy::Bb1d(at),
                    other => panic!("{other:?} does not merge"),
                };
                (light, interior, self.lens, strategy)
            }
        };
        (Trace { light, interior, lens, film: self.film }, strategy)
    }

    fn audit(&mut self, sample: &ObservedSample<Material>) {
        let technique = sample.technique as usize;
        let comparison = &mut self.comparisons[technique];
        comparison.seen += 1;
        let is_compared = comparison.seen <= ALL_OF_FIRST || comparison.seen.is_multiple_of(EVERY);
        let found = sample.weight.value();
        assert!((0.0..=1.0 + 1e-6).contains(&found), "{sample:?}");
        if matches!(sample.completion, Completion::Emission) {
            // In closed form only where nothing else makes the path.
            let is_alone = self.camera_vertices.iter().all(|vertex| vertex.delta);
            assert!(
                found == 1.0 && is_alone && self.plan.lengths.contains(sample.camera_depth),
                "{sample:?}"
            );
            return;
        }
        if !is_compared {
            return;
        }
        self.comparisons[technique].tried += 1;
        let (trace, strategy) = self.trace(sample);
        assert!(self.plan.lengths.contains(trace.length() as u32), "{sample:?}");
        let in_lanes = plan_in_lanes(self.plan);
        let Ok(path) = trace.rebuild(self.scene, self.plan, in_lanes) else {
            self.comparisons[technique].doubtful += 1;
            return;
        };
        // Of lanes that are all the same, any one will do.
        let lanes = if in_lanes { self.plan.mis.lanes } else { [1.0, 0.0, 0.0] };
        let mis = MisPlan { lanes, ..self.plan.mis.clone() };
        let weight = |path: &Path<[f64; 3]>| {
            let weights = path.weights(&mis);
            let sum: f64 = weights.iter().map(|w| w.1).sum();
            assert!((sum - 1.0).abs() < 1e-12, "{sum}");
            weights.iter().find(|(other, _)| *other == strategy).map_or(0.0, |w| w.1)
        };
        let expected = weight(&path);
        if expected.max(found) < SMALLEST_WEIGHT {
            return;
        }
        let difference = (found / expected - 1.0).abs();
        let mut excess = difference / TOLERANCE;
        if excess > 1.0 {
            let rounding = trace.sensitivity(self.scene, self.plan, in_lanes, weight, expected);
            excess = difference / (TOLERANCE + rounding);
        }
        let comparison = &mut self.comparisons[technique];
        comparison.differences.push(difference);
        if excess > comparison.worst.0 {
            let text = format!("{strategy:?}: {found}, expected {expected}\n{trace:?}\n{path:?}");
            comparison.worst = (excess, text);
        }
    }
}

impl Observer<Material> for Auditor<'_> {
    type Densities = f64;

    fn light_end(&mut self, path: u32, end: &LightEnd) {
        self.light_ends[path as usize] = Some(*end);
    }

    fn light_vertex(&mut self, path: u32, observed: &ObservedVertex<Material>) {
        let vertices = &mut self.light_vertices[path as usize];
        vertices.push(vertex(observed));
        assert_eq!(vertices.len(), observed.depth as usize);
    }

    fn camera_end(&mut self, film: Vec2, ray: &CameraRay) {
        (self.film, self.lens) = (film, ray.origin);
        self.camera_vertices.clear();
    }

    fn camera_vertex(&mut self, observed: &ObservedVertex<Material>) {
        self.camera_vertices.push(vertex(observed));
        assert_eq!(self.camera_vertices.len(), observed.depth as usize);
    }

    fn sample(&mut self, sample: &ObservedSample<Material>) {
        self.audit(sample);
    }
}

/// Renders once and compares; every technique that runs has at least `at_least` weights to compare.
pub(super) fn audit_scene(name: &str, scene: &ClosedForm, choices: &IterationChoices, at_least: usize) {
    let size = scene.camera.size;
    let mut world = PreparedScene::new(scene).expect("the scene is in order");
    if let Some(choice) = &scene.choice {
        world.set_emitter_choice(choice).expect("a choice of this scene");
    }
    if let Some(focus) = scene.focus {
        world.focus_emission(focus);
    }
    world.guide_emission(scene.guides.clone());
    let plan = IterationPlan::new(scene, choices);
    let context = Context { prepared: &world, plan: &plan };
    let mut auditor = Auditor::new(scene, &plan);
    let counters = if plan_in_lanes(&plan) {
        run::<_, [f64; 3]>(&context, size, &mut auditor)
    } else {
        run::<_, f64>(&context, size, &mut auditor)
    };
    assert_eq!(counters.dropped, 0, "{counters:?}");
    let walks = u64::from(plan.light_paths + size * size);
    assert!(counters.lost_walks * 10_000 < walks, "{counters:?}");

    println!("{name}");
    for (technique, comparison) in Technique::ALL.into_iter().zip(auditor.comparisons) {
        let Comparison { seen, tried, doubtful, mut differences, worst: (excess, path) } = comparison;
        assert_eq!(seen, counters.contributions_of(technique), "{technique:?}");
        if !plan.techniques.has(technique) {
            assert_eq!(seen, 0, "{technique:?} is off");
            continue;
        }
        differences.sort_by(f64::total_cmp);
        let count = differences.len();
        assert!(count >= at_least, "{technique:?}: only {count} weights");
        if count == 0 {
            continue;
        }
        let quantile = |q: f64| differences[((q * count as f64) as usize).min(count - 1)];
        println!(
            "  {:8} {count:6} weights, {doubtful} in doubt; median {:.1e}, 99 % {:.1e}, 99.9 % {:.1e}, \
             largest {:.1e}, {excess:.1} times what rounding explains",
            technique.name(),
            quantile(0.5),
            quantile(0.99),
            quantile(0.999),
            quantile(1.0),
        );
        // A vertex within rounding of a boundary cannot be rebuilt: about one sample in 10⁴, a Poisson count,
        // in clusters since samples share vertices. This only guards that hardly any sample escapes the
        // comparison.
        let expected = 1e-4 * tried as f64;
        let most = expected + 4.0 * expected.sqrt() + 4.0;
        assert!(doubtful as f64 <= most, "{technique:?}: {doubtful} of {tried} in doubt");
        // Squared densities have twice the relative error.
        let tolerance = if plan.mis.heuristic == Heuristic::Power { 2.0 * TOLERANCE } else { TOLERANCE };
        assert!(quantile(REGULAR) < tolerance, "{technique:?}: {:e}", quantile(REGULAR));
        assert!(excess < LARGEST_EXCESS, "{technique:?}, {excess}: {path}");
    }
}

/// Whether sub-paths draw their distances by lanes.
fn plan_in_lanes(plan: &IterationPlan) -> bool {
    plan.mis.lanes != [0.0; 3]
}

/// All sub-paths of an iteration, with one camera sub-path per pixel of a film of this size.
pub(super) fn run<O: Observer<Material>, L: Lanes>(
    context: &Context<'_, ClosedForm>,
    size: u32,
    observer: &mut O,
) -> Counters {
    let mut scratch = Scratch::default();
    let mut chunk = LightChunk::<_, O::Densities, L>::default();
    for index in 0..context.plan.light_paths {
        trace_light_path(context, StreamKind::Light, index, &mut scratch, &mut chunk, observer);
    }
    let LightChunk { vertices, beams, mut counters, .. } = chunk;
    let map = LightMap::build(context.plan, vertices, beams);
    for i in 0..size * size {
        let stream = context.plan.stream(StreamKind::Camera, u64::from(i));
        let pixel = [i % size, i / size];
        let _ = trace_camera_path(context, &map, stream, pixel, &mut scratch, &mut counters, observer);
    }
    counters
}
