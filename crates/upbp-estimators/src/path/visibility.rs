//! Visibility: the edge between two vertices that are to be connected.

use glam::Vec3;
use upbp_accel::{Ray, offset_origin};
use upbp_media::{EdgeDensity, Lanes, MediumStack};

use super::crossing::{correction, correction_of_escape, cross_all, has_surface, may_correct};
use super::edge::{medium_of, push_stretch};
use super::interaction::Interaction;
use crate::scene::{Crossing, MAX_CROSSINGS, Scene};

/// The far end of a connection.
#[derive(Clone, Copy, Debug)]
pub enum Target {
    /// Infinitely far in this direction, a unit vector.
    Infinity(Vec3),
    /// A point in a medium.
    Medium(Vec3),
    /// A point on a surface, with the unit normal there.
    Surface(Vec3, Vec3),
    /// A light or a lens that has no surface, but may lie in one: a lamp in the plane of its ceiling.
    Pinpoint(Vec3),
}

/// The start of a ray from a vertex: off the surface, by no more than rounding requires.
pub(crate) fn ray_origin<B>(interaction: &Interaction<B>, position: Vec3, direction: Vec3) -> Vec3 {
    match interaction {
        Interaction::Surface(surface) => offset_origin(position, surface.geometric_normal, direction),
        Interaction::Medium(_) => position,
    }
}

/// The densities of the edge from `origin` (off its surface) to `target`, or `None` if a surface is in
/// between.
///
/// `stack` holds the bodies at the near end, on the side of `target`; the far end has none of its own.
pub fn clear_edge<S: Scene, L: Lanes>(
    scene: &S,
    stack: &MediumStack,
    origin: Vec3,
    target: &Target,
    crossings: &mut Vec<Crossing>,
) -> Option<EdgeDensity<L>> {
    /// The far end of a ray is off by less than this part of its length, by the roundings of its direction.
    const OFF: f32 = 4.0 * f32::EPSILON;
    /// Surfaces that are met at smaller cosines count as met at this one.
    const LEAST_COSINE: f32 = 0.04;
    crossings.clear();
    // The ray ends before it could, by rounding, meet the surface that it leads to; media do not.
    let to_point = |point: Vec3, short: f32| {
        let between = point - origin;
        let length = between.length();
        (Ray { origin, direction: between / length, t_min: 0.0, t_max: length * (1.0 - short) }, length)
    };
    let (ray, length) = match *target {
        Target::Infinity(direction) => (Ray::new(origin, direction), f32::INFINITY),
        Target::Medium(point) => to_point(point, 0.0),
        Target::Surface(position, normal) => {
            // Both ends stand off their surfaces, so that neither blocks the view.
            let away = origin - position;
            let cosine = away.dot(normal).abs() / away.length();
            to_point(offset_origin(position, normal, away), OFF / cosine.max(LEAST_COSINE))
        }
        Target::Pinpoint(point) => {
            let away = (origin - point).normalize();
            to_point(offset_origin(point, away, away), OFF / LEAST_COSINE)
        }
    };
    if !(ray.t_max > 0.0) || !ray.direction.is_finite() || !scene.is_clear(&ray, crossings) {
        return None;
    }
    if crossings.len() >= MAX_CROSSINGS {
        return None;
    }
    let escapes = length == f32::INFINITY;
    if crossings.is_empty() && (!escapes || stack.is_empty()) {
        // Most edges: no list is copied.
        let mut density = EdgeDensity::EMPTY;
        push_stretch(scene, &mut density, &ray, medium_of(scene, stack), 0.0, length);
        return Some(density);
    }
    // As along a walk, what the ray meets counts more than what was known where it starts.
    let mut corrections = 0;
    while may_correct(corrections) {
        match accumulate(scene, stack.clone(), &ray, length, crossings, corrections) {
            Followed::Clear(density) => return Some(density),
            Followed::Blocked => return None,
            Followed::Corrected(correction) => crossings.insert(corrections, correction),
        }
        corrections += 1;
    }
    None
}

/// The result of following an edge.
enum Followed<L> {
    Clear(EdgeDensity<L>),
    Blocked,
    /// The edge is another one, with this crossing at its start.
    Corrected(Crossing),
}

fn accumulate<S: Scene, L: Lanes>(
    scene: &S,
    mut stack: MediumStack,
    ray: &Ray,
    length: f32,
    crossings: &[Crossing],
    corrections: usize,
) -> Followed<L> {
    let mut density = EdgeDensity::<L>::EMPTY;
    let mut start = 0.0;
    let mut started = false;
    let mut crossed = 0;
    for place in crossings.chunk_by(|a, b| a.t == b.t) {
        if crossed >= corrections
            && let Some(correction) = correction(&stack, place, &crossings[..crossed])
        {
            return Followed::Corrected(correction);
        }
        crossed += place.len();
        if has_surface(&stack, place) {
            return Followed::Blocked;
        }
        let medium = medium_of(scene, &stack);
        cross_all(&mut stack, place);
        if medium_of(scene, &stack) != medium {
            let t = place[0].t.max(start);
            // The first stretch counts even without a length.
            if t > start || !started {
                push_stretch(scene, &mut density, ray, medium, start, t);
                started = true;
            }
            start = t;
        }
    }
    if length == f32::INFINITY
        && let Some(correction) = correction_of_escape(&stack, crossings)
    {
        return Followed::Corrected(correction);
    }
    if length > start || !started {
        push_stretch(scene, &mut density, ray, medium_of(scene, &stack), start, length);
    }
    Followed::Clear(density)
}
