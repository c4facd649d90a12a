//! Techniques, a file each: where they find samples, what those contribute and weigh.
//!
//! Source: `docs/theory.md`, section 2 for contributions, 4.4 for weights.

mod beams;
mod connect;
mod hit;
mod light_tracing;
mod nee;
mod points;

pub(crate) use beams::along_beam;
pub(crate) use connect::connections;
pub(crate) use hit::{emission_along, emitter_hit, environment};
pub(crate) use light_tracing::light_tracing;
pub(crate) use nee::next_events;
pub(crate) use points::at_point;
