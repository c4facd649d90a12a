//! `upbp render` and `upbp check`: a scene and its options are read; what follows is a render, or nothing.

mod bar;
mod interrupt;
mod options;
mod progress;

use std::path::Path;

use upbp_core::{
    Canceller, CheckedSettings, Film, FrozenPlan, Image, OutputError, Preparing, RenderError, Renderer,
    Report, Start, State, StateError, Stop, StopReason, check_outputs, read_exr, read_text, remove_leftovers,
    write_text,
};
use upbp_scene::{ReadyScene, SceneError};

use crate::exit::{Failure, Failures, complain, say};
use crate::files::{self, Images};
use bar::Bar;
pub(crate) use options::{Options, names};
use progress::{Beside, render};

/// Renders a scene file: `upbp render`.
pub(crate) fn run(options: &Options) -> Result<(), Failure> {
    in_pool(options, || {
        let canceller = interrupt::install().map_err(Failure::input)?;
        let job = Job::read(options)?;
        for output in options.outputs(&job.images) {
            remove_leftovers(output.path);
        }
        let bar = Bar::on_stderr(options.messages.quiet);
        let mut renderer = job.start(options, canceller, &bar)?;
        if options.is_lost_share() && !options.messages.quiet {
            complain("note: without --state these iterations cannot be merged with others");
        }
        let beside =
            Beside { state: options.saving.state.as_deref().map(|path| (path, options.save_every())), bar };
        let done = |film: &Film| (film.iterations(), film.begun());
        let before = done(renderer.film());
        let reason = render(&mut renderer, &options.stop(), beside);
        if done(renderer.film()) == before && !renderer.film().is_empty() && !options.messages.quiet {
            explain_nothing(reason, renderer.state());
        }
        write(renderer.state(), reason, options, &job.images)
    })
}

/// Says why nothing was rendered, if it is since the state has all that was asked for.
fn explain_nothing(reason: StopReason, state: &State) {
    let (has, advice) = match reason {
        StopReason::Iterations => {
            (format!("has the iterations {}", state.film().iteration_set()), "give others by `--iterations`")
        }
        StopReason::Time => {
            (format!("has {:.1} s of rendering", state.seconds().total()), "give a longer `--time`")
        }
        StopReason::Error => ("is below `--target-error`".to_owned(), "give a smaller one"),
        _ => return,
    };
    complain(&format!("note: nothing was rendered, since the state {has} already: {advice}"));
}

/// Does everything that comes before the first iteration, and writes what is known then: `upbp check`.
pub(crate) fn check(options: &Options) -> Result<(), Failure> {
    in_pool(options, || {
        let canceller = interrupt::install().map_err(Failure::input)?;
        let job = Job::read(options)?;
        let renderer = job.start(options, canceller, &Bar::on_stderr(true))?;
        let (report, mut failures) = (renderer.report(), Failures::default());
        write_texts(renderer.state(), &report, options, &mut failures);
        failures.all()?;
        if options.messages.quiet {
            return Ok(());
        }
        let Report { support, plan, .. } = report;
        say(&format!("{}: no problems; {support}\nplan: {plan}", options.scene.display()))
    })
}

/// Runs `work` in a pool of the threads that were asked for: reading the scene works in parallel too.
fn in_pool(options: &Options, work: impl FnOnce() -> Result<(), Failure> + Send) -> Result<(), Failure> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads()).build();
    pool.map_err(Failure::input)?.install(work)
}

/// Everything that a render reads, except the state, and the images that it writes.
struct Job {
    scene: ReadyScene,
    settings: CheckedSettings,
    reference: Option<Image>,
    plan: Option<FrozenPlan>,
    images: Images,
}

impl Job {
    /// Reads all files, and checks before the work that outputs can be written and none would destroy a file.
    fn read(options: &Options) -> Result<Self, Failure> {
        let settings = options.settings().map_err(Failure::input)?.validate().map_err(Failure::input)?;
        let scene = load(options).map_err(Failure::input)?;
        let images = options.images();
        let files =
            scene.files().iter().map(|file| ("a mesh, an image or a table of the scene", file.as_path()));
        let inputs: Vec<_> = options.inputs().chain(files).collect();
        let outputs = options.outputs(&images);
        check_outputs(&outputs, &inputs).map_err(Failure::input)?;
        if !options.messages.quiet {
            options.explain_idle(&settings, &images);
        }
        let reference =
            options.messages.reference.as_deref().map(read_exr).transpose().map_err(Failure::input)?;
        let plan = options.method.plan.as_deref().map(read_plan).transpose().map_err(Failure::Input)?;
        Ok(Self { scene, settings, reference, plan, images })
    }

