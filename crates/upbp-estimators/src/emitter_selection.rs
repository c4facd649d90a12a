//! A discrete distribution over emitters, by their power and by the light that they were seen to bring
//! (`docs/theory.md`, section 6.6).

use serde::{Deserialize, Serialize};

use crate::random::Decision;
use crate::scene::EmitterId;

/// Light that each emitter was seen to bring, as
/// [`choose_emitters_by`](crate::PreparedScene::choose_emitters_by) takes it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EmitterShares {
    /// Light by emitter, in any unit; emitters that are left out bring nothing.
    pub light: Vec<f64>,
    /// [Independent samples](effective_samples) that this was measured with.
    pub samples: f64,
}

/// A contribution of some emitter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmitterSample {
    /// The emitter.
    pub emitter: EmitterId,
    /// The contribution before weighting, divided by the probability that the emitter was chosen with.
    pub light: f64,
    /// All other techniques, relative to this one if it chose the emitter with a probability of one.
    pub others: f64,
}

impl EmitterShares {
    /// Shares in proportion to the light that each emitter would bring and nothing else would find, if
    /// emitters were chosen by these very shares: contributions times the square of their weights. The
    /// `probabilities` of emitters are where the search for them begins; samples of other emitters do not
    /// count.
    #[must_use]
    pub fn of(probabilities: Vec<f64>, samples: &[EmitterSample]) -> Self {
        Self::reproduced(probabilities, samples, |light| light)
    }

    /// Shares in proportion to the roots of the second moments that are left of each emitter, if emitters
    /// were chosen by these very shares: then the sum of the variances is least. Here the light of samples is
    /// the square of a contribution, divided by the probability that the emitter was chosen with. The
    /// `probabilities`, and samples of other emitters, are as in [`of`](Self::of).
    #[must_use]
    pub fn of_squares(probabilities: Vec<f64>, samples: &[EmitterSample]) -> Self {
        Self::reproduced(probabilities, samples, f64::sqrt)
    }

    /// Probabilities that reproduce themselves, as a function of the weighted light by emitter.
    fn reproduced(mut probabilities: Vec<f64>, samples: &[EmitterSample], share: fn(f64) -> f64) -> Self {
        let mut light = vec![0.0; probabilities.len()];
        let mut each = vec![0.0; samples.len()];
        for _ in 0..ROUNDS {
            light.fill(0.0);
            for (sample, each) in samples.iter().zip(&mut each) {
                let emitter = sample.emitter.0 as usize;
                let Some(probability) = probabilities.get(emitter) else { continue };
                let weight = probability / (probability + sample.others);
                *each = if weight > 0.0 { sample.light * weight * weight } else { 0.0 };
                light[emitter] += *each;
            }
            for light in &mut light {
                *light = share(*light);
            }
            let sum: f64 = light.iter().sum();
            if !(sum > 0.0 && sum.is_finite()) {
                break;
            }
            for (probability, light) in probabilities.iter_mut().zip(&light) {
                *probability = light / sum;
            }
        }
        Self { light, samples: effective_samples(each) }
    }
}

/// The number of equal samples whose sum would be as uncertain as that of these (Kish 1965): a sum that a few
/// large ones make says little, however many small ones there are.
#[must_use]
pub fn effective_samples(samples: impl IntoIterator<Item = f64>) -> f64 {
    let add = |[sum, squares]: [f64; 2], x: f64| [sum + x, squares + x * x];
    let [sum, squares] = samples.into_iter().fold([0.0; 2], add);
    let count = sum * sum / squares;
    if count.is_finite() { count } else { 0.0 }
}

/// Steps towards probabilities that reproduce themselves. More would trust the samples too far: of emitters
/// that are alike, the one that they happen to favour would take all, where another technique finds the light
/// of the others too.
const ROUNDS: u32 = 4;

/// Power and an even choice keep at least this share.
const SPREAD_SHARE: f64 = 0.1;

/// Effective samples per emitter from which on a measured share counts more than power and an even choice.
const TELLING_SAMPLES: f64 = 2.0;

/// Even part of the choice by which lights are measured, and that stays where little is known: what power
/// alone never chooses is not learnt.
const EVEN: f64 = 0.5;

/// Random numbers are multiples of 2⁻²⁴.
pub(crate) const STEPS: u32 = 1 << 24;

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

    /// The even distribution over the emitters that this one can choose, mixed with this one.
    pub(crate) fn spread(&self) -> Self {
        let count = self.cumulative.len();
        let power = |i: usize| f64::from(self.probability(EmitterId(i as u32)));
        let shining = (0..count).filter(|&i| power(i) > 0.0).count() as f64;
        let weight = |i| if power(i) > 0.0 { (1.0 - EVEN) * power(i) + EVEN / shining } else { 0.0 };
        Self::new(&(0..count).map(weight).collect::<Vec<_>>())
    }

    /// Whether this is a distribution over the emitters that `power` can choose.
    pub(crate) fn fits(&self, power: &Self) -> bool {
        let steps = |selection: &Self| {
            let starts = std::iter::once(0).chain(selection.cumulative.iter().copied());
            starts.zip(selection.cumulative.clone()).map(|(start, end)| end.cmp(&start)).collect::<Vec<_>>()
        };
        self.cumulative.last() == power.cumulative.last() && steps(self) == steps(power)
    }

    /// The distribution without some of the emitters.
    pub(crate) fn without(&self, is_left_out: impl Fn(EmitterId) -> bool) -> Self {
        let probability = |id| if is_left_out(id) { 0.0 } else { f64::from(self.probability(id)) };
        let rest: Vec<f64> = (0..self.cumulative.len()).map(|i| probability(EmitterId(i as u32))).collect();
        Self::new(&rest)
    }

    /// The number of emitters, with those that are never chosen.
    pub(crate) const fn len(&self) -> usize {
        self.cumulative.len()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.cumulative.last().is_none_or(|&end| end == 0)
    }

    /// The [spread](Self::spread) distribution with a part that follows `shares`, the larger the more samples
    /// they stand on; without any light this one.
    pub(crate) fn blend(&self, shares: &EmitterShares) -> Self {
        let spread = self.spread();
        let count = self.cumulative.len();
        let spread = |i: usize| f64::from(spread.probability(EmitterId(i as u32)));
        let light = |i: usize| match shares.light.get(i) {
            Some(&light) if light > 0.0 && spread(i) > 0.0 => light,
            _ => 0.0,
        };
        let sum: f64 = (0..count).map(light).sum();
        if !(sum > 0.0 && sum.is_finite()) {
            return self.clone();
        }
        let evidence = shares.samples / TELLING_SAMPLES;
        let shining = (0..count).filter(|&i| spread(i) > 0.0).count();
        let trust = (1.0 - SPREAD_SHARE) * evidence / (evidence + shining as f64);
        let weights: Vec<f64> =
            (0..count).map(|i| trust * light(i) / sum + (1.0 - trust) * spread(i)).collect();
        Self::new(&weights)
    }

    /// Chooses as [`choose`](Self::choose) does, by a number that is only asked for if there is a choice.
    #[inline]
    pub(crate) fn choose_by(&self, decision: Decision) -> Option<(EmitterId, f32)> {
        if self.cumulative == [STEPS] {
            return Some((EmitterId(0), 1.0));
        }
        self.choose(f64::from(decision.uniform()))
    }

    pub(crate) fn choose(&self, u: f64) -> Option<(EmitterId, f32)> {
        let target = ((u * f64::from(STEPS)) as u32).min(STEPS - 1);
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
mod tests;
