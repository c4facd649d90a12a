//! The options of `upbp render` and `upbp check`, in the groups in which the help shows them.

use std::error::Error;
use std::num::{IntErrorKind, NonZeroUsize, ParseIntError};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use clap::{Args, ValueHint};
use upbp_core::{
    Content, LightPaths, MAX_ITERATIONS, Output, Settings, Stop, Technique, TechniqueSet, Techniques,
    read_text,
};
use upbp_scene::description::{Count, Crop};

use crate::exit;
use crate::files::{self, Images, Look};

/// Seconds of rendering if nothing else says when to stop.
const DEFAULT_SECONDS: f64 = 60.0;
/// The most threads per core. More only wait for each other, and each takes memory.
const THREADS_PER_CORE: usize = 16;

#[derive(Debug, Args)]
pub(crate) struct Options {
    /// Scene file (RON)
    ///
    /// `upbp format` describes it; scenes to start from are in examples/scenes of the repository.
    #[arg(value_name = "SCENE.ron", value_hint = ValueHint::FilePath)]
    pub(crate) scene: PathBuf,
    #[command(flatten)]
    pub(crate) image: ImageOptions,
    #[command(flatten)]
    pub(crate) limits: Limits,
    #[command(flatten)]
    pub(crate) method: Method,
    #[command(flatten)]
    pub(crate) saving: Saving,
    #[command(flatten)]
    pub(crate) resources: Resources,
    #[command(flatten)]
    pub(crate) messages: Messages,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Image")]
pub(crate) struct ImageOptions {
    /// Image to write: OpenEXR, and a PNG of the same name beside it; or OUT.png, a PNG alone [default: the
    /// scene's name, in the current folder]
    #[arg(short, long, value_name = "OUT.exr", value_parser = files::path(Images::named), value_hint = ValueHint::FilePath)]
    output: Option<Images>,
    /// Size of the film in pixels, such as 640x360; drops the scene's crop [default: the scene's]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(crate) size: Option<[Count; 2]>,
    /// Part of the film to render: column and row of its top left pixel, and its size, such as 100,50,64x36
    /// [default: the scene's]
    #[arg(long, value_name = "X,Y,WxH", value_parser = crop)]
    pub(crate) crop: Option<Crop>,
    #[command(flatten)]
    pub(crate) look: Look,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "When to stop (what is reached first)")]
pub(crate) struct Limits {
    /// Render iterations 0..N, or A..B as a share of a render that others work on too
    #[arg(long, value_name = "N|A..B", value_parser = iterations)]
    iterations: Option<Iterations>,
    /// Stop after this many seconds of rendering: preparation and resumed ones included, in the middle of an
    /// iteration if need be [default: 60 if no other limit is given]
    #[arg(long, value_name = "SECONDS", value_parser = positive, allow_negative_numbers = true)]
    time: Option<f64>,
    /// Stop when the estimated relMSE is below this with its whole interval, without the bias of kernels
    ///
    /// Errors are relative to the brightness of a pixel, but what is darker than about 0.1 counts less:
    /// render a dark scene with brighter lights, or stop by time. While the estimate is in doubt, as that
    /// of a black picture is, this does not stop the render: give `--time` too.
    #[arg(long, value_name = "E", value_parser = positive, allow_negative_numbers = true)]
    target_error: Option<f64>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "How to render")]
