//! Shares of emitters by the place of the receiver: what light arrives there, learnt beforehand
//! (`docs/theory.md`, section 6.6).
//!
//! No bounds tell which lamps stand in the same room as a receiver. So space is divided where receivers are,
//! and each region has shares of the clusters of emitters whose light was seen to arrive. Neighbouring
//! regions blend into each other: probabilities are continuous in the receiver, so that a photon and a query
//! point that are merged agree on them.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::emitter_selection::{EmitterSample, EmitterShares};
use crate::scene::{BoundingSphere, EmitterId};

/// Shares are multiples of one over this.
const SHARES: u16 = 4096;
/// Samples that a region needs to be divided.
const SPLIT_SAMPLES: usize = 128;
/// Most regions.
const MOST_REGIONS: usize = 256;
/// Deepest nesting of regions.
const MOST_DEPTH: u32 = 32;
/// Regions blend over this part of half a region, on both sides of their boundary.
const BLEND: f32 = 0.1;
/// Samples per cluster from which on what was seen counts more than the tree.
const TELLING_SAMPLES: f64 = 2.0;
/// The tree keeps at least this part of the choice.
const LEAST_TREE: f64 = 0.2;

/// Light that a next event brought to a receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ClusterSample {
    pub(crate) receiver: Vec3,
    pub(crate) cluster: u16,
    /// The contribution before weighting.
    pub(crate) light: f64,
    /// All other techniques, relative to this one if the cluster had a probability of one.
    pub(crate) others: f64,
}

/// Shares of clusters of emitters, as a function of the receiver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(crate) struct ReceiverShares {
    /// A binary tree in preorder: the lower side follows its node.
    nodes: Vec<Region>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum Region {
    /// Two sides of a plane across an axis.
    Sides {
        axis: u8,
        at: f32,
        /// Distance from the plane up to which the other side counts, too.
        blend: f32,
        /// Index of the upper side.
        upper: u32,
    },
    /// Clusters with their shares, ascending. What is left goes by the tree.
    Shares(Vec<(u16, u16)>),
}

impl ReceiverShares {
    /// The shares of what was seen within `bounds`, or anywhere if nothing was seen there:
    /// receivers far out in clear air would take up the depth of the tree.
    pub(crate) fn fit(samples: &[ClusterSample], bounds: &BoundingSphere) -> Self {
        let mut samples: Vec<_> =
            samples.iter().filter(|s| s.receiver.is_finite() && s.light > 0.0).copied().collect();
        let is_near = |s: &ClusterSample| s.receiver.distance(bounds.centre) <= bounds.radius;
        if samples.iter().any(is_near) {
            samples.retain(is_near);
        }
        let mut nodes = Vec::new();
        grow(&mut nodes, &mut samples, MOST_REGIONS, 0);
        Self { nodes }
    }

    /// Whether this is a tree of shares of so many clusters.
    pub(crate) fn fits(&self, clusters: usize) -> bool {
        self.nodes.len() < 2 * MOST_REGIONS && self.end(0, 0, clusters) == Some(self.nodes.len())
    }

    /// The index behind a valid subtree.
    fn end(&self, index: usize, depth: u32, clusters: usize) -> Option<usize> {
        match self.nodes.get(index)? {
            Region::Shares(shares) => {
                let sum: u64 = shares.iter().map(|&(_, share)| u64::from(share)).sum();
                let is_valid = shares.is_sorted_by(|a, b| a.0 < b.0)
                    && shares.last().is_none_or(|&(last, _)| (last as usize) < clusters)
                    && sum <= u64::from(SHARES);
                is_valid.then_some(index + 1)
            }
            &Region::Sides { axis, at, blend, upper } => {
                let is_valid = axis < 3 && at.is_finite() && blend.is_finite() && blend > 0.0;
                let lower_end =
                    (is_valid && depth < MOST_DEPTH).then(|| self.end(index + 1, depth + 1, clusters))??;
                (lower_end == upper as usize).then(|| self.end(lower_end, depth + 1, clusters))?
            }
        }
    }

