//! The end of an edge, the same for both walks: where it stops, what is there, what it passes on.

use glam::Vec3;
use upbp_media::{EdgeDensity, Lanes};

use super::context::Context;
use super::edge::EdgeTrace;
use super::interaction::{Interaction, MediumInterface, Scattered};
use crate::mis::{Densities, EdgeMis, EdgeStart, MergeKind, VertexMis};
use crate::scene::Scene;

/// The end of an edge.
pub(crate) struct Arrived<'a, B, L> {
    pub(crate) position: Vec3,
    pub(crate) distance: f32,
    pub(crate) density: EdgeDensity<L>,
    pub(crate) interaction: Interaction<B>,
    /// The bodies around it.
    pub(crate) sides: MediumInterface<'a>,
}

pub(crate) enum Arrival<'a, B, L> {
    /// At a vertex.
    Vertex(Arrived<'a, B, L>),
    /// To infinity.
    Escaped,
    /// Grazing a surface.
    Absorbed,
    /// To infinity, but still inside a body: the geometry is not closed. Or to where nothing can be: the
    /// scene breaks its contract.
    Lost,
}

#[inline]
pub(crate) fn arrive<'a, S: Scene, L: Lanes>(
    scene: &S,
    edge_trace: &'a EdgeTrace<S::Bsdf, L>,
) -> Arrival<'a, S::Bsdf, L> {
    if edge_trace.is_lost() {
        return Arrival::Lost;
    }
    let sides = edge_trace.sides();
    if let Some((i, t)) = edge_trace.stop {
        let span = &edge_trace.spans[i];
        let Some(medium) = span.medium else { return Arrival::Lost };
        let position = edge_trace.ray.at(t);
        if !(t >= span.start && position.is_finite()) {
            return Arrival::Lost;
        }
        return Arrival::Vertex(Arrived {
            position,
            distance: t,
            density: edge_trace.density_to(scene, span, t),
            interaction: Interaction::Medium(medium),
            sides,
        });
    }
    let Some(hit) = &edge_trace.hit else {
        return if sides.near.is_empty() { Arrival::Escaped } else { Arrival::Lost };
    };
    let Some(&bsdf) = hit.boundary.bsdf() else { return Arrival::Lost };
    match Interaction::at_hit(hit, bsdf, edge_trace.ray.direction, &sides) {
        Some(interaction) => Arrival::Vertex(Arrived {
            position: hit.position,
            distance: hit.t,
            density: edge_trace.density(scene),
            interaction,
            sides,
        }),
        None => Arrival::Absorbed,
    }
}

/// Densities for the weights of the next vertex, of a vertex that has scattered; `scale` is that of kernel
/// radii there.
pub(crate) fn depart<S: Scene, D: Densities, L: Lanes>(
    context: &Context<'_, S>,
    mis: &VertexMis<D, L>,
    interaction: &Interaction<S::Bsdf>,
    scale: f32,
    scattered: &Scattered<L>,
) -> EdgeMis<D, L> {
    let (rho, shares) = scattered.rho_own.step(&mis.shares);
    let smooth = if scattered.delta { VertexMis { connect: D::ZERO, ..*mis } } else { *mis };
    EdgeMis {
        before: smooth.before_each(&context.plan.mis, scattered.rho_opposite),
        rho,
        cos_out: scattered.cos,
        kind: if scattered.delta {
            MergeKind::None
        } else {
            context.plan.merge_kind(interaction, scattered.sin_theta, scale)
        },
        distance_factor: mis.distance_factor,
        shares,
        connectible: !scattered.delta,
        start: if interaction.in_medium() { EdgeStart::Medium } else { EdgeStart::Surface },
    }
}
