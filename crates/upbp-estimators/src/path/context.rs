//! Context and buffers of a walk.

use upbp_media::Lanes;

use super::edge::EdgeTrace;
use crate::iteration::IterationPlan;
use crate::prepared_scene::PreparedScene;
use crate::scene::{Crossing, Scene};

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
