//! Sub-paths of pilots, traced in parallel with a result that does not depend on the number of threads.

use std::sync::atomic::{AtomicUsize, Ordering};

use upbp_estimators::mis::ByTechnique;
use upbp_estimators::observer::DynObserver;
use upbp_estimators::path::{Context, LightChunk, Scratch};
use upbp_estimators::scene::{PixelRect, Scene};
use upbp_estimators::trace::{trace_camera_path, trace_light_path};
use upbp_estimators::{Counters, LightMap, StreamKind};
use upbp_media::Lanes;

use crate::deadline::Halt;
use crate::parallel::do_all;

/// Sub-paths per piece of work.
pub(super) const PIECE: usize = 16;

/// A run before the first iteration. Each has random numbers of its own, so that none is judged by those that
/// what it uses was made of; passes of a pilot render begin alike.
#[derive(Clone, Copy)]
pub(super) enum PilotRun {
    /// [Statistics](super::statistics).
    Statistics,
    /// A round of [measuring emitters](super::emitters).
    Emitters { round: u32 },
    /// A pass over [volumes that emit](super::volumes).
    Volumes { pass: u32 },
    /// A pass of a [pilot render](super::pilot_render).
    Render { pass: u32 },
}

impl PilotRun {
    /// The iteration that its random numbers are those of. Camera sub-paths of iterations that differ in
    /// their lower 32 bits only [begin alike](upbp_estimators::StreamKind::PilotCamera).
    pub(super) const fn iteration(self) -> u64 {
        let [kind, part, pass] = match self {
            Self::Statistics => [0, 0, 0],
            Self::Emitters { round } => [1, round, 0],
            Self::Volumes { pass } => [2, pass, 0],
            Self::Render { pass } => [3, 0, pass],
        };
        (part as u64) << 34 | (kind as u64) << 32 | pass as u64
    }
}

/// Traces sub-paths by number, with an output for each piece of [`PIECE`] sub-paths. `None` if it was halted,
/// or if `trace` breaks off by `false`.
pub(super) fn in_pieces<B: Copy, L: Lanes, O: Default + Send>(
    paths: u32,
    halt: &Halt<'_>,
    trace: impl Fn(u32, &mut Scratch<B, L>, &mut O) -> bool + Sync,
) -> Option<Vec<O>> {
    let firsts = (0..paths).step_by(PIECE);
    let mut outs: Vec<O> = firsts.clone().map(|_| O::default()).collect();
    let done = do_all(firsts.zip(&mut outs), |scratch: &mut Scratch<B, L>, (first, out)| {
        let mut piece = first..first.saturating_add(PIECE as u32).min(paths);
        piece.all(|path| !halt.now() && trace(path, scratch, out))
    });
    done.then_some(outs)
}

/// Room for samples, common to all pieces of a run. Whether it suffices does not depend on the order of the
/// pieces.
pub(super) struct SampleRoom {
    taken: AtomicUsize,
    most: usize,
}

impl SampleRoom {
    pub(super) const fn new(most: usize) -> Self {
        Self { taken: AtomicUsize::new(0), most }
    }

    /// The number of samples that there is room for.
    pub(super) const fn most(&self) -> usize {
        self.most
    }

    /// The part of the room that is taken.
    pub(super) fn taken(&self) -> f64 {
        self.taken.load(Ordering::Relaxed) as f64 / self.most as f64
    }

    /// Takes room for more samples; whether there was enough.
    pub(super) fn take(&self, samples: usize) -> bool {
        samples <= self.most && self.taken.fetch_add(samples, Ordering::Relaxed) + samples <= self.most
    }
}

/// The observer of all pilots: their walks carry the densities of every technique, even where only places
/// matter, so that they are compiled for one type of observers beside that of renders.
pub(super) type PilotObserver<'a, B> = DynObserver<'a, B, ByTechnique>;

/// Traces a camera sub-path of a pilot.
pub(super) fn camera_path<S: Scene, L: Lanes>(
    context: &Context<'_, S>,
    map: &LightMap<S::Bsdf, ByTechnique, L>,
    pixel: [u32; 2],
    index: u64,
    scratch: &mut Scratch<S::Bsdf, L>,
    counters: &mut Counters,
    observer: &mut PilotObserver<'_, S::Bsdf>,
) {
    let stream = context.plan.stream(StreamKind::PilotCamera, index);
    trace_camera_path(context, map, stream, pixel, scratch, counters, observer);
}

/// Traces a light sub-path of a pilot.
pub(super) fn light_path<S: Scene, L: Lanes>(
    context: &Context<'_, S>,
    index: u32,
    scratch: &mut Scratch<S::Bsdf, L>,
    out: &mut LightChunk<S::Bsdf, ByTechnique, L>,
    observer: &mut PilotObserver<'_, S::Bsdf>,
) {
    trace_light_path(context, StreamKind::PilotLight, index, scratch, out, observer);
}

/// Steps of a sequence that fills the unit square evenly, from its beginning on (Roberts's R2).
pub(super) const EVEN_STEPS: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];

/// A pixel of a sequence of which each first part, however short, is spread over the picture.
pub(super) fn pixel(crop: PixelRect, index: u64) -> [u32; 2] {
    let [u, v] = EVEN_STEPS.map(|step| (0.5 + index as f64 * step).fract());
    let place = |u: f64, size: u32| ((u * f64::from(size)) as u32).min(size - 1);
    [crop.x + place(u, crop.width), crop.y + place(v, crop.height)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_first_part_of_the_pixels_is_spread_over_the_picture() {
        for (width, height) in [(640, 360), (7680, 4320), (7919, 100), (1, 4000)] {
            let crop = PixelRect { x: 3, y: 5, width, height };
            for (pixels, cells) in [(16, 2), (128, 6), (2048, 24)] {
                let mut found = std::collections::BTreeSet::new();
                for index in 0..pixels {
                    let [x, y] = pixel(crop, index);
                    assert!((3..3 + width).contains(&x) && (5..5 + height).contains(&y));
                    found.insert([(x - 3) * cells / width, (y - 5) * cells / height]);
                }
                let expected = width.min(cells) * height.min(cells);
                assert_eq!(found.len(), expected as usize, "{pixels} of {width} x {height}");
            }
        }
    }
}
