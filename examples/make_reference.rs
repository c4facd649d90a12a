//! Makes the references of `examples/scenes/suite`: long renders in batches of different seeds, so that the
//! standard error of every pixel is known.
//!
//! `cargo run --release --example make_reference -- --scenes caustic_in_fog --sets
//! "bpt+surf+pb2d;bpt+surf+pb2d@0.002"` writes `tests/data/suite/caustic_in_fog.exr` from the first set. The
//! others get a quarter of the time. They are there to be compared with: the table has the means of all of
//! them, the noise, and the difference in tiles and pixels, which is bias where it is more than noise. `@` is
//! followed by the first radius of all kernels, relative to the scene.

use std::error::Error;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Parser;
use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Image as ExrImage, WritableImage as _, f16};
use upbp_core::{
    Content, Image, Output, OutputError, Radii, Radius, Settings, Stop, TechniqueSet, check_outputs,
};
use upbp_scene::{ReadyScene, SceneError};
use upbp_testing::shipped::{Group, Shipped, names};

/// Fewest batches of a set: below that their spread says too little.
const LEAST_BATCHES: u32 = 4;

/// Side of a tile, pixels.
const TILE: usize = 12;

/// Renders references of the suite, or of other scenes.
#[derive(Debug, Parser)]
#[command(version, about)]
struct Options {
    /// Names of scenes of the suite, or paths of scene files [default: the suite]
    #[arg(long, value_delimiter = ',')]
    scenes: Vec<String>,
    /// Sets of techniques, separated by semicolons: that of the reference, then those to compare it with;
    /// SET@R for the first radius R of all kernels, relative to the scene
    #[arg(long, value_delimiter = ';', default_value = "bpt+surf+pb2d+bb1d;bpt")]
    sets: Vec<Set>,
    /// Batches of the first set
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(4..))]
    batches: u32,
    /// Seconds per batch
    #[arg(long, value_name = "SECONDS", default_value_t = 7.0)]
    time: f64,
    /// Seed of the first batch; not one of those that are measured against the reference
    #[arg(long, default_value_t = 1000)]
    seed: u64,
    /// Folder to write to [default: tests/data/suite]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Write nothing, print the table only
    #[arg(long)]
    dry: bool,
}

/// A set of techniques and the first radius of its kernels.
#[derive(Clone, Debug)]
struct Set {
    name: String,
    techniques: TechniqueSet,
    radius: Radius,
}

impl Set {
    fn settings(&self, seed: u64) -> Settings {
        let (techniques, radii) = (self.techniques.into(), Radii::all(self.radius));
        Settings { techniques, radii, seed, ..Settings::default() }
    }
}

impl FromStr for Set {
    type Err = Box<dyn Error + Send + Sync>;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (techniques, radius) = match text.split_once('@') {
            Some((techniques, radius)) => (techniques, Radius::Scene(radius.parse()?)),
            None => (text, Radius::Auto),
        };
        let set = Self { name: text.to_owned(), techniques: techniques.parse()?, radius };
        set.settings(0).validate()?;
        Ok(set)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::parse();
    let wanted = if options.scenes.is_empty() {
        names(Group::Suite).map(str::to_owned).collect()
    } else {
        options.scenes.clone()
    };
    let folder =
        options.out.clone().unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/suite"));
    let jobs = wanted.into_iter().map(|name| Job::open(name, &folder)).collect::<Result<Vec<_>, _>>()?;
    if !options.dry {
        std::fs::create_dir_all(&folder)?;
        check_files(&jobs)?;
    }
    println!(
        "| scene | set | batches × iterations | mean R, G, B | relMSE of its noise | relMSE × s | worst tile |"
    );
    println!("|---|---|---|---|---|---|---|");
    for Job { name, scene, reference, .. } in jobs {
        let mut first: Option<Batches> = None;
        for (index, set) in options.sets.iter().enumerate() {
            let count = if index == 0 { options.batches } else { (options.batches / 4).max(LEAST_BATCHES) };
            let batches = Batches::render(&scene, set, count, &options)?;
            println!("| {name} | {} {}", set.name, batches.row(first.as_ref()));
            first.get_or_insert(batches);
        }
        if let (Some(batches), false) = (first, options.dry) {
            batches.write(&reference)?;
        }
    }
    Ok(())
}

/// A scene to render, and where its reference goes.
struct Job {
    name: String,
    file: PathBuf,
    scene: ReadyScene,
    reference: PathBuf,
}

impl Job {
    fn open(name: String, folder: &Path) -> Result<Self, SceneError> {
        let file = Shipped::find(&name).map_or_else(|| PathBuf::from(&name), |shipped| shipped.scene());
        let scene = ReadyScene::load(&file)?;
        let reference = folder.join(file.with_extension("exr").file_name().unwrap_or_default());
        Ok(Self { name, file, scene, reference })
    }
}

/// Checks, before the work, that the references can be written, and destroy nothing.
fn check_files(jobs: &[Job]) -> Result<(), OutputError> {
    let outputs: Vec<_> = jobs
        .iter()
        .map(|job| Output { role: "the reference", path: &job.reference, content: Content::Exr })
        .collect();
    let inputs: Vec<_> = jobs
        .iter()
        .flat_map(|job| [&job.file].into_iter().chain(job.scene.files()))
        .map(|path| ("a file of a scene", path.as_path()))
        .collect();
    check_outputs(&outputs, &inputs)
}

