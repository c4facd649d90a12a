//! Renders: their errors over time.

use upbp_core::{ErrorPoint, RenderError, Renderer, Settings, Start, Stop};

use crate::subject::Subject;

/// Ratio of the numbers of iterations at which errors are taken.
const SPACING: f64 = 1.1;
/// Seconds of a turn.
const TURN: f64 = 0.1;

/// A render that is prepared for a number of seconds and has not begun.
pub(crate) fn prepare(
    subject: &Subject,
    settings: Settings,
    seconds: f64,
) -> Result<Renderer<'_>, RenderError> {
    let stop = Stop { seconds: Some(seconds), ..Stop::default() };
    // For the check of its size: errors are taken below.
    let start = Start { stop, reference: Some(subject.reference.clone()), ..Start::default() };
    subject.scene.start_renderer(settings.validate()?, start)
}

/// Renders each for some time and takes errors after iterations at geometric distances, and after the last
/// one. Seconds are those of rendering, the preparation included; taking errors does not count.
///
/// They take turns: the speed of a machine that others use changes within seconds, and so it does for all of
/// them alike.
pub(crate) fn measure(subject: &Subject, renderers: Vec<Renderer<'_>>, seconds: f64) -> Vec<Vec<ErrorPoint>> {
    let mut lines: Vec<Line<'_>> =
        renderers.into_iter().map(|renderer| Line::new(subject, renderer)).collect();
    let mut turn_ends = 0.0;
    while lines.iter().any(|line| !line.done) {
        turn_ends += TURN;
        for line in lines.iter_mut().filter(|line| !line.done) {
            line.go_on(turn_ends, seconds);
        }
    }
    lines.into_iter().map(|line| line.points).collect()
}

/// A render with what was measured of it so far.
struct Line<'a> {
    subject: &'a Subject,
    renderer: Renderer<'a>,
    points: Vec<ErrorPoint>,
    /// The number of iterations at which the next error is taken.
    next: u64,
    preparation: f64,
    done: bool,
}

impl<'a> Line<'a> {
    fn new(subject: &'a Subject, renderer: Renderer<'a>) -> Self {
        let preparation = renderer.state().seconds().total();
        Self { subject, renderer, points: Vec::new(), next: 1, preparation, done: false }
    }

    /// Goes on until `until` seconds are taken, of `limit` in all.
    fn go_on(&mut self, until: f64, limit: f64) {
        loop {
            let seconds = self.renderer.state().seconds().total();
            let iterations = self.renderer.film().iterations();
            // As near to the limit as whole iterations come.
            let one = (seconds - self.preparation) / iterations.max(1) as f64;
            self.done = iterations > 0 && seconds + 0.5 * one > limit;
            if iterations >= self.next || self.done {
                self.points.push(self.renderer.state().error_against(&self.subject.reference));
                self.next = ((iterations as f64 * SPACING) as u64).max(iterations + 1);
            }
            if self.done || seconds >= until && iterations > 0 {
                return;
            }
            self.renderer.iterate();
        }
    }
}
