//! Traits that a host implements, to tell a renderer of its scene.
//!
//! Geometry, materials, lights and the camera stay the host's own. The walks of this crate ask five
//! questions: where does a ray go ([`Scene`]), how does a surface scatter ([`Bsdf`]), what does a light
//! emit ([`Emitter`]), which ray belongs to a place on the film ([`Camera`]), and what is between two points
//! ([`upbp_media::Medium`]). All of them are called from several threads, statically dispatched.
//!
//! Directions are unit vectors. Positions and distances are in scene units, radiance in W m⁻² sr⁻¹.

use std::collections::BTreeMap;

use glam::Vec3;
use upbp_accel::Ray;
use upbp_media::{BodyId, Medium, MediumId, MediumStack};

mod bsdf;
mod camera;
mod emitter;
mod hit;
mod pointers;

pub use bsdf::{Bsdf, BsdfEvaluation, BsdfSample, Interface, Walk};
pub use camera::{Camera, CameraConnection, CameraRay, LensConnection, PixelRect};
pub use emitter::{
    BoundingSphere, Emission, EmissionCoordinates, Emitter, EmitterBounds, EmitterKind, EmitterPoint,
    HitDensities, Incident,
};
pub use hit::{Boundary, Crossing, EmitterId, Hit, PathEnd};

/// A scene to render: the host's geometry and everything on it.
///
/// Required is the nearest hit; what is derived from it may be overridden where the host has something faster
/// or more exact. Whether two surfaces coincide, where a ray starts inside a body, and so on is the host's to
/// answer consistently: the walks of both sides rely on it.
pub trait Scene: Sync {
    /// Scattering of the host's surfaces.
    type Bsdf: Bsdf;
    /// The host's lights.
    type Emitter: Emitter;
    /// The host's media.
    type Medium: Medium;
    /// The host's camera.
    type Camera: Camera;

    /// The nearest surface with `t` in `(ray.t_min, ray.t_max)`, null boundaries included.
    ///
    /// Distance and position are to be right to a rounding or two of the distance: a connection ends four of
    /// them, over the cosine, before the surface that it leads to.
    fn intersect(&self, ray: &Ray) -> Option<Hit<Self::Bsdf>>;

    /// A sphere around all geometry, and all lights but infinite ones: light from infinity does not begin
    /// elsewhere, so that what lies outside, as an endless ground does, gets too little of it.
    fn bounds(&self) -> BoundingSphere;

    /// All lights.
    fn emitters(&self) -> &[Self::Emitter];

    /// All media; a [`MediumId`] is an index into them.
    fn media(&self) -> &[Self::Medium];

    /// The camera.
    fn camera(&self) -> &Self::Camera;

    /// The medium around everything, `None` for vacuum. Of the light of infinite emitters there is what gets
    /// through an infinite length of it: nothing, but in channels without extinction. It has to be the same
    /// from everywhere in all directions, so that fog that thins out needs a body with a top.
    fn outside(&self) -> Option<MediumId> {
        None
    }

    /// The largest coordinate of places in a medium, or the distance from which rays get into it without a
    /// surface that scatters, whichever is more, scene units: positions in it are rounded in proportion.
    ///
    /// By default the [largest coordinate](BoundingSphere::largest_coordinate) of the bounds. Of a medium
    /// that is only in bodies that refract, away from all others, a host may tell less; then walks in one
    /// that is dense in the scene, but not in its body, are shorter.
    fn medium_extent(&self, medium: MediumId) -> f32 {
        let _ = medium;
        self.bounds().largest_coordinate()
    }

    /// Whether every straight line from a place where `body` counts (`None`: where none does) to `end` is
    /// known to meet a surface that scatters.
    ///
    /// So it is from the milk in a glass to the sun, from the bottom of a pool to a lens above the water, and
    /// from a room to the filament of a bulb: next events and connections to the lens that would find nothing
    /// are not tried. `false`, the default, is always allowed.
    fn hides(&self, body: Option<BodyId>, end: PathEnd) -> bool {
        let _ = (body, end);
        false
    }

    /// Whether any surface has a smooth lobe; `false` saves the preparation of what would find nothing.
    fn has_connectible_surfaces(&self) -> bool {
        true
    }

