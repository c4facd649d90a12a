//! The emitters that sub-paths begin at, and how often.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::emission_guide::EmissionGuide;
use crate::scene::{BoundingSphere, EmitterId};

/// The probabilities of emitters: part of a plan, so that iterations on all machines choose alike.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EmitterChoice {
    /// Where light sub-paths start.
    pub(crate) emission: Selection,
    /// Where camera vertices look for light.
    pub(crate) next_event: Selection,
    /// Where on an emitter, and in which direction, light sub-paths start; emitters that are left out have no
    /// guide.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) guides: Vec<Option<EmissionGuide>>,
    /// Where the rays of most guided starts pass: light from infinity starts on discs around it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) focus: Option<Vec3>,
}

impl EmitterChoice {
    pub(crate) fn guide(&self, emitter: EmitterId) -> Option<&EmissionGuide> {
        self.guides.get(emitter.0 as usize)?.as_ref()
    }

    /// The sphere that light from infinity has to start in front of: around the focus, and about all of
    /// `bounds`. So starts that lead to the focus have one place on the disc, whatever their direction.
    pub(crate) fn emission_bounds(&self, bounds: &BoundingSphere) -> BoundingSphere {
        self.focus.map_or(*bounds, |centre| BoundingSphere {
            centre,
            radius: bounds.radius + centre.distance(bounds.centre),
        })
    }
}

/// Light that each emitter was seen to bring, as
/// [`choose_emitters_by`](crate::PreparedScene::choose_emitters_by) takes it.
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
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub(crate) struct Selection {
    /// Running sums of the probabilities, in units of the random numbers: what is chosen with these has
    /// exactly the probability that it is said to have, and whatever shines is chosen at all.
    cumulative: Vec<u32>,
}

impl Selection {
    pub(crate) fn new(powers: &[f64]) -> Self {
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

    /// Whether this is a distribution over the emitters that `power` can choose.
    pub(crate) fn fits(&self, power: &Self) -> bool {
        let steps = |selection: &Self| {
            let starts = std::iter::once(0).chain(selection.cumulative.iter().copied());
            starts.zip(selection.cumulative.clone()).map(|(start, end)| end.cmp(&start)).collect::<Vec<_>>()
        };
        self.cumulative.last() == power.cumulative.last() && steps(self) == steps(power)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.cumulative.last().is_none_or(|&end| end == 0)
    }

    /// This distribution with a part that follows `shares`, the larger the more samples they stand on.
    pub(crate) fn blend(&self, shares: &EmitterShares) -> Self {
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

    pub(crate) fn choose(&self, u: f32) -> Option<(EmitterId, f32)> {
        let target = (u * STEPS as f32) as u32;
        let index = self.cumulative.partition_point(|&end| end <= target);
        let emitter = EmitterId(u32::try_from(index).ok()?);
        (index < self.cumulative.len()).then(|| (emitter, self.probability(emitter)))
    }

    pub(crate) fn probability(&self, emitter: EmitterId) -> f32 {
        let index = emitter.0 as usize;
        let Some(&end) = self.cumulative.get(index) else { return 0.0 };
        let start = if index == 0 { 0 } else { self.cumulative[index - 1] };
        end.saturating_sub(start) as f32 / STEPS as f32
    }
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

    #[test]
    fn a_choice_of_other_emitters_does_not_fit() {
        let power = Selection::new(&[0.0, 1.0, 3.0]);
        let given = |ends: &[u32]| Selection { cumulative: ends.to_vec() }.fits(&power);
        assert!(given(&[0, 1, STEPS]));
        assert!(!given(&[0, STEPS]), "fewer");
        assert!(!given(&[1, 2, STEPS]), "a dark one");
        assert!(!given(&[0, 0, STEPS]), "one left out");
        assert!(!given(&[0, 9, 5]), "not ascending");
        assert!(!given(&[0, 1, 2]), "not a whole");
    }
}
