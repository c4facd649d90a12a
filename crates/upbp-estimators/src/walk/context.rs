//! What every walk needs.

use upbp_media::Spectrum;

use super::passage::Passage;
use crate::counters::Counters;
use crate::plan::Plan;
use crate::scene::{Crossing, Scene};
use crate::technique::Technique;
use crate::world::World;

/// The scene and the plan of an iteration.
pub struct Context<'a, S: Scene> {
    /// The scene, made ready.
    pub world: &'a World<'a, S>,
    /// What the iteration does.
    pub plan: &'a Plan,
}

impl<S: Scene> Clone for Context<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<S: Scene> Copy for Context<'_, S> {}

/// Buffers of one thread, kept from path to path.
pub struct Scratch<B> {
    pub(crate) passage: Passage<B>,
    pub(crate) crossings: Vec<Crossing>,
}

impl<B: Copy> Default for Scratch<B> {
    fn default() -> Self {
        Self { passage: Passage::new(), crossings: Vec::new() }
    }
}

impl Counters {
    /// The weighted contribution, counted; or nothing, counted as dropped, if it is not a radiance.
    #[inline]
    pub(crate) fn accept(&mut self, technique: Technique, value: Spectrum, weight: f64) -> Option<Spectrum> {
        if value.is_black() || weight == 0.0 {
            return None;
        }
        let contribution = value * weight as f32;
        if contribution.is_finite() && contribution.is_non_negative() {
            self.contributions[technique as usize] += 1;
            Some(contribution)
        } else {
            self.dropped += 1;
            None
        }
    }
}
