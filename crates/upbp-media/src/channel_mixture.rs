//! Probabilities with which the colour channels choose the distance in a chromatic medium.
//!
//! Under the per-segment mixture (`docs/theory.md`, section 1.4, policy B) every collision multiplies the
//! throughput of channel `c` by `σ_s,c e^{−σ_c t} / p(t)`. Its second moment `M_c = ∫ (σ_s,c e^{−σ_c t})² / p
//! dt` is the factor by which the variance of that channel grows from collision to collision, so the
//! probabilities that make the largest `M_c` as small as possible suit long paths best. They are a function
//! of the medium only, which lets the other walk compute them too.

use crate::Spectrum;

/// Least probability, before normalisation, of a channel that [needs](is_needed) one; after it, the inverse
/// bounds the throughput of a passed segment.
const FLOOR: f64 = 0.05;

/// Points of the quadrature over distances.
const POINTS: u32 = 256;

/// The probabilities of the channels, which sum to one, from the coefficients in inverse scene units.
pub(crate) fn channel_probabilities(sigma_s: Spectrum, sigma_t: Spectrum) -> [f64; 3] {
    let floor = is_needed(sigma_s, sigma_t).map(|is_needed| if is_needed { FLOOR } else { 0.0 });
    let mut alpha = normalised(floor);
    for _ in 0..64 {
        // A channel whose variance grows faster than others gets more of the samples: the fixed point has
        // equal growth in all channels that are above the floor.
        let growth: [f64; 3] = std::array::from_fn(|c| growth(c, &alpha, sigma_s, sigma_t));
        let raised: [f64; 3] = std::array::from_fn(|c| alpha[c] * growth[c].sqrt());
        let sum: f64 = raised.iter().sum();
        if !(sum > 0.0 && sum.is_finite()) {
            break;
        }
        alpha = normalised(std::array::from_fn(|c| (raised[c] / sum).max(floor[c])));
    }
    // With few bits the three sum to one without rounding: a segment of length zero is passed with certainty.
    let scale = f64::from(1_u32 << 20);
    let mut alpha = alpha.map(|a| (a * scale).round() / scale);
    let missing = 1.0 - alpha.iter().sum::<f64>();
    if let Some(largest) = alpha.iter_mut().max_by(|a, b| a.total_cmp(b)) {
        *largest += missing;
    }
    alpha
}

/// Whether distances are to be drawn from each channel: those that scatter, and those that get farther than
/// all of these. Of other channels nothing is left where they stop, and what passes is bounded by the channel
/// that gets farthest.
fn is_needed(sigma_s: Spectrum, sigma_t: Spectrum) -> [bool; 3] {
    let least = least_extinction(sigma_s, sigma_t);
    [0, 1, 2].map(|c| sigma_s[c] > 0.0 || sigma_t[c] < least)
}

/// The extinction of the channel that gets farthest of those that scatter; infinite if none does.
pub(crate) fn least_extinction(sigma_s: Spectrum, sigma_t: Spectrum) -> f32 {
    (0..3).filter(|&c| sigma_s[c] > 0.0).map(|c| sigma_t[c]).fold(f32::INFINITY, f32::min)
}

fn normalised(parts: [f64; 3]) -> [f64; 3] {
    let sum: f64 = parts.iter().sum();
    parts.map(|part| part / sum)
}

/// The second moment `M_c` of a channel, with the distance substituted by `u = 1 − e^{−σ_c t}`.
fn growth(channel: usize, alpha: &[f64; 3], sigma_s: Spectrum, sigma_t: Spectrum) -> f64 {
    let sigma = f64::from(sigma_t[channel]);
    let scattering = f64::from(sigma_s[channel]);
    if scattering == 0.0 {
        return 0.0;
    }
    let sum: f64 = (0..POINTS)
        .map(|i| {
            let passed = 1.0 - (f64::from(i) + 0.5) / f64::from(POINTS);
            let t = -passed.ln() / sigma;
            let p: f64 =
                (0..3).map(|c| alpha[c] * f64::from(sigma_t[c]) * (-f64::from(sigma_t[c]) * t).exp()).sum();
            passed / p
        })
        .sum();
    scattering * scattering / sigma * sum / f64::from(POINTS)
}

