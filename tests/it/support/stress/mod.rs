//! The stress matrix: scenes at the ends of what a description can say, and what must hold for each of their renders.
//!
//! [`case`] describes a scene as data, [`grid`] lists the combinations, [`execute`] renders one and judges it, [`walk`]
//! is the oracle in double precision, [`super::cases`] the table of exact values, and [`photon`] finds out where photons are. `tests/it/hostile/stress.rs` runs a part, `examples/stress` all of it.

#![allow(dead_code, reason = "the test and the example use different parts")]

pub(crate) mod case;
pub(crate) mod execute;
pub(crate) mod grid;
pub(crate) mod photon;
#[path = "../../../support/processor.rs"]
mod processor;
pub(crate) mod walk;
