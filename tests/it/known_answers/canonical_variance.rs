//! Variance of points and beams where it has a closed form: two fixed rays that cross at right angles in a
//! homogeneous medium (`docs/theory.md`, section 2.7).
//!
//! A light that shoots a single ray and a camera that sees along a single ray leave nothing random but the
//! distances that the walks sample. Walks, stored photons and beams, trees, kernels and estimators are those
//! of the renderer; a plan of one technique gives every sample the weight one.
//!
//! With the extinction as unit of length, the kernel occupies `[a, a + w]` on both rays and its centre is the
//! crossing. Second moments over squared means:
//!
//! | technique | light's side | camera's side |
//! |---|---|---|
//! | PB2D, constant disc | point | 1 (long), short beam at the crossing (short) |
//! | PB2D, parabolic disc | point, weighted by the kernel (quadrature) | 1 |
//! | BP2D, constant disc | 1 (long) | point |
//! | BB1D | 1 (long), short beam at the crossing (short) | the same |
//! | PP3D, ball | a ball does not factor into intervals: quadrature over both rays ||
//!
//! The estimators blur beams only across, never along: the factor "short beam with overlap" belongs to none
//! of them. It is checked with the stored beams' own ends.

use std::ops::RangeInclusive;

use glam::{Vec2, Vec3};
use rayon::prelude::*;
use upbp_core::media::{Homogeneous, PhaseFunction};
use upbp_estimators::mis::{BeamExtent, Heuristic};
use upbp_estimators::observer::{NoObserver, ObservedSample, Observer};
use upbp_estimators::path::{Context, LightChunk, Scratch};
use upbp_estimators::scene::{
    BoundingSphere, Bsdf, BsdfSample, Camera, CameraConnection, CameraRay, Emission, Emitter, EmitterKind,
    EmitterPoint, Hit, HitDensities, Incident, Interface, Scene, Walk,
};
use upbp_estimators::trace::{trace_camera_path, trace_light_path};
use upbp_estimators::{
    Counters, IterationChoices, IterationPlan, Kernel, Kernels, LightMap, MediumId, MergePeriods, NO_LIMIT,
    PathLengths, PreparedScene, RadiusField, Ray, Roulette, Spectrum, StreamKind, TechniqueSet,
};

/// There are no surfaces.
#[derive(Clone, Copy)]
struct Nothing;

impl Bsdf for Nothing {
    fn eval(&self, _: Vec3, _: Vec3, _: Interface) -> Spectrum {
        Spectrum::ZERO
    }

    fn pdf(&self, _: Vec3, _: Vec3, _: Interface) -> f32 {
        0.0
    }

    fn sample(&self, _: Vec3, _: Walk, _: Interface, _: f32, _: [f32; 2]) -> Option<BsdfSample> {
        None
    }

    fn is_connectible(&self) -> bool {
        false
    }

    fn continuation(&self, _: Vec3) -> f32 {
        0.0
    }
}

/// Shoots one ray along +x, which starts at `-start`.
struct Laser {
    start: f32,
}

impl Emitter for Laser {
    fn kind(&self) -> EmitterKind {
        EmitterKind::Point
    }

    fn power(&self, _: &BoundingSphere) -> f32 {
        1.0
    }

    fn sample_emission(&self, _: &BoundingSphere, _: [f32; 2], _: [f32; 2]) -> Option<Emission> {
        let point = EmitterPoint { position: Vec3::new(-self.start, 0.0, 0.0), normal: Vec3::X };
        let radiance = Spectrum::splat(1.0);
        Some(Emission { point, direction: Vec3::X, radiance, pdf_position: 1.0, pdf_direction: 1.0 })
    }

    fn sample_incident(&self, _: &BoundingSphere, _: Vec3, _: [f32; 2]) -> Option<Incident> {
        None
    }

    fn hit(&self, _: &BoundingSphere, _: &EmitterPoint, _: Vec3, _: Vec3) -> Option<HitDensities> {
        None
    }
}

