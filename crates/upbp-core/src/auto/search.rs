//! The plan with the least product of variance and cost.

use std::num::NonZeroU32;
use std::ops::Range;

use rayon::prelude::*;
use upbp_estimators::{LookUps, Technique, TechniqueSet};

use super::cost::Costs;
use super::pilot_render::recorder::TECHNIQUES;
use super::pilot_render::roulette::TRIAL;
use super::variance::{Counts, GROUPS, Prediction};
use crate::auto::choices::BEAMS;

/// A plan that may be chosen. Numbers of sub-paths are relative to the trial's plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Candidate {
    pub(crate) techniques: TechniqueSet,
    pub(crate) light_paths: f64,
    pub(crate) beam_paths: f64,
    /// Connections per camera vertex, likewise.
    pub(crate) connections: f64,
    /// The radius of surface merging, likewise.
    pub(crate) surf_radius: f64,
    /// Merges whose photons only some iterations look up.
    pub(crate) seldom: TechniqueSet,
    /// The number of a roulette.
    pub(crate) roulette: usize,
}

/// What a candidate may be.
#[derive(Clone, Debug)]
pub(crate) struct Bounds {
    /// All techniques that the scene can use.
    pub(crate) techniques: TechniqueSet,
    /// Those that stay on: some path may have no other.
    pub(crate) always: TechniqueSet,
    /// Those that a plan with light sub-paths has at least seldom: there may be light that a trial misses.
    pub(crate) careful: TechniqueSet,
    /// Numbers of light sub-paths, relative to the trial's plan; ascending, with 1.
    pub(crate) light_paths: Vec<f64>,
    /// The same of those with photon beams.
    pub(crate) beam_paths: Vec<f64>,
    /// The light sub-paths of the trial's plan over those of them with beams.
    pub(crate) paths_per_beam_path: f64,
    /// Connections per camera vertex, likewise. None more than one: a trial does not tell what several at a vertex have in common.
    pub(crate) connections: Vec<f64>,
    /// Radii of surface merging, likewise; ascending, the usual one first.
    pub(crate) surf_radii: Vec<f64>,
    /// Numbers of roulettes, ascending.
    pub(crate) roulettes: Range<usize>,
}

/// One of so many iterations looks up what is looked up seldom.
const SELDOM: NonZeroU32 = NonZeroU32::new(8).unwrap();

impl Candidate {
    /// All that is possible, as much of it as there may be, with the usual radius.
    pub(crate) fn everything(bounds: &Bounds) -> Self {
        Self {
            techniques: bounds.techniques,
            light_paths: 1.0,
            beam_paths: 1.0,
            connections: 1.0,
            surf_radius: bounds.surf_radii.first().copied().unwrap_or(1.0),
            seldom: TechniqueSet::EMPTY,
            roulette: TRIAL,
        }
    }

    /// The same with beams from no more light sub-paths than there are.
    fn possible(self, bounds: &Bounds) -> Self {
        let most = self.light_paths * bounds.paths_per_beam_path;
        let beam_paths =
            if self.techniques.intersects(BEAMS) { self.beam_paths.min(most) } else { self.beam_paths };
        Self { beam_paths, ..self }
    }

    /// The part of the iterations that make the look-up of a technique.
    pub(crate) fn look_up(&self, technique: Technique) -> f64 {
        1.0 / f64::from(self.look_ups().period(technique))
    }

    /// As a stage has it.
    pub(crate) fn look_ups(&self) -> LookUps {
        LookUps::from_fn(|technique| if self.seldom.has(technique) { SELDOM } else { NonZeroU32::MIN })
    }

    /// The light sub-paths that a technique uses.
    pub(crate) fn paths(&self, technique: Technique) -> f64 {
        if BEAMS.has(technique) { self.beam_paths } else { self.light_paths }
    }

    /// Photons or beams within reach of a look-up.
    pub(crate) fn photons(&self, technique: Technique) -> f64 {
        let kernel = if technique == Technique::Surf { self.surf_radius.powi(2) } else { 1.0 };
        kernel * self.paths(technique)
    }

    /// Whether any technique uses light sub-paths.
    pub(crate) fn needs_light(&self) -> bool {
        !self.techniques.without(TechniqueSet::PT).is_empty()
    }

