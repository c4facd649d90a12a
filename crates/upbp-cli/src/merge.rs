//! `upbp merge`: puts the states of several runs of one render together.
//!
//! `upbp merge a.state b.state --state whole.state -o whole.exr` merges states with disjoint
//! iterations, in any order, to the bits of a single run. Without an output it says what the states hold.

use std::path::{Path, PathBuf};

use clap::{Args, ValueHint};
use upbp_core::{Content, Output, OutputError, State, check_outputs};

use crate::exit::{Failure, Failures, say};
use crate::files::{self, Images, Look};

#[derive(Debug, Args)]
pub(crate) struct Options {
    /// State files, of the same scene and settings
    #[arg(required = true, value_name = "STATE", value_hint = ValueHint::FilePath)]
    states: Vec<PathBuf>,
    /// File to save the merged state to: it can be merged again, and resumed
    #[arg(long, value_name = "FILE.state", value_parser = files::path(files::state), value_hint = ValueHint::FilePath)]
    state: Option<PathBuf>,
    /// Write the report as JSON
    #[arg(long, value_name = "FILE.json", value_parser = files::path(files::report), value_hint = ValueHint::FilePath)]
    report: Option<PathBuf>,
    /// Print nothing but warnings and errors
    #[arg(long)]
    quiet: bool,
    #[command(flatten)]
    image: ImageOptions,
}

#[derive(Debug, Args)]
#[command(
    next_help_heading = "Image",
    mut_arg("exposure", |exposure| exposure.requires("output")),
    mut_arg("tone", |tone| tone.requires("output"))
)]
struct ImageOptions {
    /// Image to write: OpenEXR, and a PNG of the same name beside it; or OUT.png, a PNG alone
    #[arg(short, long, value_name = "OUT.exr", value_parser = files::path(Images::named), value_hint = ValueHint::FilePath)]
    output: Option<Images>,
    #[command(flatten)]
    look: Look,
}

impl Options {
    /// All files that are written.
    fn outputs(&self) -> Vec<Output<'_>> {
        let others =
            [("the state", &self.state, Content::State), ("the report", &self.report, Content::Report)];
        let others = others
            .into_iter()
            .filter_map(|(role, path, content)| Some(Output { role, path: path.as_deref()?, content }));
        self.image.output.iter().flat_map(Images::outputs).chain(others).collect()
    }
}

pub(crate) fn run(options: &Options) -> Result<(), Failure> {
    let outputs = options.outputs();
    let inputs: Vec<_> = options.states.iter().map(|path| ("a state to merge", path.as_path())).collect();
    check_outputs(&outputs, &inputs).map_err(Failure::input)?;
    let (merged, parts) = merge(&options.states, options.quiet)?;
    if options.image.output.is_some() && merged.film().is_empty() {
        return Err(Failure::Input("there is no picture in the states yet: no pixel is rendered".to_owned()));
    }
    let report = merged.report();
    let mut failures = Failures::default();
    if let Some(path) = &options.state {
        failures.note(merged.save(path));
    }
    let mut hint = None;
    if let Some(images) = &options.image.output {
        hint = images.write_render(&merged, &report, options.image.look.tones(), &mut failures);
    }
    if let Some(path) = &options.report {
        failures.note(files::write_report(&report, path));
    }
    failures.all()?;
    // Last, since nobody may be reading.
    if options.quiet {
        files::warn(&report);
    } else {
        say(&format!("{parts}{}", report.to_string().trim_end()))?;
        if let Some(hint) = hint {
            say(&hint)?;
        }
    }
    Ok(())
}

/// Reads and merges one after the other: two films are in memory at most. Comes with a line about each,
/// unless it is to be quiet.
fn merge(paths: &[PathBuf], quiet: bool) -> Result<(State, String), Failure> {
    let (mut merged, mut parts) = (None::<State>, String::new());
    for path in paths {
        let state = State::load(path).map_err(Failure::input)?;
        if !quiet {
            parts += &describe(path, &state);
        }
        match &mut merged {
            None => merged = Some(state),
            Some(merged) => merged
                .merge(state)
                .map_err(|source| OutputError::State { path: path.clone(), source })
                .map_err(Failure::input)?,
        }
    }
    merged.map(|merged| (merged, parts)).ok_or_else(|| Failure::Input("no state".to_owned()))
}

fn describe(path: &Path, state: &State) -> String {
    let film = state.film();
    let mut iterations = film.iteration_set().to_string();
    let begun = film.begun().into_iter();
    iterations.extend(begun.map(|(iteration, share)| format!(" and {:.0} % of {iteration}", 100.0 * share)));
    let (path, scene) = (path.display(), &state.identity().scene);
    format!("{path}: {scene}, iterations {iterations}, film {}\n", film.fingerprint())
}
