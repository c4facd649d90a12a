//! The tree under both look-up structures.
//!
//! Items are sorted so that every eight neighbours form a block, every eight blocks a node, every eight nodes
//! a node of the level above. Children follow from the index of the parent; nothing but boxes is stored,
//! eight at a time per axis and side, so that one node is one vectorised test. The sort splits at the median
//! across the widest extent of the centres; as ties are broken by index, coincident items make a
//! tree like any other: the depth depends on their number alone.

use glam::Vec3;
use rayon::prelude::*;

use super::wide::{Task, Wide, run};

/// Items per block and children per node.
pub(super) const WIDTH: usize = 8;

/// Levels that 2³² items can have.
const MAX_LEVELS: usize = 11;

/// Below this number of items a thread works alone.
const SERIAL: usize = 1 << 13;

/// Eight boxes, arranged for vectorised tests. An unused lane has an empty box.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Boxes {
    pub(super) min: [[f32; WIDTH]; 3],
    pub(super) max: [[f32; WIDTH]; 3],
}

impl Boxes {
    const EMPTY: Self = Self { min: [[f32::INFINITY; WIDTH]; 3], max: [[f32::NEG_INFINITY; WIDTH]; 3] };

    fn set(&mut self, lane: usize, (min, max): (Vec3, Vec3)) {
        for axis in 0..3 {
            self.min[axis][lane] = min[axis];
            self.max[axis][lane] = max[axis];
        }
    }

    fn union(&self) -> (Vec3, Vec3) {
        let least = |lanes: &[f32; WIDTH]| lanes.iter().copied().fold(f32::INFINITY, f32::min);
        let greatest = |lanes: &[f32; WIDTH]| lanes.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        (Vec3::from(self.min.each_ref().map(least)), Vec3::from(self.max.each_ref().map(greatest)))
    }
}

/// What a traversal asks. Its methods are compiled into the traversal, for the instruction set of that.
pub(super) trait Query {
    /// The boxes that may hold what is looked for, one bit per lane.
    fn boxes<W: Wide>(&self, wide: W, boxes: &Boxes) -> u32;

    /// Looks at the items of a block.
    fn block<W: Wide>(&mut self, wide: W, index: usize);
}

/// A hierarchy over blocks of eight items.
#[derive(Clone, Debug)]
pub(super) struct PackedTree {
    /// Level after level, the one above the blocks first, the root last.
    nodes: Vec<Boxes>,
    /// Where each level starts, and after the last one the number of nodes.
    starts: Vec<usize>,
    blocks: usize,
    bounds: (Vec3, Vec3),
}

/// An item while it is sorted.
#[derive(Clone, Copy)]
struct Entry {
    /// As [`ordered`] integers, which compare faster.
    centre: [u32; 3],
    index: u32,
}

impl Entry {
    /// Ties go to the lesser index.
    #[inline]
    fn key<const AXIS: usize>(&self) -> u64 {
        u64::from(self.centre[AXIS]) << 32 | u64::from(self.index)
    }
}

