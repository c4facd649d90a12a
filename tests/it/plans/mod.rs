//! The choice of techniques.

mod adaptation;
mod emitters;
mod guides;
mod radii;
mod receivers;
mod technique_support;
