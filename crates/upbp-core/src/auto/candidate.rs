//! Plans that may be chosen, and the steps from one to the next.

use std::num::NonZeroU32;

use upbp_estimators::scene::Scene;
use upbp_estimators::{MergePeriods, Roulette, Technique, TechniqueSet};

use super::cost::Cost;
use super::full_plan::{Inputs, Planner};
use super::roulette;
use super::statistics::Statistics;
use super::technique_support::TechniqueSupport;
use crate::plan::Plan;
use crate::radius_schedule::{LARGEST_RADIUS, Radius};
use crate::settings::LightPaths;

/// Numbers of light sub-paths, relative to the full plan's: more than one per pixel where what matters is
/// found by them alone, as what the sun throws through water is.
const LIGHT_PATH_FACTORS: [f64; 5] = [0.0625, 0.25, 1.0, 4.0, 16.0];
/// Numbers of light sub-paths with beams, relative to the full plan's: fewer are fast, and more of them show
/// less as rays.
const BEAM_PATH_FACTORS: [f64; 3] = [0.25, 1.0, 4.0];
/// Factors of emission hits, next events and connections in the weights: photons and beams tell less than as
/// many independent samples would, by how much depends on what they share.
const CAMERA_FACTORS: [f32; 3] = [1.0, 2.0, 4.0];
/// Width of beams in a pilot render over that of candidates, and by which part there are as many: pairs of
/// pixels that share a beam, the evidence of rays in a picture, are more the wider beams are.
const WIDER_BEAMS: u32 = 4;
/// Period of queries that only some pixels make.
const PERIOD: NonZeroU32 = NonZeroU32::new(8).unwrap();
/// Factor by which an iteration may take longer with the safeguard.
const SAFEGUARD_OVERHEAD: f64 = 1.05;

/// All plans that may be chosen: whatever settings do not fix.
#[derive(Clone, Debug)]
pub(super) struct Candidates {
    /// The full plan: all techniques, a light sub-path per pixel if there is room. It is what runs if there
    /// is no time for a choice.
    pub(super) usual: Plan,
    /// The full plan with the widest radii, [wider beams](WIDER_BEAMS) and a roulette that any other can be
    /// told from: pilot renders run it, since they can tell what less of anything, or more light sub-paths,
    /// would do.
    pub(super) of_pilot: Plan,
    /// Techniques that stay on: some paths may have no other.
    always: TechniqueSet,
    /// Techniques of which one stays on at least: each finds the same paths, which may have no other.
    any_of: TechniqueSet,
    /// Techniques that a plan with light sub-paths has at least in some pixels: there may be light that a
    /// pilot render misses.
    safeguard: TechniqueSet,
    light_paths: Vec<u32>,
    beam_paths: Vec<u32>,
    /// Radii of surface merging, the usual one first.
    surf_radii: Vec<f32>,
    roulettes: Vec<Roulette>,
}

impl Candidates {
    /// The candidates beside a full plan. More light sub-paths than it has are candidates up to `most`; more
    /// with beams than it has, if there `is_room` for such numbers of light sub-paths and of those with
    /// beams.
    pub(super) fn new<S: Scene>(
        planner: &Planner<'_, '_, S>,
        support: &TechniqueSupport,
        full: Plan,
        most: u32,
        is_room: impl Fn([u32; 2]) -> bool,
    ) -> Self {
        let Planner { scene, inputs: Inputs { settings, .. }, statistics } = *planner;
        let counts = |full: u32, parts: &[f64], is_fixed: bool, is_possible: &dyn Fn(u32) -> bool| {
            let count = |part: &f64| ((f64::from(full) * part) as u32).max(1);
            let is_candidate = |count: &u32| *count <= full || is_possible(*count);
            if is_fixed { vec![full] } else { parts.iter().map(count).filter(is_candidate).collect() }
        };
        let is_fixed = settings.light_paths != LightPaths::Auto;
        let light_paths = counts(full.light_paths, &LIGHT_PATH_FACTORS, is_fixed, &|count| count <= most);
        let longest = light_paths.iter().copied().fold(full.light_paths, u32::max);
        let is_room = |count| is_room([longest, count]);
        let are_fixed = settings.beams.is_some();
        let beam_paths = counts(full.beam_paths, &BEAM_PATH_FACTORS, are_fixed, &is_room);
        let surf = full.radii.surf;
        let widest = if settings.radii.surf == Radius::Auto { widest(surf, statistics) } else { surf };
        let needed = if support.needs_merges { full.techniques } else { TechniqueSet::EMPTY };
        let mut of_pilot = Plan { roulette: settings.roulette.unwrap_or(roulette::OF_PILOT), ..full };
        of_pilot.radii.surf = widest;
        let wider = WIDER_BEAMS as f32 * full.radii.bb1d;
        if !are_fixed
            && settings.radii.bb1d == Radius::Auto
            && wider <= full.radii.field.largest_radius().min(LARGEST_RADIUS)
        {
            of_pilot.radii.bb1d = wider;
            of_pilot.beam_paths = full.beam_paths.div_ceil(WIDER_BEAMS);
        }
        Self {
            usual: full,
            of_pilot,
            always: needed.intersection(TechniqueSet::only(Technique::Surf)),
            any_of: needed.intersection(TechniqueSet::VOLUME_MERGES),
            safeguard: if scene.scene.has_specular_surfaces() {
                full.techniques.intersection(TechniqueSet::only(Technique::Surf))
            } else {
                TechniqueSet::EMPTY
            },
            light_paths,
            beam_paths,
            surf_radii: if widest > surf { vec![surf, widest] } else { vec![surf] },
            roulettes: settings.roulette.map_or_else(|| roulette::all().to_vec(), |own| vec![own]),
        }
    }

