//! Bad input to the program: a clear error that names the place, exit code 2, and no output file.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use crate::program::{self, SMALL, folder};
use upbp_core::{Image, write_image};

fn run(folder: &Path, arguments: &[&str]) -> Output {
    program::command("render", folder, arguments).output().expect("the program runs")
}

/// Runs, and checks that it was refused with all of `words` and left nothing behind.
fn refused(folder: &Path, arguments: &[&str], words: &[&str]) {
    let before: Vec<_> = list(folder);
    let output = run(folder, arguments);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
    for word in words {
        assert!(text.contains(word), "{arguments:?}: expected `{word}` in: {text}");
    }
    assert!(!text.contains("panicked"), "{text}");
    let mut parts = text.split("because: ").map(str::trim);
    let mut said = parts.next().unwrap_or_default().to_owned();
    for cause in parts {
        assert!(!said.contains(cause), "{arguments:?}: `{cause}` is said twice: {text}");
        said += cause;
    }
    assert_eq!(list(folder), before, "{arguments:?} left a file");
}

fn list(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<_> =
        fs::read_dir(folder).expect("the folder").map(|entry| entry.expect("an entry").path()).collect();
    files.sort();
    files
}

#[test]
fn a_good_scene_renders_and_writes_its_files() {
    let folder = folder("good");
    fs::write(folder.join("scene.ron"), SMALL).expect("a writable folder");
    // A plan by a limit of time could differ in the second render.
    let render = |image: &str, more: &[&str]| {
        let mut arguments = vec!["scene.ron", "--deterministic", "--iterations", "2", "-o", image];
        arguments.extend(more);
        run(&folder, &arguments)
    };
    let output = render("out.exr", &["--threads", "2", "--report", "report.json", "--quiet"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stdout.is_empty() && output.stderr.is_empty(), "--quiet prints nothing");
    for name in ["out.exr", "out.png", "report.json"] {
        assert!(fs::metadata(folder.join(name)).expect(name).len() > 100, "{name}");
    }
    assert_eq!(list(&folder).len(), 4, "nothing else is left");
    let report: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.join("report.json")).expect("the report")).expect("JSON");
    assert_eq!(report["iterations"], 2);
    assert_eq!(report["counters"]["dropped"], 0);

    let check = program::command("check", &folder, &["scene.ron", "-o", "not_written.exr"]).output();
    assert!(check.expect("the program runs").status.success());
    assert_eq!(list(&folder).len(), 4, "a check writes nothing");

    // The reference is the image itself: no error, and a series with one point per iteration.
    assert!(render("again.exr", &["--reference", "out.exr", "--report", "b.json"]).status.success());
    let report: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.join("b.json")).expect("the report")).expect("JSON");
    let series = report["series"].as_array().expect("a series");
    assert_eq!(series.len(), 2);
    assert_eq!(series[1]["relative_mse"], 0.0);
    assert!(series[0]["relative_mse"].as_f64() > Some(0.0));
    let other = render("other.exr", &["--reference", "out.exr", "--size", "5x7"]);
    assert_eq!(other.status.code(), Some(2));
    let message = String::from_utf8_lossy(&other.stderr);
    assert!(message.contains("out.exr: expected a reference of 5 x 7 pixels, found "), "{message}");
}

#[test]
fn what_makes_a_picture_wrong_is_told_even_if_it_is_to_be_quiet() {
    let folder = folder("quiet_warnings");
    fs::write(folder.join("scene.ron"), SMALL).expect("a writable folder");
    let limited = ["scene.ron", "--iterations", "1", "--max-length", "2", "--quiet", "--state", "a.state"];
    let merging = ["a.state", "--quiet", "--state", "b.state"];
    for (name, arguments) in [("render", &limited[..]), ("merge", &merging)] {
        let output = program::command(name, &folder, arguments).output().expect("the program runs");
        let told = String::from_utf8(output.stderr).expect("UTF-8");
        assert!(output.status.success() && output.stdout.is_empty(), "{name}: {told}");
        assert!(
            told.starts_with("warning: light is missing: ") && told.lines().count() == 1,
            "{name}: {told}"
        );
    }
}

