//! Files. Written beside their place and moved there when complete: nobody ever sees half a file.

mod exr_file;
mod file;
mod paths;
mod png_file;

pub use exr_file::{Metadata, read_exr, write_exr};
pub(crate) use file::write_whole;
pub use file::{check_writable, remove_leftovers, write_text};
pub use paths::{Content, Output, check_outputs};
pub use png_file::write_png;
