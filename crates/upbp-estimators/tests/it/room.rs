//! A host in a few lines, a lamp over a floor, at any place; and what walks and checkers make of it.

use std::f32::consts::{FRAC_1_PI, TAU};
use std::sync::Mutex;

use glam::{Vec2, Vec3};
use upbp_estimators::check::check_scene;
use upbp_estimators::mis::{BeamExtent, Heuristic};
use upbp_estimators::observer::NoObserver;
use upbp_estimators::path::{Context, Scratch};
use upbp_estimators::scene::{
    Boundary, BoundingSphere, Bsdf, BsdfSample, Camera, CameraConnection, CameraRay, Emission, Emitter,
    EmitterId, EmitterKind, EmitterPoint, Hit, HitDensities, Incident, Interface, Scene, Walk,
};
use upbp_estimators::trace::trace_camera_path;
use upbp_estimators::{
    Counters, IterationChoices, IterationPlan, Kernel, Kernels, LightMap, MediumId, MergePeriods, NO_LIMIT,
    PathLengths, PreparedScene, RadiusField, Ray, Roulette, Spectrum, StreamKind,
};
use upbp_media::{Homogeneous, PhaseFunction};

/// Scatters one half, evenly on either side.
#[derive(Clone, Copy)]
struct Matte {
    /// The factor for the throughput of walks.
    weight: f32,
}

const MATTE: Matte = Matte { weight: 0.5 };

/// A direction about +z with a density in proportion to its cosine.
fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let (sin, cos) = (TAU * u[1]).sin_cos();
    Vec3::new(u[0].sqrt() * cos, u[0].sqrt() * sin, (1.0 - u[0]).sqrt())
}

impl Bsdf for Matte {
    fn eval(&self, towards_light: Vec3, towards_camera: Vec3, _: Interface) -> Spectrum {
        let is_reflected = towards_light.z * towards_camera.z > 0.0;
        if is_reflected { Spectrum::splat(0.5 * FRAC_1_PI) } else { Spectrum::ZERO }
    }
    fn pdf(&self, from: Vec3, to: Vec3, _: Interface) -> f32 {
        if from.z * to.z > 0.0 { to.z.abs() * FRAC_1_PI } else { 0.0 }
    }
    fn sample(&self, from: Vec3, _: Walk, interface: Interface, _: f32, u: [f32; 2]) -> Option<BsdfSample> {
        let to = cosine_hemisphere(u) * Vec3::new(1.0, 1.0, from.z.signum());
        let (pdf, pdf_reverse) = (self.pdf(from, to, interface), self.pdf(to, from, interface));
        Some(BsdfSample { to, weight: Spectrum::splat(self.weight), pdf, pdf_reverse, delta: false })
    }
    fn is_connectible(&self) -> bool {
        true
    }
}

/// A square that shines downwards, and the receivers that it was asked for.
struct Lamp {
    middle: Vec3,
    chosen_for: Mutex<Vec<Vec3>>,
    hit_from: Mutex<Vec<Vec3>>,
}

impl Lamp {
    const HALF: f32 = 0.5;
    const PDF: f32 = 0.25 / (Self::HALF * Self::HALF);
    const RADIANCE: Spectrum = Spectrum::ONE;

    fn point(&self, u: [f32; 2]) -> EmitterPoint {
        let [x, z] = u.map(|u| Self::HALF * (2.0 * u - 1.0));
        EmitterPoint { position: self.middle + Vec3::new(x, 0.0, z), normal: Vec3::NEG_Y }
    }
}

