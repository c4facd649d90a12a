//! The traversal that all queries share.
//!
//! A query is a [`Region`] that boxes are tested against, and a test of the items in a block. Leaves and
//! blocks are what misses the cache: both are gathered in lists before they are looked at, so that many are
//! fetched at the same time.

use super::boxes::Boxes;
use super::region::Region;
use super::tree::{MAX_LEVELS, PackedTree};
use crate::simd::{Plain, Task, WIDTH, Wide, run_or, set_lanes};

/// The greatest number of blocks or leaves that wait to be looked at.
const WAITING: usize = 24;

/// The search of blocks for items. Its methods are compiled into the traversal, for the instruction set at
/// hand.
pub(super) trait Query<B> {
    /// Results of a test of eight items.
    type Found: Copy + Default;

    /// The items of a block that are wanted, one bit per lane.
    fn test<W: Wide>(&self, wide: W, block: &B) -> (u32, Self::Found);

    /// Whether wanted items are announced.
    const ANNOUNCES: bool = false;

    /// Hears of a wanted item before any of its list is reported, so that what reports will read can be
    /// fetched for all of them at the same time.
    #[inline(always)]
    fn announce(&self, _block: &B, _lane: usize) {}

    /// Reports a wanted item, with the results of its block.
    fn report(&mut self, block: &B, found: &Self::Found, lane: usize);
}

impl<L: Boxes, B> PackedTree<L, B> {
    /// Reports the wanted items of all blocks whose boxes overlap `region`, in the order of the blocks.
    /// Returns the number of nodes, leaves and blocks that it looked at.
    ///
    /// On an x86 processor without AVX2 `otherwise` is asked, since all this is compiled for each query: it
    /// [searches](Self::search_plainly) with a query whose closures are called by reference.
    #[inline]
    pub(super) fn search<R: Region, Q: Query<B>>(
        &self,
        region: R,
        query: Q,
        otherwise: impl FnOnce(Q) -> u32,
    ) -> u32 {
        let mut tests = 0;
        if !self.nodes.is_empty() {
            let traversal = Traversal { tree: self, region, query, tests: &mut tests };
            run_or(traversal, |traversal| *traversal.tests = otherwise(traversal.query));
        }
        tests
    }

    /// As [`search`](Self::search), with instructions that every processor has.
    pub(super) fn search_plainly(&self, region: impl Region, query: impl Query<B>) -> u32 {
        let mut tests = 0;
        if !self.nodes.is_empty() {
            Traversal { tree: self, region, query, tests: &mut tests }.run(Plain);
        }
        tests
    }
}

struct Traversal<'a, L, B, R, Q> {
    tree: &'a PackedTree<L, B>,
    region: R,
    query: Q,
    tests: &'a mut u32,
}

impl<L: Boxes, B, R: Region, Q: Query<B>> Task for Traversal<'_, L, B, R, Q> {
    #[inline(always)]
    fn run(mut self, wide: impl Wide) {
        let mut nodes = Nodes::default();
        let mut leaves = List::default();
        // Each step stands here once, since tests and reports are inlined.
        loop {
            let ended = self.nodes(wide, &mut nodes, &mut leaves);
            self.leaves(wide, &mut leaves);
            if ended {
                return;
            }
        }
    }
}

