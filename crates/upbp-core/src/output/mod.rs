//! Pictures and reports in files. Written beside their place and moved there when complete: nobody ever sees
//! half a file.

mod exr_file;
mod png_file;
mod tone;

use std::path::Path;

use crate::error::OutputError;
use crate::film::Image;

pub use exr_file::{read_exr, write_exr, write_image};
pub use png_file::write_png;
pub use tone::{ToneCurve, ToneMapping};

/// Refuses what encoders take for granted.
fn check_size(path: &Path, image: &Image) -> Result<(), OutputError> {
    let Image { width, height, pixels } = image;
    if image.is_whole() && !pixels.is_empty() {
        return Ok(());
    }
    let reason = format!("expected {width} x {height} pixels, at least one, found {}", pixels.len());
    Err(OutputError::Encode { path: path.to_owned(), reason })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_with_other_pixels_than_its_size_says_is_refused() {
        for (width, height, count) in [(4, 4, 3), (2, 2, 30), (0, 3, 3), (0, 0, 0), (u32::MAX, u32::MAX, 0)] {
            let image = Image { width, height, pixels: vec![[0.5; 3]; count] };
            let path = Path::new("no such folder/image");
            for result in [write_image(path, &image), write_png(path, &image, ToneMapping::default())] {
                assert!(matches!(result, Err(OutputError::Encode { .. })), "{width} x {height}: {result:?}");
            }
            assert!(count == 0 || image.relative_mse_over_scales(&image).is_nan());
        }
    }
}
