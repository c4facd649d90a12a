//! The plan of a render: a decision that is made once, before the first iteration.

use std::fmt;
use std::ops::RangeInclusive;
use std::sync::Arc;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use upbp_estimators::{EmitterChoice, FootprintField, MergePeriods, Roulette, Technique, TechniqueSet};

use crate::error::TextError;
use crate::radius_schedule::{LARGEST_RADIUS, RadiusSchedule};

/// Samples of a technique that a camera vertex may have on average.
pub(crate) const PER_VERTEX: RangeInclusive<f32> = 0.001..=1000.0;
/// Camera factors of a plan.
const CAMERA_FACTORS: RangeInclusive<f32> = 0.001..=1000.0;

/// Techniques, sample counts and radii of all iterations of a render.
///
/// Iterations depend on it, on the scene, on the settings and on their index, and on nothing else. So a plan
/// that is written to a file and read on many machines makes their iterations fit together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Self", deny_unknown_fields)]
pub struct Plan {
    /// The techniques that run.
    pub techniques: TechniqueSet,
    /// Light sub-paths per iteration; 0 if no technique uses any.
    pub light_paths: u32,
    /// Light sub-paths that leave photon beams, at most `light_paths`.
    pub beam_paths: u32,
    /// Light vertices that every camera vertex is connected to, on average.
    pub connections: f32,
    /// Points on lights that every camera vertex is connected to, on average.
    pub next_events: f32,
    /// Factor of emission hits, next events and connections in the weights, whose samples are independent
    /// where photons and beams are shared (`docs/theory.md`, section 3.4); 1 is the plain heuristic.
    pub camera_factor: f32,
    /// Russian roulette.
    pub roulette: Roulette,
    /// Periods of photon queries.
    pub periods: MergePeriods,
    /// Connectible vertices per light sub-path, by the statistics before the first iteration.
    pub vertices_per_light_path: f64,
    /// First radii and how they shrink.
    pub radii: RadiusSchedule,
    /// The probability of each lane to be the one that a sub-path draws all its distances and directions from
    /// (`docs/theory.md`, section 6.13); they sum to one. `None` if every step draws from its medium's own
    /// distributions.
    pub lanes: Option<[f64; 3]>,
}

impl Plan {
    /// Whether any technique uses light sub-paths.
    pub(crate) fn uses_light_paths(&self) -> bool {
        self.techniques.intersects(TechniqueSet::LIGHT_PATHS)
    }

    /// The light sub-paths that the samples of a technique come from.
    pub(crate) const fn paths_of(&self, technique: Technique) -> u32 {
        if technique.uses_beams() { self.beam_paths } else { self.light_paths }
    }

    /// The part of the camera sub-paths that make the queries of a technique.
    pub(crate) fn active_part(&self, technique: Technique) -> f64 {
        1.0 / f64::from(self.periods.period(technique))
    }

    /// Checks every value, since a host may have set it.
    pub(crate) fn validate(&self) -> Result<(), String> {
        let radii = &self.radii;
        let lengths = Technique::MERGES.map(|technique| radii.first(technique));
        let possible = |x: &f32| (0.0..=LARGEST_RADIUS).contains(x);
        let is_missing = |technique: &Technique| technique.merges() && !(radii.first(*technique) > 0.0);
        if self.techniques.is_empty() {
            Err("techniques: expected at least one".into())
        } else if self.light_paths == 0 && self.uses_light_paths() {
            Err(format!("light_paths: expected at least 1 for {}", self.techniques))
        } else if self.beam_paths > self.light_paths {
            Err(format!(
                "beam_paths: expected at most light_paths ({}), found {}",
                self.light_paths, self.beam_paths
            ))
        } else if self.beam_paths == 0 && self.techniques.iter().any(Technique::uses_beams) {
            Err(format!("beam_paths: expected at least 1 for {}", self.techniques))
        } else if ![self.connections, self.next_events].iter().all(|mean| PER_VERTEX.contains(mean)) {
            Err(format!(
                "connections, next_events: expected {PER_VERTEX:?}, found {} and {}",
                self.connections, self.next_events
            ))
        } else if !CAMERA_FACTORS.contains(&self.camera_factor) {
            Err(format!("camera_factor: expected {CAMERA_FACTORS:?}, found {}", self.camera_factor))
        } else if matches!(self.roulette, Roulette::Below(least) if !(least > 0.0 && least <= 1.0)) {
            Err(format!("roulette: expected Off, or Below a number in (0, 1], found {:?}", self.roulette))
        } else if !(0.0..f64::INFINITY).contains(&self.vertices_per_light_path) {
            Err(format!("vertices_per_light_path: expected a number, found {}", self.vertices_per_light_path))
        } else if !(lengths.iter().all(possible) && possible(&radii.floor)) {
            Err(format!("radii: expected lengths up to {LARGEST_RADIUS:e}, found {radii:?}"))
        } else if let Some(technique) = self.techniques.iter().find(is_missing) {
            Err(format!(
                "radii.{0}: expected a number above 0, since {0} is one of its techniques",
                technique.name()
            ))
        } else if !radii.field.is_valid(lengths.into_iter().fold(0.0, f32::max)) {
            Err(format!(
                "radii.field: expected positive factors, of which the greatest is at most {} times the least, \
                 and radii that differ by at most a tenth of the distance, found {:?}",
                FootprintField::RANGE,
                radii.field
            ))
        } else if !radii.most_mean_free_paths.is_none_or(|most| most > 0.0 && most.is_finite()) {
            Err(format!(
                "radii.most_mean_free_paths: expected None, or a number above 0, found {:?}",
                radii.most_mean_free_paths
            ))
        } else if !self.lanes.is_none_or(is_distribution) {
            Err(format!("lanes: expected None, or probabilities that sum to one, found {:?}", self.lanes))
        } else {
            Ok(())
        }
    }
}

