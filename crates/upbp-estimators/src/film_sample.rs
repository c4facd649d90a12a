//! Radiance that one camera sub-path brings to its pixel.

use upbp_media::Spectrum;

use crate::counters::Counters;
use crate::mis::{Densities, Weight};
use crate::technique::{Layer, Technique};

/// The result of one camera sub-path: radiance per layer, weighted.
#[derive(Clone, Copy, Debug)]
pub struct CameraWalk {
    /// Contributions by [`Layer`].
    pub layers: [Spectrum; Layer::COUNT],
    /// Of them, light met before the first vertex that scatters: seen directly, by mirrors and through glass. How bright it
    /// is depends on the place on the film alone, not on luck further on.
    pub seen: Spectrum,
}

/// What a technique adds to: the layers of the sample at hand and the counters of the pass.
pub(crate) struct Output<'a, O: ?Sized> {
    pub(crate) layers: &'a mut [Spectrum; Layer::COUNT],
    pub(crate) counters: &'a mut Counters,
    pub(crate) observer: &'a mut O,
}

impl<O: ?Sized> Output<'_, O> {
    /// Adds a weighted contribution; whether it was accepted.
    #[inline]
    pub(crate) fn add<D: Densities>(
        &mut self,
        technique: Technique,
        value: Spectrum,
        weight: &Weight<D>,
    ) -> bool {
        match self.counters.accept(technique, value, weight.value()) {
            Some(contribution) => {
                self.layers[technique.layer() as usize] += contribution;
                true
            }
            None => false,
        }
    }
}
