//! The constants of one iteration that enter weights.

use serde::{Deserialize, Serialize};
use upbp_media::{Lanes, MediumId};

use super::density_sum::Densities;
use crate::scene::Walk;
use crate::technique::Technique;

/// Below this `sin²θ` two beams count as parallel: BB1D neither contributes nor counts in weights.
pub const PARALLEL_SIN2: f64 = upbp_accel::PARALLEL_SIN2 as f64;

/// Heuristic that turns the densities of techniques into weights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Heuristic {
    /// In proportion to the densities.
    #[default]
    Balance,
    /// In proportion to their squares.
    Power,
}

/// Length of beams (`docs/theory.md`, section 2.6).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum BeamExtent {
    /// To the distance that the walk sampled.
    Short,
    /// To the next surface.
    Long,
}

/// One value for each technique that merges in media.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VolumeMerges<T = f64> {
    /// Photon points around points.
    pub pp3d: T,
    /// Photon points around query beams.
    pub pb2d: T,
    /// Photon beams around points.
    pub bp2d: T,
    /// Photon beams around query beams.
    pub bb1d: T,
}

/// The merges of a technique in one medium, where the scale of radii is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeMerge {
    /// Samples times the volume of the kernel, with the factor of section 6.5: `n V_d / (1 + width)`, d its
    /// dimension; 0 if the technique is off there.
    pub count: f64,
    /// `(r/ℓ)⁴` (section 6.5): its radius in mean free paths.
    pub width: f64,
    /// The greatest scale of its radius, which holds where that of a vertex is greater.
    pub greatest_scale: f32,
}

impl VolumeMerge {
    /// No merges.
    pub const NONE: Self = Self { count: 0.0, width: 0.0, greatest_scale: f32::INFINITY };

    /// Whether the technique merges.
    #[inline]
    #[must_use]
    pub fn is_on(&self) -> bool {
        self.count > 0.0
    }

    /// The count where radii have some scale (section 5.4).
    #[inline]
    fn at(&self, scale: f64, dimension: i32) -> f64 {
        let scale = scale.min(f64::from(self.greatest_scale));
        if self.count == 0.0 || scale == 1.0 {
            return self.count;
        }
        self.count * scale.powi(dimension) * ((1.0 + self.width) / (1.0 + self.width * scale.powi(4)))
    }
}

/// The density of a walk's distance at a vertex, as one of its techniques sees it (section 1.3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistanceDensity {
    /// `t`, of a walk that stops there: per length in a medium, the probability to pass on a surface.
    pub point: f64,
    /// `c·t`, of a beam that runs through: the probability `R` to get there if it is short, 1 if it is long;
    /// 0 on surfaces.
    pub beam: f64,
}

impl DistanceDensity {
    /// Relative to a walk that stops there: by the distance factor `c` of its last edge.
    #[inline]
    #[must_use]
    pub const fn at_stop(distance_factor: f64) -> Self {
        Self { point: 1.0, beam: distance_factor }
    }

    /// The distance factor `c`; 0 on surfaces.
    #[inline]
    #[must_use]
    pub const fn factor(self) -> f64 {
        self.beam / self.point
    }
}

/// A walk at a vertex that another walk has made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OtherWalk<L: Lanes = f64> {
    /// Density of its distance.
    pub density: DistanceDensity,
    /// Shares of its lanes if it stops there.
    pub shares: L::Shares,
}

/// The kind of merges that are possible at a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MergeKind {
    /// None: an end of the path, or a Dirac lobe.
    None,
    /// Surface merging.
    Surface {
        /// Kernel radii at the vertex, relative to those of the plan.
        scale: f64,
    },
    /// The merges of a medium.
    Medium {
        /// The medium.
        medium: MediumId,
        /// Sine of the angle between the incoming and the outgoing line.
        sin_theta: f64,
        /// Kernel radii at the vertex, relative to those of the plan.
        scale: f64,
    },
}

