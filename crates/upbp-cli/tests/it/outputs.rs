//! Outputs destroy nothing: whatever the names are, what is read stays as it is, and what is overwritten was
//! of its kind.
//!
//! `UPBP_COMMANDS=10000` sets how many random command lines are run; some hundred by default.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::OnceLock;

use crate::program::{self, Folder, SMALL, command};
use proptest::prelude::*;
use proptest::sample::select;
use proptest::test_runner::{Config, TestRunner};

/// Every file of a folder and of those in it, with its content, but not links to files.
type Snapshot = BTreeMap<PathBuf, Vec<u8>>;

fn snapshot(folder: &Path) -> Snapshot {
    let mut files = Snapshot::new();
    for entry in fs::read_dir(folder).expect("the folder") {
        let path = entry.expect("an entry").path();
        if path.is_symlink() {
            files.insert(
                path.clone(),
                fs::read_link(path).expect("a link").into_os_string().into_encoded_bytes(),
            );
        } else if path.is_dir() {
            files.extend(snapshot(&path));
        } else {
            files.insert(path.clone(), fs::read(path).expect("a file"));
        }
    }
    files
}

fn run(program: &str, folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let Output { status, stderr, .. } =
        command(program, folder, arguments).output().expect("the program runs");
    (status.code(), String::from_utf8_lossy(&stderr).into_owned())
}

/// Options that renders of the folder have in common, so that they are of one kind and take little time.
const LITTLE: [&str; 9] =
    ["--techniques", "pt", "--max-length", "3", "--threads", "1", "--deterministic", "--seed", "1"];

/// A file of every kind, all of the scene `scene.ron`.
fn originals() -> &'static Snapshot {
    static FILES: OnceLock<Snapshot> = OnceLock::new();
    FILES.get_or_init(|| {
        let folder = program::folder("originals");
        let write = |name: &str, text: &str| fs::write(folder.join(name), text).expect("a writable folder");
        let render = |arguments: &[&str]| {
            let (code, text) = run("render", &folder, &[&LITTLE[..], arguments].concat());
            assert_eq!(code, Some(0), "{arguments:?}: {text}");
        };
        let other = SMALL.replace("width: 8, height: 8", "width: 2, height: 2");
        write("other.ron", &other);
        // It is its content that makes an image, not its name.
        render(&["other.ron", "--iterations", "1", "-o", "sky.exr"]);
        fs::rename(folder.join("sky.exr"), folder.join("sky.png")).expect("a rename");
        let quad = "Quad(origin: (-2, 0, -2), edge_u: (0, 0, 4), edge_v: (4, 0, 0))";
        let scene = other
            .replace(quad, "Mesh(file: \"floor.obj\")")
            .replace("lights: [", "lights: [ Image(file: \"sky.png\"),");
        write("scene.ron", &scene);
        write("floor.obj", "v -2 0 -2\nv -2 0 2\nv 2 0 2\nf 1 2 3\n");
        write("settings.ron", "(connections: 2)");
        write("notes", "not to be lost");
        let share = |range, state| ["scene.ron", "--iterations", range, "--state", state];
        let outputs = ["-o", "ref.exr", "--report", "report.json", "--save-plan", "plan.ron"];
        render(&[&share("0..1", "a.state")[..], &outputs].concat());
        render(&[&share("1..2", "b.state")[..], &["-o", "b.png"]].concat());
        fs::copy(folder.join("ref.exr"), folder.join("kept.exr")).expect("a copy");
        let files = snapshot(&folder);
        let name = |path: PathBuf| path.strip_prefix(&*folder).expect("in the folder").to_owned();
        files.into_iter().map(|(path, bytes)| (name(path), bytes)).collect()
    })
}

/// Makes a folder of which [`fill`] says what is in it.
fn prepared(name: &str) -> Folder {
    let folder = program::folder(name);
    fill(&folder);
    folder
}

/// Writes [`originals`] into a folder, with other names for some, and one that is read-only.
fn fill(folder: &Path) {
    fs::create_dir(folder.join("sub")).expect("a folder");
    for (name, bytes) in originals() {
        fs::write(folder.join(name), bytes).expect("a writable folder");
    }
    for (file, name) in
        [("scene.ron", "hard"), ("floor.obj", "mesh"), ("a.state", "state"), ("a.state", "sub/hard.state")]
    {
        fs::hard_link(folder.join(file), folder.join(name)).expect("a hard link");
    }
    for (file, name) in
        [("sky.png", "sky.exr"), ("../plan.ron", "sub/plan.plan"), ("new", "to_come"), ("loop", "loop")]
    {
        symlink(file, folder.join(name)).expect("a link");
    }
    let mut protected = fs::metadata(folder.join("kept.exr")).expect("the file").permissions();
    protected.set_readonly(true);
    fs::set_permissions(folder.join("kept.exr"), protected).expect("permissions");
}

