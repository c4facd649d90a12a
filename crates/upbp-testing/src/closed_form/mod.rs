//! A scene that owes nothing to the other crates: spheres and rectangles in closed form.
//!
//! It holds what weights can go wrong on: refraction, bodies that overlap and nest without a surface, media
//! of all kinds, mirrors, mixtures of smooth and Dirac lobes, transmission at a diffuse surface, shading
//! normals, roulette that depends on the side, emitters of every kind whose points are chosen for the
//! receiver.

pub mod camera;
pub mod fog;
pub mod light;
pub mod material;
pub mod scene;
pub mod shape;
