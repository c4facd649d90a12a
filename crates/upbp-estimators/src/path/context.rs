//! Context and buffers of a walk.

use upbp_media::{Lanes, MediumStack};

use super::edge::{EdgeTrace, Extent};
use crate::iteration::IterationPlan;
use crate::prepared_scene::PreparedScene;
use crate::scene::{Crossing, Enclosure, Scene};

/// The scene and the plan of an iteration.
pub struct Context<'a, S: Scene> {
    /// The scene, made ready.
    pub prepared: &'a PreparedScene<'a, S>,
    /// The plan of the iteration.
    pub plan: &'a IterationPlan,
}

impl<S: Scene> Clone for Context<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<S: Scene> Copy for Context<'_, S> {}

impl<S: Scene> Context<'_, S> {
    /// Distance that must be known along a ray from within the bodies of `stack`: `all` of it if somebody
    /// else asks for that.
    #[inline]
    pub(crate) fn extent(&self, all: bool, stack: &MediumStack) -> Extent {
        let to_surface = all || stack.medium().is_some_and(|medium| self.prepared.is_dense(medium));
        if to_surface { Extent::ToSurface } else { Extent::ToStop }
    }

    /// Whether it is known that no straight line leads to a light from where the top body of `stack` counts.
    #[inline]
    pub(crate) fn hides_lights(&self, stack: &MediumStack) -> bool {
        self.enclosure(stack).is_some_and(|enclosure| !enclosure.lights)
    }

    /// Whether it is known that no straight line leads to the lens from where the top body of `stack` counts.
    #[inline]
    pub(crate) fn hides_lens(&self, stack: &MediumStack) -> bool {
        self.enclosure(stack).is_some_and(|enclosure| !enclosure.lens)
    }

    #[inline]
    fn enclosure(&self, stack: &MediumStack) -> Option<Enclosure> {
        stack.top().and_then(|top| self.prepared.scene.enclosure(top.body))
    }
}

/// Buffers of one thread, kept from path to path.
pub struct Scratch<B, L: Lanes = f64> {
    pub(crate) edge_trace: EdgeTrace<B, L>,
    pub(crate) crossings: Vec<Crossing>,
}

impl<B: Copy, L: Lanes> Default for Scratch<B, L> {
    fn default() -> Self {
        Self { edge_trace: EdgeTrace::new(), crossings: Vec::new() }
    }
}
