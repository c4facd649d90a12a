//! `upbp render`: renders a scene file.

mod bar;
mod interrupt;
mod options;
mod progress;

use std::error::Error;
use std::num::NonZeroUsize;
use std::path::Path;

use upbp_core::{
    OutputError, Preparing, RenderError, RenderPlan, Renderer, Settings, Start, State, StateError,
    StopReason, check_outputs, check_writable, read_exr, read_text, remove_leftovers, write_text,
};
use upbp_scene::ReadyScene;

use crate::exit::{Failure, complain, say};
use crate::files;
use bar::Bar;
pub(crate) use options::Options;
use progress::{Beside, render};

pub(crate) fn run(options: &Options) -> Result<(), Failure> {
    // A pool of its own: reading the scene works in parallel too.
    let threads = options.threads.map_or(0, NonZeroUsize::get);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(Failure::input)?;
    pool.install(|| run_in_pool(options))
}

fn run_in_pool(options: &Options) -> Result<(), Failure> {
    let canceller = interrupt::install().map_err(Failure::input)?;
    let path = options.scene.clone();
    let settings = options.settings().map_err(Failure::input)?.validate().map_err(Failure::input)?;
    let scene = load(&path, options).map_err(Failure::input)?;
    let outputs = options.outputs();
    let read = scene.files().iter().map(|file| ("a mesh or an image of the scene", file.as_path()));
    let inputs: Vec<_> =
        [("the scene", path.as_path())].into_iter().chain(options.inputs()).chain(read).collect();
    check_outputs(&outputs, &inputs).map_err(Failure::input)?;
    if !options.check {
        // Before the work, not after it.
        for output in outputs {
            check_writable(output.path).map_err(Failure::input)?;
            remove_leftovers(output.path);
        }
    }
    let reference = options.reference.as_deref().map(read_exr).transpose().map_err(Failure::input)?;
    let plan = options.plan.as_deref().map(read_plan).transpose().map_err(Failure::Input)?;
    let bar = Bar::on_stderr(options.quiet || options.check);
    let mut show = |now: Preparing| bar.prepare(now.step);
    let start = Start { plan, canceller, seconds: options.stop().seconds, progress: Some(&mut show) };
    let mut renderer = scene.start_renderer(settings, start).map_err(|error| match error {
        RenderError::Cancelled => Failure::Interrupted(format!("interrupted: {error}")),
        error => Failure::input(error),
    })?;
    renderer
        .identify_scene(&format!("{} ({:016x})", path.display(), scene.hash()), &scene.hash().to_le_bytes());
    let rect = renderer.film().rect();
    if let (Some(reference), Some(name)) = (&reference, &options.reference)
        && (reference.width, reference.height) != (rect.width, rect.height)
    {
        return Err(Failure::Input(format!(
            "{}: expected a reference of {} x {} pixels, found {} x {}",
            name.display(),
            rect.width,
            rect.height,
            reference.width,
            reference.height
        )));
    }
    if let Some(state) = &options.state {
        resume(&mut renderer, state).map_err(Failure::input)?;
    }
    if let Some(range) = options.range() {
        renderer.set_range(range);
    }
    if options.check {
        return say(&format!("{}: no problems; {}", path.display(), renderer.census()));
    }
    if options.is_lost_share() && !options.quiet {
        complain("note: without --state these iterations cannot be merged with others");
    }

    let beside = Beside {
        reference: reference.as_ref(),
        state: options.state.as_deref().map(|path| (path, options.save_every())),
        bar,
    };
    let reason = render(&mut renderer, &options.stop(), beside);
    write(renderer.state(), reason, options)
}

fn read_plan(path: &Path) -> Result<RenderPlan, String> {
    let text = read_text(path).map_err(|error| format!("cannot read {}: {error}", path.display()))?;
    RenderPlan::from_ron(&text).map_err(|error| format!("{}:{error}", path.display()))
}

/// Goes on from a state file, if there is one.
fn resume(renderer: &mut Renderer<'_>, path: &Path) -> Result<(), OutputError> {
    match State::load(path) {
        Err(OutputError::State { source: StateError::Io(error), .. })
            if error.kind() == std::io::ErrorKind::NotFound =>
        {
            Ok(())
        }
        Err(error) => Err(error),
        Ok(state) => {
            renderer.resume(state).map_err(|source| OutputError::State { path: path.to_owned(), source })
        }
    }
}

/// Writes everything that was asked for, the state first. What fails does not keep the rest from being written.
fn write(state: &State, reason: StopReason, options: &Options) -> Result<(), Failure> {
    let mut failures = Vec::new();
    let mut attempt = |written: Result<(), OutputError>| failures.extend(written.err());
    if let Some(path) = &options.state {
        attempt(state.save(path));
    }
    if let Some(path) = &options.save_plan {
        attempt(write_text(path, &state.identity().plan.to_string()));
    }
    let report = state.report();
    // Before the first pixels there is no picture.
    let rendered = !state.film().is_empty();
    if rendered {
        attempt(options.output.write(state, &report));
    }
    if let Some(path) = &options.report {
        attempt(files::write_report(&report, path));
    }
    Failure::all(&failures)?;
    if !options.quiet {
        let wrote = if rendered {
            let names: Vec<_> =
                options.output.outputs().map(|file| file.path.display().to_string()).collect();
            format!("wrote {}", names.join(" and "))
        } else {
            "nothing was rendered: the light sub-paths of the first iteration were not done (--time, --light-paths)"
                .to_owned()
        };
        say(&format!("{report}{wrote}"))?;
    }
    if reason == StopReason::Cancelled {
        let kept = match &options.state {
            Some(path) => format!("the state is in {}", path.display()),
            None => "without --state there is nothing to go on from".to_owned(),
        };
        return Err(Failure::Interrupted(format!(
            "interrupted after {} iterations; {kept}",
            report.iterations
        )));
    }
    Ok(())
}

fn load(path: &Path, options: &Options) -> Result<ReadyScene, upbp_scene::SceneError> {
    ReadyScene::load_with(path, |description| {
        if let Some([width, height]) = options.size {
            description.film.width = width;
            description.film.height = height;
            description.film.crop = None;
        }
    })
}

impl Options {
    /// The settings file, if any, with what the command line says on top.
    fn settings(&self) -> Result<Settings, Box<dyn Error>> {
        let mut settings = match &self.settings {
            None => Settings::default(),
            Some(path) => {
                let text =
                    read_text(path).map_err(|error| format!("cannot read {}: {error}", path.display()))?;
                Settings::from_ron(&text).map_err(|error| format!("{}:{error}", path.display()))?
            }
        };
        self.apply(&mut settings);
        Ok(settings)
    }
}