impl Emitter for Lamp {
    fn kind(&self) -> EmitterKind {
        EmitterKind::Area
    }
    fn power(&self, _: &BoundingSphere) -> f32 {
        1.0
    }
    fn sample_emission(&self, _: &BoundingSphere, u: [f32; 2], v: [f32; 2]) -> Option<Emission> {
        let local = cosine_hemisphere(v);
        Some(Emission {
            point: self.point(u),
            direction: Vec3::new(local.x, -local.z, local.y),
            radiance: Self::RADIANCE,
            pdf_position: Self::PDF,
            pdf_direction: local.z * FRAC_1_PI,
        })
    }
    fn sample_incident(&self, _: &BoundingSphere, receiver: Vec3, u: [f32; 2]) -> Option<Incident> {
        self.chosen_for.lock().expect("no panic").push(receiver);
        let point = self.point(u);
        let (towards_light, distance) = (point.position - receiver).normalize_and_length();
        Some(Incident {
            point,
            towards_light,
            distance,
            radiance: Self::RADIANCE,
            pdf: Self::PDF,
            pdf_position: Self::PDF,
            pdf_direction: towards_light.y.max(0.0) * FRAC_1_PI,
        })
    }
    fn hit(
        &self,
        _: &BoundingSphere,
        _: &EmitterPoint,
        direction: Vec3,
        receiver: Vec3,
    ) -> Option<HitDensities> {
        self.hit_from.lock().expect("no panic").push(receiver);
        (direction.y < 0.0).then_some(HitDensities {
            radiance: Self::RADIANCE,
            pdf_incident: Self::PDF,
            pdf_position: Self::PDF,
            pdf_direction: -direction.y * FRAC_1_PI,
        })
    }
}

/// A pinhole that looks down.
struct Eye(Vec3);

impl Camera for Eye {
    fn resolution(&self) -> (u32, u32) {
        (1, 1)
    }
    fn ray(&self, film: Vec2, _: [f32; 2]) -> Option<CameraRay> {
        let direction = Vec3::new(film.x - 0.5, -1.0, film.y - 0.5).normalize();
        Some(CameraRay { origin: self.0, direction, pdf: direction.y.powi(-3).abs() })
    }
    fn connect(&self, _: Vec3, _: [f32; 2]) -> Option<CameraConnection> {
        None
    }
    fn is_pinhole(&self) -> bool {
        true
    }
}

/// A floor around `middle`, a lamp above, and a medium that is nowhere.
struct Room {
    middle: Vec3,
    floor: Matte,
    lamps: [Lamp; 1],
    media: [Homogeneous; 1],
    eye: Eye,
}

impl Room {
    fn new(middle: Vec3) -> Self {
        let [chosen_for, hit_from] = [Mutex::default(), Mutex::default()];
        let milk = Homogeneous::new(Spectrum::ZERO, Spectrum::splat(100.0), PhaseFunction::Isotropic);
        Self {
            middle,
            floor: MATTE,
            lamps: [Lamp { middle: middle + Vec3::Y, chosen_for, hit_from }],
            media: [milk.expect("a valid medium")],
            eye: Eye(middle + 0.5 * Vec3::Y),
        }
    }
}

impl Scene for Room {
    type Bsdf = Matte;
    type Emitter = Lamp;
    type Medium = Homogeneous;
    type Camera = Eye;

    fn intersect(&self, ray: &Ray) -> Option<Hit<Matte>> {
        let square = |middle: Vec3, half: f32, normal: Vec3, bsdf: Matte, emitter: Option<EmitterId>| {
            let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
            let t = (f64::from(middle.y) - origin.y) / direction.y;
            let position = (origin + t * direction).as_vec3().with_y(middle.y);
            let t = t as f32;
            let is_met = t > ray.t_min && t < ray.t_max && (position - middle).abs().max_element() <= half;
            is_met.then_some(Hit {
                t,
                position,
                geometric_normal: normal,
                shading_normal: normal,
                boundary: Boundary::Opaque(bsdf),
                emitter,
            })
        };
        let floor = square(self.middle, 1.0, Vec3::Y, self.floor, None);
        let lamp = square(self.lamps[0].middle, Lamp::HALF, Vec3::NEG_Y, MATTE, Some(EmitterId(0)));
        floor.into_iter().chain(lamp).min_by(|a, b| a.t.total_cmp(&b.t))
    }
    fn bounds(&self) -> BoundingSphere {
        BoundingSphere { centre: self.middle + 0.5 * Vec3::Y, radius: 1.6 }
    }
    fn emitters(&self) -> &[Lamp] {
        &self.lamps
    }
    fn media(&self) -> &[Homogeneous] {
        &self.media
    }
    fn camera(&self) -> &Eye {
        &self.eye
    }
}

