//! A scene and its reference, with the noise of the latter.

use std::collections::HashSet;
use std::error::Error;
use std::path::{Path, PathBuf};

use exr::prelude::{ReadChannels as _, ReadLayers as _, read};
use upbp_core::{Image, open_exr, read_exr};
use upbp_scene::ReadyScene;

use upbp_testing::shipped::{Group, SCENES, Shipped};

/// Mean errors of a perfect render, due to the noise of the reference; 0 where it is not known.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Floor {
    /// Mean of `σ² / (r² + 0.01)`.
    pub(crate) relative_mse: f64,
    /// Root of the mean of `σ²`.
    pub(crate) rmse: f64,
}

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
        let errors = standard_errors(&files.reference)
            .map_err(|error| format!("cannot read {}: {error}", files.reference.display()))?;
        let floor = errors.map_or_else(Floor::default, |errors| floor(&reference, &errors));
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

/// The channels `stderr.R`, `stderr.G`, `stderr.B`, if there are all three.
fn standard_errors(path: &Path) -> Result<Option<[Vec<f32>; 3]>, exr::error::Error> {
    let image = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
    let layer = image.all_attributes().from_buffered(open_exr(path)?)?.layer_data;
    let channel = |name: &str| {
        let found = layer.channel_data.list.iter().find(|channel| channel.name.to_string() == name)?;
        Some(found.sample_data.values_as_f32().collect::<Vec<f32>>())
    };
    Ok(channel("stderr.R")
        .zip(channel("stderr.G"))
        .zip(channel("stderr.B"))
        .map(|((red, green), blue)| [red, green, blue]))
}

fn floor(reference: &Image, errors: &[Vec<f32>; 3]) -> Floor {
    let (mut relative, mut square) = (0.0, 0.0);
    for (i, pixel) in reference.pixels.iter().enumerate() {
        for c in 0..3 {
            let (r, s) = (f64::from(pixel[c]), f64::from(errors[c][i]));
            relative += s * s / (r * r + 0.01);
            square += s * s;
        }
    }
    let n = (3 * reference.pixels.len()).max(1) as f64;
    Floor { relative_mse: relative / n, rmse: (square / n).sqrt() }
}
