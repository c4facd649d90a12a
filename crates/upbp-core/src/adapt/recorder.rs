//! What a trial writes down: every sample with the parts of all techniques in its weight, every look-up.

use glam::Vec3;
use upbp_estimators::Technique;
use upbp_estimators::mis::ByTechnique;
use upbp_estimators::observer::{Joint, ObservedSample, Observer};

/// The number of techniques.
pub(crate) const TECHNIQUES: usize = Technique::ALL.len();

/// Samples that a trial may have, of 64 bytes each.
pub(super) const MOST_SAMPLES: usize = 1 << 20;

/// A sample, weighted as when everything runs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) technique: Technique,
    /// The light sub-path whose photon or beam was merged.
    pub(crate) merged: Option<u32>,
    pub(crate) value: Vec3,
    /// Parts of all techniques in the weights of its path; they sum to one.
    pub(crate) shares: [f32; TECHNIQUES],
}

/// Writes down what the walks of one piece of work do.
#[derive(Default)]
pub(crate) struct Recorder {
    /// Samples; `ends[i]` is behind the last one of the i-th sub-path.
    pub(crate) samples: Vec<Sample>,
    pub(crate) ends: Vec<u32>,
    /// Samples, those included that would have been [too many](MOST_SAMPLES).
    pub(super) seen: usize,
    /// How often a technique was turned to.
    pub(crate) calls: [u64; TECHNIQUES],
}

impl<B> Observer<B> for Recorder {
    type Densities = ByTechnique;

    fn turns_to(&mut self, technique: Option<Technique>) {
        if let Some(technique) = technique {
            self.calls[technique as usize] += 1;
        }
    }

    fn sample(&mut self, sample: &ObservedSample<B, ByTechnique>) {
        let ObservedSample { technique, ref joint, value, weight, .. } = *sample;
        self.seen += 1;
        if self.seen > MOST_SAMPLES {
            return;
        }
        let total = weight.all.0.iter().sum::<f64>();
        self.samples.push(Sample {
            technique,
            merged: if let Joint::Merge { path, .. } = joint { Some(*path) } else { None },
            value: Vec3::from((value * weight.value() as f32).to_array()),
            shares: weight.all.0.map(|density| (density / total) as f32),
        });
    }
}
