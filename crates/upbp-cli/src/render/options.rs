//! The command line.

use std::num::NonZeroUsize;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use upbp_core::{Content, LightPaths, MAX_ITERATIONS, Output, Settings, Stop, Techniques};
use upbp_scene::description::Count;

use crate::files::{self, Images};
use crate::threads::threads;

/// Seconds of rendering if nothing else says when to stop.
const DEFAULT_SECONDS: f64 = 60.0;

/// Renders a scene file.
#[derive(Debug, Args)]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
pub(crate) struct Options {
    /// Scene file (RON)
    #[arg(value_name = "SCENE.ron")]
    pub(crate) scene: PathBuf,
    /// Image to write: OpenEXR, and a PNG of the same name beside it; or OUT.png, a PNG alone
    #[arg(short, long, value_name = "OUT.exr", default_value = "render.exr", value_parser = files::path(Images::named))]
    pub(crate) output: Images,
    /// Size of the film in pixels instead of the scene's, such as 640x360
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(crate) size: Option<[Count; 2]>,
    /// Render iterations 0..N, or A..B as a share of a render that others work on too
    #[arg(long, value_name = "N|A..B", value_parser = iterations)]
    iterations: Option<Iterations>,
    /// Stop after this many seconds of rendering, resumed ones included [default: 60 if no other limit is given]
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    time: Option<f64>,
    /// Stop when the estimated relMSE is below this
    #[arg(long, value_name = "E", value_parser = positive)]
    target_error: Option<f64>,
    /// Techniques: auto [default, those that pay in the scene], or names joined by `+` out of bpt, pt, hit, nee, connect, lt, surf, pp3d, pb2d, bp2d, bb1d, all
    #[arg(long, value_name = "LIST")]
    techniques: Option<Techniques>,
    /// Choose techniques by a model of costs instead of measured time: every run chooses the same. Goes without saying for A..B
    #[arg(long)]
    deterministic: bool,
    /// Run what a plan says that another render has saved
    #[arg(long, value_name = "FILE.ron")]
    pub(crate) plan: Option<PathBuf>,
    /// Save the plan: what iterations run, as far as it was decided
    #[arg(long, value_name = "FILE.ron", value_parser = files::path(plan))]
    pub(crate) save_plan: Option<PathBuf>,
    /// Most edges of a path between light and camera
    #[arg(long, value_name = "K")]
    max_length: Option<u32>,
    /// Seed of all random numbers
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// Threads [default: one per core; at most 16 per core]; the image does not depend on it
    #[arg(long, value_name = "T", value_parser = threads)]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Light sub-paths per iteration [default: one per pixel]
    #[arg(long, value_name = "N")]
    light_paths: Option<u32>,
    /// Light sub-paths that leave photon beams, per iteration [default: a few per query beam]
    #[arg(long, value_name = "N")]
    beams: Option<u32>,
    /// Keep the first radii instead of shrinking them
    #[arg(long)]
    fixed_radius: bool,
    /// Settings file (RON); the options above override it
    #[arg(long, value_name = "FILE")]
    pub(crate) settings: Option<PathBuf>,
    /// Image to compare with after every iteration; the series of errors goes to the report
    #[arg(long, value_name = "REF.exr")]
    pub(crate) reference: Option<PathBuf>,
    /// Write the report as JSON
    #[arg(long, value_name = "FILE.json", value_parser = files::path(files::report))]
    pub(crate) report: Option<PathBuf>,
    /// File to go on from if it is there, and to save to: now and then, at the end, and when interrupted
    #[arg(long, value_name = "FILE.state", value_parser = files::path(files::state))]
    pub(crate) state: Option<PathBuf>,
    /// Time between two savings of the state; what is lost in a crash is no more than this and an iteration
    #[arg(long, value_name = "SECONDS", value_parser = positive, default_value_t = 60.0, requires = "state")]
    save_every: f64,
    /// Memory for film, light vertices, photon beams and their look-ups, MiB [default: half of what is free]
    #[arg(long, value_name = "MIB")]
    memory: Option<u32>,
    /// Check scene and settings, render nothing
    #[arg(long)]
    pub(crate) check: bool,
    /// Print nothing but errors
    #[arg(long)]
    pub(crate) quiet: bool,
}