/// Sees along one ray, towards +z, which starts at `-start`.
struct Tube {
    start: f32,
}

impl Camera for Tube {
    fn resolution(&self) -> (u32, u32) {
        (1, 1)
    }

    fn ray(&self, _: Vec2, _: [f32; 2]) -> Option<CameraRay> {
        Some(CameraRay { origin: Vec3::new(0.0, 0.0, -self.start), direction: Vec3::Z, pdf: 1.0 })
    }

    fn connect(&self, _: Vec3, _: [f32; 2]) -> Option<CameraConnection> {
        None
    }

    fn is_pinhole(&self) -> bool {
        true
    }
}

/// A medium without end.
struct Space {
    light: [Laser; 1],
    medium: [Homogeneous; 1],
    camera: Tube,
}

impl Scene for Space {
    type Bsdf = Nothing;
    type Emitter = Laser;
    type Medium = Homogeneous;
    type Camera = Tube;

    fn intersect(&self, _: &Ray) -> Option<Hit<Nothing>> {
        None
    }

    fn bounds(&self) -> BoundingSphere {
        BoundingSphere { centre: Vec3::ZERO, radius: 10.0 }
    }

    fn emitters(&self) -> &[Laser] {
        &self.light
    }

    fn media(&self) -> &[Homogeneous] {
        &self.medium
    }

    fn camera(&self) -> &Tube {
        &self.camera
    }

    fn outside(&self) -> Option<MediumId> {
        Some(MediumId(0))
    }
}

/// Sums over samples of one technique.
#[derive(Clone, Copy, Default)]
struct Sums {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Sums {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.squares += value * value;
    }
}

impl Observer<Nothing> for Sums {
    type Densities = f64;

    fn sample(&mut self, sample: &ObservedSample<Nothing>) {
        let weight = sample.weight.value();
        assert!((weight - 1.0).abs() < 1e-12, "one technique alone has weight {weight}");
        self.add(f64::from(sample.value[0]));
    }
}

/// A second moment over the squared mean, with its relative standard error.
#[derive(Clone, Copy)]
struct Moment {
    value: f64,
    error: f64,
}

impl Moment {
    /// From batches of equal size.
    fn of(batches: &[Sums]) -> Self {
        let n = batches.len() as f64;
        let total = |f: fn(&Sums) -> f64| batches.iter().map(f).sum::<f64>();
        let count = total(|b| b.count);
        let (mean, square) = (total(|b| b.sum) / count, total(|b| b.squares) / count);
        let value = square / (mean * mean);
        // What each batch adds to the logarithm, to first order.
        let share = |b: &Sums| b.squares / b.count / square - 2.0 * b.sum / b.count / mean + 1.0;
        let variance = batches.iter().map(|b| share(b).powi(2)).sum::<f64>() / (n - 1.0);
        Self { value, error: (variance / n).sqrt() }
    }
}

/// A technique and its rays.
#[derive(Clone, Copy)]
struct Setup {
    technique: &'static str,
    kernel: Kernel,
    /// Distance from the start of both rays to the crossing, mean free paths.
    crossing: f64,
    photon_beams: BeamExtent,
    query_beams: BeamExtent,
}

impl Setup {
    fn new(technique: &'static str, kernel: fn(f32) -> Kernel, width: f64, before: f64) -> Self {
        Self {
            technique,
            kernel: kernel(0.5 * width as f32),
            crossing: before + 0.5 * width,
            photon_beams: BeamExtent::Long,
            query_beams: BeamExtent::Long,
        }
    }

    fn short_photon(self) -> Self {
        Self { photon_beams: BeamExtent::Short, ..self }
    }

    fn short_query(self) -> Self {
        Self { query_beams: BeamExtent::Short, ..self }
    }

    fn space(&self) -> Space {
        let medium = Homogeneous::new(Spectrum::ZERO, Spectrum::ONE, PhaseFunction::Isotropic)
            .expect("valid coefficients");
        let start = self.crossing as f32;
        Space { light: [Laser { start }], medium: [medium], camera: Tube { start } }
    }

