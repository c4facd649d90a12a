//! Multiple importance sampling against independent computations: weights by enumeration, densities across
//! refraction, searches with radii by place.

mod radius_field;
mod refraction;
mod weights;
