//! Hits and crossings of rays with surfaces.

use glam::Vec3;
use upbp_media::Interior;

/// Index into [`Scene::emitters`](super::Scene::emitters).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct EmitterId(pub u32);

/// A surface as light sees it: whether it scatters, and whether it encloses a body whose inside matters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Boundary<B> {
    /// A surface that light does not pass.
    Opaque(B),
    /// A surface that scatters and encloses a body, such as glass: what is refracted goes in or out.
    Refracting(B, Interior),
    /// An index-matched boundary of a body, which light passes straight.
    Null(Interior),
}

impl<B> Boundary<B> {
    /// Scattering of the surface, unless it is a null boundary.
    #[inline]
    #[must_use]
    pub const fn bsdf(&self) -> Option<&B> {
        match self {
            Self::Opaque(bsdf) | Self::Refracting(bsdf, _) => Some(bsdf),
            Self::Null(_) => None,
        }
    }

    /// The body that the surface encloses, unless it is opaque.
    #[inline]
    #[must_use]
    pub const fn interior(&self) -> Option<Interior> {
        match self {
            Self::Opaque(_) => None,
            Self::Refracting(_, interior) | Self::Null(interior) => Some(*interior),
        }
    }

    /// Whether light passes straight.
    #[inline]
    #[must_use]
    pub const fn is_null(&self) -> bool {
        matches!(self, Self::Null(_))
    }
}

/// A ray meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit<B> {
    /// Distance along the ray, scene units.
    pub t: f32,
    /// The point, within a few roundings of its own coordinates of the surface, however far away the ray
    /// began: rays that leave start [`RAY_OFFSET`](crate::RAY_OFFSET) of these off it. The end of a ray has
    /// the roundings of its length, so that a host puts it onto its plane or sphere.
    pub position: Vec3,
    /// Unit normal of the surface proper; points out of a closed body.
    pub geometric_normal: Vec3,
    /// Unit normal for shading, in the hemisphere of the geometric one.
    pub shading_normal: Vec3,
    /// Scattering of the surface, and the body that it encloses.
    pub boundary: Boundary<B>,
    /// The light that the surface carries. Walks must stop there: a null boundary carries none, and neither
    /// does a refracting surface of which any part lies in a body that counts above its own.
    pub emitter: Option<EmitterId>,
}

impl<B> Hit<B> {
    /// The crossing of a ray along `direction` that passes straight, if the surface bounds a body.
    #[inline]
    #[must_use]
    pub fn crossing(&self, direction: Vec3) -> Option<Crossing> {
        Some(Crossing {
            t: self.t,
            interior: self.boundary.interior()?,
            entering: direction.dot(self.geometric_normal) < 0.0,
            scatters: !self.boundary.is_null(),
        })
    }

    /// Whether a ray from `t_min` on can have met this surface: the hit lies ahead, and all its numbers are
    /// finite. A walk that meets another is lost.
    #[inline]
    #[must_use]
    pub fn is_sound(&self, t_min: f32) -> bool {
        self.t > t_min
            && self.t.is_finite()
            && self.position.is_finite()
            && self.geometric_normal.is_finite()
            && self.shading_normal.is_finite()
    }
}

/// A ray goes into or out of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Distance along the ray, scene units.
    pub t: f32,
    /// The body.
    pub interior: Interior,
    /// Whether the ray goes in: its direction opposes the outward normal.
    pub entering: bool,
    /// Whether the surface scatters (a refracting body): it then blocks a connection, unless it lies in a
    /// body of higher priority.
    pub scatters: bool,
}

/// Where paths end, seen from a place in the scene ([`Scene::hides`](super::Scene::hides)).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathEnd {
    /// Every light.
    Lights,
    /// A light, all of it.
    Light(EmitterId),
    /// The lens, all of it.
    Lens,
}
