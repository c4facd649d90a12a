//! The order of items in a tree.
//!
//! Items are sorted as by recursive median splits across the widest extent. The upper levels use the medians
//! of a sample: they put every item into a bucket in one pass, instead of moving all items once per level. A
//! bucket fits in the cache of a core and is split at exact medians. Neither depends on the number of
//! threads.

use std::cmp::Ordering;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use crate::simd::{TO_WHOLE, Task, WIDTH, Wide, run};

/// A place with data, before it has its place in a tree.
pub(super) type Item<T> = (Vec3, T);

/// Items per bucket: between this and eight times as many, but for fewer items than this.
const BUCKET: usize = 1 << 10;

/// Sampled items per bucket.
const SAMPLES: usize = 32;

/// Items that are sorted into buckets together: they stay in the cache of a core.
const CHUNK: usize = 1 << 14;

/// The fewest such items per bucket, for which each chunk has a number.
const CHUNK_PER_BUCKET: usize = 4;

/// Items in the order of their buckets.
pub(super) struct Buckets<T> {
    /// Runs of items, each sorted by bucket.
    chunks: Vec<Vec<Item<T>>>,
    /// Starts of the buckets in each chunk, followed by the length of the chunk.
    starts: Vec<Vec<u32>>,
    /// The number of items of each bucket.
    pub(super) counts: Vec<usize>,
}

impl<T: Copy + Send + Sync> Buckets<T> {
    /// Sorts items into a power of eight buckets; neighbours in the list of buckets are neighbours in space.
    pub(super) fn new(items: Vec<Item<T>>) -> Self {
        let splitters = Splitters::new(&items);
        let buckets = splitters.buckets();
        let (chunks, starts): (Vec<_>, Vec<_>) = items
            .par_chunks(CHUNK.max(CHUNK_PER_BUCKET * buckets))
            .map(|chunk| splitters.sort(chunk))
            .unzip();
        drop(items);
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

/// Three levels of a k-d tree. Lane `i − 1` is split `i`: its children are `2i` and `2i + 1`, the root is 1.
/// The planes of a lane are at infinity along all axes but one.
#[derive(Clone, Copy)]
struct Splits([[f32; WIDTH]; 3]);

/// The child, one to eight, that a point belongs to, by the splits (one bit per lane) whose far side it is
/// on.
const CHILDREN: [u8; 256] = {
    let mut children = [0; 256];
    let mut beyond = 0;
    while beyond < 256 {
        let second = 2 + (beyond & 1);
        let third = 2 * second + (beyond >> (second - 1) & 1);
        children[beyond] = (2 * third + (beyond >> (third - 1) & 1) + 1 - WIDTH) as u8;
        beyond += 1;
    }
    children
};

/// A k-d tree over a sample: the children of node `i` follow `8i`, the root is 0.
struct Splitters {
    nodes: Vec<Splits>,
    levels: u32,
}

impl Splitters {
    fn new<T: Copy>(items: &[Item<T>]) -> Self {
        let (mut nodes, mut levels) = (0, 0);
        while WIDTH.pow(levels + 1) * BUCKET <= items.len() {
            nodes += WIDTH.pow(levels);
            levels += 1;
        }
        let mut splitters = Self { nodes: vec![Splits([[f32::INFINITY; WIDTH]; 3]); nodes], levels };
        if levels > 0 {
            let (samples, count) = ((splitters.buckets() * SAMPLES) as u64, items.len() as u64);
            let sampled = |i: u64| {
                // Scattered: items may repeat with a period.
                let scatter = i.wrapping_mul(0x9e37_79b9_7f4a_7c15) % count;
                (items[((i * count + scatter) / samples) as usize].0, ())
            };
            splitters.split(0, 1, &mut (0..samples).map(sampled).collect::<Vec<_>>());
        }
        splitters
    }

    /// The number of buckets.
    fn buckets(&self) -> usize {
        WIDTH.pow(self.levels)
    }

    fn split(&mut self, node: usize, index: usize, sample: &mut [Item<()>]) {
        if index >= WIDTH {
            return self.split(WIDTH * node + 1 + index - WIDTH, 1, sample);
        }
        let Some(splits) = self.nodes.get_mut(node) else { return };
        let (min, max) = corners(sample);
        let axis = (max - min).max_position();
        let middle = sample.len() / 2;
        select(sample, axis, middle);
        let (left, right) = sample.split_at_mut(middle);
        splits.0[axis][index - 1] = right[0].0[axis];
        self.split(node, 2 * index, left);
        self.split(node, 2 * index + 1, right);
    }

    fn sort<T: Copy>(&self, chunk: &[Item<T>]) -> (Vec<Item<T>>, Vec<u32>) {
        let mut starts = vec![0_u32; self.buckets() + 1];
        let mut buckets = vec![0; chunk.len()];
        run(Descent { splitters: self, items: chunk, buckets: &mut buckets, counts: &mut starts });
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        // Indices are sorted instead of items, which are larger; each item is then copied once.
        let mut order = vec![0_u32; chunk.len()];
        for (index, &bucket) in buckets.iter().enumerate().rev() {
            let start = &mut starts[bucket as usize];
            *start -= 1;
            order[*start as usize] = index as u32;
        }
        (order.into_iter().map(|index| chunk[index as usize]).collect(), starts)
    }
}

/// Finds the buckets of items, and counts the items of each bucket.
struct Descent<'a, T> {
    splitters: &'a Splitters,
    items: &'a [Item<T>],
    buckets: &'a mut [u32],
    counts: &'a mut [u32],
}

impl<T> Task for Descent<'_, T> {
    #[inline(always)]
    fn run(self, wide: impl Wide) {
        /// Items that descend together: each has to wait for its memory.
        const TOGETHER: usize = 16;
        let nodes = &self.splitters.nodes[..];
        for (buckets, items) in self.buckets.chunks_mut(TOGETHER).zip(self.items.chunks(TOGETHER)) {
            let mut places = [0_u32; TOGETHER];
            for _ in 0..self.splitters.levels {
                for (place, item) in places.iter_mut().zip(items) {
                    let [x, y, z] = wide.splat3(item.0.to_array());
                    let [splits_x, splits_y, splits_z] = wide.load3(&nodes[*place as usize].0);
                    let beyond = wide.less_equal(splits_x, x)
                        | wide.less_equal(splits_y, y)
                        | wide.less_equal(splits_z, z);
                    *place = 8 * *place + u32::from(CHILDREN[(beyond & 0xff) as usize]);
                }
            }
            for (bucket, place) in buckets.iter_mut().zip(places) {
                *bucket = place - nodes.len() as u32;
                self.counts[*bucket as usize] += 1;
            }
        }
    }
}

