//! Statistics of what a light draws: means with their errors, and moments that tell one distribution from
//! another.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

use super::{Check, Random, require};
use crate::effective_samples;
use crate::scene::{BoundingSphere, Emitter};

/// Mean of random terms, and its standard error.
#[derive(Default)]
pub(super) struct Mean {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Mean {
    pub(super) fn is_empty(&self) -> bool {
        self.count == 0.0
    }

    pub(super) fn add(&mut self, term: f64) {
        self.count += 1.0;
        self.sum += term;
        self.squares += term * term;
    }

    pub(super) fn value(&self) -> (f64, f64) {
        let mean = self.sum / self.count;
        (mean, ((self.squares / self.count - mean * mean).max(0.0) / self.count).sqrt())
    }

    pub(super) fn agrees(&self, expected: (f64, f64), what: &'static str) -> Check {
        let (mean, error) = self.value();
        let tolerance = 5.0 * error.hypot(expected.1) + 2e-3 * expected.0.abs();
        require((mean - expected.0).abs() <= tolerance, what, (mean, error, expected))
    }
}

/// Samples of light with functions of what was drawn. Their means, weighted by the light, tell draws that do
/// not follow their densities, also where the light over its density is always the same.
#[derive(Default)]
pub(super) struct Distribution(Vec<(f64, [f64; 6])>);

/// Effective number of samples from which on a standard error can be told.
const LEAST_SAMPLES: f64 = 100.0;

impl Distribution {
    pub(super) fn add(&mut self, light: f64, functions: [f64; 6]) {
        if light > 0.0 {
            self.0.push((light, functions));
        }
    }

    /// Mean of a function, and its standard error.
    fn moment(&self, function: usize) -> (f64, f64) {
        let light: f64 = self.0.iter().map(|(light, _)| light).sum();
        let mean = self.0.iter().map(|(light, values)| light * values[function]).sum::<f64>() / light;
        let squares: f64 =
            self.0.iter().map(|(light, values)| (light * (values[function] - mean)).powi(2)).sum();
        (mean, squares.sqrt() / light)
    }

    /// As many samples of the same light would tell as much.
    fn effective_samples(&self) -> f64 {
        effective_samples(self.0.iter().map(|(light, _)| *light))
    }

    /// Whether both are draws of one distribution, as far as there are enough of them to tell.
    pub(super) fn agrees(&self, other: &Self, what: &'static str) -> Check {
        if self.effective_samples().min(other.effective_samples()) < LEAST_SAMPLES {
            return Ok(());
        }
        (0..6).try_for_each(|function| {
            let [own, others] = [self, other].map(|one| one.moment(function));
            let tolerance = 5.0 * own.1.hypot(others.1) + 2e-3;
            require((own.0 - others.0).abs() <= tolerance, what, (function, own, others))
        })
    }
}

/// Where an emitter starts light sub-paths: functions of a place have about the size of one.
pub(super) struct Places {
    centre: DVec3,
    spread: f64,
}

impl Places {
    pub(super) fn of(emitter: &impl Emitter, bounds: &BoundingSphere, random: &mut Random) -> Self {
        let drawn: Vec<DVec3> = (0..1000)
            .filter_map(|_| emitter.sample_emission(bounds, random.pair(), random.pair()))
            .map(|emission| emission.point.position.as_dvec3())
            .collect();
        let centre = drawn.iter().sum::<DVec3>() / drawn.len().max(1) as f64;
        let spread = drawn.iter().map(|place| place.distance(centre)).fold(0.0, f64::max);
        Self { centre, spread: spread.max(f64::MIN_POSITIVE) }
    }

    pub(super) fn functions(&self, place: Vec3) -> [f64; 6] {
        let DVec3 { x, y, z } = (place.as_dvec3() - self.centre) / self.spread;
        [x, y, z, x * x, y * y, z * z]
    }
}

/// A distribution of directions: every other one anywhere, and every other one in a cone around where light
/// comes from, which uniform directions may miss altogether.
pub(super) struct Sources {
    axis: DVec3,
    /// One minus the cosine of the cone's half angle.
    height: f64,
}

impl Sources {
    /// By what the emitter draws: a cone of twice their angle.
    pub(super) fn of(emitter: &impl Emitter, bounds: &BoundingSphere, random: &mut Random) -> Self {
        let drawn: Vec<DVec3> = (0..1000)
            .filter_map(|_| emitter.sample_emission(bounds, random.pair(), random.pair()))
            .map(|emission| emission.direction.as_dvec3())
            .collect();
        let axis = drawn.iter().sum::<DVec3>().normalize_or(DVec3::Z);
        let farthest = drawn.iter().map(|direction| versine(axis, *direction)).fold(0.0, f64::max);
        Self { axis, height: (4.0 * farthest).clamp(1e-12, 2.0) }
    }

    pub(super) fn sample(&self, random: &mut Random) -> Vec3 {
        if random.next() < 0.5 {
            return random.direction();
        }
        let [u, v] = random.pair().map(f64::from);
        let (below_pole, (sin_phi, cos_phi)) = (u * self.height, (TAU * v).sin_cos());
        let sine = (below_pole * (2.0 - below_pole)).sqrt();
        let (tangent, bitangent) = self.axis.any_orthonormal_pair();
        let across = sine * (cos_phi * tangent + sin_phi * bitangent);
        (across + (1.0 - below_pole) * self.axis).as_vec3().normalize()
    }

    /// Functions of a direction, about as large as one within the cone.
    pub(super) fn functions(&self, direction: Vec3) -> [f64; 6] {
        let direction = direction.as_dvec3();
        let (tangent, bitangent) = self.axis.any_orthonormal_pair();
        let [x, y] = [tangent, bitangent].map(|axis| axis.dot(direction) / (2.0 * self.height).sqrt());
        [x, y, x * x, y * y, x * y, versine(self.axis, direction) / self.height]
    }

    pub(super) fn pdf(&self, direction: Vec3) -> f64 {
        let is_inside = versine(self.axis, direction.as_dvec3()) <= self.height;
        0.5 / (2.0 * TAU) + if is_inside { 0.5 / (TAU * self.height) } else { 0.0 }
    }
}

/// One minus the cosine of the angle between two unit vectors.
fn versine(a: DVec3, b: DVec3) -> f64 {
    0.5 * a.distance_squared(b)
}