    /// Chooses a cluster, or all of the tree, for `receiver` by a number in `[0, 1)`; returns that with what
    /// is left of the number.
    pub(crate) fn choose(&self, receiver: Vec3, mut u: f64) -> (Option<u16>, f64) {
        let mut index = 0;
        loop {
            match &self.nodes[index] {
                Region::Sides { upper, .. } => {
                    let part = self.lower_part(index, receiver);
                    if u < part {
                        u /= part;
                        index += 1;
                    } else {
                        u = (u - part) / (1.0 - part);
                        index = *upper as usize;
                    }
                }
                Region::Shares(shares) => {
                    let mut left = u * f64::from(SHARES);
                    let mut rest = f64::from(SHARES);
                    for &(cluster, share) in shares {
                        let share = f64::from(share);
                        if left < share {
                            return (Some(cluster), left / share);
                        }
                        left -= share;
                        rest -= share;
                    }
                    return (None, (left / rest).min(1.0 - f64::EPSILON / 2.0));
                }
            }
        }
    }

    /// The probabilities that [`choose`](Self::choose) takes `cluster`, and that it takes all of the tree.
    pub(crate) fn probabilities(&self, receiver: Vec3, cluster: u16) -> [f64; 2] {
        self.probabilities_below(0, receiver, cluster)
    }

    fn probabilities_below(&self, index: usize, receiver: Vec3, cluster: u16) -> [f64; 2] {
        match &self.nodes[index] {
            Region::Sides { upper, .. } => {
                let part = self.lower_part(index, receiver);
                let side = |index, part: f64| {
                    if part > 0.0 {
                        self.probabilities_below(index, receiver, cluster).map(|p| part * p)
                    } else {
                        [0.0; 2]
                    }
                };
                let ([a, b], [c, d]) = (side(index + 1, part), side(*upper as usize, 1.0 - part));
                [a + c, b + d]
            }
            Region::Shares(shares) => {
                let (mut own, mut rest) = (0, SHARES);
                for &(other, share) in shares {
                    rest -= share;
                    own += if other == cluster { share } else { 0 };
                }
                [own, rest].map(|share| f64::from(share) / f64::from(SHARES))
            }
        }
    }

    /// Part of the lower side of a node.
    fn lower_part(&self, index: usize, receiver: Vec3) -> f64 {
        let Region::Sides { axis, at, blend, .. } = self.nodes[index] else { return 1.0 };
        let across = f64::from(receiver[axis as usize]) - f64::from(at);
        (0.5 - 0.5 * across / f64::from(blend)).clamp(0.0, 1.0)
    }
}

/// Adds the tree over `samples`, of at most `regions`.
fn grow(nodes: &mut Vec<Region>, samples: &mut [ClusterSample], regions: usize, depth: u32) {
    let (low, high) = samples.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), sample| {
        (low.min(sample.receiver), high.max(sample.receiver))
    });
    let size = high - low;
    let axis = size.max_position();
    let (at, blend) = (low[axis] + 0.5 * size[axis], 0.5 * BLEND * size[axis]);
    let can_divide = at.is_finite() && blend > 0.0 && blend.is_finite();
    if samples.len() < SPLIT_SAMPLES || regions < 2 || depth >= MOST_DEPTH || !can_divide {
        nodes.push(Region::Shares(shares(samples)));
        return;
    }
    samples.sort_by(|a, b| a.receiver[axis].total_cmp(&b.receiver[axis]));
    let middle = samples.partition_point(|sample| sample.receiver[axis] < at);
    let part = (regions * middle / samples.len()).clamp(1, regions - 1);
    let index = nodes.len();
    nodes.push(Region::Sides { axis: axis as u8, at, blend, upper: 0 });
    let (lower, upper) = samples.split_at_mut(middle);
    grow(nodes, lower, part, depth + 1);
    let end = nodes.len() as u32;
    if let Region::Sides { upper, .. } = &mut nodes[index] {
        *upper = end;
    }
    grow(nodes, upper, regions - part, depth + 1);
}

