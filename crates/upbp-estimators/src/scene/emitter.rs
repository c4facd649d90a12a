//! Lights: how they are sampled, and with which densities.

use glam::Vec3;
use upbp_media::Spectrum;

/// A sphere around everything that is finite in the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingSphere {
    /// Centre, scene units.
    pub centre: Vec3,
    /// Radius, scene units, positive and finite.
    pub radius: f32,
}

/// The kind of an emitter: in which measure its points are chosen, and whether a path can hit it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum EmitterKind {
    /// A surface of the scene that shines: points by area, can be hit.
    Area,
    /// A single point (point light, spot): a Dirac in position, cannot be hit.
    Point,
    /// Light from one direction, infinitely far: a Dirac in direction, cannot be hit.
    Directional,
    /// Light from all directions, infinitely far: "points" are directions by solid angle, is hit by every ray
    /// that escapes.
    Environment,
}

impl EmitterKind {
    /// Infinitely far away: the first edge of a path has no distance.
    #[must_use]
    pub const fn is_infinite(self) -> bool {
        matches!(self, Self::Directional | Self::Environment)
    }

    /// Whether a camera sub-path can end on it by chance.
    #[must_use]
    pub const fn is_hittable(self) -> bool {
        matches!(self, Self::Area | Self::Environment)
    }
}

/// A point of an emitter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmitterPoint {
    /// Position, scene units. For an infinite emitter: a point outside of the scene's bounds in that
    /// direction, or whatever is at hand: only the direction counts.
    pub position: Vec3,
    /// The normal of the emitting side for [`EmitterKind::Area`]; of no meaning for the other kinds.
    pub normal: Vec3,
}

/// A light sub-path's start (`docs/theory.md`, section 2.8). Densities do not include the choice of the
/// emitter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// Start of the ray.
    pub point: EmitterPoint,
    /// Direction of the light, a unit vector.
    pub direction: Vec3,
    /// Radiance (area, environment), radiant intensity (point) or irradiance on a perpendicular plane
    /// (directional) in `direction`.
    pub radiance: Spectrum,
    /// `L_0`: per area for a surface, 1 for a Dirac, per solid angle for an environment.
    pub pdf_position: f32,
    /// `ρL_0`: per solid angle for a finite emitter; per area of the disc that rays start from, `1/(πR²)`,
    /// for an infinite one.
    pub pdf_direction: f32,
}

/// A point of an emitter chosen for a receiver. Densities do not include the choice of the emitter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incident {
    /// The point on the emitter.
    pub point: EmitterPoint,
    /// From the receiver towards the emitter, a unit vector.
    pub towards_light: Vec3,
    /// Distance in scene units; infinite for an infinite emitter.
    pub distance: f32,
    /// As [`Emission::radiance`], towards the receiver.
    pub radiance: Spectrum,
    /// `p_nee`: density of this choice, in the measure of [`Emission::pdf_position`] (area, 1, or solid
    /// angle).
    pub pdf: f32,
    /// [`Emission::pdf_position`] of this point.
    pub pdf_position: f32,
    /// [`Emission::pdf_direction`] towards the receiver.
    pub pdf_direction: f32,
}

/// Radiance and densities of an emitter that a path has hit. Densities do not include the choice of the
/// emitter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HitDensities {
    /// Radiance towards the receiver.
    pub radiance: Spectrum,
    /// [`Incident::pdf`] of this point and receiver.
    pub pdf_incident: f32,
    /// [`Emission::pdf_position`] of this point.
    pub pdf_position: f32,
    /// [`Emission::pdf_direction`] towards the receiver.
    pub pdf_direction: f32,
}

/// The random numbers with which [`Emitter::sample_emission`] starts some light sub-path.
///
/// A pair is `None` if no start depends on it, or if it cannot be told: light sub-paths then follow the
/// emitter's own distribution there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EmissionCoordinates {
    /// The first pair.
    pub position: Option<[f32; 2]>,
    /// The second pair.
    pub direction: Option<[f32; 2]>,
}

/// A light.
///
/// Emitters are chosen in proportion to [`power`](Self::power); the walks multiply that probability in. The
/// radiance of an emitter that is given here and the one that [`hit`](Self::hit) returns must be the same
/// function.
pub trait Emitter: Send + Sync {
    /// The kind of the light.
    fn kind(&self) -> EmitterKind;

    /// Power in W (any common factor may be left out): how often the emitter is chosen. For infinite
    /// emitters the power that falls on the disc `π radius²`. Finite, not negative; zero is never chosen.
    fn power(&self, bounds: &BoundingSphere) -> f32;

    /// Starts a light sub-path. The four random numbers are uniform in `[0, 1)`.
    fn sample_emission(
        &self,
        bounds: &BoundingSphere,
        u_position: [f32; 2],
        u_direction: [f32; 2],
    ) -> Option<Emission>;

    /// Chooses a point of the emitter for next event estimation at `receiver`.
    fn sample_incident(&self, bounds: &BoundingSphere, receiver: Vec3, u: [f32; 2]) -> Option<Incident>;

    /// Radiance and densities for a path from `point` (on a surface that carries this emitter; for an
    /// environment only `direction` counts) in `direction`, the direction of the light, to `receiver`. `None`
    /// for lights that cannot be hit, and on a side that does not shine.
    fn hit(
        &self,
        bounds: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        receiver: Vec3,
    ) -> Option<HitDensities>;

    /// The random numbers with which [`sample_emission`](Self::sample_emission) starts the light that leaves
    /// `point` in `direction` and passes `on_ray`; an infinite emitter is asked for that ray alone, and
    /// `point` has no meaning.
    ///
    /// With them light sub-paths are [guided](crate::EmissionGuide) to where the picture needs them. The
    /// default is an emitter that cannot be guided. Whether a pair is given must not depend on the ray,
    /// except that there are none for a ray that the emitter cannot start.
    fn emission_coordinates(
        &self,
        bounds: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        on_ray: Vec3,
    ) -> Option<EmissionCoordinates> {
        let _ = (bounds, point, direction, on_ray);
        None
    }

    /// The density [`Incident::pdf`] with which [`sample_incident`](Self::sample_incident) at `receiver`
    /// chooses `point`, in direction `direction` of the light. The default serves emitters whose choice does
    /// not depend on the receiver, so that it equals `pdf_position`.
    fn pdf_incident(
        &self,
        bounds: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        receiver: Vec3,
        pdf_position: f32,
    ) -> f32 {
        let _ = (bounds, point, direction, receiver);
        pdf_position
    }
}
