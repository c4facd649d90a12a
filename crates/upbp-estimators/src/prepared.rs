//! A scene made ready for the walks: emitters with their probabilities, bounds, the bodies around the camera.

use upbp_media::{Medium, MediumStack, RaySegment, SegmentDensity};

use crate::scene::{BoundingSphere, Camera, Emitter, EmitterId, EmitterKind, Scene};

/// A [`Scene`] with all that is derived from it once.
pub struct PreparedScene<'a, S: Scene> {
    /// The scene.
    pub scene: &'a S,
    /// Its bounds.
    pub bounds: BoundingSphere,
    /// By power.
    power: Selection,
    emission: Selection,
    next_event: Selection,
    environments: Vec<EmitterId>,
    passes_from_infinity: f64,
    camera_stack: Option<MediumStack>,
    emitting_media: bool,
    dense_media: bool,
}

impl<'a, S: Scene> PreparedScene<'a, S> {
    /// Looks at the scene once: emitters' powers, bounds, the camera's surroundings.
    ///
    /// # Errors
    /// Bounds that are not positive and finite, a power that is negative or not finite, a crop outside of the
    /// film, a medium that does not exist around the scene.
    pub fn new(scene: &'a S) -> Result<Self, PrepareError> {
        let bounds = scene.bounds();
        if !(bounds.radius > 0.0 && bounds.radius.is_finite() && bounds.centre.is_finite()) {
            return Err(PrepareError::Bounds { centre: bounds.centre.to_array(), radius: bounds.radius });
        }
        if let Some(outside) = scene.outside()
            && outside.0 as usize >= scene.media().len()
        {
            return Err(PrepareError::Outside { medium: outside.0, media: scene.media().len() });
        }
        let camera = scene.camera();
        let (width, height) = camera.resolution();
        let crop = camera.crop();
        let inside = |start: u32, size: u32, whole: u32| {
            size > 0 && start.checked_add(size).is_some_and(|end| end <= whole)
        };
        if !inside(crop.x, crop.width, width) || !inside(crop.y, crop.height, height) {
            return Err(PrepareError::Crop { width, height });
        }
        let everything =
            RaySegment { origin: bounds.centre, direction: glam::Vec3::Z, start: 0.0, end: f32::INFINITY };
        let from_infinity = scene
            .outside()
            .map_or(SegmentDensity::VACUUM, |medium| scene.media()[medium.0 as usize].segment(&everything));
        // No light from infinity gets through: such emitters are never chosen.
        let closed = from_infinity.transmittance.is_black();
        let mut powers = Vec::with_capacity(scene.emitters().len());
        let mut environments = Vec::new();
        for (index, emitter) in scene.emitters().iter().enumerate() {
            let power = emitter.power(&bounds);
            if !(power.is_finite() && power >= 0.0) {
                return Err(PrepareError::Power { emitter: index, power });
            }
            let reaches = !(closed && emitter.kind().is_infinite());
            powers.push(if reaches { f64::from(power) } else { 0.0 });
            if reaches && power > 0.0 && emitter.kind() == EmitterKind::Environment {
                environments.push(EmitterId(index as u32));
            }
        }
        let camera_stack = camera
            .is_pinhole()
            .then(|| {
                let centre = glam::Vec2::new(
                    crop.x as f32 + 0.5 * crop.width as f32,
                    crop.y as f32 + 0.5 * crop.height as f32,
                );
                // Ahead of the pinhole, which may stand on a boundary.
                camera.ray(centre, [0.5; 2]).map(|ray| {
                    scene.stack_at(upbp_accel::offset_origin(ray.origin, ray.direction, ray.direction))
                })
            })
            .flatten();
        let emitting_media = scene.media().iter().any(Medium::emits);
        let dense = |medium: &S::Medium| !(medium.mean_free_path() > DENSE * bounds.radius);
        let dense_media = scene.media().iter().any(|medium| medium.scatters() && dense(medium));
        let power = Selection::new(&powers);
        let (emission, next_event) = (power.clone(), power.clone());
        Ok(Self {
            scene,
            bounds,
            power,
            emission,
            next_event,
            environments,
            passes_from_infinity: from_infinity.pass_probability,
            camera_stack,
            emitting_media,
            dense_media,
        })
    }

    /// Chooses emitters by what they bring instead of by power: `emission` where light sub-paths start,
    /// `next_event` where camera vertices look for light. Either way the choice must not depend on samples
    /// that it serves.
    ///
    /// Power keeps a share, so that no emitter is lost that was not seen.
    pub fn choose_emitters_by(&mut self, emission: &EmitterShares, next_event: &EmitterShares) {
        self.emission = self.power.blend(emission);
        self.next_event = self.power.blend(next_event);
    }

    /// Chooses the emitter of a light sub-path; returns its probability. `None` without light.
    #[must_use]
    pub fn choose_emission(&self, u: f32) -> Option<(EmitterId, f32)> {
        self.emission.choose(u)
    }

