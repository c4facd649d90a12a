//! Hits and crossings of rays with surfaces.

use glam::Vec3;
use upbp_media::Interior;

/// Index into [`Scene::emitters`](super::Scene::emitters).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct EmitterId(pub u32);

/// A ray meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit<B> {
    /// Distance along the ray, scene units.
    pub t: f32,
    /// The point, as close to the surface as the host can tell.
    pub position: Vec3,
    /// Unit normal of the surface proper; points out of a closed body.
    pub geometric_normal: Vec3,
    /// Unit normal for shading, in the hemisphere of the geometric one.
    pub shading_normal: Vec3,
    /// Scattering of the surface. `None`: an index-matched boundary, which light passes straight.
    pub bsdf: Option<B>,
    /// The body that the surface encloses, if its inside matters: every null boundary, every refracting body.
    /// Opaque surfaces have none.
    pub interior: Option<Interior>,
    /// The light that the surface carries.
    pub emitter: Option<EmitterId>,
}

impl<B> Hit<B> {
    /// The crossing of a ray along `direction` that passes straight, if the surface bounds a body.
    #[inline]
    #[must_use]
    pub fn crossing(&self, direction: Vec3) -> Option<Crossing> {
        Some(Crossing {
            t: self.t,
            interior: self.interior?,
            entering: direction.dot(self.geometric_normal) < 0.0,
            scatters: self.bsdf.is_some(),
        })
    }

    /// Whether a ray from `t_min` on can have met it: it lies ahead, and all its numbers are finite. A walk
    /// that meets another is lost.
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
