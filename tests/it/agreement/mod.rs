//! Different ways to compute a picture give the same picture.

mod audit;
mod boundaries;
mod channels;
mod far_away;
mod lens;
mod rebuild;
mod roulette;
mod shared_faces;
mod subsets;
mod traced_weights;
mod unbounded;
mod volumes;
