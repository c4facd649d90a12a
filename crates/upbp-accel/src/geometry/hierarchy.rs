//! The hierarchy of boxes over blocks of primitives, eight to a node, and the walk of a ray through it.

use std::ops::ControlFlow;

use glam::Vec3;

use super::lane_ray::{LaneRay, Planes, SLAB_ROUNDING, Slabs};
use crate::simd::{WIDTH, Wide, set_lanes};

/// Kind of the primitives in a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    Quad,
    Box,
    Sphere,
    Triangle,
}

/// A child of a node: another node, or a block with a number of primitives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Child(u32);

/// The number of nodes, and of blocks of each kind, that can be indexed.
pub(super) const MAX_INDEX: usize = 1 << Child::INDEX_BITS;

impl Child {
    const INDEX_BITS: u32 = 26;
    const INDEX: u32 = (1 << Self::INDEX_BITS) - 1;
    const BLOCK: u32 = 1 << 31;

    pub(super) fn node(index: usize) -> Self {
        Self(index as u32 & Self::INDEX)
    }

    /// `count` is at least one.
    pub(super) fn block(kind: Kind, index: usize, count: usize) -> Self {
        let (kind, count) = (kind as u32, count as u32 - 1);
        Self(Self::BLOCK | kind << 29 | count << Self::INDEX_BITS | (index as u32 & Self::INDEX))
    }

    #[inline(always)]
    const fn index(self) -> usize {
        (self.0 & Self::INDEX) as usize
    }

    #[inline(always)]
    const fn is_block(self) -> bool {
        self.0 >= Self::BLOCK
    }
}

/// A run of up to eight primitives of a kind.
#[derive(Clone, Copy)]
pub(super) struct BlockRef {
    pub(super) kind: Kind,
    pub(super) index: usize,
    /// One bit for each primitive.
    pub(super) used: u32,
}

impl Child {
    #[inline(always)]
    fn as_block(self) -> BlockRef {
        let kind = match self.0 >> 29 & 3 {
            0 => Kind::Quad,
            1 => Kind::Box,
            2 => Kind::Sphere,
            _ => Kind::Triangle,
        };
        let last = self.0 >> Self::INDEX_BITS & 7;
        BlockRef { kind, index: self.index(), used: (2 << last) - 1 }
    }
}

/// A node with its children's boxes.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    pub(super) boxes: Planes,
    pub(super) children: [Child; WIDTH],
    /// One bit for each child.
    pub(super) existing: u32,
}

impl Node {
    /// The node above up to eight children with their boxes.
    pub(super) fn new(below: &[(Child, (Vec3, Vec3))]) -> Self {
        let mut node = Self {
            boxes: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3],
            children: [Child::node(0); WIDTH],
            existing: (1 << below.len()) - 1,
        };
        for (lane, &(child, (min, max))) in below.iter().enumerate() {
            node.children[lane] = child;
            for axis in 0..3 {
                (node.boxes[axis][0][lane], node.boxes[axis][1][lane]) = (min[axis], max[axis]);
            }
        }
        node
    }

    /// The box of a child.
    fn bounds(&self, lane: usize) -> (Vec3, Vec3) {
        let corner = |side: usize| Vec3::from_array(self.boxes.map(|planes| planes[side][lane]));
        (corner(0), corner(1))
    }
}

/// A hierarchy of boxes with eight children to a node.
#[derive(Clone, Debug)]
pub(super) struct Hierarchy {
    pub(super) nodes: Vec<Node>,
    /// First items that rays test: the root, or all blocks of a small scene.
    pub(super) roots: Vec<Child>,
}

/// A test of blocks of primitives. Compiled into the traversal, for the instruction set at hand.
pub(super) trait Visitor {
    /// Tests the primitives of a block; may lower the far end of the ray.
    fn visit<W: Wide>(
        &mut self,
        wide: W,
        ray: &LaneRay<W>,
        block: BlockRef,
        t_max: &mut f32,
    ) -> ControlFlow<()>;
}

impl Hierarchy {
    /// Shows `visitor` the blocks that `ray` may meet before `t_max`, until it breaks off. With `IN_ORDER`
    /// the nearer child of each node comes first. Boxes are tested by `S`, with its `margins`.
    #[inline(always)]
    pub(super) fn traverse<const IN_ORDER: bool, S: Slabs<W>, W: Wide>(
        &self,
        wide: W,
        ray: &LaneRay<W>,
        margins: S::Margins,
        t_max: &mut f32,
        visitor: &mut impl Visitor,
    ) -> ControlFlow<()> {
        for &root in &self.roots {
            if root.is_block() {
                visitor.visit(wide, ray, root.as_block(), t_max)?;
            } else {
                let slabs = S::new(wide, ray, margins);
                self.descend::<IN_ORDER, W>(root, wide, (ray, &slabs), t_max, visitor)?;
            }
        }
        ControlFlow::Continue(())
    }

