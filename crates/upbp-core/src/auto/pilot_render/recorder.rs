//! What a trial writes down: every sample with the parts of all techniques in its weight, every look-up.

use glam::Vec3;
use upbp_estimators::Technique;
use upbp_estimators::mis::{ByTechnique, Densities};
use upbp_estimators::observer::{Joint, LightEnd, ObservedSample, ObservedVertex, Observer};

use super::roulette;

/// The number of techniques.
pub(crate) const TECHNIQUES: usize = Technique::ALL.len();

/// Samples that a trial may have, of 72 bytes each.
pub(super) const MOST_SAMPLES: usize = 1 << 20;

/// A sample, weighted as when everything runs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) technique: Technique,
    /// The light sub-path whose photon or beam was merged.
    pub(crate) merged: Option<u32>,
    pub(crate) value: Vec3,
    /// Product of the albedos of the camera vertices that scattered before.
    pub(crate) albedos: f32,
    /// Parts of all techniques in the weights of its path; they sum to one.
    pub(crate) shares: [f32; TECHNIQUES],
}

/// What camera sub-paths do, by the number of a roulette.
pub(crate) type ByRoulette = [f64; roulette::COUNT];

/// Writes down what the walks of one piece of work do.
#[derive(Default)]
pub(crate) struct Recorder {
    /// Samples; `ends[i]` is behind the last one of the i-th sub-path.
    pub(crate) samples: Vec<Sample>,
    pub(crate) ends: Vec<u32>,
    /// Samples, those included that would have been [too many](MOST_SAMPLES).
    pub(super) seen: usize,
    /// Edges of camera sub-paths.
    pub(crate) edges: ByRoulette,
    /// How often a technique was turned to.
    pub(crate) calls: [ByRoulette; TECHNIQUES],
    /// The camera sub-path at hand.
    albedos: f32,
    reach: ByRoulette,
}

impl<B> Observer<B> for Recorder {
    type Densities = ByTechnique;

    fn light_end(&mut self, _: u32, _: &LightEnd) {
        self.reach = [1.0; roulette::COUNT];
    }

    fn camera_end(&mut self, _: Vec3, _: Vec3, _: f32) {
        self.albedos = 1.0;
        self.edge();
    }

    fn camera_vertex(&mut self, vertex: &ObservedVertex<B>) {
        self.albedos *= vertex.albedo;
        self.edge();
    }

    fn turns_to(&mut self, technique: Option<Technique>) {
        if let Some(technique) = technique {
            add(&mut self.calls[technique as usize], &self.reach);
        }
    }

    fn sample(&mut self, sample: &ObservedSample<B, ByTechnique>) {
        let ObservedSample { technique, ref joint, value, weight, .. } = *sample;
        self.seen += 1;
        if self.seen > MOST_SAMPLES {
            return;
        }
        let total = weight.all.total();
        let merged = if let Joint::Merge { path, .. } = joint { Some(*path) } else { None };
        self.samples.push(Sample {
            technique,
            merged,
            albedos: self.albedos,
            value: Vec3::from((value * weight.value() as f32).to_array()),
            shares: weight.all.of.map(|density| (density / total) as f32),
        });
    }
}

impl Recorder {
    /// Another edge of a camera sub-path.
    fn edge(&mut self) {
        self.reach = reach(self.albedos);
        add(&mut self.edges, &self.reach);
    }
}

/// How many camera sub-paths get past vertices with this product of albedos, relative to the trial's.
pub(super) fn reach(albedos: f32) -> ByRoulette {
    std::array::from_fn(|number| f64::from(roulette::relative_reach(number, albedos)))
}

pub(super) fn add(sum: &mut ByRoulette, more: &ByRoulette) {
    for (sum, more) in sum.iter_mut().zip(more) {
        *sum += more;
    }
}
