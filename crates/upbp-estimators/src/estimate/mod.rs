//! One module per technique: where it finds samples, what they contribute, what they weigh.
//!
//! Source: `docs/theory.md`, section 2 for contributions, 4.4 for weights.

mod beams;
mod connect;
mod emission;
mod light_tracing;
mod next_event;
mod points;

pub(crate) use beams::along_beam;
pub(crate) use connect::connections;
pub(crate) use emission::{emission_along, emitter_hit, environment};
pub(crate) use light_tracing::light_tracing;
pub(crate) use next_event::next_events;
pub(crate) use points::at_point;
