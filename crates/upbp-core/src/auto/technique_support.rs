//! Techniques that can contribute anything in a scene.
//!
//! Those that cannot are neither traced, stored, built nor queried. Every decision here is exact: it never
//! removes a path.

use std::fmt;

use serde::{Deserialize, Serialize};
use upbp_estimators::scene::{Emitter, EmitterKind, Scene};
use upbp_estimators::{MediumId, PreparedScene, Technique, TechniqueSet};

use crate::error::RenderError;
use crate::media::Medium;
use crate::plan::Plan;
use crate::settings::Settings;

/// The techniques that remain, and why others do not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct TechniqueSupport {
    /// Techniques that the settings allow and the scene can use; a [plan](crate::Plan) runs some of them.
    pub techniques: TechniqueSet,
    /// Whether there may be light that only merges find: of a light that cannot be hit, through a specular
    /// surface to a place that is seen through another.
    pub needs_merges: bool,
    /// Whether media emit in whose volume no light sub-path starts: that light is found by emission hits
    /// alone, where camera sub-paths pass.
    pub emitting_media: bool,
    /// One sentence for each reason to leave something out.
    pub reasons: Vec<String>,
}

impl TechniqueSupport {
    /// The support of the techniques that the settings allow.
    ///
    /// # Errors
    /// [`RenderError::NoLight`].
    pub(crate) fn of<S: Scene>(
        scene: &PreparedScene<'_, S>,
        settings: &Settings,
    ) -> Result<Self, RenderError> {
        let (chosen, max_length) = (settings.techniques.candidates(), settings.max_length);
        let support = Self::find(scene, chosen, max_length);
        if support.techniques.is_empty() {
            let possible = Self::find(scene, TechniqueSet::ALL, max_length);
            let reasons = if possible.techniques.is_empty() { possible.reasons } else { support.reasons };
            let (possible, reasons) = (possible.techniques, reasons.join("; "));
            return Err(RenderError::NoLight { chosen, possible, reasons });
        }
        Ok(support)
    }

    /// Checks that the scene can use all techniques of a plan.
    ///
    /// # Errors
    /// [`RenderError::Plan`].
    pub(super) fn check(&self, plan: &Plan) -> Result<(), RenderError> {
        let techniques = self.techniques;
        let extra = plan.techniques.without(techniques);
        if extra.is_empty() { Ok(()) } else { Err(RenderError::Plan { extra, techniques }) }
    }

    /// Looks at the scene and at path lengths of up to `max_length` edges.
    fn find<S: Scene>(prepared: &PreparedScene<'_, S>, chosen: TechniqueSet, max_length: u32) -> Self {
        let scene = prepared.scene;
        let all_hittable = scene.emitters().iter().all(|emitter| emitter.kind().is_hittable());
        let mut support = Self {
            techniques: chosen,
            needs_merges: scene.has_specular_surfaces() && !all_hittable,
            emitting_media: emits_without_emitter(prepared),
            reasons: Vec::new(),
        };
        let hit = TechniqueSet::only(Technique::Hit);
        // Without vertices to connect.
        let (at_camera, remain) = if prepared.has_lens_emitters() {
            (hit.with(Technique::Nee), "only emission hits and next events at the lens remain")
        } else {
            (hit, "only emission hits remain")
        };
        let scattering = scene.media().iter().any(Medium::scatters);
        if !scattering {
            support
                .drop("no medium scatters: photons and beams in media are off", TechniqueSet::VOLUME_MERGES);
        }
        if !scene.has_connectible_surfaces() {
            let surf = TechniqueSet::only(Technique::Surf);
            support.drop("all surfaces are specular: surface merging is off", surf);
            if !scattering {
                let reason = format!("nothing but specular surfaces: {remain}");
                support.drop(&reason, TechniqueSet::BPT.without(at_camera));
            }
        }
        // Whatever their power: zero is never chosen, and hit like any other.
        let is_area = |emitter: &S::Emitter| emitter.kind() == EmitterKind::Area;
        let is_hit = prepared.has_emitting_media()
            || !prepared.environments().is_empty()
            || scene.emitters().iter().any(is_area);
        match (is_hit, prepared.has_emitters()) {
            (true, true) => {}
            (true, false) => support
                .drop("nothing that shines can be chosen: only emission hits remain", chosen.without(hit)),
            (false, true) => support.drop("no light can be hit: emission hits are off", hit),
            (false, false) => support.drop("nothing shines that reaches the scene", TechniqueSet::ALL),
        }
        if max_length < 2 {
            support.drop(&format!("paths of one edge: {remain}"), TechniqueSet::ALL.without(at_camera));
        } else if max_length < 3 {
            support.drop(
                "paths of up to two edges: vertices are not connected",
                TechniqueSet::only(Technique::Connect),
            );
        }
        support
    }

    fn drop(&mut self, reason: &str, techniques: TechniqueSet) {
        if self.techniques.intersects(techniques) {
            self.techniques = self.techniques.without(techniques);
            self.reasons.push(reason.to_owned());
        }
    }
}

/// Whether a medium emits around everything, in a body whose volume was [left out](super::volumes), or in one
/// that the host has made no emitter of.
fn emits_without_emitter<S: Scene>(prepared: &PreparedScene<'_, S>) -> bool {
    let scene = prepared.scene;
    let is_volume = |emitter: &&S::Emitter| matches!(emitter.kind(), EmitterKind::Volume(_));
    let volumes = scene.emitters().iter().filter(is_volume).count();
    let emits = |medium: MediumId| scene.media().get(medium.0 as usize).is_some_and(Medium::emits);
    let is_complete = volumes > 0 && prepared.volume_emitters().count() == volumes;
    prepared.has_emitting_media() && (!is_complete || scene.outside().is_some_and(emits))
}

impl fmt::Display for TechniqueSupport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "techniques that the scene can use: {}", self.techniques)?;
        for reason in &self.reasons {
            write!(f, "; {reason}")?;
        }
        if self.emitting_media {
            let found = if self.techniques.has(Technique::Hit) {
                "found by camera sub-paths alone, where they pass through"
            } else {
                "not found, since emission hits are off"
            };
            write!(f, "; media emit that no light sub-path starts in: their light is {found}")?;
        }
        Ok(())
    }
}
