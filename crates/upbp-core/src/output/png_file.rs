//! A PNG to look at.

use std::path::Path;

use super::check_size;
use super::tone::ToneMapping;
use crate::error::OutputError;
use crate::files::write_whole;
use crate::film::Image;

/// Writes `image` as `tones` has it, with the sRGB transfer curve, 8 bits per channel; NaN becomes black.
///
/// # Errors
/// Those of the file system or of the encoder, or the image has other pixels than its size says.
pub fn write_png(path: &Path, image: &Image, tones: ToneMapping) -> Result<(), OutputError> {
    check_size(path, image)?;
    let bytes: Vec<u8> = image.pixels.iter().flat_map(|pixel| tones.apply(*pixel)).map(quantise).collect();
    write_whole(path, |writer| {
        let fail = |error: png::EncodingError| OutputError::Encode {
            path: path.to_owned(),
            reason: error.to_string(),
        };
        let mut encoder = png::Encoder::new(writer, image.width, image.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header().map_err(fail)?;
        writer.write_image_data(&bytes).map_err(fail)?;
        writer.finish().map_err(fail)
    })
}

fn quantise(linear: f32) -> u8 {
    let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_is_srgb() {
        let plain = |value| quantise(ToneMapping::default().apply([value; 3])[0]);
        assert_eq!([0.0, 0.5, 1.0, 9.0, f32::NAN].map(plain), [0, 188, 255, 255, 0]);
    }
}
