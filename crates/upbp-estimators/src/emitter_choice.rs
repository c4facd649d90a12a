//! The emitters that sub-paths begin at, and how often (`docs/theory.md`, sections 6.6 and 6.11).

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::emission_guide::EmissionGuide;
use crate::emitter_selection::{STEPS, Selection};
use crate::emitter_tree::EmitterTree;
use crate::emitters_by_receiver::ReceiverShares;
use crate::random::Decision;
use crate::scene::{BoundingSphere, EmitterId};

/// The probabilities of emitters: part of a plan, so that iterations on all machines choose alike.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EmitterChoice {
    /// Probabilities of emitters at which light sub-paths start.
    pub(crate) emission: Selection,
    /// Probabilities of emitters of next events, alike for all receivers.
    pub(crate) next_event: Selection,
    /// Probabilities of emitters of next events by the place of the receiver, for all but a
    /// [part](EVERYWHERE) of the choice.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) receivers: Option<ReceiverShares>,
    /// Distributions of places and directions of starts, by emitter; emitters that are left out have no
    /// guide.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) guides: Vec<Option<EmissionGuide>>,
    /// Point that the rays of most guided starts pass: light from infinity starts on discs around it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) focus: Option<Vec3>,
}

impl EmitterChoice {
    /// The guide of an emitter's light sub-paths, if it has one.
    #[must_use]
    pub fn guide(&self, emitter: EmitterId) -> Option<&EmissionGuide> {
        self.guides.get(emitter.0 as usize)?.as_ref()
    }

    /// Checks that a scene can choose so, whose emitters have some `power` and are in some `clusters`, if it
    /// has a tree over them; `axes` are the numbers of a start that a guide of an emitter may split.
    pub(crate) fn check(
        &self,
        power: &Selection,
        clusters: Option<usize>,
        bounds: &BoundingSphere,
        axes: impl Fn(EmitterId) -> [bool; 4],
    ) -> Result<(), EmitterChoiceError> {
        let emitters = power.len();
        if ![&self.emission, &self.next_event].iter().all(|selection| selection.fits(power)) {
            return Err(EmitterChoiceError::Emitters { emitters });
        }
        let can_follow = |(emitter, guide): (u32, &Option<EmissionGuide>)| {
            guide.as_ref().is_none_or(|guide| guide.is_valid(axes(EmitterId(emitter))))
        };
        if self.guides.len() > emitters || !(0..).zip(&self.guides).all(can_follow) {
            return Err(EmitterChoiceError::Guides);
        }
        if self.focus.is_some() && !self.emission_bounds(bounds).has_density_on_disc() {
            return Err(EmitterChoiceError::Focus);
        }
        let fits = |receivers: &ReceiverShares| clusters.is_some_and(|clusters| receivers.fits(clusters));
        if self.receivers.as_ref().is_some_and(|receivers| !fits(receivers)) {
            return Err(EmitterChoiceError::Receivers);
        }
        Ok(())
    }

    /// The sphere that light from infinity has to start in front of: around the focus, and about all of
    /// `bounds`. So starts that lead to the focus have one place on the disc, whatever their direction.
    pub(crate) fn emission_bounds(&self, bounds: &BoundingSphere) -> BoundingSphere {
        self.focus.map_or(*bounds, |centre| BoundingSphere {
            centre,
            radius: bounds.radius + centre.distance(bounds.centre),
        })
    }

    /// Chooses an emitter for `receiver`; with its probability.
    #[inline]
    pub(crate) fn next_event(
        &self,
        tree: Option<&EmitterTree>,
        receiver: Vec3,
        decision: Decision,
    ) -> Option<(EmitterId, f32)> {
        match (&self.receivers, tree) {
            (Some(shares), Some(tree)) => {
                self.next_event_by_receiver(shares, tree, receiver, decision.pair())
            }
            _ => self.next_event.choose_by(decision),
        }
    }

    fn next_event_by_receiver(
        &self,
        shares: &ReceiverShares,
        tree: &EmitterTree,
        receiver: Vec3,
        [u, fine]: [f32; 2],
    ) -> Option<(EmitterId, f32)> {
        // The second number begins where the first one ends: there may be a million emitters.
        let u = f64::from(u) + f64::from(fine) / f64::from(STEPS);
        let emitter = if u < EVERYWHERE {
            self.next_event.choose(u / EVERYWHERE)?.0
        } else {
            let (cluster, u) = shares.choose(receiver, (u - EVERYWHERE) / (1.0 - EVERYWHERE));
            tree.choose(cluster, receiver, u)
        };
        Some((emitter, self.next_event_probability(Some(tree), receiver, emitter)))
    }

    /// The probability of [`next_event`](Self::next_event).
    pub(crate) fn next_event_probability(
        &self,
        tree: Option<&EmitterTree>,
        receiver: Vec3,
        emitter: EmitterId,
    ) -> f32 {
        let everywhere = self.next_event.probability(emitter);
        let (Some(shares), Some(tree)) = (&self.receivers, tree) else { return everywhere };
        let Some((cluster, [of_cluster, within])) = tree.probability(emitter, receiver) else { return 0.0 };
        let [own, all] = shares.probabilities(receiver, cluster);
        let here = within * (own + all * of_cluster);
        (EVERYWHERE * f64::from(everywhere) + (1.0 - EVERYWHERE) * here) as f32
    }
}

/// Part of the next events that choose an emitter without regard to the receiver: no contribution has more
/// than the inverse of it times the weight that it would have without.
const EVERYWHERE: f64 = 1.0 / 16.0;

/// The choice of emitters of a plan that does not go with the scene.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EmitterChoiceError {
    /// A choice among other emitters, or one that leaves out an emitter that shines.
    #[error("expected a choice among the {emitters} emitters of this scene that leaves out none that shines")]
    Emitters {
        /// The number of emitters of the scene.
        emitters: usize,
    },
    /// A guide without an emitter, or one that its emitter cannot follow.
    #[error("expected guides that the emitters of this scene can follow")]
    Guides,
    /// A focus that light from infinity cannot start around.
    #[error("expected a focus that is not so far away that light from infinity has no density around it")]
    Focus,
    /// Receivers that choose among other clusters of emitters.
    #[error("expected receivers that choose among the clusters of emitters of this scene")]
    Receivers,
}

#[cfg(test)]
mod tests;
