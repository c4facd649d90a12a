//! Whether a walk in a medium is still where it is thought to be.

use glam::Vec3;
use upbp_media::MediumStack;

use crate::scene::Scene;

/// Stops in a row after which the scene is asked for the first time.
const FIRST: u32 = 16;

/// Counts how often a walk has stopped in media since it last met a boundary, and asks the scene for the
/// bodies there whenever that number has doubled.
///
/// A vertex within rounding of a boundary may come out beyond it. Where a ray goes on from there away from
/// the body, it meets nothing that would correct the bodies, and a walk that is followed no farther than it
/// gets would scatter in a medium without end, in full light. So it does for about as many edges, at most, as
/// it has had in the body, or [`FIRST`] of them.
#[derive(Default)]
pub(crate) struct BodyCheck {
    stops: u32,
}

impl BodyCheck {
    /// Counts an edge that ends at `position`, and that has `crossed` a boundary or not. Where the scene is
    /// asked, and does not find the body there that counts in `stack`, the bodies become those that it finds;
    /// whether they did.
    #[inline]
    pub(crate) fn at_vertex<S: Scene>(
        &mut self,
        scene: &S,
        (position, in_medium): (Vec3, bool),
        crossed: bool,
        stack: &mut MediumStack,
    ) -> bool {
        if crossed || !in_medium {
            self.stops = 0;
            return false;
        }
        self.stops += 1;
        if self.stops < FIRST || !self.stops.is_power_of_two() {
            return false;
        }
        let Some(top) = stack.top() else { return false };
        let found = scene.stack_at(position);
        let is_elsewhere = !found.contains(top.body);
        if is_elsewhere {
            *stack = found;
        }
        is_elsewhere
    }
}
