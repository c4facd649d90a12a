//! The constants of one iteration that enter weights.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};
use upbp_media::MediumId;

use super::PARALLEL_SIN2;
use super::densities::Densities;
use super::recursion::MergeSite;
use crate::scene::Walk;
use crate::technique::Technique;

/// How the densities of techniques are turned into weights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Heuristic {
    /// In proportion to the densities.
    #[default]
    Balance,
    /// In proportion to their squares.
    Power,
}

/// How far beams reach (`docs/theory.md`, section 2.6).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum BeamExtent {
    /// To the distance that the walk sampled.
    Short,
    /// To the next surface.
    Long,
}

/// Samples times kernel volume of the merges in one medium; zero for what is off there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VolumeMerges {
    /// `n V_3`, photon points around points.
    pub pp3d: f64,
    /// `n V_2`, photon points around query beams.
    pub pb2d: f64,
    /// `n V_2`, photon beams around points.
    pub bp2d: f64,
    /// `n V_1`, photon beams around query beams.
    pub bb1d: f64,
}

/// Fourth powers of the radii of merges, by which they are damped next to other vertices; scene units.
///
/// A kernel as wide as an edge is long averages over all that changes along it: contact shadows, `1/d²` beside lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Damping {
    /// Surface merging.
    pub surf: f64,
    /// PP3D.
    pub pp3d: f64,
    /// PB2D.
    pub pb2d: f64,
    /// BP2D.
    pub bp2d: f64,
    /// BB1D.
    pub bb1d: f64,
}

/// The last edge of one of two sub-paths that meet in a vertex, as far as merges there depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Leg {
    /// The distance factor in a medium; 0 on surfaces.
    pub c: f64,
    /// One over the squared length; 0 from infinity.
    pub nearness: f64,
}

/// Sample counts and kernel volumes of one iteration.
///
/// Counts are relative to one camera sub-path. A technique that does not run has count zero. The same predicate that
/// zeroes a count must decide whether the technique runs, else weights do not sum to one.
#[derive(Clone, Debug, PartialEq)]
pub struct MisPlan {
    /// Balance or power heuristic.
    pub heuristic: Heuristic,
    /// Emission hits: 0 or 1.
    pub hit: f64,
    /// Light samples per camera vertex.
    pub nee: f64,
    /// Expected number of times that a pair of vertices is connected.
    pub connect: f64,
    /// Light sub-paths that are connected to the camera.
    pub light_tracing: f64,
    /// `n V_2` of surface merging.
    pub surf: f64,
    /// Merges in each medium, by [`MediumId`].
    pub volume: Vec<VolumeMerges>,
    /// Extent of photon beams.
    pub photon_beams: BeamExtent,
    /// Extent of query beams.
    pub query_beams: BeamExtent,
    /// How merges are damped where their kernels are wide beside the edges that meet there (`docs/theory.md`, section 6(c)).
    pub damping: Option<Damping>,
    /// The radius within which camera sub-paths find the same photons, scene units: merges behind vertices that are spread more widely
    /// count less (section 6(b)). Needs densities that [know merges apart](Densities::KNOWS_MERGES).
    pub correlation: Option<f64>,
}

impl MisPlan {
    /// A quantity that is proportional to a density, as the heuristic takes it.
    #[inline]
    #[must_use]
    pub fn pow(&self, q: f64) -> f64 {
        match self.heuristic {
            Heuristic::Balance => q,
            Heuristic::Power => q * q,
        }
    }

    /// The merges in a medium; none in one that the plan does not know.
    #[inline]
    #[must_use]
    pub fn merges_in(&self, medium: MediumId) -> VolumeMerges {
        self.volume.get(medium.0 as usize).copied().unwrap_or_default()
    }

    /// The count of connections, as the heuristic takes it.
    #[inline]
    #[must_use]
    pub fn connections<D: Densities>(&self) -> D {
        D::of(Technique::Connect, self.pow(self.connect))
    }

    /// Extent of the beams of a walk: photon beams on the light's side, query beams on the camera's.
    #[inline]
    #[must_use]
    pub const fn extent(&self, walk: Walk) -> BeamExtent {
        match walk {
            Walk::Light => self.photon_beams,
            Walk::Camera => self.query_beams,
        }
    }

