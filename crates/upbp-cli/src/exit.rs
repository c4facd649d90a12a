//! Ends of the program: messages and exit codes.

use std::error::Error;
use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::process::ExitCode;

use upbp_core::{OutputError, describe};

/// A reason for not doing what the command line asks for.
pub(crate) enum Failure {
    /// Scene, settings, options or a state that cannot be used. Nothing was rendered, no file was written.
    Input(String),
    /// A file or the standard output that could not be written.
    Output(String),
    /// A signal. What was done is saved if there is a state file.
    Interrupted(String),
}

// Those of `sysexits.h` where there is one; 75 says to a queue: try again.
const INPUT: u8 = 2;
const OUTPUT: u8 = 74;
const INTERRUPTED: u8 = 75;
/// Exit code after a second signal: that of shells for SIGINT.
pub(crate) const AT_ONCE: u8 = 130;

impl Failure {
    /// Makes a failure of an error in what the program reads.
    pub(crate) fn input(error: impl Into<Box<dyn Error>>) -> Self {
        Self::Input(describe(&*error.into()))
    }
}

/// Messages about files that could not be written; none keeps the others from being written.
#[derive(Default)]
pub(crate) struct Failures(Vec<String>);

impl Failures {
    /// Takes note of what came of writing a file.
    pub(crate) fn note(&mut self, written: Result<(), OutputError>) {
        self.0.extend(written.err().map(|error| describe(&error)));
    }

    /// Makes one failure of all, if there are any.
    pub(crate) fn all(self) -> Result<(), Failure> {
        if self.0.is_empty() { Ok(()) } else { Err(Failure::Output(self.0.join("\nerror: "))) }
    }
}

/// All exit codes, for the help.
pub(crate) fn codes() -> String {
    let codes = [
        (0, "done"),
        (
            INPUT,
            "bad input: options, scene, settings, a state or an image that cannot be used, an output that cannot be \
             written from the start or would destroy a file; nothing was rendered, no file was written",
        ),
        (
            OUTPUT,
            "a file or the standard output failed later: a disk is full, a folder has gone; everything else was \
             written, the state first",
        ),
        (INTERRUPTED, "interrupted by a signal; what was done is in the --state, if there is one: try again"),
        (AT_ONCE, "ended at once by a second signal, SIGINT or SIGTERM"),
    ];
    list("Exit codes", &codes.map(|(code, meaning)| (code.to_string(), meaning)))
}

/// A list for the help, 80 columns wide.
pub(crate) fn list(title: &str, rows: &[(impl AsRef<str>, &str)]) -> String {
    let indent = rows.iter().map(|(name, _)| name.as_ref().len()).max().unwrap_or_default() + 4;
    let mut text = format!("{title}:");
    for (name, meaning) in rows {
        let _ = write!(text, "\n  {:indent$}", name.as_ref(), indent = indent - 2);
        let mut column = indent;
        for (n, word) in meaning.split(' ').enumerate() {
            if n > 0 && column + 1 + word.len() > 80 {
                let _ = write!(text, "\n{:indent$}", "");
                column = indent;
            } else if n > 0 {
                text.push(' ');
                column += 1;
            }
            text.push_str(word);
            column += word.len();
        }
    }
    text
}

/// Prints a failure, and gives the exit code.
pub(crate) fn finish(result: Result<(), Failure>) -> ExitCode {
    let Err(failure) = result else { return ExitCode::SUCCESS };
    let (code, message) = match failure {
        Failure::Input(message) => (INPUT, format!("error: {message}")),
        Failure::Output(message) => (OUTPUT, format!("error: {message}")),
        Failure::Interrupted(message) => (INTERRUPTED, message),
    };
    complain(&message);
    ExitCode::from(code)
}

/// Prints to the standard error; if nobody reads it, nothing can be done.
pub(crate) fn complain(text: &str) {
    let _ = writeln!(io::stderr(), "{text}");
}

/// Prints a line to the standard output.
pub(crate) fn say(text: &str) -> Result<(), Failure> {
    say_bytes(format!("{text}\n").as_bytes())
}

/// Prints to the standard output.
pub(crate) fn say_bytes(text: &[u8]) -> Result<(), Failure> {
    let mut out = io::stdout();
    out.write_all(text)
        .and_then(|()| out.flush())
        .map_err(|error| Failure::Output(format!("cannot write to the standard output: {error}")))
}
