//! Two numbers per vertex instead of a walk over the path (`docs/theory.md`, sections 4.1 to 4.6).
//!
//! For a sub-path that ends at `u_i`, let `B_i` be the sum of the densities of all techniques that split the
//! path before `u_i`, relative to the density of "the sub-path ends at `u_i`". It is linear in the one
//! unknown, the density ρ′ with which the other side's walk would scatter at `u_i`: `B_i = D_i + ρ′ E_i`. A
//! vertex carries `D` and `E`. The same recursion serves both walks. Oracle: [`super::oracle`].

use upbp_media::EdgeDensity;

use super::counts::{BeamExtent, MergeKind, MisPlan};
use super::density_sum::Densities;
use crate::scene::Walk;
use crate::technique::Technique;

/// Densities of all techniques that split a sub-path before a vertex, on arrival there (section 4.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexMis<D = f64> {
    /// `D_i`: connecting to this vertex from the one before.
    pub connect: D,
    /// `E_i`: everything below the vertex before, per opposite scattering density.
    pub below: D,
    /// The distance factor of the arriving edge; 0 on surfaces.
    pub distance_factor: f64,
}

impl<D: Densities> VertexMis<D> {
    /// `B_i = D_i + ρ′ E_i` for the opposite scattering density `ρ′`, roulette included, sr⁻¹.
    #[inline]
    #[must_use]
    pub fn before(&self, plan: &MisPlan, rho_opposite: f64) -> D {
        // A branch instead of 0 · ∞ where the other walk cannot scatter this way.
        if rho_opposite > 0.0 { self.connect + self.below * plan.pow(rho_opposite) } else { self.connect }
    }

    /// The end of the sub-path for a connection to its vertex: `kind` is the vertex with the direction of the
    /// connection, `opposite` the distance factor of the other walk that would arrive there, `rho_opposite`
    /// the density with which it would then scatter along this sub-path.
    #[inline]
    #[must_use]
    pub fn end(
        &self,
        plan: &MisPlan,
        walk: Walk,
        kind: MergeKind,
        opposite: f64,
        rho_opposite: f64,
    ) -> End<D> {
        End {
            merges: merges(plan, walk, kind, self.distance_factor, opposite),
            before: self.before(plan, rho_opposite),
        }
    }
}

/// One sub-path's end, seen from the completed path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End<D = f64> {
    /// `F`: the sum of the merge factors at the vertex, as the heuristic takes it.
    pub merges: D,
    /// `B`: all techniques that split the path before the vertex.
    pub before: D,
}

impl<D: Densities> End<D> {
    pub(super) fn sum(self, plan: &MisPlan, density: f64) -> D {
        // The density may be zero (the other walk cannot get here) while B is anything.
        if density > 0.0 { (self.merges + self.before) * plan.pow(density) } else { D::ZERO }
    }
}

/// The merges at a vertex, from the distance factors of `walk` and of the opposite one.
#[inline]
fn merges<D: Densities>(plan: &MisPlan, walk: Walk, kind: MergeKind, own: f64, opposite: f64) -> D {
    match walk {
        Walk::Light => plan.merge_sum(kind, own, opposite),
        Walk::Camera => plan.merge_sum(kind, opposite, own),
    }
}

/// A vertex that has scattered: what it passes on to the next vertex, whose distance is not known yet.
///
/// Kept as it is with photon and query beams, whose vertices appear anywhere along them (section 4.5).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeMis<D = f64> {
    /// `B_i`, as the heuristic takes it.
    pub before: D,
    /// Own scattering density towards the next vertex: sr⁻¹, a probability for a Dirac lobe, per area for
    /// infinite lights.
    pub rho: f64,
    /// The cosine factor of the outgoing direction; 1 in media and at points.
    pub cos_out: f64,
    /// The merges that the vertex takes part in.
    pub kind: MergeKind,
    /// The distance factor of the edge that arrived at it.
    pub distance_factor: f64,
    /// Whether the vertex can be connected to the next one.
    pub connectible: bool,
    /// The way in which walks of the other side come to it.
    pub start: EdgeStart,
}

/// The way in which walks of the other side come to the first vertex of an edge: their density of distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EdgeStart {
    /// By passing the whole edge, to a surface or an end of the path.
    Surface,
    /// By stopping at a sampled distance, in a medium.
    Medium,
    /// By seeing it on their way through an emitting volume, wherever they stop. That density does not depend
    /// on the edge and is part of the vertex's `B` (section 2.9).
    Volume,
}

impl EdgeStart {
    /// The density of distance of a walk of the other side that comes to the start of an edge.
    #[inline]
    #[must_use]
    pub const fn backward(self, density: &EdgeDensity) -> f64 {
        match self {
            Self::Surface => density.backward(false),
            Self::Medium => density.backward(true),
            Self::Volume => 1.0,
        }
    }
}

