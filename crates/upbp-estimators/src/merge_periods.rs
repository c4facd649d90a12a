//! Periods of photon queries: in each iteration one of `m` pixels makes them, and pixels take turns
//! (`docs/theory.md`, section 6.3).
//!
//! Where photon queries bring little, a camera sub-path makes them with probability `1/m`, what they find
//! counts `m` times, and in the weights of all camera sub-paths their number of samples is `n/m`. So the
//! weights of a path sum to one for any `m`, and a technique that hardly pays but may be the only one for
//! some paths stays, at a part of the cost of its queries. Turns are spread evenly over the picture: any part
//! of it has its share of the queries in every iteration, and pixels of a run of m query different
//! photons.

use std::num::NonZeroU32;

use crate::random::{Stream, StreamKind, half, mix};
use crate::technique::{PerMerge, Technique};

/// Periods of the photon queries of each merge: a pixel makes them in one iteration of each period.
pub type MergePeriods = PerMerge<NonZeroU32>;

impl MergePeriods {
    /// Periods of one: all camera sub-paths make all photon queries.
    pub const ONE: Self = {
        let one = NonZeroU32::MIN;
        Self { surf: one, pp3d: one, pb2d: one, bp2d: one, bb1d: one }
    };

    /// The period of the photon queries of a technique; 1 if it has none.
    #[must_use]
    pub fn period(&self, technique: Technique) -> u32 {
        self.get(technique).map_or(1, |period| period.get())
    }

    /// The turn of each technique in an iteration: the [`rank`] of the pixels that make its queries.
    ///
    /// It is at random, and all turns take place once in any `m` iterations of a [half](crate::half) from a
    /// multiple of `m` on.
    pub(crate) fn turns(&self, seed: u64, iteration: u64) -> PerMerge<u32> {
        let (half, iteration) = half(iteration);
        PerMerge::from_fn(|technique| {
            let period = self.period(technique);
            let block = iteration / u64::from(period);
            let index = (half as u64) << 32 | technique as u64;
            let first = Stream::new(seed, block, StreamKind::MergePeriods, index).index(period as usize);
            ((iteration + first as u64) % u64::from(period)) as u32
        })
    }
}

/// The rank of a pixel, below `period`.
///
/// Along a Z-order curve each run of as many pixels has every rank once, in an order of its own. So any part
/// of the picture has its share of each, and pixels of a rank, which query the same photons, are no grid that
/// one sees.
pub(crate) fn rank([x, y]: [u32; 2], period: u32) -> u32 {
    let along = spread(x) | spread(y) << 1;
    let (run, place) = (along / u64::from(period), along % u64::from(period));
    permuted(place as u32, period, mix(run))
}

/// The bits of a number at every other place, from the lowest.
const fn spread(number: u32) -> u64 {
    let mut bits = number as u64;
    bits = (bits | bits << 16) & 0x0000_ffff_0000_ffff;
    bits = (bits | bits << 8) & 0x00ff_00ff_00ff_00ff;
    bits = (bits | bits << 4) & 0x0f0f_0f0f_0f0f_0f0f;
    bits = (bits | bits << 2) & 0x3333_3333_3333_3333;
    (bits | bits << 1) & 0x5555_5555_5555_5555
}