    /// Plans to begin with, the simplest first: camera sub-paths alone, paths alone, everything.
    pub(super) fn starts(&self) -> [Plan; 3] {
        let everything = self.with_techniques(self.usual.techniques);
        let in_turn = [Technique::Pb2d, Technique::Pp3d, Technique::Bb1d, Technique::Bp2d];
        let one = in_turn.into_iter().find(|technique| self.any_of.has(*technique));
        let least = one.map_or(self.always, |technique| self.always.with(technique));
        let with = |set: TechniqueSet| self.with_techniques(set.union(least));
        // What stays on only for the sake of paths that were not seen is to cost little.
        let camera = Plan { light_paths: self.light_paths[0], ..with(TechniqueSet::PT) };
        let mut paths = with(TechniqueSet::BPT.union(self.safeguard));
        for technique in self.safeguard.without(least).iter() {
            paths = with_period(paths, technique, PERIOD);
        }
        [camera, paths, everything].map(|plan| self.possible(plan))
    }

    /// The usual plan with those of some techniques that can be had, and the roulette that suits them.
    fn with_techniques(&self, set: TechniqueSet) -> Plan {
        let techniques = set.intersection(self.usual.techniques);
        let suitable = roulette::usual_roulette(techniques);
        let roulette = if self.roulettes.contains(&suitable) { suitable } else { self.usual.roulette };
        Plan { techniques, roulette, ..self.usual }
    }

    /// All candidates that differ from a plan in one thing.
    pub(super) fn steps(&self, from: &Plan) -> Vec<Plan> {
        let mut steps = Vec::new();
        for technique in self.usual.techniques.intersection(TechniqueSet::LIGHT_PATHS).iter() {
            let always = with_period(*from, technique, NonZeroU32::MIN);
            let techniques = always.techniques.with(technique);
            steps.push(Plan { techniques, ..always });
            if technique.merges() {
                steps.push(Plan { techniques, ..with_period(always, technique, PERIOD) });
            }
            let without = Plan { techniques: techniques.without(TechniqueSet::only(technique)), ..always };
            if self.has_enough(without.techniques) {
                steps.push(without);
            }
        }
        steps.extend(self.light_paths(from));
        if from.techniques.intersects(TechniqueSet::BEAMS) {
            steps.extend(self.beam_paths.iter().map(|&beam_paths| Plan { beam_paths, ..*from }));
        }
        if from.techniques.has(Technique::Surf) {
            steps.extend(self.surf_radii.iter().map(|&radius| with_surf_radius(*from, radius)));
        }
        steps.extend(self.roulettes.iter().map(|&roulette| Plan { roulette, ..*from }));
        steps.into_iter().map(|step| self.possible(step)).filter(|step| step != from).collect()
    }

    /// Whether no technique is missing that has to stay on.
    fn has_enough(&self, techniques: TechniqueSet) -> bool {
        let any = self.any_of.is_empty() || techniques.intersects(self.any_of);
        any && self.always.without(techniques).is_empty()
    }

    /// A plan with each camera factor, if it has light sub-paths.
    pub(super) fn camera_factors(from: &Plan) -> Vec<Plan> {
        let factors = if from.uses_light_paths() { CAMERA_FACTORS.as_slice() } else { &[] };
        factors.iter().map(|&camera_factor| Plan { camera_factor, ..*from }).collect()
    }

    /// A plan with beams from no more light sub-paths than it has, and from as many as the full plan if their
    /// number is fixed and it has so many.
    fn possible(&self, plan: Plan) -> Plan {
        let most = if plan.techniques.intersects(TechniqueSet::BEAMS) { plan.light_paths } else { u32::MAX };
        let beam_paths = if let [only] = self.beam_paths[..] { only } else { plan.beam_paths };
        Plan { beam_paths: beam_paths.min(most), ..plan }
    }

    /// A plan with each number of light sub-paths, if it has any.
    pub(super) fn light_paths(&self, from: &Plan) -> Vec<Plan> {
        let counts = if from.uses_light_paths() { self.light_paths.as_slice() } else { &[] };
        counts.iter().map(|&light_paths| self.possible(Plan { light_paths, ..*from })).collect()
    }

