//! The tree under both look-up structures.
//!
//! [Sorted](super::sort) items are packed eight to a block, and blocks and nodes eight to a node. Most nodes
//! are leaves, the nodes above blocks: a leaf's place says where its blocks are, so that it has nothing but
//! boxes.

use rayon::iter::repeat_n;
use rayon::prelude::*;

use super::boxes::{Bounds, Boxes, Exact, union};
use super::sort::{Buckets, Item, split, split_few};
use crate::simd::WIDTH;

/// Items of a leaf, of all its blocks.
const LEAF: usize = WIDTH * WIDTH;

/// Levels that 2³² items can have above the leaves: nine if all are in one bucket, and nine above the
/// buckets.
pub(super) const MAX_LEVELS: usize = 18;

/// A node above other nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) boxes: Exact,
    /// The first child; the others follow.
    pub(super) first: u32,
    /// One bit for each child.
    pub(super) existing: u8,
    /// Whether the children are leaves.
    pub(super) over_leaves: bool,
}

impl Node {
    fn new(boxes: &[Bounds], first: usize, over_leaves: bool) -> Self {
        let existing = ((1_u32 << boxes.len()) - 1) as u8;
        Self { boxes: Exact::around(boxes), first: first as u32, existing, over_leaves }
    }
}

/// A hierarchy over blocks `B` of eight items, with leaves of a kind of boxes `L`.
#[derive(Clone, Debug)]
pub(super) struct PackedTree<L, B> {
    /// The root first.
    pub(super) nodes: Vec<Node>,
    /// The blocks of a leaf start at eight times its place.
    pub(super) leaves: Vec<L>,
    pub(super) blocks: Vec<B>,
}

impl<L: Boxes, B: Copy + Send + Sync> PackedTree<L, B> {
    /// Builds over items at finite places with finite `bounds`.
    ///
    /// `fill` packs up to eight items into an `empty` block; leaves that are not full have blocks that stay
    /// empty. Items are dropped as soon as they are sorted into buckets, before there are blocks.
    pub(super) fn build<T: Copy + Send + Sync>(
        items: Vec<Item<T>>,
        bounds: impl Fn(&Item<T>) -> Bounds + Sync,
        empty: B,
        fill: impl Fn(&mut B, &[Item<T>]) + Sync,
    ) -> Self {
        assert!(u32::try_from(items.len()).is_ok(), "{} items are more than can be indexed", items.len());
        let buckets = Buckets::new(items);
        let leaves = || buckets.counts.iter().map(|count| count.div_ceil(LEAF));
        let mut blocks: Vec<B> = repeat_n(empty, leaves().sum::<usize>() * WIDTH).collect();
        let (mut rest, mut first) = (&mut blocks[..], 0);
        let mut work = Vec::new();
        for (bucket, leaves) in leaves().enumerate() {
            let (own, others) = rest.split_at_mut(leaves * WIDTH);
            if leaves > 0 {
                work.push((bucket, first, own));
            }
            rest = others;
            first += leaves;
        }
        let branches = work.into_par_iter().map(|(bucket, first, own)| {
            let mut items = buckets.items(bucket);
            let branch = Branch::new(&mut items, first, &bounds);
            for (to, items) in own.iter_mut().zip(items.chunks(WIDTH)) {
                fill(to, items);
            }
            branch
        });
        let branches: Vec<_> = branches.collect();
        drop(buckets);
        Self::join(&branches, blocks)
    }

