//! Radiance that one camera sub-path brings to its pixel.

use glam::Vec2;
use upbp_media::Spectrum;

use crate::counters::Counters;
use crate::features::Features;
use crate::observer::{ObservedSample, Observer};
use crate::technique::Layer;

/// The result of one camera sub-path: radiance per layer, weighted.
#[derive(Clone, Copy, Debug)]
pub struct CameraWalk {
    /// Contributions by [`Layer`].
    pub layers: [Spectrum; Layer::COUNT],
    /// The part in `layers` that was met before the first vertex that scatters: seen directly, by mirrors and
    /// through glass. How bright it is depends on the place on the film alone, not on luck further on.
    pub seen: Spectrum,
    /// Features of what is seen first, if the plan [asks for them](crate::IterationPlan::features).
    pub features: Features,
}

/// Receiver of a camera sub-path's samples: layers, counters of the pass, and an observer.
pub(crate) struct Output<'a, O: ?Sized> {
    /// Place on the film, in pixels.
    pub(crate) film: Vec2,
    pub(crate) layers: &'a mut [Spectrum; Layer::COUNT],
    pub(crate) counters: &'a mut Counters,
    pub(crate) observer: &'a mut O,
}

impl<O: ?Sized> Output<'_, O> {
    /// Adds a sample to the layer of its technique, if it is a radiance, and shows it to the observer.
    #[inline]
    pub(crate) fn record<B>(&mut self, sample: &ObservedSample<B, O::Densities>)
    where
        O: Observer<B>,
    {
        let ObservedSample { technique, value, ref weight, .. } = *sample;
        if let Some(contribution) = self.counters.accept(technique, value, weight.value()) {
            self.layers[technique.layer() as usize] += contribution;
            self.observer.sample(sample);
        }
    }
}
