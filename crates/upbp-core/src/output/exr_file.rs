//! One OpenEXR file with everything: the picture as `R`, `G`, `B`, layers as `bpt.R` and so on, the variance,
//! two independent halves, the estimated error, features of what the camera sees first.
//!
//! One part with dotted channel names is what every viewer reads; all metadata is in one text attribute,
//! because the encoder writes several in random order.

use std::io::{Cursor, Seek as _, Write as _};
use std::path::Path;

use exr::prelude::*;
use serde::Serialize;

use super::check_size;
use upbp_estimators::scene::PixelRect;

use crate::error::OutputError;
use crate::files::{open_exr, write_whole};
use crate::film::{FeatureImages, Image as Picture};
use crate::report::Report;
use crate::settings::Settings;
use crate::state::{Identity, State};

/// Origin of an image file, as RON text in its attribute `upbp`, in UTF-8.
#[derive(Serialize)]
struct Metadata<'a> {
    scene: &'a str,
    settings: &'a Settings,
    report: &'a Report,
}

/// Writes the mean of a render's film, its layers, variance, halves, estimated error and features, as far as
/// the film has them, in float32. The attribute `upbp` of the file holds the name of the scene, the settings
/// and the [report](State::report) as RON text.
///
/// # Errors
/// Those of the file system or of the encoder.
pub fn write_exr(path: &Path, state: &State, report: &Report) -> std::result::Result<(), OutputError> {
    let fail = |reason: String| OutputError::Encode { path: path.to_owned(), reason };
    let film = state.film();
    let mut channels = SmallVec::<[AnyChannel<FlatSamples>; 4]>::new();
    // First what takes memory besides.
    if let Some(error) = film.error_map() {
        let (width, height) = (film.rect().width, film.rect().height);
        push(&mut channels, "error.", &Picture { width, height, pixels: error.relative });
    }
    push(&mut channels, "", &film.image());
    for layer in film.layers() {
        if let Some(image) = film.layer(layer) {
            push(&mut channels, &format!("{}.", layer.name()), &image);
        }
    }
    if film.iterations() > 1 {
        push(&mut channels, "variance.", &film.variance());
    }
    if let Some(halves) = film.halves() {
        for (half, name) in halves.iter().zip(["half0.", "half1."]) {
            push(&mut channels, name, half);
        }
    }
    if let Some(FeatureImages { albedo, normal, depth }) = film.features() {
        push(&mut channels, "albedo.", &albedo);
        push_as(&mut channels, ["normal.X", "normal.Y", "normal.Z"], &normal);
        push_plane(&mut channels, "Z", depth);
        push_plane(&mut channels, "samples.Y", film.sample_counts());
    }

    let mut attributes = LayerAttributes::default();
    let Identity { scene, settings, .. } = state.identity();
    let metadata = Metadata { scene, settings, report };
    let text = ron::to_string(&metadata).map_err(|error| fail(error.to_string()))?;
    // Not `Text::from`, which takes nothing but Latin-1.
    let text = Text::from_slice_unchecked(text.as_bytes());
    attributes.other.insert(Text::from("upbp"), AttributeValue::Text(text));
    encode(path, film.rect(), state.identity().film, attributes, channels)
}

/// Writes an image as `R`, `G`, `B`, with nothing besides: float32.
///
/// # Errors
/// Those of the file system or of the encoder, or the image has other pixels than its size says.
pub fn write_image(path: &Path, image: &Picture) -> std::result::Result<(), OutputError> {
    check_size(path, image)?;
    let mut channels = SmallVec::new();
    push(&mut channels, "", image);
    let size = (image.width, image.height);
    encode(path, PixelRect::whole(size), size, LayerAttributes::default(), channels)
}

/// Writes the pixels of `part` of a `film` of some width and height.
fn encode(
    path: &Path,
    part: PixelRect,
    film: (u32, u32),
    attributes: LayerAttributes,
    channels: SmallVec<[AnyChannel<FlatSamples>; 4]>,
) -> std::result::Result<(), OutputError> {
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let size = (part.width as usize, part.height as usize);
    let attributes = attributes.with_position(Vec2(part.x.cast_signed(), part.y.cast_signed()));
    let layer = Layer::new(size, attributes, encoding, AnyChannels::sort(channels));
    let mut file = Image::from_layer(layer);
    // A part is placed in the whole picture by whoever puts pictures together.
    file.attributes.display_window = IntegerBounds::from_dimensions((film.0 as usize, film.1 as usize));
    let fail =
        |error: exr::error::Error| OutputError::Encode { path: path.to_owned(), reason: error.to_string() };
    write_whole(path, |writer| {
        if writer.stream_position().is_ok() {
            return file.write().to_buffered(writer).map_err(fail);
        }
        // The encoder goes back to its tables, which a pipe does not.
        let mut whole = Cursor::new(Vec::new());
        file.write().to_buffered(&mut whole).map_err(fail)?;
        let written = writer.write_all(whole.get_ref());
        written.map_err(|source| OutputError::Write { path: path.to_owned(), source })
    })
}

fn push(channels: &mut SmallVec<[AnyChannel<FlatSamples>; 4]>, prefix: &str, image: &Picture) {
    let names = ["R", "G", "B"].map(|name| format!("{prefix}{name}"));
    push_as(channels, names.each_ref().map(String::as_str), image);
}

fn push_as(channels: &mut SmallVec<[AnyChannel<FlatSamples>; 4]>, names: [&str; 3], image: &Picture) {
    for (c, name) in names.into_iter().enumerate() {
        push_plane(channels, name, image.pixels.iter().map(|pixel| pixel[c]).collect());
    }
}

fn push_plane(channels: &mut SmallVec<[AnyChannel<FlatSamples>; 4]>, name: &str, samples: Vec<f32>) {
    channels.push(AnyChannel::new(Text::from(name), FlatSamples::F32(samples)));
}

/// Reads the channels `R`, `G`, `B` of an image.
///
/// # Errors
/// Those of the file system or of the decoder.
pub fn read_exr(path: &Path) -> std::result::Result<Picture, OutputError> {
    let unreadable =
        |error: exr::error::Error| OutputError::Read { path: path.to_owned(), reason: error.to_string() };
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| Picture {
                width: size.width() as u32,
                height: size.height() as u32,
                pixels: vec![[0.0; 3]; size.width() * size.height()],
            },
            |picture: &mut Picture, position, (r, g, b): (f32, f32, f32)| {
                let index = position.y() * picture.width as usize + position.x();
                picture.pixels[index] = [r, g, b];
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(open_exr(path).map_err(|error| unreadable(error.into()))?)
        .map_err(unreadable)?;
    Ok(image.layer_data.channel_data.pixels)
}
