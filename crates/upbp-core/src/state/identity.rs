//! Identity of a render: all that its iterations depend on, besides their index.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use upbp_estimators::EmitterChoice;
use upbp_estimators::scene::PixelRect;

use crate::auto::technique_support::TechniqueSupport;
use crate::error::StateError;
use crate::plan::{FrozenPlan, Plan};
use crate::radius_schedule::RadiusSchedule;
use crate::settings::Settings;
use crate::state::fingerprint;

/// Version of what an iteration samples. Raised by a change that alters images, so that states of code before
/// and after it are not mixed.
pub(crate) const SAMPLES: u32 = 14;

/// The identity of a render: whatever its iterations depend on, besides their index.
///
/// The plan is part of it: so slices from machines whose mathematical functions differ in the last bit, and
/// which therefore chose otherwise, are refused and not mixed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Identity {
    /// Version of the renderer.
    pub version: String,
    /// Version of what an iteration samples: renderers of one version may differ in it between releases.
    pub samples: u32,
    /// Name of the scene, for people: it may differ.
    pub scene: String,
    /// Fingerprint of the scene's content; empty if the host gave none.
    pub fingerprint: String,
    /// Width and height of the whole film in pixels.
    pub film: (u32, u32),
    /// The part of the film that is rendered.
    pub crop: PixelRect,
    /// Settings as they were given.
    pub settings: Settings,
    /// Techniques that the scene can use.
    pub support: TechniqueSupport,
    /// Techniques, sample counts and first radii.
    pub plan: Plan,
    /// The emitters that sub-paths begin at.
    pub emitters: Arc<EmitterChoice>,
}

impl Identity {
    /// The plan, for another render that is to fit to this one.
    #[must_use]
    pub fn frozen_plan(&self) -> FrozenPlan {
        FrozenPlan { plan: self.plan, emitters: self.emitters.clone() }
    }

    /// Compares with the identity of another render. Settings count by their effect: how much memory is
    /// allowed does not matter where the number of light sub-paths is the same.
    ///
    /// # Errors
    /// [`StateError::Different`] with the names of what differs and both values.
    pub fn check_same(&self, other: &Self) -> Result<(), StateError> {
        let fields = |identity: &Self| identity.fields().into_iter().chain(plan_fields(&identity.plan));
        let differences: Vec<_> = fields(self)
            .zip(fields(other))
            .filter(|(own, other)| own != other)
            .map(|((name, own), (_, other))| format!("{name} is {own} in one and {other} in the other"))
            .collect();
        if differences.is_empty() { Ok(()) } else { Err(StateError::Different { differences }) }
    }