/// Sorts items so that every run of `capacity` items is compact.
pub(super) fn split<T: Copy + Send>(items: &mut [Item<T>], capacity: usize) {
    let parts = items.len().div_ceil(capacity);
    if parts <= 1 {
        return;
    }
    let (min, max) = corners(items);
    let axis = (max - min).max_position();
    if min[axis] == max[axis] {
        // All the same: any order will do.
        return;
    }
    let middle = parts.div_ceil(2) * capacity;
    select(items, axis, middle);
    // A bucket has this many items only if they are all but the same: one thread need not do it alone.
    let parallel = items.len() > CHUNK;
    let (left, right) = items.split_at_mut(middle);
    if parallel {
        rayon::join(|| split(left, capacity), || split(right, capacity));
    } else {
        split(left, capacity);
        split(right, capacity);
    }
}

/// Sorts up to 64 items so that every run of eight is compact.
pub(super) fn split_few<T: Copy>(items: &mut [Item<T>]) {
    run(SplitFew(items));
}

struct SplitFew<'a, T>(&'a mut [Item<T>]);

impl<T: Copy> Task for SplitFew<'_, T> {
    #[inline(always)]
    fn run(self, _: impl Wide) {
        let Some(&first) = self.0.first() else { return };
        let mut copy = [first; 64];
        let copy = &mut copy[..self.0.len()];
        // To and fro.
        for half in halves::<64, T>(self.0, copy) {
            for quarter in halves::<32, T>(half.to, half.from) {
                halves::<16, T>(quarter.to, quarter.from);
            }
        }
        self.0.copy_from_slice(copy);
    }
}

