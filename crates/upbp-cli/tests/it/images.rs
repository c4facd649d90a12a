//! Images: what `upbp compare` says of them, and how a PNG looks.

use std::fs;
use std::path::{Path, PathBuf};

use upbp_core::{Image, read_exr, write_image};

use crate::program::{SMALL, command, folder};

/// Exit code, standard output and standard error of `upbp compare`.
fn compare(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = command("compare", folder, arguments).output().expect("the program runs");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

fn write(folder: &Path, name: &str, (width, height): (u32, u32), pixel: impl Fn(u32) -> [f32; 3]) {
    let image = Image { width, height, pixels: (0..width * height).map(pixel).collect() };
    write_image(&folder.join(name), &image).expect("a writable folder");
}

/// The numbers of a row, for red, green, blue and all.
fn row(text: &str, name: &str) -> [f64; 4] {
    let line =
        text.lines().find_map(|line| line.strip_prefix(name)).unwrap_or_else(|| panic!("no {name}: {text}"));
    let numbers: Vec<f64> = line.split_whitespace().map(|word| word.parse().expect("a number")).collect();
    numbers.try_into().expect("four numbers")
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<_> =
        fs::read_dir(folder).expect("the folder").map(|entry| entry.expect("an entry").path()).collect();
    files.sort();
    files
}

#[test]
fn errors_are_those_of_pixels_and_of_blocks() {
    let folder = folder("compare");
    // 10 x 9 pixels: whole blocks and parts of blocks. Noise that is zero in the mean of every block, on a
    // red that is too bright.
    write(&folder, "reference.exr", (10, 9), |_| [1.0, 2.0, 0.0]);
    write(&folder, "image.exr", (10, 9), |n| {
        let noise = if n % 10 % 2 == 0 { 0.5 } else { -0.5 };
        [1.1, 2.0 + noise, 0.0]
    });
    let (code, text, error) = compare(&folder, &["image.exr", "reference.exr"]);
    assert_eq!((code, error.as_str()), (Some(0), ""));
    assert!(text.starts_with("image.exr against reference.exr, 10 x 9 pixels\n"), "{text}");
    let close = |name: &str, expected: [f64; 4]| {
        for (found, expected) in row(&text, name).iter().zip(expected) {
            assert!(
                (found - expected).abs() <= 1e-4 * expected.abs() + 5e-6,
                "{name}: {found}, not {expected}: {text}"
            );
        }
    };
    close("mean  ", [1.1, 2.0, 0.0, 3.1 / 3.0]);
    close("mean of the reference", [1.0, 2.0, 0.0, 1.0]);
    let relative = [0.01 / 1.01, 0.25 / 4.01];
    close("relMSE  ", [relative[0], relative[1], 0.0, (relative[0] + relative[1]) / 3.0]);
    close("RMSE  ", [0.1, 0.5, 0.0, (0.26_f64 / 3.0).sqrt()]);
    close("relMSE of 8 x 8 blocks", [relative[0], 0.0, 0.0, relative[0] / 3.0]);
    close("RMSE of 8 x 8 blocks", [0.1, 0.0, 0.0, 0.1 / 3.0_f64.sqrt()]);
    let ratio = text.lines().find(|line| line.starts_with("ratio of the means")).expect("a ratio");
    assert_eq!(ratio.split_whitespace().skip(4).collect::<Vec<_>>(), ["1.10000", "1.00000", "-", "1.03333"]);
    assert_eq!(files(&folder).len(), 2, "nothing is written");
}

#[test]
fn what_is_not_finite_is_left_out_and_counted() {
    let folder = folder("not_finite");
    write(&folder, "reference.exr", (8, 8), |n| if n == 3 { [f32::INFINITY, 0.0, 0.0] } else { [1.0; 3] });
    write(&folder, "image.exr", (8, 8), |n| if n < 2 { [1.0, f32::NAN, 1.0] } else { [1.0; 3] });
    let (code, text, _) = compare(&folder, &["image.exr", "reference.exr", "-o", "error.exr"]);
    assert_eq!(code, Some(0));
    assert_eq!(row(&text, "relMSE  "), [0.0; 4]);
    assert!(text.contains("not finite, 2 of the image and 1 of the reference"), "{text}");
    let error = read_exr(&folder.join("error.exr")).expect("a picture");
    let unknown: Vec<_> = (0..64).filter(|n| error.pixels[*n][0].is_nan()).collect();
    assert_eq!(unknown, [0, 1, 3]);
    write(&folder, "none.exr", (8, 8), |_| [f32::NAN; 3]);
    let before = files(&folder);
    let (code, _, error) = compare(&folder, &["none.exr", "reference.exr", "-o", "o.exr"]);
    assert!(code == Some(2) && error.contains("none.exr") && error.contains("finite"), "{error}");
    assert_eq!(files(&folder), before);
}

#[test]
fn images_that_cannot_be_compared_are_refused_by_name() {
    let folder = folder("compare_bad");
    write(&folder, "small.exr", (4, 3), |_| [1.0; 3]);
    write(&folder, "large.exr", (4, 4), |_| [1.0; 3]);
    fs::write(folder.join("text.exr"), "this is no image").expect("a writable folder");
    let before = files(&folder);
    for (arguments, words) in [
        (["small.exr", "large.exr"], &["small.exr", "large.exr", "4 x 3", "4 x 4"][..]),
        (["text.exr", "large.exr"], &["text.exr"]),
        (["large.exr", "text.exr"], &["text.exr"]),
        (["none.exr", "large.exr"], &["none.exr"]),
        (["large.exr", "/dev/zero"], &["/dev/zero", "regular file"]),
    ] {
        let (code, out, error) = compare(&folder, &[&arguments[..], &["-o", "o.exr"]].concat());
        assert_eq!((code, out.as_str()), (Some(2), ""), "{arguments:?}: {error}");
        for word in words {
            assert!(error.contains(word), "{arguments:?}: expected `{word}` in: {error}");
        }
        assert_eq!(files(&folder), before, "{arguments:?} left a file");
    }
}

/// Width, height and pixels of a PNG.
fn png(path: &Path) -> Vec<[u8; 3]> {
    let mut reader = png::Decoder::new(std::io::BufReader::new(fs::File::open(path).expect("the image")))
        .read_info()
        .expect("a PNG");
    let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
    reader.next_frame(&mut bytes).expect("a PNG");
    bytes.as_chunks().0.to_vec()
}

#[test]
fn the_picture_of_an_error_says_where_it_is_and_of_which_sign() {
    let folder = folder("error_picture");
    write(&folder, "reference.exr", (3, 1), |_| [1.0; 3]);
    write(&folder, "image.exr", (3, 1), |n| [[1.5; 3], [0.5; 3], [1.0; 3]][n as usize]);
    assert_eq!(compare(&folder, &["image.exr", "reference.exr", "-o", "error.exr"]).0, Some(0));
    let relative = (0.5 / 1.01_f64.sqrt()) as f32;
    let error = read_exr(&folder.join("error.exr")).expect("a picture");
    assert_eq!(error.pixels, [[relative; 3], [-relative; 3], [0.0; 3]]);
    let [bright, dark, none] = png(&folder.join("error.png"))[..] else { panic!("three pixels") };
    assert!(bright[0] > 150 && bright[2] < 100 && dark[2] > 150 && dark[0] < 100, "{bright:?} {dark:?}");
    assert_eq!(none, [0; 3]);
    // A PNG alone, brighter.
    assert_eq!(
        compare(&folder, &["image.exr", "reference.exr", "-o", "more.png", "--exposure", "1"]).0,
        Some(0)
    );
    assert!(png(&folder.join("more.png"))[0][0] > bright[0]);
    assert_eq!(files(&folder).len(), 5);
}

#[test]
fn a_png_that_is_mostly_white_comes_with_an_exposure_that_shows_it() {
    let folder = folder("bright");
    let bright = SMALL.replace("Point(position: (0, 3, 0), intensity: (5, 5, 5))", "Constant((20, 10, 5))");
    fs::write(folder.join("scene.ron"), bright).expect("a writable folder");
    let render = |more: &[&str]| {
        let arguments = ["scene.ron", "--techniques", "pt", "--iterations", "1", "-o", "bright.png"];
        let output = command("render", &folder, &[&arguments[..], more].concat()).output().expect("it runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let said = String::from_utf8(output.stdout).expect("text");
        said.split_once("--exposure ").map(|(_, stops)| stops.trim().to_owned())
    };
    let stops = render(&[]).expect("most is white");
    assert!(stops.parse::<f32>().is_ok_and(|stops| stops < -2.0), "{stops}");
    assert_eq!(render(&["--exposure", &stops]), None);
}

#[test]
fn exposure_and_tone_change_the_png_and_nothing_else() {
    let folder = folder("tones");
    fs::write(folder.join("scene.ron"), SMALL.replace("(5, 5, 5)", "(200, 100, 50)"))
        .expect("a writable folder");
    let render = |name: &str, more: &[&str]| {
        let image = format!("{name}.exr");
        let arguments = ["scene.ron", "--techniques", "pt", "--iterations", "1", "--quiet", "-o", &image];
        let output = command("render", &folder, &[&arguments[..], more].concat()).output().expect("it runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let read = |ending| fs::read(folder.join(name).with_extension(ending)).expect("an image");
        (read("png"), read_exr(&folder.join(image)).expect("an image"))
    };
    let plain = render("plain", &["--state", "a.state"]);
    assert_eq!(render("default", &["--tone", "plain", "--exposure", "0"]), plain);
    let (darker, filmic) =
        (render("darker", &["--exposure", "-1.5"]), render("filmic", &["--tone", "filmic"]));
    assert!(darker.1 == plain.1 && filmic.1 == plain.1);
    assert!(darker.0 != plain.0 && filmic.0 != plain.0 && filmic.0 != darker.0);
    // What is too bright for a screen has shades on film.
    let white = |name: &str| png(&folder.join(name)).iter().flatten().filter(|value| **value == 255).count();
    assert!(white("filmic.png") < white("plain.png") / 2);
    let merge = |more: &[&str]| {
        let arguments = [&["a.state", "--quiet", "-o", "merged.png"], more].concat();
        assert!(command("merge", &folder, &arguments).status().expect("it runs").success());
        fs::read(folder.join("merged.png")).expect("an image")
    };
    assert!(merge(&[]) == plain.0 && merge(&["--tone", "filmic"]) == filmic.0);
}

#[test]
fn a_scene_may_have_a_name_in_any_script() {
    let folder = folder("any_script");
    fs::write(folder.join("牛乳.ron"), SMALL).expect("a writable folder");
    let arguments = ["牛乳.ron", "--iterations", "1", "-o", "o.exr"];
    let output = command("render", &folder, &arguments).output().expect("the program runs");
    assert!(output.status.success(), "{output:?}");
    let bytes = fs::read(folder.join("o.exr")).expect("an image");
    let name = "牛乳".as_bytes();
    assert!(bytes.windows(name.len()).any(|part| part == name), "the image names its scene in UTF-8");
    assert_eq!(read_exr(&folder.join("o.exr")).expect("a picture").pixels.len(), 64);
}
