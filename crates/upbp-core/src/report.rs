//! What a render did, for people and for scripts.

use std::fmt;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use upbp_estimators::{Counters, Technique};

use crate::auto::support::Census;
use crate::film::ErrorEstimate;
use crate::film::IterationSet;
use crate::plan::RenderPlan;
use crate::state::State;

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

/// Wall time of the passes, in whole nanoseconds: sums do not depend on the order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct PassTimes {
    pub(crate) pilot: Duration,
    pub(crate) light: Duration,
    pub(crate) build: Duration,
    pub(crate) camera: Duration,
    pub(crate) film: Duration,
}

impl PassTimes {
    pub(crate) fn add(&mut self, other: &Self) {
        let sum = |a: &mut Duration, b| *a = a.saturating_add(b);
        sum(&mut self.pilot, other.pilot);
        sum(&mut self.light, other.light);
        sum(&mut self.build, other.build);
        sum(&mut self.camera, other.camera);
        sum(&mut self.film, other.film);
    }

    pub(crate) fn seconds(&self) -> PassSeconds {
        PassSeconds {
            pilot: self.pilot.as_secs_f64(),
            light: self.light.as_secs_f64(),
            build: self.build.as_secs_f64(),
            camera: self.camera.as_secs_f64(),
            film: self.film.as_secs_f64(),
        }
    }
}

/// The error at some moment of a render, against a reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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

/// Errors over time, of any length of a render in bounded space: every iteration up to the hundredth, then one per hundredth
/// of the number of iterations, and the latest.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ErrorSeries(Vec<ErrorPoint>);

impl ErrorSeries {
    /// Least ratio of the numbers of iterations of two points that are kept.
    const SPACING: f64 = 1.01;

    /// Adds a point with more iterations than those before.
    pub fn push(&mut self, point: ErrorPoint) {
        if let [.., before, last] = self.0.as_mut_slice()
            && (last.iterations as f64) < Self::SPACING * before.iterations as f64
        {
            *last = point;
        } else {
            self.0.push(point);
        }
    }

    /// The points that were kept.
    #[must_use]
    pub fn points(&self) -> &[ErrorPoint] {
        &self.0
    }
}

/// What a render did.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Version of the renderer.
    pub version: String,
    /// What the scene can use.
    pub census: Census,
    /// Width and height of the picture.
    pub resolution: [u32; 2],
    /// Seed.
    pub seed: u64,
    /// Iterations done.
    pub iterations: u64,
    /// Which ones: ranges with their ends excluded.
    pub iteration_set: IterationSet,
    /// A number of the film's bits: equal for equal films, however they came about.
    pub film_fingerprint: String,
    /// Seconds of rendering by pass.
    pub seconds: PassSeconds,
    /// Whether techniques, if they were chosen, were so by a model of costs; else time was measured.
    pub deterministic: bool,
    /// What iterations ran, from which on.
    pub plan: RenderPlan,
    /// Light sub-paths of the iteration with the largest index.
    pub light_paths: u32,
    /// Of them with photon beams.
    pub beam_paths: u32,
    /// Radii of the iteration with the largest index: `surf`, `pp3d`, `pb2d`, `bp2d`, `bb1d`.
    pub last_radii: [f32; 5],
    /// Counts over all iterations.
    pub counters: Counters,
    /// Part of the image's mean luminance that each layer holds.
    pub shares: Vec<(&'static str, f64)>,
    /// Largest number of bytes that light vertices, beams and look-up structures took.
    pub map_bytes: u64,
    /// Bytes that the render was expected to need: the film, and an iteration or the writing of an image.
    pub expected_bytes: u64,
    /// Estimated relMSE of the image, without the bias of kernels and light that no technique finds; `None` before there are two halves.
    pub estimated_error: Option<ErrorEstimate>,
    /// Error against a reference over time, if there is one.
    pub series: ErrorSeries,
}

impl Report {
    pub(crate) fn new(state: &State) -> Self {
        let State { identity, record, film } = state;
        let last = film.iteration_set().last().unwrap_or(0);
        let stage = identity.plan.stage(last);
        let radii = stage.radii.kernels(last);
        let error = film.error_map().map(|map| map.estimate());
        Self {
            version: identity.version.clone(),
            census: identity.census.clone(),
            resolution: [film.rect().width, film.rect().height],
            seed: identity.settings.seed,
            iterations: film.iterations(),
            iteration_set: film.iteration_set().clone(),
            film_fingerprint: film.fingerprint(),
            seconds: record.times.seconds(),
            deterministic: identity.settings.deterministic,
            plan: identity.plan.clone(),
            light_paths: stage.light_paths,
            beam_paths: stage.beam_paths,
            last_radii: [
                radii.surf.radius(),
                radii.pp3d.radius(),
                radii.pb2d.radius(),
                radii.bp2d.radius(),
                radii.bb1d.radius(),
            ],
            counters: record.counters,
            shares: film.shares().into_iter().map(|(layer, share)| (layer.name(), share)).collect(),
            map_bytes: record.map_bytes,
            expected_bytes: record.expected_bytes,
            estimated_error: error,
            series: record.series.clone(),
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [width, height] = self.resolution;
        writeln!(f, "{}", self.census)?;
        for stage in self.plan.stages() {
            writeln!(f, "{stage}")?;
        }
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
            "{} light vertices and {} beams in all, {:.1} MiB at most",
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
            Some(error) => writeln!(f, "estimated relMSE: {error}")?,
            None => writeln!(f, "estimated relMSE: unknown before the second iteration")?,
        }
        if c.cut_walks > 0 {
            writeln!(
                f,
                "{} camera sub-paths were ended by the limit of the path length (max_length): light is missing",
                c.cut_walks
            )?;
        }
        if [c.dropped, c.lost_walks, c.boundary_conflicts].iter().any(|count| *count > 0) {
            writeln!(
                f,
                "dropped: {} contributions that were not finite; geometry that is not closed: {} walks lost, {} boundaries ignored",
                c.dropped, c.lost_walks, c.boundary_conflicts
            )?;
        }
        if let Some(last) = self.series.points().last() {
            writeln!(f, "against the reference: relMSE {:.3e}, RMSE {:.3e}", last.relative_mse, last.rmse)?;
        }
        Ok(())
    }
}
