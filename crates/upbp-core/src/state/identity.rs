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

/// The identity of a render: whatever its iterations depend on, besides their index.
///
/// The plan is part of it: so slices from machines whose mathematical functions differ in the last bit, and
/// which therefore chose otherwise, are refused and not mixed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// Version of the renderer.
    pub version: String,
    /// Name of the scene, for people: it may differ.
    pub scene: String,
    /// Fingerprint of the scene's content; empty if the host gave none.
    pub fingerprint: String,
    /// Width and height of the whole film in pixels.
    pub film: (u32, u32),
    /// Column, row, width and height of the part that is rendered.
    pub part: (u32, u32, u32, u32),
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

    /// The part of the film.
    pub(crate) const fn rect(&self) -> PixelRect {
        let (x, y, width, height) = self.part;
        PixelRect { x, y, width, height }
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
    fn fields(&self) -> [(&'static str, String); 12] {
        let s = &self.settings;
        let (width, height) = self.film;
        let (x, y, columns, rows) = self.part;
        [
            ("version", self.version.clone()),
            ("scene", if self.fingerprint.is_empty() { "unnamed".into() } else { self.fingerprint.clone() }),
            ("film", format!("{width} x {height}")),
            ("crop", format!("{columns} x {rows} at ({x}, {y})")),
            ("seed", s.seed.to_string()),
            ("min_length", s.min_length.to_string()),
            ("max_length", s.max_length.to_string()),
            ("heuristic", format!("{:?}", s.heuristic)),
            ("photon_beams", format!("{:?}", s.photon_beams)),
            ("query_beams", format!("{:?}", s.query_beams)),
            ("features", s.features.to_string()),
            ("choice of emitters", fingerprint(format!("{:?}", self.emitters).as_bytes())),
        ]
    }
}

/// The same of the plan, all of it.
fn plan_fields(plan: &Plan) -> [(&'static str, String); 18] {
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
        radii: RadiusSchedule { surf, pp3d, pb2d, bp2d, bb1d, field, progressive, floor },
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
        ("least radius", floor.to_string()),
        ("progressive", progressive.to_string()),
        ("lanes", format!("{lanes:?}")),
    ]
}
