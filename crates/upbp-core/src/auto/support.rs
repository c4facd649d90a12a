//! What of the chosen techniques the scene can use at all.
//!
//! What cannot contribute is neither traced, stored, built nor looked up. Every decision here is exact: it never removes
//! a path.

use std::fmt;

use serde::{Deserialize, Serialize};
use upbp_estimators::scene::{Emitter, EmitterId, Scene};
use upbp_estimators::{Technique, TechniqueSet, World};

use crate::error::RenderError;
use crate::media::Medium;

/// The techniques that remain, and why others do not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Census {
    /// The techniques that run.
    pub techniques: TechniqueSet,
    /// Whether there may be light that only merges find: of a light that cannot be hit, through a specular surface to a place that
    /// is seen through another.
    pub needs_merges: bool,
    /// Whether media emit, in whose volume no light sub-path starts: that light is found by emission hits alone, where camera sub-paths happen
    /// to pass.
    #[serde(default)]
    pub emitting_media: bool,
    /// One sentence for each reason to leave something out.
    pub reasons: Vec<String>,
}

impl Census {
    /// As [`take`](Self::take), for a picture that is not black by construction.
    ///
    /// # Errors
    /// If none of the techniques can make any light in the scene.
    pub(crate) fn with_light<S: Scene>(
        world: &World<'_, S>,
        chosen: TechniqueSet,
        max_length: u32,
    ) -> Result<Self, RenderError> {
        let census = Self::take(world, chosen, max_length);
        if !census.techniques.is_empty() {
            return Ok(census);
        }
        let possible = Self::take(world, TechniqueSet::ALL, max_length);
        let reasons = if possible.techniques.is_empty() { possible.reasons } else { census.reasons };
        Err(RenderError::NoLight { chosen, possible: possible.techniques, reasons: reasons.join("; ") })
    }

    /// Looks at the scene and at path lengths of up to `max_length` edges.
    #[must_use]
    pub fn take<S: Scene>(world: &World<'_, S>, chosen: TechniqueSet, max_length: u32) -> Self {
        let scene = world.scene;
        let all_hittable = scene.emitters().iter().all(|emitter| emitter.kind().is_hittable());
        let mut census = Self {
            techniques: chosen,
            needs_merges: scene.has_specular_surfaces() && !all_hittable,
            emitting_media: world.has_emitting_media(),
            reasons: Vec::new(),
        };
        let scattering = scene.media().iter().any(Medium::scatters);
        if !scattering {
            census
                .drop("no medium scatters: photons and beams in media are off", TechniqueSet::VOLUME_MERGES);
        }
        if !scene.has_connectible_surfaces() {
            let surf = TechniqueSet::EMPTY.with(Technique::Surf);
            census.drop("all surfaces are specular: surface merging is off", surf);
            if !scattering {
                let connections = [Technique::Nee, Technique::Connect, Technique::LightTracing];
                census.drop(
                    "nothing but specular surfaces: only emission hits remain",
                    connections.into_iter().collect(),
                );
            }
        }
        if !world.has_emitters() && !world.has_emitting_media() {
            census.drop("nothing shines that reaches the scene", TechniqueSet::ALL);
        } else if !world.has_emitters() {
            let emission_only = chosen.without(TechniqueSet::EMPTY.with(Technique::Hit));
            census.drop("no light but emitting media: only emission hits remain", emission_only);
        }
        let is_hit = |(index, emitter): (usize, &S::Emitter)| {
            emitter.kind().is_hittable() && world.emission_probability(EmitterId(index as u32)) > 0.0
        };
        if !world.has_emitting_media() && !scene.emitters().iter().enumerate().any(is_hit) {
            census
                .drop("no light can be hit: emission hits are off", TechniqueSet::EMPTY.with(Technique::Hit));
        }
        if max_length < 2 {
            let all_but_hit = TechniqueSet::ALL.without(TechniqueSet::EMPTY.with(Technique::Hit));
            census.drop("paths of one edge: only emission hits remain", all_but_hit);
        } else if max_length < 3 {
            census.drop(
                "paths of up to two edges: vertices are not connected",
                TechniqueSet::EMPTY.with(Technique::Connect),
            );
        }
        census
    }

    fn drop(&mut self, reason: &str, techniques: TechniqueSet) {
        if self.techniques.intersects(techniques) {
            self.techniques = self.techniques.without(techniques);
            self.reasons.push(reason.to_owned());
        }
    }
}

impl fmt::Display for Census {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "techniques that the scene can use: {}", self.techniques)?;
        for reason in &self.reasons {
            write!(f, "; {reason}")?;
        }
        if self.emitting_media {
            let found = if self.techniques.has(Technique::Hit) {
                "found by chance only, where camera sub-paths pass through them"
            } else {
                "not found, since emission hits are off"
            };
            write!(f, "; no light sub-path starts in the media that emit: their light is {found}")?;
        }
        Ok(())
    }
}