/// A likely mistake is told, and rendered all the same.
#[test]
fn media_that_are_nowhere_or_never_end_are_told() {
    let folder = folder("notes_on_media");
    let check = |scene: &str, more: &[&str]| {
        fs::write(folder.join("scene.ron"), scene).expect("a writable folder");
        let output = program::command("check", &folder, &[&["scene.ron"], more].concat()).output();
        let output = output.expect("the program runs");
        assert!(output.status.success());
        String::from_utf8(output.stderr).expect("UTF-8")
    };
    let empty = SMALL.replace("interior: \"m\",", "");
    let note = "note: medium `m`: is nowhere: no shape has it as `interior`, nor is it `outside`\n";
    assert_eq!(check(&empty, &[]), note);
    assert_eq!(check(&empty, &["--quiet"]), "");
    let everywhere = empty.replace("version: 1,", "version: 1, outside: \"m\",");
    let note = "note: medium `m`: scatters around everything without absorbing: iterations are long, and with a little `sigma_a` in each channel much shorter\n";
    let endless = everywhere.replace("sigma_a: 0.1, ", "");
    assert_eq!(check(&endless, &[]), note);
    assert_eq!(check(&endless, &["--quiet"]), "");
    assert_eq!(check(&everywhere, &[]), "");
    assert_eq!(check(SMALL, &[]), "");
}

#[test]
fn options_without_effect_are_told() {
    let folder = folder("notes_on_options");
    fs::write(folder.join("scene.ron"), SMALL).expect("a writable folder");
    let notes = |arguments: &[&str]| {
        let all = [&["scene.ron", "--iterations", "1"], arguments].concat();
        let output = program::command("check", &folder, &all).output().expect("the program runs");
        let text = String::from_utf8(output.stderr).expect("UTF-8");
        assert!(output.status.success(), "{text}");
        text
    };
    for (option, value, idle, useful) in [
        ("--light-paths", Some("64"), ["--techniques", "pt"], ["--techniques", "pt+lt"]),
        ("--beams", Some("8"), ["--techniques", "bpt+surf+pb2d"], ["--techniques", "bb1d"]),
        ("--fixed-radius", None, ["--techniques", "bpt"], ["--techniques", "bpt+surf"]),
        ("--features", None, ["-o", "o.png"], ["-o", "o.exr"]),
    ] {
        let with = |others: &[&str]| notes(&[&[option], value.as_slice(), others].concat());
        let text = with(&idle);
        assert!(
            text.starts_with(&format!("note: {option} has no effect: ")) && text.lines().count() == 1,
            "{text}"
        );
        assert_eq!(with(&[&idle[..], &["--quiet"]].concat()), "", "{option}");
        assert_eq!(with(&useful), "", "{option}");
        assert_eq!(with(&[]), "", "{option}");
        assert_eq!(notes(&idle), "", "{idle:?}");
    }
    assert_eq!(notes(&["--features", "-o", "o.png", "--state", "a.state"]), "");
}

#[test]
fn scenes_that_cannot_be_rendered_are_refused_by_place() {
    let folder = folder("scenes");
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).expect("a writable folder");
    refused(&folder, &["missing.ron"], &["missing.ron"]);
    let cases = [
        ("syntax", SMALL.replace("version: 1,", "version: 1"), "3:3"),
        ("unknown_field", SMALL.replace("film:", "films:"), "films"),
        ("nan", SMALL.replace("sigma_s: 0.5", "sigma_s: NaN"), "5:"),
        ("negative", SMALL.replace("sigma_a: 0.1", "sigma_a: -0.1"), "5:"),
        ("unknown_material", SMALL.replace("material: \"white\"", "material: \"whit\""), "`whit`"),
        ("unknown_medium", SMALL.replace("interior: \"m\"", "interior: \"n\""), "`n`"),
        ("flat_quad", SMALL.replace("edge_v: (4, 0, 0)", "edge_v: (0, 0, 1)"), "floor"),
        ("flat_sphere", SMALL.replace("radius: 0.5", "radius: 0"), "9:"),
        ("no_light", SMALL.replace("Point(position: (0, 3, 0), intensity: (5, 5, 5))", ""), "light"),
        ("no_film", SMALL.replace("width: 8", "width: 0"), "4:"),
        (
            "triangle",
            SMALL.replace(
                "Sphere(centre: (0, 1, 0), radius: 0.5)",
                "Mesh(positions: [(0, 0, 0), (1, 0, 0), (2, 0, 0)], indices: [(0, 1, 2)])",
            ),
            "ball",
        ),
        (
            "camera_in_wall",
            SMALL
                .replace("material: \"null\", interior: \"m\"", "material: \"white\"")
                .replace("origin: (0, 1, 3), target: (0, 1, 0)", "origin: (0, 1, 0.2), target: (0, 1, 0)"),
            "ball",
        ),
    ];
    for (name, text, word) in cases {
        assert_ne!(text, SMALL, "{name}");
        let file = format!("{name}.ron");
        write(&file, &text);
        refused(&folder, &[&file, "-o", "out.exr"], &[&file, word]);
    }
}

