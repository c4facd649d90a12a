//! The inside of a body that emits: the same radiance per length in all directions.
//!
//! Light sub-paths start uniformly by volume. So do next events, except at a sphere: there a direction is
//! chosen uniformly among those in which the receiver sees it, and a point on that chord by the light that it
//! sends, so that neither distance nor extinction make the light uneven (`docs/theory.md`, section 2.9).

use std::f32::consts::{FRAC_1_PI, PI, TAU};
use std::sync::Arc;

use glam::{DVec3, Vec3};
use upbp_accel::{Shape, ShapeVolume, Sphere};
use upbp_estimators::scene::{
    BoundingSphere, Emission, EmissionCoordinates, Emitter, EmitterBounds, EmitterKind, EmitterPoint,
    HitDensities, Incident,
};
use upbp_media::{BodyId, Homogeneous, Medium, RaySegment};

use super::finite::{direction_and_distance, incident};
use crate::sampling;

/// Density of a uniform direction, sr⁻¹.
const PDF_DIRECTION: f32 = 0.25 * FRAC_1_PI;

/// Light gets out of a volume from this part of its largest coordinate at least, or rounding of positions
/// would decide what it is attenuated by.
const LEAST_DEPTH: f64 = 3e-5;

/// Light gets out of a volume from this part of the radius of the scene at least, or receivers on the other
/// side of it could not tell by their distance what is inside.
const LEAST_DEPTH_FROM_AFAR: f64 = 1e-6;

/// A body whose medium emits.
#[derive(Clone, Debug)]
pub struct VolumeLight {
    body: BodyId,
    inside: ShapeVolume,
    bounds: EmitterBounds,
    /// Shared by the lights of all bodies with it.
    medium: Arc<Homogeneous>,
    /// Length of a ray inside from which light gets out, scene units.
    depth: f64,
    power: f32,
}

impl VolumeLight {
    /// The light of `body`, which is the inside of `shape` filled with `medium`, in a scene of the given
    /// radius. `None` if it does not emit.
    ///
    /// Without power, so that it is never chosen, if positions in single precision cannot tell its points
    /// apart.
    #[must_use]
    pub fn new(body: BodyId, shape: &Shape, medium: Arc<Homogeneous>, scene_radius: f32) -> Option<Self> {
        let inside = if medium.emits() { ShapeVolume::new(shape)? } else { return None };
        let mean_chord = 4.0 * inside.volume() / f64::from(shape.area());
        let depth = mean_chord.min(f64::from(medium.mean_free_path()));
        let source = f64::from(medium.source(Vec3::ZERO).mean());
        let power = (f64::from(4.0 * PI) * inside.volume() * source) as f32;
        let numbers = [inside.pdf() as f32, (1.0 / depth) as f32, power];
        let (min, max) = shape.aabb();
        let largest = f64::from(min.abs().max(max.abs()).max_element());
        let least = (LEAST_DEPTH * largest).max(LEAST_DEPTH_FROM_AFAR * f64::from(scene_radius));
        let is_fit = numbers.iter().all(|x| x.is_normal()) && depth > least;
        let bounds = EmitterBounds::all_around(min, max);
        Some(Self { body, inside, bounds, medium, depth, power: if is_fit { power } else { 0.0 } })
    }

    fn pdf_position(&self) -> f32 {
        self.inside.pdf() as f32
    }

    fn sample_point(&self, receiver: Vec3, u: [f32; 2]) -> Option<Vec3> {
        let Some(sphere) = self.inside.as_sphere() else { return Some(self.inside.sample(three(u))) };
        let [_, _, u_distance] = three(u);
        let direction = match sampling::cone_of(sphere, receiver) {
            Some((axis, height)) => sampling::fine::cone(axis, height, u.map(f64::from)),
            None => sampling::sphere(u).as_dvec3().normalize(),
        };
        // A ray on the rim of the cone may miss by rounding.
        let from = receiver.as_dvec3();
        let [start, end] = chord(sphere, from, direction)?;
        let t = self.medium.sample_emitted(&stretch(end - start), u_distance as f32)?;
        Some((from + direction * (start + f64::from(t))).as_vec3())
    }
}

