//! Covariances of neighbouring pixels, to which the same light sub-paths bring merges and splats.

use glam::Vec3;

use super::sample_pairs::View;
use crate::auto::pilot_render::Shared;
use crate::auto::pilot_render::recorder::Sample;

impl View<'_> {
    /// Product of what one light sub-path brings to two pixels under the plan, times its weight in the errors
    /// of blocks.
    ///
    /// A covariance is less by the product of the means over the number of light sub-paths: little where
    /// each of them meets a small part of the picture.
    pub(super) fn in_common(&self, shared: &Shared) -> f64 {
        let [own, other] = shared.samples.each_ref().map(|samples| self.by_class(samples));
        let with_points = own[0].dot(other[0] + other[1]) + own[1].dot(other[0]);
        let [points, beams] = self.pairs_relative();
        shared.weight * f64::from(points * with_points + beams * own[1].dot(other[1]))
    }

    /// Sums of samples by points and by beams.
    fn by_class(&self, samples: &[Sample]) -> [Vec3; 2] {
        let mut sums = [Vec3::ZERO; 2];
        for sample in samples {
            let weight = self.weight(sample.technique, &sample.shares);
            // Neither without samples nor without a number.
            if weight > 0.0 {
                sums[usize::from(sample.technique.uses_beams())] += sample.value * weight;
            }
        }
        sums
    }
}
