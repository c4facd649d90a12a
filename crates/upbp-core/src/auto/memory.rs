//! How much memory an iteration needs, and how many light sub-paths fit into a budget.
//!
//! Everything large has a size that follows from counts: the film and the buffer of an iteration from pixels; vertices, beams,
//! their look-up structures, and what building those takes for a moment, from light sub-paths. The pilot tells how many of
//! each a sub-path leaves. What does not grow is not counted: the program, the scene, the threads.

use upbp_estimators::path::{LightVertex, PhotonBeam};

use crate::auto::statistics::Pilot;

/// What light sub-paths and their look-ups may take where that must not depend on the machine.
pub(crate) const LIGHT_BYTES: u64 = 2 << 30;

/// Bytes that a render may take: so many MiB, or half of what the machine has free.
pub(crate) fn budget(mebibytes: Option<u32>) -> u64 {
    mebibytes.map_or_else(|| free_bytes().map_or(LIGHT_BYTES, |free| free / 2), |mib| u64::from(mib) << 20)
}

/// Bytes that a process can still have, by what Linux says of the machine and of the group of processes that it is in; `None` where it
/// says nothing.
fn free_bytes() -> Option<u64> {
    let number = |path: &str| std::fs::read_to_string(path).ok()?.trim().parse::<u64>().ok();
    let machine = std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| available(&text));
    let group = ["/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"].map(number);
    let group = group[0].zip(group[1]).map(|(most, taken)| most.saturating_sub(taken));
    machine.into_iter().chain(group).min()
}

/// The line `MemAvailable` of `/proc/meminfo`, in bytes.
fn available(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    line.trim().strip_suffix(" kB")?.parse::<u64>().ok()?.checked_mul(1024)
}

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
        /// The boxes of a tree, per item: those of leaves, rounded for points, and the nodes above them.
        const NODES: f64 = 256.0 / 512.0 * 8.0 / 7.0;
        const POINT_BOXES: f64 = 1.0 + NODES;
        const PIECE_BOXES: f64 = 3.0 + NODES;
        /// A position with its payload: sorted into buckets, and before that given to be sorted, after that in its place in the
        /// tree.
        const POINT: f64 = 16.0;
        /// A segment with its payload.
        const SEGMENT: f64 = 36.0;
        /// A piece of one; its centre and index, sorted into buckets; its place in the tree.
        const PIECE: f64 = 12.0;
        const CENTRE: f64 = 16.0;
        const PLACED: f64 = 40.0;
        let [vertex, beam] = [size_of::<LightVertex<B>>(), size_of::<PhotonBeam>()];
        let held = self.vertices * vertex as f64 + self.beams * beam as f64;
        // Buckets are kept until the tree is there.
        let (building, tree) = (2.0 * POINT + POINT_BOXES, POINT + POINT_BOXES);
        let surface = self.surface * building;
        let medium = self.surface * tree + self.medium * building;
        let points = (self.surface + self.medium) * tree;
        let beams = points + self.beams * SEGMENT + self.pieces * (PIECE + CENTRE + PLACED + PIECE_BOXES);
        held + surface.max(medium).max(beams)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_what_is_free_or_what_is_allowed() {
        let text = "MemTotal:       24576000 kB\nMemFree:          512000 kB\nMemAvailable:   16384000 kB\n";
        assert_eq!(available(text), Some(16_384_000 * 1024));
        assert_eq!(available("MemAvailable: lots"), None);
        assert_eq!(budget(Some(3)), 3 << 20);
        assert!(budget(None) > 1 << 20);
    }
}