/// Traces camera sub-paths by hits and next events.
fn trace(scene: &Room) -> Counters {
    let prepared = PreparedScene::new(scene).expect("a valid scene");
    let choices = IterationChoices {
        seed: 1,
        iteration: 0,
        techniques: "hit+nee".parse().expect("names"),
        light_paths: 0,
        beam_paths: 0,
        connections: 0.0,
        next_events: 1.0,
        camera_factor: 1.0,
        vertices_per_light_path: 0.0,
        lengths: PathLengths { min: 1, max: 4 },
        roulette: Roulette::Off,
        kernels: Kernels::from_fn(|_| Kernel::NONE),
        radius_field: RadiusField::Uniform,
        mean_free_paths: NO_LIMIT,
        periods: MergePeriods::ONE,
        heuristic: Heuristic::Balance,
        photon_beams: BeamExtent::Short,
        query_beams: BeamExtent::Short,
        lanes: None,
        features: false,
    };
    let plan = IterationPlan::new(scene, &choices);
    let context = Context { prepared: &prepared, plan: &plan };
    let map = LightMap::<_, f64, f64>::empty();
    let (mut scratch, mut counters) = (Scratch::default(), Counters::default());
    for index in 0..256 {
        let stream = plan.stream(StreamKind::Camera, index);
        trace_camera_path(&context, &map, stream, [0, 0], &mut scratch, &mut counters, &mut NoObserver);
    }
    counters
}

/// Else weights would not sum to one where the density of a light jumps next to a surface.
#[test]
fn hits_and_next_events_have_the_same_receivers() {
    let scene = Room::new(Vec3::new(3.0, 1.0, 2.0));
    assert_eq!(trace(&scene).dropped, 0);
    let [Lamp { chosen_for, hit_from, .. }] = scene.lamps;
    let [chosen_for, hit_from] = [chosen_for, hit_from].map(|asked| asked.into_inner().expect("no panic"));
    assert!(hit_from.len() > 50, "{} hits", hit_from.len());
    for receiver in hit_from {
        assert!(chosen_for.contains(&receiver), "{receiver}");
    }
}

#[test]
fn camera_sub_paths_that_carry_no_number_are_counted() {
    for weight in [f32::NAN, f32::INFINITY] {
        let scene = Room::new(Vec3::ZERO);
        let floor = Matte { weight };
        let counters = trace(&Room { floor, ..scene });
        assert!(counters.dropped > 50, "{weight}: {counters:?}");
    }
}

#[test]
fn media_extend_to_the_largest_coordinates() {
    let is_dense = |middle: Vec3| {
        let scene = Room::new(middle);
        PreparedScene::new(&scene).expect("a valid scene").is_dense(MediumId(0))
    };
    // The mean free path is a hundredth.
    assert!(!is_dense(Vec3::ZERO));
    for far in [Vec3::X, Vec3::NEG_Y, Vec3::Z] {
        let scene = Room::new(1e3 * far);
        let place = scene.eye.0.abs().max_element();
        assert!(scene.medium_extent(MediumId(0)) >= place && is_dense(1e3 * far), "{far}");
    }
}

#[test]
fn the_checker_accepts_scenes_far_from_the_origin() {
    for far in [0.0, 2100.0, 30_000.0] {
        check_scene(&Room::new(Vec3::new(far, 0.5 * far, -far))).unwrap();
    }
}
