//! The program, run as a process.

use std::fs;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::process::Command;

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

/// `upbp` with a command of its own and its arguments, in a folder.
pub(crate) fn command(name: &str, folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_upbp"));
    command.arg(name).args(arguments).current_dir(folder);
    command
}

/// A folder that is removed with what is in it, unless the test fails.
pub(crate) struct Folder(PathBuf);

/// A folder of its own for each test of each process: the same tests may run elsewhere at this moment.
pub(crate) fn folder(name: &str) -> Folder {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a writable target folder");
    let folder = Folder(folder.canonicalize().expect("the folder"));
    folder.clear();
    folder
}

impl Folder {
    /// Removes what is in it.
    pub(crate) fn clear(&self) {
        fs::remove_dir_all(&self.0).expect("a writable folder");
        fs::create_dir(&self.0).expect("a writable target folder");
    }
}

impl Deref for Folder {
    type Target = Path;

    fn deref(&self) -> &Path {
        &self.0
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            let _ = fs::remove_dir_all(&self.0);
        }
    }
}