    fn plan(&self, space: &Space, batch: u64, paths: u32) -> IterationPlan {
        let kernel = self.kernel;
        IterationPlan::new(
            space,
            &IterationChoices {
                seed: 7,
                iteration: batch,
                techniques: self.technique.parse::<TechniqueSet>().expect("a technique"),
                light_paths: paths,
                beam_paths: paths,
                connections: 1.0,
                next_events: 1.0,
                camera_factor: 1.0,
                periods: MergePeriods::ONE,
                vertices_per_light_path: 1.0,
                lengths: PathLengths { min: 2, max: 2 },
                roulette: Roulette::Off,
                kernels: Kernels {
                    surf: Kernel::NONE,
                    pp3d: kernel,
                    pb2d: kernel,
                    bp2d: kernel,
                    bb1d: kernel,
                },
                radius_field: RadiusField::Uniform,
                mean_free_paths: NO_LIMIT,
                heuristic: Heuristic::Balance,
                photon_beams: self.photon_beams,
                query_beams: self.query_beams,
                lanes: None,
                features: false,
            },
        )
    }

    fn light(&self, batch: u64, paths: u32) -> LightChunk<Nothing> {
        let space = self.space();
        let world = PreparedScene::new(&space).expect("a valid scene");
        let plan = self.plan(&space, batch, paths);
        let context = Context { prepared: &world, plan: &plan };
        let (mut scratch, mut chunk) = (Scratch::default(), LightChunk::default());
        for path in 0..paths {
            trace_light_path(&context, StreamKind::Light, path, &mut scratch, &mut chunk, &mut NoObserver);
        }
        chunk
    }

    /// The moment of one light sub-path against one camera sub-path, from `batches` of `light` times
    /// `camera`.
    fn measure(&self, batches: u64, light: u32, camera: u32) -> Moment {
        let sums: Vec<Sums> = (0..batches)
            .into_par_iter()
            .map(|batch| {
                let chunk = self.light(batch, light);
                let space = self.space();
                let world = PreparedScene::new(&space).expect("a valid scene");
                let plan = self.plan(&space, batch, light);
                let context = Context { prepared: &world, plan: &plan };
                let map = LightMap::build(&plan, chunk.vertices, chunk.beams);
                let (mut scratch, mut counters) = (Scratch::default(), Counters::default());
                let mut sums = Sums { count: f64::from(light) * f64::from(camera), ..Sums::default() };
                for index in 0..u64::from(camera) {
                    let stream = plan.stream(StreamKind::Camera, index);
                    let counters = &mut counters;
                    trace_camera_path(&context, &map, stream, [0, 0], &mut scratch, counters, &mut sums);
                }
                sums
            })
            .collect();
        Moment::of(&sums)
    }

    /// The moment of the length that stored beams share with the kernel.
    fn overlap(&self, batches: u64, light: u32) -> Moment {
        let half = f64::from(self.kernel.radius());
        let sums: Vec<Sums> = (0..batches)
            .into_par_iter()
            .map(|batch| {
                let mut sums = Sums { count: f64::from(light), ..Sums::default() };
                for beam in self.light(batch, light).beams {
                    let (start, end) = (f64::from(beam.segment.start), f64::from(beam.segment.end));
                    let shared = end.min(self.crossing + half) - start.max(self.crossing - half);
                    sums.add(shared.max(0.0));
                }
                sums
            })
            .collect();
        Moment::of(&sums)
    }
}

/// Second moments over squared means of one ray.
mod closed {
    pub(super) fn point(w: f64, a: f64) -> f64 {
        a.exp() / (1.0 - (-w).exp())
    }

    pub(super) fn overlap(w: f64, a: f64) -> f64 {
        let e = 1.0 - (-w).exp();
        a.exp() * 2.0 * (e - w * (-w).exp()) / (e * e)
    }

    pub(super) fn crossing(w: f64, a: f64) -> f64 {
        (a + 0.5 * w).exp()
    }

