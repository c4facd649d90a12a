//! Which of several bodies counts where they overlap.
//!
//! At load all bodies get a total order, so that what is inside of what never depends on the way that a
//! path took: by the given priority, then the smaller volume above the larger, then the later in the file
//! above the earlier. The second rule makes nested bodies work without any number: what is inside is smaller.

use upbp_accel::{Shape, ShapeId};
use upbp_media::{BodyId, Interior, MediumId};

use crate::scene::Body;

/// A body before it has its place.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodyDraft<'a> {
    /// Place of its shape in the scene.
    pub(super) index: usize,
    pub(super) shape: &'a Shape,
    pub(super) medium: Option<MediumId>,
    /// Index of refraction; `None` for that of the surroundings.
    pub(super) ior: Option<f32>,
    /// As given; the higher counts.
    pub(super) priority: i32,
}

/// Puts bodies in order, the lowest first: a body's [`Interior::priority`] is its place.
pub(super) fn rank<'a>(drafts: impl Iterator<Item = BodyDraft<'a>>) -> Vec<Body> {
    let mut drafts: Vec<BodyDraft<'a>> = drafts.collect();
    drafts.sort_by(|a, b| {
        let larger_first = || b.shape.volume_bound().total_cmp(&a.shape.volume_bound());
        a.priority.cmp(&b.priority).then_with(larger_first).then(a.index.cmp(&b.index))
    });
    let mut bodies: Vec<Body> = Vec::with_capacity(drafts.len());
    for ((place, draft), priority) in drafts.iter().enumerate().zip(0..) {
        let ior = draft.ior.unwrap_or_else(|| surrounding_ior(draft, &drafts[..place], &bodies));
        let interior = Interior { body: BodyId(place as u32), medium: draft.medium, priority, ior };
        bodies.push(Body { shape: ShapeId(draft.index as u32), aabb: draft.shape.aabb(), interior });
    }
    bodies
}

/// Whether a body is all inside of another sphere or box, as far as their own boxes tell.
pub(super) fn is_inside(shape: &Shape, other: &Shape) -> bool {
    let (min, max) = shape.aabb();
    match (shape, other) {
        (_, Shape::Box(_)) => {
            let (outer_min, outer_max) = other.aabb();
            outer_min.cmple(min).all() && max.cmple(outer_max).all()
        }
        (Shape::Sphere(inner), Shape::Sphere(outer)) => {
            inner.centre().distance(outer.centre()) + inner.radius() <= outer.radius()
        }
        (_, Shape::Sphere(outer)) => {
            let farthest = (min - outer.centre()).abs().max((max - outer.centre()).abs());
            farthest.length() <= outer.radius()
        }
        _ => false,
    }
}

/// The index of refraction around an index-matched body: that of the highest body below it that contains
/// points all over its surface. A cloud in a glass block has the index of the glass, or a bubble in the
/// cloud would refract wrongly.
fn surrounding_ior(draft: &BodyDraft<'_>, lower: &[BodyDraft<'_>], placed: &[Body]) -> f32 {
    let surface =
        |i: u8| draft.shape.sample_area([(f32::from(i % 4) + 0.5) / 4.0, (f32::from(i / 4) + 0.5) / 4.0]).0;
    let (min, max) = draft.shape.aabb();
    let contains = |shape: &Shape| {
        let (outer_min, outer_max) = shape.aabb();
        let boxed = outer_min.cmple(min).all() && max.cmple(outer_max).all();
        boxed && (0..16).all(|i| shape.contains(surface(i)) == Some(true))
    };
    lower
        .iter()
        .zip(placed)
        .rev()
        .find(|(other, _)| contains(other.shape))
        .map_or(1.0, |(_, body)| body.interior.ior)
}
