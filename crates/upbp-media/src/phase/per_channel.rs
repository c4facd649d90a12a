//! Phase functions that differ between the channels.

use super::deflection::Deflection;
use super::{ONE_MINUS_EPSILON, PhaseFunction, PhaseValue};
use crate::Spectrum;

/// A phase function for each channel, made by [`PhaseFunction::per_channel`].
///
/// A walk with [lanes](crate::Lanes) draws all its directions for the channel of its hero. Without lanes a
/// channel is drawn uniformly anew at each collision, so that the density is the mean of the three: both ends
/// of a path know it, and no channel's value is more than three times the density, but over many collisions
/// the factors multiply.
#[derive(Clone, Debug, PartialEq)]
pub struct PerChannel {
    /// None of them is itself per channel.
    channels: Box<[PhaseFunction; 3]>,
}

impl PerChannel {
    pub(super) fn new(channels: [PhaseFunction; 3]) -> Self {
        let [r, g, b] = channels;
        Self { channels: Box::new([r.channel(0), g.channel(1), b.channel(2)]) }
    }

    /// The phase functions of the red, the green and the blue channel.
    #[must_use]
    pub fn channels(&self) -> &[PhaseFunction; 3] {
        &self.channels
    }

    pub(super) fn value(&self, deflection: Deflection<f32>) -> PhaseValue {
        let value = Spectrum::from_array(self.channels.each_ref().map(|phase| phase.value(deflection).pdf));
        PhaseValue { value, pdf: value.mean() }
    }

    pub(super) fn mean_cosine(&self) -> Spectrum {
        Spectrum::from_array(self.channels.each_ref().map(|phase| phase.mean_cosine().r()))
    }

    /// Chooses a channel; also returns the rest of the random number, again in `[0, 1)`.
    pub(super) fn choose(&self, u: f32) -> (&PhaseFunction, f32) {
        let scaled = 3.0 * u;
        let channel = (scaled as usize).min(2);
        (&self.channels[channel], (scaled - channel as f32).min(ONE_MINUS_EPSILON))
    }
}
