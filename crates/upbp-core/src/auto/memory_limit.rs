//! Memory that a render may take, and that its light sub-paths need.
//!
//! Everything large has a size that follows from counts: the film and the buffer of an iteration from pixels;
//! vertices, beams, their trees, and what building those takes for a moment, from light
//! sub-paths. Statistics tell the numbers per sub-path. Sizes that do not grow are not counted: the program,
//! the scene, the threads.

use std::fs;
use std::path::{Path, PathBuf};

use upbp_estimators::path::{LightVertex, PhotonBeam};
use upbp_estimators::scene::{Camera, Scene};
use upbp_estimators::{PreparedScene, TechniqueSet};

use super::statistics::Statistics;
use crate::error::{MemoryLimit, RenderError};
use crate::film::Film;
use crate::plan::Plan;
use crate::settings::Settings;

/// Bytes of light sub-paths and their trees, where the limit must not depend on the machine.
const LIGHT_BYTES: u64 = 2 << 30;

/// Bytes that a render may take, and needs for its film.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Room {
    film: u64,
    /// An estimate of the error.
    estimate: u64,
    /// The writing of an image, when light vertices have gone.
    output: u64,
    /// All that may be taken.
    total: u64,
    /// The same, for messages.
    limit: MemoryLimit,
    /// Light vertices, beams, and their trees.
    pub(crate) light_bytes: u64,
    /// Whether light vertices and beams carry densities of three lanes.
    in_lanes: bool,
}

impl Room {
    /// The room beside the film. A render by a plan that `is_given` may take all that is free if no setting
    /// says otherwise, so that it can go on where less is free than where it was begun.
    ///
    /// # Errors
    /// [`RenderError::Memory`] if there is none.
    pub(crate) fn of<S: Scene>(
        scene: &PreparedScene<'_, S>,
        settings: &Settings,
        techniques: TechniqueSet,
        in_lanes: bool,
        is_given: bool,
    ) -> Result<Self, RenderError> {
        let rect = scene.scene.camera().crop();
        let (total, limit) = budget(settings.memory, is_given, free_bytes());
        let film = Film::memory_bytes(rect, techniques, settings.features);
        let estimate = Film::estimate_bytes(rect);
        let output = Film::output_bytes(rect, techniques, settings.features);
        let needed = film.saturating_add(output.max(estimate));
        if needed > total {
            return Err(RenderError::Memory {
                width: rect.width,
                height: rect.height,
                needed: needed.div_ceil(1 << 20),
                limit,
            });
        }
        let light_bytes = match settings.memory {
            // The memory that is free now says nothing of other machines.
            None if settings.deterministic => LIGHT_BYTES,
            _ => total - film - estimate,
        };
        Ok(Self { film, estimate, output, total, limit, light_bytes, in_lanes })
    }

    /// Checks that the iterations of a plan fit. They may need a tenth more than a setting
    /// allows: a plan that was made to fit is measured anew, and in another time, when its render goes on.
    ///
    /// # Errors
    /// [`RenderError::PlanMemory`].
    pub(crate) fn fits<S: Scene>(&self, plan: &Plan, statistics: &Statistics) -> Result<(), RenderError> {
        let needed = self.iteration_bytes::<S>(plan, statistics);
        // Of what is free there is no more, and a plan was made for half of it.
        let more = if matches!(self.limit, MemoryLimit::Free(_)) { 0 } else { self.total / 10 };
        if needed > self.total.saturating_add(more) {
            let needed = needed.div_ceil(1 << 20);
            return Err(RenderError::PlanMemory { needed, limit: self.limit });
        }
        Ok(())
    }

    /// As many of so many light sub-paths, and of those with beams, as there is room for, at least one if
    /// there are any.
    pub(super) fn limited<S: Scene>(&self, paths: [u32; 2], statistics: &Statistics) -> [u32; 2] {
        // Need grows in proportion: a part of the sub-paths takes this part of the memory.
        let need = self.light_need::<S>(paths, statistics);
        let part = (self.light_bytes as f64 / need.max(1.0)).min(1.0);
        paths.map(|count| ((f64::from(count) * part) as u32).max(count.min(1)))
    }

    /// Whether there is room for a number of light sub-paths, and of those with beams.
    pub(super) fn holds<S: Scene>(&self, paths: [u32; 2], statistics: &Statistics) -> bool {
        self.light_need::<S>(paths, statistics) <= self.light_bytes as f64
    }

    /// The most light sub-paths that there is room for in the proportion of those of a plan.
    pub(super) fn most_paths<S: Scene>(&self, plan: &Plan, statistics: &Statistics) -> f64 {
        let need = self.light_need::<S>([plan.light_paths, plan.beam_paths], statistics);
        f64::from(plan.light_paths) * self.light_bytes as f64 / need.max(1.0)
    }

