//! Light vertices and photon beams of an iteration, in trees for the queries of camera sub-paths.

use std::hint::black_box;

use upbp_accel::{PointTree, SegmentTree, SplitParams};
use upbp_media::Lanes;

use crate::iteration::IterationPlan;
use crate::mis::Densities;
use crate::path::{LightVertex, PhotonBeam};
use crate::technique::Technique;

/// Light vertices and photon beams of an iteration, with the trees that camera sub-paths query.
#[derive(Debug)]
pub struct LightMap<B, D: Densities = f64, L: Lanes = f64> {
    /// All vertices that can be connected or merged.
    pub vertices: Vec<LightVertex<B, D, L>>,
    /// All photon beams.
    pub beams: Vec<PhotonBeam<D, L>>,
    /// Surface photons; the payload is an index into `vertices`.
    pub(crate) surface: PointTree,
    /// Photons in media.
    pub(crate) medium: PointTree,
    /// Photon beams; the payload is an index into `beams`.
    pub(crate) beam_tree: SegmentTree,
}

impl<B: Copy + Send + Sync, D: Densities, L: Lanes> LightMap<B, D, L> {
    /// Builds the structures that the plan queries, and no others.
    #[must_use]
    pub fn build(
        plan: &IterationPlan,
        vertices: Vec<LightVertex<B, D, L>>,
        beams: Vec<PhotonBeam<D, L>>,
    ) -> Self {
        let photons = |on: bool, in_medium: bool| {
            let is_chosen = |v: &LightVertex<B, D, L>| on && v.interaction.in_medium() == in_medium;
            let chosen = vertices.iter().enumerate().filter(|(_, v)| is_chosen(v));
            PointTree::build(chosen.map(|(i, v)| (v.position, i as u32)).collect())
        };
        let surface = photons(plan.merges_by(Technique::Surf), false);
        let medium = photons(plan.stores_medium_photons(), true);
        let segments: Vec<_> = beams.iter().enumerate().map(|(i, b)| (b.segment, i as u32)).collect();
        // A technique that does not run has a radius of zero.
        let radius = plan.kernels.bb1d.radius().max(plan.kernels.bp2d.radius());
        let radius = plan.radius_field.search_radius(radius, f32::INFINITY);
        let split = SplitParams::choose(&segments, radius);
        let beam_tree = SegmentTree::build(segments, split);
        Self { vertices, beams, surface, medium, beam_tree }
    }

    /// A map without anything.
    #[must_use]
    pub fn empty() -> Self {
        Self {
            vertices: Vec::new(),
            beams: Vec::new(),
            surface: PointTree::build(Vec::new()),
            medium: PointTree::build(Vec::new()),
            beam_tree: SegmentTree::build(Vec::new(), SplitParams::default()),
        }
    }

    /// Reads a vertex that is about to be merged, so that it is in the cache by then: fields that the
    /// compiler lays out in different lines.
    #[inline]
    pub(crate) fn read_ahead(&self, index: u32) {
        let vertex = &self.vertices[index as usize];
        black_box((vertex.interaction.in_medium(), vertex.mis.distance_factor, vertex.path));
    }

    /// Numbers of photon points on surfaces and in media, each 0 where the plan does not query them.
    #[must_use]
    pub fn photon_points(&self) -> [usize; 2] {
        [self.surface.len(), self.medium.len()]
    }

    /// Bytes that the map occupies.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        self.vertices.capacity() * size_of::<LightVertex<B, D, L>>()
            + self.beams.capacity() * size_of::<PhotonBeam<D, L>>()
            + self.surface.memory_bytes()
            + self.medium.memory_bytes()
            + self.beam_tree.memory_bytes()
    }
}
