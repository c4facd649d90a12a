//! Offsets of pixels that share the errors of a block, and the weights of what they share.
//!
//! Photons and beams are seen by many pixels of an iteration, so that the error of a block's mean falls less
//! than with its number n of pixels. The mean over some sizes of blocks of n times the variance of a block's
//! mean is the variance of a pixel and a sum over the other pixels near it, of covariances times
//! [weights](weight) that depend on their offset.

use crate::auto::parallel_walks::EVEN_STEPS;
use crate::film::BLOCK_SIDES;

/// The farthest that pixels of a block are apart in a row.
const FARTHEST: u32 = 15;

/// Pairs of pixels at an offset in a block, over the pixels of the block; mean over all [sides](BLOCK_SIDES).
pub(super) fn weight([x, y]: [i32; 2]) -> f64 {
    let of_side = |side: u32| {
        let pairs = side.saturating_sub(x.unsigned_abs()) * side.saturating_sub(y.unsigned_abs());
        f64::from(pairs) / f64::from(side * side)
    };
    BLOCK_SIDES.map(of_side).iter().sum::<f64>() / BLOCK_SIDES.len() as f64
}

/// Another of `count` elements than the one at `index`, the n-th one that is drawn: all others are as likely.
pub(super) fn another(n: usize, index: usize, count: usize) -> usize {
    let others = count - 1;
    let drawn = (n as f64 * EVEN_STEPS[0]).fract() * others as f64;
    (index + 1 + (drawn as usize).min(others - 1)) % count
}

/// The offset of the n-th pair of pixels, and its weight over its probability. A ring at half the
/// distance is twice as likely: there is more in common the nearer pixels are.
pub(super) fn offset(n: u32) -> ([i32; 2], f64) {
    let [u, v] = EVEN_STEPS.map(|step| (f64::from(n) * step).fract());
    let all: f64 = (1..=FARTHEST).map(|ring| f64::from(ring).recip()).sum();
    let mut rest = u * all;
    let mut ring = 1;
    while ring < FARTHEST && rest >= f64::from(ring).recip() {
        rest -= f64::from(ring).recip();
        ring += 1;
    }
    // Around the square of a ring.
    let places = 8 * ring;
    let place = ((v * f64::from(places)) as u32).min(places - 1);
    let (side, along) = (place / (2 * ring), (place % (2 * ring)).cast_signed());
    let ring = ring.cast_signed();
    let offset = match side {
        0 => [along - ring, -ring],
        1 => [ring, along - ring],
        2 => [ring - along, ring],
        _ => [-ring, ring - along],
    };
    (offset, weight(offset) * all * f64::from(ring) * f64::from(places))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All pairs of different pixels of a block, over its pixels.
    #[test]
    fn weights_count_pairs() {
        let offsets = || (-15..=15).flat_map(|y| (-15..=15).map(move |x| [x, y])).filter(|o| *o != [0, 0]);
        let expected = BLOCK_SIDES.map(|side| f64::from(side * side - 1)).iter().sum::<f64>() / 4.0;
        let sum: f64 = offsets().map(weight).sum();
        assert!((sum / expected - 1.0).abs() < 1e-12, "{sum}, expected {expected}");
    }

    #[test]
    fn every_other_one_is_drawn_alike() {
        for count in [2, 3, 10] {
            let mut drawn = vec![[0_usize; 10]; count];
            let draws = 10_000;
            for n in 0..draws * count {
                drawn[n % count][another(n, n % count, count)] += 1;
            }
            let expected = draws / (count - 1);
            for (index, drawn) in drawn.iter().enumerate() {
                for (other, &found) in drawn[..count].iter().enumerate() {
                    let expected = if other == index { 0 } else { expected };
                    assert!(found.abs_diff(expected) <= expected / 100, "{index}, {other}: {found}");
                }
            }
        }
    }

    /// Sums over all offsets are estimated without bias, whatever they are of.
    #[test]
    fn drawn_offsets_stand_for_all() {
        let functions: [fn([i32; 2]) -> f64; 3] = [
            |_| 1.0,
            |[x, y]| (-0.2 * f64::from(x * x + y * y)).exp(),
            |[x, y]| f64::from(u8::from(x > 2 && y < 0)),
        ];
        for (i, function) in functions.into_iter().enumerate() {
            let (mut expected, mut found) = (0.0, 0.0);
            for y in -15..=15 {
                for x in -15..=15 {
                    if [x, y] != [0, 0] {
                        expected += weight([x, y]) * function([x, y]);
                    }
                }
            }
            let draws = 1 << 16;
            for n in 0..draws {
                let (offset, weight) = offset(n);
                found += weight * function(offset) / f64::from(draws);
            }
            assert!((found / expected - 1.0).abs() < 2e-3, "{i}: {found}, expected {expected}");
        }
    }
}
