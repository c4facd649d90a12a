//! Extended multiple importance sampling: weights across estimators of different dimension.
//!
//! The balance heuristic over all techniques that can produce a path, where a merge counts with `n · V_K ·
//! (distance factors) · (densities of both sub-paths)`: `docs/theory.md`, sections 3 and 4. A sub-path vertex
//! carries two numbers ([`VertexMis`]) from which the weight of any technique that ends there follows in
//! constant time; or two per technique ([`ByTechnique`]), from which the weights of any other sample counts
//! follow. [`oracle`] enumerates the same weights the slow, obvious way, and the tests hold one to the other.

mod counts;
mod density_sum;
pub mod oracle;
mod recursion;
mod weights;

pub use counts::{
    BeamExtent, DistanceDensity, Heuristic, MergeKind, MisPlan, OtherWalk, PARALLEL_SIN2, VolumeMerge,
    VolumeMerges,
};
pub use density_sum::{ByTechnique, Densities, Weight};
pub use recursion::{Edge, EdgeMis, EdgeStart, VertexMis};