    /// How often another's light sub-paths have to be quartered to be as few as its own; zero unless both have some.
    fn quarterings(&self, other: &Self) -> f64 {
        let both = self.needs_light() && other.needs_light();
        if both { (other.light_paths / self.light_paths).log(4.0) } else { 0.0 }
    }

    fn counts(&self) -> Counts {
        let paths = [self.light_paths, self.beam_paths];
        let mut counts = Counts {
            relative: [0.0; TECHNIQUES],
            paths,
            look_ups: [1.0; TECHNIQUES],
            roulette: self.roulette,
        };
        // Camera sub-paths are never told apart by how they find the light.
        counts.relative[Technique::Hit as usize] = 1.0;
        counts.relative[Technique::Nee as usize] = 1.0;
        for technique in self.techniques.without(TechniqueSet::PT).iter() {
            let p = self.look_up(technique);
            counts.look_ups[technique as usize] = p;
            counts.relative[technique as usize] = match technique {
                Technique::Hit | Technique::Nee => 1.0,
                Technique::Connect => self.connections,
                _ => p * self.photons(technique),
            };
        }
        counts
    }
}

/// A candidate with what is predicted of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Judged {
    pub(crate) candidate: Candidate,
    /// Relative variance of one iteration, in parts due to groups of pixels.
    pub(crate) variance: [f64; GROUPS],
    /// Nanoseconds of one iteration, on one thread.
    pub(crate) cost: f64,
}

impl Judged {
    /// What an error costs: variance times time.
    pub(crate) fn product(&self) -> f64 {
        self.variance.iter().sum::<f64>() * self.cost
    }

    /// This, unless the other's product is less: by `gain` for each time that the other's light sub-paths are quartered.
    fn or_less(self, other: Self, gain: f64) -> Self {
        let needed = gain.powf(other.candidate.quarterings(&self.candidate));
        if other.product() < needed * self.product() { other } else { self }
    }

    /// Whether the product is less than `gain` times the other's, and by more than the uncertainty of that.
    fn beats(&self, other: &Self, gain: f64) -> bool {
        if other.product().is_infinite() {
            return self.product().is_finite();
        }
        let differences: [f64; GROUPS] =
            std::array::from_fn(|i| gain * other.cost * other.variance[i] - self.cost * self.variance[i]);
        let n = GROUPS as f64;
        let sum: f64 = differences.iter().sum();
        let spread: f64 = differences.iter().map(|d| (d - sum / n).powi(2)).sum();
        sum > (n / (n - 1.0) * spread).sqrt()
    }
}

/// Judges candidates, each once.
struct Judge<'a> {
    prediction: &'a Prediction,
    costs: &'a Costs,
    known: Vec<Judged>,
}

impl Judge<'_> {
    /// The judgement of each.
    fn judge(&mut self, candidates: &[Candidate]) -> Vec<Judged> {
        let find =
            |known: &[Judged], candidate| known.iter().find(|judged| judged.candidate == candidate).copied();
        let new: Vec<_> = candidates
            .par_iter()
            .filter(|candidate| find(&self.known, **candidate).is_none())
            .map(|&candidate| Judged {
                candidate,
                variance: self.prediction.relative_variance(&candidate.counts()),
                cost: self.costs.iteration(&candidate),
            })
            .collect();
        self.known.extend(new);
        candidates.iter().filter_map(|candidate| find(&self.known, *candidate)).collect()
    }
}

/// The best candidate that small steps from some sensible ones lead to. A step must make the product smaller by the factor
/// `gain`: predictions are noisy, and the least of many is so by chance. Where the ways end there are only a few. None is to be
/// preferred, but that without light sub-paths, if no other is better by more than its uncertainty, and those with more light
/// sub-paths to those with fewer, by `gain` for each quartering: what fewer lose is in few samples, of which most trials see too little.
pub(crate) fn best(prediction: &Prediction, costs: &Costs, bounds: &Bounds, gain: f64) -> Candidate {
    let mut judge = Judge { prediction, costs, known: Vec::new() };
    let less = |a: Judged, b: Judged| a.or_less(b, gain);
    let [camera, paths, everything] = starts(bounds, Candidate::everything(bounds)).map(|start| {
        let end = descend(&mut judge, start, bounds, gain);
        let end = judge.judge(&numbers_of_light_paths(&end.candidate, bounds)).into_iter().fold(end, less);
        with_roulette(&mut judge, end, bounds)
    });
    let least = less(less(camera, paths), everything);
    let best = if camera.candidate.needs_light() || least.beats(&camera, 1.0) { least } else { camera };
    insured(best.candidate, costs, bounds)
}

