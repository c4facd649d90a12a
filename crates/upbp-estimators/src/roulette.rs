//! Russian roulette: which walks end before they leave the scene.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::scene::BoundingSphere;

/// Rule by which sub-paths end early (`docs/theory.md`, section 6.8).
///
/// Every vertex tells a probability to [continue](crate::scene::Bsdf::continuation), its albedo. Light
/// sub-paths go on with just that probability, so that all photons carry the same power. What a camera vertex
/// finds differs by more than its albedo anyway, and first vertices matter most; so camera sub-paths go on
/// with certainty until the product of their albedos falls below a threshold, and hold it from then on.
///
/// Walks of both kinds may be caught inside of clear glass, where total reflection never lets them out: after
/// many vertices in a row that only reflect or refract, two in a thousand end at each further one. And they
/// may get lost in a medium around the scene: the farther away, the fewer [go on](Surroundings), since fewer
/// would come back and after more vertices.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Roulette {
    /// Walks end where they leave the scene, or at the greatest length, which those that total reflection
    /// keeps inside of glass always reach.
    Off,
    /// A camera sub-path is cut so that no less of its throughput is left by albedos than this, in `(0, 1]`.
    Below(f32),
}

impl Roulette {
    /// Whether walks end at all. If so, their densities in weights contain the albedo of every vertex: the
    /// threshold depends on what a walk went through, which the walk of the other side cannot know.
    #[inline]
    #[must_use]
    pub const fn is_on(self) -> bool {
        matches!(self, Self::Below(_))
    }

    /// The probability by albedos that a camera sub-path goes on past vertices with this product of them.
    #[must_use]
    pub fn survival(self, albedos: f32) -> f32 {
        match self {
            Self::Off => 1.0,
            Self::Below(least) => (albedos / least).min(1.0),
        }
    }
}

/// Vertices in a row without a smooth lobe from which on a walk may be caught.
const FREE_REFLECTIONS: u32 = 256;
/// The probability to go on at each more: a walk that is caught has five hundred more on average, and one
/// that gets out of the wall of a vessel after as many has 2.7 times the throughput.
const REFLECTS_ON: f32 = 0.998;

/// A medium around the scene, in which walks get lost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surroundings {
    /// A sphere around the scene and its camera, within which distance ends no walk.
    pub within: BoundingSphere,
    /// The distance on which light loses its direction in the medium, scene units.
    pub free_path: f32,
}

impl Surroundings {
    /// Part of the walks that have been at a place which go on (`docs/theory.md`, section 6.8).
    fn part_that_goes_on(&self, position: Vec3) -> f32 {
        let Self { within: BoundingSphere { centre, radius }, free_path } = *self;
        let distance = position.distance(centre);
        if distance > radius {
            radius / distance * ((radius + free_path) / (distance + free_path)).sqrt()
        } else {
            1.0
        }
    }
}

/// The roulette of one walk.
#[derive(Clone, Copy, Debug)]
pub struct Survival {
    roulette: Roulette,
    /// Part of the throughput that albedos left.
    left: f32,
    /// Vertices in a row without a smooth lobe.
    reflections: u32,
    /// The medium in which the walk may get lost, if there is one.
    surroundings: Option<Surroundings>,
    /// Part of the walks as far away that go on.
    not_lost: f32,
}

impl Survival {
    /// State of a camera sub-path that starts. Far out in the `surroundings`, if there are any, it ends more
    /// often.
    #[must_use]
    pub const fn of_camera(roulette: Roulette, surroundings: Option<Surroundings>) -> Self {
        Self { roulette, left: 1.0, reflections: 0, surroundings, not_lost: 1.0 }
    }

    /// State of a light sub-path that starts.
    #[must_use]
    pub const fn of_light(roulette: Roulette, surroundings: Option<Surroundings>) -> Self {
        let roulette = match roulette {
            Roulette::Off => Roulette::Off,
            Roulette::Below(_) => Roulette::Below(1.0),
        };
        Self::of_camera(roulette, surroundings)
    }

    pub(crate) const fn roulette(&self) -> Roulette {
        self.roulette
    }

