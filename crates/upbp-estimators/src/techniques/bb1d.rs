//! BB1D: photon beams around a camera edge, the query beam (`docs/theory.md`, section 2.6).

use upbp_media::Lanes;

use super::merge::merge;
use crate::camera_output::Output;
use crate::light_map::LightMap;
use crate::observer::Observer;
use crate::path::{CameraEdge, Context, EdgeTrace};
use crate::scene::Scene;
use crate::technique::Technique;

/// Merges the photon beams around `edge`, through all its media.
pub(super) fn bb1d<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    map: &LightMap<S::Bsdf, O::Densities, L>,
    edge_trace: &EdgeTrace<S::Bsdf, L>,
    edge: &CameraEdge<O::Densities, L>,
    out: &mut Output<'_, O>,
) {
    let plan = context.plan;
    for (span, medium, beam) in edge_trace.query_beams(plan, edge.depth, Technique::Bb1d) {
        let kernels = plan.kernels_in(medium, Technique::Bb1d);
        let radius = kernels.search_radius(&plan.radius_field);
        let tests = map.beam_tree.around_ray(&beam, radius, |index, approach| {
            let t = approach.t_ray;
            let scale = plan.radius_scale(beam.at(t), true);
            let kernel = kernels.at(scale).value(approach.distance * approach.distance);
            let photons = &map.beams[index as usize];
            if kernel > 0.0
                && photons.medium == medium
                && plan.lengths.contains(edge.depth + photons.depth)
                && let Some(light) = photons.vertex_at(context, approach.t_segment)
                && let Some(vertex) = edge.vertex_at(context, edge_trace, (span, medium), (t, scale))
            {
                let kernel = kernel / approach.sin_theta;
                merge(context, Technique::Bb1d, &light, &vertex, kernel, out);
            }
        });
        out.observer.call(Technique::Bb1d, tests);
    }
}