    /// Names and values of whatever counts beside the plan, as text: the shortest decimals of two different
    /// numbers differ.
    fn fields(&self) -> [(&'static str, String); 13] {
        let Settings {
            seed,
            min_length,
            max_length,
            heuristic,
            photon_beams,
            query_beams,
            features,
            // These count by the plan that they lead to.
            techniques: _,
            deterministic: _,
            light_paths: _,
            beams: _,
            connections: _,
            next_events: _,
            roulette: _,
            radii: _,
            progressive: _,
            memory: _,
        } = &self.settings;
        let (width, height) = self.film;
        let PixelRect { x, y, width: columns, height: rows } = self.crop;
        [
            ("version", self.version.clone()),
            ("version of samples", self.samples.to_string()),
            ("scene", if self.fingerprint.is_empty() { "unnamed".into() } else { self.fingerprint.clone() }),
            ("film", format!("{width} x {height}")),
            ("crop", format!("{columns} x {rows} at ({x}, {y})")),
            ("seed", seed.to_string()),
            ("min_length", min_length.to_string()),
            ("max_length", max_length.to_string()),
            ("heuristic", format!("{heuristic:?}")),
            ("photon_beams", format!("{photon_beams:?}")),
            ("query_beams", format!("{query_beams:?}")),
            ("features", features.to_string()),
            ("choice of emitters", fingerprint(format!("{:?}", self.emitters).as_bytes())),
        ]
    }
}

/// The same of the plan, all of it.
fn plan_fields(plan: &Plan) -> [(&'static str, String); 19] {
    let Plan {
        techniques,
        light_paths,
        beam_paths,
        connections,
        next_events,
        camera_factor,
        roulette,
        periods,
        vertices_per_light_path,
        radii:
            RadiusSchedule { surf, pp3d, pb2d, bp2d, bb1d, field, most_mean_free_paths, progressive, floor },
        lanes,
    } = plan;
    [
        ("techniques", techniques.to_string()),
        ("light_paths", light_paths.to_string()),
        ("beams", beam_paths.to_string()),
        ("connections", connections.to_string()),
        ("next_events", next_events.to_string()),
        ("camera_factor", camera_factor.to_string()),
        ("roulette", format!("{roulette:?}")),
        ("periods", format!("{periods:?}")),
        ("vertices per light sub-path", vertices_per_light_path.to_string()),
        ("radii.surf", surf.to_string()),
        ("radii.pp3d", pp3d.to_string()),
        ("radii.pb2d", pb2d.to_string()),
        ("radii.bp2d", bp2d.to_string()),
        ("radii.bb1d", bb1d.to_string()),
        ("radii.field", format!("{field:?}")),
        ("mean free paths", format!("{most_mean_free_paths:?}")),
        ("least radius", floor.to_string()),
        ("progressive", progressive.to_string()),
        ("lanes", format!("{lanes:?}")),
    ]
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroU32;

    use upbp_estimators::mis::{BeamExtent, Heuristic};
    use upbp_estimators::{FootprintField, MergePeriods, RadiusField, Roulette, TechniqueSet};

    use super::*;
    use crate::plan::tests::plan;

    fn identity() -> Identity {
        Identity {
            version: "1.2.3".into(),
            samples: 4,
            scene: "room".into(),
            fingerprint: "ab".into(),
            film: (40, 30),
            crop: PixelRect { x: 0, y: 0, width: 40, height: 30 },
            settings: Settings::default(),
            support: TechniqueSupport {
                techniques: TechniqueSet::STANDARD,
                needs_merges: false,
                emitting_media: false,
                reasons: Vec::new(),
            },
            plan: plan(),
            emitters: Arc::default(),
        }
    }

    /// The name that a change is to be told by, and the change.
    type Change<'a> = (&'a str, &'a dyn Fn(&mut Identity));

    /// Whatever changes iterations is compared: such a change is named, and it alone.
    #[test]
    fn each_difference_is_named() {
        let focus = |i: &mut Identity| {
            let text = ron::to_string(&*i.emitters).unwrap();
            let text = text.replace("(emission", "(focus:Some((0.0,0.0,1.0)),emission");
            i.emitters = ron::from_str(&text).unwrap();
        };
        let field = FootprintField { eye: [0.0; 3], offset: 1.0, slope: 0.01, least: 0.5, most: 2.0 };
        let changes: [Change<'_>; 32] = [
            ("version", &|i| i.version = "1.2.4".into()),
            ("version of samples", &|i| i.samples = 5),
            ("scene", &|i| i.fingerprint = "cd".into()),
            ("film", &|i| i.film.0 = 41),
            ("crop", &|i| i.crop.y = 1),
            ("seed", &|i| i.settings.seed = 1),
            ("min_length", &|i| i.settings.min_length = 2),
            ("max_length", &|i| i.settings.max_length = 100),
            ("heuristic", &|i| i.settings.heuristic = Heuristic::Power),
            ("photon_beams", &|i| i.settings.photon_beams = BeamExtent::Long),
            ("query_beams", &|i| i.settings.query_beams = BeamExtent::Short),
            ("features", &|i| i.settings.features = true),
            ("choice of emitters", &focus),
            ("techniques", &|i| i.plan.techniques = TechniqueSet::BPT),
            ("light_paths", &|i| i.plan.light_paths += 1),
            ("beams", &|i| i.plan.beam_paths += 1),
            ("connections", &|i| i.plan.connections = 0.3),
            ("next_events", &|i| i.plan.next_events = 0.3),
            ("camera_factor", &|i| i.plan.camera_factor = 2.0),
            ("roulette", &|i| i.plan.roulette = Roulette::Off),
            ("periods", &|i| {
                i.plan.periods = MergePeriods { pb2d: NonZeroU32::new(9).unwrap(), ..i.plan.periods }
            }),
            ("vertices per light sub-path", &|i| i.plan.vertices_per_light_path = 3.2),
            ("radii.surf", &|i| i.plan.radii.surf = 0.2),
            ("radii.pp3d", &|i| i.plan.radii.pp3d = 0.2),
            ("radii.pb2d", &|i| i.plan.radii.pb2d = 0.2),
            ("radii.bp2d", &|i| i.plan.radii.bp2d = 0.2),
            ("radii.bb1d", &|i| i.plan.radii.bb1d = 0.2),
            ("radii.field", &|i| i.plan.radii.field = RadiusField::Footprint(field)),
            ("mean free paths", &|i| i.plan.radii.most_mean_free_paths = Some(0.5)),
            ("least radius", &|i| i.plan.radii.floor = 0.2),
            ("progressive", &|i| i.plan.radii.progressive = false),
            ("lanes", &|i| i.plan.lanes = None),
        ];
        for (name, change) in changes {
            let mut other = identity();
            change(&mut other);
            let found = identity().check_same(&other);
            let is_named = |differences: &[String]| {
                differences.len() == 1 && differences[0].starts_with(&format!("{name} is "))
            };
            assert!(
                matches!(&found, Err(StateError::Different { differences }) if is_named(differences)),
                "{name}: {found:?}"
            );
        }
        assert_eq!(identity().fields().len() + plan_fields(&plan()).len(), changes.len(), "none is left out");
        // A name is for people, and settings count by the plan that they lead to.
        let mut other = identity();
        other.scene = "hall".into();
        other.settings = Settings { memory: Some(100), beams: Some(3), ..other.settings };
        assert!(identity().check_same(&other).is_ok());
    }
}
