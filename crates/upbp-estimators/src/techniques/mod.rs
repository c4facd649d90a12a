//! Techniques, a file each: where they find samples, what those contribute and weigh.
//!
//! Source: `docs/theory.md`, section 2 for contributions, 4.4 for weights.

mod bb1d;
mod bp2d;
mod connect;
mod hit;
mod lens;
mod light_tracing;
mod merge;
mod nee;
mod pb2d;
mod pp3d;
mod surf;

pub(crate) use bb1d::bb1d;
pub(crate) use bp2d::bp2d;
pub(crate) use connect::connections;
pub(crate) use hit::{emission_along, environment, shine};
pub(crate) use lens::next_events_at_lens;
pub(crate) use light_tracing::light_tracing;
pub(crate) use nee::next_events;
pub(crate) use pb2d::pb2d;
pub(crate) use pp3d::pp3d;
pub(crate) use surf::surf;
