//! The program `upbp`: renders scene files, puts slices of a render together, and compares images.

mod compare;
mod exit;
mod files;
#[cfg(test)]
mod help_page;
mod merge;
mod render;

use std::process::ExitCode;

use clap::{CommandFactory as _, Parser, Subcommand};
use clap_complete::Shell;

use exit::{Failure, finish, say, say_bytes};

/// Renders light in participating media: photon points, photon beams and bidirectional paths in one estimate
#[derive(Debug, Parser)]
#[command(name = "upbp", version, arg_required_else_help = true, after_help = exit::codes())]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene file
    ///
    /// Renders until the first limit is reached; a signal ends the render in good order. No output overwrites
    /// a file that the render reads, another output, or a file of another kind.
    #[command(after_long_help = render::names())]
    Render(Box<render::Options>),
    /// Check the scene and all options of a render, and render nothing
    ///
    /// Takes the options of `upbp render`, reads and checks all that they name, and says how the scene would
    /// be rendered: a command line is checked by replacing one word. Of the outputs it writes the plan and
    /// the report.
    #[command(after_long_help = render::names())]
    Check(Box<render::Options>),
    /// Put slices of a render together
    ///
    /// Merges states of one render with disjoint iterations, in any order, to the bits of a single run.
    /// Without an output it says what the states hold.
    Merge(merge::Options),
    /// Compare an image with a reference
    ///
    /// Reads any OpenEXR images with the channels R, G, B, and prints the means of both and how far they are
    /// apart: pixel by pixel, and in blocks of 8 x 8 pixels, where noise is averaged out and what is too
    /// bright or too dark everywhere remains. Pixels that are not finite in either are left out and counted.
    Compare(compare::Options),
    /// Print the scene format
    ///
    /// All that a scene file may hold, with examples and defaults, as Markdown: `upbp format | less`.
    Format,
    /// Print the completions of a shell
    ///
    /// For bash: `mkdir -p ~/.local/share/bash-completion/completions && upbp completions bash >
    /// ~/.local/share/bash-completion/completions/upbp`.
    Completions {
        /// The shell
        shell: Shell,
    },
}

fn main() -> ExitCode {
    finish(match &Cli::parse().command {
        Command::Render(options) => render::run(options),
        Command::Check(options) => render::check(options),
        Command::Merge(options) => merge::run(options),
        Command::Compare(options) => compare::run(options),
        Command::Format => say(upbp_scene::scene_format().trim_end()),
        Command::Completions { shell } => completions(*shell),
    })
}

fn completions(shell: Shell) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "upbp", &mut script);
    say_bytes(&script)
}