    /// Whether any surface has a Dirac lobe, alone or beside smooth ones. If there is none, or if all lights
    /// can be hit, camera sub-paths alone find every path, and light sub-paths may be left out.
    fn has_specular_surfaces(&self) -> bool {
        true
    }

    /// The nearest surface that scatters, and in `crossings` (empty before, sorted by distance after) the
    /// null boundaries before it, or all along the ray if there is none.
    ///
    /// Where surfaces of bodies coincide, it is that of the highest priority, and the other boundaries there,
    /// those that scatter too, are crossings at its distance: a path meets them as one, between the body that
    /// counts before them and the one that counts behind (`docs/theory.md`, section 1.7). Rays that leave
    /// start behind what is as near as [`RAY_OFFSET`](crate::RAY_OFFSET), so that this must coincide.
    ///
    /// The default asks [`intersect`](Self::intersect) again behind each boundary, and so misses one of two
    /// boundaries that coincide to rounding; a host with such geometry overrides this. It gives up at
    /// [`MAX_CROSSINGS`], and at a hit that is not [sound](Hit::is_sound): walks are lost there.
    fn trace(&self, ray: &Ray, crossings: &mut Vec<Crossing>) -> Option<Hit<Self::Bsdf>> {
        let mut rest = *ray;
        for _ in 0..MAX_CROSSINGS {
            let hit = self.intersect(&rest)?;
            if !hit.boundary.is_null() || !hit.is_sound(rest.t_min) {
                return Some(hit);
            }
            crossings.extend(hit.crossing(ray.direction));
            rest.t_min = behind(hit.t);
        }
        None
    }

    /// Whether the segment `(ray.t_min, ray.t_max)` is free of surfaces that end every connection: those that
    /// scatter and enclose no body. Boundaries of bodies on the way, null or not, go to `crossings`, sorted
    /// by distance, which is the same for those that coincide with one that scatters; they are of no
    /// interest if the answer is `false`.
    fn is_clear(&self, ray: &Ray, crossings: &mut Vec<Crossing>) -> bool {
        let mut rest = *ray;
        for _ in 0..MAX_CROSSINGS {
            let Some(hit) = self.intersect(&rest) else { return true };
            if matches!(hit.boundary, Boundary::Opaque(_)) || !hit.is_sound(rest.t_min) {
                return false;
            }
            crossings.extend(hit.crossing(ray.direction));
            rest.t_min = behind(hit.t);
        }
        false
    }

    /// The bodies that `point` lies in.
    ///
    /// The default follows a ray to infinity: a body is around the point if the ray leaves it more often than
    /// it enters. Beyond [`MAX_CROSSINGS`] it has found none.
    fn stack_at(&self, point: Vec3) -> MediumStack {
        // Any direction serves; one without symmetry meets few edges.
        let direction = Vec3::new(0.284_69, 0.867_42, 0.408_03).normalize();
        let mut ray = Ray { origin: point, direction, t_min: 0.0, t_max: f32::INFINITY };
        let mut stack = MediumStack::new(self.outside());
        let mut balance: Vec<(upbp_media::Interior, i32)> = Vec::new();
        let mut places = BTreeMap::new();
        let mut met = 0;
        while let Some(hit) = self.intersect(&ray).filter(|hit| hit.is_sound(ray.t_min)) {
            met += 1;
            if met > MAX_CROSSINGS {
                return stack;
            }
            if let Some(interior) = hit.boundary.interior() {
                let step = if direction.dot(hit.geometric_normal) > 0.0 { 1 } else { -1 };
                let place = *places.entry(interior.body).or_insert(balance.len());
                match balance.get_mut(place) {
                    Some((_, count)) => *count += step,
                    None => balance.push((interior, step)),
                }
            }
            ray.t_min = behind(hit.t);
        }
        // Met last is farthest out: entered first.
        for (interior, count) in balance.into_iter().rev() {
            if count > 0 {
                let _ = stack.enter(interior);
            }
        }
        stack
    }
}

/// Most boundaries on one ray: a ray that meets more is lost, so that a host's answers cannot keep a walk for
/// ever.
pub const MAX_CROSSINGS: usize = 4096;

/// The next distance that is certainly not the same intersection again.
fn behind(t: f32) -> f32 {
    t + t.abs().max(f32::MIN_POSITIVE) * 4.0 * f32::EPSILON
}
