//! A scene and its reference, with the noise of the latter.

use std::collections::HashSet;
use std::error::Error;
use std::path::{Path, PathBuf};

use upbp_core::{Image, read_exr};
use upbp_scene::ReadyScene;

use upbp_testing::reference::{Floor, Reference};
use upbp_testing::shipped::{Group, SCENES, Shipped};

/// A scene to render.
pub(crate) struct Subject {
    pub(crate) name: String,
    pub(crate) scene: ReadyScene,
    pub(crate) reference: Image,
    pub(crate) floor: Floor,
    /// Files that were read for the scene and the reference.
    pub(crate) files: Vec<PathBuf>,
}

/// The files of a scene and of its reference.
struct Files {
    name: String,
    scene: PathBuf,
    reference: PathBuf,
}

impl Subject {
    /// Loads everything that the command line names.
    pub(crate) fn load_all(wanted: &[String]) -> Result<Vec<Self>, Box<dyn Error>> {
        let mut all = Vec::new();
        for item in wanted {
            match item.as_str() {
                "suite" => all.extend(SCENES.iter().map(Files::shipped)),
                "all" => {
                    let reference = SCENES.iter().filter(|scene| scene.group == Group::Reference);
                    all.extend(reference.map(Files::shipped));
                }
                other => match Shipped::find(other) {
                    Some(scene) => all.push(Files::shipped(&scene)),
                    None => all.push(Files::pair(other)?),
                },
            }
        }
        let mut names = HashSet::new();
        if let Some(files) = all.iter().find(|files| !names.insert(&files.name)) {
            return Err(format!("two scenes are called `{}`", files.name).into());
        }
        all.into_iter().map(Self::load).collect()
    }

    fn load(files: Files) -> Result<Self, Box<dyn Error>> {
        let scene = ReadyScene::load(&files.scene)?;
        let reference = read_exr(&files.reference)?;
        // Standard errors that a file does not have are zero.
        let floor = Reference::read(&files.reference)
            .map_err(|error| format!("cannot read {}: {error}", files.reference.display()))?
            .floor();
        let read = [[files.scene, files.reference].as_slice(), scene.files()].concat();
        Ok(Self { name: files.name, scene, reference, floor, files: read })
    }
}

impl Files {
    fn shipped(scene: &Shipped) -> Self {
        Self { name: scene.name.to_owned(), scene: scene.scene(), reference: scene.reference() }
    }

    fn pair(text: &str) -> Result<Self, String> {
        let (scene, reference) = text.split_once('=').ok_or_else(|| {
            let names = SCENES.map(|scene| scene.name).join(", ");
            format!("scene `{text}`: expected suite, all, SCENE.ron=REF.exr, or one of {names}")
        })?;
        let name = Path::new(scene).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if name.is_empty() || reference.is_empty() {
            return Err(format!("scene `{text}`: expected SCENE.ron=REF.exr"));
        }
        Ok(Self { name, scene: scene.into(), reference: reference.into() })
    }
}
