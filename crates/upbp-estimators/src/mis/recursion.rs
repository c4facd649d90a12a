//! Two numbers per vertex instead of a walk over the path (`docs/theory.md`, sections 4.1 to 4.6).
//!
//! For a sub-path that ends at `u_i`, let `B_i` be the sum of the densities of all techniques that split the
//! path before `u_i`, relative to the density of "the sub-path ends at `u_i`". It is linear in the one
//! unknown, the density ρ′ with which the other side's walk would scatter at `u_i`: `B_i = D_i + ρ′ E_i`. A
//! vertex carries `D` and `E`. The same recursion serves both walks. Oracle: [`super::oracle`].
//!
//! With [lanes](Lanes), densities of a sub-path's own side are means over the lanes with its shares. What the
//! other side would have done has to be kept for each of its lanes, `E` and `B`, until its shares are known
//! (section 6.13).

use upbp_media::{EdgeDensity, Lanes};

use super::counts::{BeamExtent, DistanceDensity, MergeKind, MisPlan, OtherWalk};
use super::density_sum::Densities;
use crate::scene::Walk;
use crate::technique::Technique;

/// Densities of all techniques that split a sub-path before a vertex, on arrival there (section 4.1).
#[derive(Clone, Copy, Debug)]
pub struct VertexMis<D: Densities = f64, L: Lanes = f64> {
    /// `D_i`: connecting to this vertex from the one before.
    pub connect: D,
    /// `E_i`: everything below the vertex before, per opposite scattering density; for each lane of the other
    /// walk.
    pub below: L::Each<D>,
    /// The distance factor of the arriving edge; 0 on surfaces.
    pub distance_factor: f64,
    /// Shares of the sub-path's own lanes, on arrival.
    pub shares: L::Shares,
}

impl<D: Densities, L: Lanes> VertexMis<D, L> {
    /// `B_i = D_i + ρ′ E_i` for the opposite scattering density `ρ′` in each lane, roulette included, sr⁻¹,
    /// and the shares with which the other walk stops at the vertex.
    #[inline]
    #[must_use]
    pub fn before(&self, plan: &MisPlan, rho_opposite: L, opposite: &L::Shares) -> D {
        let (rho_opposite, shares) = rho_opposite.step(opposite);
        with_below(plan, self.connect, rho_opposite, || L::blend(D::ZERO, &self.below, &shares))
    }

    /// `B_i` for each lane of the other walk.
    #[inline]
    #[must_use]
    pub fn before_each(&self, plan: &MisPlan, rho_opposite: L) -> L::Each<D> {
        L::each(|lane| with_below(plan, self.connect, rho_opposite.get(lane), || L::pick(&self.below, lane)))
    }

    /// `F_i + B_i` times the density with which the `other` walk would make the vertex, for a connection to
    /// it: `kind` is the vertex with the direction of the connection, `density` the other walk's, but for its
    /// distance, and `rho_opposite` the density with which each of its lanes would then scatter along this
    /// sub-path.
    #[inline]
    #[must_use]
    pub fn end(
        &self,
        plan: &MisPlan,
        walk: Walk,
        kind: MergeKind,
        other: &OtherWalk<L>,
        rho_opposite: L,
        density: f64,
    ) -> D {
        let OtherWalk { density: distance, ref shares } = *other;
        // Either may be zero (the other walk cannot get here) while B is anything.
        if !(density > 0.0 && distance.point > 0.0) {
            return D::ZERO;
        }
        let merges: D = merges(plan, walk, kind, self.distance_factor, distance);
        let before = self.before(plan, rho_opposite, shares);
        (merges + before * plan.pow(distance.point)) * plan.pow(density)
    }
}

/// `D + ρ′ E`, with a branch instead of 0 · ∞ where the other walk cannot scatter this way.
#[inline]
fn with_below<D: Densities>(plan: &MisPlan, connect: D, rho_opposite: f64, below: impl FnOnce() -> D) -> D {
    if rho_opposite > 0.0 { connect + below() * plan.pow(rho_opposite) } else { connect }
}

/// The merges at a vertex, from the distance factor of `walk`, which stops there, and the density of the
/// opposite one.
#[inline]
fn merges<D: Densities>(
    plan: &MisPlan,
    walk: Walk,
    kind: MergeKind,
    distance_factor: f64,
    opposite: DistanceDensity,
) -> D {
    let own = DistanceDensity::at_stop(distance_factor);
    match walk {
        Walk::Light => plan.merge_sum(kind, own, opposite),
        Walk::Camera => plan.merge_sum(kind, opposite, own),
    }
}

