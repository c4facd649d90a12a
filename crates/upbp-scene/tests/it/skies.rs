//! Images of the sky and tables of phase functions, as scenes name them.

use std::fs;
use std::path::PathBuf;

use glam::Vec3;
use upbp_core::scene::Scene as _;
use upbp_media::Medium as _;
use upbp_scene::{Light, ReadyScene};

/// A folder for the files of a test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("upbp skies {name} {}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    fn image(&self, name: &str, width: usize, height: usize, red: fn(usize) -> f32) {
        let pixel = |x, _| (red(x), 0.5_f32, 0.5_f32);
        exr::prelude::write_rgb_file(self.0.join(name), width, height, pixel).unwrap();
    }

    fn scene(&self, rest: &str) -> ReadyScene {
        let text = format!(
            "(version: 1, camera: Perspective(origin: (0, 0, 9), target: (0, 0, 0), fov_degrees: 30), {rest})"
        );
        ReadyScene::from_ron_str(&text, &self.0).unwrap_or_else(|error| panic!("{error}"))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn notes(scene: &ReadyScene) -> Vec<String> {
    scene.notes().iter().map(ToString::to_string).collect()
}

#[test]
fn skies_that_are_stretched_or_were_infinite_are_noted_once() {
    let folder = Folder::new("notes");
    folder.image("good.exr", 4, 2, |x| x as f32);
    folder.image("square.exr", 4, 4, |x| x as f32);
    folder.image("bright.exr", 4, 2, |x| if x == 3 { f32::INFINITY } else { 1.0 });
    let scene = folder.scene(
        r#"lights: [Image(file: "good.exr"), Image(file: "square.exr"), Image(file: "bright.exr"),
                    Image(file: "square.exr", scale: 2), Image(file: "bright.exr", rotation_degrees: 90)]"#,
    );
    let expected = [
        "image `square.exr`: has 4 x 4 pixels and is stretched over all directions: latitude-longitude images \
         are twice as wide as high",
        "image `bright.exr`: 2 pixels are infinite, as bright ones are in half precision, and count as the \
         largest finite value of each channel",
    ];
    assert_eq!(notes(&scene), expected);
    assert_eq!(scene.files().len(), 3, "each is read once");
}

/// In a world where +z is up, as the README has it: the middle at +y, and the right half at +x.
#[test]
fn an_image_may_be_turned_about_any_axis() {
    let folder = Folder::new("turned");
    folder.image("sky.exr", 4, 2, |x| x as f32);
    let red = |rest: &str, direction: Vec3| {
        let scene = folder.scene(&format!("lights: [Image(file: \"sky.exr\" {rest})]"));
        let Light::Image(light) = &scene.emitters()[0] else { panic!("no image") };
        light.radiance_and_pdf(direction.normalize()).0[0]
    };
    let rest = ", rotate: [(axis: (1, 0, 0), degrees: 90)]";
    for (x, z, expected) in [(-1.0, 1.0, 0.0), (-1.0, -1.0, 1.0), (1.0, -1.0, 2.0), (1.0, 1.0, 3.0)] {
        assert_eq!(red("", Vec3::new(x, 0.1, z)), expected);
        assert_eq!(red(rest, Vec3::new(x, -z, 0.1)), expected);
    }
    // First about the axis of the image.
    let both = format!(", rotation_degrees: 90 {rest}");
    assert_eq!(red(&both, Vec3::new(-1.0, -0.1, 0.1)), 1.0);
    assert_eq!(red(&both, Vec3::new(-1.0, 0.1, 0.1)), 2.0);
}

#[test]
fn a_table_that_several_media_name_is_read_once() {
    let folder = Folder::new("tables");
    fs::write(folder.0.join("fog.txt"), "0 2\n180 1\n").unwrap();
    let scene = folder.scene(
        r#"media: { "a": Homogeneous(sigma_s: 1, phase: TableFile(file: "fog.txt")),
                    "b": Homogeneous(sigma_s: 2, phase: TableFile(file: "fog.txt")) },
           materials: { "null": Null },
           shapes: [(geometry: Sphere(centre: (0, 0, 0), radius: 1), material: "null", interior: "a"),
                    (geometry: Sphere(centre: (3, 0, 0), radius: 1), material: "null", interior: "b")],
           lights: [Constant(1)]"#,
    );
    assert_eq!(scene.media()[0].phase(), scene.media()[1].phase());
    assert_eq!((scene.files().len(), notes(&scene)), (1, Vec::new()));
}
