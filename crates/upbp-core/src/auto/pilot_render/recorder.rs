//! Samples with the weights of all techniques, and counts of work, as the walks of a pilot render make them.

use std::ops::Range;

use glam::{Vec2, Vec3};
use upbp_estimators::mis;
use upbp_estimators::mis::Densities;
use upbp_estimators::observer::{Completion, LightEnd, ObservedSample, ObservedVertex, Observer};
use upbp_estimators::scene::CameraRay;
use upbp_estimators::{PerTechnique, Technique};

use crate::auto::parallel_walks::SampleRoom;
use crate::auto::roulette;

/// The least weight of a technique that can find a path. A connection through a hundred mean free paths has
/// next to no value, and no other technique has a weight there that single precision could divide by: that
/// must not look as if only connections found this light.
const LEAST_WEIGHT: f64 = 1e-30;

/// A sample, weighted as when everything runs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) technique: Technique,
    /// The light sub-path that was merged, or whose splat it is.
    pub(crate) light_path: Option<u32>,
    pub(crate) value: Vec3,
    /// Product of the albedos of the camera vertices that scattered before.
    pub(crate) albedos: f32,
    /// [Weights](mis_weights) of all techniques on its path; they sum to one.
    pub(crate) weights: PerTechnique<f32>,
}

/// Counts of camera sub-paths' work, by the number of a roulette.
pub(crate) type ByRoulette = [f64; roulette::COUNT];

/// Samples and work of one piece of sub-paths.
#[derive(Default)]
pub(crate) struct Recorder {
    pub(crate) samples: Vec<Sample>,
    /// Ends of samples: `ends[i]` is behind the last one of the i-th sub-path.
    ends: Vec<u32>,
    /// Samples, those included that would have been too many.
    seen: usize,
    /// Samples that there is room for.
    most: usize,
    /// Edges of camera sub-paths.
    pub(crate) edges: ByRoulette,
    /// Calls of each technique.
    pub(crate) calls: PerTechnique<ByRoulette>,
    /// Nodes, leaves and blocks of trees over photons that the queries of each technique looked at.
    pub(crate) tests: PerTechnique<ByRoulette>,
    /// Product of the albedos of the camera sub-path at hand.
    albedos: f32,
    /// Camera sub-paths that would be here, by the number of a roulette.
    passed: ByRoulette,
}

impl<B> Observer<B> for Recorder {
    type Densities = mis::ByTechnique;

    fn light_end(&mut self, _: u32, _: &LightEnd) {
        self.passed = [1.0; roulette::COUNT];
    }

    fn camera_end(&mut self, _: Vec2, _: &CameraRay) {
        self.albedos = 1.0;
        self.edge();
    }

    fn camera_vertex(&mut self, vertex: &ObservedVertex<B>) {
        self.albedos *= vertex.albedo;
        self.edge();
    }

    fn call(&mut self, technique: Technique, tests: u32) {
        let i = technique as usize;
        add(&mut self.calls[i], &self.passed);
        add(&mut self.tests[i], &self.passed.map(|passed| passed * f64::from(tests)));
    }

    fn sample(&mut self, sample: &ObservedSample<B, mis::ByTechnique>) {
        let ObservedSample { technique, ref completion, value, weight, .. } = *sample;
        self.seen += 1;
        if self.seen > self.most {
            return;
        }
        let light_path = if let Completion::Merge { path, .. } = completion { Some(*path) } else { None };
        self.samples.push(Sample {
            technique,
            light_path,
            albedos: self.albedos,
            value: Vec3::from((value * weight.value() as f32).to_array()),
            weights: mis_weights(&weight.all),
        });
    }
}

/// Weights of all techniques by the balance heuristic: their parts in the sum of all densities.
pub(crate) fn mis_weights(densities: &mis::ByTechnique) -> PerTechnique<f32> {
    let total = densities.total();
    densities.of.map(|density| if density > 0.0 { (density / total).max(LEAST_WEIGHT) as f32 } else { 0.0 })
}

impl Recorder {
    /// Traces a sub-path under the eyes of this recorder; whether there is room for its samples.
    pub(super) fn record(&mut self, room: &SampleRoom, trace: impl FnOnce(&mut Self)) -> bool {
        let before = self.seen;
        self.most = room.most();
        trace(self);
        self.ends.push(self.samples.len() as u32);
        room.take(self.seen - before)
    }

    /// The samples of the i-th sub-path.
    pub(super) fn of_path(&self, i: usize) -> &[Sample] {
        &self.samples[self.range(i)]
    }

    /// The places of the samples of each sub-path.
    pub(super) fn ranges(&self) -> impl Iterator<Item = Range<usize>> {
        (0..self.ends.len()).map(|i| self.range(i))
    }

    fn range(&self, i: usize) -> Range<usize> {
        let start = if i == 0 { 0 } else { self.ends[i - 1] };
        start as usize..self.ends[i] as usize
    }

    /// Another edge of a camera sub-path.
    fn edge(&mut self) {
        self.passed = passed(self.albedos);
        add(&mut self.edges, &self.passed);
    }
}

/// Camera sub-paths that get past vertices with this product of albedos, relative to those of the pilot
/// render.
pub(super) fn passed(albedos: f32) -> ByRoulette {
    std::array::from_fn(|number| f64::from(roulette::relative_pass_probability(number, albedos)))
}

pub(super) fn add(sum: &mut ByRoulette, more: &ByRoulette) {
    for (sum, more) in sum.iter_mut().zip(more) {
        *sum += more;
    }
}