/// The largest second moment that any channel has after a segment of any length, on which walks pass or,
/// with the probability `continuation`, go on from where they stop, in a direction that multiplies the second
/// moment by `turn` (`docs/theory.md`, section 6.13). At least one, that of a segment without a length.
pub(crate) fn segment_growth(
    alpha: &[f64; 3],
    sigma_s: Spectrum,
    sigma_t: Spectrum,
    continuation: f64,
    turn: [f64; 3],
) -> f64 {
    let extinctions = [0, 1, 2].map(|c| f64::from(sigma_t[c]));
    let positive = || extinctions.into_iter().filter(|sigma| *sigma > 0.0);
    let shortest = 1e-3 / positive().fold(0.0, f64::max);
    let longest = 1e3 / positive().fold(f64::INFINITY, f64::min);
    if !(longest > shortest) {
        return 1.0;
    }
    let step = (longest / shortest).powf(1.0 / f64::from(POINTS));
    let of_channel = |channel: usize| {
        let (sigma, scattering) = (extinctions[channel], f64::from(sigma_s[channel]));
        // Relative to the transmittance of the channel, which may underflow.
        let mixed = |length: f64, factor: &dyn Fn(usize) -> f64| -> f64 {
            // Infinity times nothing would be no number.
            let drawn = (0..3).filter(|&k| alpha[k] > 0.0);
            drawn.map(|k| alpha[k] * factor(k) * ((sigma - extinctions[k]) * length).exp()).sum()
        };
        let stops = |length: f64| {
            let density = mixed(length, &|k| extinctions[k]);
            if scattering == 0.0 { 0.0 } else { scattering * scattering * (-sigma * length).exp() / density }
        };
        let (mut largest, mut stopped, mut before) = (1.0_f64, 0.0, 0.0);
        for point in 0..=POINTS {
            let length = shortest * step.powf(f64::from(point));
            stopped += 0.5 * (length - before) * (stops(before) + stops(length));
            let passes = (-sigma * length).exp() / mixed(length, &|_| 1.0);
            largest = largest.max(turn[channel] * stopped / continuation + passes);
            before = length;
        }
        largest
    };
    (0..3).map(of_channel).fold(1.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn largest(alpha: [f64; 3], sigma_s: Spectrum, sigma_t: Spectrum) -> f64 {
        (0..3).map(|c| growth(c, &alpha, sigma_s, sigma_t)).fold(0.0, f64::max)
    }

    #[test]
    fn no_other_probabilities_are_better() {
        for (sigma_a, sigma_s) in [
            (Spectrum::new(0.05, 0.5, 2.5), Spectrum::new(8.0, 2.0, 0.3)),
            (Spectrum::new(0.1, 0.1, 0.1), Spectrum::new(1.0, 3.0, 9.0)),
            (Spectrum::new(0.0, 1.0, 0.0), Spectrum::new(1.0, 0.0, 0.5)),
        ] {
            let sigma_t = sigma_a + sigma_s;
            let chosen = channel_probabilities(sigma_s, sigma_t);
            assert_eq!(chosen.iter().sum::<f64>(), 1.0);
            let best = largest(chosen, sigma_s, sigma_t);
            // All probabilities on a grid that respects the floor.
            for r in 1..20 {
                for g in 1..20 - r {
                    let alpha = [r, g, 20 - r - g].map(|n| f64::from(n) / 20.0);
                    let other = largest(alpha, sigma_s, sigma_t);
                    assert!(best < other * 1.01, "{chosen:?}: {best}, {alpha:?}: {other}");
                }
            }
        }
    }

    #[test]
    fn channels_that_only_absorb_are_drawn_where_they_get_farther() {
        let of = |sigma_a: [f32; 3], sigma_s: [f32; 3]| {
            let sigma_s = Spectrum::from(sigma_s);
            let sigma_t = Spectrum::from(sigma_a) + sigma_s;
            let alpha = channel_probabilities(sigma_s, sigma_t);
            (alpha, segment_growth(&alpha, sigma_s, sigma_t, 1.0, [1.0; 3]))
        };
        // The one channel that scatters is like a grey medium.
        let (alpha, growth) = of([0.0, 200.0, 200.0], [2.0, 0.0, 0.0]);
        assert_eq!(alpha, [1.0, 0.0, 0.0]);
        // But for the quadrature.
        assert!((growth - 1.0).abs() < 2e-3, "{growth}");
        let (alpha, growth) = of([0.0, 0.0, 200.0], [2.0, 2.0, 0.0]);
        assert_eq!(alpha, [0.5, 0.5, 0.0]);
        assert!((growth - 1.0).abs() < 2e-3, "{growth}");
        // Clear red has to pass.
        let (alpha, growth) = of([0.0, 1.0, 4.0], [0.0, 0.5, 0.5]);
        assert!(alpha.iter().all(|a| *a > 0.04) && growth.is_finite(), "{alpha:?} {growth}");
        // Rounding goes to a channel that is drawn.
        for sigma in [0.7, 1.1, 1.9, 3.1] {
            let (alpha, _) = of([0.3, 0.0, 9.0], [1.0, sigma, 0.0]);
            assert!(alpha[2] == 0.0 && alpha[0] + alpha[1] == 1.0, "{alpha:?}");
        }
    }

    #[test]
    fn equal_channels_are_chosen_alike() {
        let alpha = channel_probabilities(Spectrum::splat(2.0), Spectrum::splat(3.0));
        assert!(alpha.iter().all(|a| (a - 1.0 / 3.0).abs() < 1e-6));
    }
}
