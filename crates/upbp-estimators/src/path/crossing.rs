//! Boundaries that a ray crosses: which of them are surfaces for it, and where it must have started.
//!
//! Boundaries that coincide count together, from the body on one side to that on the other. Source:
//! `docs/theory.md`, section 1.7; oracle: `tests/it/agreement/shared_faces.rs`.

use upbp_media::MediumStack;

use crate::scene::Crossing;

/// Crosses all boundaries of a place.
pub(crate) fn cross_all(stack: &mut MediumStack, place: &[Crossing]) {
    for crossing in place {
        // Contradictions are ignored: what is entered twice is left once.
        let _ = stack.cross(crossing.interior, crossing.entering);
    }
}

/// Whether the surface of a body is there for a path between the bodies `before` and `behind` it.
///
/// A boundary inside a stronger body, or of a body that is hidden by one, is no surface: the body is entered
/// or left, and the ray goes on. Where the body that counts changes, its surface is there, on the side where
/// it counts; and where indices of refraction differ, light bends whichever body has the surface.
#[inline]
pub(crate) fn is_surface(before: &MediumStack, behind: &MediumStack, boundary: &Crossing) -> bool {
    let (here, there) = (before.top(), behind.top());
    let inside = if boundary.entering { there } else { here };
    let changes = here.map(|top| top.body) != there.map(|top| top.body);
    changes && (inside.is_some_and(|top| top.body == boundary.interior.body) || before.ior() != behind.ior())
}

/// Whether a path from the bodies `before` meets a surface where it crosses all boundaries of `place`.
pub(crate) fn has_surface(before: &MediumStack, place: &[Crossing]) -> bool {
    let scattering = place.iter().filter(|crossing| crossing.scatters);
    scattering.max_by_key(|crossing| crossing.interior.priority).is_some_and(|boundary| {
        let mut behind = before.clone();
        cross_all(&mut behind, place);
        is_surface(before, &behind, boundary)
    })
}

/// A crossing that must have happened where a ray starts, if one at `place` is the first of its body, after
/// those in `earlier`, and contradicts the bodies that the ray is thought to be in: an index-matched body
/// that is left was entered before, and one that is entered was not.
///
/// Vertices within rounding of a boundary come out on the wrong side of it, and cameras and lights may stand
/// on one.
pub(crate) fn correction(stack: &MediumStack, place: &[Crossing], earlier: &[Crossing]) -> Option<Crossing> {
    let contradicts = |crossing: &Crossing| {
        !crossing.scatters && stack.contains(crossing.interior.body) == crossing.entering
    };
    let is_first = |i: usize| {
        let body = place[i].interior.body;
        earlier.iter().chain(&place[..i]).all(|other| other.interior.body != body)
    };
    let i = (0..place.len()).find(|&i| contradicts(&place[i]) && is_first(i))?;
    Some(Crossing { t: 0.0, entering: !place[i].entering, ..place[i] })
}

/// The [`correction`] for a ray that gets to infinity: what it never crossed it was not inside of.
pub(crate) fn correction_of_escape(stack: &MediumStack, earlier: &[Crossing]) -> Option<Crossing> {
    let crossed = |body| earlier.iter().any(|other| other.interior.body == body);
    let interior = stack.bodies().find(|interior| !crossed(interior.body))?;
    Some(Crossing { t: 0.0, interior, entering: false, scatters: false })
}

/// Bodies at the start of a ray that may turn out to be others than was thought.
const MAX_CORRECTIONS: usize = 64;

/// Whether a ray is followed again with one more correction, or is lost: a scene that tells of other bodies
/// each time would never end.
pub(crate) const fn may_correct(corrections: usize) -> bool {
    corrections < MAX_CORRECTIONS
}

#[cfg(test)]
mod tests {
    use upbp_media::{BodyId, Interior};

    use super::*;

    /// From a glass into another of the same index; a third, hidden in that, is told of last.
    #[test]
    fn the_strongest_of_boundaries_that_coincide_has_the_surface() {
        let glass =
            |number: i32| Interior { body: BodyId(number as u32), medium: None, priority: number, ior: 1.5 };
        let mut before = MediumStack::new(None);
        let _ = before.enter(glass(2));
        let crossing =
            |number, entering| Crossing { t: 1.0, interior: glass(number), entering, scatters: true };
        let place = [crossing(2, false), crossing(1, true), crossing(0, true)];
        assert!(has_surface(&before, &place));
        assert!(!has_surface(&before, &place[2..]), "one that is hidden has none");
    }
}
