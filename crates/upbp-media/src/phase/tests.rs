mod draine;
mod per_channel;
mod tabulated;

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use serde::Deserialize;
use serde::de::IntoDeserializer;
use serde::de::value::{Error, F32Deserializer};

use super::*;
use crate::orthonormal_basis;
use crate::testing::{Random, assert_fits, assert_uniform, integrate_towards_zero};

const LARGEST_BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// Asymmetries of increasing difficulty; each is tested with both signs.
const ASYMMETRIES: [f32; 6] = [0.0, 1e-6, 0.5, 0.9, 0.999, 0.999_99];

fn signed_asymmetries() -> impl Iterator<Item = f32> {
    ASYMMETRIES.into_iter().flat_map(|g| [g, -g])
}

fn henyey_greenstein(g: f32) -> PhaseFunction {
    PhaseFunction::henyey_greenstein(g).unwrap()
}

/// Haze: a narrow peak, a wide one backwards, and a smooth rest.
fn haze() -> PhaseFunction {
    PhaseFunction::blend(vec![
        (3.0, henyey_greenstein(0.95)),
        (1.0, henyey_greenstein(-0.4)),
        (1.0, PhaseFunction::Rayleigh),
        (1.0, PhaseFunction::Isotropic),
    ])
    .unwrap()
}

fn all() -> Vec<PhaseFunction> {
    let mut all = vec![PhaseFunction::Isotropic, PhaseFunction::Rayleigh, haze()];
    all.extend(signed_asymmetries().map(henyey_greenstein));
    all.extend(draine::all());
    all.push(PhaseFunction::two_lobes([0.9, -0.3], 0.7).unwrap());
    all.push(PhaseFunction::per_channel([henyey_greenstein(0.9), haze(), draine::all().remove(0)]));
    all
}

/// The value per steradian of a phase function whose channels are equal, at an angle in radians.
fn at_angle(phase: &PhaseFunction, angle: f32) -> f32 {
    phase.eval(Vec3::Z, Vec3::new(angle.sin(), 0.0, angle.cos())).pdf
}

/// `1 − cos θ` and `1 + cos θ` of two directions, in double precision.
fn deflection(before: Vec3, after: Vec3) -> (f64, f64) {
    let (before, after): (DVec3, DVec3) = (before.as_dvec3().normalize(), after.as_dvec3().normalize());
    (0.5 * (before - after).length_squared(), 0.5 * (before + after).length_squared())
}

/// The phase function in double precision, as textbooks write it but for the cancellation.
fn reference(phase: &PhaseFunction, (one_minus_cos, one_plus_cos): (f64, f64)) -> f64 {
    match phase {
        PhaseFunction::Isotropic => 0.25 / PI,
        PhaseFunction::Rayleigh => 3.0 / (16.0 * PI) * (1.0 + (1.0 - one_minus_cos).powi(2)),
        PhaseFunction::HenyeyGreenstein(g) => {
            let g = f64::from(g.get());
            let distance2 = if g > 0.0 {
                (1.0 - g).powi(2) + 2.0 * g * one_minus_cos
            } else {
                (1.0 + g).powi(2) - 2.0 * g * one_plus_cos
            };
            (1.0 - g * g) / (4.0 * PI * distance2.powf(1.5))
        }
        PhaseFunction::Draine(phase) => draine::reference(phase, (one_minus_cos, one_plus_cos)),
        PhaseFunction::PerChannel(phases) => {
            phases.channels().iter().map(|phase| reference(phase, (one_minus_cos, one_plus_cos)) / 3.0).sum()
        }
        PhaseFunction::Tabulated(_) => unreachable!("tables have their own oracle"),
        PhaseFunction::Blend(blend) => blend
            .parts()
            .iter()
            .map(|(weight, part)| f64::from(*weight) * reference(part, (one_minus_cos, one_plus_cos)))
            .sum(),
    }
}

