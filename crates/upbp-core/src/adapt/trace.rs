//! The sub-paths of a trial, under the eyes of any observer.

use rayon::prelude::*;
use upbp_estimators::observer::Observer;
use upbp_estimators::scene::Scene;
use upbp_estimators::walk::{Context, LightChunk, LightVertex, PhotonBeam, Scratch, Splat};
use upbp_estimators::walk::{trace_camera_path, trace_light_path};
use upbp_estimators::{Counters, LightMap, Plan, StreamKind, World};

use super::grid::Grid;

/// Sub-paths per piece of work.
pub(super) const CHUNK: usize = 16;

/// What looks at one piece of work.
pub(super) trait Piece<B>: Observer<B> + Default + Send {
    /// A sub-path has ended.
    fn path_ended(&mut self);
}

/// A pass, by pieces: light sub-paths with their splats, and one camera sub-path for each cell.
pub(super) struct Pass<O> {
    pub(super) light: Vec<(O, Vec<Splat>)>,
    pub(super) camera: Vec<O>,
    pub(super) counters: Counters,
}

impl<O> Pass<O> {
    /// Traces the sub-paths of a pass, which numbers them.
    pub(super) fn trace<S: Scene>(world: &World<'_, S>, plan: &Plan, grid: &Grid, pass: u32) -> Self
    where
        O: Piece<S::Bsdf>,
    {
        let context = Context { world, plan };
        let paths = if plan.needs_light_paths() { plan.light_paths } else { 0 };
        let chunks: Vec<_> = (0..paths.div_ceil(CHUNK as u32))
            .into_par_iter()
            .map_init(Scratch::default, |scratch, chunk| {
                let mut observer = O::default();
                let mut out = LightChunk::default();
                for index in chunk * CHUNK as u32..((chunk + 1) * CHUNK as u32).min(paths) {
                    let kind = StreamKind::PilotLight;
                    trace_light_path(&context, kind, index, scratch, &mut out, &mut observer);
                    observer.path_ended();
                }
                (out, observer)
            })
            .collect();
        let mut counters = Counters::default();
        let mut light = Vec::with_capacity(chunks.len());
        let mut vertices: Vec<LightVertex<S::Bsdf, O::Densities>> = Vec::new();
        let mut beams: Vec<PhotonBeam<O::Densities>> = Vec::new();
        for (out, observer) in chunks {
            vertices.extend(out.vertices);
            beams.extend(out.beams);
            counters.add(&out.counters);
            light.push((observer, out.splats));
        }
        let map = if plan.stores_vertices() || plan.stores_beams() {
            LightMap::build(plan, vertices, beams)
        } else {
            LightMap::empty()
        };
        let cells = grid.cells();
        let pieces: Vec<_> = (0..cells.div_ceil(CHUNK))
            .into_par_iter()
            .map_init(Scratch::default, |scratch, chunk| {
                let mut observer = O::default();
                let mut counters = Counters::default();
                for cell in chunk * CHUNK..((chunk + 1) * CHUNK).min(cells) {
                    // A number of its own for every sub-path: those of a pixel are not to be stratified among each other, so
                    // that their variance can be taken.
                    let index = u64::from(pass) << 32 | cell as u64;
                    let (kind, pixel) = (StreamKind::PilotCamera, grid.pixel(cell));
                    let counters = &mut counters;
                    trace_camera_path(&context, &map, kind, pixel, index, scratch, counters, &mut observer);
                    observer.path_ended();
                }
                (observer, counters)
            })
            .collect();
        let mut camera = Vec::with_capacity(pieces.len());
        for (observer, own) in pieces {
            counters.add(&own);
            camera.push(observer);
        }
        Self { light, camera, counters }
    }
}