/// Runs, and checks that it was refused with all of `words` and left everything as it was.
fn refused(program: &str, folder: &Path, arguments: &[&str], words: &[&str], before: &Snapshot) {
    let (code, text) = run(program, folder, arguments);
    assert_eq!(code, Some(2), "{arguments:?}: {text}");
    for word in words {
        assert!(text.contains(word), "{arguments:?}: expected `{word}` in: {text}");
    }
    assert!(snapshot(folder) == *before, "{arguments:?} changed a file");
}

#[test]
fn an_output_that_would_destroy_a_file_is_refused() {
    let folder = prepared("outputs");
    let before = snapshot(&folder);
    let cases: &[(&[&str], &[&str])] = &[
        // By the ending of the name.
        (&["-o", "scene.ron"], &["--output", "scene.ron", ".exr", ".png"]),
        (&["-o", "o.jpg"], &["o.jpg", ".exr", ".png"]),
        (&["-o", "o"], &[".exr", ".png"]),
        (&["--report", "scene.ron"], &["--report", "scene.ron", ".json"]),
        (&["--report", "o.png", "-o", "o.exr"], &["--report", "o.png", ".json"]),
        (&["--state", "o.exr", "-o", "o.exr"], &["--state", "o.exr", ".state"]),
        (&["--state", "floor.obj"], &["--state", "floor.obj", ".state"]),
        (&["--save-plan", "o.json"], &["--save-plan", "o.json", ".ron", ".plan"]),
        // What is read and what is written.
        (&["--save-plan", "scene.ron"], &["the plan to save", "the scene", "scene.ron"]),
        (&["--report", "hard"], &["the report", "the scene", "hard", "scene.ron"]),
        (&["--state", "hard"], &["the state", "the scene", "hard", "scene.ron"]),
        (&["--report", "mesh"], &["the report", "a mesh, an image", "mesh", "floor.obj"]),
        (&["--state", "sub/../mesh"], &["the state", "sub/../mesh", "floor.obj"]),
        (&["-o", "sky.exr"], &["the image", "a mesh, an image", "sky.exr", "sky.png"]),
        (&["-o", "sky.png"], &["the image", "a mesh, an image", "sky.png"]),
        (&["-o", "./ref.exr", "--reference", "ref.exr"], &["the image", "the reference", "./ref.exr"]),
        (
            &["--save-plan", "settings.ron", "--settings", "settings.ron"],
            &["the plan to save", "the settings"],
        ),
        (&["--save-plan", "plan.ron", "--plan", "plan.ron"], &["the plan to save", "the plan,", "plan.ron"]),
        (&["--save-plan", "sub/plan.plan", "--plan", "plan.ron"], &["sub/plan.plan", "plan.ron"]),
        // What is written twice.
        (&["--state", "new", "--report", "new"], &["the state", "the report", "new"]),
        (&["--state", "new", "--save-plan", "sub/../new"], &["the state", "the plan to save", "sub/../new"]),
        (&["--state", "new", "--report", "to_come"], &["the state", "the report", "to_come"]),
        (&["--state", "a.state", "--save-plan", "state"], &["the state, a.state", "the plan to save, state"]),
        // What is there and something else.
        (&["--save-plan", "other.ron"], &["the plan to save", "other.ron", "not a plan"]),
        (&["--save-plan", "settings.ron"], &["settings.ron", "not a plan"]),
        (&["--report", "notes"], &["the report", "notes", "not a report"]),
        (&["--state", "notes"], &["the state", "notes", "not a state"]),
        // What leads nowhere.
        (&["--report", "loop"], &["loop"]),
    ];
    let whole =
        |arguments: &[&'static str]| [&["scene.ron", "--iterations", "1"], &LITTLE[..], arguments].concat();
    for (arguments, words) in cases {
        refused("render", &folder, &whole(arguments), words, &before);
        refused("check", &folder, &whole(arguments), words, &before);
    }
    // What cannot be written is seen before the work.
    let cases: &[(&[&str], &[&str])] =
        &[(&["-o", "kept.exr"], &["kept.exr", "read-only"]), (&["--report", "sub"], &["sub", "directory"])];
    for (arguments, words) in cases {
        refused("render", &folder, &whole(arguments), words, &before);
        refused("check", &folder, &whole(arguments), words, &before);
    }
    let (to, from) = ("the state, ", "a state to merge, ");
    let cases: &[(&[&str], &[&str])] = &[
        (&["--state", "a.state"], &[to, from, "a.state"]),
        (&["--state", "sub/hard.state"], &[to, from, "sub/hard.state", "a.state"]),
        (&["--state", "scene.ron"], &["--state", ".state"]),
        (&["--state", "new", "--report", "new"], &["the state", "the report", "new"]),
        (&["-o", "o.tif"], &["o.tif", ".exr", ".png"]),
        (&["--exposure", "1"], &["--output"]),
        (&["--tone", "filmic", "--state", "new"], &["--output"]),
    ];
    for (arguments, words) in cases {
        refused("merge", &folder, &[&["a.state", "b.state"], *arguments].concat(), words, &before);
    }
    let cases: &[(&[&str], &[&str])] = &[
        (&["-o", "ref.exr"], &["the image, ref.exr", "the image to compare", "ref.exr"]),
        (&["-o", "sub/../sky.exr"], &["the image, sub/../sky.exr", "the reference", "sky.png"]),
        (&["-o", "kept.exr"], &["kept.exr", "read-only"]),
        (&["-o", "o.tif"], &["o.tif", ".exr", ".png"]),
        (&["-o", "none/o.exr"], &["none/o.exr"]),
        (&["--exposure", "1"], &["--output"]),
    ];
    for (arguments, words) in cases {
        refused("compare", &folder, &[&["ref.exr", "sky.png"], *arguments].concat(), words, &before);
    }
}

#[test]
fn a_name_that_ends_in_png_makes_a_png_alone() {
    let folder = prepared("png");
    let before = snapshot(&folder);
    for (program, input) in [("render", &["scene.ron", "--iterations", "1"][..]), ("merge", &["a.state"])] {
        let (code, text) = run(program, &folder, &[input, &["-o", "o.PNG", "--quiet"]].concat());
        assert_eq!(code, Some(0), "{text}");
        let image = folder.join("o.PNG");
        assert_eq!(kind(&fs::read(&image).expect("the image")), Some("png"));
        fs::remove_file(image).expect("a file");
        assert!(snapshot(&folder) == before, "{program}: nothing else is written");
    }
}

/// The plan and the report are known before the first iteration.
#[test]
fn a_check_writes_the_plan_and_the_report() {
    let folder = prepared("check");
    let before = snapshot(&folder);
    let outputs = ["--save-plan", "new.ron", "--report", "new.json", "--state", "new.state", "-o", "new.exr"];
    let run = |program, more: &[&str]| {
        let (code, text) = run(program, &folder, &[&["scene.ron", "--iterations", "0..1"], more].concat());
        assert_eq!(code, Some(0), "{text}");
    };
    run("check", &outputs);
    let mut after = snapshot(&folder);
    let mut written = |name: &str| after.remove(&folder.join(name)).unwrap_or_else(|| panic!("no {name}"));
    let plan = written("new.ron");
    let report: serde_json::Value = serde_json::from_slice(&written("new.json")).expect("JSON");
    assert_eq!(report["iterations"], 0);
    assert!(after == before, "nothing else is written");
    run("render", &outputs);
    assert!(fs::read(folder.join("new.ron")).expect("the plan") == plan, "a render chooses the same");
}

#[test]
fn slices_that_cannot_be_merged_are_mentioned() {
    let folder = prepared("lost");
    let note = "cannot be merged";
    let render = |arguments: &[&str]| {
        let (code, text) =
            run("render", &folder, &[&["scene.ron", "-o", "o.exr"], &LITTLE[..], arguments].concat());
        assert_eq!(code, Some(0), "{text}");
        text
    };
    assert!(render(&["--iterations", "3..4"]).contains(note));
    for arguments in [
        &["--iterations", "3..4", "--quiet"][..],
        &["--iterations", "3..4", "--state", "new"],
        &["--iterations", "1"],
    ] {
        assert!(!render(arguments).contains(note), "{arguments:?}");
    }
    let (code, text) = run("check", &folder, &[&["scene.ron", "--iterations", "3..4"], &LITTLE[..]].concat());
    assert!(code == Some(0) && !text.contains(note), "{text}");
}

/// The kind of a file, by its content.
fn kind(bytes: &[u8]) -> Option<&'static str> {
    let kinds: [(&[u8], &str); 5] = [
        (b"\x76\x2f\x31\x01", "exr"),
        (b"\x89PNG", "png"),
        (b"UPBPSTAT", "state"),
        (b"{\n  \"version\"", "json"),
        (b"FrozenPlan(\n", "ron"),
    ];
    kinds.into_iter().find(|(beginning, _)| bytes.starts_with(beginning)).map(|(_, kind)| kind)
}

