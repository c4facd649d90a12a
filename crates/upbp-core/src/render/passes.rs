//! The passes of one iteration, in parallel, with a result that does not depend on the number of threads.
//!
//! Light sub-paths are cut into pieces whose size does not depend on the number of threads, and what pieces
//! return is put together in their order: a reduction by work stealing would change the last bits with the
//! schedule. Pixels are independent of each other, however they are cut.

use std::iter::repeat_with;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;
use upbp_estimators::observer::NoObserver;
use upbp_estimators::path::{Context, LightChunk, Scratch, Splat};
use upbp_estimators::scene::{PixelRect, Scene};
use upbp_estimators::trace::{trace_camera_path, trace_light_path};
use upbp_estimators::{Counters, Features, LightMap, StreamKind, pixel_index};
use upbp_media::Lanes;

use crate::auto::memory_limit::LightCounts;
use crate::deadline::Halt;
use crate::film::Pixel;
use crate::film::pixel_sets::set_of;
use crate::parallel::do_all;

/// Most light sub-paths per piece of work.
const LIGHT_CHUNK: u32 = 64;
/// Vertices or beams that a piece of work is expected to leave at most, unless one sub-path leaves more: few
/// long sub-paths are work for all threads, too.
const LIGHT_CHUNK_ITEMS: f64 = 4096.0;
/// Most pixels per piece of work.
const CAMERA_CHUNK: usize = 64;

/// Traces all light sub-paths of the plan, and hands their splats over in the order of the sub-paths.
/// `expected` is how many vertices and beams there will be, as far as anyone knows; the lists of `all` are
/// used again. `None` if it was halted: then the splats mean nothing.
///
/// Pieces are traced in waves, whose buffers are emptied into the lists and used again: so there is never
/// more than a fraction of all in two places.
pub(crate) fn light_pass<S: Scene, L: Lanes>(
    context: &Context<'_, S>,
    expected: &LightCounts,
    mut all: LightChunk<S::Bsdf, f64, L>,
    halt: &Halt<'_>,
    mut take_splats: impl FnMut(&[Splat]),
) -> Option<LightChunk<S::Bsdf, f64, L>> {
    let paths = context.plan.traced_light_paths();
    let items = expected.vertices.max(expected.beams) / f64::from(paths.max(1));
    let chunk = ((LIGHT_CHUNK_ITEMS / items) as u32).clamp(1, LIGHT_CHUNK);
    let chunks = paths.div_ceil(chunk);
    // Enough for each thread that none waits long for the last one.
    let threads = rayon::current_num_threads() as u32;
    let wave = (chunks / 32).clamp(16 * threads, 256 * threads);
    let mut buffers: Vec<LightChunk<S::Bsdf, f64, L>> = Vec::new();
    buffers.resize_with(wave.min(chunks) as usize, LightChunk::default);
    all.vertices.clear();
    all.beams.clear();
    // A little more than expected. What cannot be had at once may still turn out not to be needed.
    let _ = all.vertices.try_reserve_exact((1.05 * expected.vertices) as usize);
    let _ = all.beams.try_reserve_exact((1.05 * expected.beams) as usize);
    for start in (0..chunks).step_by(wave as usize) {
        let buffers = &mut buffers[..(chunks - start).min(wave) as usize];
        let done =
            do_all((start..chunks).zip(&mut *buffers), |scratch: &mut Scratch<S::Bsdf, L>, (piece, out)| {
                let first = piece * chunk;
                for index in first..first.saturating_add(chunk).min(paths) {
                    if halt.now() {
                        return false;
                    }
                    trace_light_path(context, StreamKind::Light, index, scratch, out, &mut NoObserver);
                }
                true
            });
        if !done {
            return None;
        }
        for out in buffers {
            all.vertices.append(&mut out.vertices);
            all.beams.append(&mut out.beams);
            all.counters.add(&std::mem::take(&mut out.counters));
            take_splats(&out.splats);
            out.splats.clear();
        }
    }
    Some(all)
}

/// Room for one iteration.
pub(crate) struct Buffers<'b> {
    /// Radiance of each pixel.
    pub(crate) pixels: &'b mut [Pixel],
    /// Features of each pixel, or nothing if they are not wanted.
    pub(crate) features: &'b mut [Features],
}

/// Traces one camera sub-path for each pixel of `rect` that belongs to one of `sets`, and adds it to
/// the buffers. `None` if it was halted: then the pixels of these sets mean nothing.
pub(crate) fn camera_pass<S: Scene, L: Lanes>(
    context: &Context<'_, S>,
    map: &LightMap<S::Bsdf, f64, L>,
    rect: PixelRect,
    sets: &Range<u32>,
    Buffers { pixels, features }: Buffers<'_>,
    halt: &Halt<'_>,
) -> Option<Counters> {
    let width = rect.width as usize;
    // A small crop is work for all threads, too.
    let chunk_size = (pixels.len() / (16 * rayon::current_num_threads())).clamp(1, CAMERA_CHUNK);
    // None of them if there is no room for any.
    let features = features.chunks_mut(chunk_size).chain(repeat_with(Default::default));
    let chunks = pixels.chunks_mut(chunk_size).zip(features).enumerate();
    // Integers: the same in whatever order they are added.
    let sum = Mutex::new(Counters::default());
    let done = do_all(chunks, |scratch: &mut Scratch<S::Bsdf, L>, (chunk, (pixels, features))| {
        let (mut counters, mut traced) = (Counters::default(), false);
        for (i, pixel) in pixels.iter_mut().enumerate() {
            let place = chunk * chunk_size + i;
            let (column, row) = (place % width, place / width);
            if !sets.contains(&set_of(column, row)) {
                continue;
            }
            if halt.now() {
                return false;
            }
            traced = true;
            let place = [rect.x + column as u32, rect.y + row as u32];
            let stream = context.plan.stream(StreamKind::Camera, pixel_index(place));
            let walk =
                trace_camera_path(context, map, stream, place, scratch, &mut counters, &mut NoObserver);
            for (sum, value) in pixel.layers.iter_mut().zip(walk.layers) {
                *sum += value;
            }
            pixel.seen += walk.seen;
            if let Some(own) = features.get_mut(i) {
                *own = walk.features;
            }
        }
        // Of few sets most pieces have no pixel.
        if traced {
            sum.lock().unwrap_or_else(PoisonError::into_inner).add(&counters);
        }
        true
    });
    done.then(|| sum.into_inner().unwrap_or_else(PoisonError::into_inner))
}

/// Makes pixels black.
pub(crate) fn blacken(pixels: &mut [Pixel]) {
    pixels.par_iter_mut().with_min_len(1024).for_each(|pixel| *pixel = Pixel::BLACK);
}

/// Adds splats of light tracing, in their order.
pub(crate) fn add_splats(rect: PixelRect, splats: &[Splat], pixels: &mut [Pixel]) {
    for splat in splats {
        let [x, y] = [splat.pixel[0] - rect.x, splat.pixel[1] - rect.y];
        let pixel = &mut pixels[y as usize * rect.width as usize + x as usize];
        pixel.add_splat(splat.value);
    }
}