/// Probability of a smaller cosine than at this angle, in double precision.
fn distribution(phase: &PhaseFunction, (one_minus_cos, one_plus_cos): (f64, f64)) -> f64 {
    let cos = 0.5 * (one_plus_cos - one_minus_cos);
    match phase {
        PhaseFunction::Isotropic => 0.5 * one_plus_cos,
        PhaseFunction::Rayleigh => (cos.powi(3) + 3.0 * cos + 4.0) / 8.0,
        PhaseFunction::HenyeyGreenstein(g) => {
            let g = f64::from(g.get());
            if g.abs() < 1e-5 {
                // To first order in g; the exact form divides by it.
                return 0.5 * one_plus_cos - 0.75 * g * one_minus_cos * one_plus_cos;
            }
            let distance = if g > 0.0 {
                ((1.0 - g).powi(2) + 2.0 * g * one_minus_cos).sqrt()
            } else {
                ((1.0 + g).powi(2) - 2.0 * g * one_plus_cos).sqrt()
            };
            (1.0 - g * g) / (2.0 * g) * (1.0 / distance - 1.0 / (1.0 + g))
        }
        PhaseFunction::Draine(phase) => draine::distribution(phase, (one_minus_cos, one_plus_cos)),
        PhaseFunction::PerChannel(phases) => phases
            .channels()
            .iter()
            .map(|phase| distribution(phase, (one_minus_cos, one_plus_cos)) / 3.0)
            .sum(),
        PhaseFunction::Tabulated(_) => unreachable!("tables have their own oracle"),
        PhaseFunction::Blend(blend) => blend
            .parts()
            .iter()
            .map(|(weight, part)| f64::from(*weight) * distribution(part, (one_minus_cos, one_plus_cos)))
            .sum(),
    }
}

/// Tolerance of a value, relative to the reference. Directions in single precision are unit
/// vectors to about 1e-7, and two of them differ in length by up to 2e-7: the square of that counts, to the
/// power 3/2, against the squared width of the peak, `(1 − |g|)²`.
fn tolerance(phase: &PhaseFunction) -> f64 {
    let width = match phase {
        PhaseFunction::HenyeyGreenstein(g) => 1.0 - f64::from(g.get().abs()),
        PhaseFunction::Draine(draine) => 1.0 - f64::from(draine.g().get().abs()),
        _ => 0.05,
    };
    3e-6 + 6e-14 / (width * width)
}

/// Unit vectors with an angle of about `theta` between them.
fn pair_at(random: &mut Random, theta: f32) -> (Vec3, Vec3) {
    let before = random.direction();
    let (tangent, _) = orthonormal_basis(before);
    (before, (before * theta.cos() + tangent * theta.sin()).normalize())
}

#[test]
fn integrates_to_one() {
    for phase in all() {
        let value = |one_minus_cos: f64, one_plus_cos: f64| {
            let at = Deflection { one_minus_cos: one_minus_cos as f32, one_plus_cos: one_plus_cos as f32 };
            f64::from(phase.value(at).pdf)
        };
        // A hemisphere each, with nodes that crowd towards its pole.
        let forward = integrate_towards_zero(|x| value(x, 2.0 - x), 1.0);
        let backward = integrate_towards_zero(|x| value(2.0 - x, x), 1.0);
        let integral = TAU * (forward + backward);
        assert!((integral - 1.0).abs() < 1e-6, "{phase:?}: {integral}");
    }
}

#[test]
fn mean_cosine_is_the_first_moment() {
    for phase in all() {
        let forward = integrate_towards_zero(|x| (1.0 - x) * reference(&phase, (x, 2.0 - x)), 1.0);
        let backward = integrate_towards_zero(|x| (x - 1.0) * reference(&phase, (2.0 - x, x)), 1.0);
        let moment = TAU * (forward + backward);
        assert!((moment - f64::from(phase.mean_cosine().mean())).abs() < 1e-6, "{phase:?}: {moment}");
    }
}

