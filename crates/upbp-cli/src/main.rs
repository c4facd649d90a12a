//! The program `upbp`: renders scene files, and puts slices of a render together.

mod exit;
mod files;
mod merge;
mod render;
mod threads;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Renders light in participating media: photon points, photon beams and bidirectional paths in one estimate.
#[derive(Debug, Parser)]
#[command(version, about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Render(render::Options),
    Merge(merge::Options),
}

fn main() -> ExitCode {
    exit::finish(match &Cli::parse().command {
        Command::Render(options) => render::run(options),
        Command::Merge(options) => merge::run(options),
    })
}
