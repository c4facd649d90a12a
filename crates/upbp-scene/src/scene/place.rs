//! Boundaries of bodies that coincide: liquid and the glass that holds it share faces.
//!
//! A path meets all that coincides as one: [`Scene::trace`](upbp_estimators::scene::Scene::trace) tells it of
//! one surface, with the other boundaries as crossings at the same distance.

use glam::Vec3;
use upbp_accel::{Candidate, RAY_OFFSET, Ray, Shape, Visit};
use upbp_estimators::scene::{Crossing, Hit};
use upbp_media::BodyId;

use super::{Opaque, ReadyScene, sort};
use crate::material::Material;

/// Distance between surfaces that coincide, relative to the largest coordinate of the place. Rays start
/// nearer than this to a surface, so that none that does not coincide with it is skipped. What one that
/// leaves meets again was crossed already, which changes nothing.
pub(crate) const COINCIDENT: f32 = 1.25 * RAY_OFFSET;
/// Distance between planes of triangles that are meant to coincide, relative to what is rounded for their
/// corners across the planes. It counts where the plane passes near the origin, far from the corners.
pub(crate) const ROUNDING: f32 = 4.0 * f32::EPSILON;
/// Distance behind an opaque surface at which a lamp is meant to be in its plane, relative to the largest
/// coordinate of the place. Rays start from a lamp farther off than this, or its light would not get out.
pub(crate) const IN_PLANE: f32 = 0.875 * RAY_OFFSET;
/// Roundings of a distance along a ray.
const DISTANCE: f32 = 2.0 * f32::EPSILON;
/// Least cosine between a ray and the normal: distances between surfaces grow along rays that graze them.
const GRAZING: f32 = 0.05;

/// The plane of a surface that a ray meets, and how far off it another one coincides.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    /// Distance along the ray.
    t: f32,
    /// The geometric normal, turned the way the ray goes.
    normal: Vec3,
    /// Distance across the plane, scene units.
    across: f32,
}

impl Plane {
    fn new(ray: &Ray, t: f32, normal: Vec3, across: f32) -> Self {
        Self { t, normal: if normal.dot(ray.direction) < 0.0 { -normal } else { normal }, across }
    }

    /// Distance along the ray beyond which nothing coincides.
    pub(super) fn width(&self, ray: &Ray) -> f32 {
        self.across / self.normal.dot(ray.direction).max(GRAZING) + DISTANCE * self.t
    }

    /// Whether another plane coincides: a ray that goes on from the nearer one starts `across` off it, and
    /// has passed the other. So faces that are turned away from each other, as those at the rim of a ball
    /// are, or stand upright on each other, do not, but where the ray meets their common edge.
    fn coincides(&self, other: &Self, ray: &Ray) -> bool {
        let between = (self.t - other.t).abs() - DISTANCE * self.t.max(other.t);
        let cosine = self.normal.dot(ray.direction).min(other.normal.dot(ray.direction));
        between * cosine < self.across.max(other.across) * self.normal.dot(other.normal).max(0.0)
    }
}

/// Largest distance along `ray`, from an opaque surface at distance `t`, of a lamp in its plane.
#[inline]
pub(super) fn largest_width_of_plane(ray: &Ray, t: f32) -> f32 {
    const MARGIN: f32 = 1.0 + 1e-4;
    let place = ray.origin.abs().max_element() + t;
    (IN_PLANE / GRAZING * place + DISTANCE * t) * MARGIN
}

impl ReadyScene {
    /// The plane of the hit of a candidate.
    pub(super) fn plane(&self, ray: &Ray, candidate: &Candidate, position: Vec3, normal: Vec3) -> Plane {
        let rounded = match self.geometry.shape(candidate.shape) {
            Shape::Mesh(mesh) => mesh.rounded(candidate.primitive).dot(normal.abs()),
            Shape::Sphere(_) | Shape::Box(_) | Shape::Quad(_) => 0.0,
        };
        let across = (COINCIDENT * position.abs().max_element()).max(ROUNDING * rounded);
        Plane::new(ray, candidate.t, normal, across)
    }

    /// The plane of a candidate.
    fn plane_of(&self, ray: &Ray, candidate: &Candidate) -> Plane {
        let point = self.geometry.surface(ray, candidate);
        self.plane(ray, candidate, point.position, point.geometric_normal)
    }

    /// The hit of a lamp that is met behind the nearest opaque surface, if it is in its plane.
    #[cold]
    pub(super) fn lamp_in_plane(
        &self,
        ray: &Ray,
        nearest: &Candidate,
        lamp: &Candidate,
    ) -> Option<Hit<Material>> {
        let in_plane = |hit: &Hit<Material>| {
            let across = IN_PLANE * hit.position.abs().max_element();
            Plane::new(ray, hit.t, hit.geometric_normal, across)
        };
        let (nearest, hit) = (self.hit(ray, nearest), self.hit(ray, lamp));
        in_plane(&nearest).coincides(&in_plane(&hit), ray).then_some(hit)
    }

    /// Largest [width](Plane::width) at distance `t` along `ray`.
    #[inline]
    pub(super) fn largest_width(&self, ray: &Ray, t: f32) -> f32 {
        const MARGIN: f32 = 1.0 + 1e-4;
        let place = ray.origin.abs().max_element() + t;
        let across = (COINCIDENT * place).max(ROUNDING * self.most_rounded);
        (across / GRAZING + DISTANCE * t) * MARGIN
    }