impl<L: Boxes, B, R: Region, Q: Query<B>> Traversal<'_, L, B, R, Q> {
    /// Gathers leaves until there are enough; whether all nodes have been looked at.
    #[inline(always)]
    fn nodes(&mut self, wide: impl Wide, nodes: &mut Nodes, leaves: &mut List) -> bool {
        loop {
            let node = &self.tree.nodes[nodes.next];
            *self.tests += 1;
            let met = self.region.overlaps(wide, &node.boxes) & u32::from(node.existing);
            if node.over_leaves {
                leaves.extend(node.first, met);
            } else if met != 0 {
                nodes.push(met, node.first);
            }
            let more = nodes.advance();
            if !more || leaves.is_full() {
                return !more;
            }
        }
    }

    #[inline(always)]
    fn leaves(&mut self, wide: impl Wide, leaves: &mut List) {
        let mut blocks = List::default();
        let leaves = leaves.take();
        *self.tests += leaves.len() as u32;
        let mut waiting = leaves.iter();
        while waiting.len() > 0 {
            while !blocks.is_full()
                && let Some(&leaf) = waiting.next()
            {
                let met = self.region.overlaps(wide, &self.tree.leaves[leaf as usize]);
                blocks.extend(leaf * WIDTH as u32, met);
            }
            self.blocks(wide, &mut blocks);
        }
    }

    /// Tests all blocks before anything is reported: the tests wait for memory, not for each other.
    #[inline(always)]
    fn blocks(&mut self, wide: impl Wide, blocks: &mut List) {
        let (mut wanted, mut found) = ([0; WAITING], [Q::Found::default(); WAITING]);
        let (tree, blocks) = (self.tree, blocks.take());
        *self.tests += blocks.len() as u32;
        for ((wanted, found), &block) in wanted.iter_mut().zip(&mut found).zip(blocks) {
            (*wanted, *found) = self.query.test(wide, &tree.blocks[block as usize]);
        }
        if Q::ANNOUNCES {
            for (&wanted, &block) in wanted.iter().zip(blocks) {
                let block = &tree.blocks[block as usize];
                for lane in set_lanes(wanted) {
                    self.query.announce(block, lane);
                }
            }
        }
        for ((&wanted, found), &block) in wanted.iter().zip(&found).zip(blocks) {
            let block = &tree.blocks[block as usize];
            for lane in set_lanes(wanted) {
                self.query.report(block, found, lane);
            }
        }
    }
}

/// The way through the nodes.
#[derive(Default)]
struct Nodes {
    next: usize,
    /// Lanes still to be visited and the first child, per level. So it is as high as the tree.
    stack: [(u32, u32); MAX_LEVELS],
    level: usize,
}

impl Nodes {
    #[inline(always)]
    fn push(&mut self, met: u32, first: u32) {
        self.stack[self.level] = (met, first);
        self.level += 1;
    }

    /// Goes to the next node, if there is one.
    #[inline(always)]
    fn advance(&mut self) -> bool {
        while self.level > 0 && self.stack[self.level - 1].0 == 0 {
            self.level -= 1;
        }
        if self.level == 0 {
            return false;
        }
        let (met, first) = &mut self.stack[self.level - 1];
        self.next = (*first + met.trailing_zeros()) as usize;
        *met &= *met - 1;
        true
    }
}

/// Blocks or leaves that wait.
#[derive(Default)]
struct List {
    indices: [u32; WAITING],
    len: usize,
}

/// The lanes whose bit is set, by the bits.
const LANES: [[u8; WIDTH]; 256] = {
    let mut lanes = [[0; WIDTH]; 256];
    let mut bits = 0;
    while bits < 256 {
        let (mut lane, mut count) = (0, 0);
        while lane < WIDTH {
            if bits >> lane & 1 == 1 {
                lanes[bits][count] = lane as u8;
                count += 1;
            }
            lane += 1;
        }
        bits += 1;
    }
    lanes
};

impl List {
    /// Adds the indices from `first` whose bit is set; there has to be room for eight. Has no branch to
    /// mispredict.
    #[inline(always)]
    fn extend(&mut self, first: u32, bits: u32) {
        let lanes = &LANES[(bits & 0xff) as usize];
        let room = &mut self.indices[self.len..][..WIDTH];
        for (to, &lane) in room.iter_mut().zip(lanes) {
            *to = first + u32::from(lane);
        }
        self.len += (bits & 0xff).count_ones() as usize;
    }

    /// Whether there is no room for eight more.
    #[inline(always)]
    fn is_full(&self) -> bool {
        self.len > WAITING - WIDTH
    }

    /// Empties the list.
    #[inline(always)]
    fn take(&mut self) -> &[u32] {
        let len = std::mem::take(&mut self.len);
        &self.indices[..len]
    }
}
