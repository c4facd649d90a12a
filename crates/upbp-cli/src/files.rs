//! Files that commands write, and the options that name them.

use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::{PathBufValueParser, PossibleValuesParser, TypedValueParser};
use upbp_core::{
    Content, Image, Output, OutputError, Report, State, ToneCurve, ToneMapping, write_exr, write_image,
    write_png, write_text,
};

use crate::exit::{Failures, complain};

/// Places of images: an OpenEXR image and a PNG beside it, or a PNG alone.
#[derive(Clone, Debug)]
pub(crate) struct Images {
    exr: Option<PathBuf>,
    png: PathBuf,
}

impl Images {
    /// Chooses the files by the ending of a name.
    pub(crate) fn named(path: PathBuf) -> Result<Self, String> {
        match ending(&path).as_deref() {
            Some("exr") => Ok(Self { png: path.with_extension("png"), exr: Some(path) }),
            Some("png") => Ok(Self { exr: None, png: path }),
            _ => Err(
                "expected a name that ends in .exr (OpenEXR, and a PNG beside it) or in .png (a PNG alone)"
                    .to_owned(),
            ),
        }
    }

    /// Images for a scene without other names: the scene's, in the current folder.
    pub(crate) fn of_scene(scene: &Path) -> Self {
        let name = Path::new(scene.file_name().unwrap_or_default());
        Self { exr: Some(name.with_extension("exr")), png: name.with_extension("png") }
    }

    /// Whether one of the files holds layers besides the picture.
    pub(crate) const fn have_layers(&self) -> bool {
        self.exr.is_some()
    }

    /// The files, for checks.
    pub(crate) fn outputs(&self) -> impl Iterator<Item = Output<'_>> {
        let exr = self.exr.as_deref().map(|path| Output { role: "the image", path, content: Content::Exr });
        let role = if exr.is_some() { "the PNG beside the image" } else { "the image" };
        exr.into_iter().chain([Output { role, path: &self.png, content: Content::Png }])
    }

    /// Writes a render with all its layers, each file whatever became of the other; returns a hint if the PNG
    /// shows little of it.
    pub(crate) fn write_render(
        &self,
        state: &State,
        report: &Report,
        tones: ToneMapping,
        failures: &mut Failures,
    ) -> Option<String> {
        if let Some(path) = &self.exr {
            failures.note(write_exr(path, state, report));
        }
        let image = state.film().image();
        failures.note(write_png(&self.png, &image, tones));
        if image.pixels.iter().flatten().all(|value| *value == 0.0) {
            // Nobody who renders in a script looks at every picture.
            complain(BLACK);
        }
        self.too_bright(&image, tones).or_else(|| self.too_dark(&image, tones))
    }

    /// Writes an image, and another one to look at, each whatever became of the other.
    pub(crate) fn write(&self, image: &Image, shown: &Image, failures: &mut Failures) {
        if let Some(path) = &self.exr {
            failures.note(write_image(path, image));
        }
        failures.note(write_png(&self.png, shown, ToneMapping::default()));
    }

    /// A hint for a PNG that is darker than a sixteenth of white, all but the brightest hundredth of it.
    fn too_dark(&self, image: &Image, tones: ToneMapping) -> Option<String> {
        const DARK: f32 = 1.0 / 16.0;
        const BRIGHT: f32 = 0.99;
        let mut brightest = brightest_channels(image);
        let place = (BRIGHT * (brightest.len() - 1) as f32) as usize;
        let (_, bright, _) = brightest.select_nth_unstable_by(place, f32::total_cmp);
        let shown = *bright * tones.exposure.exp2();
        if !(shown > 0.0 && shown < DARK) {
            return None;
        }
        let (stops, png) = (stops_to(MIDDLE, *bright), self.png.display());
        (stops > tones.exposure).then(|| format!("nearly all of {png} is dark: try --exposure {stops}"))
    }

    /// A hint for a PNG whose pixels are mostly too bright by more than a stop: a sky may be white.
    fn too_bright(&self, image: &Image, tones: ToneMapping) -> Option<String> {
        let darker = ToneMapping { exposure: tones.exposure - 1.0, ..tones };
        let is_white = |pixel: &&[f32; 3]| darker.apply(**pixel).iter().any(|value| *value >= 1.0);
        let (white, all) = (image.pixels.iter().filter(is_white).count(), image.pixels.len());
        if 2 * white <= all {
            return None;
        }
        let mut brightest = brightest_channels(image);
        let (_, median, _) = brightest.select_nth_unstable_by(all / 2, f32::total_cmp);
        let stops = stops_to(MIDDLE, *median);
        let (percent, png) = (100 * white / all, self.png.display());
        (stops < tones.exposure).then(|| {
            format!(
                "{percent} % of {png} are brighter than white by more than a stop: try --exposure {stops}"
            )
        })
    }

    /// The names of the files, for messages.
    pub(crate) fn names(&self) -> String {
        self.outputs().map(|file| file.path.display().to_string()).collect::<Vec<_>>().join(" and ")
    }
}

