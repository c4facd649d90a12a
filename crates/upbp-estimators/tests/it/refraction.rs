//! The ratio of the two walks' densities at a smooth interface (`docs/theory.md`, section 4.6): oracle is the
//! Jacobian of refraction by finite differences.

use glam::{DMat3, DVec3, Vec2, Vec3};
use upbp_estimators::path::{Interaction, Scattered, SurfaceInteraction, WalkState};
use upbp_estimators::scene::{
    BoundingSphere, Bsdf, BsdfSample, Camera, CameraConnection, CameraRay, Emission, Emitter, EmitterKind,
    EmitterPoint, Hit, HitDensities, Incident, Interface, Scene, Walk,
};
use upbp_estimators::{Ray, Roulette, Spectrum, Stream, StreamKind, Survival};
use upbp_media::Homogeneous;

/// Reflects or refracts with fixed probabilities that differ on the two sides.
#[derive(Clone, Copy, Debug)]
struct Glass;

impl Glass {
    /// Probability of refraction after arriving from above or below.
    const REFRACT: [f32; 2] = [0.8, 0.6];
    /// Probability to continue after arriving from above or below.
    const CONTINUE: [f32; 2] = [0.9, 0.7];
}

fn side(z: f32) -> usize {
    usize::from(z < 0.0)
}

impl Bsdf for Glass {
    fn eval(&self, _: Vec3, _: Vec3, _: Interface) -> Spectrum {
        Spectrum::ZERO
    }

    fn pdf(&self, _: Vec3, _: Vec3, _: Interface) -> f32 {
        0.0
    }

    fn sample(
        &self,
        from: Vec3,
        _: Walk,
        interface: Interface,
        u_lobe: f32,
        _: [f32; 2],
    ) -> Option<BsdfSample> {
        let refract = Self::REFRACT[side(from.z)];
        let sample =
            |to, pdf, pdf_reverse| BsdfSample { to, weight: Spectrum::ONE, pdf, pdf_reverse, delta: true };
        if u_lobe >= refract {
            return Some(sample(Vec3::new(-from.x, -from.y, from.z), 1.0 - refract, 1.0 - refract));
        }
        let ratio =
            if from.z > 0.0 { interface.above / interface.below } else { interface.below / interface.above };
        let sin = -from.truncate() * ratio;
        let cos2 = 1.0 - sin.length_squared();
        let to = sin.extend(cos2.sqrt().copysign(-from.z));
        (cos2 > 0.0).then(|| sample(to, refract, Self::REFRACT[side(to.z)]))
    }

    fn is_connectible(&self) -> bool {
        false
    }

    fn continuation(&self, from: Vec3) -> f32 {
        Self::CONTINUE[side(from.z)]
    }
}

/// Nothing is ever asked of the scene at a surface.
struct Nothing;

enum NoEmitter {}

impl Emitter for NoEmitter {
    fn kind(&self) -> EmitterKind {
        match *self {}
    }
    fn power(&self, _: &BoundingSphere) -> f32 {
        match *self {}
    }
    fn sample_emission(&self, _: &BoundingSphere, _: [f32; 2], _: [f32; 2]) -> Option<Emission> {
        match *self {}
    }
    fn sample_incident(&self, _: &BoundingSphere, _: Vec3, _: [f32; 2]) -> Option<Incident> {
        match *self {}
    }
    fn hit(&self, _: &BoundingSphere, _: &EmitterPoint, _: Vec3, _: Vec3) -> Option<HitDensities> {
        match *self {}
    }
}

impl Camera for Nothing {
    fn resolution(&self) -> (u32, u32) {
        (1, 1)
    }
    fn ray(&self, _: Vec2, _: [f32; 2]) -> Option<CameraRay> {
        None
    }
    fn connect(&self, _: Vec3, _: [f32; 2]) -> Option<CameraConnection> {
        None
    }
    fn is_pinhole(&self) -> bool {
        true
    }
}

impl Scene for Nothing {
    type Bsdf = Glass;
    type Emitter = NoEmitter;
    type Medium = Homogeneous;
    type Camera = Self;

    fn intersect(&self, _: &Ray) -> Option<Hit<Glass>> {
        None
    }
    fn bounds(&self) -> BoundingSphere {
        BoundingSphere { centre: Vec3::ZERO, radius: 1.0 }
    }
    fn emitters(&self) -> &[NoEmitter] {
        &[]
    }
    fn media(&self) -> &[Homogeneous] {
        &[]
    }
    fn camera(&self) -> &Self {
        self
    }
}