impl Options {
    /// When to stop.
    pub(crate) fn stop(&self) -> Stop {
        let unlimited = self.iterations.is_none() && self.target_error.is_none();
        Stop {
            iterations: None,
            seconds: self.time.or(unlimited.then_some(DEFAULT_SECONDS)),
            error: self.target_error,
        }
    }

    /// Time between two savings.
    pub(crate) fn save_every(&self) -> Duration {
        Duration::try_from_secs_f64(self.save_every).unwrap_or(Duration::MAX)
    }

    /// All files that are written. The state, which is read too if it is there, is one of them.
    pub(crate) fn outputs(&self) -> Vec<Output<'_>> {
        let others = [
            ("the report", &self.report, Content::Report),
            ("the state", &self.state, Content::State),
            ("the plan to save", &self.save_plan, Content::Plan),
        ];
        let others = others
            .into_iter()
            .filter_map(|(role, path, content)| Some(Output { role, path: path.as_deref()?, content }));
        self.output.outputs().chain(others).collect()
    }

    /// The files that are only read, as far as the command line tells.
    pub(crate) fn inputs(&self) -> impl Iterator<Item = (&'static str, &Path)> {
        [("the settings", &self.settings), ("the plan", &self.plan), ("the reference", &self.reference)]
            .into_iter()
            .filter_map(|(role, path)| Some((role, path.as_deref()?)))
    }

    /// Whether others render the rest, and what is rendered here cannot be put together with it.
    pub(crate) fn is_lost_share(&self) -> bool {
        self.state.is_none() && self.iterations.as_ref().is_some_and(|iterations| iterations.is_share)
    }

    /// The iterations to render, if not all.
    pub(crate) fn range(&self) -> Option<Range<u64>> {
        self.iterations.as_ref().map(|iterations| iterations.range.clone())
    }

    /// Overrides settings by what was given on the command line.
    pub(crate) fn apply(&self, settings: &mut Settings) {
        if let Some(techniques) = self.techniques {
            settings.techniques = techniques;
        }
        settings.deterministic |= self.deterministic || self.iterations.as_ref().is_some_and(|i| i.is_share);
        if let Some(length) = self.max_length {
            settings.max_length = length;
        }
        if let Some(seed) = self.seed {
            settings.seed = seed;
        }
        if let Some(count) = self.light_paths {
            settings.light_paths = LightPaths::Count(count);
        }
        if self.beams.is_some() {
            settings.beams = self.beams;
        }
        if self.memory.is_some() {
            settings.memory = self.memory;
        }
        if self.fixed_radius {
            settings.progressive = false;
        }
    }
}

fn plan(path: PathBuf) -> Result<PathBuf, String> {
    files::ends_in(path, &["ron", "plan"])
}

fn size(text: &str) -> Result<[Count; 2], String> {
    let sides: Option<Vec<Count>> = text.split('x').map(|side| Count::new(side.parse().ok()?).ok()).collect();
    match sides.as_deref() {
        Some(&[width, height]) => Ok([width, height]),
        _ => Err("expected width x height in pixels, such as 640x360".to_owned()),
    }
}

/// Iterations to render.
#[derive(Clone, Debug)]
struct Iterations {
    range: Range<u64>,
    /// Whether others render the rest.
    is_share: bool,
}

fn iterations(text: &str) -> Result<Iterations, String> {
    let share = text.split_once("..");
    let (start, end) = share.unwrap_or(("0", text));
    match (start.parse::<u64>(), end.parse::<u64>()) {
        (Ok(start), Ok(end)) if start < end && end <= MAX_ITERATIONS => {
            Ok(Iterations { range: start..end, is_share: share.is_some() })
        }
        _ => Err(format!(
            "expected a number of iterations such as 100, or a range such as 100..200 without its end, up to {MAX_ITERATIONS}"
        )),
    }
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("expected a positive number".to_owned()),
    }
}