#[test]
fn eval_is_the_formula_at_every_angle() {
    let mut random = Random(2);
    for phase in all() {
        for exponent in -24..2 {
            for about in [0.0, std::f32::consts::PI] {
                let (before, after) = pair_at(&mut random, about + (exponent as f32).exp2());
                let expected = reference(&phase, deflection(before, after));
                let value = f64::from(phase.eval(before, after).pdf);
                let error = (value / expected - 1.0).abs();
                assert!(error < tolerance(&phase), "{phase:?} at 2^{exponent}: {value}, expected {expected}");
            }
        }
    }
}

#[test]
fn eval_is_symmetric_and_agrees_with_the_cosine() {
    let mut random = Random(3);
    for phase in all() {
        for _ in 0..1000 {
            let (before, after) = (random.direction(), random.direction());
            let value = phase.eval(before, after);
            assert_eq!(value, phase.eval(after, before));
            assert_eq!(value, phase.eval(-before, -after));
        }
    }
}

#[test]
fn sample_reports_the_density_of_its_direction() {
    let mut random = Random(4);
    for phase in all() {
        for _ in 0..20_000 {
            let before = random.direction();
            let sample = phase.sample::<f64>(before, (), &(), [random.uniform(), random.uniform()]);
            assert!((sample.after.length() - 1.0).abs() < 2e-7);
            assert_eq!(sample.pdf, f64::from(phase.eval(before, sample.after).pdf));
            let expected = reference(&phase, deflection(before, sample.after));
            let error = (sample.pdf / expected - 1.0).abs();
            assert!(error < tolerance(&phase), "{phase:?}: {error}");
        }
    }
}

#[test]
fn sample_survives_the_ends_of_the_random_numbers() {
    for phase in all() {
        for before in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_Z, Vec3::splat(-3.0_f32.sqrt().recip())] {
            for u_angle in [0.0, f32::EPSILON / 2.0, 0.5, LARGEST_BELOW_ONE] {
                for u_azimuth in [0.0, 0.5, LARGEST_BELOW_ONE] {
                    let sample = phase.sample::<f64>(before, (), &(), [u_angle, u_azimuth]);
                    assert!((sample.after.length() - 1.0).abs() < 2e-7, "{phase:?}: {sample:?}");
                    assert!(sample.pdf.is_finite() && sample.pdf > 0.0, "{phase:?}: {sample:?}");
                }
            }
        }
    }
}

#[test]
fn forward_peak_goes_forward() {
    let mut random = Random(5);
    for _ in 0..10_000 {
        let before = random.direction();
        let u = [random.uniform(), random.uniform()];
        // Half of all angles of g = 0.999999 are below 1.7e-6; the fraction above 0.01 is 5e-5.
        let forward = henyey_greenstein(0.999_999).sample::<f64>(before, (), &(), u).after;
        let backward =
            henyey_greenstein(-0.999_999).sample::<f64>(before, (), &(), [1.0 - u[0].max(1e-3), u[1]]).after;
        if u[0] > 1e-3 {
            assert!(forward.distance(before) < 2e-3, "{before} became {forward} at {u:?}");
        }
        assert!(backward.distance(-before) < 2e-3, "{before} became {backward} at {u:?}");
    }
    let peak = henyey_greenstein(0.9);
    assert!(peak.eval(Vec3::X, Vec3::X).pdf > 1000.0 * peak.eval(Vec3::X, Vec3::NEG_X).pdf);
}

#[test]
fn the_narrowest_peaks_stay_finite() {
    for g in [LARGEST_BELOW_ONE, -LARGEST_BELOW_ONE] {
        let phase = henyey_greenstein(g);
        let mut random = Random(6);
        for _ in 0..1000 {
            let before = random.direction();
            for u in [0.0, random.uniform(), LARGEST_BELOW_ONE] {
                let sample = phase.sample::<f64>(before, (), &(), [u, random.uniform()]);
                assert!(sample.after.is_normalized());
                assert!(sample.pdf.is_finite() && sample.pdf > 0.0, "{g}: {sample:?}");
            }
        }
        assert!(phase.eval(Vec3::Z, g.signum() * Vec3::Z).pdf.is_finite());
    }
}