/// Refraction of a direction of propagation at an interface with this normal.
fn refract(direction: DVec3, normal: DVec3, ratio: f64) -> DVec3 {
    let cos = -direction.dot(normal);
    let across = ratio * (direction + cos * normal);
    across - (1.0 - across.length_squared()).sqrt() * cos.signum() * normal
}

/// `dω_to / dω_from` of [`refract`] by central differences.
fn jacobian(direction: DVec3, normal: DVec3, ratio: f64) -> f64 {
    let step = 1e-5;
    let (s, t) = direction.any_orthonormal_pair();
    let image = |offset: DVec3| refract((direction + offset).normalize(), normal, ratio);
    let ds = (image(step * s) - image(-step * s)) / (2.0 * step);
    let dt = (image(step * t) - image(-step * t)) / (2.0 * step);
    // The images lie in the tangent plane of the refracted direction.
    DMat3::from_cols(ds, dt, refract(direction, normal, ratio)).determinant().abs()
}

fn transmitted(interaction: &Interaction<Glass>, walk: Walk, from: Vec3) -> Option<Scattered<f64>> {
    (0..64).find_map(|index| {
        let mut state = WalkState::<f64> {
            walk,
            stream: Stream::new(1, 0, StreamKind::Light, index),
            survival: Survival::of_light(Roulette::Below(1.0), None),
            hero: (),
            stops: 0,
        };
        let scattered = interaction.scatter(&Nothing, Vec3::ZERO, from, &(), &mut state);
        scattered.filter(|scattered| scattered.transmitted)
    })
}

/// Compares all incident directions under one pair of normals; returns how many were refracted.
fn compare(geometric_normal: Vec3, shading_normal: Vec3) -> u32 {
    let interface = Interface { above: 1.1, below: 1.6 };
    let interaction =
        Interaction::Surface(SurfaceInteraction { bsdf: Glass, geometric_normal, shading_normal, interface });
    let mut refracted = 0;
    for i in 0..200_u32 {
        // A spiral over the sphere.
        let z = 1.0 - (i as f32 + 0.5) / 100.0;
        let (sin, cos) = (i as f32 * 2.4).sin_cos();
        let from = Vec3::new(cos * (1.0 - z * z).sqrt(), sin * (1.0 - z * z).sqrt(), z);
        let above = from.dot(shading_normal) > 0.0;
        let ratio = if above { 1.1 / 1.6 } else { 1.6 / 1.1 };
        let both = [Walk::Light, Walk::Camera].map(|walk| transmitted(&interaction, walk, from));
        if let [Some(light), Some(camera)] = both {
            // The material has one weight for both: the rest is the adjoint of the shading normal (1.6).
            let cosines = |v: Vec3| v.dot(shading_normal) / v.dot(geometric_normal);
            let expected = cosines(from) / cosines(light.direction);
            let found = light.weight.r() / camera.weight.r();
            assert!((found / expected - 1.0).abs() < 1e-4, "{from}: {found}, expected {expected}");
        }
        for walk in [Walk::Light, Walk::Camera] {
            let Some(found) = transmitted(&interaction, walk, from) else { continue };
            assert!(found.delta);
            let (own, other) = if above { (0, 1) } else { (1, 0) };
            let probability = |side: usize| f64::from(Glass::REFRACT[side] * Glass::CONTINUE[side]);
            let expected = probability(other) / probability(own)
                * jacobian(-from.as_dvec3(), shading_normal.as_dvec3(), ratio);
            let ratio = found.rho_opposite / found.rho_own;
            // A small cosine is what is left of one minus the square of a sine in single precision.
            let cos =
                f64::from(found.direction.dot(shading_normal).abs().min(from.dot(shading_normal).abs()));
            let tolerance = 3e-7 / (cos * cos);
            assert!(
                (ratio / expected - 1.0).abs() < tolerance,
                "{from}: {ratio}, expected {expected}, cos {cos}"
            );
            // The reversed walk sees the inverse.
            let back =
                transmitted(&interaction, walk, found.direction).expect("what was refracted can return");
            let product = ratio * (back.rho_opposite / back.rho_own);
            assert!((product - 1.0).abs() < 2.0 * tolerance, "{from}: {product}");
            refracted += 1;
        }
    }
    refracted
}

#[test]
fn opposite_density_is_widened_like_a_beam_at_a_flat_interface() {
    assert!(compare(Vec3::Z, Vec3::Z) > 250);
}

#[test]
fn a_shading_normal_bends_and_widens_alike() {
    // Light is bent about the shading normal: the solid angles follow its cosines, whatever the surface is.
    for tilt in [Vec3::new(0.2, 0.1, 1.0), Vec3::new(-0.5, 0.3, 1.0)] {
        assert!(compare(Vec3::Z, tilt.normalize()) > 150);
    }
}
