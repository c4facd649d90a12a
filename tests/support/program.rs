//! The example programs, run as processes.

#![allow(dead_code, reason = "no test uses all of it")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// A scene with a surface, a medium and a lamp.
pub(crate) const SMALL: &str = r#"(
  version: 1,
  camera: Perspective(origin: (0, 1, 3), target: (0, 1, 0), fov_degrees: 40),
  film: (width: 8, height: 8),
  media: { "m": Homogeneous(sigma_a: 0.1, sigma_s: 0.5) },
  materials: { "white": Lambert(0.7), "null": Null },
  shapes: [
    (name: "floor", material: "white", geometry: Quad(origin: (-2, 0, -2), edge_u: (0, 0, 4), edge_v: (4, 0, 0))),
    (name: "ball", material: "null", interior: "m", geometry: Sphere(centre: (0, 1, 0), radius: 0.5)),
  ],
  lights: [ Point(position: (0, 3, 0), intensity: (5, 5, 5)) ],
)"#;

/// An example program with its arguments, in a folder.
pub(crate) fn command(name: &str, folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(examples().join(format!("{name}{}", std::env::consts::EXE_SUFFIX)));
    command.args(arguments).current_dir(folder);
    command
}

/// Where the programs are. A run of one test alone does not build them; if they are up to date this takes a moment.
fn examples() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let built = Command::new(env!("CARGO"))
            .args(["build", "--quiet", "--example", "cornell_media", "--example", "merge"])
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .status()
            .expect("cargo runs");
        assert!(built.success());
        let mut path = std::env::current_exe().expect("the path of this test");
        path.pop();
        path.pop();
        path.join("examples")
    })
}

/// A folder of its own for each test.
pub(crate) fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a writable target folder");
    folder
}