/// Goes the steepest way as long as there are steps down.
fn descend(judge: &mut Judge<'_>, start: Candidate, bounds: &Bounds, gain: f64) -> Judged {
    /// What a wider radius and more beams than the trial has must gain: the blur of the one is not predicted, and the gain by the
    /// others is predicted too large.
    const BEYOND: f64 = 0.8;
    let mut at = judge.judge(&[start])[0];
    loop {
        let steps = judge.judge(&steps(&at.candidate, bounds));
        let needed = |step: &Judged| {
            let wider = step.candidate.surf_radius > at.candidate.surf_radius;
            let more = step.candidate.beam_paths > at.candidate.beam_paths.max(1.0);
            if wider || more { BEYOND.min(gain) } else { gain }
        };
        let better = steps.into_iter().filter(|step| step.beats(&at, needed(step)));
        match better.min_by(|a, b| a.product().total_cmp(&b.product())) {
            Some(next) => at = next,
            None => return at,
        }
    }
}

/// The same with the roulette that ends least walks of those that are nearly as good as the best. Random numbers of camera sub-paths are
/// stratified, of which trials know the first ones only: it makes all that does not come from roulette smaller.
///
/// After all else, so that there are fewer candidates on the way.
fn with_roulette(judge: &mut Judge<'_>, at: Judged, bounds: &Bounds) -> Judged {
    const NEARLY: f64 = 1.05;
    let with = |roulette| Candidate { roulette, ..at.candidate };
    let all = judge.judge(&bounds.roulettes.clone().map(with).collect::<Vec<_>>());
    let least = all.iter().map(Judged::product).fold(f64::INFINITY, f64::min);
    all.into_iter().find(|judged| judged.product() <= NEARLY * least).unwrap_or(at)
}

/// A candidate with what may find light that the trial missed, if it has light sub-paths: in all iterations and with the widest
/// radius where this costs little, since such light is bright in few photons, else in all with the radius at hand, else in some.
fn insured(best: Candidate, costs: &Costs, bounds: &Bounds) -> Candidate {
    /// The factor by which an iteration may take longer.
    const PREMIUM: f64 = 1.05;
    if !best.needs_light() || bounds.careful.is_empty() {
        return best;
    }
    let techniques = best.techniques.union(bounds.careful);
    let missing = bounds.careful.without(best.techniques).union(best.seldom.intersection(bounds.careful));
    let always = Candidate { techniques, seldom: best.seldom.without(missing), ..best };
    let widest = Candidate { surf_radius: bounds.surf_radii.last().copied().unwrap_or(1.0), ..always };
    let most = PREMIUM * costs.iteration(&best);
    [widest, always].into_iter().find(|candidate| costs.iteration(candidate) <= most).unwrap_or(Candidate {
        techniques,
        seldom: best.seldom.union(missing),
        ..best
    })
}

/// Where to begin, the simplest first: with camera sub-paths alone, with paths alone, and with everything.
fn starts(bounds: &Bounds, everything: Candidate) -> [Candidate; 3] {
    let with = |set: TechniqueSet| set.union(bounds.always).intersection(bounds.techniques);
    // What stays on only for the sake of paths that were not seen is to cost little.
    let least = bounds.light_paths.first().copied().unwrap_or(1.0);
    let camera = Candidate { techniques: with(TechniqueSet::PT), light_paths: least, ..everything };
    let seldom = bounds.careful.without(bounds.always);
    let paths = Candidate { techniques: with(TechniqueSet::BPT.union(bounds.careful)), seldom, ..everything };
    [camera, paths, everything].map(|start| start.possible(bounds))
}