/// Brightness, as a part of white, that the exposure of a hint gives to the median of a bright picture, or to
/// the bright part of a dark one.
const MIDDLE: f32 = 0.5;

/// The brightest channel of each pixel.
fn brightest_channels(image: &Image) -> Vec<f32> {
    image.pixels.iter().map(|&[r, g, b]| r.max(g).max(b)).collect()
}

/// The exposure that shows a value as another one, within what the option takes.
fn stops_to(shown: f32, value: f32) -> f32 {
    // No zero with a sign.
    (shown / value).log2().round().clamp(-20.0, 20.0) + 0.0
}

/// Said of a picture without any light.
const BLACK: &str = "warning: the picture is black. Does a lamp face away (a quad shines on the side of its \
                     normal), a spot, a sun (`direction` is that in which its light travels), or the camera? \
                     Is there an opaque shape around or before the lights or the camera? Is the medium too \
                     thick?";

/// Prints what a report warns of, for those who do not see the rest of it.
pub(crate) fn warn(report: &Report) {
    for warning in report.warnings() {
        complain(&format!("warning: {warning}"));
    }
}

/// Options for the look of a PNG.
#[derive(Debug, Args)]
pub(crate) struct Look {
    /// Exposure of the PNG in stops, -20 to 20: each doubles the brightness
    #[arg(long, value_name = "STOPS", value_parser = stops, default_value_t = 0.0, allow_negative_numbers = true)]
    exposure: f32,
    /// Tone curve of the PNG: `plain` clips what is brighter than white, `filmic` rolls highlights off
    #[arg(long, value_name = "CURVE", value_parser = curves(), default_value = "plain")]
    tone: ToneCurve,
}

impl Look {
    pub(crate) const fn tones(&self) -> ToneMapping {
        ToneMapping { exposure: self.exposure, curve: self.tone }
    }
}

fn curves() -> impl TypedValueParser<Value = ToneCurve> {
    PossibleValuesParser::new(ToneCurve::ALL.map(ToneCurve::name)).try_map(|name| name.parse::<ToneCurve>())
}

/// Reads an exposure of the command line.
pub(crate) fn stops(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(stops) if (-20.0..=20.0).contains(&stops) => Ok(stops),
        _ => Err("expected a number of stops from -20 to 20".to_owned()),
    }
}

/// Parser of a path whose name says what the file is.
pub(crate) fn path<T: Clone + Send + Sync + 'static>(
    read: fn(PathBuf) -> Result<T, String>,
) -> impl TypedValueParser<Value = T> {
    PathBufValueParser::new().try_map(read)
}

/// A report to write: `.json`, or no ending.
pub(crate) fn report(path: PathBuf) -> Result<PathBuf, String> {
    ends_in(path, &["json"])
}

/// A state to write: `.state`, or no ending.
pub(crate) fn state(path: PathBuf) -> Result<PathBuf, String> {
    ends_in(path, &["state"])
}

/// A plan to write: `.ron`, `.plan`, or no ending.
pub(crate) fn plan(path: PathBuf) -> Result<PathBuf, String> {
    ends_in(path, &["ron", "plan"])
}

/// Refuses a name with another ending, since people take a file for what its name says. Devices have no
/// ending.
fn ends_in(path: PathBuf, endings: &[&str]) -> Result<PathBuf, String> {
    match ending(&path) {
        Some(ending) if !endings.contains(&ending.as_str()) => {
            Err(format!("expected a name that ends in .{}, or has no ending", endings.join(" or .")))
        }
        _ => Ok(path),
    }
}

/// The ending of a name, after its last dot, in small letters.
fn ending(path: &Path) -> Option<String> {
    path.extension().map(|ending| ending.to_string_lossy().to_lowercase())
}

/// Writes a report as JSON.
pub(crate) fn write_report(report: &Report, path: &Path) -> Result<(), OutputError> {
    let text = serde_json::to_string_pretty(report)
        .map_err(|error| OutputError::Encode { path: path.to_owned(), reason: error.to_string() })?;
    write_text(path, &(text + "\n"))
}
