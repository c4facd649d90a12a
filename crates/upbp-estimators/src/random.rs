//! Random numbers as streams that are addressed, not shared.
//!
//! Every sub-path draws from its own stream, a function of (seed, iteration, kind of path, index): results
//! then depend neither on the number of threads nor on who renders which iteration, and the walks of both
//! sides are independent (a shared stream correlates them, `docs/theory.md`, section 10, row 6).
//!
//! The first decisions of a sub-path are points of Owen-scrambled (0, 2)-sequences, padded: every decision
//! has an order and a scramble of its own (`docs/theory.md`, section 6.7). The light sub-paths of an
//! iteration are stratified among each other, the camera sub-paths of a pixel over iterations; each sub-path
//! for itself is uniform and independent of all others, so nothing is biased. Later decisions, whose strata
//! no longer mean anything, come from xoshiro256++.
//!
//! Source: B. Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020. Oracle:
//! `tests::strata_hold_one_point_each`.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// Draws that are stratified: about four vertices of a path.
const STRATIFIED_DRAWS: u32 = 24;
/// Draws that camera sub-paths of the pilot with one index have in common: the place on the film, that on the
/// lens, the first distance in a medium, and the next event there, an emitter and a point on it. Without a
/// medium, what is drawn next.
const COMMON_DRAWS: u32 = 5;

/// The purpose of a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StreamKind {
    /// Light sub-paths.
    Light,
    /// Camera sub-paths. Those of even and of odd iterations are stratified apart, so that the two halves of
    /// a render are independent of each other and their difference tells the error.
    Camera,
    /// Light sub-paths of the pilot, which sets radii and counts before the first iteration.
    PilotLight,
    /// Camera sub-paths of the pilot. Those with the same index, of different iterations, begin alike and are
    /// independent after a few draws: what they differ in is what stratification leaves of the variance of a
    /// pixel, since it takes away what their common decisions make.
    PilotCamera,
    /// The turns in which pixels make photon queries.
    MergePeriods,
}

/// A stream of uniform random numbers.
#[derive(Clone, Debug)]
pub struct Stream {
    /// Number of the point in the sequences that this stream shares with others, the lowest bit first.
    point: u32,
    /// Key of all streams that are stratified among each other.
    family: u64,
    draws: u32,
    /// Draws from the sequences.
    from_sequences: u32,
    rest: Xoshiro256PlusPlus,
}

impl Stream {
    /// The stream of one sub-path.
    #[must_use]
    pub fn new(seed: u64, iteration: u64, kind: StreamKind, index: u64) -> Self {
        let common =
            mix(mix(seed ^ 0x9e37_79b9_7f4a_7c15) ^ (kind as u64 + 1).wrapping_mul(0x8cb9_2ba7_2f3d_8dd7));
        let of_iteration = iteration.wrapping_mul(0xd1b5_4a32_d192_ed03);
        let of_index = index.wrapping_mul(0xaef1_7502_108e_f2d9);
        // Light sub-paths share an iteration, camera sub-paths a pixel. Beyond 2³² the sequences repeat their
        // points, which costs stratification only.
        let (point, family, from_sequences) = match kind {
            StreamKind::Light | StreamKind::PilotLight => {
                (index as u32, mix(common ^ of_iteration), STRATIFIED_DRAWS)
            }
            StreamKind::Camera => {
                let (half, point) = half(iteration);
                let of_half = (half as u64).wrapping_mul(0x2545_f491_4f6c_dd1d);
                (point as u32, mix(common ^ of_index) ^ of_half, STRATIFIED_DRAWS)
            }
            StreamKind::PilotCamera => (0, mix(common ^ of_index), COMMON_DRAWS),
            StreamKind::MergePeriods => (0, 0, 0),
        };
        // The finaliser of SplitMix64 between the words: streams of neighbouring addresses have nothing in
        // common.
        let rest = Xoshiro256PlusPlus::seed_from_u64(mix(mix(common ^ of_iteration) ^ of_index));
        Self { point: point.reverse_bits(), family, draws: 0, from_sequences, rest }
    }

