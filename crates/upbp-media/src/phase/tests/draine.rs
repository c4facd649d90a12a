//! Draine's phase function and the mixture for droplets.

use proptest::prelude::*;

use super::*;
use crate::testing::integrate;

fn draine(g: f32, alpha: f32) -> PhaseFunction {
    PhaseFunction::draine(g, alpha).unwrap()
}

pub(super) fn all() -> Vec<PhaseFunction> {
    let mut all = vec![draine(0.0, 1.0), draine(0.3, 0.0)];
    for g in [0.0, 0.4, 0.9, 0.999, 0.999_99] {
        for alpha in [0.5, 250.0] {
            all.extend([draine(g, alpha), draine(-g, alpha)]);
        }
    }
    all.extend([0.01, 1.0, 2.0, 10.0, 50.0].map(|diameter| PhaseFunction::droplets(diameter).unwrap()));
    all
}

/// As it is published, but for the cancellation.
pub(super) fn reference(phase: &Draine, (one_minus_cos, one_plus_cos): (f64, f64)) -> f64 {
    let (g, alpha) = (f64::from(phase.g().get()), f64::from(phase.alpha()));
    let cos = 0.5 * (one_plus_cos - one_minus_cos);
    let lobe = PhaseFunction::HenyeyGreenstein(phase.g());
    let factor = (1.0 + alpha * cos * cos) / (1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0);
    super::reference(&lobe, (one_minus_cos, one_plus_cos)) * factor
}

/// The integral in the variable `D = √(1 + g² − 2 g cos θ)`, by powers of it.
pub(super) fn distribution(phase: &Draine, (one_minus_cos, one_plus_cos): (f64, f64)) -> f64 {
    let (g, alpha) = (f64::from(phase.g().get()), f64::from(phase.alpha()));
    let mean = 1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0;
    if g.abs() < 1e-3 {
        assert_eq!(g, 0.0, "the integral divides by g");
        let cos = 0.5 * (one_plus_cos - one_minus_cos);
        return 0.5 * (one_plus_cos + alpha / 3.0 * (cos.powi(3) + 1.0)) / mean;
    }
    let distance = |(one_minus_cos, one_plus_cos): (f64, f64)| {
        let near = if g > 0.0 { one_minus_cos } else { one_plus_cos };
        ((1.0 - g.abs()).powi(2) + 2.0 * g.abs() * near).sqrt()
    };
    let integral = |d: f64| {
        let (s, quarter) = (1.0 + g * g, alpha / (4.0 * g * g));
        -(1.0 + quarter * s * s) / d - 2.0 * quarter * s * d + quarter * d.powi(3) / 3.0
    };
    let range = integral(distance((2.0, 0.0))) - integral(distance((one_minus_cos, one_plus_cos)));
    (1.0 - g * g) / (2.0 * g) * range / mean
}

#[test]
fn special_cases_are_the_other_functions() {
    let mut random = Random(21);
    for _ in 0..1000 {
        let (before, after) = (random.direction(), random.direction());
        let same = |a: PhaseFunction, b: PhaseFunction| {
            let ratio = a.eval(before, after).pdf / b.eval(before, after).pdf;
            assert!((ratio - 1.0).abs() < 2e-6, "{a:?}, {b:?}: {ratio}");
        };
        same(draine(0.0, 1.0), PhaseFunction::Rayleigh);
        same(draine(0.7, 0.0), henyey_greenstein(0.7));
    }
}

