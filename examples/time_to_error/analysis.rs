//! Slope, time to an error and efficiency, from errors over time.
//!
//! The noise of the reference is independent of the render's, so that its part of a mean squared error is
//! known and taken away. Near that part the rest is uncertain: what is below a tenth of it is left out.

use upbp_core::ErrorPoint;
use upbp_testing::reference::Floor;

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

/// The moment at which an error was reached, in seconds.
pub(crate) enum Reached {
    /// Before the first point.
    Before(f64),
    /// Between two points.
    At(f64),
    /// Later than the end, as far as relMSE falls like 1/t.
    Not(f64),
}

impl Reached {
    /// The seconds alone.
    pub(crate) const fn seconds(&self) -> f64 {
        match *self {
            Self::Before(seconds) | Self::At(seconds) | Self::Not(seconds) => seconds,
        }
    }
}

impl Curve {
    pub(crate) fn new(name: String, series: Vec<(u64, Vec<ErrorPoint>)>, floor: Floor) -> Self {
        let mean = geometric_mean(&series).iter().filter_map(|point| without(point, floor)).collect();
        Self { name, series, floor, mean }
    }

    /// The curves with relMSE over scales for that of pixels. A reference with independent pixels has the
    /// same floor.
    pub(crate) fn over_scales(&self) -> Self {
        let series = self.series.iter().map(|(seed, points)| {
            let over_scales = |p: &ErrorPoint| ErrorPoint { relative_mse: p.over_scales, ..*p };
            (*seed, points.iter().map(over_scales).collect())
        });
        Self::new(self.name.clone(), series.collect(), self.floor)
    }

    /// Seconds and RMSE, the geometric mean over the seeds.
    pub(crate) fn rmse(&self) -> Vec<[f64; 2]> {
        self.mean.iter().map(|point| [point.seconds, point.rmse]).collect()
    }

    /// Slope of log RMSE over log seconds, least squares in the last two thirds on the logarithmic axis of
    /// time.
    pub(crate) fn slope(&self) -> Option<f64> {
        let points: Vec<[f64; 2]> = self.rmse().into_iter().map(|point| point.map(f64::ln)).collect();
        let (first, last) = (points.first()?[0], points.last()?[0]);
        let late = points.into_iter().filter(|[x, _]| *x >= first + (last - first) / 3.0);
        slope(&late.collect::<Vec<_>>())
    }

    /// Seconds until the relMSE fell to `error` for the first time.
    pub(crate) fn time_to(&self, error: f64) -> Option<Reached> {
        let (first, last) = (self.mean.first()?, self.mean.last()?);
        if first.relative_mse <= error {
            return Some(Reached::Before(first.seconds));
        }
        let crossing = self.mean.windows(2).find(|pair| pair[1].relative_mse <= error);
        Some(crossing.map_or(Reached::Not(last.seconds), |pair| Reached::At(crossing_time(pair, error))))
    }

    /// Seconds until the relMSE fell to `error` for good. If it did not, the time at which it would, were the
    /// curve continued with relMSE ∝ 1/t.
    pub(crate) fn time_below(&self, error: f64) -> Option<Reached> {
        let (first, last) = (self.mean.first()?, self.mean.last()?);
        if last.relative_mse > error {
            return Some(Reached::Not(last.seconds * last.relative_mse / error));
        }
        let crossing = self.mean.windows(2).rfind(|pair| pair[0].relative_mse > error);
        let time = crossing.map(|pair| Reached::At(crossing_time(pair, error)));
        Some(time.unwrap_or(Reached::Before(first.seconds)))
    }

    /// relMSE at a time, before the first point and after the last one with relMSE ∝ 1/t.
    pub(crate) fn error_at(&self, seconds: f64) -> Option<f64> {
        let (first, last) = (self.mean.first()?, self.mean.last()?);
        let around = self.mean.windows(2).find(|pair| (pair[0].seconds..=pair[1].seconds).contains(&seconds));
        Some(match around {
            Some([from, to]) => {
                interpolate([from.seconds, from.relative_mse], [to.seconds, to.relative_mse], seconds)
            }
            _ if seconds < first.seconds => first.relative_mse * first.seconds / seconds,
            _ => last.relative_mse * last.seconds / seconds,
        })
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

/// Seconds at which the straight line in logarithmic axes between two points has an error between theirs.
fn crossing_time(pair: &[ErrorPoint], error: f64) -> f64 {
    let [from, to] = [pair[0], pair[1]].map(|point| [point.relative_mse, point.seconds]);
    interpolate(from, to, error)
}

/// The straight line through two points in logarithmic axes.
fn interpolate(from: [f64; 2], to: [f64; 2], x: f64) -> f64 {
    let [[x0, y0], [x1, y1]] = [from, to].map(|point| point.map(f64::ln));
    let part = if x1 == x0 { 1.0 } else { (x.ln() - x0) / (x1 - x0) };
    (y0 + part * (y1 - y0)).exp()
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
            over_scales: mean(|p| p.over_scales),
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

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    fn curve(name: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Curve {
        let point = |(i, (seconds, error)): (usize, (f64, f64))| ErrorPoint {
            seconds,
            iterations: i as u64 + 1,
            relative_mse: error,
            over_scales: error,
            rmse: error.sqrt(),
        };
        let points = points.into_iter().enumerate().map(point).collect();
        Curve::new(name.to_owned(), vec![(1, points)], Floor::default())
    }

    /// relMSE `error / t`, from 1 to 10 seconds.
    pub(crate) fn converging(name: &str, error: f64) -> Curve {
        curve(name, (1..=10).map(|t| (f64::from(t), error / f64::from(t))))
    }

    fn close(a: f64, b: f64) -> bool {
        (a / b - 1.0).abs() < 1e-9
    }

    #[test]
    fn errors_are_interpolated_and_continued() {
        let curve = converging("x", 2.0);
        for seconds in [0.5, 1.0, 2.5, 10.0, 40.0] {
            assert!(close(curve.error_at(seconds).unwrap(), 2.0 / seconds), "{seconds}");
        }
    }

    #[test]
    fn times_to_an_error_say_how_they_were_found() {
        let curve = converging("x", 2.0);
        assert!(matches!(curve.time_below(3.0), Some(Reached::Before(t)) if close(t, 1.0)));
        assert!(matches!(curve.time_below(0.3), Some(Reached::At(t)) if close(t, 2.0 / 0.3)));
        assert!(matches!(curve.time_below(0.1), Some(Reached::Not(t)) if close(t, 20.0)));
    }

    #[test]
    fn what_does_not_last_does_not_count() {
        let bumpy = curve("x", [(1.0, 4.0), (2.0, 1.0), (3.0, 3.0), (4.0, 1.0)]);
        assert!(matches!(bumpy.time_to(2.0), Some(Reached::At(t)) if t < 2.0));
        assert!(matches!(bumpy.time_below(2.0), Some(Reached::At(t)) if (3.0..4.0).contains(&t)));
        let late = curve("x", [(1.0, 1.0), (2.0, 3.0)]);
        assert!(matches!(late.time_below(2.0), Some(Reached::Not(t)) if close(t, 3.0)));
    }

    #[test]
    fn without_points_there_is_no_time() {
        let nothing = curve("x", []);
        assert!(nothing.time_below(1.0).is_none());
        assert!(nothing.error_at(1.0).is_none());
    }
}
