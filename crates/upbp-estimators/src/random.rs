//! Random numbers as streams that are addressed, not shared.
//!
//! Every sub-path draws from its own stream, a function of (seed, iteration, kind of path, index): results
//! then depend neither on the number of threads nor on who renders which iteration, and the walks of both
//! sides are independent (a shared stream correlates them, `docs/theory.md`, section 10, row 6).
//!
//! The first decisions of a sub-path are points of Owen-scrambled (0, 2)-sequences, padded: every decision
//! has an order and a scramble of its own (`docs/theory.md`, section 6.7). The light sub-paths of an
//! iteration are stratified among each other, the camera sub-paths of a pixel over iterations and with those
//! of the pixels around it; each sub-path for itself is uniform, so nothing is biased. Later decisions, whose
//! strata no longer mean anything, come from xoshiro256++.
//!
//! Sources: B. Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020; for pixels that share a
//! sequence, with samples of a known number, A. Ahmed and P. Wonka, "Screen-Space Blue-Noise Diffusion of
//! Monte Carlo Sampling Error via Hierarchical Ordering of Pixels", ACM TOG 39(6), 2020. Oracles:
//! `tests::strata_hold_one_point_each`, `tests::strata_of_squares_hold_one_point_each`.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// The largest number below one: what rounding makes one is moved there, to be a random number.
pub(crate) const ONE_MINUS_EPSILON: f32 = 1.0_f32.next_down();

/// Draws that are stratified: about four vertices of a path.
const STRATIFIED_DRAWS: u32 = 24;
/// Side of the squares of pixels whose camera sub-paths share their sequences: that of the largest blocks
/// that errors over scales are taken of.
const SQUARE: u32 = 1 << LEVELS;
/// Times that a square is divided into four to get to a pixel.
const LEVELS: u32 = 4;
/// Draws that camera sub-paths with one index have in common in a run of the preparation: the place on the
/// film, that on the lens, the first distance in a medium, and the next event there, an emitter and a point
/// on it, or the one at the lens if a light can be seen through it. In lanes the channel takes the place of
/// that point; without a medium, it is what is drawn next.
const COMMON_DRAWS: u32 = 5;

/// The purpose of a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StreamKind {
    /// Light sub-paths.
    Light,
    /// Camera sub-paths, by [`pixel_index`]. Those of even and of odd iterations are stratified apart, so
    /// that the two halves of a render are independent of each other and their difference tells the error.
    /// So are those of different squares of 16 × 16 pixels.
    Camera,
    /// Light sub-paths of the preparation, which sets radii and counts before the first iteration.
    PilotLight,
    /// Camera sub-paths of the preparation. Those of one index, in iterations that differ in nothing but
    /// their lower 32 bits, share their first decisions and are independent after them: their difference
    /// tells the variance of a pixel that stratification leaves.
    PilotCamera,
    /// The turns in which pixels make photon queries.
    MergePeriods,
}