    /// The greatest `value` of a block, where no block in a box has more than `most` of that box.
    pub(super) fn greatest(
        &self,
        most: impl Fn((Vec3, Vec3)) -> f32,
        value: impl Fn(BlockRef) -> f32,
    ) -> f32 {
        let mut greatest = f32::NEG_INFINITY;
        let mut waiting: Vec<_> = self.roots.iter().map(|&root| (f32::INFINITY, root)).collect();
        while let Some((most_here, child)) = waiting.pop() {
            if most_here <= greatest {
                continue;
            }
            if child.is_block() {
                greatest = greatest.max(value(child.as_block()));
            } else {
                let (node, first) = (&self.nodes[child.index()], waiting.len());
                let below =
                    set_lanes(node.existing).map(|lane| (most(node.bounds(lane)), node.children[lane]));
                waiting.extend(below);
                waiting[first..].sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
            }
        }
        greatest
    }

    /// The part of [`traverse`](Self::traverse) below the node `root`.
    #[inline(always)]
    fn descend<const IN_ORDER: bool, W: Wide>(
        &self,
        root: Child,
        wide: W,
        (ray, slabs): (&LaneRay<W>, &impl Slabs<W>),
        t_max: &mut f32,
        visitor: &mut impl Visitor,
    ) -> ControlFlow<()> {
        let mut stack = Stack::new();
        let mut child = root;
        loop {
            if child.is_block() {
                visitor.visit(wide, ray, child.as_block(), t_max)?;
            } else if let Some(nearest) =
                self.nearest_child::<IN_ORDER, W>(child, wide, (ray, slabs), *t_max, &mut stack)
            {
                child = nearest;
                continue;
            }
            child = loop {
                let Some(entry) = stack.pop() else { return ControlFlow::Continue(()) };
                if entry.distance() * (1.0 - SLAB_ROUNDING) <= *t_max {
                    break entry.child();
                }
            };
        }
    }

    /// The nearest child of a node that the ray may meet; others that it may meet go to the stack.
    #[inline(always)]
    fn nearest_child<const IN_ORDER: bool, W: Wide>(
        &self,
        node: Child,
        wide: W,
        (ray, slabs): (&LaneRay<W>, &impl Slabs<W>),
        t_max: f32,
        stack: &mut Stack,
    ) -> Option<Child> {
        let node = &self.nodes[node.index()];
        let [near, far] = slabs.slabs(wide, &node.boxes, ray.t_min, wide.splat(t_max));
        let far = wide.mul(far, wide.splat(1.0 + SLAB_ROUNDING));
        let far = wide.add(far, wide.splat(f32::MIN_POSITIVE));
        let met = wide.less_equal(near, far) & node.existing;
        if met == 0 {
            return None;
        }
        let near = wide.store(near);
        let entry = |lane: usize| Entry::new(near[lane & 7], node.children[lane & 7]);
        // Mostly there are no more than two.
        let first = met.trailing_zeros() as usize;
        let rest = met & (met - 1);
        if rest == 0 {
            return Some(node.children[first & 7]);
        }
        let (first, second) = (entry(first), entry(rest.trailing_zeros() as usize));
        let mut nearest = first.min(second);
        let bottom = stack.length;
        stack.push(first.max(second));
        for lane in set_lanes(rest & (rest - 1)) {
            let entry = entry(lane);
            let farther = entry.max(nearest);
            nearest = entry.min(nearest);
            if IN_ORDER {
                stack.push_sorted(bottom, farther);
            } else {
                stack.push(farther);
            }
        }
        Some(nearest.child())
    }
}

/// A child that waits, and the distance at which the ray enters it: ordered by the distance, as long as that
/// is not negative.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Entry(u64);

impl Entry {
    #[inline(always)]
    fn new(distance: f32, child: Child) -> Self {
        Self(u64::from(distance.to_bits()) << 32 | u64::from(child.0))
    }

    #[inline(always)]
    const fn distance(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }

    #[inline(always)]
    const fn child(self) -> Child {
        Child(self.0 as u32)
    }
}

/// A stack that lives in an array and moves to the heap when a hierarchy is deeper than usual.
struct Stack {
    array: [Entry; Self::SIZE],
    length: usize,
    spilled: Vec<Entry>,
}

impl Stack {
    const SIZE: usize = 32;

    #[inline(always)]
    fn new() -> Self {
        Self { array: [Entry(0); Self::SIZE], length: 0, spilled: Vec::new() }
    }

    #[inline(always)]
    fn push(&mut self, entry: Entry) {
        if let Some(place) = self.array.get_mut(self.length) {
            *place = entry;
            self.length += 1;
        } else {
            self.spilled.push(entry);
        }
    }

    /// Adds an entry to those from `first`, of which the last is the nearest.
    #[inline(always)]
    fn push_sorted(&mut self, first: usize, entry: Entry) {
        if self.length >= Self::SIZE {
            self.spilled.push(entry);
            return;
        }
        let mut place = self.length;
        while place > first && self.array[place - 1] < entry {
            self.array[place] = self.array[place - 1];
            place -= 1;
        }
        self.array[place] = entry;
        self.length += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<Entry> {
        if let Some(entry) = self.spilled.pop() {
            return Some(entry);
        }
        self.length = self.length.checked_sub(1)?;
        Some(self.array[self.length & (Self::SIZE - 1)])
    }
}