impl<D: Densities> EdgeMis<D> {
    /// The light end of a light sub-path (section 4.2). `hit` is 0 if the emitter cannot be hit,
    /// [`pdf_passage`](crate::scene::Emitter::pdf_passage) in a volume, else 1; `pdf_position` and
    /// `pdf_direction` are `L_0` and `ρL_0`.
    #[must_use]
    pub fn at_light(
        plan: &MisPlan,
        start: EdgeStart,
        hit: f64,
        cos_out: f64,
        pdf_position: f64,
        pdf_direction: f64,
    ) -> Self {
        let hit = hit * plan.hit;
        Self {
            before: D::of(Technique::Hit, plan.pow(hit / pdf_position)),
            rho: pdf_direction,
            cos_out,
            kind: MergeKind::None,
            distance_factor: 0.0,
            connectible: true,
            start,
        }
    }

    /// The camera end of a camera sub-path; `pdf` is the density of the camera ray, sr⁻¹ per pixel.
    #[must_use]
    pub fn at_camera(pdf: f64) -> Self {
        Self {
            before: D::ZERO,
            rho: pdf,
            cos_out: 1.0,
            kind: MergeKind::None,
            distance_factor: 0.0,
            connectible: true,
            start: EdgeStart::Surface,
        }
    }

    /// Whether no technique but the walk itself makes a path that goes on from here.
    #[inline]
    #[must_use]
    pub fn is_alone(&self) -> bool {
        !self.connectible && self.kind == MergeKind::None && self.before.total() == 0.0
    }

    /// One step (section 4.3): the arrival at the next vertex. `connections` is the number of samples that
    /// connect the two vertices, as the heuristic takes it: of connections in general, of next events (times
    /// `p_nee/L_0`) on a light sub-path's first edge or at a camera sub-path's vertex on a light, of light
    /// tracing on a camera sub-path's first edge; 0 if the new vertex cannot be connected.
    #[inline]
    #[must_use]
    pub fn arrive(&self, plan: &MisPlan, walk: Walk, edge: &Edge, connections: D) -> VertexMis<D> {
        let inverse = 1.0 / (self.rho * edge.cos_in * edge.forward);
        let below = if edge.backward > 0.0 {
            let stops = self.start == EdgeStart::Medium;
            let opposite = plan.distance_factor(walk.other(), stops, edge.pass_probability, edge.backward);
            let merges: D = merges(plan, walk, self.kind, self.distance_factor, opposite);
            (merges + self.before) * plan.pow(inverse * self.cos_out * edge.backward)
        } else {
            D::ZERO
        };
        let connect = if self.connectible && connections.total() > 0.0 {
            connections * plan.pow(inverse * edge.distance_squared)
        } else {
            D::ZERO
        };
        let distance_factor =
            plan.distance_factor(walk, edge.ends_in_medium, edge.pass_probability, edge.forward);
        VertexMis { connect, below, distance_factor }
    }
}

/// An edge between two vertices, walked from the first to the second (section 1.3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Squared distance in scene units; 1 from or to an infinite emitter, whose densities are per solid
    /// angle.
    pub distance_squared: f64,
    /// The cosine factor at the second vertex; 1 in media and towards infinity.
    pub cos_in: f64,
    /// Distance density `t` of the walk that stops at the second vertex.
    pub forward: f64,
    /// Distance density `t′` of the other walk, which stops at the first.
    pub backward: f64,
    /// Probability `R` that a walk passes the whole edge; the same in both directions.
    pub pass_probability: f64,
    /// Whether the second vertex lies in a medium.
    pub ends_in_medium: bool,
}

impl Edge {
    /// An edge from what its segments accumulated.
    #[inline]
    #[must_use]
    pub fn new(
        density: &EdgeDensity,
        distance: f64,
        cos_in: f64,
        start: EdgeStart,
        ends_in_medium: bool,
    ) -> Self {
        Self {
            distance_squared: if distance.is_finite() { distance * distance } else { 1.0 },
            cos_in,
            forward: density.forward(ends_in_medium),
            backward: start.backward(density),
            pass_probability: density.pass_probability,
            ends_in_medium,
        }
    }
}

/// Throughput of a beam at a point of it: `T/R` inside a short beam, `T` on a long one.
impl BeamExtent {
    /// The divisor of the transmittance: the probability that the beam gets there at all.
    #[inline]
    #[must_use]
    pub const fn normalisation(self, pass_probability: f64) -> f64 {
        match self {
            Self::Short => pass_probability,
            Self::Long => 1.0,
        }
    }
}