/// A stream of uniform random numbers.
#[derive(Clone, Debug)]
pub struct Stream {
    /// Number of the sub-path among those that share the sequences, of one pixel, the lowest bit first.
    point: u32,
    /// The pixel among those that share the sequences, if several do: [quarters of the
    /// square](place_in_square).
    place: Option<u8>,
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
        let of = |index: u64| index.wrapping_mul(0xaef1_7502_108e_f2d9);
        // Light sub-paths share an iteration, camera sub-paths a square of pixels. Beyond 2³² sub-paths the
        // sequences repeat their points, and 2²⁴ of a pixel are for themselves: that costs stratification
        // only.
        let mut place = None;
        let (point, family, from_sequences) = match kind {
            StreamKind::Light | StreamKind::PilotLight => {
                (index as u32, mix(common ^ of_iteration), STRATIFIED_DRAWS)
            }
            StreamKind::Camera => {
                let (half, point) = half(iteration);
                let of_half = (half as u64).wrapping_mul(0x2545_f491_4f6c_dd1d);
                let [square, pixel] = square_and_pixel(index);
                place = Some(place_in_square(pixel));
                (point as u32, mix(common ^ of(square)) ^ of_half, STRATIFIED_DRAWS)
            }
            StreamKind::PilotCamera => {
                let of_run = (iteration >> 32).wrapping_mul(0xd1b5_4a32_d192_ed03);
                (0, mix(mix(common ^ of_run) ^ of(index)), COMMON_DRAWS)
            }
            StreamKind::MergePeriods => (0, 0, 0),
        };
        // The finaliser of SplitMix64 between the words: streams of neighbouring addresses have nothing in
        // common.
        let rest = Xoshiro256PlusPlus::seed_from_u64(mix(mix(common ^ of_iteration) ^ of(index)));
        Self { point: point.reverse_bits(), place, family, draws: 0, from_sequences, rest }
    }

    /// The next decision: numbers that may not be needed.
    #[inline]
    pub fn decide(&mut self) -> Decision {
        self.draws += 1;
        if self.draws <= self.from_sequences {
            let key = self.family.wrapping_add(u64::from(self.draws).wrapping_mul(0x9e37_79b9_7f4a_7c15));
            Decision::InSequences { point: self.point, place: self.place, key }
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
        /// The number of the sub-path, of its pixel if there are several, the lowest bit first.
        point: u32,
        /// The pixel among those that share the sequences, if several do.
        place: Option<u8>,
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
            Self::InSequences { point, place, key } => {
                let key = mix(key);
                to_unit(scramble(number(point, place, key), (key >> 32) as u32).reverse_bits())
            }
            Self::Alone(bits) => to_unit((bits >> 32) as u32),
        }
    }

    /// Two uniform numbers in `[0, 1)`, stratified together.
    #[must_use]
    pub fn pair(self) -> [f32; 2] {
        let bits = match self {
            Self::InSequences { point, place, key } => {
                let key = mix(key);
                let point = number(point, place, key);
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

/// The index of camera sub-paths of a pixel: neighbours are stratified together. A crop of the film has the
/// samples of the whole one.
#[must_use]
pub const fn pixel_index([x, y]: [u32; 2]) -> u64 {
    (y as u64) << 32 | x as u64
}

/// The square of pixels that a [`pixel_index`] lies in, and the index within it.
const fn square_and_pixel(index: u64) -> [u64; 2] {
    const WITHIN: u64 = pixel_index([SQUARE - 1; 2]);
    [index & !WITHIN, index & WITHIN]
}

/// The quarters of ever smaller squares that a pixel lies in, that of the whole square in the lowest two
/// bits.
const fn place_in_square(pixel: u64) -> u8 {
    let (x, y) = (pixel, pixel >> 32);
    let (mut place, mut level) = (0, 0);
    while level < LEVELS {
        let bit = LEVELS - 1 - level;
        place |= ((x >> bit & 1) | (y >> bit & 1) << 1) << (2 * level);
        level += 1;
    }
    place as u8
}

/// The number, in the sequences, of a sub-path of a pixel; the lowest bit of `point` comes first.
///
/// With bits as coefficients of polynomials over the field of two elements it is
/// `r₀ + q r₁ + q² r₂ + q³ r₃ + q⁴ i`, `q = x² + x + 1`, where the quarters `r` of the pixel and the number
/// `i` of the sub-path are in an order of the decision's own. Points of the sequences are a net if the
/// remainders of their numbers by `xᵃ (x + 1)ᵇ` differ. That has no factor in common with `q`, so those of a
/// pixel are one, and those of a square of pixels, over any aligned run of sub-paths.
#[inline]
fn number(point: u32, place: Option<u8>, key: u64) -> u32 {
    let point = order(point, key);
    let Some(place) = place else { return point };
    let quarters = key.wrapping_mul(0x9e6c_63d0_876a_3f35) >> 32;
    let place = scramble(u32::from(place), quarters as u32) as u8;
    point ^ point << 4 ^ point << 8 ^ u32::from(PLACES[usize::from(place)])
}

/// `r₀ + q r₁ + q² r₂ + q³ r₃` for quarters of two bits each.
static PLACES: [u8; 1 << (2 * LEVELS)] = {
    let mut places = [0; 1 << (2 * LEVELS)];
    let mut place = 0;
    while place < places.len() {
        let (mut sum, mut level) = (0, LEVELS);
        while level > 0 {
            level -= 1;
            sum = sum ^ sum << 1 ^ sum << 2 ^ (place >> (2 * level) & 0b11);
        }
        places[place] = sum as u8;
        place += 1;
    }
    places
};

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

/// The finaliser of `SplitMix64`: numbers that are next to each other have nothing in common behind it.
#[inline]
pub(crate) fn mix(mut z: u64) -> u64 {
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

    #[test]
    fn strata_of_squares_hold_one_point_each() {
        // 2ᵏ camera sub-paths of each of 4ᴸ pixels: every elementary interval has one point, at each
        // decision.
        for (level, log_paths) in (0..=4_u32).flat_map(|l| (0..=4_u32).map(move |k| (l, k))) {
            let (side, paths) = (1 << level, 1_u32 << log_paths);
            let corner = [7 * 16 + (16 - side), 3 * 16 + side % 16];
            let mut streams: Vec<_> = (0..side * side)
                .flat_map(|i| {
                    (0..paths).map(move |path| ([corner[0] + i % side, corner[1] + i / side], path))
                })
                .map(|(pixel, path)| {
                    let iteration = 2 * u64::from(5 * paths + path);
                    Stream::new(5, iteration, StreamKind::Camera, pixel_index(pixel))
                })
                .collect();
            let count = streams.len();
            for _ in 0..3 {
                let pairs: Vec<_> = streams.iter_mut().map(Stream::pair).collect();
                for width in (0..=count.ilog2()).map(|log| 1 << log) {
                    let height = count / width;
                    let cell = |[x, y]: &[f32; 2]| {
                        (x * width as f32) as usize + width * (y * height as f32) as usize
                    };
                    let mut cells: Vec<_> = pairs.iter().map(cell).collect();
                    cells.sort_unstable();
                    assert!(cells.into_iter().eq(0..count), "{side} x {side}, {paths}: {width} x {height}");
                }
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
            // Other walk, iteration, seed, square of pixels.
            correlation(|i| (first(light(7, 0, i)), first(camera(7, 0, i)))),
            correlation(|i| (first(light(7, 0, i)), first(light(7, 1, i)))),
            correlation(|i| (first(light(7, 0, i)), first(light(8, 0, i)))),
            correlation(|i| (first(camera(7, 2, i)), first(camera(7, 2, i + 16)))),
            // Pixels of a square, at two decisions.
            correlation(|i| {
                let [mut one, mut other] = [camera(7, i, 3), camera(7, i, 4)];
                (one.uniform(), [other.uniform(), other.uniform()][1])
            }),
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
            let runs = [0, 1].map(|run| Stream::new(7, run << 32, StreamKind::PilotCamera, index).pair());
            assert_ne!(runs[0], runs[1], "runs have nothing in common");
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
            let mut counts = [[0_u32; 16]; 2];
            for seed in 0..20_000 {
                let mut stream = Stream::new(seed, 3, StreamKind::Camera, 11);
                for _ in 0..draw {
                    stream.pair();
                }
                for (counts, number) in counts.iter_mut().zip(stream.pair()) {
                    counts[(number * 16.0) as usize] += 1;
                }
            }
            for counts in counts {
                let chi2: f64 = counts.iter().map(|&c| (f64::from(c) - 1250.0).powi(2) / 1250.0).sum();
                assert!(chi2 < 45.0, "draw {draw}: {counts:?}");
            }
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