/// Whether these are probabilities of all there is.
fn is_distribution(probabilities: [f64; 3]) -> bool {
    probabilities.iter().all(|p| (0.0..=1.0).contains(p))
        && (probabilities.iter().sum::<f64>() - 1.0).abs() < 1e-9
}

/// A plan with the emitters that its sub-paths begin at: all that is decided before the first iteration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrozenPlan {
    /// Techniques, sample counts and radii.
    pub plan: Plan,
    /// Probabilities of the emitters that sub-paths begin at, and their guides.
    pub emitters: Arc<EmitterChoice>,
}

impl FrozenPlan {
    /// Beginning of the text of every plan.
    pub(crate) const BEGINNING: &'static str = "FrozenPlan(";

    /// Reads a plan from RON text, as [`to_ron`](Self::to_ron) writes it.
    ///
    /// # Errors
    /// Line, column and reason of what is not understood or cannot be.
    pub fn from_ron(text: &str) -> Result<Self, TextError> {
        Ok(ron::from_str(text)?)
    }

    /// The plan as RON text, which begins with `FrozenPlan(`.
    #[must_use]
    pub fn to_ron(&self) -> String {
        let pretty = ron::ser::PrettyConfig::default().compact_arrays(true);
        // Numbers and names: there is nothing that RON cannot spell.
        let text = ron::ser::to_string_pretty(self, pretty).unwrap_or_default();
        // Without the name the text begins with the parenthesis.
        format!("{}{}", Self::BEGINNING, text.strip_prefix('(').unwrap_or(&text))
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.techniques)?;
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
        if self.camera_factor != 1.0 {
            write!(f, ", camera factor {}", self.camera_factor)?;
        }
        match self.roulette {
            Roulette::Off => write!(f, ", no roulette")?,
            Roulette::Below(least) => write!(f, ", roulette below {least}")?,
        }
        if self.lanes.is_some() {
            write!(f, ", lanes by channel")?;
        }
        for technique in self.techniques.iter().filter(|technique| self.periods.period(*technique) > 1) {
            write!(f, ", {} in one of {} pixels", technique.name(), self.periods.period(technique))?;
        }
        Ok(())
    }
}

/// Written and read as its fields, and checked when it is read.
impl Serialize for Plan {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

impl<'de> Deserialize<'de> for Plan {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let plan = Self::deserialize(deserializer)?;
        plan.validate().map_err(D::Error::custom)?;
        Ok(plan)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use std::num::NonZeroU32;

    use upbp_estimators::RadiusField;

    use super::*;

    /// A plan in which everything has a value that is not the usual one.
    pub(crate) fn plan() -> Plan {
        Plan {
            techniques: TechniqueSet::PT.with(Technique::Surf),
            light_paths: 1000,
            beam_paths: 0,
            connections: 1.0,
            next_events: 2.0,
            camera_factor: 4.0,
            roulette: Roulette::Below(0.5),
            periods: MergePeriods { surf: NonZeroU32::new(4).unwrap(), ..MergePeriods::ONE },
            vertices_per_light_path: 3.1,
            radii: RadiusSchedule {
                surf: 1e-3,
                pp3d: 0.0,
                pb2d: 0.0,
                bp2d: 0.0,
                bb1d: 0.0,
                field: RadiusField::Uniform,
                most_mean_free_paths: None,
                progressive: true,
                floor: 1e-6,
            },
            lanes: Some([0.25, 0.75, 0.0]),
        }
    }

