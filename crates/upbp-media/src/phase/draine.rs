//! The phase function of Draine: that of Henyey and Greenstein times `1 + α cos² θ`.
//!
//! Source: Draine, "Scattering by interstellar dust grains", `ApJ` 598, 2003; its parameters for water
//! droplets: Jendersie and d'Eon, "An approximate Mie scattering function for fog and cloud rendering",
//! SIGGRAPH Talks 2023. The inversion: `docs/theory.md`, section 7. Oracle: `tests` of the parent module.

use super::deflection::Deflection;
use super::{Asymmetry, henyey_greenstein};
use crate::MediaError;

/// The phase function of Draine. With `g = 0` and `α = 1` it is Rayleigh's, with `α = 1` that of Cornette and
/// Shanks, with `α = 0` that of Henyey and Greenstein.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Draine {
    g: Asymmetry,
    alpha: f32,
    /// One over the mean of `1 + α cos² θ` under Henyey and Greenstein's function.
    constant: f32,
    /// `α` over that mean.
    quadratic: f32,
}

impl Draine {
    pub(super) fn new(g: f32, alpha: f32) -> Result<Self, MediaError> {
        let g = Asymmetry::new(g)?;
        if !(alpha.is_finite() && alpha >= 0.0) {
            let (what, expected) = ("the factor of the squared cosine", "a finite number of at least zero");
            return Err(MediaError::OutOfRange { what, value: alpha, expected });
        }
        let mean = mean_factor(g, alpha);
        let (constant, quadratic) = (mean.recip() as f32, (f64::from(alpha) / mean) as f32);
        Ok(Self { g, alpha, constant, quadratic })
    }

    /// The asymmetry of the factor that is Henyey and Greenstein's, not the mean cosine.
    #[must_use]
    pub const fn g(&self) -> Asymmetry {
        self.g
    }

    /// The factor of the squared cosine.
    #[must_use]
    pub const fn alpha(&self) -> f32 {
        self.alpha
    }

    /// `(1 + α cos² θ) / (1 + α (1 + 2 g²) / 3)` times Henyey and Greenstein's, per steradian.
    #[inline]
    pub(super) fn value(&self, deflection: Deflection<f32>) -> f32 {
        let cos = deflection.cosine();
        henyey_greenstein::value(self.g, deflection) * (self.constant + self.quadratic * cos * cos)
    }

    pub(super) fn mean_cosine(&self) -> f32 {
        let (g, alpha) = (f64::from(self.g.get()), f64::from(self.alpha));
        (g * (1.0 + alpha * (3.0 + 2.0 * g * g) / 5.0) / mean_factor(self.g, self.alpha)) as f32
    }

    /// The angle at the fraction `u` of the distribution, counted from straight back.
    ///
    /// Jendersie and d'Eon solve the quartic in closed form, which divides by `g` and `α` and cancels at the
    /// ends. Here the unknown is the fraction of Henyey and Greenstein's distribution, in which the same
    /// quartic has no narrow peak, and Newton's steps reach rounding.
    pub(super) fn sample(&self, u: f32) -> Deflection<f64> {
        let u = f64::from(u);
        let (mut low, mut high) = (0.0, 1.0);
        let (mut fraction, mut error_before) = (u, f64::INFINITY);
        for _ in 0..MAX_STEPS {
            let (distribution, slope) = self.distribution(fraction);
            let error = distribution - u;
            if error.abs() <= ROUNDING {
                break;
            }
            if error > 0.0 {
                high = fraction;
            } else {
                low = fraction;
            }
            let newton = fraction - error / slope;
            // Where the factor is all but flat, about the horizon, Newton's steps may cycle.
            let converges = newton > low && newton < high && error.abs() < 0.5 * error_before;
            fraction = if converges { newton } else { 0.5 * (low + high) };
            error_before = error.abs();
        }
        henyey_greenstein::sample(self.g, fraction)
    }

    /// Draine's distribution function at the fraction `v` of Henyey and Greenstein's, both counted from
    /// straight back, and its derivative.
    fn distribution(&self, v: f64) -> (f64, f64) {
        let (g, alpha) = (f64::from(self.g.get()), f64::from(self.alpha));
        let (a, b2) = (1.0 - g, (1.0 + g).powi(2));
        let q = a + 2.0 * g * v;
        let cos = 2.0 * b2 * v * (a + g * v) / (q * q) - 1.0;
        // The integral of the squared cosine, by powers of 1 + cos.
        let squared = v + v * v * b2 / q * (b2 * v * (3.0 * q + a) / (3.0 * q * q) - 2.0);
        let mean = mean_factor(self.g, self.alpha);
        ((v + alpha * squared) / mean, (1.0 + alpha * cos * cos) / mean)
    }
}

/// The most steps of the inversion: each second one halves the bracket at least.
const MAX_STEPS: u32 = 120;

/// The error of a fraction below which the inversion stops.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// The mean of `1 + α cos² θ` under Henyey and Greenstein's function.
fn mean_factor(g: Asymmetry, alpha: f32) -> f64 {
    let g = f64::from(g.get());
    1.0 + f64::from(alpha) * (1.0 + 2.0 * g * g) / 3.0
}

/// The mixture that approximates Mie scattering of visible light by water droplets in air: the asymmetry of a
/// lobe of Henyey and Greenstein; asymmetry and `α` of one of Draine; the share of the latter.
///
/// Equations 4 to 7 of Jendersie and d'Eon, and those for smaller droplets in their supplement.
pub(super) fn droplets(diameter_um: f32) -> Result<([f32; 3], f32), MediaError> {
    let d = f64::from(diameter_um);
    let log = d.ln();
    let (g_hg, g, alpha, share) = if !(d > 0.0 && d <= 50.0) {
        let (what, expected) = ("the diameter of droplets", "a number above 0 and up to 50 micrometres");
        return Err(MediaError::OutOfRange { what, value: diameter_um, expected });
    } else if d <= 0.1 {
        (13.8 * d * d, 1.1456 * d * (9.29044 * d).sin(), 250.0, 0.252_977 - 312.983 * d.powf(4.3))
    } else if d < 1.5 {
        let inner = (log - 0.238_604) * (log + 1.00667) / (0.507_522 - 0.15677 * log);
        let turn = 1.19692 * inner.cos() + 1.37932 * log + 0.062_583_5;
        let share = 0.146_209 * (3.38707 * log + 2.11193).cos() + 0.316_072 + 0.077_891_7 * log;
        (0.862 - 0.143 * log * log, 0.379_685 * turn.cos() + 0.344_213, 250.0, share)
    } else if d < 5.0 {
        let log_log = log.ln();
        let g = 0.500_411 - 0.081_287 / (-2.0 * log + log.tan() + 1.27551);
        let share = 0.026_914 * (log - (5.68947 * (log_log - 0.029_214_9)).cos()) + 0.376_475;
        (0.060_493_1 * log_log + 0.940_256, g, 7.30354 * log + 6.31675, share)
    } else {
        let g = (-2.20679 / (d + 3.91029) - 0.428_934).exp();
        let alpha = (3.62489 - 8.29288 / (d + 5.52825)).exp();
        let share = (-0.599_085 / (d - 0.641_583) - 0.665_888).exp();
        ((-0.099_056_7 / (d - 1.67154)).exp(), g, alpha, share)
    };
    Ok(([g_hg as f32, g as f32, alpha as f32], share as f32))
}