#[test]
fn settings_and_options_that_make_no_sense_are_refused() {
    let folder = folder("settings");
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).expect("a writable folder");
    write("scene.ron", SMALL);
    write("zero.ron", "(radii: (pb2d: Absolute(0)))");
    write("infinite.ron", "(radii: (bb1d: Scene(inf)))");
    write("typo.ron", "(\n  sed: 1,\n)");
    write("image.exr", "this is no image");
    write("image.state", "this is no state");
    let mut reference = Image { width: 8, height: 8, pixels: vec![[1.0; 3]; 64] };
    reference.pixels[5 * 8 + 3][1] = f32::NAN;
    write_image(&folder.join("nan.exr"), &reference).expect("a writable folder");
    for (arguments, words) in [
        (&["--settings", "zero.ron"][..], &["radii.pb2d", "positive"][..]),
        (&["--settings", "infinite.ron"], &["radii.bb1d"]),
        (&["--settings", "typo.ron"], &["typo.ron", "2:", "sed"]),
        (&["--settings", "none.ron"], &["none.ron"]),
        (&["--size", "0x5"], &["--size"]),
        (&["--size", "12"], &["--size", "640x360"]),
        (&["--techniques", "bpt+beam"], &["beam", "bb1d"]),
        (&["--light-paths", "0"], &["light_paths"]),
        (&["--max-length", "0"], &["max_length"]),
        (&["--time=-1"], &["--time"]),
        (&["--time", "NaN"], &["--time"]),
        (&["--iterations", "0"], &["--iterations"]),
        (&["--iterations", "5..5"], &["--iterations"]),
        (&["--iterations", "0..300000000"], &["--iterations", "268435456"]),
        (&["--save-every", "5"], &["--state"]),
        (&["--state", "image.exr"], &["image.exr", ".state"]),
        (&["--state", "image.state"], &["image.state", "not a state"]),
        (&["--state", "no/such/folder/a.state"], &["no/such/folder/a.state"]),
        (&["--size", "4000x4000", "--memory", "100"], &["4000 x 4000", "100 MiB", "`--memory MIB`"]),
        (&["--target-error", "0"], &["--target-error"]),
        (&["--threads", "0"], &["--threads", "from 1 to", "16 per core"]),
        (&["--threads", "1000000"], &["--threads", "from 1 to", "16 per core"]),
        (&["--reference", "image.exr"], &["image.exr"]),
        (&["--reference", "nan.exr"], &["nan.exr: ", "not finite, in column 3 of row 5 from 0"]),
        (&["--frobnicate"], &["--frobnicate"]),
        (&["-o", "no/such/folder/out.exr"], &["no/such/folder/out.exr"]),
        (&["--report", "no/such/folder/report.json"], &["no/such/folder/report.json"]),
    ] {
        let mut all = vec!["scene.ron"];
        all.extend(arguments);
        refused(&folder, &all, words);
    }
}

/// None of these would be refused if it was read to its end.
#[cfg(unix)]
#[test]
fn devices_and_pipes_are_not_read() {
    let folder = folder("devices");
    fs::write(folder.join("scene.ron"), SMALL).expect("a writable folder");
    let made = std::process::Command::new("mkfifo").arg(folder.join("pipe")).status();
    assert!(made.expect("mkfifo runs").success());
    let expected = "expected a regular file, found a device, a pipe or a socket";
    for path in ["/dev/zero", "pipe"] {
        refused(&folder, &[path], &[path, expected]);
        for option in ["--settings", "--plan", "--reference", "--state"] {
            refused(&folder, &["scene.ron", option, path], &[path, expected]);
        }
    }
}
