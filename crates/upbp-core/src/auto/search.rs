//! The candidate with the least product of variance and cost.

use rayon::prelude::*;

use super::candidate::{Candidates, finished};
use super::cost::Cost;
use super::variance::{GROUPS, Variance};
use crate::deadline::Stop;
use crate::plan::Plan;

/// Part of the product that a step must gain. Predictions are noisy, and the least of many is so by chance.
pub(super) const LEAST_GAIN: f64 = 0.05;
/// Part of the product that four times as many light sub-paths as usual must gain. They leave less time for
/// camera sub-paths, of whose variance stratification over iterations takes away more than a prediction
/// knows.
const LEAST_GAIN_OF_MORE: f64 = 0.1;

/// Cells of a pilot render from which on their groups tell how sure a difference is.
const LEAST_CELLS: usize = 2 * GROUPS;

/// The best candidate that small steps from some sensible ones lead to.
pub(super) struct Found {
    pub(super) plan: Plan,
    /// Whether no other candidate is likely to be better by more than [`LEAST_GAIN`].
    pub(super) is_clear: bool,
    /// The relMSE of an iteration.
    pub(super) relative_mse: f64,
    /// Processor nanoseconds of an iteration.
    pub(super) cost: f64,
}

impl Found {
    /// Processor nanoseconds of a render by this plan that ends by `stop`, as far as that can be told without
    /// a clock.
    pub(super) fn work(&self, stop: &Stop) -> f64 {
        let by_iterations = stop.iterations.map(|iterations| iterations as f64);
        let by_error = stop.error.map(|error| self.relative_mse / error);
        let iterations = by_iterations.into_iter().chain(by_error).fold(f64::INFINITY, f64::min);
        iterations * self.cost
    }
}

/// Searches from several starts, and compares the ends directly. Ties go to the plan without light sub-paths,
/// then to the one with more of them: the variance that is lost by tracing fewer sits in rare samples, which
/// a pilot render underestimates. One that met no light, or that has a handful of pixels, tells nothing, and
/// everything may be needed to find some.
pub(super) fn best(variance: &Variance, candidates: &Candidates) -> Found {
    let cost = Cost::of(variance.pilot());
    if !variance.sees_light() || variance.pilot().cells < LEAST_CELLS {
        let plan = finished(candidates.usual);
        return Found { plan, is_clear: false, relative_mse: f64::INFINITY, cost: cost.iteration(&plan) };
    }
    let mut judge = Judge { variance, cost, known: Vec::new() };
    let usual = candidates.usual.light_paths;
    let [camera, paths, everything] = candidates.starts().map(|start| {
        let end = descend(&mut judge, start, candidates);
        let counts = judge.judge(&candidates.light_paths(&end.plan));
        counts.into_iter().fold(end, |a, b| a.or_better(b, usual))
    });
    let least = camera.or_better(paths, usual).or_better(everything, usual);
    let (gain, error) = least.gain_over(&camera);
    let best = if camera.plan.uses_light_paths() || !(gain <= error) { least } else { camera };
    let is_clear = !judge.known.iter().any(|other| other.may_beat(&best));
    // Last, so that a factor cannot tip the choice between plans with and without light sub-paths.
    let factors = judge.judge(&Candidates::camera_factors(&best.plan));
    let best = factors.into_iter().fold(best, |a, b| if b.product() < a.product() { b } else { a });
    let plan = finished(candidates.with_safeguard(best.plan, cost));
    Found { plan, is_clear, relative_mse: variance.relative_mse(&best.plan), cost: cost.iteration(&plan) }
}

/// Takes the steepest step as long as one leads down.
fn descend(judge: &mut Judge<'_>, start: Plan, candidates: &Candidates) -> Judged {
    let mut at = judge.judge(&[start])[0];
    loop {
        let steps = judge.judge(&candidates.steps(&at.plan));
        let better = steps.into_iter().filter(|step| step.beats(&at));
        match better.min_by(|a, b| a.product().total_cmp(&b.product())) {
            Some(next) => at = next,
            None => return at,
        }
    }
}

/// A plan with what is predicted of it.
#[derive(Clone, Copy, Debug)]
struct Judged {
    plan: Plan,
    /// Relative variance of one iteration over sizes of blocks, in parts due to groups of pixels.
    variance: [f64; GROUPS],
    /// Processor nanoseconds of one iteration.
    cost: f64,
}

impl Judged {
    /// The price of an error: variance times time.
    fn product(&self) -> f64 {
        self.variance.iter().sum::<f64>() * self.cost
    }

    /// Takes the other if its product is less: by [`LEAST_GAIN`] for each time that it has a quarter of the
    /// light sub-paths, up to the usual number, and by [`LEAST_GAIN_OF_MORE`] for each time that it has four
    /// times as many beyond it.
    fn or_better(self, other: Self, usual: u32) -> Self {
        let [fewer, more] = log4_path_ratios(&self.plan, &other.plan, usual);
        let needed = (1.0 - LEAST_GAIN).powf(fewer) * (1.0 - LEAST_GAIN_OF_MORE).powf(-more);
        if other.product() < needed * self.product() { other } else { self }
    }

    /// Whether this gains more than the larger of [`LEAST_GAIN`] and the standard error of what it gains.
    fn beats(&self, other: &Self) -> bool {
        if other.product().is_infinite() {
            return self.product().is_finite();
        }
        let (gain, error) = self.gain_over(other);
        gain > error.max(LEAST_GAIN * other.product())
    }

