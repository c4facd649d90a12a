//! Hosts that break the contract of their scene: the renderer drops and counts, or refuses, and never panics;
//! what reaches the film is finite and not negative; and the contract checkers find every kind of fault.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

use glam::{Vec2, Vec3};
use upbp_core::check::{check_bsdf, check_camera, check_emitter, check_medium, check_scene};
use upbp_core::media::{Homogeneous, Medium, PhaseFunction, RaySegment, SegmentDensity};
use upbp_core::scene::{
    BoundingSphere, Bsdf, BsdfSample, Camera, CameraConnection, CameraRay, Emission, Emitter, EmitterId,
    EmitterKind, EmitterPoint, Hit, HitDensities, Incident, Interface, Scene, Walk,
};
use upbp_core::{
    BodyId, Canceller, Counters, Interior, MediumId, Ray, RenderError, Renderer, Settings, Spectrum, Start,
    Stop, StopReason,
};
use upbp_scene::{Light, Material, PerspectiveCamera, ReadyScene};

/// A contract that the host breaks.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    None,
    NormalNan,
    NormalZero,
    NormalLong,
    ShadingNan,
    ShadingOpposite,
    HitBehind,
    HitNan,
    HitInfinite,
    PositionNan,
    PositionInfinite,
    BoundaryNan,
    /// Null boundaries without an end, of one body or of another each time.
    Endless,
    EndlessBodies,
    /// Null boundaries that are left, of another body whenever one is asked for.
    NewBodies,
    NormalInwards,
    NormalTurned,
    InteriorMissing,
    PositionElsewhere,
    MediumUnknown,
    EmitterUnknown,
    BsdfNan,
    BsdfNegative,
    BsdfInfinite,
    BsdfPdf(f32),
    BsdfDirection,
    BsdfRoulette(f32),
    BsdfWeight(f32),
    Transmittance(f32),
    Reach(f64),
    Stop(f64),
    Distance(f32),
    Scattering(f32),
    Continuation(f32),
    FreePath(f32),
    Radiance(f32),
    LightPdf(f32),
    LightDirection,
    LightOutside,
    CameraPdf(f32),
    CameraDirection,
    CameraFilm,
    Bounds(f32),
    Power(f32),
}

use Fault as F;

/// A good scene with one fault.
struct Hostile {
    scene: ReadyScene,
    lights: Vec<HostileLight>,
    media: Vec<HostileMedium>,
    camera: HostileCamera,
    fault: Fault,
    bodies: AtomicU32,
    /// Rays so far, and what to cancel after how many.
    rays: AtomicU64,
    end: Option<(u64, Canceller)>,
}

#[derive(Clone, Copy)]
struct HostileBsdf(Material, Fault);
struct HostileLight(Light, Fault);
struct HostileMedium(Homogeneous, Fault);
struct HostileCamera(PerspectiveCamera, Fault);

impl Hostile {
    fn new_body(&self) -> u32 {
        self.bodies.fetch_add(1, Ordering::Relaxed)
    }

