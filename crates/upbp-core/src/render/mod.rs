//! The render: a preparation, then iterations of three passes each, until a rule says stop.

pub(crate) mod engine;
pub(crate) mod passes;
mod prepare;
mod renderer;
mod stop;

pub use prepare::{Preparing, Start};
pub use renderer::Renderer;
pub use stop::{Outcome, Progress, Stop, StopReason};
