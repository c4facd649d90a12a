//! What a render runs: stages, each from some iteration on.

use std::fmt;
use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};
use upbp_estimators::{LookUps, Roulette, Technique, TechniqueSet};

use crate::radius::RadiusSchedule;

/// How many samples of a technique a camera vertex may have on average.
pub(crate) const PER_VERTEX: RangeInclusive<f32> = 0.001..=1000.0;

/// What iterations run, from the one with index `from` until the next stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stage {
    /// Index of the first iteration.
    pub from: u64,
    /// The techniques that run.
    pub techniques: TechniqueSet,
    /// Light sub-paths per iteration; 0 if no technique uses any.
    pub light_paths: u32,
    /// Of them with photon beams.
    pub beam_paths: u32,
    /// Light vertices that every camera vertex is connected to, on average.
    pub connections: f32,
    /// Points on lights that every camera vertex is connected to, on average.
    pub next_events: f32,
    /// When walks end by Russian roulette.
    pub roulette: Roulette,
    /// In which iterations photons are looked up.
    pub look_ups: LookUps,
    /// Connectible vertices per light sub-path, as the pilot found.
    pub vertices_per_light_path: f64,
    /// First radii and how they shrink.
    pub radii: RadiusSchedule,
}

impl Stage {
    fn validate(&self) -> Result<(), String> {
        let radii = &self.radii;
        let lengths = [radii.surf, radii.pp3d, radii.pb2d, radii.bp2d, radii.bb1d];
        let finite = |x: &f32| (0.0..f32::INFINITY).contains(x);
        if self.techniques.is_empty() {
            Err("techniques: expected at least one".into())
        } else if self.light_paths == 0 && !self.techniques.without(TechniqueSet::PT).is_empty() {
            Err(format!("light_paths: expected at least 1 for {}", self.techniques))
        } else if self.beam_paths > self.light_paths {
            Err(format!(
                "beam_paths: expected at most light_paths ({}), found {}",
                self.light_paths, self.beam_paths
            ))
        } else if ![self.connections, self.next_events].iter().all(|mean| PER_VERTEX.contains(mean)) {
            Err(format!(
                "connections, next_events: expected {PER_VERTEX:?}, found {} and {}",
                self.connections, self.next_events
            ))
        } else if matches!(self.roulette, Roulette::Below(least) if !(least > 0.0 && least <= 1.0)) {
            Err(format!("roulette: expected Off, or Below a number in (0, 1], found {:?}", self.roulette))
        } else if !(0.0..f64::INFINITY).contains(&self.vertices_per_light_path) {
            Err(format!("vertices_per_light_path: expected a number, found {}", self.vertices_per_light_path))
        } else if !(lengths.iter().all(finite) && finite(&radii.floor) && radii.floor > 0.0) {
            Err(format!("radii: expected lengths and a positive floor, found {radii:?}"))
        } else {
            Ok(())
        }
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "from iteration {}: {}", self.from, self.techniques)?;
        if self.light_paths > 0 {
            write!(f, ", {} light sub-paths", self.light_paths)?;
        }
        if self.beam_paths > 0 {
            write!(f, ", {} with beams", self.beam_paths)?;
        }
        if self.connections != 1.0 && self.techniques.has(Technique::Connect) {
            write!(f, ", {} connections per vertex", self.connections)?;
        }
        if self.next_events != 1.0 && self.techniques.has(Technique::Nee) {
            write!(f, ", {} next events per vertex", self.next_events)?;
        }
        match self.roulette {
            Roulette::Off => write!(f, ", no roulette")?,
            Roulette::Below(least) => write!(f, ", roulette below {least}")?,
        }
        for technique in self.techniques.iter().filter(|technique| self.look_ups.period(*technique) > 1) {
            write!(f, ", {} in one of {} iterations", technique.name(), self.look_ups.period(technique))?;
        }
        Ok(())
    }
}

/// The stages of a render so far. What iterations compute depends on it, on the scene, on the settings and on their index, and
/// on nothing else: so a plan that is written to a file and read on many machines makes their iterations fit together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Stage>", into = "Vec<Stage>")]
pub struct RenderPlan {
    /// Not empty; the first is from iteration 0, and they ascend.
    stages: Vec<Stage>,
}

impl RenderPlan {
    /// One stage for all iterations.
    pub(crate) fn new(mut first: Stage) -> Self {
        first.from = 0;
        Self { stages: vec![first] }
    }

