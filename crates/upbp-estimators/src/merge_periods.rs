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

/// The rank of a pixel, below `period`. Pixels of each rank are spread evenly over the picture and over every
/// coarser grid of pixels, which is all that there is of an iteration that had to stop early; for a period of
/// 8 they are more than 2 pixels apart.
pub(crate) fn rank([x, y]: [u32; 2], period: u32) -> u32 {
    /// 1/ρ and 1/ρ² in units of 2⁻³², with `ρ³ = ρ + 1`: a lattice that no grid is in step with.
    ///
    /// Source: M. Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018.
    const STEPS: [u32; 2] = [3_242_174_889, 2_447_445_414];
    let place = x.wrapping_mul(STEPS[0]).wrapping_add(y.wrapping_mul(STEPS[1]));
    ((u64::from(place) * u64::from(period)) >> 32) as u32
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
    fn ranks_are_spread_over_the_picture_and_over_coarser_grids() {
        for (period, spacing) in
            [1_u32, 2, 3, 8, 13, 16].into_iter().flat_map(|p| [1, 2, 4, 8, 16].map(|s| (p, s)))
        {
            let mut counts = vec![0_u32; period as usize];
            for (y, x) in (0..40).flat_map(|y| (0..60).map(move |x| (y, x))) {
                counts[rank([7 + spacing * x, 1000 + spacing * y], period) as usize] += 1;
            }
            let mean = 2400 / period;
            assert!(
                counts.iter().all(|&count| count.abs_diff(mean) <= mean / 20 + 2),
                "{period}, {spacing}: {counts:?}"
            );
        }
    }

    #[test]
    fn pixels_of_one_rank_are_apart() {
        let pixels: Vec<[u32; 2]> =
            (0..64).flat_map(|y| (0..64).map(move |x| [x, y])).filter(|&pixel| rank(pixel, 8) == 0).collect();
        for (i, a) in pixels.iter().enumerate() {
            let distance =
                |b: &[u32; 2]| f64::from(a[0].abs_diff(b[0])).hypot(f64::from(a[1].abs_diff(b[1])));
            assert!(pixels[..i].iter().map(distance).all(|distance| distance > 2.0));
        }
    }
}
