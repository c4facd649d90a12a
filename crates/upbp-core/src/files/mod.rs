//! Files: reading those that others made, and writing whole ones.

mod input;
mod paths;
mod whole;

pub use input::{open_exr, open_file, read_text};
pub use paths::{Content, Output, check_outputs};
pub(crate) use whole::write_whole;
pub use whole::{abandon_files, check_writable, remove_leftovers, write_text};