/// All that differ from a candidate in one thing.
fn steps(from: &Candidate, bounds: &Bounds) -> Vec<Candidate> {
    let mut steps = Vec::new();
    for technique in bounds.techniques.without(TechniqueSet::PT).iter() {
        let alone = TechniqueSet::EMPTY.with(technique);
        let (on, seldom) = (from.techniques.with(technique), from.seldom.without(alone));
        let states = [
            (!bounds.always.has(technique)).then_some((from.techniques.without(alone), seldom)),
            (technique > Technique::LightTracing).then_some((on, seldom.with(technique))),
            Some((on, seldom)),
        ];
        steps.extend(states.into_iter().flatten().map(|(techniques, seldom)| Candidate {
            techniques,
            seldom,
            ..*from
        }));
    }
    steps.extend(numbers_of_light_paths(from, bounds));
    if from.techniques.has(Technique::Bb1d) {
        steps.extend(bounds.beam_paths.iter().map(|&beam_paths| Candidate { beam_paths, ..*from }));
    }
    if from.techniques.has(Technique::Surf) {
        steps.extend(bounds.surf_radii.iter().map(|&surf_radius| Candidate { surf_radius, ..*from }));
    }
    if from.techniques.has(Technique::Connect) {
        steps.extend(bounds.connections.iter().map(|&connections| Candidate { connections, ..*from }));
    }
    steps.into_iter().map(|step| step.possible(bounds)).filter(|step| step != from).collect()
}

/// The same with other numbers of light sub-paths, if it has any.
fn numbers_of_light_paths(from: &Candidate, bounds: &Bounds) -> Vec<Candidate> {
    let numbers = if from.needs_light() { bounds.light_paths.as_slice() } else { &[] };
    numbers.iter().map(|&light_paths| Candidate { light_paths, ..*from }.possible(bounds)).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use super::*;

    #[test]
    fn fewer_light_sub_paths_must_gain_more() {
        let judged = |techniques, light_paths, cost| Judged {
            candidate: Candidate {
                techniques,
                light_paths,
                beam_paths: 1.0,
                connections: 1.0,
                surf_radius: 1.0,
                seldom: TechniqueSet::EMPTY,
                roulette: TRIAL,
            },
            variance: [1.0; GROUPS],
            cost,
        };
        let gain = 0.9;
        let chosen = |a: Judged, b: Judged| {
            let least = a.or_less(b, gain);
            assert_eq!(least.cost, b.or_less(a, gain).cost, "whichever comes first");
            least.cost
        };
        let all = judged(TechniqueSet::BPT, 1.0, 1.0);
        for (fewer, needed) in [(0.25, gain), (0.0625, gain * gain)] {
            assert_eq!(chosen(all, judged(TechniqueSet::BPT, fewer, 1.01 * needed)), 1.0);
            assert_eq!(chosen(all, judged(TechniqueSet::BPT, fewer, 0.99 * needed)), 0.99 * needed);
        }
        // What has none is compared as it is.
        assert_eq!(chosen(all, judged(TechniqueSet::PT, 0.0625, 0.99)), 0.99);
        assert_eq!(chosen(all, judged(TechniqueSet::PT, 0.0625, 1.01)), 1.0);
    }

    #[test]
    fn beams_come_from_light_sub_paths() {
        let bounds = Bounds {
            techniques: TechniqueSet::ALL,
            always: TechniqueSet::EMPTY,
            careful: TechniqueSet::EMPTY,
            light_paths: vec![0.0625, 0.25, 1.0],
            beam_paths: vec![0.25, 1.0, 4.0],
            paths_per_beam_path: 2.0,
            connections: vec![1.0],
            surf_radii: vec![1.0],
            roulettes: TRIAL..TRIAL + 1,
        };
        let mut found = starts(&bounds, Candidate::everything(&bounds)).to_vec();
        let mut next = VecDeque::from(found.clone());
        let mut fewer = 0;
        while let Some(from) = next.pop_front().filter(|_| found.len() < 2000) {
            for step in steps(&from, &bounds) {
                if found.contains(&step) {
                    continue;
                }
                assert!(
                    !step.techniques.intersects(BEAMS) || step.beam_paths <= 2.0 * step.light_paths,
                    "{step:?}"
                );
                fewer += u32::from(!bounds.beam_paths.contains(&step.beam_paths));
                found.push(step);
                next.push_back(step);
            }
        }
        assert!(fewer > 0, "nothing to hold back in {} candidates", found.len());
    }
}