#[test]
fn sampled_angles_follow_the_distribution() {
    let mut random = Random(7);
    for phase in all() {
        let levels = (0..200_000).map(|_| {
            let before = random.direction();
            let after = phase.sample::<f64>(before, (), &(), [random.uniform(), random.uniform()]).after;
            distribution(&phase, deflection(before, after))
        });
        assert_uniform(levels, &format!("{phase:?}"));
    }
}

/// The sine is what the textbook sampler loses: 96 % of its samples at g = 0.99999 have none.
#[test]
fn sampled_sines_follow_the_distribution() {
    let mut random = Random(8);
    for phase in signed_asymmetries().map(henyey_greenstein) {
        let levels = (0..200_000).map(|_| {
            let before = random.direction();
            let after = phase.sample::<f64>(before, (), &(), [random.uniform(), random.uniform()]).after;
            let sine = before.as_dvec3().cross(after.as_dvec3()).length().min(1.0);
            // Probability of a smaller sine: the caps around both poles. 1 − cos from the sine, stably.
            let small = sine * sine / (1.0 + (1.0 - sine * sine).sqrt());
            let forward = 1.0 - distribution(&phase, (small, 2.0 - small));
            let backward = distribution(&phase, (2.0 - small, small));
            forward + backward
        });
        assert_uniform(levels, &format!("{phase:?}"));
    }
}

#[test]
fn sampled_azimuths_are_uniform_around_the_propagation() {
    let mut random = Random(9);
    for phase in [PhaseFunction::Rayleigh, haze(), henyey_greenstein(0.9)] {
        let levels = (0..100_000).map(|_| {
            let before = random.direction();
            let after = phase.sample::<f64>(before, (), &(), [random.uniform(), random.uniform()]).after;
            let (tangent, bitangent) = orthonormal_basis(before);
            (f64::from(after.dot(bitangent)).atan2(f64::from(after.dot(tangent))) / TAU).rem_euclid(1.0)
        });
        assert_uniform(levels, &format!("{phase:?}"));
    }
}

/// Cells over the whole sphere in fixed coordinates: angle, azimuth and density at once.
#[test]
fn sampled_directions_fit_the_density() {
    const ROWS: usize = 8;
    const COLUMNS: usize = 8;
    const SAMPLES: usize = 200_000;
    let mut random = Random(10);
    let before = Vec3::new(0.3, -0.5, -0.7).normalize();
    for phase in
        [PhaseFunction::Isotropic, PhaseFunction::Rayleigh, henyey_greenstein(-0.6), henyey_greenstein(0.6)]
    {
        let mut observed = [0_u32; ROWS * COLUMNS];
        for _ in 0..SAMPLES {
            let after = phase.sample::<f64>(before, (), &(), [random.uniform(), random.uniform()]).after;
            let row = (0.5 * (after.z + 1.0) * ROWS as f32) as usize;
            let turn = (after.y.atan2(after.x) / std::f32::consts::TAU).rem_euclid(1.0);
            let column = (turn * COLUMNS as f32) as usize;
            observed[row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)] += 1;
        }
        let cell_area = 4.0 * PI / (ROWS * COLUMNS) as f64;
        let expected: Vec<f64> = (0..ROWS * COLUMNS)
            .map(|cell| {
                let fine = 40;
                let mean = (0..fine * fine)
                    .map(|i| {
                        let along = |whole: usize, part: usize, cells: usize| {
                            (whole as f64 + (part as f64 + 0.5) / fine as f64) / cells as f64
                        };
                        let z = 2.0 * along(cell / COLUMNS, i / fine, ROWS) - 1.0;
                        let (sin, cos) = (TAU * along(cell % COLUMNS, i % fine, COLUMNS)).sin_cos();
                        let radius = (1.0 - z * z).sqrt();
                        let after = DVec3::new(radius * cos, radius * sin, z).as_vec3();
                        f64::from(phase.eval(before, after).pdf)
                    })
                    .sum::<f64>()
                    / (fine * fine) as f64;
                mean * cell_area * SAMPLES as f64
            })
            .collect();
        assert_fits(&observed, &expected, &format!("{phase:?}"));
    }
}

