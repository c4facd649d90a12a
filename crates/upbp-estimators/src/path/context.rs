//! Context and buffers of a walk.

use upbp_media::{Lanes, MediumStack};

use super::edge::{EdgeTrace, Extent};
use super::interaction::MediumInterface;
use super::walk_state::WalkState;
use crate::iteration::IterationPlan;
use crate::prepared_scene::PreparedScene;
use crate::scene::{Crossing, PathEnd, Scene};

/// The scene and the plan of an iteration.
#[derive(Debug)]
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
    /// The extent to which a walk follows a ray from within the bodies of `stack`: to the next surface if
    /// `all` is asked for, in a dense medium, and at every 32nd stop, else until the walk stops.
    ///
    /// A walk that rounding has taken out of its body, and that heads away from it, meets no boundary that
    /// would tell, and would scatter for ever in a medium without end. The end of one ray in 32 does.
    #[inline]
    pub(crate) fn extent<L: Lanes>(&self, all: bool, state: &WalkState<L>, stack: &MediumStack) -> Extent {
        /// Stops after which the bodies are put to the proof.
        const PROOF: u32 = 32;
        let is_proof = state.stops % PROOF == PROOF - 1;
        let to_surface =
            all || is_proof || stack.medium().is_some_and(|medium| self.prepared.is_dense(medium));
        if to_surface { Extent::ToSurface } else { Extent::ToStop }
    }

    /// Whether it is known that no straight line leads to `end` from where the top body of `stack` counts.
    #[inline]
    pub(crate) fn hides(&self, stack: &MediumStack, end: PathEnd) -> bool {
        self.prepared.scene.hides(stack.top().map(|top| top.body), end)
    }

    /// The same from both sides of a surface.
    #[inline]
    pub(crate) fn hides_from_both(&self, sides: &MediumInterface<'_>, end: PathEnd) -> bool {
        self.hides(sides.near, end) && self.hides(sides.far, end)
    }
}

/// Buffers of one thread, kept from path to path.
#[derive(Debug)]
pub struct Scratch<B, L: Lanes = f64> {
    pub(crate) edge_trace: EdgeTrace<B, L>,
    pub(crate) crossings: Vec<Crossing>,
}

impl<B: Copy, L: Lanes> Default for Scratch<B, L> {
    fn default() -> Self {
        Self { edge_trace: EdgeTrace::default(), crossings: Vec::new() }
    }
}
