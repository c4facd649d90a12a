//! How much memory an iteration needs, and how many light sub-paths fit into a budget.
//!
//! Everything large has a size that follows from counts: the film and the buffer of an iteration from pixels; vertices, beams,
//! their look-up structures, and what building those takes for a moment, from light sub-paths. The pilot tells how many of
//! each a sub-path leaves. What does not grow is not counted: the program, the scene, the threads.

use upbp_estimators::walk::{LightVertex, PhotonBeam};

use crate::pilot::Pilot;

/// What light sub-paths leave in memory, by number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LightCounts {
    /// Light vertices.
    pub(crate) vertices: f64,
    /// Of them those in the tree of surface photons.
    pub(crate) surface: f64,
    /// And in the tree of photons in media.
    pub(crate) medium: f64,
    /// Photon beams.
    pub(crate) beams: f64,
    /// The pieces that they are cut into.
    pub(crate) pieces: f64,
}

impl LightCounts {
    /// The numbers that so many light sub-paths leave, of which so many leave beams.
    pub(crate) fn expected(pilot: &Pilot, light_paths: u32, beam_paths: u32) -> Self {
        let (paths, beam_paths) = (f64::from(light_paths), f64::from(beam_paths));
        Self {
            vertices: paths * pilot.vertices_per_path,
            surface: paths * pilot.surface_per_path,
            medium: paths * pilot.medium_per_path,
            beams: beam_paths * pilot.beams_per_path,
            pieces: beam_paths * pilot.pieces_per_path,
        }
    }

    /// The most bytes that they take at one time, from the first vertex to the end of the iteration.
    pub(crate) fn peak_bytes<B>(&self) -> f64 {
        /// The boxes of a tree, per item.
        const NODES: f64 = 192.0 / 64.0 * 8.0 / 7.0;
        /// Centre and index of an item that is sorted, and its place in the result.
        const SORT: f64 = 16.0 + 4.0;
        /// A position with its payload, before it is in a tree; and in its place there.
        const POINT: f64 = 16.0;
        /// A segment with its payload; a piece of one, before and in the tree.
        const SEGMENT: f64 = 36.0;
        const PIECE: f64 = 12.0;
        const PLACED: f64 = 36.0;
        /// The light pass has a wave of pieces in two places, and what their buffers leave is not given back before the build.
        const WAVE: f64 = 1.0 / 32.0;
        let kept =
            self.vertices * size_of::<LightVertex<B>>() as f64 + self.beams * size_of::<PhotonBeam>() as f64;
        let held = (1.0 + WAVE) * kept;
        let point_tree = NODES + POINT;
        let built = self.surface * point_tree;
        let surface = self.surface * (POINT + SORT + NODES);
        let medium = built + self.medium * (POINT + SORT + NODES);
        let built = built + self.medium * point_tree;
        let segments = self.beams * SEGMENT;
        let sorting = segments + self.pieces * (PIECE + SORT + NODES);
        let placing = segments + self.pieces * (PIECE + 4.0 + NODES + PLACED);
        held + surface.max(medium).max(built + sorting.max(placing))
    }
}