    fn integral(radius: f64, f: impl Fn(f64) -> f64) -> f64 {
        let steps = 20_000;
        let dx = 2.0 * radius / f64::from(steps);
        (0..steps).map(|i| f((f64::from(i) + 0.5) * dx - radius) * dx).sum()
    }

    /// A point in a parabolic kernel.
    pub(super) fn parabolic_point(w: f64, a: f64) -> f64 {
        let (r, start) = (0.5 * w, a + 0.5 * w);
        let kernel = |x: f64| 1.0 - (x / r).powi(2);
        let density = |x: f64| (-(x + start)).exp();
        let mean = integral(r, |x| kernel(x) * density(x));
        integral(r, |x| kernel(x).powi(2) * density(x)) / (mean * mean)
    }

    /// Two points in a common ball: of points alone, since a ball is no product of intervals.
    pub(super) fn points_in_ball(w: f64, a: f64) -> f64 {
        let (r, start) = (0.5 * w, a + 0.5 * w);
        1.0 / integral(r, |x| {
            let half = (r * r - x * x).max(0.0).sqrt();
            (-(x + start)).exp() * ((half - start).exp() - (-half - start).exp())
        })
    }
}

const WIDTHS: [f64; 5] = [0.1, 1.0, 1.26, 3.0, 10.0];

/// Keeps rows that are more than 1 % off, or of which so much cannot be told.
fn check(failures: &mut Vec<String>, name: &str, w: f64, a: f64, measured: Moment, expected: f64) {
    let difference = measured.value / expected - 1.0;
    let row = format!(
        "{name:36} w = {w:4} a = {a}: {:10.4} (± {:.2} %), expected {expected:10.4}: {:+.2} %",
        measured.value,
        100.0 * measured.error,
        100.0 * difference
    );
    println!("{row}");
    if !(difference.abs() < 0.01 && measured.error < 0.006) {
        failures.push(row);
    }
}

#[test]
fn one_random_end() {
    let mut failures = Vec::new();
    // The way to the kernel is a factor of all widths alike. Distances of light sub-paths are stratified, so
    // that a few thousand of them tell moments within 0.6 %.
    for (w, a) in WIDTHS.into_iter().map(|w| (w, 0.0)).chain([(1.0, 1.0)]) {
        let points = Setup::new("pb2d", Kernel::disc, w, a).measure(20, 5_000, 1);
        check(&mut failures, "PB2D, constant disc, long query", w, a, points, closed::point(w, a));
        let points = Setup::new("pb2d", Kernel::parabolic_disc, w, a).measure(20, 5_000, 1);
        check(&mut failures, "PB2D, parabolic disc, long query", w, a, points, closed::parabolic_point(w, a));
        // The more are needed, the fewer of them meet the kernel.
        let queries = |expected: f64| (2400.0 * (expected - 1.0)).clamp(400.0, 20_000.0) as u32;
        let expected = closed::point(w, a);
        let points = Setup::new("bp2d", Kernel::disc, w, a).measure(50, 1, queries(expected));
        check(&mut failures, "BP2D, constant disc, long beam", w, a, points, expected);
        let beams = Setup::new("bb1d", Kernel::parabolic_line, w, a);
        check(&mut failures, "BB1D, long, long", w, a, beams.measure(2, 10, 10), 1.0);
        check(
            &mut failures,
            "short beam, overlap",
            w,
            a,
            beams.short_photon().overlap(20, 5_000),
            closed::overlap(w, a),
        );
        // Beams that reach a far crossing are rare.
        let batches = if w > 5.0 { 200 } else { 20 };
        let short = beams.short_photon().measure(batches, 10_000, 1);
        check(&mut failures, "BB1D, short beam, long query", w, a, short, closed::crossing(w, a));
        if w < 5.0 {
            let expected = closed::crossing(w, a);
            let short = beams.short_query().measure(50, 1, queries(expected));
            check(&mut failures, "BB1D, long beam, short query", w, a, short, expected);
        }
    }
    assert!(failures.is_empty(), "more than 1 % off:\n{}", failures.join("\n"));
}

