//! Renders a scene file with every technique.
//!
//! `cargo run --release --example cornell_media` renders the shipped scene; `-- --help` lists the options.

mod options;

use std::error::Error;
use std::io::IsTerminal;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use upbp_core::{
    ErrorPoint, Image, Metadata, Progress, Renderer, Settings, Stop, check_writable, read_exr, write_exr,
    write_png,
};
use upbp_scene::ReadyScene;

use options::Options;

/// Exit code for input that cannot be rendered and output that cannot be written.
const BAD_INPUT: u8 = 2;

fn main() -> ExitCode {
    let options = Options::parse();
    // A pool of its own: reading the scene works in parallel too.
    let threads = options.threads.map_or(0, NonZeroUsize::get);
    let result = match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool.install(|| run(&options).map_err(|error| describe(&*error))),
        Err(error) => Err(error.to_string()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::from(BAD_INPUT)
        }
    }
}

/// An error with all its causes.
fn describe(error: &dyn Error) -> String {
    match error.source() {
        Some(cause) => format!("{error}\n  because: {}", describe(cause)),
        None => error.to_string(),
    }
}

fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    let path = options.scene.clone().unwrap_or_else(shipped_scene);
    let settings = options.settings()?;
    let scene = ReadyScene::load_with(&path, |description| {
        if let Some([width, height]) = options.size {
            description.film.width = width;
            description.film.height = height;
            description.film.crop = None;
        }
    })?;
    let reference = options.reference.as_deref().map(read_exr).transpose()?;
    let mut renderer = Renderer::new(&scene, settings.clone().validate()?)?;
    if let Some(reference) = &reference {
        let rect = renderer.film().rect();
        if (reference.width, reference.height) != (rect.width, rect.height) {
            return Err(format!(
                "{}: expected a reference of {} x {} pixels, found {} x {}",
                options.reference.as_deref().unwrap_or(Path::new("")).display(),
                rect.width,
                rect.height,
                reference.width,
                reference.height
            )
            .into());
        }
    }
    if options.check {
        println!("{}: no problems; {}", path.display(), renderer.census());
        return Ok(());
    }
    // Before the work, not after it.
    let picture = options.output.with_extension("png");
    let outputs = [Some(options.output.as_path()), Some(picture.as_path()), options.report.as_deref()];
    outputs.into_iter().flatten().try_for_each(check_writable)?;

    render(&mut renderer, &options.stop(), reference.as_ref(), options.quiet);

    let report = renderer.report();
    let name = format!("{} ({:016x})", path.display(), scene.hash());
    let metadata = Metadata { scene: &name, settings: &settings, report: &report };
    write_exr(&options.output, renderer.film(), &metadata)?;
    write_png(&picture, &renderer.film().image(), 1.0)?;
    if let Some(path) = &options.report {
        let text = serde_json::to_string_pretty(&report)? + "\n";
        std::fs::write(path, text).map_err(|error| format!("cannot write {}: {error}", path.display()))?;
    }
    if !options.quiet {
        println!("{report}wrote {} and {}", options.output.display(), picture.display());
    }
    Ok(())
}

fn render(renderer: &mut Renderer<'_, ReadyScene>, stop: &Stop, reference: Option<&Image>, quiet: bool) {
    let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new(1000) };
    if let Ok(style) = ProgressStyle::with_template("[{elapsed_precise}] {bar:40} {percent:>3} %  {msg}") {
        bar.set_style(style);
    }
    // Iterations take seconds: the clock moves meanwhile.
    bar.enable_steady_tick(std::time::Duration::from_millis(200));
    let terminal = std::io::stderr().is_terminal();
    let mut points = Vec::new();
    renderer.render(stop, |now: &Progress<'_>| {
        if let Some(reference) = reference {
            let image = now.film.image();
            points.push(ErrorPoint {
                seconds: now.seconds,
                iterations: now.iterations,
                relative_mse: image.relative_mse(reference),
                rmse: image.rmse(reference),
            });
        }
        let message = status(now);
        bar.set_position((1000.0 * now.fraction) as u64);
        bar.set_message(message.clone());
        // Without a terminal a bar is invisible: a line now and then instead.
        if !terminal && !quiet && now.iterations.is_power_of_two() {
            eprintln!("{:3.0} %  {message}", 100.0 * now.fraction);
        }
        ControlFlow::Continue(())
    });
    bar.finish();
    for point in points {
        renderer.record_error(point);
    }
}

/// Iterations, time left, and the error so far.
fn status(now: &Progress<'_>) -> String {
    let left = if now.fraction > 0.0 { now.seconds * (1.0 / now.fraction - 1.0) } else { f64::INFINITY };
    let error = if now.estimated_error.is_finite() {
        format!("estimated relMSE {:.2e}", now.estimated_error)
    } else {
        "error not known yet".to_owned()
    };
    format!("iteration {}, {left:.0} s left, {error}", now.iterations)
}

/// The scene that comes with the project, from wherever the program is started.
fn shipped_scene() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes/cornell_media.ron")
}

impl Options {
    /// The settings file, if any, with what the command line says on top.
    fn settings(&self) -> Result<Settings, Box<dyn Error>> {
        let mut settings = match &self.settings {
            None => Settings::default(),
            Some(path) => {
                let text = std::fs::read_to_string(path)
                    .map_err(|error| format!("cannot read {}: {error}", path.display()))?;
                Settings::from_ron(&text).map_err(|error| format!("{}:{error}", path.display()))?
            }
        };
        self.apply(&mut settings);
        Ok(settings)
    }
}
