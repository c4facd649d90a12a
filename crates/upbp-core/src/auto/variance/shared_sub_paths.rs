//! Covariances of neighbouring pixels, which merge photons and beams of the same light sub-paths.

use glam::Vec3;
use upbp_estimators::Technique;

use super::sample_pairs::View;
use crate::auto::pilot_render::Shared;
use crate::auto::pilot_render::recorder::{Sample, TECHNIQUES};

impl View<'_> {
    /// Product of two pixels' merges with one light sub-path under the plan, times its weight in the errors
    /// of blocks.
    ///
    /// A covariance is less by the product of the means over the number of light sub-paths: little where
    /// each of them meets a small part of the picture.
    pub(super) fn in_common(&self, shared: &Shared) -> f64 {
        let [own, other] = &shared.samples;
        let [own, other] = [self.by_technique(own), self.by_technique(other)];
        let mut product = 0.0;
        for first in Technique::ALL {
            for second in Technique::ALL {
                let both = own[first as usize].dot(other[second as usize]);
                if both != 0.0 {
                    product += f64::from(both * self.pairs_relative(first, second));
                }
            }
        }
        shared.weight * product
    }

    fn by_technique(&self, samples: &[Sample]) -> [Vec3; TECHNIQUES] {
        let mut sums = [Vec3::ZERO; TECHNIQUES];
        for sample in samples {
            let weight = self.weight(sample.technique, &sample.shares);
            // Neither without samples nor without a number.
            if weight > 0.0 {
                sums[sample.technique as usize] += sample.value * weight;
            }
        }
        sums
    }
}
