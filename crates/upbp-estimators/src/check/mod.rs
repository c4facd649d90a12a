//! Checkers for what a host implements: call them in the host's own tests.
//!
//! A renderer whose densities do not describe its sampling is wrong without looking wrong. These functions
//! draw from an implementation and compare with what it says about itself: that every sample agrees with
//! the functions that evaluate it, that frequencies follow densities, and that densities integrate to one.
//! They use their own fixed random numbers: an implementation passes always or never.
//!
//! Frequencies are compared by Pearson's χ² on a grid of directions, at a significance of 10⁻⁶ per test;
//! those of lights by their moments, and sums of random terms, within five standard errors. Equalities allow
//! for single precision: one part in a thousand.

mod bsdf;
mod camera;
mod emitter;
mod medium;
mod moments;
mod normals;
mod scene;

pub use bsdf::check_bsdf;
pub use camera::check_camera;
pub use emitter::check_emitter;
pub use medium::check_medium;
pub use scene::check_scene;

use std::f64::consts::TAU;
use std::fmt::Debug;

use glam::Vec3;

use crate::Spectrum;
use crate::random::mix;
use crate::scene::BoundingSphere;

/// An implementation does not keep a contract.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what}: {details}")]
pub struct ContractViolation {
    /// The rule that is broken.
    pub what: &'static str,
    /// Arguments and values of the first case found.
    pub details: String,
}

/// Draws per case: a direction of arrival, a receiver, a segment.
const DRAWS: usize = 40_000;

type Check = Result<(), ContractViolation>;

fn fail<T>(what: &'static str, details: impl Debug) -> Result<T, ContractViolation> {
    Err(ContractViolation { what, details: format!("{details:?}") })
}

fn require(condition: bool, what: &'static str, details: impl Debug) -> Check {
    if condition { Ok(()) } else { fail(what, details) }
}

/// A distance that is short in a scene, yet beyond rounding anywhere in it.
fn short_distance(bounds: &BoundingSphere) -> f32 {
    (1e-4 * bounds.radius).max(64.0 * f32::EPSILON * bounds.largest_coordinate())
}

/// Random numbers of the checkers: Steele et al., "Fast Splittable Pseudorandom Number Generators", OOPSLA
/// 2014.
struct Random(u64);

impl Random {
    /// Uniform in `[0, 1)`.
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mix(self.0) >> 40) as f32 / (1_u32 << 24) as f32
    }

    fn pair(&mut self) -> [f32; 2] {
        [self.next(), self.next()]
    }

    fn direction(&mut self) -> Vec3 {
        let [u, v] = self.pair();
        direction((1.0 - 2.0 * f64::from(u)).acos(), TAU * f64::from(v))
    }
}

fn direction(theta: f64, phi: f64) -> Vec3 {
    Vec3::new((theta.sin() * phi.cos()) as f32, (theta.sin() * phi.sin()) as f32, theta.cos() as f32)
}

/// Equal to one part in a thousand.
fn same(a: f32, b: f32) -> bool {
    (a - b).abs() <= 1e-3 * a.abs().max(b.abs()) || (a.abs() < 1e-30 && b.abs() < 1e-30)
}

fn same_spectrum(a: Spectrum, b: Spectrum) -> bool {
    (0..3).all(|channel| same(a[channel], b[channel]))
}

fn is_unit(v: Vec3) -> bool {
    (v.length_squared() - 1.0).abs() < 1e-4
}

fn is_light(value: Spectrum) -> bool {
    value.is_finite() && value.is_non_negative()
}

fn is_density(value: f32) -> bool {
    value.is_finite() && value >= 0.0
}