/// Names of all files of [`prepared`], of files to come, and of no files.
const NAMES: [&str; 37] = [
    "scene.ron",
    "./scene.ron",
    "hard",
    "other.ron",
    "settings.ron",
    "plan.ron",
    "sub/plan.plan",
    "floor.obj",
    "mesh",
    "sky.exr",
    "sky.png",
    "ref.exr",
    "ref.png",
    "REF.EXR",
    "sub/../ref.exr",
    "kept.exr",
    "a.state",
    "state",
    "b.state",
    "b.png",
    "b.exr",
    "sub/hard.state",
    "report.json",
    "notes",
    "to_come",
    "new",
    "new.exr",
    "new.png",
    "new.json",
    "new.state",
    "new.ron",
    "sub/new.exr",
    "sub",
    "loop",
    "none/new.exr",
    "",
    "new.jpg",
];

/// Words of a command line; those of a file are chosen among good ones, more often, and all others.
type Words = Vec<&'static str>;

fn option(option: &'static str, good: &'static [&'static str]) -> impl Strategy<Value = Words> {
    let value = prop_oneof![2 => select(good), 1 => select(&NAMES[..])];
    prop_oneof![1 => Just(Vec::new()), 1 => value.prop_map(move |value| vec![option, value])]
}

/// The command, and its options with their values. No option comes twice.
fn commands() -> impl Strategy<Value = (&'static str, Vec<Words>)> {
    let scenes =
        prop_oneof![8 => Just("scene.ron"), 1 => select(&["other.ron", "hard"][..]), 1 => select(&NAMES[..])];
    let images = || option("-o", &["new.exr", "new.png", "sub/new.exr", "ref.exr", "b.exr", "b.png"]);
    let reports = || option("--report", &["new.json", "report.json", "new", "to_come"]);
    let flag = |words: Words| prop_oneof![4 => Just(Vec::new()), 1 => Just(words)];
    let files = (
        scenes.prop_map(|scene| vec![scene]),
        images(),
        reports(),
        option("--state", &["new.state", "a.state", "new", "sub/hard.state"]),
        option("--save-plan", &["new.ron", "plan.ron", "new", "sub/plan.plan"]),
        option("--plan", &["plan.ron", "sub/plan.plan"]),
        option("--settings", &["settings.ron"]),
        option("--reference", &["ref.exr", "sub/../ref.exr"]),
    );
    let files = files.prop_map(|(a, b, c, d, e, f, g, h)| vec![a, b, c, d, e, f, g, h]);
    let rest = (
        flag(vec!["--quiet"]),
        flag(vec!["--tone", "filmic"]),
        flag(vec!["--size", "1x1"]),
        flag(vec!["--fixed-radius"]),
        select(&["1", "2", "0..1", "4..5"][..]).prop_map(|n| vec!["--iterations", n]),
    );
    let rest = rest.prop_map(|(a, b, c, d, e)| vec![a, b, c, d, e]);
    let names = prop_oneof![4 => Just("render"), 1 => Just("check")];
    let renders = (names, files, rest).prop_map(|(name, files, rest)| (name, [files, rest].concat()));
    let states = prop::collection::vec(
        prop_oneof![8 => select(&["a.state", "b.state"][..]), 1 => select(&NAMES[..])],
        1..3,
    );
    let merges = (states, images(), reports(), option("--state", &["new.state", "new", "sub/hard.state"]));
    let merges = merges.prop_map(|(states, a, b, c)| ("merge", vec![states, a, b, c]));
    let image = || prop_oneof![8 => select(&["ref.exr", "kept.exr"][..]), 1 => select(&NAMES[..])];
    let compares = (image(), image(), images())
        .prop_map(|(image, reference, output)| ("compare", vec![vec![image, reference], output]));
    prop_oneof![8 => renders, 2 => merges, 1 => compares]
}

/// The files that a command reads and does not write on purpose.
fn read<'a>(program: &str, words: &'a [Words]) -> Vec<&'a str> {
    let (mut files, options) = (words[0].clone(), &words[1..]);
    if matches!(program, "render" | "check") {
        files.extend(["floor.obj", "sky.png"]);
    }
    for option in options {
        if let ["--plan" | "--settings" | "--reference", file] = option[..] {
            files.push(file);
        }
    }
    files
}