    /// A plan with the techniques that may find light that the pilot render missed, if it has light
    /// sub-paths: in all pixels and with the widest radius where this costs little, since such light is
    /// bright in few photons, else in all with the radius at hand, else in some.
    pub(super) fn with_safeguard(&self, plan: Plan, cost: Cost<'_>) -> Plan {
        if !plan.uses_light_paths() {
            return plan;
        }
        let (mut always, mut in_some_pixels) = (plan, plan);
        for technique in self.safeguard.iter() {
            let techniques = plan.techniques.with(technique);
            let is_active = plan.techniques.has(technique) && plan.active_part(technique) == 1.0;
            always = Plan { techniques, ..with_period(always, technique, NonZeroU32::MIN) };
            if !is_active {
                in_some_pixels = Plan { techniques, ..with_period(in_some_pixels, technique, PERIOD) };
            }
        }
        let widest = with_surf_radius(always, self.of_pilot.radii.surf);
        let most = SAFEGUARD_OVERHEAD * cost.iteration(&plan);
        let affordable = [widest, always].into_iter().find(|safe| cost.iteration(safe) <= most);
        if self.safeguard.is_empty() { plan } else { affordable.unwrap_or(in_some_pixels) }
    }
}

/// A plan as it is written down: without sub-paths that no technique uses.
pub(super) fn finished(plan: Plan) -> Plan {
    let light_paths = if plan.uses_light_paths() { plan.light_paths } else { 0 };
    let beam_paths =
        if plan.techniques.intersects(TechniqueSet::BEAMS) { plan.beam_paths.min(light_paths) } else { 0 };
    let camera_factor = if light_paths > 0 { plan.camera_factor } else { 1.0 };
    Plan { light_paths, beam_paths, camera_factor, ..plan }
}

fn with_period(plan: Plan, technique: Technique, period: NonZeroU32) -> Plan {
    let of = |other| NonZeroU32::new(plan.periods.period(other)).unwrap_or(NonZeroU32::MIN);
    let periods = MergePeriods::from_fn(|other| if other == technique { period } else { of(other) });
    Plan { periods, ..plan }
}

fn with_surf_radius(mut plan: Plan, radius: f32) -> Plan {
    plan.radii.surf = radius;
    plan
}

/// The widest radius of surface merging: the width of a pixel, if that is more than the usual radius, up to
/// four times as much. It blurs what a pixel blurs anyway, so that the prediction, which knows nothing of
/// blur, may be asked.
fn widest(usual: f32, statistics: &Statistics) -> f32 {
    /// Least ratio to the usual radius that is worth a candidate.
    const LEAST: f32 = 1.25;
    const MOST: f32 = 4.0;
    let footprint = statistics.footprint.min(statistics.radius_field.largest_radius()).min(LARGEST_RADIUS);
    if footprint >= LEAST * usual { footprint.min(MOST * usual) } else { usual }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use super::*;
    use crate::plan::tests::plan;

    /// Candidates beside a full plan of all techniques.
    fn candidates() -> Candidates {
        let full = Plan {
            techniques: TechniqueSet::ALL,
            light_paths: 1600,
            beam_paths: 800,
            roulette: roulette::OF_PILOT,
            periods: MergePeriods::ONE,
            ..plan()
        };
        Candidates {
            usual: full,
            of_pilot: full,
            always: TechniqueSet::EMPTY,
            any_of: TechniqueSet::EMPTY,
            safeguard: TechniqueSet::EMPTY,
            light_paths: vec![100, 400, 1600],
            beam_paths: vec![200, 800],
            surf_radii: vec![full.radii.surf],
            roulettes: vec![roulette::OF_PILOT],
        }
    }

    #[test]
    fn any_merges_in_media_may_be_those_that_stay() {
        let surf = TechniqueSet::only(Technique::Surf);
        let candidates = Candidates { always: surf, any_of: TechniqueSet::VOLUME_MERGES, ..candidates() };
        let mut found: Vec<TechniqueSet> = Vec::new();
        let mut next: Vec<Plan> = candidates.starts().to_vec();
        while let Some(from) = next.pop() {
            if found.contains(&from.techniques) {
                continue;
            }
            assert!(from.techniques.has(Technique::Surf), "{}", from.techniques);
            assert!(from.techniques.intersects(TechniqueSet::VOLUME_MERGES), "{}", from.techniques);
            found.push(from.techniques);
            next.extend(candidates.steps(&from));
        }
        for one in TechniqueSet::VOLUME_MERGES.iter() {
            assert!(found.contains(&TechniqueSet::BPT.union(surf).with(one)), "{one:?}");
        }
    }

    #[test]
    fn beams_come_from_light_sub_paths() {
        let candidates = candidates();
        let mut found = candidates.starts().to_vec();
        let mut next = VecDeque::from(found.clone());
        let mut fewer = 0;
        while let Some(from) = next.pop_front().filter(|_| found.len() < 2000) {
            for step in candidates.steps(&from) {
                if found.contains(&step) {
                    continue;
                }
                assert!(
                    !step.techniques.intersects(TechniqueSet::BEAMS) || step.beam_paths <= step.light_paths,
                    "{step:?}"
                );
                fewer += u32::from(!candidates.beam_paths.contains(&step.beam_paths));
                found.push(step);
                next.push_back(step);
            }
        }
        assert!(fewer > 0, "nothing to hold back in {} candidates", found.len());
        assert_eq!(finished(candidates.starts()[0]).light_paths, 0);
    }
}
