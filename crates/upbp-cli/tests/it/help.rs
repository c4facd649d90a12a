//! The first things that a newcomer sees: help, completions, and errors that say how to go on.

use std::path::Path;
use std::process::Command;

use crate::program;

/// The exit code, the standard output and the standard error.
fn run(arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_upbp")).args(arguments).output().expect("the program runs");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[test]
fn the_help_names_commands_groups_and_exit_codes() {
    let (code, help, _) = run(&["help"]);
    assert_eq!(code, Some(0));
    for word in ["render", "check", "merge", "compare", "format", "completions", "Exit codes:", "75", "130"] {
        assert!(help.contains(word), "{word}: {help}");
    }
    // The same without a word, as an error.
    assert_eq!(run(&[]), (Some(2), String::new(), help));
    let (_, help, _) = run(&["help", "render"]);
    for word in [
        "SCENE.ron",
        "Image:",
        "When to stop",
        "How to render:",
        "Saving and resuming:",
        "Resources:",
        "Reports:",
        "bb1d",
    ] {
        assert!(help.contains(word), "{word}: {help}");
    }
    assert_eq!(run(&["check", "--help"]).0, Some(0));
    assert_eq!(run(&["--version"]).1, concat!("upbp ", env!("CARGO_PKG_VERSION"), "\n"));
}

#[test]
fn what_is_missing_or_misspelt_is_said() {
    for (arguments, words) in [
        (&["render"][..], &["SCENE.ron", "--help"][..]),
        (&["rendr", "scene.ron"], &["rendr", "render"]),
        (&["scene.ron"], &["scene.ron", "--help"]),
        (&["render", "scene.ron", "--itertions", "5"], &["--itertions", "--iterations"]),
        (&["render", "scene.ron", "--tone", "film"], &["--tone", "filmic"]),
        (&["render", "scene.ron", "--exposure", "NaN"], &["--exposure", "-20 to 20"]),
        (&["merge"], &["STATE"]),
        (&["compare", "a.exr"], &["REFERENCE.exr"]),
        (&["completions", "tcsh"], &["tcsh", "bash", "fish", "zsh"]),
    ] {
        let (code, out, error) = run(arguments);
        assert_eq!((code, out.as_str()), (Some(2), ""), "{arguments:?}: {error}");
        for word in words {
            assert!(error.contains(word), "{arguments:?}: expected `{word}` in: {error}");
        }
    }
}

#[test]
fn completions_know_commands_and_options() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let (code, script, error) = run(&["completions", shell]);
        assert_eq!(code, Some(0), "{error}");
        for word in ["compare", "target-error", "filmic"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
}

/// A shell without a word on what is wrong would take any text.
#[cfg(unix)]
#[test]
fn bash_takes_its_completions() {
    let folder = program::folder("completions");
    std::fs::write(folder.join("upbp"), run(&["completions", "bash"]).1).expect("a writable folder");
    if !Path::new("/bin/bash").exists() {
        return;
    }
    let script = "source ./upbp && COMP_WORDS=(upbp render --tar) COMP_CWORD=2 && _upbp upbp --tar render && echo ${COMPREPLY[@]}";
    let output =
        Command::new("/bin/bash").args(["-c", script]).current_dir(&*folder).output().expect("bash runs");
    assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), "--target-error");
}
