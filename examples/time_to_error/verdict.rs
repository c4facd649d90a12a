//! The verdict: how long the automatic choice takes to an error, beside every fixed choice.
//!
//! Each scene has a target of its own: the lowest relMSE that any fixed set has at [`TARGET_PART`] of the
//! time of a line, the geometric mean over the seeds. That set is the best fixed one, with hindsight: no
//! single choice is as good on all scenes, and the lowest of many noisy values is too low by some per cent,
//! so that a ratio of 1 is more than can be asked for. The part is below 1 so that a set that is somewhat
//! slower still gets there in time.
//!
//! The time to the target is where the curve falls below it for good, so that a lucky start followed by a
//! bright sample does not count. A curve that ends above is continued with relMSE ∝ 1/t. This is generous to
//! a set that cannot find all the light, which would never get there.

use std::fmt::Write as _;

use crate::analysis::{Curve, Reached};
use crate::options::{AUTO, EVERYTHING};

/// Part of the time of a line at which the best fixed set defines the target.
const TARGET_PART: f64 = 0.6;

/// Times to the target of one scene.
pub(crate) struct Verdict {
    scene: String,
    /// relMSE.
    target: f64,
    best: String,
    /// By set, `auto` among them.
    times: Vec<(String, Reached)>,
}

impl Verdict {
    /// `None` if there is no fixed set with an error above the noise of the reference.
    pub(crate) fn new(scene: &str, curves: &[Curve], seconds: f64) -> Option<Self> {
        let fixed = curves.iter().filter(|curve| curve.name != AUTO);
        let errors = fixed.filter_map(|curve| Some((curve, curve.error_at(TARGET_PART * seconds)?)));
        // Where everything is the same as a smaller set, that one deserves the name.
        let order = |(curve, error): &(&Curve, f64)| (*error, curve.name == EVERYTHING);
        let (best, target) = errors.min_by(|a, b| {
            let (a, b) = (order(a), order(b));
            a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
        })?;
        let times = curves.iter().filter_map(|curve| Some((curve.name.clone(), curve.time_below(target)?)));
        Some(Self { scene: scene.to_owned(), target, best: best.name.clone(), times: times.collect() })
    }

    fn time(&self, set: &str) -> Option<&Reached> {
        self.times.iter().find(|(name, _)| name == set).map(|(_, time)| time)
    }

    /// Time of one set relative to that of another.
    fn ratio(&self, set: &str, to: &str) -> Option<f64> {
        Some(self.time(set)?.seconds() / self.time(to)?.seconds())
    }

    /// Time of the choice of the program over that of the best fixed set.
    fn loss(&self) -> Option<f64> {
        self.ratio(AUTO, &self.best)
    }
}

/// The tables: scene by scene with the worst loss first, then every fixed set over all scenes.
pub(crate) fn markdown(verdicts: &mut [Verdict]) -> String {
    let worst_first = |a: &Verdict, b: &Verdict| b.loss().unwrap_or(0.0).total_cmp(&a.loss().unwrap_or(0.0));
    verdicts.sort_by(worst_first);
    let mut text = format!(
        "Time to the error of the best fixed set at {TARGET_PART} of the time; `~`: continued with relMSE ∝ 1/t; `<`: \
         from the first point on.\n\n\
         | scene | target relMSE | best fixed | s | auto s | auto / best | everything / auto |\n|---|---|---|---|---|---|---|\n"
    );
    let seconds = |time: Option<&Reached>| match time {
        Some(Reached::Before(seconds)) => format!("< {seconds:.2}"),
        Some(Reached::At(seconds)) => format!("{seconds:.2}"),
        Some(Reached::Not(seconds)) => format!("~ {seconds:.2}"),
        None => "–".to_owned(),
    };
    let number = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |v| format!("{v:.2}"));
    for verdict in &*verdicts {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {} | {:.2e} | {} | {} | {} | {} | {} |",
            verdict.scene,
            verdict.target,
            verdict.best,
            seconds(verdict.time(&verdict.best)),
            seconds(verdict.time(AUTO)),
            number(verdict.loss()),
            number(verdict.ratio(EVERYTHING, AUTO)),
        );
    }
    let names = sets(verdicts);
    let _ =
        writeln!(text, "\nTime to the target of every set, seconds.\n\n| scene | {} |", names.join(" | "));
    let _ = writeln!(text, "|---|{}", "---|".repeat(names.len()));
    for verdict in &*verdicts {
        let times: Vec<String> = names.iter().map(|name| seconds(verdict.time(name))).collect();
        let _ = writeln!(text, "| {} | {} |", verdict.scene, times.join(" | "));
    }
    text += "\nGeometric means over the scenes: time relative to auto, and to the best fixed set of each scene. With \
             times that are continued, lower bounds for sets that miss light.\n\n\
             | set | / auto | / best fixed | worst / best fixed | scenes | continued |\n|---|---|---|---|---|---|\n";
    for name in names {
        let to_auto: Vec<f64> = verdicts.iter().filter_map(|verdict| verdict.ratio(name, AUTO)).collect();
        let to_best: Vec<f64> =
            verdicts.iter().filter_map(|verdict| verdict.ratio(name, &verdict.best)).collect();
        let continued = verdicts.iter().filter(|v| matches!(v.time(name), Some(Reached::Not(_)))).count();
        let _ = writeln!(
            text,
            "| {name} | {} | {} | {} | {} | {continued} |",
            number(geometric_mean(&to_auto)),
            number(geometric_mean(&to_best)),
            number(to_best.iter().copied().reduce(f64::max)),
            to_best.len(),
        );
    }
    text
}

