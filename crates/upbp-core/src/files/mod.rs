//! Files: reading those that others made, and writing whole ones.

mod atomic_write;
mod input;
mod output_paths;

pub(crate) use atomic_write::write_whole;
pub use atomic_write::{abandon_files, remove_leftovers, write_text};
pub use input::{open_exr, open_file, read_text};
pub use output_paths::{Content, Output, check_outputs};
