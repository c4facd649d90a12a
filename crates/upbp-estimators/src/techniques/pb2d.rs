//! PB2D: photon points in media around a camera edge, the query beam (`docs/theory.md`, section 2.4).

use upbp_media::Lanes;

use super::merge::merge;
use crate::camera_output::Output;
use crate::light_map::LightMap;
use crate::observer::Observer;
use crate::path::{CameraEdge, Context, EdgeTrace, Interaction};
use crate::scene::Scene;
use crate::technique::Technique;

/// Merges the photons around `edge`, through all its media.
pub(super) fn pb2d<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    map: &LightMap<S::Bsdf, O::Densities, L>,
    edge_trace: &EdgeTrace<S::Bsdf, L>,
    edge: &CameraEdge<O::Densities, L>,
    out: &mut Output<'_, O>,
) {
    let plan = context.plan;
    for (span, medium, beam) in edge_trace.query_beams(plan, edge.depth, Technique::Pb2d) {
        let kernels = plan.kernels_in(medium, Technique::Pb2d);
        let radius = kernels.search_radius(&plan.radius_field);
        let ahead = |index| map.read_ahead(index);
        let tests = map.medium.around_ray_ahead(&beam, radius, ahead, |index, t, distance2| {
            let scale = plan.radius_scale(beam.at(t), true);
            let kernel = kernels.at(scale).value(distance2);
            let photon = &map.vertices[index as usize];
            if kernel > 0.0
                && matches!(photon.interaction, Interaction::Medium(other) if other == medium)
                && plan.lengths.contains(edge.depth + photon.depth)
                && let Some(vertex) = edge.vertex_at(context, edge_trace, (span, medium), (t, scale))
            {
                merge(context, Technique::Pb2d, photon, &vertex, kernel, out);
            }
        });
        out.observer.call(Technique::Pb2d, tests);
    }
}