/// Items that were copied `from` one place `to` another: each serves as the space of the next copy.
struct Moved<'a, T> {
    from: &'a mut [Item<T>],
    to: &'a mut [Item<T>],
}

impl<T> Moved<'_, T> {
    #[inline(always)]
    fn halves(self, middle: usize) -> [Self; 2] {
        let (from, to) = (self.from.split_at_mut(middle), self.to.split_at_mut(middle));
        [Self { from: from.0, to: to.0 }, Self { from: from.1, to: to.1 }]
    }
}

/// Splits up to `N` items, at most 64, as [`split`] does into runs of eight. The place of an item is the
/// number of items before it: the count has no branch to mispredict. Items nearer than 2⁻²³ of the extent
/// keep their order.
#[inline(always)]
fn halves<'a, const N: usize, T: Copy>(
    items: &'a mut [Item<T>],
    sorted: &'a mut [Item<T>],
) -> [Moved<'a, T>; 2] {
    let parts = items.len().div_ceil(WIDTH);
    let middle = parts.div_ceil(2) * WIDTH;
    if parts <= 1 {
        sorted.copy_from_slice(items);
        let middle = items.len();
        return Moved { from: items, to: sorted }.halves(middle);
    }
    let (min, max) = corners(items);
    let axis = (max - min).max_position();
    let scale = TO_WHOLE / (max[axis] - min[axis]);
    let mut places = [0.0; N];
    for (place, item) in places.iter_mut().zip(&*items) {
        *place = item.0[axis];
    }
    let mut keys = [0; N];
    for (index, (key, place)) in keys.iter_mut().zip(&places).enumerate() {
        let place = (place - min[axis]) * scale;
        // In range even if the difference or the scale is infinite or NaN.
        let place = if place < TO_WHOLE - 1.0 { place } else { TO_WHOLE - 1.0 };
        *key = ((place + TO_WHOLE).to_bits() << 8 >> 2 | u32::from(index as u8)).cast_signed();
    }
    let mut ranks = [0_i32; N];
    for &other in &keys[..items.len()] {
        for (rank, &key) in ranks.iter_mut().zip(&keys) {
            *rank += i32::from(other < key);
        }
    }
    for (item, &rank) in items.iter().zip(&ranks) {
        sorted[rank as usize] = *item;
    }
    Moved { from: items, to: sorted }.halves(middle)
}

/// Moves the `middle` least items along an axis to the front.
fn select<T>(items: &mut [Item<T>], axis: usize, middle: usize) {
    fn along<const AXIS: usize, T>(items: &mut [Item<T>], middle: usize) {
        items.select_nth_unstable_by(middle, |a, b| {
            a.0[AXIS].partial_cmp(&b.0[AXIS]).unwrap_or(Ordering::Equal)
        });
    }
    match axis {
        0 => along::<0, T>(items, middle),
        1 => along::<1, T>(items, middle),
        _ => along::<2, T>(items, middle),
    }
}

/// The corners of the box around items. Four boxes grow in turn, so that none waits for the item before.
#[inline(always)]
fn corners<T>(items: &[Item<T>]) -> (Vec3, Vec3) {
    const BY_TURNS: usize = 4;
    // Four numbers are one vector, three are not.
    let (mut min, mut max) = ([Vec4::INFINITY; BY_TURNS], [Vec4::NEG_INFINITY; BY_TURNS]);
    let mut grow = |items: &[Item<T>]| {
        for ((min, max), item) in min.iter_mut().zip(&mut max).zip(items) {
            let place = item.0.extend(0.0);
            (*min, *max) = (min.min(place), max.max(place));
        }
    };
    let (turns, rest) = items.as_chunks::<BY_TURNS>();
    for turn in turns {
        grow(turn);
    }
    grow(rest);
    let least = min.into_iter().reduce(Vec4::min).unwrap_or_default();
    let greatest = max.into_iter().reduce(Vec4::max).unwrap_or_default();
    (least.truncate(), greatest.truncate())
}
