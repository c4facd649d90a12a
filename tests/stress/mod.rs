//! The stress matrix: scenes at the ends of what a description can say, and what must hold for each of their renders.
//!
//! [`case`] describes a scene as data, [`grid`] lists the combinations, [`execute`] renders one and judges it, [`walk`]
//! is the oracle in double precision. `tests/stress.rs` runs a part, `examples/stress` all of it.

#![allow(dead_code, reason = "the test and the example use different parts")]

pub(crate) mod case;
pub(crate) mod execute;
pub(crate) mod grid;
pub(crate) mod walk;
