//! What a renderer must be told of a scene: the traits that a host implements.
//!
//! Geometry, materials, lights and the camera stay the host's own. The walks of this crate ask five
//! questions: where does a ray go ([`Scene`]), how does a surface scatter ([`Bsdf`]), what does a light
//! emit ([`Emitter`]), which ray belongs to a place on the film ([`Camera`]), and what is between two points
//! ([`upbp_media::Medium`]). All of them are called from several threads, statically dispatched.
//!
//! Directions are unit vectors. Positions and distances are in scene units, radiance in W m⁻² sr⁻¹.

mod bsdf;
mod camera;
mod emitter;
mod hit;
mod world;

pub use bsdf::{Bsdf, BsdfSample, Interface, Walk};
pub use camera::{Camera, CameraConnection, CameraRay, PixelRect};
pub use emitter::{BoundingSphere, Emission, Emitter, EmitterKind, EmitterPoint, HitDensities, Incident};
pub use hit::{Crossing, EmitterId, Hit};
pub use world::{MAX_CROSSINGS, Scene};