    /// The stages, in order.
    #[must_use]
    pub fn stages(&self) -> &[Stage] {
        &self.stages
    }

    /// The techniques of all stages.
    #[must_use]
    pub fn techniques(&self) -> TechniqueSet {
        self.stages.iter().flat_map(|stage| stage.techniques.iter()).collect()
    }

    /// What an iteration runs, as far as it has been decided.
    #[must_use]
    pub fn stage(&self, iteration: u64) -> &Stage {
        &self.stages[self.stages.partition_point(|stage| stage.from <= iteration).max(1) - 1]
    }

    /// Another stage, which begins after those that there are.
    pub(crate) fn push(&mut self, stage: Stage) {
        self.stages.push(stage);
    }

    /// Reads a plan from RON text, as its display writes it.
    ///
    /// # Errors
    /// Line, column and reason of what is not understood or cannot be.
    pub fn from_ron(text: &str) -> Result<Self, ron::error::SpannedError> {
        ron::from_str(text)
    }
}

impl fmt::Display for RenderPlan {
    /// As RON text, which [`from_ron`](RenderPlan::from_ron) reads.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let style = ron::ser::PrettyConfig::default();
        f.write_str(&ron::ser::to_string_pretty(self, style).map_err(|_| fmt::Error)?)
    }
}

impl TryFrom<Vec<Stage>> for RenderPlan {
    type Error = String;

    fn try_from(stages: Vec<Stage>) -> Result<Self, String> {
        let starts_at_zero = stages.first().is_some_and(|stage| stage.from == 0);
        if !starts_at_zero || !stages.is_sorted_by(|a, b| a.from < b.from) {
            return Err("expected stages with ascending `from`, the first from 0".into());
        }
        for (index, stage) in stages.iter().enumerate() {
            stage.validate().map_err(|reason| format!("stage {index}: {reason}"))?;
        }
        Ok(Self { stages })
    }
}

impl From<RenderPlan> for Vec<Stage> {
    fn from(plan: RenderPlan) -> Self {
        plan.stages
    }
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroU32;

    use super::*;

    fn stage(from: u64) -> Stage {
        Stage {
            from,
            techniques: TechniqueSet::PT.with(Technique::Surf),
            light_paths: 1000,
            beam_paths: 0,
            connections: 1.0,
            next_events: 2.0,
            roulette: Roulette::Below(0.5),
            look_ups: LookUps { surf: NonZeroU32::new(4).unwrap(), ..LookUps::ALL },
            vertices_per_light_path: 3.1,
            radii: RadiusSchedule {
                surf: 1e-3,
                pp3d: 0.0,
                pb2d: 0.0,
                bp2d: 0.0,
                bb1d: 0.0,
                progressive: true,
                floor: 1e-6,
            },
        }
    }

    #[test]
    fn a_plan_survives_its_spelling() {
        let mut plan = RenderPlan::new(stage(0));
        plan.push(stage(512));
        assert_eq!(RenderPlan::from_ron(&plan.to_string()), Ok(plan.clone()));
        assert_eq!([0, 511, 512, 9999].map(|i| plan.stage(i).from), [0, 0, 512, 512]);
        assert_eq!(
            plan.stages()[1].to_string(),
            "from iteration 512: hit+nee+surf, 1000 light sub-paths, 2 next events per vertex, roulette below 0.5, surf in one of 4 iterations"
        );
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let refused = |stages: Vec<Stage>| RenderPlan::try_from(stages).unwrap_err();
        assert!(refused(vec![]).contains("from 0"));
        assert!(refused(vec![stage(3)]).contains("from 0"));
        assert!(refused(vec![stage(0), stage(0)]).contains("ascending"));
        let wrong = |change: fn(&mut Stage)| {
            let mut second = stage(7);
            change(&mut second);
            refused(vec![stage(0), second])
        };
        assert!(wrong(|s| s.roulette = Roulette::Below(0.0)).contains("stage 1: roulette"));
        assert!(wrong(|s| s.light_paths = 0).contains("light_paths"));
        assert!(wrong(|s| s.beam_paths = 2000).contains("beam_paths"));
        assert!(wrong(|s| s.radii.pb2d = f32::NAN).contains("radii"));
        assert!(wrong(|s| s.techniques = TechniqueSet::EMPTY).contains("techniques"));
        assert!(wrong(|s| s.next_events = 5000.0).contains("next_events"));
        assert!(wrong(|s| s.vertices_per_light_path = f64::INFINITY).contains("vertices"));
    }
}