    /// The probability to go on at a vertex of this albedo, which may have a smooth lobe or only reflect and
    /// refract. The walk is taken to do so.
    #[inline]
    pub(crate) fn probability(&mut self, albedo: f32, is_smooth: bool) -> f32 {
        let probability = self.roulette.survival(self.left * albedo);
        self.left *= albedo / probability;
        self.reflections = if is_smooth { 0 } else { self.reflections + 1 };
        let caught = self.reflections > FREE_REFLECTIONS && self.roulette.is_on();
        if caught { REFLECTS_ON * probability } else { probability }
    }

    /// The probability to go on from a place, by how far away it is. The walk is taken to do so.
    #[inline]
    pub(crate) fn probability_at(&mut self, position: Vec3) -> f32 {
        let Some(surroundings) = self.surroundings.filter(|_| self.roulette.is_on()) else { return 1.0 };
        let before = self.not_lost;
        self.not_lost = before.min(surroundings.part_that_goes_on(position));
        self.not_lost / before
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// The probability to get past some vertices depends on the product of their albedos alone, in
        /// whatever order.
        #[test]
        fn what_is_reached_does_not_depend_on_the_order(
            albedos in prop::collection::vec(0.05_f32..1.0, 1..12), least in 0.01_f32..1.0,
        ) {
            let roulette = Roulette::Below(least);
            let mut survival = Survival::of_camera(roulette, None);
            let (mut product, mut reached) = (1.0, 1.0);
            for albedo in albedos {
                product *= albedo;
                reached *= survival.probability(albedo, true);
                prop_assert!((reached / roulette.survival(product) - 1.0).abs() < 1e-5);
                prop_assert!(survival.left >= least * (1.0 - 1e-5));
            }
        }

        #[test]
        fn photons_keep_their_power(albedos in prop::collection::vec(0.05_f32..1.0, 1..40)) {
            let mut survival = Survival::of_light(Roulette::Below(0.3), None);
            for albedo in albedos {
                prop_assert_eq!(survival.probability(albedo, true), albedo);
            }
        }

        /// The probability to get anywhere depends on the farthest place on the way alone.
        #[test]
        fn fewer_walks_go_on_the_farther_away_they_have_been(
            places in prop::collection::vec([-40.0_f32..40.0, -40.0_f32..40.0, -40.0_f32..40.0], 1..20),
            free_path in 0.01_f32..100.0,
        ) {
            let within = BoundingSphere { centre: Vec3::new(1.0, -2.0, 3.0), radius: 8.0 };
            let surroundings = Surroundings { within, free_path };
            let mut survival = Survival::of_light(Roulette::Below(0.5), Some(surroundings));
            let (mut reached, mut farthest) = (1.0, 8.0_f32);
            for place in places.into_iter().map(Vec3::from) {
                reached *= survival.probability_at(place);
                farthest = farthest.max((place - within.centre).length());
                let left = 8.0 / farthest * ((8.0 + free_path) / (farthest + free_path)).sqrt();
                prop_assert!((reached / left - 1.0).abs() < 1e-5);
            }
            let mut endless = Survival::of_light(Roulette::Off, Some(surroundings));
            prop_assert_eq!(endless.probability_at(Vec3::splat(1e9)), 1.0);
        }

        #[test]
        fn without_roulette_walks_go_on(albedo in 0.0_f32..1.0) {
            prop_assert_eq!(Survival::of_camera(Roulette::Off, None).probability(albedo, false), 1.0);
            prop_assert_eq!(Survival::of_light(Roulette::Off, None).probability(albedo, false), 1.0);
        }
    }

    #[test]
    fn a_walk_that_is_caught_ends() {
        let mut survival = Survival::of_light(Roulette::Below(0.5), None);
        let mut probabilities = (0..400).map(|_| survival.probability(1.0, false));
        assert!(probabilities.by_ref().take(256).all(|probability| probability == 1.0));
        assert!(probabilities.all(|probability| probability == 0.998));
        assert_eq!(survival.probability(1.0, true), 1.0, "a smooth lobe lets it out");
        assert_eq!(survival.probability(1.0, false), 1.0);
        let mut camera = Survival::of_camera(Roulette::Below(0.5), None);
        for _ in 0..300 {
            let _ = camera.probability(1.0, false);
        }
        assert_eq!(camera.probability(0.8, true), 1.0, "albedos count alone");
    }
}
