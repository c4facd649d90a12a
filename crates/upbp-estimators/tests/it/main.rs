//! Multiple importance sampling against independent computations: weights by enumeration, densities across
//! refraction.

mod refraction;
mod weights;
