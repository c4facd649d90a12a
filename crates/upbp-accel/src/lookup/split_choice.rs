//! The decision whether segments are worth splitting.

use std::cell::Cell;

use super::closest_approach::Segment;
use super::query::Query;
use super::region::ThickRay;
use super::segment_tree::{Block, SegmentTree};
use super::split::SplitParams;
use crate::ray::Ray;
use crate::simd::Wide;

impl SplitParams {
    /// Segments per sampled one.
    const SAMPLED: usize = 16;

    /// Least and greatest size of the sample: fewer segments tell nothing, more tell nothing new.
    const SAMPLE: (usize, usize) = (64, 1024);

    /// Rays that search the sample.
    const RAYS: usize = 128;

    /// The default split, or none where searches look faster without: among beams through one place, whose
    /// pieces would all lie there, and the more so the fewer beams there are.
    ///
    /// Compares the boxes and blocks that rays between segments have to test in a sample with and without a
    /// split. Depends on nothing but the segments.
    #[must_use]
    pub fn choose<P>(segments: &[(Segment, P)]) -> Self {
        let (least, most) = Self::SAMPLE;
        let (split, whole) = (Self::default(), Self { pieces_per_segment: 1.0, ..Self::default() });
        let count = (segments.len() / Self::SAMPLED).min(most);
        if count < least {
            return split;
        }
        // Scattered: segments may repeat with a period.
        let scattered =
            |i: usize, count: usize| ((i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as usize % count;
        let stride = segments.len() / count;
        let sampled = |i: usize| (segments[i * stride + scattered(i, stride)].0, ());
        let sample: Vec<_> = (0..count).map(sampled).filter(|(segment, ())| segment.is_usable()).collect();
        let place = |i: usize| {
            let segment = sample.get(scattered(i, count))?.0;
            let part = (scattered(i + 1, 256) as f32 + 0.5) / 256.0;
            Some(segment.at(segment.start + (segment.end - segment.start) * part))
        };
        let ray = |i: usize| {
            let (a, b) = (place(2 * i)?, place(2 * i + 1)?);
            Some(Ray::new(a, (b - a).try_normalize()?).with_range(f32::NEG_INFINITY, f32::INFINITY))
        };
        let rays: Vec<_> = (0..Self::RAYS).filter_map(ray).collect();
        let effort = |params| SegmentTree::build(sample.clone(), params).effort(&rays) as f64;
        // The gain by pieces grows about with this power of the number of segments; their memory asks for a
        // gain of at least 1.45.
        let more = (segments.len() as f64 / count as f64).powf(0.1);
        if effort(whole) * more >= effort(split) * 1.45 { split } else { whole }
    }
}

/// A query that finds nothing, but counts blocks.
struct CountBlocks<'a>(&'a Cell<u64>);

impl Query<Block> for CountBlocks<'_> {
    type Found = ();

    #[inline(always)]
    fn test<W: Wide>(&self, _: W, _: &Block) -> (u32, ()) {
        self.0.set(self.0.get() + 1);
        (0, ())
    }

    #[inline(always)]
    fn report(&mut self, _: &Block, (): &(), _: usize) {}
}

impl<P> SegmentTree<P> {
    /// The number of nodes and leaves that rays without width have to look at, and twice that of blocks.
    fn effort(&self, rays: &[Ray]) -> u64 {
        let blocks = Cell::new(0);
        let search = |ray| self.tree.search(ThickRay::new(ray, 0.0_f32, 0.0), CountBlocks(&blocks));
        rays.iter().map(|ray| u64::from(search(ray))).sum::<u64>() + blocks.get()
    }
}