/// Sample counts and kernel volumes of one iteration.
///
/// Counts are relative to one camera sub-path, and those of emission hits, next events and connections
/// contain the camera factor of the iteration. A technique that does not run has count zero. The same
/// predicate that zeroes a count must decide whether the technique runs, else weights do not sum to one.
#[derive(Clone, Debug, PartialEq)]
pub struct MisPlan {
    /// Balance or power heuristic.
    pub heuristic: Heuristic,
    /// Emission hits: 1 times the camera factor, or 0.
    pub hit: f64,
    /// Light samples per camera vertex, times the camera factor.
    pub nee: f64,
    /// Expected number of times that a pair of vertices is connected, times the camera factor.
    pub connect: f64,
    /// Light sub-paths that are connected to the camera.
    pub light_tracing: f64,
    /// `n V_2` of surface merging, where the scale of radii is one.
    pub surf: f64,
    /// Merges in each medium, by [`MediumId`]; none in media that are left out.
    pub volume: Vec<VolumeMerges<VolumeMerge>>,
    /// Extent of photon beams.
    pub photon_beams: BeamExtent,
    /// Extent of query beams.
    pub query_beams: BeamExtent,
    /// The probability of each lane to be the hero of a sub-path, of either side; walks with one lane do not
    /// ask. With more lanes there is only the balance heuristic: squares of densities have no recursion with
    /// a value per lane.
    pub lanes: [f64; 3],
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
    pub fn merges_in(&self, medium: MediumId) -> &VolumeMerges<VolumeMerge> {
        const NONE: VolumeMerges<VolumeMerge> = {
            let none = VolumeMerge::NONE;
            VolumeMerges { pp3d: none, pb2d: none, bp2d: none, bb1d: none }
        };
        self.volume.get(medium.0 as usize).unwrap_or(&NONE)
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

    /// The density of the distance of `walk` at a vertex, by an edge that it passes with probability
    /// `pass_probability` and at whose end it stops with density `t` (section 1.3).
    #[inline]
    #[must_use]
    pub(crate) fn distance_density(
        &self,
        walk: Walk,
        in_medium: bool,
        pass_probability: f64,
        t: f64,
    ) -> DistanceDensity {
        let beam = match self.extent(walk) {
            _ if !in_medium => 0.0,
            BeamExtent::Short => pass_probability,
            BeamExtent::Long => 1.0,
        };
        DistanceDensity { point: t, beam }
    }

    /// The walk that would arrive at a vertex, from a start where its lanes have `shares`, by an edge that it
    /// passes with probability `pass_probability` and at whose end it stops with density `t`.
    #[inline]
    #[must_use]
    pub fn other_walk<L: Lanes>(
        &self,
        walk: Walk,
        in_medium: bool,
        pass_probability: L,
        t: L,
        shares: &L::Shares,
    ) -> OtherWalk<L> {
        let mean = t.mean(shares);
        OtherWalk {
            density: self.distance_density(walk, in_medium, pass_probability.mean(shares), mean),
            shares: t.given(shares, mean),
        }
    }

    /// `f` of surface merging, as the heuristic takes it (section 2.1), at a vertex with some scale of radii.
    #[inline]
    #[must_use]
    pub fn surface_factor(&self, scale: f64) -> f64 {
        self.pow(self.surf * scale * scale)
    }

    /// `f_v` of the four merges in a medium, as the heuristic takes them (section 2.1), times the densities
    /// of the two sub-paths' distances, at a vertex with some scale of radii.
    #[inline]
    #[must_use]
    pub fn volume_factors(
        &self,
        medium: MediumId,
        light: DistanceDensity,
        camera: DistanceDensity,
        sin_theta: f64,
        scale: f64,
    ) -> VolumeMerges {
        let v = self.merges_in(medium);
        let sin_theta = if sin_theta * sin_theta < PARALLEL_SIN2 { 0.0 } else { sin_theta };
        VolumeMerges {
            pp3d: self.pow(v.pp3d.at(scale, 3) * light.point * camera.point),
            pb2d: self.pow(v.pb2d.at(scale, 2) * light.point * camera.beam),
            bp2d: self.pow(v.bp2d.at(scale, 2) * light.beam * camera.point),
            bb1d: self.pow(v.bb1d.at(scale, 1) * light.beam * camera.beam * sin_theta),
        }
    }

    /// `F_i`: the sum of the merge factors at a vertex (section 4.1), times the densities of the two
    /// sub-paths' distances.
    #[inline]
    #[must_use]
    pub(crate) fn merge_sum<D: Densities>(
        &self,
        kind: MergeKind,
        light: DistanceDensity,
        camera: DistanceDensity,
    ) -> D {
        match kind {
            MergeKind::None => D::ZERO,
            MergeKind::Surface { scale } => {
                D::of(Technique::Surf, self.surface_factor(scale) * self.pow(light.point * camera.point))
            }
            MergeKind::Medium { medium, sin_theta, scale } => {
                self.volume_factors(medium, light, camera, sin_theta, scale).sum()
            }
        }
    }
}

impl<T> VolumeMerges<T> {
    /// The values of a function of the technique.
    #[must_use]
    pub fn from_fn(mut value: impl FnMut(Technique) -> T) -> Self {
        Self {
            pp3d: value(Technique::Pp3d),
            pb2d: value(Technique::Pb2d),
            bp2d: value(Technique::Bp2d),
            bb1d: value(Technique::Bb1d),
        }
    }

    /// Applies a function to each value.
    #[must_use]
    pub fn map<U>(self, mut function: impl FnMut(T) -> U) -> VolumeMerges<U> {
        VolumeMerges {
            pp3d: function(self.pp3d),
            pb2d: function(self.pb2d),
            bp2d: function(self.bp2d),
            bb1d: function(self.bb1d),
        }
    }

    /// The value of a technique; `None` if it merges nothing in media.
    #[inline]
    #[must_use]
    pub const fn get(&self, technique: Technique) -> Option<&T> {
        match technique {
            Technique::Pp3d => Some(&self.pp3d),
            Technique::Pb2d => Some(&self.pb2d),
            Technique::Bp2d => Some(&self.bp2d),
            Technique::Bb1d => Some(&self.bb1d),
            _ => None,
        }
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
