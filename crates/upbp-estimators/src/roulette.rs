//! Russian roulette: which walks end before they leave the scene.

use serde::{Deserialize, Serialize};

/// Rule by which sub-paths end early (`docs/theory.md`, section 6.8).
///
/// Every vertex tells a probability to [continue](crate::scene::Bsdf::continuation), its albedo. Light
/// sub-paths go on with just that probability, so that all photons carry the same power. What a camera vertex
/// finds differs by more than its albedo anyway, and first vertices matter most; so camera sub-paths go on
/// with certainty until the product of their albedos falls below a threshold, and hold it from then on.
///
/// Walks of both kinds may be caught inside of clear glass, where total reflection never lets them out: after
/// many vertices in a row that only reflect or refract, two in a thousand end at each further one.
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

/// The roulette of one walk.
#[derive(Clone, Copy, Debug)]
pub struct Survival {
    roulette: Roulette,
    /// Part of the throughput that albedos left.
    left: f32,
    /// Vertices in a row without a smooth lobe.
    reflections: u32,
}

impl Survival {
    /// State of a camera sub-path that starts.
    #[must_use]
    pub const fn of_camera(roulette: Roulette) -> Self {
        Self { roulette, left: 1.0, reflections: 0 }
    }

    /// State of a light sub-path that starts.
    #[must_use]
    pub const fn of_light(roulette: Roulette) -> Self {
        let roulette = match roulette {
            Roulette::Off => Roulette::Off,
            Roulette::Below(_) => Roulette::Below(1.0),
        };
        Self { roulette, left: 1.0, reflections: 0 }
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
            let mut survival = Survival::of_camera(roulette);
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
            let mut survival = Survival::of_light(Roulette::Below(0.3));
            for albedo in albedos {
                prop_assert_eq!(survival.probability(albedo, true), albedo);
            }
        }

        #[test]
        fn without_roulette_walks_go_on(albedo in 0.0_f32..1.0) {
            prop_assert_eq!(Survival::of_camera(Roulette::Off).probability(albedo, false), 1.0);
            prop_assert_eq!(Survival::of_light(Roulette::Off).probability(albedo, false), 1.0);
        }
    }

    #[test]
    fn a_walk_that_is_caught_ends() {
        let mut survival = Survival::of_light(Roulette::Below(0.5));
        let mut probabilities = (0..400).map(|_| survival.probability(1.0, false));
        assert!(probabilities.by_ref().take(256).all(|probability| probability == 1.0));
        assert!(probabilities.all(|probability| probability == 0.998));
        assert_eq!(survival.probability(1.0, true), 1.0, "a smooth lobe lets it out");
        assert_eq!(survival.probability(1.0, false), 1.0);
        let mut camera = Survival::of_camera(Roulette::Below(0.5));
        for _ in 0..300 {
            let _ = camera.probability(1.0, false);
        }
        assert_eq!(camera.probability(0.8, true), 1.0, "albedos count alone");
    }
}
