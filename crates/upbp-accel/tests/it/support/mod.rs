//! Random input and hard cases that the tests of this crate share.

use glam::Vec3;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng as _, SeedableRng as _};
#[cfg(feature = "geometry")]
use upbp_accel::{Candidate, SceneGeometry, Visit};
use upbp_accel::{GrowingRadius, Ray, SearchRadius};

/// Uniform numbers from a fixed seed.
pub(crate) struct Random(Xoshiro256PlusPlus);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    /// Uniform in `[0, 1)`.
    pub(crate) fn unit(&mut self) -> f32 {
        (self.0.next_u64() >> 40) as f32 / (1_u64 << 24) as f32
    }

    /// Uniform in `[0, 1)²`.
    #[cfg(feature = "geometry")]
    pub(crate) fn square(&mut self) -> [f32; 2] {
        [self.unit(), self.unit()]
    }

    /// Uniform in `[−1, 1)³`.
    pub(crate) fn cube(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    /// Uniform on the unit sphere.
    pub(crate) fn direction(&mut self) -> Vec3 {
        loop {
            let point = self.cube();
            if (1e-4..1.0).contains(&point.length_squared()) {
                return point.normalize();
            }
        }
    }

    /// Uniform below `count`.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.next_u64() % count as u64) as usize
    }

    pub(crate) fn next_u64(&mut self) -> u64 {
        self.0.next_u64()
    }
}

/// [`SceneGeometry::for_each_hit`] for visitors of one type: its code is long, and compiled for each type.
#[cfg(feature = "geometry")]
pub(crate) fn visit_hits(scene: &SceneGeometry, ray: Ray, visit: &mut dyn FnMut(&Candidate) -> Visit) {
    scene.for_each_hit(ray, visit);
}

/// Distributions of positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Spread {
    Uniform,
    Clustered,
    Coincident,
    Collinear,
    Grid,
}

pub(crate) const SPREADS: [Spread; 5] =
    [Spread::Uniform, Spread::Clustered, Spread::Coincident, Spread::Collinear, Spread::Grid];

/// Positions of a spread in about `[−1, 1]³`, scaled and moved.
pub(crate) fn positions(
    spread: Spread,
    count: usize,
    scale: f32,
    offset: Vec3,
    random: &mut Random,
) -> Vec<Vec3> {
    let centre = random.cube() * 0.5;
    let along = random.direction();
    (0..count)
        .map(|_| {
            let local = match spread {
                Spread::Uniform => random.cube(),
                Spread::Clustered => centre + random.cube() * random.unit().powi(6),
                Spread::Coincident => centre,
                Spread::Collinear => centre + along * (random.unit() - 0.5),
                Spread::Grid => (random.cube() * 4.0).floor() / 4.0,
            };
            offset + local * scale
        })
        .collect()
}

/// Sizes of the spread and the places where it lies: small, large and far away.
pub(crate) const SCALES_AND_PLACES: [(f32, Vec3); 5] = [
    (1.0, Vec3::ZERO),
    (1e-6, Vec3::ZERO),
    (1e6, Vec3::ZERO),
    (1.0, Vec3::new(1e5, -1e5, 1e5)),
    (1e-3, Vec3::new(0.0, 1e5, 0.0)),
];

/// Directions of all kinds: along the axes with zeros of both signs, in a plane, any.
pub(crate) fn any_direction(random: &mut Random) -> Vec3 {
    let axes = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
    match random.below(4) {
        0 => axes[random.below(6)],
        1 => {
            let mut direction = random.direction();
            direction[random.below(3)] = if random.unit() < 0.5 { 0.0 } else { -0.0 };
            direction.normalize()
        }
        _ => random.direction(),
    }
}

/// A ray from a place, with ends or without; along `toward` with a probability, otherwise in any direction.
pub(crate) fn any_ray(place: Vec3, toward: Vec3, probability: f32, scale: f32, random: &mut Random) -> Ray {
    let direction = match toward.try_normalize() {
        Some(direction) if random.unit() < probability => direction,
        _ => any_direction(random),
    };
    let t_min = if random.unit() < 0.5 { 0.0 } else { random.unit() * scale };
    let t_max = if random.unit() < 0.5 { f32::INFINITY } else { t_min + random.unit() * 2.0 * scale };
    Ray::new(place, direction).with_range(t_min, t_max)
}

/// Places at exponential distances, as in clear air around a scene.
pub(crate) fn far_positions(count: usize, mean: f32, random: &mut Random) -> Vec<Vec3> {
    (0..count).map(|_| random.direction() * mean * -(1.0 - random.unit()).ln()).collect()
}

/// Radii of searches in a scene of size one: small, or as small as rounding at a distance; one or growing.
pub(crate) fn any_radius(distance: f32, random: &mut Random) -> SearchRadius {
    let least = if random.unit() < 0.5 {
        10_f32.powf(-3.0 + random.unit())
    } else {
        distance.max(1.0) * f32::EPSILON * 10_f32.powf(random.unit() * 2.0 - 1.0)
    };
    if random.unit() < 0.5 {
        return least.into();
    }
    let slope = 1e-3 * random.unit();
    let most = least * 10_f32.powf(random.unit() * 4.0);
    SearchRadius::Growing(GrowingRadius { centre: random.cube(), offset: 0.0, slope, least, most })
}

/// The radius of a search at a distance along its ray, rounded as the search does.
pub(crate) fn radius_at(radius: SearchRadius, ray: &Ray, t: f32) -> f32 {
    match radius {
        SearchRadius::Constant(radius) => radius,
        SearchRadius::Growing(GrowingRadius { centre, offset, slope, least, most }) => {
            let to_centre = centre - ray.origin;
            let nearest = to_centre.dot(ray.direction);
            let height2 = (to_centre - nearest * ray.direction).length_squared();
            (offset + slope * ((t - nearest).powi(2) + height2).sqrt()).min(most).max(least)
        }
    }
}
