//! Boundaries of bodies that coincide: liquid and the glass that holds it share faces.
//!
//! A path meets all that coincides as one: [`Scene::trace`](upbp_estimators::scene::Scene::trace) tells it of
//! one surface, with the other boundaries as crossings at the same distance.

use upbp_accel::{Candidate, RAY_OFFSET, Ray, Shape, Visit};
use upbp_estimators::scene::{Crossing, Hit};

use super::{Opaque, ReadyScene, sort};
use crate::material::Material;

/// Distance between surfaces that coincide, relative to the largest coordinate of the place. Rays start
/// nearer than this to a surface, so that none that does not coincide with it is skipped. What one that
/// leaves meets again was crossed already, which changes nothing.
pub(crate) const COINCIDENT: f32 = 1.25 * RAY_OFFSET;
/// Distance between planes of triangles that are meant to coincide, relative to the largest coordinate of a
/// corner: roundings of the corners. It counts where the plane passes near the origin, far from the corners.
const ROUNDING: f32 = 4.0 * f32::EPSILON;
/// Distance behind an opaque surface at which a lamp is meant to be in its plane, relative to the largest
/// coordinate of the place. Rays start from a lamp farther off than this, or its light would not get out.
const IN_PLANE: f32 = 0.875 * RAY_OFFSET;
/// Roundings of a distance along a ray.
const DISTANCE: f32 = 2.0 * f32::EPSILON;
/// Least cosine between a ray and the normal: distances between surfaces grow along rays that graze them.
const GRAZING: f32 = 0.05;

/// The way along `ray` to what is `across` off the surface that it hits, scene units.
fn along(across: f32, ray: &Ray, hit: &Hit<Material>) -> f32 {
    across / hit.geometric_normal.dot(ray.direction).abs().max(GRAZING) + DISTANCE * hit.t
}

/// Largest distance along `ray`, from an opaque surface at distance `t`, of a lamp in its plane.
#[inline]
pub(super) fn largest_width_of_plane(ray: &Ray, t: f32) -> f32 {
    const MARGIN: f32 = 1.0 + 1e-4;
    let place = ray.origin.abs().max_element() + t;
    (IN_PLANE / GRAZING * place + DISTANCE * t) * MARGIN
}

impl ReadyScene {
    /// Distance along `ray` within which boundaries coincide with the hit of a candidate, scene units.
    pub(super) fn width(&self, ray: &Ray, candidate: &Candidate, hit: &Hit<Material>) -> f32 {
        let largest_corner = match self.geometry.shape(candidate.shape) {
            Shape::Mesh(mesh) => {
                let corners = mesh.corners(candidate.primitive);
                corners.map(|corner| corner.abs().max_element()).into_iter().fold(0.0, f32::max)
            }
            Shape::Sphere(_) | Shape::Box(_) | Shape::Quad(_) => 0.0,
        };
        let across = (COINCIDENT * hit.position.abs().max_element()).max(ROUNDING * largest_corner);
        along(across, ray, hit)
    }

    /// The hit of a lamp that is met behind the nearest opaque surface, if it is in its plane.
    #[cold]
    pub(super) fn lamp_in_plane(
        &self,
        ray: &Ray,
        nearest: &Candidate,
        lamp: &Candidate,
    ) -> Option<Hit<Material>> {
        let hit = self.hit(ray, lamp);
        let width = along(IN_PLANE * hit.position.abs().max_element(), ray, &hit);
        (hit.t < nearest.t + width).then_some(hit)
    }

    /// Largest [`width`](Self::width) at distance `t` along `ray`.
    #[inline]
    pub(super) fn largest_width(&self, ray: &Ray, t: f32) -> f32 {
        const MARGIN: f32 = 1.0 + 1e-4;
        let place = ray.origin.abs().max_element() + t;
        let across = (COINCIDENT * place).max(ROUNDING * self.largest_corner);
        (across / GRAZING + DISTANCE * t) * MARGIN
    }

    /// The surface at distance `at`, where something may coincide with it, as far as `width` before and
    /// behind: an opaque one, or that of the highest body, with the other boundaries in `crossings`.
    #[cold]
    pub(super) fn surface_at(
        &self,
        ray: &Ray,
        at: f32,
        width: f32,
        crossings: &mut Vec<Crossing>,
    ) -> Option<Hit<Material>> {
        let near = ray.with_range((at - width).max(ray.t_min), at + width);
        crossings.retain(|crossing| crossing.t <= near.t_min);
        let first = crossings.len();
        let (mut opaque, mut end) = (Opaque::default(), at);
        let mut highest: Option<(Candidate, Crossing)> = None;
        let rank = |crossing: &Crossing| (crossing.interior.priority, crossing.entering);
        self.geometry.for_each_hit(near, |candidate| {
            let boundary = &self.record(candidate).boundary;
            let Some(interior) = boundary.interior() else {
                self.add(ray, &mut opaque, candidate);
                return Visit::Continue;
            };
            end = end.max(candidate.t);
            let crossing = self.crossing(ray, candidate, interior, !boundary.is_null());
            let is_higher = |(_, other): &(_, _)| rank(&crossing) > rank(other);
            if crossing.scatters && highest.as_ref().is_none_or(is_higher) {
                crossings.extend(highest.replace((*candidate, crossing)).map(|(_, lower)| lower));
            } else {
                crossings.push(crossing);
            }
            Visit::Continue
        });
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
            let Crossing { t, interior, .. } = crossings[anchor];
            let is_near = |other: &Crossing, width: f32| (other.t - t).abs() < width;
            let largest = self.largest_width(ray, t);
            let before = anchor > next && is_near(&crossings[anchor - 1], largest);
            let behind = crossings.get(anchor + 1).is_some_and(|other| is_near(other, largest));
            next = anchor + 1;
            if !(before || behind) {
                continue;
            }
            let mut width = 0.0;
            self.geometry.for_each_hit(ray.with_range(t.next_down(), t.next_up()), |candidate| {
                if self.record(candidate).boundary.interior() == Some(interior) {
                    width = self.width(ray, candidate, &self.hit(ray, candidate));
                }
                Visit::Continue
            });
            let first = crossings[..anchor].partition_point(|other| other.t <= t - width);
            next += crossings[next..].partition_point(|other| other.t < t + width);
            let end = crossings[next - 1].t;
            for crossing in &mut crossings[first..next] {
                crossing.t = end;
            }
            joined = true;
        }
        if joined {
            sort(crossings);
        }
    }
}
