//! The order of items in a tree.
//!
//! Items are sorted as by recursive median splits across the widest extent. The upper levels take the medians
//! of a sample: they put every item into a bucket in one pass, instead of moving all of them once a level. A bucket
//! fits in the cache of a core and is split at exact medians. Neither depends on the number of threads.

use glam::Vec3;
use rayon::prelude::*;

/// Something with a place.
pub(super) type Item<T> = (Vec3, T);

/// Buckets are made for about this many items or more.
const BUCKET: usize = 1 << 10;

/// Sampled items per bucket.
const SAMPLES: usize = 32;

/// Items that are sorted into buckets at once: they stay in the cache of a core.
const CHUNK: usize = 1 << 14;

/// Items in the order of their buckets.
pub(super) struct Buckets<T> {
    /// Runs of items, each sorted by bucket.
    chunks: Vec<Vec<Item<T>>>,
    /// Where each bucket starts in each chunk, and after the last one the length of the chunk.
    starts: Vec<Vec<u32>>,
    /// The number of items of each bucket.
    pub(super) counts: Vec<usize>,
}

impl<T: Copy + Send + Sync> Buckets<T> {
    /// Sorts items into a power of eight buckets; neighbours in the list of buckets are neighbours in space.
    pub(super) fn new(items: &[Item<T>]) -> Self {
        let splitters = Splitters::new(items);
        let buckets = splitters.0.len();
        let (chunks, starts): (Vec<_>, Vec<_>) =
            items.par_chunks(CHUNK).map(|chunk| splitters.sort(chunk)).unzip();
        let count = |bucket| {
            starts.iter().map(|starts: &Vec<u32>| (starts[bucket + 1] - starts[bucket]) as usize).sum()
        };
        let counts = (0..buckets).map(count).collect();
        Self { chunks, starts, counts }
    }

    /// The items of a bucket.
    pub(super) fn items(&self, bucket: usize) -> Vec<Item<T>> {
        let mut items = Vec::with_capacity(self.counts[bucket]);
        for (chunk, starts) in self.chunks.iter().zip(&self.starts) {
            items.extend_from_slice(&chunk[starts[bucket] as usize..starts[bucket + 1] as usize]);
        }
        items
    }
}

/// A k-d tree over a sample: the children of split `i` are `2i` and `2i + 1`, the root is 1.
struct Splitters(Vec<(f32, u32)>);

impl Splitters {
    fn new<T: Copy>(items: &[Item<T>]) -> Self {
        let mut buckets = 1;
        while buckets * 8 * BUCKET <= items.len() {
            buckets *= 8;
        }
        let mut splits = vec![(0.0, 0); buckets];
        if buckets > 1 {
            let (samples, count) = ((buckets * SAMPLES) as u64, items.len() as u64);
            let sampled = |i: u64| {
                // Scattered: items may repeat with a period.
                let scatter = i.wrapping_mul(0x9e37_79b9_7f4a_7c15) % count;
                (items[((i * count + scatter) / samples) as usize].0, ())
            };
            let mut sample: Vec<Item<()>> = (0..samples).map(sampled).collect();
            Self::split(&mut splits, 1, &mut sample);
        }
        Self(splits)
    }

    fn split(splits: &mut [(f32, u32)], index: usize, sample: &mut [Item<()>]) {
        if index >= splits.len() {
            return;
        }
        let axis = widest_axis(sample).0;
        let middle = sample.len() / 2;
        select(sample, axis, middle);
        let (left, right) = sample.split_at_mut(middle);
        splits[index] = (right[0].0[axis], axis as u32);
        Self::split(splits, 2 * index, left);
        Self::split(splits, 2 * index + 1, right);
    }

    /// The buckets of points. Several descend together: each has to wait for its memory.
    fn buckets<T>(&self, items: &[Item<T>]) -> Vec<u32> {
        const TOGETHER: usize = 16;
        let last = self.0.len() - 1;
        let mut buckets = Vec::with_capacity(items.len());
        for items in items.chunks(TOGETHER) {
            let mut points = [[0.0; 4]; TOGETHER];
            for (point, item) in points.iter_mut().zip(items) {
                *point = item.0.extend(0.0).to_array();
            }
            let mut places = [1_u32; TOGETHER];
            for _ in 0..self.0.len().ilog2() {
                for (place, point) in places.iter_mut().zip(&points) {
                    let (split, axis) = self.0[*place as usize & last];
                    *place = 2 * *place + u32::from(point[axis as usize & 3] >= split);
                }
            }
            buckets.extend(places[..items.len()].iter().map(|place| place - self.0.len() as u32));
        }
        buckets
    }