#[test]
fn two_random_ends() {
    let mut failures = Vec::new();
    for w in [1.0, 3.0] {
        let short = closed::crossing(w, 0.0);
        let beams = Setup::new("bb1d", Kernel::parabolic_line, w, 0.0).short_photon().short_query();
        check(&mut failures, "BB1D, short, short", w, 0.0, beams.measure(1000, 100, 100), short * short);
        let points = Setup::new("pb2d", Kernel::disc, w, 0.0).short_query();
        let expected = closed::point(w, 0.0) * short;
        check(
            &mut failures,
            "PB2D, constant disc, short query",
            w,
            0.0,
            points.measure(1000, 100, 100),
            expected,
        );
        let balls = Setup::new("pp3d", Kernel::ball, w, 0.0);
        check(
            &mut failures,
            "PP3D, ball",
            w,
            0.0,
            balls.measure(1000, 100, 100),
            closed::points_in_ball(w, 0.0),
        );
    }
    // The closed form of rare pairs is reached for wide kernels too.
    let balls = Setup::new("pp3d", Kernel::ball, 10.0, 0.0);
    check(
        &mut failures,
        "PP3D, ball",
        10.0,
        0.0,
        balls.measure(2800, 100, 100),
        closed::points_in_ball(10.0, 0.0),
    );
    assert!(failures.is_empty(), "more than 1 % off:\n{}", failures.join("\n"));
}

/// The width in a range at which a ratio falls below one.
fn crossover(range: RangeInclusive<f64>, ratio: impl Fn(f64) -> f64) -> f64 {
    let (mut start, mut end) = range.into_inner();
    assert!(ratio(start) > 1.0 && ratio(end) < 1.0);
    for _ in 0..40 {
        let middle = 0.5 * (start + end);
        *if ratio(middle) > 1.0 { &mut start } else { &mut end } = middle;
    }
    0.5 * (start + end)
}

/// By the closed forms, which the tests above hold the renderer to at and between these widths.
#[test]
fn points_and_beams_change_places_at_one_mean_free_path() {
    let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-4, "{found}, {expected}");
    // Points in a box against beams that are blurred across only.
    let points_by_beams = |w| closed::point(w, 0.0) / closed::crossing(w, 0.0);
    near(crossover(0.5..=2.0, points_by_beams), 2.0 * 0.5_f64.asinh());
    // The renderer's own kernel weighs the rim little: it needs a larger radius for the same.
    let parabolic_by_beams = |w| closed::parabolic_point(w, 0.0) / closed::crossing(w, 0.0);
    near(crossover(0.5..=2.0, parabolic_by_beams), 1.1503);
    // Points and beams with the same kernel along the ray: e^w = 1 + 2w.
    near(crossover(0.5..=2.0, |w| closed::point(w, 0.0) / closed::overlap(w, 0.0)), 1.2564);
}

/// The closed forms used above against the tabulated ones, which start `a` before the kernel alike.
#[test]
fn closed_forms_agree_with_the_table() {
    let cases: Vec<serde_json::Value> =
        serde_json::from_str(include_str!("../../data/analytic.json")).expect("a list of cases");
    let mut checked = 0;
    for case in cases.iter().filter(|case| case["kind"] == "canonical_variance") {
        let number = |part: &str, name: &str| case[part][name].as_f64().expect("a number");
        let (w, a) = (number("inputs", "sigma_t_h"), number("inputs", "sigma_t_start"));
        for (name, value) in [
            ("point", closed::point(w, a)),
            ("short_beam", closed::overlap(w, a)),
            ("short_beam_1d", closed::crossing(w, a)),
        ] {
            let expected = number("expected", name) + 1.0;
            assert!((value / expected - 1.0).abs() < 1e-9, "{name} at w = {w}, a = {a}");
            checked += 1;
        }
    }
    assert!(checked >= 50);
}