    /// Whether this would gain more than [`LEAST_GAIN`] if it was better by its standard error.
    fn may_beat(&self, other: &Self) -> bool {
        let (gain, error) = self.gain_over(other);
        gain + error > LEAST_GAIN * other.product()
    }

    /// The difference of both products, and its standard error.
    fn gain_over(&self, other: &Self) -> (f64, f64) {
        let differences: [f64; GROUPS] =
            std::array::from_fn(|i| other.cost * other.variance[i] - self.cost * self.variance[i]);
        let n = GROUPS as f64;
        let sum: f64 = differences.iter().sum();
        let spread: f64 = differences.iter().map(|d| (d - sum / n).powi(2)).sum();
        (sum, (n / (n - 1.0) * spread).sqrt())
    }
}

/// Light sub-paths of a plan over those of another, as powers of four: of those up to `usual` each, 0 unless
/// both have some, and of those beyond.
fn log4_path_ratios(plan: &Plan, other: &Plan, usual: u32) -> [f64; 2] {
    let count = |plan: &Plan| if plan.uses_light_paths() { plan.light_paths } else { usual };
    let both = plan.uses_light_paths() && other.uses_light_paths();
    let ratio = |a: u32, b: u32| (f64::from(a) / f64::from(b)).log(4.0);
    let [count, others] = [plan, other].map(count);
    let fewer = if both { ratio(count.min(usual), others.min(usual)) } else { 0.0 };
    [fewer, ratio(count.max(usual), others.max(usual))]
}

/// Predictions of candidates, each made once.
struct Judge<'a> {
    variance: &'a Variance,
    cost: Cost<'a>,
    known: Vec<Judged>,
}

impl Judge<'_> {
    fn judge(&mut self, plans: &[Plan]) -> Vec<Judged> {
        let find = |known: &[Judged], plan| known.iter().find(|judged| judged.plan == plan).copied();
        let new: Vec<_> = plans
            .par_iter()
            .filter(|plan| find(&self.known, **plan).is_none())
            .map(|&plan| Judged {
                plan,
                variance: self.variance.over_scales(&plan),
                cost: self.cost.iteration(&plan),
            })
            .collect();
        self.known.extend(new);
        plans.iter().filter_map(|plan| find(&self.known, *plan)).collect()
    }
}

#[cfg(test)]
mod tests {
    use upbp_estimators::TechniqueSet;

    use super::*;
    use crate::plan::tests::plan;

    fn judged(variance: [f64; GROUPS], cost: f64) -> Judged {
        let plan = Plan { techniques: TechniqueSet::BPT, light_paths: 1, ..plan() };
        Judged { plan, variance, cost }
    }

    #[test]
    fn other_numbers_of_light_sub_paths_must_gain_more() {
        let with = |techniques, light_paths, cost| {
            let judged = judged([1.0; GROUPS], cost);
            Judged { plan: Plan { techniques, light_paths, ..judged.plan }, ..judged }
        };
        let chosen = |a: Judged, b: Judged| {
            let better = a.or_better(b, 1600);
            assert_eq!(better.cost, b.or_better(a, 1600).cost, "whichever comes first");
            better.cost
        };
        let gain = 1.0 - LEAST_GAIN;
        let all = with(TechniqueSet::BPT, 1600, 1.0);
        for (fewer, needed) in [(400, gain), (100, gain * gain)] {
            assert_eq!(chosen(all, with(TechniqueSet::BPT, fewer, 1.01 * needed)), 1.0);
            assert_eq!(chosen(all, with(TechniqueSet::BPT, fewer, 0.99 * needed)), 0.99 * needed);
        }
        // So must more than usual.
        let gain = 1.0 - LEAST_GAIN_OF_MORE;
        for (more, needed) in [(6400, gain), (25600, gain * gain)] {
            for other in [all, with(TechniqueSet::PT, 100, 1.0)] {
                assert_eq!(chosen(other, with(TechniqueSet::BPT, more, 1.01 * needed)), 1.0);
                assert_eq!(chosen(other, with(TechniqueSet::BPT, more, 0.99 * needed)), 0.99 * needed);
            }
        }
        // What has none is compared as it is.
        assert_eq!(chosen(all, with(TechniqueSet::PT, 100, 0.99)), 0.99);
        assert_eq!(chosen(all, with(TechniqueSet::PT, 100, 1.01)), 1.0);
    }

    #[test]
    fn a_step_gains_more_than_a_part_and_more_than_its_error() {
        let all = judged([1.0; GROUPS], 1.0);
        assert!(judged([1.0; GROUPS], 0.94).beats(&all) && !judged([1.0; GROUPS], 0.96).beats(&all));
        assert!(judged([1.0; GROUPS], 0.94).may_beat(&all) && !judged([1.0; GROUPS], 0.96).may_beat(&all));
        // Half of the groups gain, the others lose: the sum gains 20 % with a standard error of 38 %.
        let noisy = judged(std::array::from_fn(|i| if i % 2 == 0 { -0.2 } else { 1.8 }), 1.0);
        let (gain, error) = noisy.gain_over(&all);
        assert!((gain / 8.0 - 0.2).abs() < 1e-9 && (error / 8.0 - 0.378).abs() < 1e-3, "{gain} {error}");
        assert!(!noisy.beats(&all) && noisy.may_beat(&all));
        let impossible = judged([f64::INFINITY; GROUPS], 1.0);
        assert!(all.beats(&impossible) && !impossible.beats(&all) && !impossible.may_beat(&all));
        assert!(!impossible.beats(&impossible));
    }
}
