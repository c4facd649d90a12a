//! The stress matrix: scenes at the ends of what a description can say, and what must hold for each of their
//! renders.
//!
//! `case` describes a scene as data, `grid` lists the combinations, `execute` renders one and judges it,
//! `walk` is the oracle in double precision, and `photon` finds out where photons are.
//! `tests/it/hostile/stress.rs` runs a part, `examples/stress.rs` all cases.

mod case;
mod execute;
mod grid;
mod photon;
mod walk;

pub use execute::in_parallel;
pub use grid::{Case, all};
