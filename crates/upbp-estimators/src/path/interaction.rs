//! Vertices where a path can be connected and merged, and how they scatter.

use glam::Vec3;
use upbp_media::{Lanes, Medium, MediumId, MediumStack, Spectrum, orthonormal_basis};

use super::walk_state::WalkState;
use crate::random::Decision;
use crate::roulette::Roulette;
use crate::scene::{Bsdf, Hit, Interface, Scene, Walk};

/// Directions closer to a tangent plane than this end a walk and forbid a connection, on both sides alike.
pub(crate) const MIN_COSINE: f32 = 1e-6;

/// A vertex of a path with its scattering: on a surface or in a medium.
#[derive(Clone, Copy, Debug)]
pub enum Interaction<B> {
    /// On a surface.
    Surface(SurfaceInteraction<B>),
    /// In a medium.
    Medium(MediumId),
}

/// A point of a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceInteraction<B> {
    /// Scattering of the surface.
    pub bsdf: B,
    /// Geometric normal, out of a closed body.
    pub geometric_normal: Vec3,
    /// Shading normal.
    pub shading_normal: Vec3,
    /// Refractive indices on its two sides.
    pub interface: Interface,
}

/// The bodies on the two sides of a vertex.
#[derive(Clone, Copy, Debug)]
pub struct MediumInterface<'a> {
    /// Bodies on the side that the walk comes from.
    pub near: &'a MediumStack,
    /// Bodies on the other side; in a medium the same.
    pub far: &'a MediumStack,
}

impl<'a> MediumInterface<'a> {
    /// The bodies on the side that a path goes to, which `crosses` the surface or stays on the side it came
    /// from.
    #[inline]
    #[must_use]
    pub const fn towards(&self, crosses: bool) -> &'a MediumStack {
        if crosses { self.far } else { self.near }
    }
}

/// A pair of directions at a vertex, evaluated.
#[derive(Clone, Copy, Debug)]
pub struct Evaluation<L> {
    /// The scattering function `s`: BSDF times the shading-normal correction, or `σ_s ρ`.
    pub value: Spectrum,
    /// Density of each lane of the own walk choosing this direction, times the albedo if there is roulette,
    /// sr⁻¹.
    pub rho_own: L,
    /// Density of the opposite walk, which comes from there and leaves to where this walk came from.
    pub rho_opposite: L,
    /// Cosine factor of the direction: with the geometric normal, 1 in a medium.
    pub cos: f64,
    /// Sine of the angle between the two lines in a medium.
    pub sin_theta: f64,
}

/// A sampled direction at a vertex.
#[derive(Clone, Copy, Debug)]
pub struct Scattered<L> {
    /// The new direction, a unit vector.
    pub direction: Vec3,
    /// Factor of the throughput, roulette included.
    pub weight: Spectrum,
    /// The vertex's own probability to continue the walk, 1 without roulette.
    pub albedo: f32,
    /// Density as [`Evaluation::rho_own`]; for a Dirac lobe its probability.
    pub rho_own: L,
    /// Density as [`Evaluation::rho_opposite`]; for a Dirac lobe as in (4.6).
    pub rho_opposite: L,
    /// Cosine as [`Evaluation::cos`].
    pub cos: f64,
    /// Sine as [`Evaluation::sin_theta`].
    pub sin_theta: f64,
    /// Whether the lobe is a Dirac.
    pub delta: bool,
    /// Whether the walk passed through the surface.
    pub transmitted: bool,
}

/// `sin` of the angle between two lines, without the cancellation of `√(1 − cos²)`.
fn sine(a: Vec3, b: Vec3) -> f64 {
    f64::from(a.cross(b).length()).min(1.0)
}

impl<B> Interaction<B> {
    /// Whether the vertex is in a medium.
    #[inline]
    pub const fn in_medium(&self) -> bool {
        matches!(self, Self::Medium(_))
    }
}

impl<B: Bsdf> Interaction<B> {
    /// The surface of a hit, between the bodies of `sides`. `None` if the surface is grazed.
    #[inline]
    pub(crate) fn at_hit(
        hit: &Hit<B>,
        bsdf: B,
        direction: Vec3,
        sides: &MediumInterface<'_>,
    ) -> Option<Self> {
        let cos = direction.dot(hit.geometric_normal);
        if cos.abs() < MIN_COSINE {
            return None;
        }
        let (near, far) = (sides.near.ior(), sides.far.ior());
        let (above, below) = if cos < 0.0 { (near, far) } else { (far, near) };
        Some(Self::Surface(SurfaceInteraction {
            bsdf,
            geometric_normal: hit.geometric_normal,
            shading_normal: hit.shading_normal,
            interface: Interface { above, below },
        }))
    }

