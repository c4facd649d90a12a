//! Means with standard errors, and their comparison.

use std::ops::Sub;

/// A mean of independent values, with its standard error.
#[derive(Clone, Copy, Debug, Default)]
pub struct Estimate {
    /// The mean.
    pub mean: f64,
    /// Standard error of the mean.
    pub error: f64,
}

impl Estimate {
    /// Mean and standard error of independent values.
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        Self { mean, error: (variance / n).sqrt() }
    }

    /// Mean and standard error of `n` independent values, from their sum and the sum of their squares.
    pub fn from_sums(n: f64, sum: f64, squares: f64) -> Self {
        let mean = sum / n;
        Self { mean, error: ((squares / n - mean * mean).max(0.0) / (n - 1.0)).sqrt() }
    }

    /// A value that is known.
    pub const fn exactly(mean: f64) -> Self {
        Self { mean, error: 0.0 }
    }

    /// Difference to another independent estimate, in standard errors of the difference.
    pub fn sigmas(&self, other: &Self) -> f64 {
        (self.mean - other.mean) / self.error.hypot(other.error)
    }

    /// Difference relative to `other`, in percent.
    pub fn percent(&self, other: &Self) -> f64 {
        100.0 * (self.mean / other.mean - 1.0)
    }
}

impl Sub for Estimate {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self { mean: self.mean - other.mean, error: self.error.hypot(other.error) }
    }
}

/// Mean and standard error of independent values, per channel.
pub fn channels(values: &[[f64; 3]]) -> [Estimate; 3] {
    std::array::from_fn(|c| Estimate::of(&values.iter().map(|v| v[c]).collect::<Vec<_>>()))
}

/// Asserts that independent estimates agree within 4 standard errors of the difference, per channel, and that
/// such an error is at most a part `noise` of what is expected: with a larger one the test could not tell.
pub fn assert_same(found: [Estimate; 3], expected: [Estimate; 3], noise: f64, what: &str) {
    for (found, expected) in found.iter().zip(&expected) {
        let (sigmas, relative_error) = (found.sigmas(expected), (*found - *expected).error / expected.mean);
        let row = format!(
            "{what}: {found:?}, expected {expected:?}, {sigmas:.2} sigma of {:.2} %",
            100.0 * relative_error
        );
        println!("{row}");
        assert!(sigmas.abs() < 4.0, "{row}");
        assert!(relative_error <= noise, "too noisy to tell: {row}");
    }
}