/// An integer in the place of a number in the total order.
#[inline]
fn ordered(x: f32) -> u32 {
    let bits = x.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

/// The number at a place in the total order.
fn number(ordered: u32) -> f32 {
    f32::from_bits(if ordered >> 31 == 1 { ordered ^ 1 << 31 } else { !ordered })
}

impl PackedTree {
    /// Builds over `count` items with the given finite bounds; also returns their order in the blocks.
    pub(super) fn build(count: usize, bounds: impl Fn(usize) -> (Vec3, Vec3) + Sync) -> (Self, Vec<u32>) {
        assert!(u32::try_from(count).is_ok(), "{count} items are more than can be indexed");
        let mut entries: Vec<Entry> = (0..count)
            .into_par_iter()
            .with_min_len(SERIAL)
            .map(|index| {
                let (min, max) = bounds(index);
                Entry { centre: (min * 0.5 + max * 0.5).to_array().map(ordered), index: index as u32 }
            })
            .collect();
        let mut capacity = WIDTH;
        while capacity < count {
            capacity *= WIDTH;
        }
        arrange(&mut entries, capacity);
        let order: Vec<u32> = entries.par_iter().with_min_len(SERIAL).map(|entry| entry.index).collect();

        let blocks = count.div_ceil(WIDTH);
        let mut level: Vec<Boxes> = order
            .par_chunks(WIDTH * WIDTH)
            .with_min_len(SERIAL / (WIDTH * WIDTH))
            .map(|items| {
                let mut boxes = Boxes::EMPTY;
                for (lane, block) in items.chunks(WIDTH).enumerate() {
                    let each = block.iter().map(|&index| bounds(index as usize));
                    if let Some(union) = each.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) {
                        boxes.set(lane, union);
                    }
                }
                boxes
            })
            .collect();
        let mut nodes = Vec::with_capacity(level.len() + level.len() / 4);
        let mut starts = vec![0];
        loop {
            nodes.extend_from_slice(&level);
            starts.push(nodes.len());
            if level.len() <= 1 {
                break;
            }
            level = level
                .chunks(WIDTH)
                .map(|children| {
                    let mut boxes = Boxes::EMPTY;
                    for (lane, child) in children.iter().enumerate() {
                        boxes.set(lane, child.union());
                    }
                    boxes
                })
                .collect();
        }
        let bounds = nodes.last().map_or((Vec3::ZERO, Vec3::ZERO), Boxes::union);
        (Self { nodes, starts, blocks, bounds }, order)
    }

    /// The greatest sum of coordinate differences between `point` and anything in the tree.
    pub(super) fn extent_from(&self, point: Vec3) -> f32 {
        (self.bounds.0 - point).abs().max((self.bounds.1 - point).abs()).element_sum()
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Boxes>() + self.starts.capacity() * size_of::<usize>()
    }

    /// Asks `query` about every block under the boxes that it accepts, in the order of the blocks.
    #[inline]
    pub(super) fn ask(&self, query: impl Query) {
        if self.blocks > 0 {
            run(Traversal { tree: self, query });
        }
    }

    #[inline(always)]
    fn walk(&self, wide: impl Wide, mut query: impl Query) {
        let levels = self.starts.len() - 1;
        debug_assert!(levels <= MAX_LEVELS, "{levels} levels");
        // Lanes still to be visited and the index of the first child, per level from the blocks up. So the
        // stack is as high as the tree and cannot overflow.
        let mut lanes = [0_u32; MAX_LEVELS];
        let mut children = [0_usize; MAX_LEVELS];
        let (mut level, mut node) = (levels - 1, 0);
        loop {
            // Children that do not exist must not count: a test may accept empty boxes when the radius is infinite.
            let below = if level == 0 { self.blocks } else { self.starts[level] - self.starts[level - 1] };
            let existing = (1 << (below - node * WIDTH).min(WIDTH)) - 1;
            let mut met = query.boxes(wide, &self.nodes[self.starts[level] + node]) & existing;
            if level == 0 {
                while met != 0 {
                    query.block(wide, node * WIDTH + met.trailing_zeros() as usize);
                    met &= met - 1;
                }
            }
            children[level] = node * WIDTH;
            lanes[level] = met;
            while lanes[level] == 0 {
                level += 1;
                if level == levels {
                    return;
                }
            }
            node = children[level] + lanes[level].trailing_zeros() as usize;
            lanes[level] &= lanes[level] - 1;
            level -= 1;
        }
    }
}

struct Traversal<'a, Q> {
    tree: &'a PackedTree,
    query: Q,
}

impl<Q: Query> Task for Traversal<'_, Q> {
    #[inline(always)]
    fn run(self, wide: impl Wide) {
        self.tree.walk(wide, self.query);
    }
}

/// Sorts entries so that every run of `capacity / 8` items, and of an eighth of that and so on, is compact.
fn arrange(entries: &mut [Entry], capacity: usize) {
    let mut capacity = capacity;
    let mut parts = 1;
    while parts == 1 {
        if capacity <= WIDTH {
            return;
        }
        parts = entries.len().div_ceil(capacity / WIDTH);
        if parts <= 1 {
            capacity /= WIDTH;
        }
    }
    let middle = parts.div_ceil(2) * (capacity / WIDTH);
    match widest_axis(entries) {
        0 => partition::<0>(entries, middle),
        1 => partition::<1>(entries, middle),
        _ => partition::<2>(entries, middle),
    }
    let parallel = entries.len() > SERIAL;
    let (left, right) = entries.split_at_mut(middle);
    if parallel {
        rayon::join(|| arrange(left, capacity), || arrange(right, capacity));
    } else {
        arrange(left, capacity);
        arrange(right, capacity);
    }
}

/// Moves the `middle` least entries along an axis to the front.
fn partition<const AXIS: usize>(entries: &mut [Entry], middle: usize) {
    entries.select_nth_unstable_by_key(middle, Entry::key::<AXIS>);
}

fn widest_axis(entries: &[Entry]) -> usize {
    let (mut min, mut max) = ([u32::MAX; 3], [0; 3]);
    for entry in entries {
        for axis in 0..3 {
            min[axis] = min[axis].min(entry.centre[axis]);
            max[axis] = max[axis].max(entry.centre[axis]);
        }
    }
    (Vec3::from(max.map(number)) - Vec3::from(min.map(number))).max_position()
}