    /// The probability of [`choose_emission`](Self::choose_emission); 0 if the emitter does not exist.
    #[must_use]
    pub fn emission_probability(&self, emitter: EmitterId) -> f32 {
        self.emission.probability(emitter)
    }

    /// Chooses the emitter of a next event; returns its probability. `None` without light.
    #[must_use]
    pub fn choose_next_event(&self, u: f32) -> Option<(EmitterId, f32)> {
        self.next_event.choose(u)
    }

    /// The probability of [`choose_next_event`](Self::choose_next_event); 0 if the emitter does not exist.
    #[must_use]
    pub fn next_event_probability(&self, emitter: EmitterId) -> f32 {
        self.next_event.probability(emitter)
    }

    /// The emitters that every escaping ray hits.
    #[must_use]
    pub fn environments(&self) -> &[EmitterId] {
        &self.environments
    }

    /// Whether any emitter can be chosen.
    #[must_use]
    pub fn has_emitters(&self) -> bool {
        !self.power.is_empty()
    }

    /// The probability that a walk passes an infinite length of the medium around everything.
    #[must_use]
    pub(crate) const fn passes_from_infinity(&self) -> f64 {
        self.passes_from_infinity
    }

    /// Whether any medium emits light.
    #[must_use]
    pub const fn has_emitting_media(&self) -> bool {
        self.emitting_media
    }

    /// Whether any medium is so dense that rounding often puts a vertex in it on the other side of its
    /// boundary. A ray that is followed to the next surface or to infinity finds out; one that is followed to
    /// the next collision does not.
    #[must_use]
    pub const fn has_dense_media(&self) -> bool {
        self.dense_media
    }

    /// The bodies around a point of the lens.
    #[must_use]
    pub fn stack_at_camera(&self, lens: glam::Vec3) -> MediumStack {
        self.camera_stack.clone().unwrap_or_else(|| self.scene.stack_at(lens))
    }
}

/// Media whose mean free path is a smaller part of the scene's radius are dense: of their vertices next to a
/// boundary, one in ten thousand is within rounding of it.
const DENSE: f32 = 1e-3;

/// Light that each emitter was seen to bring, as [`PreparedScene::choose_emitters_by`] takes it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EmitterShares {
    /// Light by emitter, in any unit; emitters that are left out bring nothing.
    pub light: Vec<f64>,
    /// Samples that this was measured with.
    pub samples: f64,
}

/// Power keeps at least this share of a choice.
const POWER_SHARE: f64 = 0.1;

/// Samples per emitter from which on a measured share counts more than power.
const TELLING_SAMPLES: f64 = 16.0;

/// Random numbers are multiples of 2⁻²⁴.
const STEPS: u32 = 1 << 24;

/// No light gets less than this part of an even share: it may be all that some corner of the scene sees.
const LEAST_OF_EVEN_SHARE: f64 = 0.01;

/// A discrete distribution over emitters.
#[derive(Clone, Debug)]
struct Selection {
    /// Running sums of the probabilities, in units of the random numbers: what is chosen with these has
    /// exactly the probability that it is said to have, and whatever shines is chosen at all.
    cumulative: Vec<u32>,
}

impl Selection {
    fn new(powers: &[f64]) -> Self {
        let total: f64 = powers.iter().sum();
        let mut waiting = powers.iter().filter(|power| **power > 0.0).count();
        let least = LEAST_OF_EVEN_SHARE / waiting as f64;
        let share = |power: f64| if power > 0.0 { (power / total).max(least) } else { 0.0 };
        let shares: f64 = powers.iter().copied().map(share).sum();
        let (mut sum, mut end) = (0.0, 0_u32);
        let cumulative = powers
            .iter()
            .map(|&power| {
                if power > 0.0 {
                    sum += share(power);
                    waiting -= 1;
                    let last = STEPS.saturating_sub(waiting as u32);
                    let next = ((sum / shares * f64::from(STEPS)).round() as u32).max(end + 1);
                    end = if waiting == 0 { STEPS } else { next.min(last) };
                }
                end
            })
            .collect();
        Self { cumulative }
    }

    fn is_empty(&self) -> bool {
        self.cumulative.last().is_none_or(|&end| end == 0)
    }

    /// This distribution with a part that follows `shares`, the larger the more samples they stand on.
    fn blend(&self, shares: &EmitterShares) -> Self {
        let count = self.cumulative.len();
        let power = |i: usize| f64::from(self.probability(EmitterId(i as u32)));
        let light = |i: usize| match shares.light.get(i) {
            Some(&light) if light > 0.0 && power(i) > 0.0 => light,
            _ => 0.0,
        };
        let sum: f64 = (0..count).map(light).sum();
        if !(sum > 0.0 && sum.is_finite()) {
            return self.clone();
        }
        let evidence = shares.samples / TELLING_SAMPLES;
        let trust = (1.0 - POWER_SHARE) * evidence / (evidence + count as f64);
        let weights: Vec<f64> =
            (0..count).map(|i| trust * light(i) / sum + (1.0 - trust) * power(i)).collect();
        Self::new(&weights)
    }