/// Shares of the clusters that samples of one region saw.
fn shares(samples: &[ClusterSample]) -> Vec<(u16, u16)> {
    let mut clusters: Vec<u16> = samples.iter().map(|sample| sample.cluster).collect();
    clusters.sort_unstable();
    clusters.dedup();
    let count = clusters.len();
    if count == 0 {
        return Vec::new();
    }
    let place = |cluster: u16| EmitterId(clusters.partition_point(|&other| other < cluster) as u32);
    let seen: Vec<_> = samples
        .iter()
        .map(|s| EmitterSample { emitter: place(s.cluster), light: s.light, others: s.others })
        .collect();
    let EmitterShares { light, .. } = EmitterShares::of(vec![1.0 / count as f64; count], &seen);
    let sum: f64 = light.iter().sum();
    if !(sum > 0.0 && sum.is_finite()) {
        return Vec::new();
    }
    let evidence = samples.len() as f64 / TELLING_SAMPLES;
    let trust = (1.0 - LEAST_TREE) * evidence / (evidence + count as f64);
    let share = |light: f64| (trust * light / sum * f64::from(SHARES)) as u16;
    clusters.iter().zip(light).map(|(&cluster, light)| (cluster, share(light))).filter(|s| s.1 > 0).collect()
}

#[cfg(test)]
mod tests {
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::{Rng as _, SeedableRng as _};

    use super::*;

    #[test]
    fn what_is_no_tree_of_shares_does_not_fit() {
        let leaf = |shares: &[(u16, u16)]| Region::Shares(shares.to_vec());
        let sides = |upper, blend| Region::Sides { axis: 0, at: 0.0, blend, upper };
        let fits = |nodes: &[Region]| ReceiverShares { nodes: nodes.to_vec() }.fits(3);
        assert!(fits(&[leaf(&[])]));
        assert!(fits(&[sides(2, 1.0), leaf(&[(0, 4000), (2, 96)]), leaf(&[])]));
        for wrong in [
            &[][..],
            &[leaf(&[(3, 1)])],
            &[leaf(&[(1, 1), (0, 1)])],
            &[leaf(&[(0, 4000), (1, 97)])],
            &[leaf(&[]), leaf(&[])],
            &[sides(1, 1.0), leaf(&[]), leaf(&[])],
            &[sides(0, 1.0)],
            &[sides(2, 0.0), leaf(&[]), leaf(&[])],
            &[sides(2, f32::NAN), leaf(&[]), leaf(&[])],
            &[sides(2, 1.0), leaf(&[])],
        ] {
            assert!(!fits(wrong), "{wrong:?}");
        }
    }

    #[test]
    fn regions_are_limited_whatever_the_samples() {
        let sample = |x: f32| ClusterSample { receiver: Vec3::splat(x), cluster: 0, light: 1.0, others: 0.0 };
        for samples in [
            (0..100_000).map(|i| sample(i as f32)).collect::<Vec<_>>(),
            // Each half has almost all of them.
            (0..100_000).map(|i| sample(0.5_f32.powi(i / 800))).collect(),
            vec![sample(1.0); 1000],
        ] {
            let everywhere = BoundingSphere { centre: Vec3::ZERO, radius: f32::INFINITY };
            let shares = ReceiverShares::fit(&samples, &everywhere);
            assert!(shares.fits(1));
            assert!(shares.nodes.len() < 2 * MOST_REGIONS, "{}", shares.nodes.len());
        }
    }

    #[test]
    fn receivers_far_out_do_not_take_the_regions_of_the_scene() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut unit = || (random.next_u64() >> 40) as f32 / (1_u64 << 24) as f32;
        let mut samples = |least: f32, mean: f32| -> Vec<_> {
            let sample = |_| {
                let direction = (Vec3::new(unit(), unit(), unit()) - 0.5).normalize_or(Vec3::X);
                let receiver = (least - mean * (1.0 - unit()).ln()) * direction;
                ClusterSample { receiver, cluster: (unit() * 8.0) as u16, light: 1.0, others: 0.0 }
            };
            (0..20_000).map(sample).collect()
        };
        let (near, far) = (samples(0.0, 0.5), samples(10.0, 1e5));
        let bounds = |radius| BoundingSphere { centre: Vec3::ZERO, radius };
        let all = [&far[..], &near].concat();
        let shares = ReceiverShares::fit(&near, &bounds(10.0));
        assert!(shares.nodes.len() > 100, "{}", shares.nodes.len());
        assert_eq!(ReceiverShares::fit(&all, &bounds(10.0)), shares);
        // They count where there are no others.
        let shares = ReceiverShares::fit(&far, &bounds(f32::INFINITY));
        assert!(shares.nodes.len() > 100, "{}", shares.nodes.len());
        assert_eq!(ReceiverShares::fit(&far, &bounds(10.0)), shares);
    }
}
