//! What of the chosen techniques the scene can use at all.
//!
//! What cannot contribute is neither traced, stored, built nor looked up. Every decision here is exact: it never removes
//! a path.

use std::fmt;

use serde::{Deserialize, Serialize};
use upbp_estimators::scene::{Emitter, Scene};
use upbp_estimators::{Technique, TechniqueSet, World};

use crate::media::Medium;

/// The techniques that remain, and why others do not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Census {
    /// The techniques that run.
    pub techniques: TechniqueSet,
    /// Whether there may be light that only merges find: of a light that cannot be hit, through a specular surface to a place that
    /// is seen through another.
    pub needs_merges: bool,
    /// One sentence for each reason to leave something out.
    pub reasons: Vec<String>,
}

impl Census {
    /// Looks at the scene and at path lengths of up to `max_length` edges.
    #[must_use]
    pub fn take<S: Scene>(world: &World<'_, S>, chosen: TechniqueSet, max_length: u32) -> Self {
        let scene = world.scene;
        let all_hittable = scene.emitters().iter().all(|emitter| emitter.kind().is_hittable());
        let mut census = Self {
            techniques: chosen,
            needs_merges: scene.has_specular_surfaces() && !all_hittable,
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
        if !world.has_emitters() {
            let emission_only = chosen.without(TechniqueSet::EMPTY.with(Technique::Hit));
            census.drop("no light but emitting media: only emission hits remain", emission_only);
        } else if !world.scene.emitters().iter().any(|emitter| emitter.kind().is_hittable())
            && !scene.media().iter().any(Medium::emits)
        {
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
        Ok(())
    }
}
