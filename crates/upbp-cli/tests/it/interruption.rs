//! Renders as processes that are killed, interrupted, out of disk or without a reader: what was saved stays
//! good, and the end result is the same to the bit.
//!
//! `UPBP_KILLS=200` sets how often a render is killed; a few times by default.

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, SystemTime};

use crate::program::{Folder, SMALL, command, folder};
use upbp_core::State;
use upbp_testing::processor;

/// As [`program::command`], silent, one thread.
fn render(folder: &Path, arguments: &[&str]) -> Command {
    let mut command =
        command("render", folder, &["scene.ron", "--quiet", "--threads", "1", "--deterministic"]);
    command.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn prepared(name: &str) -> Folder {
    let folder = folder(name);
    fs::write(folder.join("scene.ron"), SMALL).expect("a writable folder");
    folder
}

/// The exit code and what was said.
fn end(output: &Output) -> (Option<i32>, String) {
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

fn succeeds(mut command: impl std::borrow::BorrowMut<Command>) {
    let (code, text) = end(&command.borrow_mut().output().expect("the program runs"));
    assert_eq!(code, Some(0), "{text}");
}

/// Sends a signal by name.
fn signal(child: &Child, name: &str) {
    let status = Command::new("kill").args([format!("-{name}"), child.id().to_string()]).status();
    assert!(status.expect("kill runs").success());
}

/// Processor seconds of a program so far; 0 where they are not known.
fn used(child: &Child) -> f64 {
    processor::seconds(Path::new(&format!("/proc/{}", child.id()))).unwrap_or(0.0)
}

/// Looks at a program again and again until something holds. Fails when it ends before, or has used too much
/// processor time for it ever to hold.
fn wait_until(child: &mut Child, what: &str, mut holds: impl FnMut(&Child) -> bool) {
    const HUNG: f64 = 60.0;
    while !holds(child) {
        let ended = child.try_wait().expect("a status").is_some();
        if ended || used(child) > HUNG {
            let _ = child.kill();
            panic!("{what}: {}", if ended { "it ends before" } else { "it hangs" });
        }
        sleep(Duration::from_millis(5));
    }
}

/// The time at which a file was written, if it is there.
fn written(path: &Path) -> Option<SystemTime> {
    fs::metadata(path).and_then(|metadata| metadata.modified()).ok()
}

/// The film of a state file: its iterations and its fingerprint.
fn film(path: &Path) -> (u64, String) {
    let state = State::load(path).expect("a good state");
    (state.film().iterations(), state.film().fingerprint())
}

/// The number of unfinished files in a folder.
fn unfinished(folder: &Path) -> usize {
    let entries = fs::read_dir(folder).expect("the folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    paths.filter(|path| path.extension().is_some_and(|extension| extension == "part")).count()
}

#[test]
fn killed_at_random_moments_it_loses_no_more_than_since_the_last_saving() {
    /// Processor seconds between savings: the time that is asked for, and what an iteration and a saving
    /// take.
    const BETWEEN: f64 = 0.02 + 1.0;
    /// Enough that no run ends by itself.
    const MANY: &str = "200000000";
    let kills: u32 = std::env::var("UPBP_KILLS").map_or(10, |text| text.parse().expect("a number"));
    let folder = prepared("kills");
    let state = folder.join("a.state");
    let arguments = |state| ["--state", state, "--save-every", "0.02", "--light-paths", "64"];
    let (mut before, mut oldest, mut unsaved) = (0, 0.0_f64, 0);
    for kill in 0..kills {
        let mut child = render(&folder, &arguments("a.state"))
            .args(["--iterations", MANY])
            .spawn()
            .expect("the program runs");
        // A low-discrepancy sequence: moments from the start of the process to some savings later, every
        // other one after two.
        let mut wait = (100.0 * (f64::from(kill) * 0.618_034).fract()) as u32;
        let mut wanted = 2 * (kill % 2);
        let (mut last, mut last_used) = (written(&state), None);
        wait_until(&mut child, "a saving", |child| {
            if written(&state) != last {
                (last, last_used) = (written(&state), Some(used(child)));
                wanted = wanted.saturating_sub(1);
            }
            wait = wait.saturating_sub(1);
            wait == 0 && wanted == 0
        });
        child.kill().expect("it runs still");
        let used = used(&child);
        child.wait().expect("it has ended");
        if !state.exists() {
            unsaved += 1;
            continue;
        }
        let (iterations, _) = film(&state);
        let least = before + u64::from(last_used.is_some());
        assert!(iterations >= least, "kill {kill}: {iterations} iterations after {before}");
        before = iterations;
        if let Some(last_used) = last_used
            && written(&state) == last
        {
            let age = used - last_used;
            assert!(age < BETWEEN, "kill {kill}: the last saving was {age} s of processor time ago");
            oldest = oldest.max(age);
        }
    }
    // To the end of what is there and a little more, in one go and by what survived.
    let target = (before + 5).to_string();
    succeeds(render(&folder, &arguments("a.state")).args(["--iterations", &target, "-o", "a.exr"]));
    succeeds(render(&folder, &arguments("b.state")).args(["--iterations", &target, "-o", "b.exr"]));
    assert_eq!(film(&state), film(&folder.join("b.state")));
    let leftovers = unfinished(&folder);
    println!(
        "{kills} kills, {unsaved} of them before the first saving, {before} iterations survived; \
         oldest saving at a kill {oldest:.2} s of processor time; {leftovers} unfinished files"
    );
}

#[test]
fn a_signal_saves_and_says_try_again() {
    let folder = prepared("signals");
    let arguments =
        ["--state", "a.state", "--save-every", "0.01", "--light-paths", "64", "--report", "a.json"];
    // Who ignores it here, as under `nohup`, has programs that ignore it.
    let hangs_up = !has_signal("self", "SigIgn:", 1);
    for name in ["TERM", "INT", "HUP"].into_iter().filter(|name| hangs_up || *name != "HUP") {
        let _ = fs::remove_file(folder.join("a.exr"));
        let state = folder.join("a.state");
        let before = written(&state);
        let child = render(&folder, &arguments).args(["-o", "a.exr", "--iterations", "200000000"]).spawn();
        let mut child = child.expect("the program runs");
        wait_until(&mut child, "a saving", |_| written(&state) != before);
        signal(&child, name);
        let (code, text) = end(&child.wait_with_output().expect("it ends"));
        assert_eq!(code, Some(75), "{name}: {text}");
        assert!(text.contains("interrupted") && text.contains("a.state"), "{text}");
        assert!(folder.join("a.exr").exists() && folder.join("a.png").exists(), "{name}: there is a picture");
    }
    let (done, _) = film(&folder.join("a.state"));
    let target = (done + 3).to_string();
    succeeds(render(&folder, &arguments).args(["-o", "a.exr", "--iterations", &target]));
    succeeds(render(
        &folder,
        &["--light-paths", "64", "--state", "b.state", "-o", "b.exr", "--iterations", &target],
    ));
    assert_eq!(film(&folder.join("a.state")), film(&folder.join("b.state")));
    assert_eq!(unfinished(&folder), 0);
}

/// Whether a signal is in one of the masks of a process; in none where these are not known.
fn has_signal(process: &str, mask: &str, signal: u32) -> bool {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix(mask));
    mask.is_some_and(|mask| u64::from_str_radix(mask.trim(), 16).expect("a mask") >> (signal - 1) & 1 == 1)
}

/// A render with camera sub-paths that has asked for SIGINT and SIGTERM, and is on its way.
#[cfg(target_os = "linux")]
fn rendering(folder: &Path) -> Child {
    let listens =
        |child: &Child| [2, 15].iter().all(|signal| has_signal(&child.id().to_string(), "SigCgt:", *signal));
    let mut child = render(folder, &["--techniques", "pt", "-o", "a.exr"]).spawn().expect("the program runs");
    wait_until(&mut child, "it renders", |child| listens(child) && used(child) > 0.5);
    child
}

#[cfg(target_os = "linux")]
#[test]
fn a_second_signal_while_it_writes_leaves_nothing_unfinished() {
    let folder = prepared("writing");
    // Enough pixels for a file to be seen while it is written.
    let scene = SMALL.replace("width: 8", "width: 1000").replace("height: 8", "height: 1000");
    fs::write(folder.join("scene.ron"), scene).expect("a writable folder");
    for _ in 0..5 {
        let mut child = rendering(&folder);
        signal(&child, "TERM");
        while unfinished(&folder) == 0 && child.try_wait().expect("a status").is_none() {
            sleep(Duration::from_millis(1));
        }
        signal(&child, "INT");
        let (code, text) = end(&child.wait_with_output().expect("it ends"));
        assert!(matches!(code, Some(130 | 75)), "{code:?}: {text}");
        assert_eq!(unfinished(&folder), 0);
        if code == Some(130) {
            return;
        }
    }
    panic!("no signal came while it wrote");
}

/// A terminal that is closed may say so twice; what `nohup` has ignored is not heard at all.
#[cfg(target_os = "linux")]
#[test]
fn a_closed_terminal_ends_in_order_or_not_at_all() {
    let folder = prepared("hangup");
    let is_ignored = |process: &str| {
        let status = fs::read_to_string(format!("/proc/{process}/status")).expect("it is there");
        let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).expect("a known name");
        u64::from_str_radix(ignored.trim(), 16).expect("a mask") & 1 == 1
    };
    // The tests themselves may run under `nohup`, which a shell cannot undo.
    for ignored in [true, is_ignored("self")] {
        let trap = if ignored { "trap '' HUP; " } else { "" };
        let mut child = Command::new("sh")
            .args(["-c", &format!("{trap}exec \"$0\" \"$@\""), env!("CARGO_BIN_EXE_upbp"), "render"])
            .args(["scene.ron", "--quiet", "--threads", "1", "--deterministic", "--light-paths", "64"])
            .args(["--iterations", "200000000", "--state", "a.state", "--save-every", "0.01", "-o", "a.exr"])
            .current_dir(&*folder)
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program runs");
        wait_until(&mut child, "a saving", |_| folder.join("a.state").exists());
        assert_eq!(is_ignored(&child.id().to_string()), ignored);
        signal(&child, "HUP");
        if ignored {
            let before = written(&folder.join("a.state"));
            wait_until(&mut child, "another saving", |_| written(&folder.join("a.state")) > before);
            signal(&child, "TERM");
        } else {
            sleep(Duration::from_millis(1));
            // It may have ended.
            let _ = Command::new("kill").args(["-HUP", &child.id().to_string()]).output();
        }
        let (code, text) = end(&child.wait_with_output().expect("it ends"));
        assert_eq!(code, Some(75), "{text}");
        assert!(text.contains("the state is in a.state"), "{text}");
        fs::remove_file(folder.join("a.state")).expect("it was saved");
    }
}

#[test]
fn without_disk_or_reader_the_error_is_clear_and_the_state_stays() {
    let folder = prepared("disk");
    let arguments = ["--iterations", "2", "--light-paths", "64"];
    succeeds(render(&folder, &arguments).args(["--state", "a.state", "-o", "a.exr"]));
    let kept = film(&folder.join("a.state"));
    let failing = |extra: &[&str], word: &str| {
        let output = render(&folder, &arguments).args(extra).output().expect("the program runs");
        let (code, text) = end(&output);
        assert_eq!(code, Some(74), "{extra:?}: {text}");
        assert!(text.contains(word) && !text.contains("panicked"), "{extra:?}: {text}");
        assert_eq!(film(&folder.join("a.state")), kept);
    };
    if Path::new("/dev/full").exists() {
        // All that could not be written is named; what could be is there.
        failing(&["--state", "a.state", "-o", "b.exr", "--report", "/dev/full"], "/dev/full");
        assert!(folder.join("b.exr").exists());
        std::os::unix::fs::symlink("/dev/full", folder.join("full.exr")).expect("a link");
        failing(&["--state", "a.state", "-o", "full.exr"], "full.exr");
        assert!(folder.join("full.png").exists());
        // The numbers do not need the picture of them.
        fs::remove_file(folder.join("full.png")).expect("it is there");
        let compare = ["b.exr", "b.exr", "-o", "full.exr"];
        let output = command("compare", &folder, &compare).output().expect("the program runs");
        assert_eq!(output.status.code(), Some(74));
        assert!(String::from_utf8_lossy(&output.stdout).contains("relMSE"));
        assert!(folder.join("full.png").exists());
    }
    // A folder that vanishes while it renders.
    let gone = folder.join("gone");
    fs::create_dir(&gone).expect("a folder");
    let mut child = render(&folder, &["--state", "gone/a.state", "--save-every", "0.01", "-o", "d.exr"])
        .args(["--iterations", "200000000", "--light-paths", "64"])
        .spawn()
        .expect("the program runs");
    wait_until(&mut child, "a saving", |_| gone.join("a.state").exists());
    while fs::remove_dir_all(&gone).is_err() {}
    let mut errors = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut text = String::new();
    while !text.contains("warning") {
        assert!(errors.read_line(&mut text).expect("text") > 0, "it ends before a warning: {text}");
    }
    signal(&child, "TERM");
    errors.read_to_string(&mut text).expect("text");
    assert_eq!(child.wait().expect("it ends").code(), Some(74), "{text}");
    assert!(text.contains("warning") && text.contains("gone/a.state"), "{text}");

    // Nobody reads what it says: the files are there all the same.
    let unread = |program, arguments: &[&str]| {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let (code, text) =
            end(&command(program, &folder, arguments).stdout(writer).output().expect("the program runs"));
        assert_eq!(code, Some(74), "{text}");
        assert!(text.contains("standard output") && !text.contains("panicked"), "{text}");
    };
    unread("render", &["scene.ron", "--iterations", "2", "-o", "e.exr"]);
    unread("merge", &["a.state", "--state", "m.state", "-o", "m.exr"]);
    for name in ["e.exr", "m.state", "m.exr"] {
        assert!(folder.join(name).exists(), "{name}");
    }
    let mut child = command("render", &folder, &["scene.ron", "--iterations", "2", "-o", "f.exr"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs");
    drop(child.stderr.take());
    assert_eq!(child.wait().expect("it ends").code(), Some(0));
}

/// As in a pipe that a signal ends from both sides: a queue is to try again.
#[test]
fn a_signal_says_try_again_to_nobody_as_well() {
    let folder = prepared("deaf");
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let arguments = ["scene.ron", "--state", "a.state", "--save-every", "0.01", "--light-paths", "64"];
    let mut child = command("render", &folder, &arguments)
        .args(["--threads", "1", "--deterministic", "-o", "a.exr", "--iterations", "200000000"])
        .stdout(writer)
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs");
    wait_until(&mut child, "a saving", |_| folder.join("a.state").exists());
    signal(&child, "TERM");
    let (code, text) = end(&child.wait_with_output().expect("it ends"));
    assert_eq!(code, Some(75), "{text}");
    assert!(text.contains("the state is in a.state"), "{text}");
}

/// States of parts of iterations say which; a file that is empty is none; a pipe takes an image.
#[cfg(unix)]
#[test]
fn what_is_begun_is_told_and_what_is_empty_is_filled() {
    let folder = prepared("begun");
    // The first iteration has half a second, of which it needs several: all of the picture is a ball of 500
    // mean free paths.
    let scene = SMALL
        .replace("sigma_a: 0.1, sigma_s: 0.5", "sigma_a: 0, sigma_s: 500")
        .replace("fov_degrees: 40", "fov_degrees: 15");
    fs::write(folder.join("scene.ron"), scene).expect("a writable folder");
    let size = ["--size", "200x200", "--light-paths", "64", "--techniques", "pt"];
    fs::write(folder.join("a.state"), "").expect("a writable folder");
    succeeds(render(&folder, &["--time", "0.05", "--state", "a.state", "-o", "a.png"]).args(size));
    let state = State::load(&folder.join("a.state")).expect("a good state");
    let begun = state.film().begun();
    let (iteration, share) = begun.first_key_value().expect("a part of an iteration");
    let output = command("merge", &folder, &["a.state"]).output().expect("the program runs");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    for words in [
        format!(" and {:.0} % of {iteration}, film", 100.0 * share),
        format!(" iterations and {:.0} % of iteration {iteration} in ", 100.0 * share),
    ] {
        assert!(said.contains(&words), "{words}: {said}");
    }
    let pipe = folder.join("pipe.exr");
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("it runs").success());
    let read = std::thread::spawn(move || fs::read(pipe).expect("a pipe"));
    succeeds(command("merge", &folder, &["a.state", "--quiet", "-o", "pipe.exr"]));
    let received = read.join().expect("it is read");
    succeeds(command("merge", &folder, &["a.state", "--quiet", "-o", "file.exr"]));
    assert!(received == fs::read(folder.join("file.exr")).expect("an image"));
}

#[test]
fn a_state_with_all_that_is_asked_for_is_told() {
    let folder = prepared("nothing_to_do");
    // Enough pixels for an estimate of the error.
    let common = ["scene.ron", "--deterministic", "--size", "32x32", "--state", "a.state", "-o", "a.exr"];
    let said = |arguments: &[&str]| {
        let output = command("render", &folder, &[&common, arguments].concat()).output();
        let (code, text) = end(&output.expect("the program runs"));
        assert_eq!(code, Some(0), "{text}");
        text
    };
    assert!(!said(&["--iterations", "8"]).contains("note: "));
    let kept = film(&folder.join("a.state"));
    let iterations = "the state has the iterations 0..8 already: give others by `--iterations`";
    for (arguments, words) in [
        (&["--iterations", "8"][..], iterations),
        (&["--iterations", "2..5"], iterations),
        (&["--time", "0.001"], " s of rendering already: give a longer `--time`"),
        (
            &["--target-error", "1e6", "--iterations", "9"],
            "below `--target-error` already: give a smaller one",
        ),
    ] {
        let text = said(arguments);
        assert!(text.starts_with("note: nothing was rendered, ") && text.contains(words), "{text}");
        assert_eq!(film(&folder.join("a.state")), kept);
    }
    assert_eq!(said(&["--iterations", "8", "--quiet"]), "");
    assert!(!said(&["--iterations", "9"]).contains("note: "));
}

#[test]
fn states_without_a_picture_do_not_become_one() {
    let folder = prepared("empty");
    let scene = upbp_scene::ReadyScene::load(folder.join("scene.ron")).expect("a scene");
    let settings = upbp_core::Settings { deterministic: true, ..upbp_core::Settings::default() };
    let renderer = scene.renderer(settings.validate().expect("good settings")).expect("a renderer");
    renderer.state().save(&folder.join("a.state")).expect("a writable folder");
    let output = command("merge", &folder, &["a.state", "-o", "a.exr"]).output().expect("the program runs");
    let (code, text) = end(&output);
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("no picture") && !folder.join("a.exr").exists(), "{text}");
}

#[test]
fn slices_by_processes_merge_to_one_run() {
    let folder = prepared("slices");
    let paths = ["--light-paths", "64"];
    succeeds(render(&folder, &paths).args([
        "--iterations",
        "9",
        "--state",
        "whole.state",
        "-o",
        "whole.exr",
    ]));
    for (name, range) in [("a", "0..4"), ("b", "4..7"), ("c", "7..9")] {
        let (state, image) = (format!("{name}.state"), format!("{name}.exr"));
        succeeds(render(&folder, &paths).args(["--iterations", range, "--state", &state, "-o", &image]));
    }
    let merge = |arguments: &[&str]| {
        let output = command("merge", &folder, arguments).output().expect("the program runs");
        (end(&output), String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let order = ["c.state", "a.state", "b.state", "--state", "m.state", "-o", "m.exr", "--report", "m.json"];
    let ((code, text), said) = merge(&order);
    assert_eq!(code, Some(0), "{text}");
    assert_eq!(film(&folder.join("m.state")), film(&folder.join("whole.state")));
    assert!(
        said.contains("c.state") && said.contains("iterations 7..9") && said.contains("9 iterations"),
        "{said}"
    );
    let pixels = |name: &str| upbp_core::read_exr(&folder.join(name)).expect("an image");
    assert_eq!(pixels("m.exr"), pixels("whole.exr"));
    assert!(folder.join("m.png").exists());
    let first = fs::read(folder.join("m.state")).expect("the state");
    assert_eq!(merge(&["a.state", "b.state", "c.state", "--state", "m.state", "--quiet"]).0.0, Some(0));
    assert!(first == fs::read(folder.join("m.state")).expect("the state"), "the same file in any order");

    // What was merged can be resumed.
    succeeds(render(&folder, &paths).args(["--iterations", "11", "--state", "m.state", "-o", "m.exr"]));
    succeeds(render(&folder, &paths).args([
        "--iterations",
        "11",
        "--state",
        "whole.state",
        "-o",
        "whole.exr",
    ]));
    assert_eq!(film(&folder.join("m.state")), film(&folder.join("whole.state")));

    let ((code, text), _) = merge(&["a.state", "a.state", "--state", "n.state"]);
    assert!(code == Some(2) && text.contains("iterations 0..4 are in both"), "{text}");
    succeeds(render(
        &folder,
        &["--iterations", "20..21", "--seed", "5", "--state", "d.state", "-o", "d.exr"],
    ));
    let ((code, text), _) = merge(&["a.state", "d.state", "--state", "n.state"]);
    assert!(code == Some(2) && text.contains("seed is 0 in one and 5 in the other"), "{text}");
    assert!(text.contains("d.state") && !folder.join("n.state").exists());
    let (code, text) = end(&render(&folder, &["--state", "d.state"]).output().expect("the program runs"));
    assert!(code == Some(2) && text.contains("seed is"), "{text}");
}

#[test]
fn a_changed_mesh_is_another_scene() {
    let folder = prepared("mesh");
    let quad = "Quad(origin: (-2, 0, -2), edge_u: (0, 0, 4), edge_v: (4, 0, 0))";
    let scene = SMALL.replace(quad, "Mesh(file: \"floor.obj\")");
    assert_ne!(scene, SMALL);
    fs::write(folder.join("scene.ron"), scene).expect("a writable folder");
    let mesh = "v -2 0 -2\nv -2 0 2\nv 2 0 2\nf 1 2 3\n";
    fs::write(folder.join("floor.obj"), mesh).expect("a writable folder");
    let arguments = ["--light-paths", "64", "--iterations", "2", "--state", "a.state", "-o", "a.exr"];
    succeeds(render(&folder, &arguments));
    fs::write(folder.join("floor.obj"), mesh.replace("v 2 0 2", "v 2 0 1.9")).expect("a writable folder");
    let (code, text) = end(&render(&folder, &arguments).output().expect("the program runs"));
    assert!(code == Some(2) && text.contains("a.state") && text.contains("scene is"), "{text}");
}
