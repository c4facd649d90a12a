//! The render: a preparation, then iterations of three passes each, until a rule says stop.

mod engine;
mod passes;
mod prepare;
mod renderer;
mod stop;

pub use prepare::Start;
pub use renderer::Renderer;
pub use stop::{Progress, StopReason};
