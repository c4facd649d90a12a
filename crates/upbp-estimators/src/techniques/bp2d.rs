//! BP2D: photon beams around a vertex in a medium (`docs/theory.md`, section 2.5).

use upbp_media::{Lanes, MediumId};

use super::merge::merge;
use crate::camera_output::Output;
use crate::light_map::LightMap;
use crate::observer::Observer;
use crate::path::{CameraVertex, Context};
use crate::scene::Scene;
use crate::technique::Technique;

/// Merges the photon beams around `vertex`, which lies in `medium`.
pub(super) fn bp2d<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    map: &LightMap<S::Bsdf, O::Densities, L>,
    vertex: &CameraVertex<S::Bsdf, O::Densities, L>,
    medium: MediumId,
    out: &mut Output<'_, O>,
) {
    let plan = context.plan;
    if !plan.merges_in(medium, Technique::Bp2d) {
        return;
    }
    let kernel = plan.kernels_in(medium, Technique::Bp2d).at(vertex.scale);
    let tests = map.beam_tree.around_point(vertex.position, kernel.radius(), |index, t, distance2| {
        let beam = &map.beams[index as usize];
        if beam.medium == medium
            && plan.lengths.contains(vertex.depth + beam.depth)
            && let Some(light) = beam.vertex_at(context, t)
        {
            merge(context, Technique::Bp2d, &light, vertex, kernel.value(distance2), out);
        }
    });
    out.observer.call(Technique::Bp2d, tests);
}