    /// The most bytes that a number of light sub-paths, and of those with beams, take at one time.
    fn light_need<S: Scene>(&self, [paths, beam_paths]: [u32; 2], statistics: &Statistics) -> f64 {
        LightCounts::expected(statistics, paths, beam_paths).peak_bytes::<S::Bsdf>(self.in_lanes)
    }

    /// Items that a small run of the preparation may have, with as many bytes of others beside them.
    pub(crate) const fn items<T>(&self) -> u64 {
        /// As they are traced, put together in lists that double, made ready for queries or predictions, and
        /// once more as what neighbours have in common, which is most of them where light is merged.
        const COPIES: u64 = 5;
        self.light_bytes / 2 / (COPIES * size_of::<T>() as u64)
    }

    /// Bytes that a render by a plan is expected to take.
    pub(crate) fn expected_bytes<S: Scene>(&self, plan: &Plan, statistics: &Statistics) -> u64 {
        (self.film + self.output).max(self.iteration_bytes::<S>(plan, statistics))
    }

    /// Bytes that an iteration takes, with an estimate of the error after it.
    fn iteration_bytes<S: Scene>(&self, plan: &Plan, statistics: &Statistics) -> u64 {
        let light = self.light_need::<S>([plan.light_paths, plan.beam_paths], statistics);
        self.film + self.estimate + light as u64
    }
}

/// Bytes that a render may take, with what they come from: the given number of MiB, or half of what is
/// `free`, or `all` of it.
fn budget(mebibytes: Option<u32>, all: bool, free: Option<u64>) -> (u64, MemoryLimit) {
    let (bytes, limit): (u64, fn(u64) -> MemoryLimit) = match (mebibytes, free) {
        (Some(mebibytes), _) => (u64::from(mebibytes) << 20, MemoryLimit::Setting),
        (None, None) => (LIGHT_BYTES, MemoryLimit::Unknown),
        (None, Some(free)) if all => (free, MemoryLimit::Free),
        (None, Some(free)) => (free / 2, MemoryLimit::HalfOfFree),
    };
    (bytes, limit(bytes >> 20))
}

/// Bytes that a process can still have, by what Linux says of the machine and of the control groups that it
/// is in; `None` where it says nothing.
fn free_bytes() -> Option<u64> {
    let text = |path: &str| fs::read_to_string(path).unwrap_or_default();
    let machine = available(&text("/proc/meminfo"));
    let groups = text("/proc/self/cgroup");
    let of_groups = group_folders(&groups).filter_map(|folder| free_of_group(&folder));
    machine.into_iter().chain(of_groups).min()
}

/// Folders with the limits of control groups: those of `/proc/self/cgroup` and all above them, as limits hold
/// for what is below. In a container the own group may be the root.
fn group_folders(groups: &str) -> impl Iterator<Item = PathBuf> + '_ {
    groups.lines().flat_map(|line| {
        let mut parts = line.splitn(3, ':').skip(1);
        let root = match parts.next() {
            Some("") => Some("/sys/fs/cgroup"),
            Some(controllers) if controllers.split(',').any(|name| name == "memory") => {
                Some("/sys/fs/cgroup/memory")
            }
            _ => None,
        };
        let path = parts.next().unwrap_or_default();
        let folders = root.map(|root| {
            let own = Path::new(path.trim_start_matches('/')).ancestors();
            own.map(|folder| Path::new(root).join(folder))
        });
        folders.into_iter().flatten()
    })
}

/// Bytes that a control group, of version 2 or 1, may still take: files in its cache make room for others.
fn free_of_group(folder: &Path) -> Option<u64> {
    let text = |name: &str| fs::read_to_string(folder.join(name)).ok();
    let number = |name: &str| text(name)?.trim().parse::<u64>().ok();
    let of_version = |[most, taken, cached]: [&str; 3]| {
        let cached = text("memory.stat").and_then(|stat| {
            stat.lines().find_map(|line| line.strip_prefix(cached)?.trim().parse::<u64>().ok())
        });
        Some(number(most)?.saturating_sub(number(taken)?.saturating_sub(cached.unwrap_or(0))))
    };
    of_version(["memory.max", "memory.current", "inactive_file "])
        .or_else(|| of_version(["memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file "]))
}

/// The line `MemAvailable` of `/proc/meminfo`, in bytes.
fn available(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    line.trim().strip_suffix(" kB")?.parse::<u64>().ok()?.checked_mul(1024)
}

