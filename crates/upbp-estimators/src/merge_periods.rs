//! Periods of photon queries, in iterations.
//!
//! Photon queries that bring little need not be made in every iteration: they are made in one of `m`, their
//! contributions count `m` times, and in the weights of all iterations their number of samples is `n/m`. So
//! the weights of a path sum to one for any `m`, and a technique that hardly pays but may be the only one for
//! some paths stays, at a part of the cost of its queries and of what they need.

use std::num::NonZeroU32;

use crate::random::{Stream, StreamKind, half};
use crate::technique::{PerMerge, Technique, TechniqueSet};

/// Periods of the photon queries of each merge, in iterations: one iteration of each period makes them.
pub type MergePeriods = PerMerge<NonZeroU32>;

impl MergePeriods {
    /// Periods of one: every iteration makes all photon queries.
    pub const ONE: Self = {
        let one = NonZeroU32::MIN;
        Self { surf: one, pp3d: one, pb2d: one, bp2d: one, bb1d: one }
    };

    /// The period of the photon queries of a technique; 1 if it has none.
    #[must_use]
    pub fn period(&self, technique: Technique) -> u32 {
        self.get(technique).map_or(1, |period| period.get())
    }

    /// The techniques that run in an iteration: each in one of every `m` iterations of a [half](crate::half)
    /// from a multiple of `m` on, whichever it happens to be. So every iteration has it with probability
    /// `1/m`, and `m` of a half have it once.
    #[must_use]
    pub fn active(&self, seed: u64, iteration: u64) -> TechniqueSet {
        let (half, iteration) = half(iteration);
        let active = |technique: &Technique| {
            let period = u64::from(self.period(*technique));
            let turn = || {
                let block = iteration / period;
                let index = (half as u64) << 32 | *technique as u64;
                Stream::new(seed, block, StreamKind::MergePeriods, index).index(period as usize)
            };
            period == 1 || iteration % period == turn() as u64
        };
        Technique::ALL.into_iter().filter(active).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_block_of_iterations_has_one_turn() {
        let periods = MergePeriods::from_fn(|technique| match technique {
            Technique::Surf => NonZeroU32::new(8).unwrap(),
            Technique::Bb1d => NonZeroU32::new(3).unwrap(),
            _ => NonZeroU32::MIN,
        });
        let mut turns = [0_u32; 8];
        for block in 0..4000_u64 {
            let of_block: Vec<_> =
                (0..8).filter(|i| periods.active(7, 2 * (8 * block + i)).has(Technique::Surf)).collect();
            assert_eq!(of_block.len(), 1);
            turns[of_block[0] as usize] += 1;
            let beams =
                (0..3).filter(|i| periods.active(7, 2 * (3 * block + i) + 1).has(Technique::Bb1d)).count();
            assert_eq!(beams, 1);
            assert!(
                periods.active(7, block).has(Technique::Pb2d) && periods.active(7, block).has(Technique::Nee)
            );
        }
        // 500 each, with a standard deviation of 21.
        assert!(turns.iter().all(|&turns| turns.abs_diff(500) < 84), "{turns:?}");
    }
}