    /// The leg by which a walk arrives at a vertex, over an edge that it passes with probability `reach` and stops at the end of
    /// with density `t`. The distance factor is `R/t` for short beams, `1/t` for long ones (section 1.3).
    #[inline]
    #[must_use]
    pub fn leg(&self, walk: Walk, in_medium: bool, nearness: f64, reach: f64, t: f64) -> Leg {
        let c = match self.extent(walk) {
            _ if !in_medium => 0.0,
            BeamExtent::Short => reach / t,
            BeamExtent::Long => 1.0 / t,
        };
        Leg { c, nearness }
    }

    /// How much of a merge counts between two such legs, given the fourth power of its radius (section 6(c)).
    #[inline]
    fn damped(&self, legs: [Leg; 2], fourth_power: fn(&Damping) -> f64) -> f64 {
        match &self.damping {
            Some(damping) => {
                // Its square is a number, so that a radius of zero takes nothing away.
                let nearness = legs[0].nearness.max(legs[1].nearness).min(1e150);
                1.0 / (1.0 + fourth_power(damping) * (nearness * nearness))
            }
            None => 1.0,
        }
    }

    /// `f` of surface merging, as the heuristic takes it (section 2.1).
    #[inline]
    #[must_use]
    pub fn surface_factor(&self, light: Leg, camera: Leg) -> f64 {
        self.pow(self.surf * self.damped([light, camera], |damping| damping.surf))
    }

    /// `f_v` of the four merges in a medium, as the heuristic takes them (section 2.1).
    #[inline]
    #[must_use]
    pub fn volume_factors(&self, medium: MediumId, light: Leg, camera: Leg, sin_theta: f64) -> VolumeMerges {
        let v = self.merges_in(medium);
        let sin_theta = if sin_theta * sin_theta < PARALLEL_SIN2 { 0.0 } else { sin_theta };
        let damped = |fourth_power| self.damped([light, camera], fourth_power);
        VolumeMerges {
            pp3d: self.pow(v.pp3d * damped(|damping| damping.pp3d)),
            pb2d: self.pow(v.pb2d * camera.c * damped(|damping| damping.pb2d)),
            bp2d: self.pow(v.bp2d * light.c * damped(|damping| damping.bp2d)),
            bb1d: self.pow(v.bb1d * light.c * camera.c * sin_theta * damped(|damping| damping.bb1d)),
        }
    }

    /// `F_i`: the sum of the merge factors at a vertex between two legs (section 4.1).
    #[inline]
    #[must_use]
    pub fn merge_sum<D: Densities>(&self, site: MergeSite, light: Leg, camera: Leg) -> D {
        match site {
            MergeSite::None => D::ZERO,
            MergeSite::Surface => D::of(Technique::Surf, self.surface_factor(light, camera)),
            MergeSite::Medium { medium, sin_theta } => {
                self.volume_factors(medium, light, camera, sin_theta).sum()
            }
        }
    }

    /// What merges count behind one more vertex of a camera sub-path (section 6(b)): `reuse` is what they count behind those before, `density`
    /// that with which the last of them scatters, per area across the new edge at its other end.
    #[inline]
    #[must_use]
    pub fn reuse(&self, reuse: f64, density: f64) -> f64 {
        match self.correlation {
            Some(radius) => reuse * (density * (PI * radius * radius)).min(1.0),
            None => reuse,
        }
    }

    /// The same factor of one vertex per unknown density of the one before, `per_density` being the area's solid angle over the area; infinite if there
    /// is none.
    #[inline]
    pub(super) fn spread(&self, per_density: f64) -> f64 {
        self.correlation.map_or(f64::INFINITY, |radius| per_density * (PI * radius * radius))
    }
}

impl VolumeMerges {
    /// The sum of all four.
    #[inline]
    #[must_use]
    pub fn sum<D: Densities>(&self) -> D {
        D::of(Technique::Pp3d, self.pp3d)
            + D::of(Technique::Pb2d, self.pb2d)
            + D::of(Technique::Bp2d, self.bp2d)
            + D::of(Technique::Bb1d, self.bb1d)
    }
}
