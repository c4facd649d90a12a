//! Chromatic media.

use glam::Vec3;
use upbp_estimators::Spectrum;
use upbp_media::{Medium, PhaseFunction, RaySegment, SegmentDensity};

/// A homogeneous medium that chooses among its channels with probabilities of its own.
#[derive(Clone, Debug)]
pub struct Fog {
    /// Absorption coefficients per channel, per unit of length.
    pub sigma_a: [f32; 3],
    /// Scattering coefficients per channel, per unit of length.
    pub sigma_s: [f32; 3],
    /// Mean cosine of the scattering angle per channel.
    pub g: [f32; 3],
    /// Radiance that is emitted per length.
    pub glow: Spectrum,
    phase: PhaseFunction,
}

impl Fog {
    /// Probabilities that a distance follows each channel.
    pub const ALPHA: [f64; 3] = [0.5, 0.2, 0.3];

    /// Probability to go on after a collision.
    pub const CONTINUATION: f64 = 0.9;

    /// Fog of these coefficients that scatters by Henyey and Greenstein.
    pub fn new(sigma_a: [f32; 3], sigma_s: [f32; 3], g: f32) -> Self {
        let phase = PhaseFunction::henyey_greenstein(g).expect("in range");
        Self { sigma_a, sigma_s, g: [g; 3], glow: Spectrum::ZERO, phase }
    }

    /// The same with a mean cosine for each channel.
    #[must_use]
    pub fn with_mean_cosines(self, g: [f32; 3]) -> Self {
        let lobes = g.map(|g| PhaseFunction::henyey_greenstein(g).expect("in range"));
        Self { g, phase: PhaseFunction::per_channel(lobes), ..self }
    }

    /// Extinction coefficients per channel, per unit of length.
    pub fn extinction(&self) -> [f64; 3] {
        [0, 1, 2].map(|channel| f64::from(self.sigma_a[channel] + self.sigma_s[channel]))
    }
}

impl Medium for Fog {
    fn scatters(&self) -> bool {
        self.sigma_s != [0.0; 3]
    }

    fn segment(&self, segment: &RaySegment) -> SegmentDensity {
        let sigma = self.extinction();
        let passing = sigma.map(|sigma| (-sigma * segment.length_f64().min(f64::MAX)).exp());
        let transmittance = Spectrum::from_array(passing.map(|t| t as f32));
        if !self.scatters() {
            return SegmentDensity::passing(transmittance);
        }
        let mean = |f: [f64; 3]| f.iter().zip(Self::ALPHA).map(|(f, alpha)| f * alpha).sum::<f64>();
        let stop = mean([0, 1, 2].map(|channel| sigma[channel] * passing[channel]));
        SegmentDensity {
            transmittance,
            pass_probability: mean(passing),
            stop_at_end: stop,
            stop_at_start: stop,
        }
    }

    fn sample_distance(&self, segment: &RaySegment, u_channel: f32, u_distance: f32) -> Option<f32> {
        let [first, second, _] = Self::ALPHA;
        let u = f64::from(u_channel);
        let sigma = self.extinction()[usize::from(u >= first) + usize::from(u >= first + second)];
        let t = f64::from(segment.start) - f64::ln_1p(-f64::from(u_distance)) / sigma;
        (self.scatters() && t < f64::from(segment.end)).then(|| (t as f32).min(segment.end.next_down()))
    }

    fn lane_extinctions(&self) -> Option<Spectrum> {
        self.scatters().then(|| self.sigma_t(Vec3::ZERO))
    }

    fn segment_lanes(&self, segment: &RaySegment) -> SegmentDensity<[f64; 3]> {
        let transmittance = self.segment(segment).transmittance;
        if !self.scatters() {
            return SegmentDensity::passing(transmittance);
        }
        let sigma = self.extinction();
        let passing = sigma.map(|sigma| (-sigma * segment.length_f64().min(f64::MAX)).exp());
        let stop = [0, 1, 2].map(|lane| sigma[lane] * passing[lane]);
        SegmentDensity::symmetric(transmittance, passing, stop)
    }

    fn sample_lane(&self, segment: &RaySegment, lane: usize, [_, u]: [f32; 2]) -> Option<f32> {
        let t = f64::from(segment.start) - f64::ln_1p(-f64::from(u)) / self.extinction()[lane];
        (self.scatters() && t < f64::from(segment.end)).then(|| (t as f32).min(segment.end.next_down()))
    }

    fn sigma_s(&self, _: Vec3) -> Spectrum {
        self.sigma_s.into()
    }

    fn sigma_t(&self, _: Vec3) -> Spectrum {
        Spectrum::from_array(self.extinction().map(|sigma| sigma as f32))
    }

    fn phase(&self) -> &PhaseFunction {
        &self.phase
    }

    fn emits(&self) -> bool {
        !self.glow.is_black()
    }

    fn emitted(&self, segment: &RaySegment) -> Spectrum {
        let length = segment.length_f64();
        let sigma = self.extinction();
        let emitted =
            [0, 1, 2].map(|c| f64::from(self.glow[c]) / sigma[c] * -f64::exp_m1(-sigma[c] * length));
        Spectrum::from_array(emitted.map(|x| x as f32))
    }

    fn source(&self, _: Vec3) -> Spectrum {
        self.glow
    }

    fn continuation(&self, _: Vec3) -> f32 {
        Self::CONTINUATION as f32
    }

    fn mean_free_path(&self) -> f32 {
        1.0 / self.sigma_t(Vec3::ZERO).mean()
    }
}
