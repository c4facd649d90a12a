//! The passes of one iteration, in parallel, with a result that does not depend on the number of threads.
//!
//! Work is cut into pieces of fixed size, and what pieces return is put together in their order: a reduction by work stealing
//! would change the last bits with the schedule.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;
use upbp_estimators::scene::{PixelRect, Scene};
use upbp_estimators::walk::{Context, LightChunk, LightVertex, PhotonBeam, Scratch, Splat};
use upbp_estimators::walk::{trace_camera_path, trace_light_path};
use upbp_estimators::{Counters, Layer, LightMap, Spectrum, StreamKind};

use crate::film::Pixel;

/// Light sub-paths per piece of work.
const LIGHT_CHUNK: u32 = 1024;

/// What the light pass leaves.
pub(crate) struct LightPass<B> {
    pub(crate) vertices: Vec<LightVertex<B>>,
    pub(crate) beams: Vec<PhotonBeam>,
    pub(crate) splats: Vec<Vec<Splat>>,
    pub(crate) counters: Counters,
}

/// Traces all light sub-paths of the plan.
pub(crate) fn light_pass<S: Scene>(
    context: &Context<'_, S>,
    kind: StreamKind,
    cancelled: &AtomicBool,
) -> LightPass<S::Bsdf> {
    let paths = if context.plan.needs_light_paths() { context.plan.light_paths } else { 0 };
    let chunks: Vec<LightChunk<S::Bsdf>> = (0..paths.div_ceil(LIGHT_CHUNK))
        .into_par_iter()
        .map_init(Scratch::default, |scratch, chunk| {
            let mut out = LightChunk::default();
            let first = chunk * LIGHT_CHUNK;
            for index in first..(first + LIGHT_CHUNK).min(paths) {
                if index % 64 == 0 && cancelled.load(Ordering::Relaxed) {
                    break;
                }
                trace_light_path(context, kind, index, scratch, &mut out, &mut ());
            }
            out
        })
        .collect();
    let mut pass = LightPass {
        vertices: Vec::with_capacity(chunks.iter().map(|c| c.vertices.len()).sum()),
        beams: Vec::with_capacity(chunks.iter().map(|c| c.beams.len()).sum()),
        splats: Vec::with_capacity(chunks.len()),
        counters: Counters::default(),
    };
    for chunk in chunks {
        pass.vertices.extend(chunk.vertices);
        pass.beams.extend(chunk.beams);
        pass.splats.push(chunk.splats);
        pass.counters.add(&chunk.counters);
    }
    pass
}

/// Traces one camera sub-path per pixel of `rect` into `pixels`.
pub(crate) fn camera_pass<S: Scene>(
    context: &Context<'_, S>,
    map: &LightMap<S::Bsdf>,
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
                    &mut (),
                );
                *pixel = walk.layers;
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

/// Adds the splats of light tracing, in the order of the light sub-paths.
pub(crate) fn add_splats(rect: PixelRect, splats: &[Vec<Splat>], pixels: &mut [Pixel]) {
    for splat in splats.iter().flatten() {
        let [x, y] = [splat.pixel[0] - rect.x, splat.pixel[1] - rect.y];
        let pixel = &mut pixels[y as usize * rect.width as usize + x as usize];
        pixel[Layer::Bpt as usize] += splat.value;
    }
}

/// A black buffer for one iteration.
pub(crate) fn black(rect: PixelRect) -> Vec<Pixel> {
    vec![[Spectrum::ZERO; Layer::COUNT]; rect.width as usize * rect.height as usize]
}