    /// Prepares the render, and goes on from its state if there is one.
    fn start(&self, options: &Options, canceller: Canceller, bar: &Bar) -> Result<Renderer<'_>, Failure> {
        let mut show = |now: Preparing| bar.prepare(now.step);
        let state = options.saving.state.as_deref();
        let state = state.map(read_state).transpose().map_err(Failure::input)?.flatten();
        // A render that goes on does not choose again.
        let plan = self.plan.clone().or_else(|| state.as_ref().map(|state| state.identity().frozen_plan()));
        let stop = Stop { iterations: options.range().map(|range| range.end), ..options.stop() };
        let reference = self.reference.clone();
        let start = Start { plan, canceller, stop, reference, progress: Some(&mut show) };
        let renderer = self.scene.start_renderer(self.settings.clone(), start);
        let mut renderer = renderer.map_err(|error| match error {
            RenderError::Cancelled => Failure::Interrupted(format!("interrupted: {error}")),
            RenderError::Reference { .. } => {
                let name = options.messages.reference.as_deref().unwrap_or(Path::new("reference"));
                Failure::Input(format!("{}: {error}", name.display()))
            }
            RenderError::Memory { .. } | RenderError::PlanMemory { .. } => {
                Failure::Input(format!("{error} (at the command line: `--memory MIB`)"))
            }
            error => Failure::input(error),
        })?;
        let hash = self.scene.hash();
        renderer.identify_scene(&format!("{} ({hash:016x})", options.scene.display()), &hash.to_le_bytes());
        if let (Some(state), Some(path)) = (state, &options.saving.state) {
            let resumed = renderer.resume(state);
            resumed.map_err(|source| Failure::input(OutputError::State { path: path.clone(), source }))?;
        }
        if let Some(range) = options.range() {
            renderer.set_range(range);
        }
        Ok(renderer)
    }
}

fn load(options: &Options) -> Result<ReadyScene, SceneError> {
    let scene = ReadyScene::load_with(&options.scene, |description| {
        if let Some([width, height]) = options.image.size {
            description.film.width = width;
            description.film.height = height;
            description.film.crop = None;
        }
        if let Some(crop) = options.image.crop {
            description.film.crop = Some(crop);
        }
    })?;
    if !options.messages.quiet {
        for note in scene.notes() {
            complain(&format!("note: {note}"));
        }
    }
    Ok(scene)
}

fn read_plan(path: &Path) -> Result<FrozenPlan, String> {
    let text = read_text(path).map_err(|error| format!("cannot read {}: {error}", path.display()))?;
    FrozenPlan::from_ron(&text).map_err(|error| format!("{}:{error}", path.display()))
}

/// Reads a state file, if there is one that is not empty.
fn read_state(path: &Path) -> Result<Option<State>, OutputError> {
    if path.metadata().is_ok_and(|metadata| metadata.is_file() && metadata.len() == 0) {
        return Ok(None);
    }
    match State::load(path) {
        Err(OutputError::State { source: StateError::Io(error), .. })
            if error.kind() == std::io::ErrorKind::NotFound =>
        {
            Ok(None)
        }
        state => state.map(Some),
    }
}

/// Writes the plan and the report, if they were asked for.
fn write_texts(state: &State, report: &Report, options: &Options, failures: &mut Failures) {
    if let Some(path) = &options.method.save_plan {
        failures.note(write_text(path, &state.identity().frozen_plan().to_ron()));
    }
    if let Some(path) = &options.messages.report {
        failures.note(files::write_report(report, path));
    }
}

/// Writes everything that was asked for, the state first. What fails does not keep the rest from being
/// written.
fn write(state: &State, reason: StopReason, options: &Options, images: &Images) -> Result<(), Failure> {
    let mut failures = Failures::default();
    if let Some(path) = &options.saving.state {
        failures.note(state.save(path));
    }
    let report = state.report();
    write_texts(state, &report, options, &mut failures);
    // Before the first pixels there is no picture.
    let rendered = !state.film().is_empty();
    let mut hint = None;
    if rendered {
        hint = images.write_render(state, &report, options.image.look.tones(), &mut failures);
    }
    failures.all()?;
    // Whoever asked for a picture is not to take an older one for it.
    if !rendered {
        complain("warning: no picture: the light sub-paths of the first iteration were not done");
    }
    let mut said = Ok(());
    if options.messages.quiet {
        files::warn(&report);
    } else {
        let wrote = if rendered { format!("wrote {}", images.names()) } else { String::new() };
        said =
            say(format!("{report}{wrote}").trim_end()).and_then(|()| hint.map_or(Ok(()), |hint| say(&hint)));
    }
    // Said even if nobody reads the rest.
    if reason == StopReason::Cancelled {
        let kept = match &options.saving.state {
            Some(path) => format!("the state is in {}", path.display()),
            None => "without --state there is nothing to go on from".to_owned(),
        };
        return Err(Failure::Interrupted(format!(
            "interrupted after {} iterations; {kept}",
            report.iterations
        )));
    }
    said
}
