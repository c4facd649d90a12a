//! Phase functions from tables.

use proptest::prelude::*;

use super::*;
use crate::testing::integrate;

/// Linear in the cosine between the rows, normalised, in double precision.
struct Oracle {
    /// Angles as `1 − cos` and `1 + cos`, with values.
    rows: Vec<([f64; 2], f64)>,
    /// Integrals from straight back, by row.
    below: Vec<f64>,
}

impl Oracle {
    fn new(rows: &[(f32, f32)]) -> Self {
        let at = |degrees: f64| 2.0 * (0.5 * degrees.to_radians()).sin().powi(2);
        let rows: Vec<_> = rows
            .iter()
            .map(|&(degrees, value)| {
                let degrees = f64::from(degrees);
                ([at(degrees), at(180.0 - degrees)], f64::from(value))
            })
            .collect();
        let mut below = vec![0.0; rows.len()];
        for row in (0..rows.len() - 1).rev() {
            let width = Self::width(rows[row].0, rows[row + 1].0);
            below[row] = below[row + 1] + PI * width * (rows[row].1 + rows[row + 1].1);
        }
        Self { rows, below }
    }

    /// Difference of two cosines, without cancellation.
    fn width(a: [f64; 2], b: [f64; 2]) -> f64 {
        if b[0] < 1.0 { b[0] - a[0] } else { a[1] - b[1] }
    }

    /// Density and probability of a smaller cosine.
    fn at(&self, angle: (f64, f64)) -> (f64, f64) {
        let angle = [angle.0, angle.1];
        let end =
            self.rows.partition_point(|row| Self::width(row.0, angle) > 0.0).clamp(1, self.rows.len() - 1);
        let ((a, value_a), (b, value_b)) = (self.rows[end - 1], self.rows[end]);
        let share = (Self::width(a, angle) / Self::width(a, b)).clamp(0.0, 1.0);
        let value = value_a + share * (value_b - value_a);
        let below = self.below[end] + PI * Self::width(angle, b).max(0.0) * (value + value_b);
        (value / self.below[0], below / self.below[0])
    }
}

fn tabulated(rows: &[(f32, f32)]) -> Result<PhaseFunction, MediaError> {
    let rows: Vec<_> = rows.iter().map(|&(degrees, value)| (degrees, Spectrum::splat(value))).collect();
    PhaseFunction::tabulated(&rows)
}

/// A corona, a bow and a glory: peaks at both ends and in the middle, and angles without light.
fn bow() -> Vec<(f32, f32)> {
    vec![
        (0.0, 3e5),
        (0.01, 1e5),
        (0.3, 40.0),
        (2.0, 1.0),
        (40.0, 0.0),
        (89.0, 0.0),
        (138.0, 0.2),
        (138.9, 3.0),
        (140.0, 0.1),
        (178.0, 0.5),
        (179.9, 7.0),
        (180.0, 90.0),
    ]
}

fn tables() -> Vec<Vec<(f32, f32)>> {
    vec![
        vec![(0.0, 1.0), (180.0, 1.0)],
        vec![(0.0, 1.0), (180.0, 0.0)],
        vec![(0.0, 0.0), (90.0, 1.0), (180.0, 0.0)],
        vec![(0.0, 1e30), (0.001, 0.0), (180.0, 0.0)],
        vec![(0.0, 0.0), (179.999, 0.0), (180.0, 1e-30)],
        bow(),
    ]
}

/// Of single precision, relative.
const ROUNDING: f64 = 6e-8;

