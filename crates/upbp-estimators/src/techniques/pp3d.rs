//! PP3D: photon points in media around a vertex in a medium (`docs/theory.md`, section 2.3).

use upbp_media::{Lanes, MediumId};

use super::merge::merge;
use crate::camera_output::Output;
use crate::light_map::LightMap;
use crate::observer::Observer;
use crate::path::{CameraVertex, Context, Interaction};
use crate::scene::Scene;
use crate::technique::Technique;

/// Merges the photons around `vertex`, which lies in `medium`.
pub(super) fn pp3d<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    map: &LightMap<S::Bsdf, O::Densities, L>,
    vertex: &CameraVertex<S::Bsdf, O::Densities, L>,
    medium: MediumId,
    out: &mut Output<'_, O>,
) {
    let plan = context.plan;
    if !plan.merges_in(medium, Technique::Pp3d) {
        return;
    }
    let kernel = plan.kernels_in(medium, Technique::Pp3d).at(vertex.scale);
    let ahead = |index| map.read_ahead(index);
    let tests = map.medium.in_ball_ahead(vertex.position, kernel.radius(), ahead, |index, distance2| {
        let photon = &map.vertices[index as usize];
        if matches!(photon.interaction, Interaction::Medium(other) if other == medium)
            && plan.lengths.contains(vertex.depth + photon.depth)
        {
            merge(context, Technique::Pp3d, photon, vertex, kernel.value(distance2), out);
        }
    });
    out.observer.call(Technique::Pp3d, tests);
}
