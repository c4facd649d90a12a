//! Periods of photon queries: in each iteration one of `m` pixels makes them, and pixels take turns.
//!
//! Where photon queries bring little, a camera sub-path makes them with probability `1/m`, what they find
//! counts `m` times, and in the weights of all camera sub-paths their number of samples is `n/m`. So the
//! weights of a path sum to one for any `m`, and a technique that hardly pays but may be the only one for
//! some paths stays, at a part of the cost of its queries. Turns are spread evenly over the picture: any part
//! of it has its share of the queries in every iteration, and neighbours do not query the same photons.

use std::num::NonZeroU32;

use crate::random::{Stream, StreamKind, half};
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

/// The rank of a pixel among `period` ones, of which each row has all in turn. Pixels of equal rank lie on a
/// lattice and far apart: for a period of 8, at least 2.8 pixels.
pub(crate) fn rank([x, y]: [u32; 2], period: u32) -> u32 {
    /// The golden section of a circle, so that rows are not in step with those next to them.
    const STEP: f64 = 0.381_966;
    let step = (STEP * f64::from(period)).round() as u64;
    ((u64::from(x) + step * u64::from(y)) % u64::from(period)) as u32
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
    fn every_square_has_all_ranks_alike() {
        for period in [1_u32, 2, 3, 4, 5, 8, 13, 16] {
            let mut counts = vec![0_u32; period as usize];
            for (y, x) in (0..period).flat_map(|y| (0..period).map(move |x| (y, x))) {
                counts[rank([u32::MAX - x, 1000 + y], period) as usize] += 1;
            }
            assert!(counts.iter().all(|&count| count == period), "{period}: {counts:?}");
        }
        let of_rank_zero =
            (0..16_u32).flat_map(|y| (0..16_u32).map(move |x| [x, y])).filter(|&pixel| rank(pixel, 8) == 0);
        let pixels: Vec<[f64; 2]> = of_rank_zero.map(|pixel| pixel.map(f64::from)).collect();
        for (i, a) in pixels.iter().enumerate() {
            assert!(pixels[..i].iter().all(|b| (a[0] - b[0]).hypot(a[1] - b[1]) >= 2.8), "{pixels:?}");
        }
    }
}