    fn new(fault: Fault) -> Self {
        let text = "(version: 1, camera: Perspective(origin: (0, 0.5, 3), target: (0, 0, 0), fov_degrees: 40),
            film: (width: 8, height: 8), media: {\"m\": Homogeneous(sigma_a: 0.1, sigma_s: (1, 0.9, 0.5))},
            materials: {\"null\": Null, \"grey\": Lambert(0.5), \"black\": Lambert(0), \"glass\": Dielectric(ior: 1.5)},
            shapes: [
                (geometry: Sphere(centre: (0, 0, 0), radius: 1), material: \"null\", interior: \"m\"),
                (geometry: Quad(origin: (-2, -1, -2), edge_u: (0, 0, 4), edge_v: (4, 0, 0)), material: \"grey\"),
                (geometry: Sphere(centre: (0.5, 2, 0), radius: 0.25), material: \"black\", emission: 5),
                (geometry: Sphere(centre: (-1.5, 0, 0), radius: 0.15), material: \"glass\"),
            ],
            lights: [Point(position: (-1, 2, 0), intensity: 1)])";
        let scene = ReadyScene::from_ron_str(text, "").expect("a valid scene");
        Self {
            lights: scene.emitters().iter().map(|light| HostileLight(light.clone(), fault)).collect(),
            media: scene.media().iter().map(|medium| HostileMedium(medium.clone(), fault)).collect(),
            camera: HostileCamera(*scene.camera(), fault),
            scene,
            fault,
            bodies: AtomicU32::new(100),
            rays: AtomicU64::new(0),
            end: None,
        }
    }
}

impl Scene for Hostile {
    type Bsdf = HostileBsdf;
    type Emitter = HostileLight;
    type Medium = HostileMedium;
    type Camera = HostileCamera;

    fn intersect(&self, ray: &Ray) -> Option<Hit<HostileBsdf>> {
        let rays = self.rays.fetch_add(1, Ordering::Relaxed);
        if let Some((last, canceller)) = &self.end
            && rays == *last
        {
            canceller.cancel();
        }
        let hit = self.scene.intersect(ray)?;
        let mut hit = Hit {
            t: hit.t,
            position: hit.position,
            geometric_normal: hit.geometric_normal,
            shading_normal: hit.shading_normal,
            bsdf: hit.bsdf.map(|bsdf| HostileBsdf(bsdf, self.fault)),
            interior: hit.interior,
            emitter: hit.emitter,
        };
        match self.fault {
            F::NormalNan => hit.geometric_normal = Vec3::NAN,
            F::NormalZero => hit.geometric_normal = Vec3::ZERO,
            F::NormalLong => hit.geometric_normal *= 1e20,
            F::ShadingNan => hit.shading_normal = Vec3::NAN,
            F::ShadingOpposite => hit.shading_normal = -hit.geometric_normal,
            F::HitBehind => hit.t = -1.0,
            F::HitNan => hit.t = f32::NAN,
            F::HitInfinite => hit.t = f32::INFINITY,
            F::PositionNan => hit.position = Vec3::NAN,
            F::PositionInfinite => hit.position.x = f32::INFINITY,
            F::BoundaryNan if hit.bsdf.is_none() => (hit.t, hit.position) = (f32::NAN, Vec3::NAN),
            F::Endless | F::EndlessBodies => {
                hit.t = ray.t_min * 1.001 + 1e-6;
                (hit.bsdf, hit.emitter) = (None, None);
                hit.position = ray.at(hit.t);
                (hit.geometric_normal, hit.shading_normal) = (ray.direction, ray.direction);
                let body = if self.fault == F::Endless { 0 } else { self.new_body() };
                hit.interior =
                    Some(Interior { body: BodyId(body), medium: Some(MediumId(0)), priority: 0, ior: 1.0 });
            }
            F::NewBodies => {
                if let Some(interior) = &mut hit.interior {
                    interior.body = BodyId(self.new_body());
                    (hit.geometric_normal, hit.shading_normal) = (ray.direction, ray.direction);
                }
            }
            F::NormalInwards if hit.interior.is_some() => {
                (hit.geometric_normal, hit.shading_normal) = (-hit.geometric_normal, -hit.shading_normal);
            }
            F::NormalTurned if hit.geometric_normal.dot(ray.direction) > 0.0 => {
                (hit.geometric_normal, hit.shading_normal) = (-hit.geometric_normal, -hit.shading_normal);
            }
            F::InteriorMissing if hit.bsdf.is_some() => hit.interior = None,
            F::PositionElsewhere => hit.position += 10.0,
            F::MediumUnknown => {
                if let Some(interior) = &mut hit.interior {
                    interior.medium = Some(MediumId(99));
                }
            }
            F::EmitterUnknown => hit.emitter = Some(EmitterId(99)),
            _ => {}
        }
        Some(hit)
    }

    fn bounds(&self) -> BoundingSphere {
        match self.fault {
            F::Bounds(radius) => BoundingSphere { radius, ..self.scene.bounds() },
            _ => self.scene.bounds(),
        }
    }

    fn emitters(&self) -> &[HostileLight] {
        &self.lights
    }

    fn media(&self) -> &[HostileMedium] {
        &self.media
    }

    fn camera(&self) -> &HostileCamera {
        &self.camera
    }
}

impl Bsdf for HostileBsdf {
    fn eval(&self, towards_light: Vec3, towards_camera: Vec3, interface: Interface) -> Spectrum {
        let value = self.0.eval(towards_light, towards_camera, interface);
        match self.1 {
            F::BsdfNan => value * f32::NAN,
            F::BsdfNegative => value * -1.0,
            F::BsdfInfinite => Spectrum::splat(f32::INFINITY),
            _ => value,
        }
    }

    fn pdf(&self, from: Vec3, to: Vec3, interface: Interface) -> f32 {
        match self.1 {
            F::BsdfPdf(pdf) => pdf,
            _ => self.0.pdf(from, to, interface),
        }
    }

    fn sample(
        &self,
        from: Vec3,
        walk: Walk,
        interface: Interface,
        lobe: f32,
        u: [f32; 2],
    ) -> Option<BsdfSample> {
        let mut sample = self.0.sample(from, walk, interface, lobe, u)?;
        match self.1 {
            F::BsdfPdf(pdf) => (sample.pdf, sample.pdf_reverse) = (pdf, pdf),
            F::BsdfDirection => sample.to = Vec3::NAN,
            F::BsdfWeight(weight) => sample.weight = Spectrum::splat(weight),
            _ => {}
        }
        Some(sample)
    }

    fn is_connectible(&self) -> bool {
        self.0.is_connectible()
    }

    fn continuation(&self, from: Vec3) -> f32 {
        match self.1 {
            F::BsdfRoulette(probability) => probability,
            _ => self.0.continuation(from),
        }
    }
}

impl Medium for HostileMedium {
    fn scatters(&self) -> bool {
        true
    }

    fn segment(&self, segment: &RaySegment) -> SegmentDensity {
        let mut density = self.0.segment(segment);
        match self.1 {
            F::Transmittance(t) => density.transmittance = Spectrum::splat(t),
            F::Reach(value) => density.pass_probability = value,
            F::Stop(stop) => (density.stop_at_start, density.stop_at_end) = (stop, stop),
            _ => {}
        }
        density
    }

    fn sample_distance(&self, segment: &RaySegment, channel: f32, distance: f32) -> Option<f32> {
        let stop = self.0.sample_distance(segment, channel, distance)?;
        Some(if let F::Distance(t) = self.1 { t } else { stop })
    }

    fn sigma_s(&self, position: Vec3) -> Spectrum {
        let sigma = self.0.sigma_s(position);
        if let F::Scattering(factor) = self.1 { sigma * factor } else { sigma }
    }

    fn sigma_t(&self, position: Vec3) -> Spectrum {
        self.0.sigma_t(position)
    }

    fn phase(&self) -> &PhaseFunction {
        self.0.phase()
    }

    fn continuation(&self, position: Vec3) -> f32 {
        if let F::Continuation(probability) = self.1 { probability } else { self.0.continuation(position) }
    }

    fn mean_free_path(&self) -> f32 {
        if let F::FreePath(path) = self.1 { path } else { self.0.mean_free_path() }
    }
}

impl Emitter for HostileLight {
    fn kind(&self) -> EmitterKind {
        self.0.kind()
    }

    fn power(&self, bounds: &BoundingSphere) -> f32 {
        if let F::Power(power) = self.1 { power } else { self.0.power(bounds) }
    }

    fn sample_emission(&self, bounds: &BoundingSphere, a: [f32; 2], b: [f32; 2]) -> Option<Emission> {
        let mut emission = self.0.sample_emission(bounds, a, b)?;
        match self.1 {
            F::Radiance(radiance) => emission.radiance = Spectrum::splat(radiance),
            F::LightPdf(pdf) => (emission.pdf_position, emission.pdf_direction) = (pdf, pdf),
            F::LightDirection => emission.direction = Vec3::NAN,
            F::LightOutside => emission.point.position += 1e6,
            _ => {}
        }
        Some(emission)
    }

    fn sample_incident(&self, bounds: &BoundingSphere, receiver: Vec3, u: [f32; 2]) -> Option<Incident> {
        let mut incident = self.0.sample_incident(bounds, receiver, u)?;
        match self.1 {
            F::Radiance(radiance) => incident.radiance = Spectrum::splat(radiance),
            F::LightPdf(pdf) => {
                (incident.pdf, incident.pdf_position, incident.pdf_direction) = (pdf, pdf, pdf);
            }
            F::LightDirection => incident.towards_light = Vec3::NAN,
            _ => {}
        }
        Some(incident)
    }

    fn hit(
        &self,
        bounds: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        receiver: Vec3,
    ) -> Option<HitDensities> {
        let mut hit = self.0.hit(bounds, point, direction, receiver)?;
        if let F::Radiance(radiance) = self.1 {
            hit.radiance = Spectrum::splat(radiance);
        }
        Some(hit)
    }

    fn pdf_incident(
        &self,
        bounds: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        receiver: Vec3,
        pdf_position: f32,
    ) -> f32 {
        self.0.pdf_incident(bounds, point, direction, receiver, pdf_position)
    }
}

impl Camera for HostileCamera {
    fn resolution(&self) -> (u32, u32) {
        self.0.resolution()
    }

    fn ray(&self, film: Vec2, u_lens: [f32; 2]) -> Option<CameraRay> {
        let mut ray = self.0.ray(film, u_lens)?;
        match self.1 {
            F::CameraPdf(pdf) => ray.pdf = pdf,
            F::CameraDirection => ray.direction = Vec3::NAN,
            _ => {}
        }
        Some(ray)
    }

    fn connect(&self, point: Vec3, u_lens: [f32; 2]) -> Option<CameraConnection> {
        let mut connection = self.0.connect(point, u_lens)?;
        match self.1 {
            F::CameraPdf(pdf) => connection.pdf = pdf,
            F::CameraFilm => connection.film = Vec2::new(f32::NAN, -1e30),
            _ => {}
        }
        Some(connection)
    }

    fn is_pinhole(&self) -> bool {
        true
    }
}

const BAD: [f32; 4] = [f32::NAN, f32::INFINITY, -1.0, 0.0];

/// Faults in what rays meet.
const GEOMETRY: [Fault; 21] = [
    F::NormalNan,
    F::NormalZero,
    F::NormalLong,
    F::ShadingNan,
    F::ShadingOpposite,
    F::HitBehind,
    F::HitNan,
    F::HitInfinite,
    F::PositionNan,
    F::PositionInfinite,
    F::BoundaryNan,
    F::Endless,
    F::EndlessBodies,
    F::NewBodies,
    F::NormalInwards,
    F::NormalTurned,
    F::InteriorMissing,
    F::PositionElsewhere,
    F::MediumUnknown,
    F::EmitterUnknown,
    F::Distance(f32::NAN),
];

/// Every kind of fault.
fn faults() -> Vec<Fault> {
    let mut faults = vec![
        F::BsdfNan,
        F::BsdfNegative,
        F::BsdfInfinite,
        F::BsdfDirection,
        F::LightDirection,
        F::LightOutside,
        F::CameraDirection,
        F::CameraFilm,
    ];
    faults.extend(GEOMETRY);
    for bad in BAD {
        faults.extend([F::BsdfPdf(bad), F::BsdfRoulette(bad), F::Reach(bad.into()), F::Stop(bad.into())]);
        faults.extend([F::Distance(bad), F::Continuation(bad), F::LightPdf(bad), F::CameraPdf(bad)]);
        // Black, opaque and clear are possible.
        if bad != 0.0 {
            faults.extend([F::BsdfWeight(bad), F::Transmittance(bad), F::Scattering(bad), F::Radiance(bad)]);
        }
        if bad != f32::INFINITY {
            faults.push(F::FreePath(bad));
        }
    }
    faults
}

/// Renders a little; what was dropped, or the reason not to start.
fn render(fault: Fault, techniques: &str) -> Result<Counters, String> {
    let scene = Hostile::new(fault);
    let settings = Settings {
        techniques: techniques.parse().expect("technique names"),
        light_paths: upbp_core::LightPaths::Count(256),
        max_length: 20,
        ..Settings::default()
    };
    let settings = settings.validate().expect("valid settings");
    let mut renderer = Renderer::new(&scene, settings).map_err(|error| error.to_string())?;
    for _ in 0..4 {
        renderer.iterate();
    }
    let film = renderer.film();
    for (name, image) in film.layers().filter_map(|layer| Some((layer.name(), film.layer(layer)?))) {
        let fine = image.pixels.iter().flatten().all(|value| value.is_finite() && *value >= 0.0);
        assert!(fine, "{fault:?}: {name}");
    }
    Ok(renderer.report().counters)
}

#[test]
fn nothing_bad_reaches_the_film_and_nothing_panics() {
    for techniques in ["all", "auto", "bpt"] {
        let good = render(F::None, techniques).expect("a good scene");
        assert_eq!((good.dropped, good.lost_walks), (0, 0));
        for fault in if techniques == "all" { faults() } else { GEOMETRY.to_vec() } {
            let outcome = std::panic::catch_unwind(|| render(fault, techniques));
            let counters = outcome.unwrap_or_else(|_| panic!("{fault:?} panics"));
            println!("{fault:?}, {techniques}: {counters:?}");
            // Values that take part in a contribution are dropped there, and counted. Walks that are told
            // what cannot be are lost.
            match fault {
                F::BsdfNan | F::BsdfNegative | F::BsdfInfinite | F::Radiance(_) => {
                    assert!(counters.expect("renders").dropped > 0, "{fault:?}");
                }
                F::NormalNan
                | F::ShadingNan
                | F::HitBehind
                | F::HitNan
                | F::HitInfinite
                | F::PositionNan
                | F::PositionInfinite
                | F::BoundaryNan
                | F::Endless
                | F::EndlessBodies
                | F::NewBodies
                | F::LightDirection
                | F::CameraDirection => assert!(counters.expect("renders").lost_walks > 0, "{fault:?}"),
                _ => {}
            }
        }
    }
}

#[test]
fn scenes_without_bounds_or_power_are_refused() {
    for bad in [f32::NAN, f32::INFINITY, -1.0] {
        assert!(render(F::Bounds(bad), "all").unwrap_err().contains("bounds"), "{bad}");
        assert!(render(F::Power(bad), "all").unwrap_err().contains("power"), "{bad}");
    }
    assert!(render(F::Bounds(0.0), "all").unwrap_err().contains("bounds"));
}

/// The verdict of the checkers on a scene, each asked for what it is about.
fn check(fault: Fault) -> Result<(), String> {
    let scene = Hostile::new(fault);
    let bounds = scene.bounds();
    check_scene(&scene).map_err(|violation| violation.to_string())?;
    for medium in scene.media() {
        check_medium(medium, &bounds).map_err(|violation| violation.to_string())?;
    }
    for light in scene.emitters() {
        let receivers = [Vec3::new(0.0, -0.9, 0.0), Vec3::new(0.5, 0.0, 0.0)];
        check_emitter(light, &bounds, &receivers).map_err(|violation| violation.to_string())?;
    }
    let down = Ray::new(Vec3::new(1.5, 0.0, 1.5), -Vec3::Y);
    let floor = scene.intersect(&down).and_then(|hit| hit.bsdf).ok_or("no floor")?;
    check_bsdf(&floor, Interface::MATCHED).map_err(|violation| violation.to_string())?;
    check_camera(scene.camera()).map_err(|violation| violation.to_string())
}

#[test]
fn the_checkers_find_every_fault() {
    check(F::None).expect("a good scene");
    let mut unseen = Vec::new();
    for fault in faults() {
        let outcome = std::panic::catch_unwind(|| check(fault));
        match outcome.unwrap_or_else(|_| panic!("{fault:?}: a checker panics")) {
            Ok(()) => unseen.push(fault),
            Err(violation) => println!("{fault:?}: {violation}"),
        }
    }
    assert!(unseen.is_empty(), "not found: {unseen:?}");
    for (fault, named) in [
        (F::NormalInwards, "geometric normals point out of a body"),
        (F::NormalTurned, "does not turn towards the ray"),
        (F::InteriorMissing, "a surface that refracts encloses a body"),
    ] {
        let violation = check(fault).unwrap_err();
        assert!(violation.contains(named), "{fault:?}: {violation}");
    }
    for bad in [f32::NAN, f32::INFINITY, -1.0] {
        assert!(check(F::Bounds(bad)).is_err() && check(F::Power(bad)).is_err(), "{bad}");
    }
}

/// A renderer of a scene that is cancelled by one of its rays.
fn begin(scene: &Hostile) -> Result<Renderer<'_>, RenderError> {
    let settings = Settings { deterministic: true, max_length: 20, ..Settings::default() };
    let canceller = scene.end.as_ref().map(|(_, canceller)| canceller.clone()).unwrap_or_default();
    Renderer::start(
        scene,
        settings.validate().expect("good settings"),
        Start { canceller, ..Start::default() },
    )
}

#[test]
fn cancelled_at_any_ray_it_ends_at_once_and_what_is_done_is_not_lost() {
    let scene = Hostile::new(F::None);
    let mut whole = begin(&scene).expect("a good scene");
    let of_preparation = scene.rays.load(Ordering::Relaxed);
    while whole.film().iterations() < 2 {
        assert!(whole.iterate());
    }
    let of_all = scene.rays.load(Ordering::Relaxed);
    let (mut refused, mut parts) = (0, 0);
    for last in (0..of_all).step_by((of_all / 60) as usize) {
        let cancelled = Hostile { end: Some((last, Canceller::default())), ..Hostile::new(F::None) };
        match begin(&cancelled) {
            Err(error) => {
                assert_eq!(error, RenderError::Cancelled);
                refused += 1;
            }
            Ok(mut renderer) => {
                let outcome = renderer
                    .render(&Stop { iterations: Some(2), ..Stop::default() }, |_| ControlFlow::Continue(()));
                assert_eq!(outcome.reason, StopReason::Cancelled);
                parts += renderer.film().parts().len();
                let mut resumed = begin(&scene).expect("a good scene");
                resumed.resume(renderer.state().clone()).expect("the same render");
                while resumed.film().iterations() < 2 {
                    assert!(resumed.iterate());
                }
                assert!(resumed.film() == whole.film(), "{last}");
            }
        }
        // The sub-paths in hand, of every thread.
        let more = cancelled.rays.load(Ordering::Relaxed) - last;
        assert!(more < 1000 * rayon::current_num_threads() as u64, "{more} rays more than {last}");
    }
    assert!(of_preparation < of_all && refused > 0 && parts > 0, "{refused} refused, {parts} parts");
}

#[test]
fn a_render_that_is_resumed_does_not_choose_again() {
    let scene = Hostile::new(F::None);
    let mut first = begin(&scene).expect("a good scene");
    let of_choice = scene.rays.load(Ordering::Relaxed);
    assert!(first.iterate() && first.iterate());
    let state = first.state().clone();

    let again = Hostile::new(F::None);
    let settings = Settings { deterministic: true, max_length: 20, ..Settings::default() };
    let start = Start { plan: Some(state.identity().frozen_plan()), ..Start::default() };
    let mut resumed =
        Renderer::start(&again, settings.validate().expect("good settings"), start).expect("a good scene");
    let rays = again.rays.load(Ordering::Relaxed);
    assert!(rays < of_choice, "{rays} rays, {of_choice} with a choice");
    resumed.resume(state).expect("the same render");
    assert!(resumed.iterate() && first.iterate());
    assert!(resumed.film() == first.film());
}
