//! The part of a walk's state that lasts from its first edge to its last.

use upbp_media::Lanes;

use super::context::Context;
use crate::random::Stream;
use crate::roulette::Survival;
use crate::scene::{Scene, Walk};

/// A walk under way: how it draws, and what it remembers of its vertices.
#[derive(Clone, Debug)]
pub struct WalkState<L: Lanes = f64> {
    /// The end of the path that it starts from.
    pub walk: Walk,
    /// Its random numbers.
    pub stream: Stream,
    /// Its roulette.
    pub survival: Survival,
    /// The lane that its distances and directions are drawn from.
    pub hero: L::Hero,
    /// Stops in media so far.
    pub stops: u32,
}

impl<L: Lanes> WalkState<L> {
    /// A walk that starts; the next number of `stream` decides on its lane.
    pub(crate) fn new<S: Scene>(context: &Context<'_, S>, walk: Walk, mut stream: Stream) -> Self {
        let Context { prepared, plan } = *context;
        let survival = match walk {
            Walk::Light => Survival::of_light(plan.roulette, prepared.surroundings()),
            Walk::Camera => Survival::of_camera(plan.roulette, prepared.surroundings()),
        };
        let hero = L::draw(&plan.mis.lanes, || stream.uniform());
        Self { walk, stream, survival, hero, stops: 0 }
    }
}
