//! Lights: how they are sampled, and with which densities.

use glam::Vec3;
use upbp_media::{BodyId, Spectrum};

/// A sphere around everything that is finite in the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingSphere {
    /// Centre, scene units.
    pub centre: Vec3,
    /// Radius, scene units, positive and finite.
    pub radius: f32,
}

impl BoundingSphere {
    /// The largest coordinate of all points inside, without its sign, scene units.
    #[must_use]
    pub fn largest_coordinate(&self) -> f32 {
        self.centre.abs().max_element() + self.radius
    }

    /// Whether single precision holds the density of light from infinity that starts on a disc as wide.
    #[must_use]
    pub fn has_density_on_disc(&self) -> bool {
        let area = std::f32::consts::PI * self.radius * self.radius;
        area.is_normal() && area.recip().is_normal()
    }
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
    /// The inside of a body whose medium emits: points by volume, is hit by every ray that passes through.
    ///
    /// A point shines only if the body counts there: points outside of it, or inside a body of higher
    /// priority, may be chosen, and are then lost. A medium that emits in a body without such an emitter, or
    /// around everything, is found by rays alone.
    Volume(BodyId),
}

impl EmitterKind {
    /// Whether emitters of this kind are infinitely far away: the first edge of a path has no distance.
    #[must_use]
    pub const fn is_infinite(self) -> bool {
        matches!(self, Self::Directional | Self::Environment)
    }

    /// Whether a camera sub-path can end on an emitter of this kind by chance.
    #[must_use]
    pub const fn is_hittable(self) -> bool {
        matches!(self, Self::Area | Self::Environment | Self::Volume(_))
    }
}

/// A point of an emitter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmitterPoint {
    /// Position, scene units. Of an infinite emitter, in an [`Emission`]: on the disc that rays start from,
    /// as wide as the sphere that is given and at least its radius before its centre; elsewhere whatever is
    /// at hand, since only the direction counts.
    pub position: Vec3,
    /// The normal of the emitting side for [`EmitterKind::Area`]; where a walk meets the light, the
    /// [geometric normal](super::Hit::geometric_normal) of the hit, whichever side shines; of no meaning for
    /// the other kinds.
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
    /// Radiance (area, environment), radiant intensity (point), irradiance on a perpendicular plane
    /// (directional) or radiance per length (volume) in `direction`.
    pub radiance: Spectrum,
    /// `L_0`: per area for a surface, 1 for a Dirac, per solid angle for an environment, per volume for a
    /// volume.
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
    /// Radiance towards the receiver, as [`Emission::radiance`].
    pub radiance: Spectrum,
    /// `p_nee`: density of this choice, in the measure of [`Emission::pdf_position`] (area, 1, solid angle,
    /// or volume).
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

/// The place of an emitter and the directions of its light, for the choice among many emitters by receiver.
///
/// The light leaves within an angle around normals, which lie within an angle around an axis. Bounds that
/// are too wide cost samples; a receiver outside of bounds that are too narrow gets few, of large weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmitterBounds {
    /// Least coordinates of the emitter's points, scene units.
    pub min: Vec3,
    /// Greatest coordinates of the emitter's points, scene units.
    pub max: Vec3,
    /// The middle of the normals, a unit vector.
    pub axis: Vec3,
    /// Cosine of the largest angle between the axis and a normal; -1 for light in all directions.
    pub cos_normals: f32,
    /// Cosine of the largest angle between a normal and the light there, in `[-1, 1)`: 0 for a hemisphere.
    /// The intensity is taken to fall linearly in the cosine, down to zero at that angle.
    pub cos_emission: f32,
}

impl EmitterBounds {
    /// The bounds of points that shine in all directions.
    #[must_use]
    pub const fn all_around(min: Vec3, max: Vec3) -> Self {
        Self { min, max, axis: Vec3::Z, cos_normals: -1.0, cos_emission: 0.0 }
    }

    /// Whether these bounds are finite, hold something and have directions.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let size = self.max - self.min;
        self.min.is_finite()
            && size.is_finite()
            && size.min_element() >= 0.0
            && self.axis.is_normalized()
            && (-1.0..=1.0).contains(&self.cos_normals)
            && (-1.0..1.0).contains(&self.cos_emission)
    }

    /// Bounds of both, not always the smallest.
    pub(crate) fn around(&self, other: &Self) -> Self {
        let axis = (self.axis + other.axis).try_normalize();
        // The largest angle of a normal is at most the sum of that of its own axis and that around it.
        let cos_to = |axis: Vec3, of: &Self| {
            let (cos, around) = (axis.dot(of.axis).clamp(-1.0, 1.0), of.cos_normals);
            let sines = ((1.0 - cos * cos) * (1.0 - around * around)).sqrt();
            // A sum beyond π, where the cosine would rise again.
            if cos <= -around { -1.0 } else { (cos * around - sines).max(-1.0) }
        };
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            axis: axis.unwrap_or(Vec3::Z),
            cos_normals: axis.map_or(-1.0, |axis| cos_to(axis, self).min(cos_to(axis, other))),
            cos_emission: self.cos_emission.min(other.cos_emission),
        }
    }
}