/// Three numbers from the two of a start: the third is a hash of both, as are the digits that single
/// precision leaves out.
fn three([u, v]: [f32; 2]) -> [f64; 3] {
    // The finaliser of SplitMix64 (Steele et al. 2014).
    let mut z = (u64::from(u.to_bits()) << 32 | u64::from(v.to_bits())).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^= z >> 31;
    let part = |shift: u32, bits: u32| (z >> shift & ((1 << bits) - 1)) as f32 / (1_u32 << bits) as f32;
    let [u, v] = sampling::fine::numbers([u, v], [part(0, 20), part(20, 20)]);
    [u, v, f64::from(part(40, 24))]
}

/// Distances at which a ray from `from` is in the sphere first and last.
fn chord(sphere: &Sphere, from: DVec3, direction: DVec3) -> Option<[f64; 2]> {
    let to_centre = sphere.centre().as_dvec3() - from;
    let along = to_centre.dot(direction);
    let across = to_centre - direction * along;
    let half2 = f64::from(sphere.radius()).powi(2) - across.length_squared();
    let half = if half2 > 0.0 { half2.sqrt() } else { return None };
    let [start, end] = [(along - half).max(0.0), along + half];
    (end > start).then_some([start, end])
}

/// A ray of that length inside of the medium.
fn stretch(length: f64) -> RaySegment {
    RaySegment { origin: Vec3::ZERO, direction: Vec3::Z, start: 0.0, end: length as f32 }
}

impl Emitter for VolumeLight {
    fn kind(&self) -> EmitterKind {
        EmitterKind::Volume(self.body)
    }

    fn power(&self, _: &BoundingSphere) -> f32 {
        self.power
    }

    fn bounds(&self, _: &BoundingSphere) -> Option<EmitterBounds> {
        Some(self.bounds)
    }

    fn sample_emission(
        &self,
        _: &BoundingSphere,
        u_position: [f32; 2],
        u_direction: [f32; 2],
    ) -> Option<Emission> {
        let (position, direction) = (self.inside.sample(three(u_position)), sampling::sphere(u_direction));
        Some(Emission {
            point: EmitterPoint { position, normal: direction },
            direction,
            radiance: self.medium.source(position),
            pdf_position: self.pdf_position(),
            pdf_direction: PDF_DIRECTION,
        })
    }

    fn sample_incident(&self, bounds: &BoundingSphere, receiver: Vec3, u: [f32; 2]) -> Option<Incident> {
        let position = self.sample_point(receiver, u)?;
        let (towards_light, distance) = direction_and_distance(receiver, position)?;
        let point = EmitterPoint { position, normal: -towards_light };
        let seen = self.hit(bounds, &point, -towards_light, receiver)?;
        incident(point, towards_light, distance, &seen)
    }

    fn hit(
        &self,
        bounds: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        receiver: Vec3,
    ) -> Option<HitDensities> {
        let pdf_position = self.pdf_position();
        Some(HitDensities {
            radiance: self.medium.source(point.position),
            pdf_incident: self.pdf_incident(bounds, point, direction, receiver, pdf_position),
            pdf_position,
            pdf_direction: PDF_DIRECTION,
        })
    }

    fn pdf_passage(&self, _: &EmitterPoint) -> f32 {
        (1.0 / self.depth) as f32
    }

    fn pdf_incident(
        &self,
        _: &BoundingSphere,
        point: &EmitterPoint,
        _: Vec3,
        receiver: Vec3,
        pdf_position: f32,
    ) -> f32 {
        let Some(sphere) = self.inside.as_sphere() else { return pdf_position };
        let (from, to) = (receiver.as_dvec3(), point.position.as_dvec3());
        let between = to - from;
        let Some(direction) = between.try_normalize() else { return 0.0 };
        let Some([start, end]) = chord(sphere, from, direction) else { return 0.0 };
        let pdf_solid_angle = sampling::cone_of(sphere, receiver)
            .map_or(PDF_DIRECTION, |(_, height)| 1.0 / (TAU * height as f32));
        let segment = stretch(end - start);
        let distance = (between.length() - start) as f32;
        let pdf_distance = self.medium.pdf_emitted(&segment, distance.clamp(0.0, segment.end));
        // p_volume = p_ω p_t / d².
        let pdf = f64::from(pdf_solid_angle) * pdf_distance / between.length_squared();
        if (pdf as f32).is_finite() { pdf as f32 } else { 0.0 }
    }

    fn emission_coordinates(
        &self,
        _: &BoundingSphere,
        _: &EmitterPoint,
        direction: Vec3,
        _: Vec3,
    ) -> Option<EmissionCoordinates> {
        Some(EmissionCoordinates { position: None, direction: Some(sampling::sphere_inverse(direction)) })
    }
}
