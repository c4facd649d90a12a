//! A host that is in order but for one fault of a list.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

use glam::{Vec2, Vec3};
use upbp_core::media::{Homogeneous, Medium, PhaseFunction, RaySegment, SegmentDensity};
use upbp_core::scene::{
    Boundary, BoundingSphere, Bsdf, BsdfSample, Camera, CameraConnection, CameraRay, Emission, Emitter,
    EmitterId, EmitterKind, EmitterPoint, Hit, HitDensities, Incident, Interface, LensConnection, Scene,
    Walk,
};
use upbp_core::{BodyId, Canceller, Interior, MediumId, Ray, Spectrum};
use upbp_scene::{Light, Material, PerspectiveCamera, ReadyScene};

/// A contract that the host breaks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fault {
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
    EmitterMissing,
    /// Light from infinity comes through what is around everything from above only.
    OutsideVaries,
    RefractiveIndex(f32),
    NothingConnectible,
    NothingSpecular,
    BsdfNan,
    BsdfNegative,
    BsdfInfinite,
    BsdfPdf(f32),
    BsdfDirection,
    BsdfRoulette(f32),
    BsdfWeight(f32),
    BsdfAlbedo(f32),
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
    CameraLens,
    CameraImage(f32),
    Bounds(f32),
    Power(f32),
}

use Fault as F;

/// The part of a host that has a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Part {
    Scene,
    Bsdf,
    Medium,
    Light,
    Camera,
}

impl Fault {
    pub(super) const fn part(self) -> Part {
        match self {
            F::BsdfNan
            | F::BsdfNegative
            | F::BsdfInfinite
            | F::BsdfPdf(_)
            | F::BsdfDirection
            | F::BsdfRoulette(_)
            | F::BsdfWeight(_)
            | F::BsdfAlbedo(_) => Part::Bsdf,
            F::Transmittance(_)
            | F::Reach(_)
            | F::Stop(_)
            | F::Distance(_)
            | F::Scattering(_)
            | F::Continuation(_)
            | F::FreePath(_) => Part::Medium,
            F::Radiance(_) | F::LightPdf(_) | F::LightDirection | F::LightOutside | F::Power(_) => {
                Part::Light
            }
            F::CameraPdf(_) | F::CameraDirection | F::CameraFilm | F::CameraLens | F::CameraImage(_) => {
                Part::Camera
            }
            _ => Part::Scene,
        }
    }
}

/// A good scene with one fault.
pub(super) struct Hostile {
    scene: ReadyScene,
    lights: Vec<HostileLight>,
    media: Vec<HostileMedium>,
    camera: HostileCamera,
    fault: Fault,
    bodies: AtomicU32,
    /// Rays so far, and what to cancel after how many.
    pub(super) rays: AtomicU64,
    pub(super) end: Option<(u64, Canceller)>,
}

#[derive(Clone, Copy)]
pub(super) struct HostileBsdf(Material, Fault);
pub(super) struct HostileLight(Light, Fault);
pub(super) struct HostileMedium(Homogeneous, Fault);
pub(super) struct HostileCamera(PerspectiveCamera, Fault);

impl Hostile {
    fn new_body(&self) -> u32 {
        self.bodies.fetch_add(1, Ordering::Relaxed)
    }

