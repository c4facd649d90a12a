//! Random numbers as streams that are addressed, not shared.
//!
//! Every sub-path draws from its own stream, a function of (seed, iteration, kind of path, index): results then
//! depend neither on the number of threads nor on who renders which iteration, and the walks of both sides are
//! independent (a shared stream correlates them, `docs/theory.md`, section 10, row 6).

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// What a stream is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StreamKind {
    /// Light sub-paths.
    Light,
    /// Camera sub-paths.
    Camera,
    /// Light sub-paths of the pilot, which sets radii and counts before the first iteration.
    PilotLight,
    /// Camera sub-paths of the pilot.
    PilotCamera,
}

/// A stream of uniform random numbers (xoshiro256++).
#[derive(Clone, Debug)]
pub struct Stream(Xoshiro256PlusPlus);

impl Stream {
    /// The stream of one sub-path.
    #[must_use]
    pub fn new(seed: u64, iteration: u64, kind: StreamKind, index: u64) -> Self {
        // The finaliser of SplitMix64 between the words: streams of neighbouring addresses have nothing in common.
        let mut state = mix(seed ^ 0x9e37_79b9_7f4a_7c15);
        state = mix(state ^ iteration.wrapping_mul(0xd1b5_4a32_d192_ed03));
        state = mix(state ^ (kind as u64 + 1).wrapping_mul(0x8cb9_2ba7_2f3d_8dd7));
        state = mix(state ^ index.wrapping_mul(0xaef1_7502_108e_f2d9));
        Self(Xoshiro256PlusPlus::seed_from_u64(state))
    }

    /// Uniform in `[0, 1)`, a multiple of 2⁻²⁴.
    pub fn uniform(&mut self) -> f32 {
        (self.0.next_u64() >> 40) as f32 * (1.0 / 16_777_216.0)
    }

    /// Two of them.
    pub fn pair(&mut self) -> [f32; 2] {
        let bits = self.0.next_u64();
        let scale = 1.0 / 16_777_216.0;
        [(bits >> 40) as f32 * scale, ((bits >> 16) & 0x00ff_ffff) as f32 * scale]
    }

    /// Uniform in `0..count`; 0 if `count` is 0.
    pub fn index(&mut self, count: usize) -> usize {
        // Multiply and shift: the bias is below count / 2⁶⁴.
        ((u128::from(self.0.next_u64()) * count as u128) >> 64) as usize
    }
}

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbouring_streams_are_uncorrelated() {
        // Correlation of first draws over 1e5 pairs of neighbours: standard deviation 1/√n.
        let n = 100_000_u64;
        for shift in [
            |i: u64| Stream::new(7, 0, StreamKind::Light, i + 1),
            |i: u64| Stream::new(7, 0, StreamKind::Camera, i),
            |i: u64| Stream::new(7, 1, StreamKind::Light, i),
            |i: u64| Stream::new(8, 0, StreamKind::Light, i),
        ] {
            let mut sum = 0.0;
            for i in 0..n {
                let a = f64::from(Stream::new(7, 0, StreamKind::Light, i).uniform()) - 0.5;
                sum += a * (f64::from(shift(i).uniform()) - 0.5) * 12.0;
            }
            let z = sum / (n as f64).sqrt();
            assert!(z.abs() < 4.0, "correlation of {z} standard deviations");
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