    /// Whether paths can be connected and merged here.
    #[inline]
    pub fn is_connectible(&self) -> bool {
        match self {
            Self::Surface(surface) => surface.bsdf.is_connectible(),
            Self::Medium(_) => true,
        }
    }

    /// Cosine factor of an arriving or leaving direction.
    #[inline]
    pub fn cosine(&self, direction: Vec3) -> f64 {
        match self {
            Self::Surface(surface) => f64::from(direction.dot(surface.geometric_normal).abs()),
            Self::Medium(_) => 1.0,
        }
    }

    /// Whether a path that comes from `from` and goes to `to` passes through the surface.
    #[inline]
    pub fn crosses(&self, from: Vec3, to: Vec3) -> bool {
        match self {
            Self::Surface(surface) => {
                from.dot(surface.geometric_normal) * to.dot(surface.geometric_normal) < 0.0
            }
            Self::Medium(_) => false,
        }
    }

    /// Evaluates the smooth scattering of `walk`, which came from `from` and goes to `to`; both directions
    /// point away from the vertex. `None` if nothing is scattered.
    pub fn evaluate<S: Scene<Bsdf = B>, L: Lanes>(
        &self,
        scene: &S,
        roulette: Roulette,
        walk: Walk,
        position: Vec3,
        from: Vec3,
        to: Vec3,
    ) -> Option<Evaluation<L>> {
        match self {
            Self::Surface(surface) => surface.evaluate(roulette, walk, from, to),
            Self::Medium(medium) => {
                let medium = &scene.media()[medium.0 as usize];
                let phase = medium.phase().eval(-from, to);
                let value = medium.sigma_s(position) * phase.value;
                if value.is_black() {
                    return None;
                }
                let albedo = continuation(medium, position, roulette);
                let rho = L::of_phase(&phase).times(L::splat(f64::from(albedo)));
                Some(Evaluation {
                    value,
                    rho_own: rho,
                    rho_opposite: rho,
                    cos: 1.0,
                    sin_theta: sine(from, to),
                })
            }
        }
    }

    /// Samples a direction for a walk, which came from `from` and whose lanes have `shares`. `None`: the walk
    /// ends.
    pub fn scatter<S: Scene<Bsdf = B>, L: Lanes>(
        &self,
        scene: &S,
        position: Vec3,
        from: Vec3,
        shares: &L::Shares,
        state: &mut WalkState<L>,
    ) -> Option<Scattered<L>> {
        match self {
            Self::Surface(surface) => surface.scatter(from, state),
            Self::Medium(medium) => {
                let WalkState { stream, survival, hero, stops, .. } = state;
                *stops += 1;
                let [goes_on, turn] = [stream.decide(), stream.decide()];
                let medium = &scene.media()[medium.0 as usize];
                let albedo = continuation(medium, position, survival.roulette());
                let probability = survival.probability(albedo, true) * survival.probability_at(position);
                if ends(goes_on, probability) {
                    return None;
                }
                let sample = medium.phase().sample::<L>(-from, *hero, shares, turn.pair());
                if !sample.pdf.is_positive() {
                    return None;
                }
                let rho = sample.pdf.times(L::splat(f64::from(albedo)));
                Some(Scattered {
                    direction: sample.after,
                    weight: medium.sigma_s(position) * sample.weight / probability,
                    albedo,
                    rho_own: rho,
                    rho_opposite: rho,
                    cos: 1.0,
                    sin_theta: sine(from, sample.after),
                    delta: false,
                    transmitted: false,
                })
            }
        }
    }
}

/// Whether a walk that survives with this probability ends.
#[inline]
fn ends(goes_on: Decision, probability: f32) -> bool {
    probability < 1.0 && goes_on.uniform() >= probability
}

/// A host's probability to go on, as the walks take it.
fn limited(continuation: f32, roulette: Roulette) -> f32 {
    if roulette.is_on() { continuation.clamp(0.0, 1.0) } else { 1.0 }
}

fn continuation<M: Medium>(medium: &M, position: Vec3, roulette: Roulette) -> f32 {
    limited(medium.continuation(position), roulette)
}

impl<B: Bsdf> SurfaceInteraction<B> {
    /// A direction in the basis in which the BSDF is asked: two tangents and the shading normal.
    pub(crate) fn local(&self, direction: Vec3) -> Vec3 {
        let (s, t) = orthonormal_basis(self.shading_normal);
        Vec3::new(direction.dot(s), direction.dot(t), direction.dot(self.shading_normal))
    }

