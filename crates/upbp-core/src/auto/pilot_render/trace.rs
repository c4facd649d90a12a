//! The sub-paths of a trial, under the eyes of any observer.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use upbp_estimators::observer::Observer;
use upbp_estimators::path::{Context, LightChunk, LightVertex, PhotonBeam, Scratch, Splat};
use upbp_estimators::scene::Scene;
use upbp_estimators::trace::{trace_camera_path, trace_light_path};
use upbp_estimators::{Counters, LightMap, Plan, StreamKind, World};

use super::PASSES;
use super::grid::Grid;
use crate::budget::Halt;

/// Sub-paths per piece of work.
pub(super) const CHUNK: usize = 16;

/// What looks at one piece of work.
pub(super) trait Piece<B>: Observer<B> + Default + Send {
    /// A sub-path has ended.
    fn path_ended(&mut self);

    /// Samples that were written down.
    fn written(&self) -> usize;
}

/// Room for samples, common to all pieces of a trial, as long as it is not halted. Whether it suffices does not depend on the order of
/// the pieces.
pub(super) struct Room<'a> {
    taken: AtomicUsize,
    most: usize,
    halt: &'a Halt<'a>,
}

impl<'a> Room<'a> {
    pub(super) const fn new(most: usize, halt: &'a Halt<'a>) -> Self {
        Self { taken: AtomicUsize::new(0), most, halt }
    }

    /// Takes room for more samples; whether there was enough.
    fn take(&self, samples: usize) -> bool {
        samples <= self.most && self.taken.fetch_add(samples, Ordering::Relaxed) + samples <= self.most
    }
}

/// Lets `observer` see sub-paths one after the other, as long as there is room for what it writes down.
fn watch<O: Piece<B>, B>(
    observer: &mut O,
    room: &Room<'_>,
    paths: impl IntoIterator<Item = u32>,
    mut trace: impl FnMut(u32, &mut O),
) -> Option<()> {
    for path in paths {
        if room.halt.now() {
            return None;
        }
        let before = observer.written();
        trace(path, observer);
        observer.path_ended();
        if !room.take(observer.written() - before) {
            return None;
        }
    }
    Some(())
}

/// A pass, by pieces: light sub-paths with their splats, and one camera sub-path for each cell.
pub(super) struct Pass<O> {
    pub(super) light: Vec<(O, Vec<Splat>)>,
    pub(super) camera: Vec<O>,
    pub(super) counters: Counters,
}

impl<O> Pass<O> {
    /// Traces the sub-paths of a pass, which numbers them; `None` if there is not enough room.
    pub(super) fn trace<S: Scene>(
        world: &World<'_, S>,
        plan: &Plan,
        grid: &Grid,
        pass: u32,
        room: &Room<'_>,
    ) -> Option<Self>
    where
        O: Piece<S::Bsdf>,
    {
        let context = Context { world, plan };
        let paths = if plan.needs_light_paths() { plan.light_paths } else { 0 };
        let chunks: Vec<_> = pieces(paths)
            .into_par_iter()
            .map_init(Scratch::default, |scratch, paths| {
                let mut observer = O::default();
                let mut out = LightChunk::default();
                watch(&mut observer, room, paths, |index, observer| {
                    trace_light_path(&context, StreamKind::PilotLight, index, scratch, &mut out, observer);
                })?;
                Some((out, observer))
            })
            .collect::<Option<_>>()?;
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
        let chunks: Vec<_> = pieces(grid.cells())
            .into_par_iter()
            .map_init(Scratch::default, |scratch, cells| {
                let mut observer = O::default();
                let mut counters = Counters::default();
                watch(&mut observer, room, cells, |cell, observer| {
                    // Passes of a trial begin alike: what they differ in is what stratification leaves.
                    let index = u64::from(pass / PASSES) << 32 | u64::from(cell);
                    let (kind, pixel) = (StreamKind::PilotCamera, grid.pixel(cell));
                    let counters = &mut counters;
                    trace_camera_path(&context, &map, kind, pixel, index, scratch, counters, observer);
                })?;
                Some((observer, counters))
            })
            .collect::<Option<_>>()?;
        let mut camera = Vec::with_capacity(chunks.len());
        for (observer, own) in chunks {
            counters.add(&own);
            camera.push(observer);
        }
        Some(Self { light, camera, counters })
    }
}

/// Numbers of sub-paths, by piece.
fn pieces(paths: u32) -> Vec<Range<u32>> {
    (0..paths).step_by(CHUNK).map(|first| first..(first + CHUNK as u32).min(paths)).collect()
}
