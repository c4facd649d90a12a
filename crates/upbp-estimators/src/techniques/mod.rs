//! Techniques, a file each: where they find samples, what those contribute and weigh.
//!
//! Source: `docs/theory.md`, section 2 for contributions, 4.4 for weights.

mod bb1d;
mod bp2d;
mod connect;
mod hit;
mod lens;
mod light_tracing;
mod merge;
mod nee;
mod pb2d;
mod pp3d;
mod surf;

use upbp_media::Lanes;

use bb1d::bb1d;
use bp2d::bp2d;
pub(crate) use connect::connections;
pub(crate) use hit::{emission_along, environment, hit};
pub(crate) use lens::next_events_at_lens;
pub(crate) use light_tracing::light_tracing;
pub(crate) use nee::next_events;
use pb2d::pb2d;
use pp3d::pp3d;
use surf::surf;

use crate::camera_output::Output;
use crate::light_map::LightMap;
use crate::observer::Observer;
use crate::path::{CameraEdge, CameraVertex, Context, EdgeTrace, Interaction};
use crate::scene::Scene;
use crate::technique::{Technique, TechniqueSet};

/// Merges the photon points and beams around a camera edge, by those of `techniques` that do.
pub(crate) fn merge_along_edge<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    map: &LightMap<S::Bsdf, O::Densities, L>,
    techniques: TechniqueSet,
    edge_trace: &EdgeTrace<S::Bsdf, L>,
    edge: &CameraEdge<O::Densities, L>,
    out: &mut Output<'_, O>,
) {
    if techniques.has(Technique::Pb2d) {
        pb2d(context, map, edge_trace, edge, out);
    }
    if techniques.has(Technique::Bb1d) {
        bb1d(context, map, edge_trace, edge, out);
    }
}

/// Merges the photon points and beams around a camera vertex, by those of `techniques` that do.
pub(crate) fn merge_at_vertex<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    map: &LightMap<S::Bsdf, O::Densities, L>,
    techniques: TechniqueSet,
    vertex: &CameraVertex<S::Bsdf, O::Densities, L>,
    out: &mut Output<'_, O>,
) {
    match &vertex.interaction {
        Interaction::Surface(surface) => {
            if techniques.has(Technique::Surf) {
                surf(context, map, vertex, surface, out);
            }
        }
        Interaction::Medium(medium) => {
            if techniques.has(Technique::Pp3d) {
                pp3d(context, map, vertex, *medium, out);
            }
            if techniques.has(Technique::Bp2d) {
                bp2d(context, map, vertex, *medium, out);
            }
        }
    }
}