    fn world(&self, local: Vec3) -> Vec3 {
        let (s, t) = orthonormal_basis(self.shading_normal);
        local.x * s + local.y * t + local.z * self.shading_normal
    }

    fn continuation(&self, from: Vec3, roulette: Roulette) -> f32 {
        limited(self.bsdf.continuation(from), roulette)
    }

    /// Cosine with the geometric normal if both normals agree on the side of `direction`, local `z` given.
    fn agreeing_cosine(&self, direction: Vec3, shading_cosine: f32) -> Option<f32> {
        let cos = direction.dot(self.geometric_normal);
        (cos * shading_cosine > 0.0 && cos.abs() >= MIN_COSINE).then_some(cos)
    }

    fn evaluate<L: Lanes>(
        &self,
        roulette: Roulette,
        walk: Walk,
        from: Vec3,
        to: Vec3,
    ) -> Option<Evaluation<L>> {
        let (local_from, local_to) = (self.local(from), self.local(to));
        let cos_from = self.agreeing_cosine(from, local_from.z)?;
        let cos_to = self.agreeing_cosine(to, local_to.z)?;
        let bsdf = self.bsdf.evaluate(local_from, local_to, walk, self.interface)?;
        // The geometry term has the geometric normal; the light's side is shaded with the other (section
        // 1.6).
        let correction = match walk {
            Walk::Camera => local_to.z / cos_to,
            Walk::Light => local_from.z / cos_from,
        };
        let continuation = |of_bsdf: f32| f64::from(limited(of_bsdf, roulette));
        Some(Evaluation {
            value: bsdf.value * correction.abs(),
            rho_own: L::splat(f64::from(bsdf.pdf) * continuation(bsdf.continuation)),
            rho_opposite: L::splat(f64::from(bsdf.pdf_reverse) * continuation(bsdf.continuation_reverse)),
            cos: f64::from(cos_to.abs()),
            sin_theta: 0.0,
        })
    }

    fn scatter<L: Lanes>(&self, from: Vec3, state: &mut WalkState<L>) -> Option<Scattered<L>> {
        let WalkState { walk, ref mut stream, ref mut survival, .. } = *state;
        let [goes_on, lobe, turn] = [stream.decide(), stream.decide(), stream.decide()];
        let local_from = self.local(from);
        let cos_from = self.agreeing_cosine(from, local_from.z)?;
        let roulette = survival.roulette();
        let albedo = self.continuation(local_from, roulette);
        let probability = survival.probability(albedo, self.bsdf.is_connectible());
        if ends(goes_on, probability) {
            return None;
        }
        let sample = self.bsdf.sample(local_from, walk, self.interface, lobe.uniform(), turn.pair())?;
        let direction = self.world(sample.to).normalize();
        let cos_to = self.agreeing_cosine(direction, sample.to.z)?;
        let mut weight = sample.weight / probability;
        if walk == Walk::Light {
            // Adjoint of the shading normal (section 1.6).
            weight *= ((local_from.z * cos_to) / (cos_from * sample.to.z)).abs();
        }
        let own = f64::from(sample.pdf) * f64::from(albedo);
        let mut opposite = f64::from(sample.pdf_reverse) * f64::from(self.continuation(sample.to, roulette));
        let transmitted = cos_from * cos_to < 0.0;
        if sample.delta && transmitted {
            // Radiance is compressed and the beam widened: (4.6), about the normal that bends. Reflection has
            // equal factors.
            let (eta_from, eta_to) = if cos_from > 0.0 {
                (self.interface.above, self.interface.below)
            } else {
                (self.interface.below, self.interface.above)
            };
            let squared = f64::from(eta_from / eta_to).powi(2);
            opposite *= squared * f64::from((local_from.z / sample.to.z).abs());
        }
        Some(Scattered {
            direction,
            weight,
            albedo,
            rho_own: L::splat(own),
            rho_opposite: L::splat(opposite),
            cos: f64::from(cos_to.abs()),
            sin_theta: 0.0,
            delta: sample.delta,
            transmitted,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_host_may_tell_of_any_probability_to_go_on() {
        for (told, taken) in [(0.3, 0.3), (1.0, 1.0), (1.7, 1.0), (-0.2, 0.0)] {
            assert_eq!(limited(told, Roulette::Below(0.5)), taken);
            assert_eq!(limited(told, Roulette::Off), 1.0);
        }
    }
}
