//! Multiple importance sampling against independent computations: weights by enumeration, densities across
//! refraction, searches with radii by place; walks and checkers in a host of a few lines.

mod radius_field;
mod refraction;
mod room;
mod weights;
