//! What a trial writes down: every sample, every look-up, and the time that they took.

use std::time::{Duration, Instant};

use upbp_estimators::observer::{ObservedSample, Observer};
use upbp_estimators::{Spectrum, Technique};

/// The number of techniques.
pub(crate) const TECHNIQUES: usize = Technique::ALL.len();
/// What time is spent on: techniques by their number, then the walk itself.
pub(crate) const PARTS: usize = TECHNIQUES + 1;
/// The walk itself.
pub(crate) const WALK: usize = TECHNIQUES;

/// A sample as the observer sees it.
#[derive(Clone, Copy)]
pub(crate) struct Seen {
    /// The camera sub-path or, for a splat, the light sub-path.
    pub(crate) path: u32,
    pub(crate) technique: Technique,
    /// Before weighting.
    pub(crate) value: Spectrum,
    pub(crate) weight: f64,
}

/// Writes down what the walks of one piece of work do.
pub(crate) struct Recorder {
    /// The sub-path at hand.
    pub(crate) path: u32,
    pub(crate) samples: Vec<Seen>,
    /// How often a technique was turned to.
    pub(crate) calls: [u64; TECHNIQUES],
    pub(crate) watch: Option<Watch>,
}

impl Recorder {
    /// With a stop watch or without.
    pub(crate) fn new(timed: bool) -> Self {
        Self { path: 0, samples: Vec::new(), calls: [0; TECHNIQUES], watch: timed.then(Watch::start) }
    }

    /// A new sub-path begins.
    pub(crate) fn begin(&mut self, path: u32) {
        self.path = path;
        if let Some(watch) = &mut self.watch {
            watch.turn(WALK);
        }
    }
}

impl<B> Observer<B> for Recorder {
    fn turns_to(&mut self, technique: Option<Technique>) {
        if let Some(technique) = technique {
            self.calls[technique as usize] += 1;
        }
        if let Some(watch) = &mut self.watch {
            watch.turn(technique.map_or(WALK, |technique| technique as usize));
        }
    }

    fn sample(&mut self, sample: &ObservedSample<B>) {
        let ObservedSample { technique, value, weight, .. } = *sample;
        self.samples.push(Seen { path: self.path, technique, value, weight });
    }
}

/// Time by what it was spent on.
pub(crate) struct Watch {
    last: Instant,
    on: usize,
    /// Nanoseconds by part.
    nanoseconds: [f64; PARTS],
    /// Turns by part that ended.
    turns: [u64; PARTS],
}

/// A longer stretch was an interruption by another program: techniques take microseconds.
const INTERRUPTION: Duration = Duration::from_micros(300);

impl Watch {
    fn start() -> Self {
        Self { last: Instant::now(), on: WALK, nanoseconds: [0.0; PARTS], turns: [0; PARTS] }
    }

    fn turn(&mut self, to: usize) {
        let now = Instant::now();
        let spent = now.duration_since(self.last);
        if spent < INTERRUPTION {
            self.nanoseconds[self.on] += spent.as_secs_f64() * 1e9;
            self.turns[self.on] += 1;
        }
        self.last = now;
        self.on = to;
    }

    /// Nanoseconds by part, without what looking at the clock takes. The stretch at hand does not count.
    pub(crate) fn net(&self) -> [f64; PARTS] {
        let look = Self::cost_of_a_look();
        std::array::from_fn(|i| (self.nanoseconds[i] - look * self.turns[i] as f64).max(0.0))
    }

    fn cost_of_a_look() -> f64 {
        const LOOKS: u32 = 64;
        // The least of a few: interruptions only make it longer.
        let once = || {
            let start = Instant::now();
            for _ in 0..LOOKS {
                std::hint::black_box(Instant::now());
            }
            start.elapsed().as_secs_f64() * 1e9 / f64::from(LOOKS)
        };
        (0..4).map(|_| once()).fold(f64::INFINITY, f64::min)
    }
}
