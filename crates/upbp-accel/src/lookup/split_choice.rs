//! The decision whether segments are worth splitting.

use super::closest_approach::Segment;
use super::radius::SearchRadius;
use super::segment_tree::SegmentTree;
use super::split::SplitParams;
use crate::ray::Ray;

impl SplitParams {
    /// Segments per sampled one.
    const SAMPLED: usize = 8;

    /// Least and greatest size of the sample: fewer segments tell nothing, more take longer than they save.
    const SAMPLE: (usize, usize) = (64, 4096);

    /// Rays that search the sample.
    const RAYS: usize = 128;

    /// The default split, or none where searches within `radius` look faster without: among beams through one
    /// place, whose pieces would all lie there, and the more so the fewer beams there are, and among beams
    /// that are not much longer than the radius.
    ///
    /// Compares what rays between segments have to look at in a sample with and without a split. Depends on
    /// nothing but the segments and the radius. The default, too, for fewer than 512 segments, and where rays
    /// find nothing to look at: without a positive radius, or if all segments are at one point.
    #[must_use]
    pub fn choose(segments: &[(Segment, u32)], radius: impl Into<SearchRadius>) -> Self {
        let radius = radius.into();
        let (least, most) = Self::SAMPLE;
        let count = (segments.len() / Self::SAMPLED).min(most);
        if count < least {
            return Self::default();
        }
        // Scattered: segments may repeat with a period.
        let scattered =
            |i: usize, count: usize| ((i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as usize % count;
        let stride = segments.len() / count;
        let sampled = |i: usize| segments[i * stride + scattered(i, stride)];
        let sample: Vec<_> = (0..count).map(sampled).filter(|(segment, _)| segment.is_usable()).collect();
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
        let effort = |params| {
            let tree = SegmentTree::build(sample.clone(), params);
            rays.iter().map(|ray| f64::from(tree.around_ray(ray, radius, |_, _| ()))).sum::<f64>()
        };
        // The part of the work that pieces save grows about with this power of the number of segments. A
        // fifth, carried over from the sample to all, pays for their memory.
        let more = (segments.len() as f64 / count as f64).powf(0.1);
        if effort(Self::WHOLE) * more >= effort(Self::default()) * 1.25 {
            Self::default()
        } else {
            Self::WHOLE
        }
    }
}