/// The files that a command which has ended well has written, with their kinds.
fn written(command: &str, words: &[Words]) -> Vec<(PathBuf, &'static str)> {
    let mut files = Vec::new();
    for option in words {
        let &[name, file] = &option[..] else { continue };
        let file = PathBuf::from(file);
        match name {
            "-o" | "--state" if command == "check" => {}
            "-o" => {
                files.push((file.with_extension("png"), "png"));
                if file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("exr")) {
                    files.push((file, "exr"));
                }
            }
            "--report" => files.push((file, "json")),
            "--state" => files.push((file, "state")),
            "--save-plan" => files.push((file, "ron")),
            _ => {}
        }
    }
    files
}

#[test]
fn random_commands_keep_what_they_read() {
    let count = std::env::var("UPBP_COMMANDS").map_or(300, |text| text.parse().expect("a number"));
    let folder = prepared("commands");
    let before = snapshot(&folder);
    let protected = folder.join("kept.exr");
    let ended = std::cell::RefCell::new(BTreeMap::new());
    let config = Config { cases: count, failure_persistence: None, ..Config::default() };
    let judged = TestRunner::new(config).run(&commands(), |(program, words)| {
        let mut arguments = words.concat();
        if matches!(program, "render" | "check") {
            arguments.extend(LITTLE);
        }
        let (code, text) = run(program, &folder, &arguments);
        *ended.borrow_mut().entry(code).or_insert(0_u32) += 1;
        let after = snapshot(&folder);
        let changed: Vec<_> = before.keys().filter(|path| after.get(*path) != before.get(*path)).collect();
        let new: Vec<_> = after.keys().filter(|path| !before.contains_key(*path)).collect();
        let read: Vec<_> =
            read(program, &words).iter().filter_map(|name| folder.join(name).canonicalize().ok()).collect();
        let written = written(program, &words)
            .into_iter()
            .map(|(file, kind)| (folder.join(file).canonicalize().ok(), kind));
        let written: Vec<_> = written.collect();
        if after != before {
            folder.clear();
            fill(&folder);
        }
        let said = || format!("{code:?}: {text}");
        prop_assert!(matches!(code, Some(0 | 2)) && !text.contains("panicked"), "{}", said());
        prop_assert!(
            code == Some(0) || changed.is_empty() && new.is_empty(),
            "refused, but {changed:?} {new:?}"
        );
        for (path, expected) in written.iter().filter(|_| code == Some(0)) {
            let found = path.as_ref().and_then(|path| kind(after.get(path)?));
            prop_assert_eq!(found, Some(*expected), "{:?}: {}", path, said());
        }
        for path in changed.iter().copied().chain(new) {
            let name = path.strip_prefix(&*folder).expect("in the folder").display().to_string();
            let now = after.get(path);
            // Each is of the kind of its name, and what was there was so, too.
            let found = now.and_then(|bytes| kind(bytes));
            prop_assert!(found.is_some(), "{name} has become something else; {}", said());
            let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
            let ending = ending.map(|ending| ending.replace("plan", "ron"));
            prop_assert!(
                ending.is_none() || ending.as_deref() == found,
                "{name} holds {found:?}; {}",
                said()
            );
            if let Some(old) = before.get(path) {
                prop_assert_eq!(kind(old), found, "{}: {}", name, said());
            }
            prop_assert!(*path != protected, "{name} was protected; {}", said());
            prop_assert!(!read.contains(path), "{name} was read; {}", said());
        }
        Ok(())
    });
    println!("by exit code: {ended:?}");
    judged.unwrap_or_else(|error| panic!("{error}"));
    let ended = ended.into_inner();
    let least = count / 20;
    assert!([0, 2].iter().all(|code| ended.get(&Some(*code)).is_some_and(|n| *n >= least)), "{ended:?}");
}
