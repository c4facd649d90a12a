//! How the program ends: messages and exit codes.

use std::error::Error;
use std::io::{self, Write};
use std::process::ExitCode;

use upbp_core::OutputError;

/// Why a program did not do what it was asked for.
pub(crate) enum Failure {
    /// Scene, settings, options or a state that cannot be used. Nothing was rendered, no file was written.
    Input(String),
    /// A file or the standard output that could not be written.
    Output(String),
    /// A signal. What was done is saved if there is a state file.
    Interrupted(String),
}

impl Failure {
    /// The code of `sysexits.h` where there is one. 75 says to a queue: try again.
    fn code(&self) -> u8 {
        match self {
            Self::Input(_) => 2,
            Self::Output(_) => 74,
            Self::Interrupted(_) => 75,
        }
    }

    pub(crate) fn input(error: impl Into<Box<dyn Error>>) -> Self {
        Self::Input(describe(&*error.into()))
    }

    /// One failure of all that could not be written.
    pub(crate) fn all(failures: &[OutputError]) -> Result<(), Self> {
        let messages: Vec<_> = failures.iter().map(|error| describe(error)).collect();
        if messages.is_empty() { Ok(()) } else { Err(Self::Output(messages.join("\nerror: "))) }
    }
}

/// An error with all its causes.
pub(crate) fn describe(error: &dyn Error) -> String {
    match error.source() {
        Some(cause) => format!("{error}\n  because: {}", describe(cause)),
        None => error.to_string(),
    }
}

/// Prints a failure, and gives the exit code.
pub(crate) fn finish(result: Result<(), Failure>) -> ExitCode {
    let Err(failure) = result else { return ExitCode::SUCCESS };
    match &failure {
        Failure::Input(message) | Failure::Output(message) => complain(&format!("error: {message}")),
        Failure::Interrupted(message) => complain(message),
    }
    ExitCode::from(failure.code())
}

/// Prints to the standard error; if nobody reads it, nothing can be done.
pub(crate) fn complain(text: &str) {
    let _ = writeln!(io::stderr(), "{text}");
}

/// Prints to the standard output.
pub(crate) fn say(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout();
    writeln!(out, "{text}")
        .and_then(|()| out.flush())
        .map_err(|error| Failure::Output(format!("cannot write to the standard output: {error}")))
}
