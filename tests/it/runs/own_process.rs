//! Tests that need a process of their own, where no other test is counted.

use std::env;
use std::process::Command;

/// Variable that holds the case that a process of its own is for.
const CASE: &str = "UPBP_OWN_PROCESS";

/// The case that this process is for, if it is one that [`run`] started.
pub(crate) fn case() -> Option<String> {
    env::var(CASE).ok()
}

/// Runs a test of this program, given by its full name, in a process of its own that gets the case and the
/// variables. Returns the output; if the test fails there, it fails here.
pub(crate) fn run(test: &str, case: &str, variables: &[(&str, &str)]) -> String {
    let output = Command::new(env::current_exe().expect("this program"))
        .args(["--nocapture", "--exact", test])
        .envs(variables.iter().copied())
        .env(CASE, case)
        .output()
        .expect("this program runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    // A wrong name would be a test that never fails.
    assert!(text.contains("1 passed"), "no test is called {test}: {text}");
    text
}