/// A vertex that has scattered: what it passes on to the next vertex, whose distance is not known yet.
///
/// Kept as it is with photon and query beams, whose vertices appear anywhere along them (section 4.5).
#[derive(Clone, Copy, Debug)]
pub struct EdgeMis<D: Densities = f64, L: Lanes = f64> {
    /// `B_i`, as the heuristic takes it, for each lane of the other walk.
    pub before: L::Each<D>,
    /// Own scattering density towards the next vertex: sr⁻¹, a probability for a Dirac lobe, per area for
    /// infinite lights.
    pub rho: f64,
    /// The cosine factor of the outgoing direction; 1 in media and at points.
    pub cos_out: f64,
    /// The merges that the vertex takes part in.
    pub kind: MergeKind,
    /// The distance factor of the edge that arrived at it.
    pub distance_factor: f64,
    /// Shares of the sub-path's own lanes, after it has scattered.
    pub shares: L::Shares,
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
    pub const fn backward<L: Lanes>(self, density: &EdgeDensity<L>) -> L {
        match self {
            Self::Surface => density.backward(false),
            Self::Medium => density.backward(true),
            Self::Volume => L::ONE,
        }
    }
}

impl<D: Densities, L: Lanes> EdgeMis<D, L> {
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
        let hit = D::of(Technique::Hit, plan.pow(hit * plan.hit / pdf_position));
        Self { cos_out, start, ..Self::at_end(plan, hit, pdf_direction) }
    }

    /// The camera end of a camera sub-path; `pdf` is the density of the camera ray, sr⁻¹ per pixel.
    #[must_use]
    pub fn at_camera(plan: &MisPlan, pdf: f64) -> Self {
        Self::at_end(plan, D::ZERO, pdf)
    }

    fn at_end(plan: &MisPlan, before: D, rho: f64) -> Self {
        Self {
            before: L::each(|_| before),
            rho,
            cos_out: 1.0,
            kind: MergeKind::None,
            distance_factor: 0.0,
            shares: L::prior(&plan.lanes),
            connectible: true,
            start: EdgeStart::Surface,
        }
    }

    /// Whether no technique but the walk itself makes a path that goes on from here.
    #[inline]
    #[must_use]
    pub fn is_alone(&self) -> bool {
        let is_made_before = |lane| L::pick(&self.before, lane).total() != 0.0;
        !self.connectible && self.kind == MergeKind::None && !(0..L::COUNT).any(is_made_before)
    }

    /// One step (section 4.3): the arrival at the next vertex. `connections` is the number of samples that
    /// connect the two vertices, as the heuristic takes it: of connections in general, of next events (times
    /// `p_nee/L_0`) on a light sub-path's first edge or at a camera sub-path's vertex on a light, of light
    /// tracing on a camera sub-path's first edge; 0 if the new vertex cannot be connected.
    #[inline]
    #[must_use]
    pub fn arrive(&self, plan: &MisPlan, walk: Walk, edge: &Edge<L>, connections: D) -> VertexMis<D, L> {
        let own = plan.distance_density(
            walk,
            edge.ends_in_medium,
            edge.pass_probability.mean(&self.shares),
            edge.forward.mean(&self.shares),
        );
        let inverse = 1.0 / (self.rho * edge.cos_in * own.point);
        // Where no lane of the other walk can stop, its beams do not count either: they are in another
        // medium.
        let below = if edge.backward.is_positive() {
            let scale = plan.pow(inverse * self.cos_out);
            let in_medium = self.start == EdgeStart::Medium;
            L::each(|lane| {
                let (passes, stops) = (edge.pass_probability.get(lane), edge.backward.get(lane));
                let opposite = plan.distance_density(walk.other(), in_medium, passes, stops);
                let merges: D = merges(plan, walk, self.kind, self.distance_factor, opposite);
                let all =
                    if stops > 0.0 { merges + L::pick(&self.before, lane) * plan.pow(stops) } else { merges };
                all * scale
            })
        } else {
            L::each(|_| D::ZERO)
        };
        let connect = if self.connectible && connections.total() > 0.0 {
            connections * plan.pow(inverse * edge.distance_squared)
        } else {
            D::ZERO
        };
        let shares = edge.forward.given(&self.shares, own.point);
        VertexMis { connect, below, distance_factor: own.factor(), shares }
    }
}

/// An edge between two vertices, walked from the first to the second (section 1.3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge<L = f64> {
    /// Squared distance in scene units; 1 from or to an infinite emitter, whose densities are per solid
    /// angle.
    pub distance_squared: f64,
    /// The cosine factor at the second vertex; 1 in media and towards infinity.
    pub cos_in: f64,
    /// Distance density `t` of the walk that stops at the second vertex.
    pub forward: L,
    /// Distance density `t′` of the other walk, which stops at the first.
    pub backward: L,
    /// Probability `R` that a walk passes the whole edge; the same in both directions.
    pub pass_probability: L,
    /// Whether the second vertex lies in a medium.
    pub ends_in_medium: bool,
}

impl<L: Lanes> Edge<L> {
    /// An edge from what its segments accumulated.
    #[inline]
    #[must_use]
    pub fn new(
        density: &EdgeDensity<L>,
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

impl BeamExtent {
    /// The divisor of the transmittance `T` in the throughput of a beam at a point of it: the probability `R`
    /// that the beam gets there at all, if it is short.
    #[inline]
    #[must_use]
    pub(crate) const fn normalisation(self, pass_probability: f64) -> f64 {
        match self {
            Self::Short => pass_probability,
            Self::Long => 1.0,
        }
    }
}
