//! The record of a render: times, counts, errors against a reference.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use upbp_estimators::Counters;

/// Wall seconds of the passes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct PassSeconds {
    /// The preparation, with its pilot renders.
    pub preparation: f64,
    /// Light sub-paths, with their splats.
    pub light: f64,
    /// Building the trees of photons and beams.
    pub build: f64,
    /// Camera sub-paths, with all photon queries.
    pub camera: f64,
    /// Adding to the film, and estimates of the error.
    pub film: f64,
}

impl PassSeconds {
    /// Wall seconds of all passes together.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.preparation + self.light + self.build + self.camera + self.film
    }
}

/// Wall time of the passes, in whole nanoseconds: sums do not depend on the order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct PassTimes {
    pub(crate) preparation: Duration,
    pub(crate) light: Duration,
    pub(crate) build: Duration,
    pub(crate) camera: Duration,
    pub(crate) film: Duration,
}

impl PassTimes {
    pub(crate) fn add(&mut self, other: &Self) {
        let sum = |a: &mut Duration, b| *a = a.saturating_add(b);
        sum(&mut self.preparation, other.preparation);
        sum(&mut self.light, other.light);
        sum(&mut self.build, other.build);
        sum(&mut self.camera, other.camera);
        sum(&mut self.film, other.film);
    }

    pub(crate) fn seconds(&self) -> PassSeconds {
        PassSeconds {
            preparation: self.preparation.as_secs_f64(),
            light: self.light.as_secs_f64(),
            build: self.build.as_secs_f64(),
            camera: self.camera.as_secs_f64(),
            film: self.film.as_secs_f64(),
        }
    }
}

/// The error at some moment of a render, against a reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorPoint {
    /// Seconds of rendering, without comparisons with the reference.
    pub seconds: f64,
    /// Whole iterations done.
    pub iterations: u64,
    /// Mean of `(x − r)² / (r² + 0.01)`.
    pub relative_mse: f64,
    /// [relMSE over scales](crate::Image::relative_mse_over_scales).
    pub over_scales: f64,
    /// Root mean squared difference.
    pub rmse: f64,
}

/// Errors over time, of any length of a render in bounded space: every iteration up to the hundredth, then
/// one per hundredth of the number of iterations, and the latest.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ErrorSeries(Vec<ErrorPoint>);

impl ErrorSeries {
    /// Least ratio of the numbers of iterations of two points that are kept.
    const SPACING: f64 = 1.01;

    /// Adds a point, which replaces those that have as many iterations or more.
    pub(crate) fn push(&mut self, point: ErrorPoint) {
        while self.0.last().is_some_and(|last| last.iterations >= point.iterations) {
            self.0.pop();
        }
        if let [.., before, last] = self.0.as_mut_slice()
            && (last.iterations as f64) < Self::SPACING * before.iterations as f64
        {
            *last = point;
        } else {
            self.0.push(point);
        }
    }

    /// The points that were kept.
    #[must_use]
    pub fn points(&self) -> &[ErrorPoint] {
        &self.0
    }
}

/// Times and counts of a render, besides the film. All add up.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Record {
    pub(crate) times: PassTimes,
    pub(crate) counters: Counters,
    /// Largest number of bytes that light vertices, beams and their trees took.
    pub(crate) map_bytes: u64,
    /// Bytes that the render is expected to need.
    pub(crate) expected_bytes: u64,
    pub(crate) series: ErrorSeries,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_series_has_ascending_iterations_and_few_points() {
        let mut series = ErrorSeries::default();
        let point = |iterations| ErrorPoint {
            seconds: 1.0,
            iterations,
            relative_mse: f64::NAN,
            over_scales: f64::NAN,
            rmse: f64::NAN,
        };
        (0..1000).chain(0..100_000).for_each(|iterations| series.push(point(iterations)));
        (0..1000).for_each(|_| series.push(point(100_000)));
        let iterations: Vec<_> = series.points().iter().map(|point| point.iterations).collect();
        assert!(iterations.is_sorted_by(|a, b| a < b) && iterations.len() < 1000, "{}", iterations.len());
        assert_eq!((iterations[99], iterations.last()), (99, Some(&100_000)));
    }
}