/// Numbers of vertices and beams that light sub-paths leave in memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LightCounts {
    /// Light vertices.
    pub(crate) vertices: f64,
    /// Vertices in the tree of surface photons.
    pub(crate) surface: f64,
    /// Vertices in the tree of photons in media.
    pub(crate) medium: f64,
    /// Photon beams.
    pub(crate) beams: f64,
    /// The pieces that they are cut into.
    pub(crate) pieces: f64,
}

impl LightCounts {
    /// The numbers that light sub-paths leave, some of which leave beams.
    pub(crate) fn expected(statistics: &Statistics, light_paths: u32, beam_paths: u32) -> Self {
        let (paths, beam_paths) = (f64::from(light_paths), f64::from(beam_paths));
        Self {
            vertices: paths * statistics.vertices_per_path,
            surface: paths * statistics.surface_per_path,
            medium: paths * statistics.medium_per_path,
            beams: beam_paths * statistics.beams_per_path,
            pieces: beam_paths * statistics.pieces_per_path,
        }
    }

    /// The most bytes that they take at one time, from the first vertex to the end of the iteration.
    fn peak_bytes<B>(&self, in_lanes: bool) -> f64 {
        /// The boxes of a tree, per item: those of leaves, rounded for points, and the nodes above them.
        const NODES: f64 = 256.0 / 512.0 * 8.0 / 7.0;
        const POINT_BOXES: f64 = 1.0 + NODES;
        const PIECE_BOXES: f64 = 3.0 + NODES;
        /// A position with its payload: sorted into buckets, and before that given to be sorted, after that
        /// in its place in the tree.
        const POINT: f64 = 16.0;
        /// A segment with its payload.
        const SEGMENT: f64 = 36.0;
        /// A piece of one; its centre and index, sorted into buckets; its place in the tree.
        const PIECE: f64 = 12.0;
        const CENTRE: f64 = 16.0;
        const PLACED: f64 = 40.0;
        let [vertex, beam] = if in_lanes {
            [size_of::<LightVertex<B, f64, [f64; 3]>>(), size_of::<PhotonBeam<f64, [f64; 3]>>()]
        } else {
            [size_of::<LightVertex<B>>(), size_of::<PhotonBeam>()]
        };
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
        assert!(budget(None, false, free_bytes()).0 > 1 << 20);
        // The limit that a message names is the one that holds.
        let free = Some(5 << 30);
        for (budget, mebibytes, reason) in [
            (budget(Some(3), false, free), 3, "3 MiB are allowed by the setting; "),
            (budget(Some(3), true, None), 3, "3 MiB are allowed by the setting; "),
            (budget(None, false, free), 2560, "2560 MiB are taken, half of what is free; "),
            (budget(None, true, free), 5120, "5120 MiB are free; "),
            (
                budget(None, true, None),
                2048,
                "2048 MiB are taken, since this system does not tell what is free; ",
            ),
        ] {
            let text = budget.1.to_string();
            assert_eq!(budget.0, mebibytes << 20);
            assert!(text.starts_with(reason) && text.contains("`memory` in the settings"), "{text}");
        }
    }

    #[test]
    fn limits_of_all_control_groups_count() {
        let folders = |groups: &str| group_folders(groups).collect::<Vec<_>>();
        let paths = |paths: &[&str]| paths.iter().map(PathBuf::from).collect::<Vec<_>>();
        let unified = ["/sys/fs/cgroup/a.slice/b", "/sys/fs/cgroup/a.slice", "/sys/fs/cgroup/"];
        assert_eq!(folders("0::/a.slice/b\n"), paths(&unified));
        let first = ["/sys/fs/cgroup/memory/job", "/sys/fs/cgroup/memory/"];
        assert_eq!(folders("5:cpu,cpuacct:/x\n4:memory:/job\n"), paths(&first));
        assert_eq!(folders("nothing"), paths(&[]));
        let folder = std::env::temp_dir().join(format!("upbp-group-{}", std::process::id()));
        let of = |files: &[(&str, &str)]| {
            fs::create_dir_all(&folder).unwrap();
            for (name, text) in files {
                fs::write(folder.join(name), text).unwrap();
            }
            let free = free_of_group(&folder);
            fs::remove_dir_all(&folder).unwrap();
            free
        };
        let (most, taken) = (("memory.max", "8000\n"), ("memory.current", "7000\n"));
        assert_eq!(of(&[most, taken]), Some(1000));
        let stat = ("memory.stat", "anon 400\ninactive_file 6000\nactive_file 600\n");
        assert_eq!(of(&[most, taken, stat]), Some(7000));
        assert_eq!(of(&[("memory.max", "max\n"), taken]), None);
        let of_first = [("memory.limit_in_bytes", "500"), ("memory.usage_in_bytes", "600")];
        assert_eq!(of(&of_first), Some(0));
    }
}