    fn sort<T: Copy>(&self, chunk: &[Item<T>]) -> (Vec<Item<T>>, Vec<u32>) {
        let buckets = self.buckets(chunk);
        let mut starts = vec![0_u32; self.0.len() + 1];
        for &bucket in &buckets {
            starts[bucket as usize] += 1;
        }
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        let mut sorted = chunk.to_vec();
        for (item, &bucket) in chunk.iter().zip(&buckets).rev() {
            let start = &mut starts[bucket as usize];
            *start -= 1;
            sorted[*start as usize] = *item;
        }
        (sorted, starts)
    }
}

/// Sorts items so that every run of `capacity` of them is compact.
pub(super) fn split<T: Copy + Send>(items: &mut [Item<T>], capacity: usize) {
    let parts = items.len().div_ceil(capacity);
    if parts <= 1 {
        return;
    }
    let (axis, extent) = widest_axis(items);
    if extent == 0.0 {
        // All the same: any order will do.
        return;
    }
    let middle = parts.div_ceil(2) * capacity;
    match items.len() {
        0..=16 => sort_few::<16, T>(items, axis, extent),
        17..=32 => sort_few::<32, T>(items, axis, extent),
        33..=64 => sort_few::<64, T>(items, axis, extent),
        _ => select(items, axis, middle),
    }
    // A bucket of many items that are all but the same need not be left to one thread.
    let parallel = items.len() > CHUNK;
    let (left, right) = items.split_at_mut(middle);
    if parallel {
        rayon::join(|| split(left, capacity), || split(right, capacity));
    } else {
        split(left, capacity);
        split(right, capacity);
    }
}

/// Sorts up to `N` items, at most 64, along an axis by counting for each how many come before: there is nothing to
/// mispredict. Items nearer than 2⁻²⁴ of the extent keep their order.
fn sort_few<const N: usize, T: Copy>(items: &mut [Item<T>], axis: usize, extent: f32) {
    let first = items.iter().fold(f32::INFINITY, |first, item| first.min(item.0[axis]));
    let scale = (1 << 24) as f32 / extent;
    let mut keys = [i32::MAX; N];
    for (index, (key, item)) in keys.iter_mut().zip(&*items).enumerate() {
        // In range even if the difference or the scale is not.
        let place = ((item.0[axis] - first) * scale).min((1 << 24) as f32) as i32;
        *key = place << 6 | i32::from(index as u8);
    }
    let mut ranks = [0_i32; N];
    for &other in &keys[..items.len()] {
        for (rank, &key) in ranks.iter_mut().zip(&keys) {
            *rank += i32::from(other < key);
        }
    }
    let mut sorted = [items[0]; N];
    for (item, &rank) in items.iter().zip(&ranks) {
        sorted[rank as usize & (N - 1)] = *item;
    }
    items.copy_from_slice(&sorted[..items.len()]);
}

/// Moves the `middle` least items along an axis to the front.
fn select<T>(items: &mut [Item<T>], axis: usize, middle: usize) {
    fn along<const AXIS: usize, T>(items: &mut [Item<T>], middle: usize) {
        items.select_nth_unstable_by(middle, |a, b| a.0[AXIS].total_cmp(&b.0[AXIS]));
    }
    match axis {
        0 => along::<0, T>(items, middle),
        1 => along::<1, T>(items, middle),
        _ => along::<2, T>(items, middle),
    }
}

/// The axis along which items extend most, and how far they do.
fn widest_axis<T>(items: &[Item<T>]) -> (usize, f32) {
    let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for item in items {
        (min, max) = (min.min(item.0), max.max(item.0));
    }
    let extent = max - min;
    (extent.max_position(), extent.max_element())
}
