//! The passes of one iteration, in parallel, with a result that does not depend on the number of threads.
//!
//! Work is cut into pieces of fixed size, and what pieces return is put together in their order: a reduction by work stealing
//! would change the last bits with the schedule.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;
use upbp_estimators::mis::Densities;
use upbp_estimators::observer::Nobody;
use upbp_estimators::scene::{PixelRect, Scene};
use upbp_estimators::walk::{Context, LightChunk, LightVertex, PhotonBeam, Scratch, Splat};
use upbp_estimators::walk::{trace_camera_path, trace_light_path};
use upbp_estimators::{Counters, Layer, LightMap, Spectrum, StreamKind};

use crate::film::Pixel;
use crate::memory::LightCounts;

/// Light sub-paths per piece of work.
const LIGHT_CHUNK: u32 = 64;

/// Lists that are used again in the next iteration: the allocator need not find a use for what was given back to it.
pub(crate) struct Lists<B, D = f64> {
    pub(crate) vertices: Vec<LightVertex<B, D>>,
    pub(crate) beams: Vec<PhotonBeam<D>>,
}

impl<B, D> Default for Lists<B, D> {
    fn default() -> Self {
        Self { vertices: Vec::new(), beams: Vec::new() }
    }
}

/// Traces all light sub-paths of the plan into `lists`, and hands their splats over in the order of the sub-paths. `expected` is how many
/// vertices and beams there will be, as far as anyone knows.
///
/// Pieces are traced in waves, whose buffers are emptied into the lists and used again: so there is never more than a
/// fraction of all in two places.
pub(crate) fn light_pass<S: Scene, D: Densities>(
    context: &Context<'_, S>,
    kind: StreamKind,
    expected: &LightCounts,
    lists: &mut Lists<S::Bsdf, D>,
    cancelled: &AtomicBool,
    mut take_splats: impl FnMut(&[Splat]),
) -> Counters {
    let paths = if context.plan.needs_light_paths() { context.plan.light_paths } else { 0 };
    let chunks = paths.div_ceil(LIGHT_CHUNK);
    // Enough for each thread that none waits long for the last one.
    let threads = rayon::current_num_threads() as u32;
    let wave = (chunks / 32).clamp(16 * threads, 256 * threads);
    let mut buffers: Vec<LightChunk<S::Bsdf, D>> = Vec::new();
    buffers.resize_with(wave.min(chunks) as usize, LightChunk::default);
    let mut counters = Counters::default();
    lists.vertices.clear();
    lists.beams.clear();
    // A little more than expected. What cannot be had at once may still turn out not to be needed.
    let _ = lists.vertices.try_reserve_exact((1.05 * expected.vertices) as usize);
    let _ = lists.beams.try_reserve_exact((1.05 * expected.beams) as usize);
    for start in (0..chunks).step_by(wave as usize) {
        let buffers = &mut buffers[..(chunks - start).min(wave) as usize];
        buffers.par_iter_mut().enumerate().for_each_init(Scratch::default, |scratch, (i, out)| {
            if cancelled.load(Ordering::Relaxed) {
                return;
            }
            let first = (start + i as u32) * LIGHT_CHUNK;
            let nobody = &mut Nobody::default();
            for index in first..first.saturating_add(LIGHT_CHUNK).min(paths) {
                trace_light_path(context, kind, index, scratch, out, nobody);
            }
        });
        for out in buffers {
            lists.vertices.append(&mut out.vertices);
            lists.beams.append(&mut out.beams);
            counters.add(&std::mem::take(&mut out.counters));
            take_splats(&out.splats);
            out.splats.clear();
        }
    }
    counters
}

/// Traces one camera sub-path per pixel of `rect` and adds it to `pixels`.
pub(crate) fn camera_pass<S: Scene, D: Densities>(
    context: &Context<'_, S>,
    map: &LightMap<S::Bsdf, D>,
    rect: PixelRect,
    pixels: &mut [Pixel],
    cancelled: &AtomicBool,
) -> Counters {
    let rows: Vec<Counters> = pixels
        .par_chunks_mut(rect.width as usize)
        .enumerate()
        .map_init(Scratch::default, |scratch, (row, pixels)| {
            let mut counters = Counters::default();
            if cancelled.load(Ordering::Relaxed) {
                return counters;
            }
            for (column, pixel) in pixels.iter_mut().enumerate() {
                let place = [rect.x + column as u32, rect.y + row as u32];
                // Addressed by the place on the whole film: a crop shows the same samples as the whole picture.
                let index = u64::from(place[1]) << 32 | u64::from(place[0]);
                let walk = trace_camera_path(
                    context,
                    map,
                    StreamKind::Camera,
                    place,
                    index,
                    scratch,
                    &mut counters,
                    &mut Nobody::default(),
                );
                for (sum, value) in pixel.iter_mut().zip(walk.layers) {
                    *sum += value;
                }
            }
            counters
        })
        .collect();
    let mut counters = Counters::default();
    for row in &rows {
        counters.add(row);
    }
    counters
}

/// Adds splats of light tracing, in their order.
pub(crate) fn add_splats(rect: PixelRect, splats: &[Splat], pixels: &mut [Pixel]) {
    for splat in splats {
        let [x, y] = [splat.pixel[0] - rect.x, splat.pixel[1] - rect.y];
        let pixel = &mut pixels[y as usize * rect.width as usize + x as usize];
        pixel[Layer::Bpt as usize] += splat.value;
    }
}

/// A black pixel.
pub(crate) const BLACK: Pixel = [Spectrum::ZERO; Layer::COUNT];
