//! Hosts, scenes, statistics and the stress grid that the tests, examples, benches and fuzz targets of the
//! workspace share.
//!
//! * [`Estimate`], [`render`], [`render_channels`]: short renders as means with standard errors.
//! * [`analytic`]: the table of exact values of transport theory.
//! * [`reference`](mod@reference), [`shipped`]: the scenes with reference images, and renders against them.
//! * [`closed_form`]: a host that owes nothing to the other crates.
//! * [`stress`]: scenes at the ends of what a description can say, and what must hold for their renders.
//! * [`readers`]: everything that reads files, for files of any content.
//! * [`processor`]: processor time of processes and threads.
//!
//! Unit tests of a crate that this one depends on cannot use it: for them the types of the crate are others.

#![allow(
    clippy::missing_panics_doc,
    clippy::must_use_candidate,
    reason = "what helps tests panics where a test has to fail"
)]

use std::path::Path;

pub mod analytic;
pub mod closed_form;
pub mod processor;
pub mod readers;
pub mod reference;
mod rendering;
pub mod shipped;
mod statistics;
pub mod stress;

pub use rendering::{
    comparing_renderer, iterate, render, render_by, render_channels, renderer, room, short_renderer,
};
pub use statistics::{Estimate, assert_same, channels};

/// The folder of the workspace, where examples and test data are.
pub fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}