    /// The next decision: numbers that may not be needed.
    #[inline]
    pub fn decide(&mut self) -> Decision {
        self.draws += 1;
        if self.draws <= self.from_sequences {
            let key = self.family.wrapping_add(u64::from(self.draws).wrapping_mul(0x9e37_79b9_7f4a_7c15));
            Decision::InSequences { point: self.point, key }
        } else {
            Decision::Alone(self.rest.next_u64())
        }
    }

    /// Uniform in `[0, 1)`, a multiple of 2⁻²⁴.
    #[inline]
    pub fn uniform(&mut self) -> f32 {
        self.decide().uniform()
    }

    /// Two uniform numbers in `[0, 1)`, stratified together.
    #[inline]
    pub fn pair(&mut self) -> [f32; 2] {
        self.decide().pair()
    }

    /// Uniform in `0..count`; 0 if `count` is 0.
    pub fn index(&mut self, count: usize) -> usize {
        // Multiply and shift: the bias is below count / 2⁶⁴.
        ((u128::from(self.rest.next_u64()) * count as u128) >> 64) as usize
    }

    /// One of the two whole numbers next to `mean`, which is the mean of what is drawn.
    #[inline]
    pub fn round(&mut self, mean: f32) -> u32 {
        let whole = mean as u32;
        let part = mean - whole as f32;
        // Not a random number where there is nothing to decide.
        if part > 0.0 { whole + u32::from(self.uniform() < part) } else { whole }
    }
}

/// Random numbers of a [`Stream`] that are computed only when they are asked for: often nothing depends on
/// them, as where there is but one light to choose.
#[derive(Clone, Copy, Debug)]
pub enum Decision {
    /// A point of the sequences.
    InSequences {
        /// The number of the point, the lowest bit first.
        point: u32,
        /// Key of the order and the scrambles, before it is mixed.
        key: u64,
    },
    /// Random bits beyond the sequences.
    Alone(u64),
}

impl Decision {
    /// Uniform in `[0, 1)`, a multiple of 2⁻²⁴: the first of the [pair](Self::pair).
    #[inline]
    #[must_use]
    pub fn uniform(self) -> f32 {
        match self {
            Self::InSequences { point, key } => {
                let key = mix(key);
                to_unit(scramble(order(point, key), (key >> 32) as u32).reverse_bits())
            }
            Self::Alone(bits) => to_unit((bits >> 32) as u32),
        }
    }

    /// Two uniform numbers in `[0, 1)`, stratified together.
    #[must_use]
    pub fn pair(self) -> [f32; 2] {
        let bits = match self {
            Self::InSequences { point, key } => {
                let key = mix(key);
                let point = order(point, key);
                let first = scramble(point, (key >> 32) as u32);
                let other = key.wrapping_mul(0xd1b5_4a32_d192_ed03) >> 32;
                let second = scramble(sobol(point), other as u32);
                // Both at once.
                (u64::from(second) << 32 | u64::from(first)).reverse_bits()
            }
            Self::Alone(bits) => bits,
        };
        [to_unit((bits >> 32) as u32), to_unit(bits as u32)]
    }
}

/// The half of a render that an iteration belongs to, 0 or 1, and its number there. Halves have no random
/// decision in common.
#[must_use]
pub const fn half(iteration: u64) -> (usize, u64) {
    ((iteration % 2) as usize, iteration / 2)
}

#[inline]
fn to_unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// The number of the point that takes the place of `point`, whose lowest bit comes first: a permutation that
/// keeps aligned blocks of 2ᵏ together.
#[inline]
fn order(point: u32, key: u64) -> u32 {
    scramble(point, key as u32).reverse_bits()
}