/// A light.
///
/// Emitters are chosen by [`power`](Self::power), by [`bounds`](Self::bounds) and by what small runs find
/// that they bring; the walks multiply that probability in. The radiance of an emitter that is given here and
/// the one that [`hit`](Self::hit) returns must be the same function.
///
/// `sphere` holds the scene: light from infinity starts on a disc in front of it. It is
/// [the bounds of the scene](super::Scene::bounds), or a larger sphere around a point that matters to the
/// picture. It may change within a render, so an emitter must not keep anything that it worked out from it.
///
/// `Box<dyn Emitter>` and `Arc<dyn Emitter>` are emitters, too, for scenes with lights of several types.
pub trait Emitter: Send + Sync {
    /// The kind of the light.
    fn kind(&self) -> EmitterKind;

    /// Power in W (any common factor may be left out): how often the emitter is chosen. For infinite
    /// emitters the power that falls on the disc `π radius²` of the bounds of the scene. Finite, not
    /// negative. Zero is never chosen: then its light is only found where camera sub-paths hit the emitter,
    /// or pass through its volume.
    fn power(&self, scene: &BoundingSphere) -> f32;

    /// Place of the emitter, and which way it shines. The default is an emitter of which that is unknown, or
    /// that is infinitely far away: all receivers then choose it equally often, unless it turns out where it
    /// is needed.
    fn bounds(&self, scene: &BoundingSphere) -> Option<EmitterBounds> {
        let _ = scene;
        None
    }

    /// Starts a light sub-path. The four random numbers are uniform in `[0, 1)`. `None` is a draw that brings
    /// no light: densities are those of all draws.
    fn sample_emission(
        &self,
        sphere: &BoundingSphere,
        u_position: [f32; 2],
        u_direction: [f32; 2],
    ) -> Option<Emission>;

    /// Chooses a point of the emitter for next event estimation at `receiver`; `u` is uniform in `[0, 1)²`.
    /// `None` is a draw that brings no light: densities are those of all draws.
    fn sample_incident(&self, sphere: &BoundingSphere, receiver: Vec3, u: [f32; 2]) -> Option<Incident>;

    /// Radiance and densities for a path from `point` (on a surface that carries this emitter, or in its
    /// volume; for an environment only `direction` counts) in `direction`, the direction of the light, to
    /// `receiver`. `None` for lights that cannot be hit, and on a side that does not shine.
    fn hit(
        &self,
        sphere: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        receiver: Vec3,
    ) -> Option<HitDensities>;

    /// Density, per length, with which weights take a camera sub-path that passes through an emitting volume
    /// to end at `point`, where [`hit`](Self::hit) answers (`docs/theory.md`, section 2.9).
    ///
    /// Good is one over the length of a ray inside from which light gets out. Of no meaning for other kinds
    /// than [`EmitterKind::Volume`].
    fn pdf_passage(&self, point: &EmitterPoint) -> f32 {
        let _ = point;
        1.0
    }

    /// The random numbers with which [`sample_emission`](Self::sample_emission) starts the light that leaves
    /// `point` in `direction` and passes `on_ray`; an infinite emitter is asked for that ray alone, and
    /// `point` has no meaning.
    ///
    /// With them light sub-paths are [guided](crate::EmissionGuide) to where the picture needs them. The
    /// default is an emitter that cannot be guided. Whether a pair is given must not depend on the ray,
    /// except that there are none for a ray that the emitter cannot start.
    fn emission_coordinates(
        &self,
        sphere: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        on_ray: Vec3,
    ) -> Option<EmissionCoordinates> {
        let _ = (sphere, point, direction, on_ray);
        None
    }

    /// The density [`Incident::pdf`] with which [`sample_incident`](Self::sample_incident) at `receiver`
    /// chooses `point`, in direction `direction` of the light. The default serves emitters whose choice does
    /// not depend on the receiver, so that it equals `pdf_position`.
    fn pdf_incident(
        &self,
        sphere: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        receiver: Vec3,
        pdf_position: f32,
    ) -> f32 {
        let _ = (sphere, point, direction, receiver);
        pdf_position
    }
}