/// The place of `place`, both below `count`, in an order by `key`.
///
/// All steps of a round can be undone among the numbers below a power of two. Where all rounds lead beyond
/// `count`, others follow until they lead back: a cycle of the permutation without the numbers that are too
/// large.
fn permuted(mut place: u32, count: u32, key: u64) -> u32 {
    if count < 2 {
        return 0;
    }
    let bits = u32::BITS - (count - 1).leading_zeros();
    let mask = u32::MAX >> (u32::BITS - bits);
    loop {
        for round in key.to_le_bytes().as_chunks::<2>().0 {
            let [factor, more] = round.map(u32::from);
            place = place.wrapping_mul(factor << 1 | 1).wrapping_add(more) & mask;
            place ^= place >> bits.div_ceil(2);
        }
        if place < count {
            return place;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn periods() -> MergePeriods {
        MergePeriods::from_fn(|technique| match technique {
            Technique::Surf => NonZeroU32::new(8).unwrap(),
            Technique::Bb1d => NonZeroU32::new(3).unwrap(),
            _ => NonZeroU32::MIN,
        })
    }

    #[test]
    fn every_turn_comes_once_in_a_period() {
        let mut first = [0_u32; 8];
        for block in 0..4000_u64 {
            for (half, period) in [(0, 8), (1, 3)] {
                let turn = |i| {
                    let turns = periods().turns(7, 2 * (period * block + i) + half);
                    assert_eq!((turns.pp3d, turns.pb2d, turns.bp2d), (0, 0, 0));
                    if half == 0 { turns.surf } else { turns.bb1d }
                };
                let mut turns: Vec<_> = (0..period).map(turn).collect();
                if half == 0 {
                    first[turns[0] as usize] += 1;
                }
                turns.sort_unstable();
                assert!(turns.into_iter().eq(0..period as u32));
            }
        }
        // 500 each, with a standard deviation of 21.
        assert!(first.iter().all(|&count| count.abs_diff(500) < 84), "{first:?}");
    }

    #[test]
    fn each_run_has_every_rank_once_in_any_order() {
        for period in [1_u32, 2, 3, 5, 8, 13, 16] {
            let runs = 4000;
            let mut counts = vec![vec![0_u32; period as usize]; period as usize];
            for run in 0..runs {
                let mut ranks: Vec<_> = (0..period).map(|place| permuted(place, period, mix(run))).collect();
                for (place, rank) in ranks.iter().enumerate() {
                    counts[place][*rank as usize] += 1;
                }
                ranks.sort_unstable();
                assert!(ranks.into_iter().eq(0..period));
            }
            let mean = runs as f64 / f64::from(period);
            for count in counts.into_iter().flatten() {
                let deviation = (f64::from(count) - mean).abs() / mean.sqrt();
                assert!(deviation < 4.5, "{period}: {count}, {mean}");
            }
        }
    }

    /// The first of a pair in a run says nothing of the second but that it is another.
    #[test]
    fn orders_are_of_many_kinds() {
        let mut pairs = [[0_u32; 8]; 8];
        let runs = 20_000;
        for run in 0..runs {
            let [a, b] = [0, 1].map(|place| permuted(place, 8, mix(run)));
            pairs[a as usize][b as usize] += 1;
        }
        let mean = f64::from(runs as u32) / 56.0;
        for (a, b) in (0..8).flat_map(|a| (0..8).map(move |b| (a, b))).filter(|(a, b)| a != b) {
            let deviation = (f64::from(pairs[a][b]) - mean).abs() / mean.sqrt();
            assert!(deviation < 5.0, "{a}, {b}: {} of {mean}", pairs[a][b]);
        }
    }

    #[test]
    fn blocks_have_as_many_pixels_of_each_rank() {
        for period in [1, 2, 3, 8, 13, 16] {
            for side in [4, 8, 16] {
                let mut counts = vec![0_u32; period as usize];
                for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
                    counts[rank([7 * side + x, 63 * side + y], period) as usize] += 1;
                }
                let mean = side * side / period;
                assert!(counts.iter().all(|count| count.abs_diff(mean) <= 2), "{period}: {counts:?}");
            }
        }
    }

    /// An iteration that had to stop early has a coarse grid of pixels.
    #[test]
    fn coarse_grids_have_pixels_of_each_rank() {
        for (period, spacing) in [2_u32, 3, 8, 13, 16].into_iter().flat_map(|p| [2, 4, 8, 16].map(|s| (p, s)))
        {
            let mut counts = vec![0_u32; period as usize];
            for (y, x) in (0..40).flat_map(|y| (0..60).map(move |x| (y, x))) {
                counts[rank([7 + spacing * x, 1000 + spacing * y], period) as usize] += 1;
            }
            let mean = 2400.0 / f64::from(period);
            let deviation = |count: &u32| (f64::from(*count) - mean).abs() / mean.sqrt();
            assert!(counts.iter().all(|count| deviation(count) < 4.0), "{period}, {spacing}: {counts:?}");
        }
    }
}