    pub(super) fn new(fault: Fault) -> Self {
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
        let sky = if fault == F::OutsideVaries { "lights: [Constant(0.1), " } else { "lights: [" };
        let scene = ReadyScene::from_ron_str(&text.replace("lights: [", sky), "").expect("a valid scene");
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

fn interior_of(hit: &mut Hit<HostileBsdf>) -> Option<&mut Interior> {
    match &mut hit.boundary {
        Boundary::Opaque(_) => None,
        Boundary::Refracting(_, interior) | Boundary::Null(interior) => Some(interior),
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
            boundary: match hit.boundary {
                Boundary::Opaque(bsdf) => Boundary::Opaque(HostileBsdf(bsdf, self.fault)),
                Boundary::Refracting(bsdf, body) => Boundary::Refracting(HostileBsdf(bsdf, self.fault), body),
                Boundary::Null(body) => Boundary::Null(body),
            },
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
            F::BoundaryNan if hit.boundary.is_null() => (hit.t, hit.position) = (f32::NAN, Vec3::NAN),
            F::Endless | F::EndlessBodies => {
                hit.t = ray.t_min * 1.001 + 1e-6;
                hit.emitter = None;
                hit.position = ray.at(hit.t);
                (hit.geometric_normal, hit.shading_normal) = (ray.direction, ray.direction);
                let body = if self.fault == F::Endless { 0 } else { self.new_body() };
                let medium = Some(MediumId(0));
                hit.boundary = Boundary::Null(Interior { body: BodyId(body), medium, priority: 0, ior: 1.0 });
            }
            F::NewBodies => {
                if let Some(interior) = interior_of(&mut hit) {
                    interior.body = BodyId(self.new_body());
                    (hit.geometric_normal, hit.shading_normal) = (ray.direction, ray.direction);
                }
            }
            F::NormalInwards if hit.boundary.interior().is_some() => {
                (hit.geometric_normal, hit.shading_normal) = (-hit.geometric_normal, -hit.shading_normal);
            }
            F::NormalTurned if hit.geometric_normal.dot(ray.direction) > 0.0 => {
                (hit.geometric_normal, hit.shading_normal) = (-hit.geometric_normal, -hit.shading_normal);
            }
            F::InteriorMissing => {
                if let Boundary::Refracting(bsdf, _) = hit.boundary {
                    hit.boundary = Boundary::Opaque(bsdf);
                }
            }
            F::PositionElsewhere => hit.position += 10.0,
            F::MediumUnknown => {
                if let Some(interior) = interior_of(&mut hit) {
                    interior.medium = Some(MediumId(99));
                }
            }
            F::RefractiveIndex(ior) => {
                if let Some(interior) = interior_of(&mut hit) {
                    interior.ior = ior;
                }
            }
            F::EmitterUnknown => hit.emitter = Some(EmitterId(99)),
            F::EmitterMissing => hit.emitter = None,
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

    fn outside(&self) -> Option<MediumId> {
        (self.fault == F::OutsideVaries).then_some(MediumId(0))
    }

    fn has_connectible_surfaces(&self) -> bool {
        self.fault != F::NothingConnectible
    }

    fn has_specular_surfaces(&self) -> bool {
        self.fault != F::NothingSpecular
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

    fn albedo(&self, from: Vec3) -> Spectrum {
        if let F::BsdfAlbedo(albedo) = self.1 { Spectrum::splat(albedo) } else { self.0.albedo(from) }
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
            F::OutsideVaries if segment.end == f32::INFINITY && segment.direction.y > 0.0 => {
                density = SegmentDensity::passing(Spectrum::ONE);
            }
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
            F::CameraLens => ray.origin.x += u_lens[0],
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

    fn connect_at(&self, _: Vec3, _: Vec2) -> Option<LensConnection> {
        let F::CameraImage(image_area) = self.1 else { return None };
        Some(LensConnection { lens: self.0.origin(), pdf: 1.0, image_area })
    }

    fn is_pinhole(&self) -> bool {
        !matches!(self.1, F::CameraImage(_))
    }
}

const BAD: [f32; 4] = [f32::NAN, f32::INFINITY, -1.0, 0.0];

/// Faults in what rays meet.
pub(super) const GEOMETRY: [Fault; 21] = [
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
pub(super) fn faults() -> Vec<Fault> {
    let mut faults = vec![
        F::NothingConnectible,
        F::NothingSpecular,
        F::EmitterMissing,
        F::OutsideVaries,
        F::CameraLens,
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
        faults.push(F::RefractiveIndex(bad));
        faults.extend([F::Distance(bad), F::Continuation(bad), F::LightPdf(bad), F::CameraPdf(bad)]);
        faults.push(F::CameraImage(bad));
        // Black, opaque and clear are possible.
        if bad != 0.0 {
            faults.extend([F::BsdfWeight(bad), F::Transmittance(bad), F::Scattering(bad), F::Radiance(bad)]);
            faults.push(F::BsdfAlbedo(bad));
        }
        if bad != f32::INFINITY {
            faults.push(F::FreePath(bad));
        }
    }
    faults
}