    /// The surface that a ray meets first, in the plane `anchor`, where something may coincide with it: an
    /// opaque one, or that of the highest body, with the other boundaries in `crossings`.
    #[cold]
    pub(super) fn surface_at(
        &self,
        ray: &Ray,
        anchor: &Plane,
        crossings: &mut Vec<Crossing>,
    ) -> Option<Hit<Material>> {
        let width = anchor.width(ray);
        let near = ray.with_range((anchor.t - width).max(ray.t_min), anchor.t + width);
        crossings.retain(|crossing| crossing.t <= near.t_min);
        let mut met = Vec::new();
        self.geometry.for_each_hit(near, |candidate| {
            let is_first = candidate.t <= anchor.t && !self.record(candidate).boundary.is_null();
            met.push((*candidate, is_first || anchor.coincides(&self.plane_of(ray, candidate), ray)));
            Visit::Continue
        });
        // In an order that is not that of the traversal: of equal ranks the first counts.
        met.sort_unstable_by(|(a, _), (b, _)| {
            let key = |candidate: &Candidate| (candidate.shape.0, candidate.primitive);
            a.t.total_cmp(&b.t).then_with(|| key(a).cmp(&key(b)))
        });
        // What is behind something else belongs to another place.
        let beyond = met.iter().filter(|(candidate, coincides)| candidate.t > anchor.t && !coincides);
        let beyond = beyond.map(|(candidate, _)| candidate.t).fold(f32::INFINITY, f32::min);
        met.retain(|(candidate, _)| candidate.t < beyond);
        // What is before it and does not coincide was crossed before.
        for (candidate, _) in met.iter().filter(|(_, coincides)| !coincides) {
            let interior = self.record(candidate).boundary.interior();
            crossings.extend(interior.map(|interior| self.crossing(ray, candidate, interior, false)));
        }
        let first = crossings.len();
        let (mut opaque, mut end) = (Opaque::default(), anchor.t);
        let mut highest: Option<(Candidate, Crossing)> = None;
        let rank = |crossing: &Crossing| (crossing.interior.priority, crossing.entering);
        for (candidate, _) in met.iter().filter(|(_, coincides)| *coincides) {
            let boundary = &self.record(candidate).boundary;
            let Some(interior) = boundary.interior() else {
                self.add(ray, &mut opaque, candidate);
                continue;
            };
            end = end.max(candidate.t);
            let crossing = self.crossing(ray, candidate, interior, !boundary.is_null());
            let is_higher = |(_, other): &(_, _)| rank(&crossing) > rank(other);
            if crossing.scatters && highest.as_ref().is_none_or(is_higher) {
                crossings.extend(highest.replace((*candidate, crossing)).map(|(_, lower)| lower));
            } else {
                crossings.push(crossing);
            }
        }
        // A glass that stands on a table: the light inside of it must not get below.
        if let Some(nearest) = opaque.nearest {
            crossings.truncate(first);
            let lamp = opaque.lamp.and_then(|lamp| self.lamp_in_plane(ray, &nearest, &lamp));
            return Some(lamp.unwrap_or_else(|| self.hit(ray, &nearest)));
        }
        for crossing in &mut crossings[first..] {
            crossing.t = end;
        }
        highest.map(|(candidate, _)| Hit { t: end, ..self.hit(ray, &candidate) })
    }

    /// Puts boundaries that coincide with one that scatters at the same distance; `crossings` are sorted.
    pub(super) fn join(&self, ray: &Ray, crossings: &mut [Crossing]) {
        let mut joined = false;
        let mut next = 0;
        while let Some(anchor) = (next..crossings.len()).find(|&i| crossings[i].scatters) {
            let begin = next;
            next = anchor + 1;
            let t = crossings[anchor].t;
            let largest = self.largest_width(ray, t);
            let is_near = |other: &Crossing| (other.t - t).abs() < largest;
            let before = anchor > begin && is_near(&crossings[anchor - 1]);
            let behind = crossings.get(next).is_some_and(is_near);
            if !(before || behind) {
                continue;
            }
            let planes = self.planes(&ray.with_range((t - largest).max(ray.t_min), t + largest));
            let plane_of = |crossing: &Crossing| {
                let is_its = |(body, plane): &&(BodyId, Plane)| {
                    *body == crossing.interior.body && plane.t == crossing.t
                };
                planes.iter().find(is_its).map(|(_, plane)| *plane)
            };
            let Some(own) = plane_of(&crossings[anchor]) else { continue };
            let width = own.width(ray);
            let coincides = |other: &Crossing| {
                (other.t - t).abs() < width && plane_of(other).is_some_and(|plane| own.coincides(&plane, ray))
            };
            next += crossings[next..].iter().take_while(|other| coincides(other)).count();
            let end = crossings[next - 1].t;
            for crossing in &mut crossings[begin..next] {
                if crossing.t >= t || coincides(crossing) {
                    crossing.t = end;
                }
            }
            joined = true;
        }
        if joined {
            sort(crossings);
        }
    }

    /// The planes of boundaries in the range of a ray.
    #[cold]
    fn planes(&self, near: &Ray) -> Vec<(BodyId, Plane)> {
        let mut planes = Vec::new();
        self.geometry.for_each_hit(*near, |candidate| {
            let interior = self.record(candidate).boundary.interior();
            planes.extend(interior.map(|interior| (interior.body, self.plane_of(near, candidate))));
            Visit::Continue
        });
        planes
    }
}