pub(crate) struct Method {
    /// Techniques: `auto`, those that pay in the scene, or names joined by `+` [default: auto]
    #[arg(long, value_name = "LIST")]
    techniques: Option<Techniques>,
    /// Choose techniques as if the render had no limit: every run chooses the same. Goes without saying for
    /// A..B
    #[arg(long)]
    deterministic: bool,
    /// Run what a plan says that another render has saved, whatever other options say of sample counts and
    /// radii
    #[arg(long, value_name = "FILE.ron", value_hint = ValueHint::FilePath)]
    pub(crate) plan: Option<PathBuf>,
    /// Save the plan: techniques, sample counts and first radii; `.ron` or `.plan`
    #[arg(long, value_name = "FILE.ron", value_parser = files::path(files::plan), value_hint = ValueHint::FilePath)]
    pub(crate) save_plan: Option<PathBuf>,
    /// Most edges of a path between light and camera [default: 16384]
    #[arg(long, value_name = "K", value_parser = whole::<u32>, allow_negative_numbers = true)]
    max_length: Option<u32>,
    /// Light sub-paths per iteration [default: one per pixel, fewer or more where that pays, fewer where
    /// memory or time is short]
    #[arg(long, value_name = "N", value_parser = whole::<u32>, allow_negative_numbers = true)]
    light_paths: Option<u32>,
    /// Light sub-paths that leave photon beams, per iteration [default: enough to give a query beam about
    /// one, fewer or more where that pays]
    #[arg(long, value_name = "N", value_parser = whole::<u32>, allow_negative_numbers = true)]
    beams: Option<u32>,
    /// Keep the first radii of kernels instead of shrinking them
    #[arg(long)]
    fixed_radius: bool,
    /// Record albedo, normal, depth and the number of samples too, as layers of OUT.exr: for denoisers
    #[arg(long)]
    features: bool,
    /// Seed of all random numbers [default: 0]
    #[arg(long, value_name = "S", value_parser = whole::<u64>, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Settings file (RON) for these and rarer choices; options override it
    ///
    /// It names what differs from the defaults: ( techniques: "all", heuristic: Power, radii: (pb2d:
    /// Scene(0.001)) ).
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    settings: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Saving and resuming")]
pub(crate) struct Saving {
    /// File to go on from if it is there, and to save to: now and then, at the end, and when interrupted
    #[arg(long, value_name = "FILE.state", value_parser = files::path(files::state), value_hint = ValueHint::FilePath)]
    pub(crate) state: Option<PathBuf>,
    /// Time between two savings of the state; what is lost in a crash is little more than this
    #[arg(long, value_name = "SECONDS", value_parser = positive, default_value = "60", requires = "state")]
    save_every: f64,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Resources")]
pub(crate) struct Resources {
    /// Threads, at most 16 per core; any number gives the same image by the same plan and iterations
    /// [default: one per core]
    #[arg(long, value_name = "T", value_parser = threads)]
    threads: Option<NonZeroUsize>,
    /// Memory for film, light vertices, photon beams and their trees, MiB [default: half of what is free, or
    /// 2048 where the system does not tell]
    #[arg(long, value_name = "MIB", value_parser = whole::<u32>, allow_negative_numbers = true)]
    memory: Option<u32>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Reports")]
pub(crate) struct Messages {
    /// Write the report as JSON
    #[arg(long, value_name = "FILE.json", value_parser = files::path(files::report), value_hint = ValueHint::FilePath)]
    pub(crate) report: Option<PathBuf>,
    /// Image to compare with after every iteration; the series of errors goes to the report
    #[arg(long, value_name = "REF.exr", value_hint = ValueHint::FilePath)]
    pub(crate) reference: Option<PathBuf>,
    /// Print nothing but warnings and errors
    #[arg(long)]
    pub(crate) quiet: bool,
}

impl Options {
    /// The images to write.
    pub(crate) fn images(&self) -> Images {
        self.image.output.clone().unwrap_or_else(|| Images::of_scene(&self.scene))
    }

    /// The rules that stop the render.
    pub(crate) fn stop(&self) -> Stop {
        let Limits { iterations, time, target_error } = &self.limits;
        let unlimited = iterations.is_none() && target_error.is_none();
        Stop {
            iterations: None,
            seconds: time.or(unlimited.then_some(DEFAULT_SECONDS)),
            error: *target_error,
        }
    }

    /// The iterations to render, if not all.
    pub(crate) fn range(&self) -> Option<Range<u64>> {
        self.limits.iterations.as_ref().map(|iterations| iterations.range.clone())
    }