fn check(rows: &[(f32, f32)], random: &mut Random, samples: usize) {
    let phase = tabulated(rows).unwrap();
    let oracle = Oracle::new(rows);
    let slope =
        |pair: &[([f64; 2], f64)]| (pair[1].1 - pair[0].1).abs() / Oracle::width(pair[0].0, pair[1].0);
    let steepest = oracle.rows.windows(2).map(slope).fold(0.0, f64::max) / oracle.below[0];
    let levels: Vec<f64> = (0..samples)
        .map(|_| {
            let before = random.direction();
            let sample = phase.sample::<f64>(before, (), &(), [random.uniform(), random.uniform()]);
            let angle = deflection(before, sample.after);
            let (density, below) = oracle.at(angle);
            let found = sample.pdf;
            // Directions and what is across them are off by roundings: the angle is by as much, its cosine by
            // that times the sine, and by the squared errors of lengths.
            let sine = (angle.0 * angle.1).sqrt();
            let moved = 1e-13 + ROUNDING * (3.0 * sine + 2.0 * angle.0.min(angle.1));
            assert!((found - density).abs() < 3e-6 * density + moved * steepest, "{found}, {density}");
            assert_eq!(phase.eval(before, sample.after), phase.eval(sample.after, before));
            below
        })
        .collect();
    if samples >= 10_000 {
        assert_uniform(levels.into_iter(), &format!("{rows:?}"));
    }
}

#[test]
fn tables_are_sampled_as_they_say() {
    let mut random = Random(41);
    for rows in tables() {
        check(&rows, &mut random, 200_000);
    }
}

#[test]
fn tables_integrate_to_one_and_know_their_mean_cosine() {
    for rows in tables() {
        let phase = tabulated(&rows).unwrap();
        let value = |one_minus_cos: f64, one_plus_cos: f64| {
            f64::from(
                phase
                    .value(Deflection {
                        one_minus_cos: one_minus_cos as f32,
                        one_plus_cos: one_plus_cos as f32,
                    })
                    .pdf,
            )
        };
        // Exact for the pieces: quadrature between the kinks.
        let oracle = Oracle::new(&rows);
        let mut kinks: Vec<[f64; 2]> = oracle.rows.iter().map(|row| row.0).collect();
        kinks.push([1.0, 1.0]);
        kinks.sort_by(|a, b| (a[0] - a[1]).total_cmp(&(b[0] - b[1])));
        let (mut integral, mut moment) = (0.0, 0.0);
        for pair in kinks.windows(2) {
            if pair[1][0] <= 1.0 {
                integral += integrate(|x| value(x, 2.0 - x), pair[0][0], pair[1][0], 4);
                moment += integrate(|x| (1.0 - x) * value(x, 2.0 - x), pair[0][0], pair[1][0], 4);
            } else {
                integral += integrate(|x| value(2.0 - x, x), pair[1][1], pair[0][1], 4);
                moment += integrate(|x| (x - 1.0) * value(2.0 - x, x), pair[1][1], pair[0][1], 4);
            }
        }
        assert!((TAU * integral - 1.0).abs() < 1e-6, "{rows:?}: {integral}");
        assert!((TAU * moment - f64::from(phase.mean_cosine().r())).abs() < 1e-6, "{rows:?}: {moment}");
    }
}

#[test]
fn a_table_of_a_known_function_is_that_function() {
    let lobe = henyey_greenstein(0.8);
    let rows: Vec<_> = (0..=1800)
        .map(|i| 0.1 * i as f32)
        .map(|degrees| (degrees, Spectrum::splat(7.0 * at_angle(&lobe, degrees.to_radians()))))
        .collect();
    let mut rows = rows;
    rows.last_mut().unwrap().0 = 180.0;
    let phase = PhaseFunction::tabulated(&rows).unwrap();
    let mut random = Random(42);
    for _ in 0..1000 {
        let (before, after) = (random.direction(), random.direction());
        let ratio = phase.eval(before, after).pdf / lobe.eval(before, after).pdf;
        assert!((ratio - 1.0).abs() < 1e-4, "{ratio}");
    }
}

#[test]
fn tables_survive_the_ends_of_the_random_numbers() {
    for rows in tables() {
        let phase = tabulated(&rows).unwrap();
        for u in [0.0, f32::EPSILON / 2.0, 0.5, LARGEST_BELOW_ONE] {
            let sample = phase.sample::<f64>(Vec3::Z, (), &(), [u, u]);
            assert!((sample.after.length() - 1.0).abs() < 2e-7, "{rows:?}: {sample:?}");
            assert!(sample.pdf.is_finite() && sample.pdf >= 0.0, "{rows:?}: {sample:?}");
            assert!(sample.weight == Spectrum::ONE || sample.pdf == 0.0, "{rows:?}: {sample:?}");
        }
    }
}