    /// Puts branches under common nodes, eight at a time.
    fn join(branches: &[Branch<L>], blocks: Vec<B>) -> Self {
        // The levels above the branches, from the root down.
        let mut levels = vec![branches.iter().map(|branch| branch.bounds).collect::<Vec<_>>()];
        while levels[0].len() > 1 {
            let around = |boxes: &[Bounds]| boxes.iter().copied().reduce(union).unwrap_or_default();
            levels.insert(0, levels[0].chunks(WIDTH).map(around).collect());
        }
        let below: usize = branches.iter().map(|branch| branch.nodes.len()).sum();
        let above: usize = levels[1..].iter().map(|level| level.len().div_ceil(WIDTH)).sum();
        let mut nodes = Vec::with_capacity(above + below);
        for level in &levels[1..] {
            let first = nodes.len() + level.len().div_ceil(WIDTH);
            let children = level.chunks(WIDTH).enumerate();
            nodes.extend(children.map(|(index, boxes)| Node::new(boxes, first + index * WIDTH, false)));
        }
        // The roots of the branches are neighbours, what is below follows.
        let first = above + branches.len();
        let starts = branches.iter().scan(first, |next, branch| {
            let start = *next;
            *next += branch.nodes.len() - 1;
            Some(start as u32)
        });
        let moved = |node: &Node, start: u32| Node {
            first: if node.over_leaves { node.first } else { node.first + start },
            ..*node
        };
        nodes.extend(
            branches.iter().zip(starts.clone()).map(|(branch, start)| moved(&branch.nodes[0], start)),
        );
        for (branch, start) in branches.iter().zip(starts) {
            nodes.extend(branch.nodes[1..].iter().map(|node| moved(node, start)));
        }
        let leaves = branches.iter().map(|branch| &branch.leaves[..]).collect::<Vec<_>>().concat();
        Self { nodes, leaves, blocks }
    }
}

impl<L, B> PackedTree<L, B> {
    /// A tree over nothing.
    pub(super) const EMPTY: Self = Self { nodes: Vec::new(), leaves: Vec::new(), blocks: Vec::new() };

    /// Memory in use, bytes.
    pub(super) fn memory_bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>()
            + self.leaves.capacity() * size_of::<L>()
            + self.blocks.capacity() * size_of::<B>()
    }
}

/// The tree over a bucket. Its nodes are numbered from its second one: the root goes elsewhere.
struct Branch<L> {
    nodes: Vec<Node>,
    leaves: Vec<L>,
    bounds: Bounds,
}

impl<L: Boxes> Branch<L> {
    /// Sorts items and builds over them; their leaves start with `first`.
    fn new<T: Copy + Send>(
        items: &mut [Item<T>],
        first: usize,
        bounds: &impl Fn(&Item<T>) -> Bounds,
    ) -> Self {
        let mut branch = Self { nodes: Vec::new(), leaves: Vec::new(), bounds: Bounds::default() };
        let mut capacity = LEAF;
        while capacity * WIDTH < items.len() {
            capacity *= WIDTH;
        }
        branch.nodes.push(Node::new(&[], 0, true));
        branch.bounds = branch.fill(0, items, capacity, first, bounds);
        branch
    }

    /// Makes a node over up to eight runs of `capacity` items.
    fn fill<T: Copy + Send>(
        &mut self,
        node: usize,
        items: &mut [Item<T>],
        capacity: usize,
        first_leaf: usize,
        bounds: &impl Fn(&Item<T>) -> Bounds,
    ) -> Bounds {
        split(items, capacity);
        let mut boxes = [Bounds::default(); WIDTH];
        let boxes = &mut boxes[..items.len().div_ceil(capacity)];
        let runs = boxes.iter_mut().zip(items.chunks_mut(capacity));
        if capacity == LEAF {
            for (own, items) in runs {
                *own = self.add_leaf(items, bounds);
            }
            self.nodes[node] = Node::new(boxes, first_leaf, true);
        } else {
            let first = self.nodes.len();
            self.nodes.resize(first + runs.len(), Node::new(&[], 0, true));
            for (index, (own, items)) in runs.enumerate() {
                let first_leaf = first_leaf + index * (capacity / LEAF);
                *own = self.fill(first + index, items, capacity / WIDTH, first_leaf, bounds);
            }
            self.nodes[node] = Node::new(boxes, first - 1, false);
        }
        boxes.iter().copied().reduce(union).unwrap_or_default()
    }

    fn add_leaf<T: Copy + Send>(
        &mut self,
        items: &mut [Item<T>],
        bounds: &impl Fn(&Item<T>) -> Bounds,
    ) -> Bounds {
        split_few(items);
        let mut boxes = [Bounds::default(); WIDTH];
        let boxes = &mut boxes[..items.len().div_ceil(WIDTH)];
        for (own, items) in boxes.iter_mut().zip(items.chunks(WIDTH)) {
            *own = items.iter().map(bounds).reduce(union).unwrap_or_default();
        }
        self.leaves.push(L::around(boxes));
        boxes.iter().copied().reduce(union).unwrap_or_default()
    }
}