/// Owen scrambling: every bit is flipped or not by a hash of the bits below it. So numbers come, and leave,
/// with the bit that counts most at the bottom.
///
/// The hash is that of Laine and Karras, with constants after Vegdahl.
#[inline]
fn scramble(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// The second dimension of the Sobol sequence, the bit that counts most at the bottom; the first is the
/// number of the point itself. Its matrix is Pascal's triangle modulo two, a Kronecker power of 2 × 2
/// matrices: one butterfly per bit of the bit number.
#[inline]
fn sobol(point: u32) -> u32 {
    let mut x = point;
    x ^= x >> 16;
    x ^= (x >> 8) & 0x00ff_00ff;
    x ^= (x >> 4) & 0x0f0f_0f0f;
    x ^= (x >> 2) & 0x3333_3333;
    x ^ ((x >> 1) & 0x5555_5555)
}

#[inline]
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The direction numbers of the second Sobol dimension, one after the other.
    fn sobol_by_definition(mut point: u32) -> u32 {
        let (mut direction, mut result) = (1_u32 << 31, 0);
        while point != 0 {
            if point & 1 == 1 {
                result ^= direction;
            }
            point >>= 1;
            direction ^= direction >> 1;
        }
        result
    }

    #[test]
    fn butterflies_are_the_direction_numbers() {
        for i in 0..32 {
            assert_eq!(sobol(1 << i).reverse_bits(), sobol_by_definition(1 << i), "bit {i}");
        }
        assert_eq!(sobol(0xdead_beef).reverse_bits(), sobol_by_definition(0xdead_beef));
    }

    #[test]
    fn strata_hold_one_point_each() {
        // 64 streams of a family: every elementary interval of area 1/64 has one point, at each decision.
        for (kind, make) in [
            (StreamKind::Light, (|i| Stream::new(5, 3, StreamKind::Light, 192 + i)) as fn(u64) -> Stream),
            (StreamKind::Camera, |i| Stream::new(5, 2 * (192 + i), StreamKind::Camera, 17)),
            (StreamKind::Camera, |i| Stream::new(5, 2 * (192 + i) + 1, StreamKind::Camera, 17)),
        ] {
            let mut streams: Vec<_> = (0..64).map(make).collect();
            for _ in 0..STRATIFIED_DRAWS / 2 {
                let pairs: Vec<_> = streams.iter_mut().map(Stream::pair).collect();
                for (width, height) in [(1, 64), (2, 32), (4, 16), (8, 8), (16, 4), (32, 2), (64, 1)] {
                    let mut cells: Vec<_> = pairs
                        .iter()
                        .map(|[x, y]| (x * width as f32) as usize + width * (y * height as f32) as usize)
                        .collect();
                    cells.sort_unstable();
                    assert_eq!(cells, (0..64).collect::<Vec<_>>(), "{kind:?}, {width} x {height}");
                }
                let mut cells: Vec<_> = streams.iter_mut().map(|s| (s.uniform() * 64.0) as usize).collect();
                cells.sort_unstable();
                assert_eq!(cells, (0..64).collect::<Vec<_>>(), "{kind:?}");
            }
        }
    }

    /// Correlation of two draws over many streams, in standard deviations.
    fn correlation(draws: impl Fn(u64) -> (f32, f32)) -> f64 {
        let n = 100_000_u64;
        let sum: f64 = (0..n)
            .map(|i| {
                let (a, b) = draws(i);
                (f64::from(a) - 0.5) * (f64::from(b) - 0.5) * 12.0
            })
            .sum();
        sum / (n as f64).sqrt()
    }

    #[test]
    fn families_and_decisions_are_uncorrelated() {
        let first = |mut stream: Stream| stream.uniform();
        let light = |seed, iteration, index| Stream::new(seed, iteration, StreamKind::Light, index);
        let camera = |seed, iteration, index| Stream::new(seed, iteration, StreamKind::Camera, index);
        for z in [
            // Other walk, iteration, seed, pixel.
            correlation(|i| (first(light(7, 0, i)), first(camera(7, 0, i)))),
            correlation(|i| (first(light(7, 0, i)), first(light(7, 1, i)))),
            correlation(|i| (first(light(7, 0, i)), first(light(8, 0, i)))),
            correlation(|i| (first(camera(7, 2, i)), first(camera(7, 2, i + 1)))),
            // Two decisions of a sub-path, in and beyond the stratified ones.
            correlation(|i| {
                let mut stream = light(7, 0, i);
                (stream.uniform(), stream.uniform())
            }),
            correlation(|i| {
                let mut stream = camera(i, 4, 9);
                (stream.pair()[1], stream.pair()[1])
            }),
            correlation(|i| {
                let mut stream = light(7, 0, i);
                for _ in 0..STRATIFIED_DRAWS {
                    stream.uniform();
                }
                (stream.uniform(), stream.uniform())
            }),
        ] {
            assert!(z.abs() < 4.5, "correlation of {z} standard deviations");
        }
    }

    #[test]
    fn camera_sub_paths_of_a_pilot_begin_alike() {
        let twins = |index| [1, 2].map(|iteration| Stream::new(7, iteration, StreamKind::PilotCamera, index));
        for index in 0..100 {
            let [mut first, mut second] = twins(index);
            for draw in 0..12 {
                assert_eq!(first.pair() == second.pair(), draw < COMMON_DRAWS, "draw {draw}");
            }
        }
        for draws in [0, COMMON_DRAWS] {
            let after = |mut stream: Stream| {
                for _ in 0..draws {
                    stream.pair();
                }
                stream.uniform()
            };
            // Those of two pixels are independent, as are twins later.
            let z = correlation(|i| {
                let [first, second] = twins(i);
                let other = if draws == 0 { twins(i + 1)[0].clone() } else { second };
                (after(first), after(other))
            });
            assert!(z.abs() < 4.5, "correlation of {z} standard deviations after {draws} draws");
        }
    }

    #[test]
    fn what_nobody_asks_for_changes_nothing() {
        let mut asked = Stream::new(7, 4, StreamKind::Camera, 3);
        let mut lazy = asked.clone();
        for draw in 0..2 * STRATIFIED_DRAWS {
            let (first, second) = (asked.pair(), lazy.decide());
            if draw % 3 == 0 {
                assert_eq!(first, second.pair(), "draw {draw}");
                assert_eq!(first[0], second.uniform(), "draw {draw}");
            }
        }
    }

    #[test]
    fn every_draw_is_uniform_over_seeds() {
        // One point of one family, over seeds: χ² with 15 degrees of freedom is below 45 with probability
        // 0.9999.
        for draw in [0, 1, 5, STRATIFIED_DRAWS + 1] {
            let mut counts = [0_u32; 16];
            for seed in 0..20_000 {
                let mut stream = Stream::new(seed, 3, StreamKind::Camera, 11);
                for _ in 0..draw {
                    stream.pair();
                }
                counts[(stream.pair()[1] * 16.0) as usize] += 1;
            }
            let chi2: f64 = counts.iter().map(|&c| (f64::from(c) - 1250.0).powi(2) / 1250.0).sum();
            assert!(chi2 < 45.0, "draw {draw}: {counts:?}");
        }
    }

    #[test]
    fn numbers_stay_in_range_and_fill_it() {
        let mut stream = Stream::new(1, 2, StreamKind::Camera, 3);
        let mut counts = [0_u32; 10];
        for _ in 0..100_000 {
            let [a, b] = stream.pair();
            assert!((0.0..1.0).contains(&a) && (0.0..1.0).contains(&b));
            counts[stream.index(10)] += 1;
        }
        assert_eq!(stream.index(0), 0);
        // Binomial(1e5, 0.1): standard deviation 95.
        assert!(counts.iter().all(|&c| (f64::from(c) - 1e4).abs() < 5.0 * 95.0), "{counts:?}");
    }
}
