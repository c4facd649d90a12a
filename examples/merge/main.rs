//! Puts the states of several runs of one render together.
//!
//! `cargo run --release --example merge -- a.state b.state --state whole.state -o whole.exr` merges states with disjoint
//! iterations, in any order, to the bits of a single run. Without an output it says what the states hold.

#[path = "../support/exit.rs"]
mod exit;
#[path = "../support/files.rs"]
mod files;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use upbp_core::{OutputError, State, check_writable};

use exit::{Failure, finish, say};

/// Merges states of one render with disjoint iterations, in any order, to the bits of a single run.
#[derive(Debug, Parser)]
#[command(version, about)]
struct Options {
    /// State files, of the same scene and settings
    #[arg(required = true, value_name = "STATE")]
    states: Vec<PathBuf>,
    /// Where to save the merged state: it can be merged again, and resumed
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,
    /// Image to write, OpenEXR; a PNG of the same name is written beside it
    #[arg(short, long, value_name = "OUT.exr")]
    output: Option<PathBuf>,
    /// Write the report as JSON
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    /// Print nothing but errors
    #[arg(long)]
    quiet: bool,
}

fn main() -> ExitCode {
    finish(run(&Options::parse()))
}

fn run(options: &Options) -> Result<(), Failure> {
    let picture = options.output.as_deref().map(files::picture);
    for output in [&options.state, &options.output, &picture, &options.report].into_iter().flatten() {
        check_writable(output).map_err(Failure::input)?;
    }
    let merged = merge(&options.states, options.quiet)?;
    let report = merged.report();
    let mut failures = Vec::new();
    let mut attempt = |written: Result<(), OutputError>| failures.extend(written.err());
    if let Some(path) = &options.state {
        attempt(merged.save(path));
    }
    if let Some(path) = &options.output {
        attempt(files::write_images(&merged, &report, path));
    }
    if let Some(path) = &options.report {
        attempt(files::write_report(&report, path));
    }
    Failure::all(&failures)?;
    if !options.quiet {
        say(report.to_string().trim_end())?;
    }
    Ok(())
}

/// Reads and merges one after the other: two films are in memory at most.
fn merge(paths: &[PathBuf], quiet: bool) -> Result<State, Failure> {
    let mut merged: Option<State> = None;
    for path in paths {
        let state = State::load(path).map_err(Failure::input)?;
        if !quiet {
            describe(path, &state)?;
        }
        match &mut merged {
            None => merged = Some(state),
            Some(merged) => merged
                .merge(state)
                .map_err(|source| OutputError::State { path: path.clone(), source })
                .map_err(Failure::input)?,
        }
    }
    merged.ok_or_else(|| Failure::Input("no state".to_owned()))
}

fn describe(path: &Path, state: &State) -> Result<(), Failure> {
    let film = state.film();
    say(&format!(
        "{}: {}, iterations {}, film {}",
        path.display(),
        state.identity().scene,
        film.iteration_set(),
        film.fingerprint()
    ))
}
