//! The end of an edge, the same for both walks: where it stops, what is there, what it passes on.

use glam::Vec3;
use upbp_media::EdgeDensity;

use super::context::Context;
use super::edge::Passage;
use super::interaction::{Scattered, Sides, Site};
use crate::mis::{Densities, MergeSite, Pending, Tip};
use crate::scene::Scene;

/// The end of an edge.
pub(crate) struct Arrived<B> {
    pub(crate) position: Vec3,
    pub(crate) distance: f32,
    pub(crate) density: EdgeDensity,
    pub(crate) site: Site<B>,
    /// The bodies around it.
    pub(crate) sides: Sides,
}

#[expect(
    clippy::large_enum_variant,
    reason = "lives on the stack for a moment, and is nearly always the large one"
)]
pub(crate) enum Arrival<B> {
    /// At a vertex.
    Vertex(Arrived<B>),
    /// To infinity.
    Escaped,
    /// Grazing a surface.
    Absorbed,
    /// To infinity, but still inside a body: the geometry is not closed. Or to where nothing can be: the
    /// scene breaks its contract.
    Lost,
}

pub(crate) fn arrive<S: Scene>(scene: &S, passage: &Passage<S::Bsdf>) -> Arrival<S::Bsdf> {
    if passage.is_lost() {
        return Arrival::Lost;
    }
    if let Some((i, t)) = passage.stop {
        let span = &passage.spans[i];
        let Some(medium) = span.medium else { return Arrival::Lost };
        let position = passage.origin + t * passage.direction;
        if !(t >= span.start && position.is_finite()) {
            return Arrival::Lost;
        }
        return Arrival::Vertex(Arrived {
            position,
            distance: t,
            density: passage.density_to(scene, span, t),
            site: Site::Medium(medium),
            sides: Sides::around(passage.stack_in(span, t)),
        });
    }
    let stack = passage.stack_at_end();
    let Some(hit) = &passage.hit else {
        return if stack.is_empty() { Arrival::Escaped } else { Arrival::Lost };
    };
    let Some(bsdf) = hit.bsdf else { return Arrival::Lost };
    match Site::at_hit(hit, bsdf, passage.direction, stack) {
        Some((site, sides)) => Arrival::Vertex(Arrived {
            position: hit.position,
            distance: hit.t,
            density: passage.density(scene),
            site,
            sides,
        }),
        None => Arrival::Absorbed,
    }
}

/// Densities for the weights of the next vertex, of a vertex that has scattered.
pub(crate) fn pend<S: Scene, D: Densities>(
    context: &Context<'_, S>,
    tip: &Tip<D>,
    site: &Site<S::Bsdf>,
    scattered: &Scattered,
) -> Pending<D> {
    let smooth = if scattered.delta { Tip { connect: D::ZERO, ..*tip } } else { *tip };
    Pending {
        before: smooth.before(&context.plan.mis, scattered.rho_opposite),
        rho: scattered.rho_own,
        cos_out: scattered.cos,
        site: if scattered.delta { MergeSite::None } else { site.merge_site(scattered.sin_theta) },
        distance_factor: tip.distance_factor,
        connectible: !scattered.delta,
        in_medium: site.in_medium(),
    }
}
