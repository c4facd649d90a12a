//! The time that techniques take.

use std::time::{Duration, Instant};

use upbp_estimators::Technique;
use upbp_estimators::observer::Observer;

use super::recorder::TECHNIQUES;

/// What time is spent on: techniques by their number, then the walk itself.
pub(crate) const PARTS: usize = TECHNIQUES + 1;
/// The walk itself.
pub(crate) const WALK: usize = TECHNIQUES;

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

impl Default for Watch {
    fn default() -> Self {
        Self { last: Instant::now(), on: WALK, nanoseconds: [0.0; PARTS], turns: [0; PARTS] }
    }
}

impl<B> Observer<B> for Watch {
    type Densities = f64;

    fn turns_to(&mut self, technique: Option<Technique>) {
        let now = Instant::now();
        let spent = now.duration_since(self.last);
        if spent < INTERRUPTION {
            self.nanoseconds[self.on] += spent.as_secs_f64() * 1e9;
            self.turns[self.on] += 1;
        }
        self.last = now;
        self.on = technique.map_or(WALK, |technique| technique as usize);
    }
}

impl Watch {
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