#[test]
fn a_blend_is_the_weighted_sum() {
    let mut random = Random(11);
    let (peak, smooth) = (henyey_greenstein(0.8), PhaseFunction::Rayleigh);
    let blend = PhaseFunction::blend(vec![(6.0, peak.clone()), (2.0, smooth.clone())]).unwrap();
    for _ in 0..100 {
        let (before, after) = (random.direction(), random.direction());
        let sum = 0.75 * peak.eval(before, after).pdf + 0.25 * smooth.eval(before, after).pdf;
        assert!((blend.eval(before, after).pdf / sum - 1.0).abs() < 1e-6);
    }
    assert!((blend.mean_cosine().mean() - 0.6).abs() < 1e-6);
}

#[test]
fn a_blend_of_blends_is_flat() {
    let inner = PhaseFunction::blend(vec![(1.0, PhaseFunction::Rayleigh), (3.0, henyey_greenstein(0.5))]);
    let outer = PhaseFunction::blend(vec![(1.0, inner.unwrap()), (1.0, PhaseFunction::Isotropic)]).unwrap();
    let PhaseFunction::Blend(blend) = outer else { panic!("not a blend") };
    let expected =
        [(0.125, PhaseFunction::Rayleigh), (0.375, henyey_greenstein(0.5)), (0.5, PhaseFunction::Isotropic)];
    assert_eq!(blend.parts(), expected);
}

#[test]
fn blend_weights_of_any_size_are_scaled() {
    let blend = |weights: [f32; 3]| {
        let parts = weights.map(|weight| (weight, henyey_greenstein(0.5)));
        PhaseFunction::blend(parts.to_vec()).unwrap()
    };
    let expected = henyey_greenstein(0.5).eval(Vec3::X, Vec3::Y).pdf;
    for weights in [[1.0; 3], [f32::MAX; 3], [1e-45; 3], [f32::MAX, 1e-45, 1.0], [1e-45, f32::MAX, 1e-45]] {
        let phase = blend(weights);
        assert!((phase.eval(Vec3::X, Vec3::Y).pdf / expected - 1.0).abs() < 1e-6, "{weights:?}");
        let PhaseFunction::Blend(parts) = &phase else { panic!("not a blend") };
        assert!(parts.parts().iter().all(|&(weight, _)| weight > 0.0), "{weights:?}");
        for u in [0.0, 0.3, 0.7, LARGEST_BELOW_ONE] {
            let sample = phase.sample::<f64>(Vec3::X, (), &(), [u, u]);
            assert!(sample.after.is_normalized() && sample.pdf.is_finite(), "{weights:?}");
        }
    }
}

#[test]
fn constructors_name_what_is_wrong() {
    for g in [1.0, -1.0, f32::NAN, f32::INFINITY] {
        assert!(PhaseFunction::henyey_greenstein(g).is_err());
    }
    let message = |result: Result<PhaseFunction, MediaError>| result.unwrap_err().to_string();
    assert_eq!(
        message(PhaseFunction::henyey_greenstein(1.5)),
        "the asymmetry is 1.5, expected a number above -1 and below 1",
    );
    let parts = |weight| vec![(1.0, PhaseFunction::Isotropic), (weight, PhaseFunction::Rayleigh)];
    assert_eq!(
        message(PhaseFunction::blend(parts(-2.0))),
        "blend weight 1 is -2, expected a finite number above zero",
    );
    for weight in [0.0, f32::NAN, f32::INFINITY] {
        assert!(PhaseFunction::blend(parts(weight)).is_err());
    }
    assert_eq!(
        message(PhaseFunction::blend(Vec::new())),
        "the blend of phase functions is empty, expected at least one part",
    );
}

#[test]
fn asymmetry_is_validated_when_read() {
    let read = |g: f32| {
        let number: F32Deserializer<Error> = g.into_deserializer();
        Asymmetry::deserialize(number)
    };
    assert_eq!(read(0.5).map(Asymmetry::get), Ok(0.5));
    assert!(read(1.0).unwrap_err().to_string().contains("the asymmetry is 1"));
}
