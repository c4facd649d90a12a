//! Counts of what the walks did and of what they had to drop.

use serde::{Deserialize, Serialize};
use upbp_media::Spectrum;

use crate::technique::{PerTechnique, Technique};

/// Counters of one pass or of a whole render; they add up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Counters {
    /// Edges of light sub-paths.
    pub light_edges: u64,
    /// Edges of camera sub-paths.
    pub camera_edges: u64,
    /// Segments tested for visibility.
    pub shadow_rays: u64,
    /// Light sub-path vertices stored.
    pub light_vertices: u64,
    /// Photon beams stored.
    pub photon_beams: u64,
    /// Contributions of each technique.
    pub contributions: PerTechnique<u64>,
    /// Contributions, throughputs of sub-paths, and values of an iteration's pixels, that were not
    /// finite or negative, and were dropped.
    pub dropped: u64,
    /// Camera sub-paths that were ended by the limit of the path length at a vertex that scatters.
    pub cut_walks: u64,
    /// Walks that were ended since what they met cannot be: they escaped while still inside a body (geometry
    /// that is not closed), or a host told of hits that are not ahead or not finite, or of boundaries without
    /// an end.
    pub lost_walks: u64,
    /// Boundaries that contradict the bodies that a walk thinks to be in: a body entered twice or left
    /// without being inside. At a start within rounding of a boundary, or on one, the bodies are corrected;
    /// where geometry is not closed, the boundary is ignored.
    pub boundary_conflicts: u64,
}

impl Counters {
    /// Adds the counts of another pass. What comes from files may be of any size: sums end at the largest
    /// number.
    pub fn add(&mut self, other: &Self) {
        let sum = |a: &mut u64, b: u64| *a = a.saturating_add(b);
        sum(&mut self.light_edges, other.light_edges);
        sum(&mut self.camera_edges, other.camera_edges);
        sum(&mut self.shadow_rays, other.shadow_rays);
        sum(&mut self.light_vertices, other.light_vertices);
        sum(&mut self.photon_beams, other.photon_beams);
        for (own, count) in self.contributions.iter_mut().zip(other.contributions) {
            sum(own, count);
        }
        sum(&mut self.dropped, other.dropped);
        sum(&mut self.cut_walks, other.cut_walks);
        sum(&mut self.lost_walks, other.lost_walks);
        sum(&mut self.boundary_conflicts, other.boundary_conflicts);
    }

    /// Contributions of one technique.
    #[must_use]
    pub const fn contributions_of(&self, technique: Technique) -> u64 {
        self.contributions[technique as usize]
    }

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

    /// Whether the throughput of a sub-path is out of range, which is counted as dropped: what it would have
    /// contributed is missing.
    #[inline]
    pub(crate) fn overflows(&mut self, throughput: Spectrum) -> bool {
        let overflows = !throughput.is_finite();
        self.dropped += u64::from(overflows);
        overflows
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_counts_add_up_to_the_largest_number() {
        // Every field, each by a factor of its own.
        let counters = |n: u64| Counters {
            light_edges: n,
            camera_edges: 2 * n,
            shadow_rays: 3 * n,
            light_vertices: 4 * n,
            photon_beams: 5 * n,
            contributions: [6, 7, 8, 9, 10, 11, 12, 13, 14].map(|factor| factor * n),
            dropped: 15 * n,
            cut_walks: 16 * n,
            lost_walks: 17 * n,
            boundary_conflicts: 18 * n,
        };
        let mut sum = counters(1);
        sum.add(&counters(10));
        assert_eq!(sum, counters(11));
        sum.lost_walks = u64::MAX;
        sum.add(&counters(1));
        assert_eq!(sum, Counters { lost_walks: u64::MAX, ..counters(12) });
    }
}
