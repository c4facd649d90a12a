//! The choice of techniques.

mod adaptation;
mod census;
mod emitters;
mod guides;
mod radii;
mod receivers;