/// Independent renders of one scene with one set.
struct Batches {
    images: Vec<Image>,
    iterations: u64,
    seconds: f64,
    /// Mean and its standard error, by pixel.
    mean: Vec<[f64; 3]>,
    error: Vec<[f64; 3]>,
}

impl Batches {
    fn render(scene: &ReadyScene, set: &Set, count: u32, options: &Options) -> Result<Self, Box<dyn Error>> {
        let (mut images, mut iterations, mut seconds) = (Vec::new(), 0, 0.0);
        for batch in 0..u64::from(count) {
            let settings = set.settings(options.seed + batch);
            let mut renderer = scene.renderer(settings.validate()?)?;
            let stop = Stop { seconds: Some(options.time), ..Stop::default() };
            renderer.render(&stop, |_| ControlFlow::Continue(()));
            images.push(renderer.film().image());
            iterations += renderer.film().iterations();
            seconds += renderer.report().seconds.total();
        }
        let (mean, error) = mean_and_error(&images);
        Ok(Self { images, iterations, seconds, mean, error })
    }

    /// Mean of a rectangle of pixels, and its standard error from the batches: pixels of a batch share light
    /// sub-paths.
    fn region(&self, pixels: &[usize], c: usize) -> (f64, f64) {
        let means: Vec<f64> = self
            .images
            .iter()
            .map(|image| {
                pixels.iter().map(|i| f64::from(image.pixels[*i][c])).sum::<f64>() / pixels.len() as f64
            })
            .collect();
        estimate(&means)
    }

    /// The largest difference of a tile to `other`, in standard errors and in percent of the tile.
    fn worst_tile(&self, other: &Self) -> (f64, f64) {
        let width = self.images[0].width as usize;
        let mut tiles = std::collections::BTreeMap::<_, Vec<usize>>::new();
        for i in 0..self.mean.len() {
            tiles.entry((i / width / TILE, i % width / TILE)).or_default().push(i);
        }
        let differences =
            tiles.values().flat_map(|pixels| (0..3).map(move |c| (pixels, c))).map(|(pixels, c)| {
                let ((own, e), (theirs, f)) = (self.region(pixels, c), other.region(pixels, c));
                ((own - theirs) / e.hypot(f).max(f64::MIN_POSITIVE), 100.0 * (own / theirs - 1.0))
            });
        differences.fold((0.0, 0.0), |a: (f64, f64), b| if b.0.abs() > a.0.abs() { b } else { a })
    }

    /// relMSE between two sets without the noise of both: what is left is bias.
    fn beyond_noise(&self, other: &Self) -> f64 {
        let values = self.mean.iter().flatten().zip(other.mean.iter().flatten());
        let errors = self.error.iter().flatten().zip(other.error.iter().flatten());
        let sum: f64 = values
            .zip(errors)
            .map(|((a, b), (e, f))| ((a - b).powi(2) - e * e - f * f) / (b * b + 0.01))
            .sum();
        sum / (3 * self.mean.len()) as f64
    }

    /// relMSE that a perfect render would seem to have.
    fn noise(&self) -> f64 {
        let values = self.mean.iter().flatten().zip(self.error.iter().flatten());
        values.map(|(r, s)| s * s / (r * r + 0.01)).sum::<f64>() / (3 * self.mean.len()) as f64
    }

    fn row(&self, reference: Option<&Self>) -> String {
        let all: Vec<usize> = (0..self.mean.len()).collect();
        let mean = [0, 1, 2].map(|c| {
            let (mean, error) = self.region(&all, c);
            format!("{mean:.5} ± {error:.5}")
        });
        let noise = self.noise();
        let tile = reference.map_or_else(
            || "– | –".to_owned(),
            |other| {
                let (sigmas, percent) = self.worst_tile(other);
                format!("{sigmas:+.1} σ ({percent:+.2} %) | {:+.1e}", self.beyond_noise(other))
            },
        );
        let batches = self.images.len();
        format!(
            "| {batches} × {} | {} | {noise:.1e} | {:.1e} | {tile} |",
            self.iterations / batches as u64,
            mean.join(", "),
            noise * self.seconds,
        )
    }

    /// Writes the channels `R`, `stderr.R` and so on.
    fn write(&self, path: &Path) -> Result<(), Box<dyn Error>> {
        let mut channels = Vec::new();
        for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
            let mean = self.mean.iter().map(|pixel| pixel[c] as f32).collect();
            let error = self.error.iter().map(|pixel| f16::from_f64(pixel[c])).collect();
            channels.push(AnyChannel::new(name, FlatSamples::F32(mean)));
            channels.push(AnyChannel::new(format!("stderr.{name}").as_str(), FlatSamples::F16(error)));
        }
        let size = (self.images[0].width as usize, self.images[0].height as usize);
        let mut image = ExrImage::from_channels(size, AnyChannels::sort(channels.into_iter().collect()));
        image.layer_data.encoding.compression = exr::compression::Compression::ZIP16;
        image.write().to_file(path)?;
        Ok(())
    }
}

fn mean_and_error(images: &[Image]) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
    let pixel = |i: usize| {
        [0, 1, 2]
            .map(|c| estimate(&images.iter().map(|image| f64::from(image.pixels[i][c])).collect::<Vec<_>>()))
    };
    (0..images[0].pixels.len())
        .map(|i| (pixel(i).map(|(mean, _)| mean), pixel(i).map(|(_, error)| error)))
        .unzip()
}

/// Mean and its standard error.
fn estimate(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
    (mean, (square / (n * (n - 1.0))).sqrt())
}
