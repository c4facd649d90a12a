//! The choice of techniques.

mod adaptation;
mod census;
mod guides;
mod radii;
mod receivers;
