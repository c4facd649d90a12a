//! The renderer against what is known without it: closed forms and tables of transport theory,
//! `tests/data/analytic.json`, and images of an independent renderer ([`references`]).
//!
//! | kind | cases | how |
//! |---|---|---|
//! | `white_furnace` | 8 | mean radiance of an image, several sets of techniques |
//! | `ball_nonscattering` | 7 × 5 rays | one ray per impact parameter; deterministic without refraction |
//! | `single_scatter_point_light` | 16 | two edges on a fixed ray: next events; 4 by each merge |
//! | `single_scatter_slab_reflection` | 4 | paths of two edges, next event estimation |
//! | `slab_RT` | 11 of 54, × 2 angles, and diffuse | walks that end on a red wall above or a green one |
//! | `slab_RT_dielectric` | 6 | the same |
//! | `halfspace_isotropic` | 8 of 10, × 3 directions | thick wide slab under a directional light |
//! | `infinite_point_source_fluence` | 10 of 11 | collision estimate from stored photons in a thin shell |
//! | `infinite_point_source_moments` | 4 | moments of the stored photons |
//! | `canonical_variance` | all | [`canonical_variance`] |
//!
//! Bodies in layers, in a white furnace of their own: [`layers`]. Layers for denoisers: [`features`].
//! Facets of smoothly shaded meshes: [`shading_normals`]. A disc of the sky: [`sun`]. Lamps and cameras in
//! planes: [`lamps_in_planes`].
//!
//! Not covered: the furnace with a density grid (no such medium); half-spaces of albedo 1, whose finite slabs
//! converge as 1/τ only (`slab_RT` has slabs of albedo 1).
//!
//! Every row is printed with its standard error; the bar is four of them, plus what is stated for bias. Each
//! table states the largest standard error that still tells anything.

mod ball;
mod canonical_variance;
mod features;
mod furnace;
mod glowing_ball;
mod halfspace;
mod lamps_in_planes;
mod layers;
mod point_source;
mod references;
mod shading_normals;
mod single_scatter;
mod slab;
mod sun;
