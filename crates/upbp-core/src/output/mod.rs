//! Pictures and reports in files. Written beside their place and moved there when complete: nobody ever sees
//! half a file.

mod exr_file;
mod png_file;
mod tone;

pub use exr_file::{Metadata, read_exr, write_exr, write_image};
pub use png_file::write_png;
pub use tone::{ToneCurve, ToneMapping};