    /// Whether others render the rest.
    fn is_share(&self) -> bool {
        self.limits.iterations.as_ref().is_some_and(|iterations| iterations.is_share)
    }

    /// Whether others render the rest, without a state here that could be merged with theirs.
    pub(crate) fn is_lost_share(&self) -> bool {
        self.saving.state.is_none() && self.is_share()
    }

    /// Time between two savings.
    pub(crate) fn save_every(&self) -> Duration {
        Duration::try_from_secs_f64(self.saving.save_every).unwrap_or(Duration::MAX)
    }

    /// The number of threads, 0 for one per core.
    pub(crate) fn threads(&self) -> usize {
        self.resources.threads.map_or(0, NonZeroUsize::get)
    }

    /// All files that are written, `images` included. The state, which is read too if it is there, is one.
    pub(crate) fn outputs<'a>(&'a self, images: &'a Images) -> Vec<Output<'a>> {
        let others = [
            ("the report", &self.messages.report, Content::Report),
            ("the state", &self.saving.state, Content::State),
            ("the plan to save", &self.method.save_plan, Content::Plan),
        ];
        let others = others
            .into_iter()
            .filter_map(|(role, path, content)| Some(Output { role, path: path.as_deref()?, content }));
        images.outputs().chain(others).collect()
    }

    /// All files that the command line names and that are only read.
    pub(crate) fn inputs(&self) -> impl Iterator<Item = (&'static str, &Path)> {
        [
            ("the scene", Some(self.scene.as_path())),
            ("the settings", self.method.settings.as_deref()),
            ("the plan", self.method.plan.as_deref()),
            ("the reference", self.messages.reference.as_deref()),
        ]
        .into_iter()
        .filter_map(|(role, path)| Some((role, path?)))
    }

    /// Says which options change nothing beside the others and the `images` to write: no error, since scripts
    /// try sets of techniques.
    pub(crate) fn explain_idle(&self, settings: &Settings, images: &Images) {
        let techniques = settings.techniques.candidates();
        let is_without = |what| format!("techniques `{techniques}` are without {what}");
        let Method { light_paths, beams, fixed_radius, .. } = self.method;
        let any = |has: fn(Technique) -> bool| techniques.iter().any(has);
        let (has_light_paths, has_layers) =
            (techniques.intersects(TechniqueSet::LIGHT_PATHS), images.have_layers());
        for (is_idle, option, reason) in [
            (light_paths.is_some() && !has_light_paths, "--light-paths", is_without("light sub-paths")),
            (beams.is_some() && !any(Technique::uses_beams), "--beams", is_without("photon beams")),
            (fixed_radius && !any(Technique::merges), "--fixed-radius", is_without("kernels")),
            (
                settings.features && !has_layers && self.saving.state.is_none(),
                "--features",
                "no output holds them, but `-o OUT.exr` or `--state` would".to_owned(),
            ),
        ] {
            if is_idle {
                exit::complain(&format!("note: {option} has no effect: {reason}"));
            }
        }
    }

