//! The program `upbp` as its users have it: what it is told, what it writes, and how it ends.

mod bad_input;
mod help;
mod images;
#[cfg(unix)]
mod interruption;
#[cfg(unix)]
mod outputs;
mod program;