    #[test]
    fn a_plan_survives_its_spelling() {
        let frozen = FrozenPlan { plan: plan(), emitters: Arc::default() };
        let text = frozen.to_ron();
        assert!(text.starts_with("FrozenPlan("), "{text}");
        assert_eq!(FrozenPlan::from_ron(&text), Ok(frozen));
        assert_eq!(
            plan().to_string(),
            "hit+nee+surf, 1000 light sub-paths, 2 next events per vertex, camera factor 4, roulette below 0.5, lanes by channel, surf in one of 4 pixels"
        );
    }

    #[test]
    fn guides_are_spelled_as_their_nodes_and_read_only_if_these_are_trees() {
        let text = FrozenPlan { plan: plan(), emitters: Arc::default() }.to_ron();
        let with = |nodes: &str| {
            let place = "next_event: [],";
            assert_eq!(text.matches(place).count(), 1, "{text}");
            FrozenPlan::from_ron(&text.replace(place, &format!("{place} guides: [Some({nodes})],")))
        };
        let guided = with("[(1, 2, 2000), (0, 0, 0), (0, 0, 0)]").expect("a tree");
        let spelled: String = guided.to_ron().split_whitespace().collect();
        assert!(spelled.contains("guides:[Some([(1,2,2000),(0,0,0),(0,0,0)"), "{spelled}");
        assert_eq!(FrozenPlan::from_ron(&guided.to_ron()), Ok(guided));
        for nodes in ["[]", "[(1, 2, 2000), (0, 0, 0)]", "[(7, 2, 2000), (0, 0, 0), (0, 0, 0)]"] {
            let error = with(nodes).unwrap_err().to_string();
            assert!(error.contains("expected the tree of a guide"), "{nodes}: {error}");
        }
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let wrong = |change: fn(&mut Plan)| {
            let mut plan = plan();
            change(&mut plan);
            let frozen = FrozenPlan { plan, emitters: Arc::default() };
            FrozenPlan::from_ron(&frozen.to_ron()).unwrap_err().to_string()
        };
        assert!(wrong(|p| p.roulette = Roulette::Below(0.0)).contains("roulette"));
        assert!(wrong(|p| p.camera_factor = 0.0).contains("camera_factor"));
        assert!(wrong(|p| p.light_paths = 0).contains("light_paths"));
        assert!(wrong(|p| p.beam_paths = 2000).contains("beam_paths"));
        assert!(wrong(|p| p.radii.pb2d = f32::NAN).contains("radii"));
        assert!(wrong(|p| p.radii.pp3d = 1e16).contains("radii: expected lengths up to 1e12"));
        assert!(wrong(|p| p.radii.most_mean_free_paths = Some(0.0)).contains("radii.most_mean_free_paths"));
        assert!(wrong(|p| p.lanes = Some([0.5; 3])).contains("lanes: expected None, or"));
        let message = wrong(|p| p.connections = 1e9);
        assert!(message.contains(": connections, next_events: expected 0.001"), "{message}");
        // This one cannot even be spelled.
        let without = Plan { techniques: TechniqueSet::EMPTY, ..plan() };
        assert!(without.validate().unwrap_err().contains("techniques"));
        assert!(wrong(|p| p.next_events = 5000.0).contains("next_events"));
        assert!(wrong(|p| p.vertices_per_light_path = f64::INFINITY).contains("vertices"));
        assert!(wrong(|p| p.radii.surf = 0.0).contains("radii.surf: expected a number above 0"));
        assert!(wrong(|p| p.techniques = TechniqueSet::ALL).contains("beam_paths: expected at least 1"));
        let text = FrozenPlan { plan: plan(), emitters: Arc::default() }.to_ron();
        for (place, more) in
            [("light_paths:", "from: 0, "), ("surf: 0.001", "most_mean_free_path: Some(1), ")]
        {
            assert_eq!(text.matches(place).count(), 1, "{text}");
            let error = FrozenPlan::from_ron(&text.replace(place, &(more.to_owned() + place))).unwrap_err();
            assert!(
                error.to_string().contains("nexpected field") || error.to_string().contains("nknown field"),
                "{error}"
            );
        }
    }
}