#[test]
fn angles_without_light_are_never_drawn() {
    for i in 0..1000 {
        let phase =
            tabulated(&[(0.0, 1.0), (25.0 + 0.005 * i as f32, 0.0), (60.0, 0.0), (180.0, 0.0)]).unwrap();
        for u in [0.0, f32::EPSILON / 2.0, LARGEST_BELOW_ONE] {
            let sample = phase.sample::<f64>(Vec3::Z, (), &(), [u, 0.5]);
            assert!(sample.after.z > 0.86, "{i}: {sample:?}");
        }
    }
}

#[test]
fn coloured_tables_have_one_function_per_channel() {
    let rows = [(0.0, Spectrum::new(1.0, 2.0, 4.0)), (180.0, Spectrum::new(1.0, 1.0, 0.0))];
    let phase = PhaseFunction::tabulated(&rows).unwrap();
    let value = phase.eval(Vec3::X, Vec3::X).value * (4.0 * std::f32::consts::PI);
    for (channel, expected) in [1.0, 4.0 / 3.0, 2.0].into_iter().enumerate() {
        assert!((value[channel] - expected).abs() < 1e-6, "{value:?}");
    }
}

#[test]
fn wrong_tables_are_named() {
    let message = |rows: &[(f32, f32)]| tabulated(rows).unwrap_err().to_string();
    assert!(message(&[]).contains("the table of a phase function is empty"));
    assert_eq!(message(&[(1.0, 1.0), (180.0, 1.0)]), "angle 0 is 1, expected 0 degrees, where tables start");
    assert_eq!(message(&[(0.0, 1.0), (90.0, 1.0)]), "angle 1 is 90, expected 180 degrees, where tables end");
    let falling = message(&[(0.0, 1.0), (50.0, 1.0), (50.0, 2.0), (180.0, 1.0)]);
    assert_eq!(falling, "angle 2 is 50, expected at least 0.001 degrees more than the angle before");
    let negative = message(&[(0.0, 1.0), (180.0, -1.0)]);
    assert_eq!(negative, "value 1 is -1, expected a finite number of at least zero");
    let zero = message(&[(0.0, 0.0), (180.0, 0.0)]);
    assert_eq!(zero, "the integral of the table is 0, expected a number above zero");
    for bad in [f32::NAN, f32::INFINITY] {
        assert!(tabulated(&[(0.0, bad), (180.0, 1.0)]).is_err());
        assert!(tabulated(&[(0.0, 1.0), (bad, 1.0), (180.0, 1.0)]).is_err());
    }
    // In single precision some of these steps are less than a thousandth.
    let small: Vec<_> = (0..180_000).step_by(997).chain([180_000]).flat_map(|i| [i, i + 1]).collect();
    let mut rows: Vec<_> =
        small.iter().filter(|i| **i <= 180_000).map(|i| (*i as f32 / 1000.0, 1.0)).collect();
    rows.dedup();
    assert!(tabulated(&rows).is_ok(), "{:?}", tabulated(&rows));
    assert!(tabulated(&[(0.0, f32::MAX), (180.0, f32::MAX)]).is_ok());
    assert!(tabulated(&[(0.0, 1e-45), (180.0, 0.0)]).is_ok());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_table_is_sampled_as_it_says(
        inner in prop::collection::btree_set(1_u32..180_000, 0..20),
        exponents in prop::collection::vec(-10_f32..10.0, 22),
        seed in 0_u64..1000,
    ) {
        let degrees = [0].into_iter().chain(inner).chain([180_000]).map(|i| i as f32 / 1000.0);
        let mut rows: Vec<(f32, f32)> =
            degrees.zip(exponents).map(|(degrees, e)| (degrees, if e < -8.0 { 0.0 } else { e.exp2() })).collect();
        rows.dedup_by(|b, a| b.0 - a.0 < 0.01 && b.0 < 180.0);
        rows[0].1 += 1.0;
        let last = rows.len() - 2;
        if last > 0 && rows[last + 1].0 - rows[last].0 < 0.01 {
            rows.remove(last);
        }
        check(&rows, &mut Random(seed), 10_000);
    }
}
