//! What a render did, for people and for scripts.

use std::fmt;

use serde::Serialize;
use upbp_estimators::{Counters, Technique};

use crate::census::Census;
use crate::radius::RadiusSchedule;

/// Wall seconds of the passes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PassSeconds {
    /// The pilot.
    pub pilot: f64,
    /// Light sub-paths.
    pub light: f64,
    /// Building look-up structures.
    pub build: f64,
    /// Camera sub-paths, with all look-ups.
    pub camera: f64,
    /// Splats and film.
    pub film: f64,
}

impl PassSeconds {
    /// All passes together.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.pilot + self.light + self.build + self.camera + self.film
    }
}

/// The error at some moment of a render, against a reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorPoint {
    /// Seconds of rendering, without evaluation of the error.
    pub seconds: f64,
    /// Iterations done.
    pub iterations: u64,
    /// Mean of `(x − r)² / (r² + 0.01)`.
    pub relative_mse: f64,
    /// Root mean squared difference.
    pub rmse: f64,
}

/// What a render did.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Version of the renderer.
    pub version: &'static str,
    /// What the scene can use.
    pub census: Census,
    /// Width and height of the picture.
    pub resolution: [u32; 2],
    /// Seed.
    pub seed: u64,
    /// Iterations done.
    pub iterations: u64,
    /// Seconds of rendering by pass.
    pub seconds: PassSeconds,
    /// Light sub-paths per iteration.
    pub light_paths: u32,
    /// Of them with photon beams.
    pub beam_paths: u32,
    /// Radii of the first iteration.
    pub first_radii: RadiusSchedule,
    /// Radii of the last iteration: `surf`, `pp3d`, `pb2d`, `bp2d`, `bb1d`.
    pub last_radii: [f32; 5],
    /// Counts over all iterations.
    pub counters: Counters,
    /// Part of the image's mean luminance that each layer holds.
    pub shares: Vec<(&'static str, f64)>,
    /// Largest number of bytes that light vertices, beams and look-up structures took.
    pub map_bytes: u64,
    /// Estimated relMSE of the image; `None` with fewer than two iterations.
    pub estimated_error: Option<f64>,
    /// Error against a reference over time, if there is one.
    pub series: Vec<ErrorPoint>,
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [width, height] = self.resolution;
        writeln!(f, "{}", self.census)?;
        let s = &self.seconds;
        writeln!(
            f,
            "{width} x {height}, {} iterations in {:.1} s (pilot {:.1}, light {:.1}, build {:.1}, camera {:.1}, film {:.1})",
            self.iterations,
            s.total(),
            s.pilot,
            s.light,
            s.build,
            s.camera,
            s.film
        )?;
        let c = &self.counters;
        writeln!(
            f,
            "{} light paths per iteration, {} with beams; {} light vertices and {} beams in all, {:.1} MiB at most",
            self.light_paths,
            self.beam_paths,
            c.light_vertices,
            c.photon_beams,
            self.map_bytes as f64 / 1_048_576.0
        )?;
        write!(f, "contributions:")?;
        for technique in Technique::ALL {
            let count = c.contributions_of(technique);
            if count > 0 {
                write!(f, " {} {count}", technique.name())?;
            }
        }
        writeln!(f)?;
        write!(f, "shares:")?;
        for (layer, share) in &self.shares {
            write!(f, " {layer} {:.1} %", 100.0 * share)?;
        }
        writeln!(f)?;
        match self.estimated_error {
            Some(error) => writeln!(f, "estimated relMSE: {error:.3e}")?,
            None => writeln!(f, "estimated relMSE: unknown before the second iteration")?,
        }
        if c.cut_walks > 0 {
            writeln!(
                f,
                "{} camera sub-paths were ended by the limit of the path length (max_length): light is missing",
                c.cut_walks
            )?;
        }
        if c.dropped + c.lost_walks + c.boundary_conflicts > 0 {
            writeln!(
                f,
                "dropped: {} contributions that were not finite; geometry that is not closed: {} walks lost, {} boundaries ignored",
                c.dropped, c.lost_walks, c.boundary_conflicts
            )?;
        }
        if let Some(last) = self.series.last() {
            writeln!(f, "against the reference: relMSE {:.3e}, RMSE {:.3e}", last.relative_mse, last.rmse)?;
        }
        Ok(())
    }
}