    fn choose(&self, u: f32) -> Option<(EmitterId, f32)> {
        let target = (u * STEPS as f32) as u32;
        let index = self.cumulative.partition_point(|&end| end <= target);
        let emitter = EmitterId(u32::try_from(index).ok()?);
        (index < self.cumulative.len()).then(|| (emitter, self.probability(emitter)))
    }

    fn probability(&self, emitter: EmitterId) -> f32 {
        let index = emitter.0 as usize;
        let Some(&end) = self.cumulative.get(index) else { return 0.0 };
        let start = if index == 0 { 0 } else { self.cumulative[index - 1] };
        end.saturating_sub(start) as f32 / STEPS as f32
    }
}

/// A fault of a scene as a whole.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PrepareError {
    /// Bounds.
    #[error(
        "bounds of the scene: expected a finite centre and a positive finite radius, found {centre:?} and {radius}"
    )]
    Bounds {
        /// Centre that was given.
        centre: [f32; 3],
        /// Radius that was given.
        radius: f32,
    },
    /// Power of an emitter.
    #[error("emitter {emitter}: expected a finite power >= 0, found {power}")]
    Power {
        /// Index of the emitter.
        emitter: usize,
        /// Its power.
        power: f32,
    },
    /// Crop of the camera.
    #[error("crop: expected a non-empty part of the film of {width} x {height} pixels")]
    Crop {
        /// Width of the film.
        width: u32,
        /// Height of the film.
        height: u32,
    },
    /// The medium around everything.
    #[error("medium around the scene: index {medium}, but there are {media} media")]
    Outside {
        /// The index.
        medium: u32,
        /// The number of media.
        media: usize,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn emitters_are_chosen_in_proportion_and_dark_ones_never() {
        let selection = Selection::new(&[0.0, 1.0, 0.0, 3.0, 0.0]);
        assert_eq!(selection.choose(0.0), Some((EmitterId(1), 0.25)));
        assert_eq!(selection.choose(0.249), Some((EmitterId(1), 0.25)));
        assert_eq!(selection.choose(0.25), Some((EmitterId(3), 0.75)));
        assert_eq!(selection.choose(1.0 - f32::EPSILON / 2.0), Some((EmitterId(3), 0.75)));
        assert_eq!(Selection::new(&[]).choose(0.5), None);
        assert_eq!(Selection::new(&[0.0]).choose(0.5), None);
        assert_eq!(selection.probability(EmitterId(9)), 0.0);
    }

    #[test]
    fn shares_move_the_choice_and_power_keeps_a_floor() {
        let power = Selection::new(&[0.0, 1.0, 0.0, 3.0]);
        let seen = |light: &[f64], samples| EmitterShares { light: light.to_vec(), samples };
        let probabilities = |shares| {
            let blend = power.blend(&shares);
            [0, 1, 2, 3].map(|i| blend.probability(EmitterId(i)))
        };
        // All the light comes from the weaker one, and there is no doubt about it. What is dark stays out.
        let [dark, weak, _, strong] = probabilities(seen(&[5.0, 2.0, 0.0, 0.0], 1e9));
        assert_eq!(dark, 0.0);
        assert!((weak - 0.925).abs() < 1e-6 && (strong - 0.075).abs() < 1e-6, "{weak}, {strong}");
        // Nothing seen, or nothing that is a number: power decides.
        for shares in [seen(&[], 1e9), seen(&[0.0; 4], 1e9), seen(&[0.0, f64::NAN, 0.0, f64::INFINITY], 1.0)]
        {
            assert_eq!(probabilities(shares), [0.0, 0.25, 0.0, 0.75]);
        }
        // A few samples say little.
        let [_, weak, ..] = probabilities(seen(&[0.0, 1.0], 4.0));
        assert!((0.25..0.35).contains(&weak), "{weak}");
    }

    #[test]
    fn probabilities_are_exact_whatever_the_ratio_of_powers() {
        let many = vec![1e-3; 100_000];
        for powers in [&[1.0, 1e-12][..], &[1e-12, 1.0], &[1e-30, 0.0, 1e30, 1e-30], &[5.0, 1e12, 3.0], &many]
        {
            let selection = Selection::new(powers);
            let mut counts = vec![0_u32; powers.len()];
            for step in 0..STEPS {
                let (emitter, _) = selection.choose(step as f32 / STEPS as f32).unwrap();
                counts[emitter.0 as usize] += 1;
            }
            for (i, (&power, &count)) in powers.iter().zip(&counts).enumerate() {
                assert_eq!(power > 0.0, count > 0, "{i}");
                let probability = selection.probability(EmitterId(i as u32));
                assert_eq!(probability, count as f32 / STEPS as f32, "{i}");
            }
        }
        // The strong one gets what its power is worth.
        assert!(Selection::new(&[1.0, 1e-12]).probability(EmitterId(0)) > 0.99);
    }
}