/// All sets with a time, in the order in which they were rendered.
fn sets(verdicts: &[Verdict]) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in verdicts.iter().flat_map(|verdict| &verdict.times) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    names
}

fn geometric_mean(values: &[f64]) -> Option<f64> {
    let sum: f64 = values.iter().map(|value| value.ln()).sum();
    (!values.is_empty()).then(|| (sum / values.len() as f64).exp())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::tests::converging;

    #[test]
    fn twice_the_error_takes_twice_the_time() {
        let curves = [converging("bpt", 1.0), converging("pt", 2.0), converging(AUTO, 1.5)];
        let verdict = Verdict::new("x", &curves, 10.0).unwrap();
        assert_eq!(verdict.best, "bpt");
        assert!((verdict.target - 1.0 / 6.0).abs() < 1e-9, "{}", verdict.target);
        assert!((verdict.time("bpt").unwrap().seconds() - 6.0).abs() < 1e-9);
        // Within the 10 seconds, and beyond.
        assert!(matches!(verdict.time(AUTO), Some(Reached::At(t)) if (t - 9.0).abs() < 1e-9));
        assert!(matches!(verdict.time("pt"), Some(Reached::Not(t)) if (t - 12.0).abs() < 1e-9));
        assert!((verdict.loss().unwrap() - 1.5).abs() < 1e-9);
    }

    #[test]
    fn the_choice_of_the_program_does_not_set_the_target() {
        let curves = [converging("bpt", 1.0), converging(AUTO, 0.5)];
        let verdict = Verdict::new("x", &curves, 10.0).unwrap();
        assert_eq!(verdict.best, "bpt");
        assert!((verdict.loss().unwrap() - 0.5).abs() < 1e-9);
        assert!(Verdict::new("x", &curves[1..], 10.0).is_none());
    }

    #[test]
    fn the_smaller_of_two_equal_sets_is_the_best() {
        let curves = [converging(EVERYTHING, 1.0), converging("bpt", 1.0)];
        assert_eq!(Verdict::new("x", &curves, 10.0).unwrap().best, "bpt");
    }

    #[test]
    fn the_worst_scene_comes_first_and_means_are_geometric() {
        let scene =
            |name, auto| Verdict::new(name, &[converging("bpt", 1.0), converging(AUTO, auto)], 10.0).unwrap();
        let text = markdown(&mut [scene("won", 0.5), scene("lost", 2.0)]);
        assert!(text.find("| lost |").unwrap() < text.find("| won |").unwrap(), "{text}");
        assert!(text.contains("| bpt | 1.00 | 1.00 | 1.00 | 2 | 0 |"), "{text}");
        assert!(text.contains("| auto | 1.00 | 1.00 | 2.00 | 2 | 1 |"), "{text}");
    }

    #[test]
    fn without_a_choice_of_the_program_there_are_no_ratios_to_it() {
        let text = markdown(&mut [Verdict::new("x", &[converging("bpt", 1.0)], 10.0).unwrap()]);
        assert!(text.contains("| bpt | 6.00 | – | – | – |"), "{text}");
    }
}
