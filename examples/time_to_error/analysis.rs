//! What the errors over time say: slope, time to an error, efficiency.
//!
//! The noise of the reference is independent of the render's, so that its part of a mean squared error is known and
//! taken away. Near that part the rest is uncertain: what is below a tenth of it is left out.

use upbp_core::ErrorPoint;

use crate::subject::Floor;

/// Part of the floor above which a difference to it means something.
const CREDIBLE: f64 = 0.1;

/// The renders of one scene with one set, and their mean.
pub(crate) struct Curve {
    pub(crate) name: String,
    /// By seed.
    pub(crate) series: Vec<(u64, Vec<ErrorPoint>)>,
    floor: Floor,
    /// Geometric means over the seeds of what was taken after the same iteration, without the floor.
    mean: Vec<ErrorPoint>,
}

/// When an error was reached.
pub(crate) enum Reached {
    /// Before the first point.
    Before(f64),
    /// Between two points.
    At(f64),
    /// Not by the end.
    Not(f64),
}

impl Curve {
    pub(crate) fn new(name: String, series: Vec<(u64, Vec<ErrorPoint>)>, floor: Floor) -> Self {
        let mean = geometric_mean(&series).iter().filter_map(|point| without(point, floor)).collect();
        Self { name, series, floor, mean }
    }

    /// Seconds and RMSE, the geometric mean over the seeds.
    pub(crate) fn rmse(&self) -> Vec<[f64; 2]> {
        self.mean.iter().map(|point| [point.seconds, point.rmse]).collect()
    }

    /// Slope of log RMSE over log seconds, least squares in the last two thirds on the logarithmic axis of time.
    pub(crate) fn slope(&self) -> Option<f64> {
        let points: Vec<[f64; 2]> = self.rmse().into_iter().map(|point| point.map(f64::ln)).collect();
        let (first, last) = (points.first()?[0], points.last()?[0]);
        let late = points.into_iter().filter(|[x, _]| *x >= first + (last - first) / 3.0);
        slope(&late.collect::<Vec<_>>())
    }

    /// When the relMSE fell to `error` for the first time.
    pub(crate) fn time_to(&self, error: f64) -> Option<Reached> {
        let (first, last) = (self.mean.first()?, self.mean.last()?);
        if first.relative_mse <= error {
            return Some(Reached::Before(first.seconds));
        }
        let crossing = self.mean.windows(2).find(|pair| pair[1].relative_mse <= error);
        Some(crossing.map_or(Reached::Not(last.seconds), |pair| {
            let [from, to] = [pair[0], pair[1]].map(|p| (p.relative_mse.ln(), p.seconds.ln()));
            let part = (error.ln() - from.0) / (to.0 - from.0);
            Reached::At((from.1 + part * (to.1 - from.1)).exp())
        }))
    }

    /// Means over the seeds at their ends: iterations, seconds, relMSE without the floor.
    pub(crate) fn end(&self) -> (f64, f64, Option<f64>) {
        let ends: Vec<&ErrorPoint> = self.series.iter().filter_map(|(_, points)| points.last()).collect();
        let mean = |value: fn(&ErrorPoint) -> f64| {
            ends.iter().map(|point| value(point)).sum::<f64>() / ends.len().max(1) as f64
        };
        let error = credible(mean(|point| point.relative_mse), self.floor.relative_mse);
        (mean(|point| point.iterations as f64), mean(|point| point.seconds), error)
    }
}

/// A mean squared error without the floor's part of it.
fn credible(square: f64, floor: f64) -> Option<f64> {
    let rest = square - floor;
    (rest > CREDIBLE * floor).then_some(rest)
}

fn without(point: &ErrorPoint, floor: Floor) -> Option<ErrorPoint> {
    let relative_mse = credible(point.relative_mse, floor.relative_mse)?;
    let rmse = credible(point.rmse * point.rmse, floor.rmse * floor.rmse)?.sqrt();
    Some(ErrorPoint { relative_mse, rmse, ..*point })
}

fn geometric_mean(series: &[(u64, Vec<ErrorPoint>)]) -> Vec<ErrorPoint> {
    let Some(((_, first), others)) = series.split_first() else { return Vec::new() };
    let mean_with = |point: &ErrorPoint| {
        let mut same = vec![*point];
        for (_, points) in others {
            same.push(*points.iter().find(|other| other.iterations == point.iterations)?);
        }
        let mean = |value: fn(&ErrorPoint) -> f64| {
            (same.iter().map(|point| value(point).ln()).sum::<f64>() / same.len() as f64).exp()
        };
        Some(ErrorPoint {
            seconds: mean(|p| p.seconds),
            iterations: point.iterations,
            relative_mse: mean(|p| p.relative_mse),
            rmse: mean(|p| p.rmse),
        })
    };
    first.iter().filter_map(mean_with).collect()
}

/// The slope of the straight line with the least squares; `None` if there is none.
fn slope(points: &[[f64; 2]]) -> Option<f64> {
    let n = points.len() as f64;
    let mean = |c: usize| points.iter().map(|point| point[c]).sum::<f64>() / n;
    let (x, y) = (mean(0), mean(1));
    let covariance: f64 = points.iter().map(|point| (point[0] - x) * (point[1] - y)).sum();
    let variance: f64 = points.iter().map(|point| (point[0] - x).powi(2)).sum();
    (points.len() >= 3 && variance > 0.0).then(|| covariance / variance)
}