#[test]
fn droplets_are_the_published_mixture() {
    // Worked out from the equations of the paper and its supplement, each of the four ranges once: asymmetry
    // of the lobe, share, asymmetry and factor of the wide part.
    for (diameter, expected) in [
        (0.05, [0.0345, 0.252_181, 0.025_661_2, 250.0]),
        (1.0, [0.862, 0.240_759, 0.506_916, 250.0]),
        (3.0, [0.945_945, 0.380_939, 0.421_973, 14.340_5]),
        (10.0, [0.988_177, 0.481_954, 0.555_66, 21.995_5]),
    ] {
        let PhaseFunction::Blend(blend) = PhaseFunction::droplets(diameter).unwrap() else {
            panic!("no blend")
        };
        let [(_, PhaseFunction::HenyeyGreenstein(g)), (share, PhaseFunction::Draine(wide))] = blend.parts()
        else {
            panic!("other parts: {blend:?}")
        };
        for (value, expected) in [g.get(), *share, wide.g().get(), wide.alpha()].into_iter().zip(expected) {
            assert!((value / expected - 1.0).abs() < 1e-4, "{diameter}: {value}, expected {expected}");
        }
    }
    // No diameter leads the fits out of the ranges of their parameters.
    for i in 1..=5000 {
        let diameter = 0.01 * i as f32;
        let phase = PhaseFunction::droplets(diameter);
        assert!(phase.is_ok(), "{diameter}: {phase:?}");
    }
    // The smallest are Rayleigh's.
    let tiny = PhaseFunction::droplets(1e-4).unwrap();
    for cos in [-1.0, -0.3, 0.0, 0.8, 1.0] {
        let ratio = at_angle(&tiny, f32::acos(cos)) / at_angle(&PhaseFunction::Rayleigh, f32::acos(cos));
        assert!((ratio - 1.0).abs() < 0.02, "{cos}: {ratio}");
    }
    for diameter in [0.0, -1.0, 50.1, f32::NAN, f32::INFINITY] {
        assert!(PhaseFunction::droplets(diameter).is_err(), "{diameter}");
    }
    for (g, alpha) in [(1.0, 1.0), (0.5, -1.0), (0.5, f32::NAN), (0.5, f32::INFINITY)] {
        assert!(PhaseFunction::draine(g, alpha).is_err(), "{g}, {alpha}");
    }
}

proptest! {
    /// The inversion against quadrature in the fraction of the lobe, where nothing is narrow.
    #[test]
    fn the_inversion_holds(
        g in prop_oneof![-1.0_f32..1.0, (-30_f32..0.0).prop_map(|e| 1.0 - e.exp2()), Just(0.0), Just(1e-20)],
        alpha in prop_oneof![Just(0.0_f32), (-20_f32..40.0).prop_map(f32::exp2), Just(f32::MAX)],
        u in prop_oneof![0.0_f32..LARGEST_BELOW_ONE, Just(0.0), Just(0.5), Just(LARGEST_BELOW_ONE)],
    ) {
        prop_assume!(g.abs() < 1.0);
        let PhaseFunction::Draine(phase) = draine(g, alpha) else { unreachable!() };
        let found = phase.sample(u);
        let (g, alpha) = (f64::from(g), f64::from(alpha));
        // The fraction of Henyey and Greenstein's distribution at the angle found.
        let (a, b) = (1.0 - g, 1.0 + g);
        let near2 = if g > 0.0 { a * a + 2.0 * g * found.one_minus_cos } else { b * b - 2.0 * g * found.one_plus_cos };
        let fraction = found.one_plus_cos * a / (near2.sqrt() * (b + near2.sqrt()));
        let cos = |v: f64| {
            let at = henyey_greenstein::sample(phase.g(), v);
            0.5 * (at.one_plus_cos - at.one_minus_cos)
        };
        let mean = 1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0;
        // Panels that crowd towards the end at which the lobe turns quickly.
        let turns = 1.0 - g.abs();
        let end = |t: f64| if g > 0.0 { turns * (t.exp() - 1.0) } else { 1.0 - turns * (t.exp() - 1.0) };
        let to = |v: f64| (1.0 + if g > 0.0 { v } else { 1.0 - v } / turns).ln();
        let integrand = |t: f64| (1.0 + alpha * cos(end(t)).powi(2)) / mean * turns * t.exp();
        let below = (integrate(integrand, to(0.0), to(fraction), 200) * g.signum()).abs();
        prop_assert!((below - f64::from(u)).abs() < 1e-9, "{below} at {fraction}");
    }
}