    /// The settings: those of the file, if any, overridden by the command line.
    pub(crate) fn settings(&self) -> Result<Settings, Box<dyn Error>> {
        let mut settings = match &self.method.settings {
            None => Settings::default(),
            Some(path) => {
                let text =
                    read_text(path).map_err(|error| format!("cannot read {}: {error}", path.display()))?;
                Settings::from_ron(&text).map_err(|error| format!("{}:{error}", path.display()))?
            }
        };
        let Method {
            techniques,
            deterministic,
            max_length,
            light_paths,
            beams,
            fixed_radius,
            features,
            seed,
            ..
        } = self.method;
        settings.techniques = techniques.unwrap_or(settings.techniques);
        settings.deterministic |= deterministic || self.is_share();
        settings.max_length = max_length.unwrap_or(settings.max_length);
        settings.light_paths = light_paths.map_or(settings.light_paths, LightPaths::Count);
        settings.beams = beams.or(settings.beams);
        settings.progressive &= !fixed_radius;
        settings.features |= features;
        settings.seed = seed.unwrap_or(settings.seed);
        settings.memory = self.resources.memory.or(settings.memory);
        Ok(settings)
    }
}

/// Names of techniques and of layers, for the help.
pub(crate) fn names() -> String {
    let techniques = [
        ("hit", "the camera sub-path meets a light, an environment or an emitting medium"),
        ("nee", "next event estimation"),
        ("connect", "connecting a camera vertex to light vertices"),
        ("lt", "light tracing: connecting a light vertex to the camera"),
        ("surf", "merging with photons on surfaces"),
        ("pp3d", "photon points around points in media"),
        ("pb2d", "photon points around query beams"),
        ("bp2d", "photon beams around points; not among those that `auto` chooses from"),
        ("bb1d", "photon beams around query beams"),
        ("pt", "path tracing: hit+nee"),
        ("bpt", "bidirectional path tracing: hit+nee+connect+lt"),
        ("all", "all nine"),
        ("auto", "those that pay in the scene, with the numbers of sub-paths that go with them"),
    ];
    let layers = [
        ("R, G, B", "the picture; of a --crop with its place in the whole (data and display window)"),
        (
            "bpt, surf, ...",
            "what each technique that merges adds to it, weighted, and in bpt all others together; of all that ran",
        ),
        (
            "variance",
            "variance of the mean, by the spread of the iterations; from two iterations on, the next two from an even \
             and an odd one on",
        ),
        ("half0, half1", "two independent halves of the render, for denoisers"),
        ("error", "estimated squared error of each pixel, relative to the converged value"),
        (
            "albedo",
            "with --features: albedo of what the camera sees first, behind perfect mirrors and through smooth glass",
        ),
        ("normal", "with --features: its normal X, Y, Z in world space; zero in media and for the sky"),
        ("Z", "with --features: its distance along the ray; infinite for the sky"),
        ("samples", "with --features: number of samples"),
    ];
    [exit::list("Techniques", &techniques), exit::list("Layers of OUT.exr", &layers)].join("\n\n")
}

fn size(text: &str) -> Result<[Count; 2], String> {
    let sides: Option<Vec<Count>> = text.split('x').map(|side| Count::new(side.parse().ok()?).ok()).collect();
    match sides.as_deref() {
        Some(&[width, height]) => Ok([width, height]),
        _ => Err("expected width x height in pixels, such as 640x360".to_owned()),
    }
}

fn crop(text: &str) -> Result<Crop, String> {
    let parts = || {
        let mut parts = text.splitn(3, ',');
        let [x, y] = [parts.next()?.parse().ok()?, parts.next()?.parse().ok()?];
        let [width, height] = size(parts.next()?).ok()?;
        Some(Crop { x, y, width, height })
    };
    parts().ok_or_else(|| "expected column, row, width x height in pixels, such as 100,50,64x36".to_owned())
}

/// A range of iterations.
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

/// Parser of a number without sign, point and exponent.
fn whole<T: FromStr<Err = ParseIntError>>(text: &str) -> Result<T, String> {
    text.parse().map_err(|error: ParseIntError| match error.kind() {
        IntErrorKind::PosOverflow => "the number is too large".to_owned(),
        _ => "expected a whole number from 0, in digits".to_owned(),
    })
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("expected a positive number".to_owned()),
    }
}

/// Parser of a number of threads that makes sense on this machine.
fn threads(text: &str) -> Result<NonZeroUsize, String> {
    let cores = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let most = THREADS_PER_CORE.saturating_mul(cores);
    match text.parse::<NonZeroUsize>() {
        Ok(threads) if threads.get() <= most => Ok(threads),
        _ => Err(format!("expected a number from 1 to {most}, {THREADS_PER_CORE} per core")),
    }
}
