//! The build of the hierarchy: obvhs builds a binary one, which is collapsed to eight children per node.
//!
//! The collapse has the least cost by the surface area heuristic that the binary hierarchy allows (Ylitie,
//! Karras, Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017).
//! The builder degenerates to a list when many boxes share a centre, so such boxes are grouped before.

use std::ops::Range;
use std::time::Duration;

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};
use rayon::prelude::*;

use super::hierarchy::{Child, Hierarchy, Kind, Node};
use crate::simd::WIDTH;

/// Limits of leaves, by what is below them.
#[derive(Clone, Copy)]
pub(super) struct Leaves {
    /// Primitives up to which there is no tree: every ray is tested against all.
    small: usize,
    /// The most primitives in a block.
    block: usize,
}

impl Leaves {
    pub(super) const PRIMITIVES: Self = Self { small: 48, block: WIDTH };
    /// Anything but primitives: all that a hierarchy knows of it is its box.
    pub(super) const BOXES: Self = Self { small: 0, block: 1 };
}

/// Cost of a ray's test against a block of primitives, as a multiple of that against a node.
const BLOCK_COST: f32 = 1.0;

/// Primitives that share a centre: one leaf entry for the builder.
struct Group {
    bounds: Aabb,
    members: Range<usize>,
}

impl Boundable for Group {
    fn aabb(&self) -> Aabb {
        self.bounds
    }
}

/// A primitive as the build sees it.
#[derive(Clone, Copy)]
pub(super) struct Boxed {
    pub(super) min: Vec3,
    pub(super) max: Vec3,
    pub(super) kind: Kind,
}

impl Boxed {
    pub(super) fn triangle([a, b, c]: [Vec3; 3]) -> Self {
        Self { min: a.min(b).min(c), max: a.max(b).max(c), kind: Kind::Triangle }
    }
}

/// Builds over primitives; `pack` makes a block of some of a kind.
pub(super) fn build(
    boxes: &[Boxed],
    leaves: Leaves,
    mut pack: impl FnMut(Kind, &[u32]) -> Child,
) -> Hierarchy {
    if boxes.len() <= leaves.small {
        let all: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut roots = Vec::new();
        by_kind(boxes, leaves, &all, |kind, members| roots.push(pack(kind, members)));
        return Hierarchy { nodes: Vec::new(), roots };
    }
    let (members, groups) = group_by_centre(boxes);
    let params = BvhBuildParams {
        max_prims_per_leaf: 1,
        post_collapse_reinsertion_batch_ratio_multiplier: 0.0,
        ..BvhBuildParams::medium_build()
    };
    let binary = build_bvh2(&groups, params, &mut Duration::default());
    let mut collapse =
        Collapse { boxes, leaves, members, groups, subtrees: Vec::new(), binary, nodes: Vec::new(), pack };
    collapse.weigh();
    let roots = vec![collapse.emit()];
    Hierarchy { nodes: collapse.nodes, roots }
}

/// Calls `run` with the primitives of each block.
fn by_kind(boxes: &[Boxed], leaves: Leaves, members: &[u32], mut run: impl FnMut(Kind, &[u32])) {
    let kind = |index: &u32| boxes[*index as usize].kind;
    let mut members = members.to_vec();
    members.sort_by_key(kind);
    for same in members.chunk_by(|a, b| kind(a) == kind(b)) {
        same.chunks(leaves.block).for_each(|members| run(kind(&members[0]), members));
    }
}

/// Sorts primitives by the centres of their boxes, and groups those with the same centre.
fn group_by_centre(boxes: &[Boxed]) -> (Vec<u32>, Vec<Group>) {
    let centre = |index: usize| {
        let Boxed { min, max, .. } = boxes[index];
        (min * 0.5 + max * 0.5).to_array().map(f32::to_bits)
    };
    let mut members: Vec<_> =
        (0..boxes.len()).into_par_iter().map(|index| (centre(index), index as u32)).collect();
    members.par_sort_unstable();
    let mut groups: Vec<Group> = Vec::with_capacity(boxes.len());
    for (place, &(centre, index)) in members.iter().enumerate() {
        let Boxed { min, max, .. } = boxes[index as usize];
        let bounds = Aabb::new(Vec3A::from(min), Vec3A::from(max));
        match groups.last_mut() {
            Some(group) if members[group.members.start].0 == centre => {
                group.bounds = group.bounds.union(&bounds);
                group.members.end = place + 1;
            }
            _ => groups.push(Group { bounds, members: place..place + 1 }),
        }
    }
    (members.into_iter().map(|(_, index)| index).collect(), groups)
}

/// Least costs of a binary node and all below it, by the number of children of a wide node that they may
/// take up.
#[derive(Clone, Copy)]
struct Subtree {
    /// Cost with up to one, two, ... seven children.
    cost: [f32; WIDTH - 1],
    /// Children that the left half gets, of two, three, ... eight; zero: one fewer is as good.
    left: [u8; WIDTH - 1],
    /// Whether a single child is a block, instead of a node.
    is_block: bool,
    /// Kind of the primitives if it is the same for all, and their number if that fits into a block.
    uniform: Option<(Kind, u32)>,
}

struct Collapse<'a, P> {
    boxes: &'a [Boxed],
    leaves: Leaves,
    members: Vec<u32>,
    groups: Vec<Group>,
    binary: Bvh2,
    /// By the binary node.
    subtrees: Vec<Subtree>,
    nodes: Vec<Node>,
    pack: P,
}

impl<P: FnMut(Kind, &[u32]) -> Child> Collapse<'_, P> {
    /// Finds the costs of all subtrees, from the leaves up.
    fn weigh(&mut self) {
        let nodes = &self.binary.nodes;
        let mut order = vec![0];
        let mut place = 0;
        while let Some(&index) = order.get(place) {
            let node = &nodes[index as usize];
            if !node.is_leaf() {
                order.extend([node.first_index, node.first_index + 1]);
            }
            place += 1;
        }
        let area = |index: u32| {
            let aabb = nodes[index as usize].aabb();
            let size = aabb.max.as_dvec3() - aabb.min.as_dvec3();
            size.x * size.y + size.y * size.z + size.z * size.x
        };
        let whole = area(0).max(f64::MIN_POSITIVE);
        let none = Subtree { cost: [0.0; 7], left: [0; 7], is_block: true, uniform: None };
        self.subtrees = vec![none; nodes.len()];
        for &index in order.iter().rev() {
            let node = &nodes[index as usize];
            let area = (area(index) / whole) as f32;
            self.subtrees[index as usize] = if node.is_leaf() {
                let members = self.members_of(index);
                let kind = self.boxes[members[0] as usize].kind;
                let same = members.iter().all(|&index| self.boxes[index as usize].kind == kind);
                let uniform =
                    (same && members.len() <= self.leaves.block).then_some((kind, members.len() as u32));
                Subtree { cost: [area * BLOCK_COST; 7], uniform, ..none }
            } else {
                let children = [0, 1].map(|i| &self.subtrees[(node.first_index + i) as usize]);
                Subtree::over(children, self.leaves, area)
            };
        }
    }

    /// Primitives of a leaf of the binary hierarchy.
    fn members_of(&self, leaf: u32) -> &[u32] {
        let node = &self.binary.nodes[leaf as usize];
        let group = &self.groups[self.binary.primitive_indices[node.first_index as usize] as usize];
        &self.members[group.members.clone()]
    }

    /// Makes the wide hierarchy; returns its root.
    fn emit(&mut self) -> Child {
        let mut waiting = Vec::new();
        let root = self.child(0, &mut waiting);
        while let Some((index, node)) = waiting.pop() {
            let first = self.binary.nodes[index as usize].first_index;
            let left = self.subtrees[index as usize].left[WIDTH - 2];
            let mut below = Vec::with_capacity(WIDTH);
            self.gather(first, left, &mut below);
            self.gather(first + 1, WIDTH as u8 - left, &mut below);
            let children = below.into_iter().map(|index| {
                let aabb = *self.binary.nodes[index as usize].aabb();
                (self.child(index, &mut waiting), (aabb.min.into(), aabb.max.into()))
            });
            let children: Vec<_> = children.collect();
            self.nodes[node] = Node::new(&children);
        }
        root
    }

    /// Binary nodes that become the children of a wide node, if this one may take up `room` of them.
    fn gather(&self, index: u32, room: u8, found: &mut Vec<u32>) {
        let node = &self.binary.nodes[index as usize];
        let left = if room < 2 || node.is_leaf() {
            0
        } else {
            self.subtrees[index as usize].left[room as usize - 2]
        };
        if left > 0 {
            self.gather(node.first_index, left, found);
            self.gather(node.first_index + 1, room - left, found);
        } else if room > 2 && !node.is_leaf() {
            self.gather(index, room - 1, found);
        } else {
            found.push(index);
        }
    }

    /// The child that a binary node becomes; a node is reserved and filled later.
    fn child(&mut self, index: u32, waiting: &mut Vec<(u32, usize)>) -> Child {
        let subtree = self.subtrees[index as usize];
        if !subtree.is_block {
            waiting.push((index, self.nodes.len()));
            self.nodes.push(Node::new(&[]));
            return Child::node(self.nodes.len() - 1);
        }
        let mut members = Vec::with_capacity(WIDTH);
        let mut below = vec![index];
        while let Some(index) = below.pop() {
            let node = &self.binary.nodes[index as usize];
            if node.is_leaf() {
                members.extend_from_slice(self.members_of(index));
            } else {
                below.extend([node.first_index + 1, node.first_index]);
            }
        }
        self.blocks(&members)
    }

    /// Blocks of any number of primitives, below nodes of their own if there are several.
    fn blocks(&mut self, members: &[u32]) -> Child {
        let mut level = Vec::new();
        by_kind(self.boxes, self.leaves, members, |kind, members| {
            let around = members.iter().map(|&index| &self.boxes[index as usize]);
            let bounds =
                around.map(|boxed| (boxed.min, boxed.max)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
            level.push(((self.pack)(kind, members), bounds.unwrap_or_default()));
        });
        while level.len() > 1 {
            let above = level.chunks(WIDTH).map(|children| {
                self.nodes.push(Node::new(children));
                let bounds = children.iter().map(|child| child.1).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
                (Child::node(self.nodes.len() - 1), bounds.unwrap_or_default())
            });
            level = above.collect();
        }
        level[0].0
    }
}

impl Subtree {
    /// The subtree over two others; `area` of its box.
    fn over([a, b]: [&Self; 2], leaves: Leaves, area: f32) -> Self {
        let uniform = match (a.uniform, b.uniform) {
            (Some((kind, count)), Some((other, more)))
                if kind == other && (count + more) as usize <= leaves.block =>
            {
                Some((kind, count + more))
            }
            _ => None,
        };
        // With two, three, ... eight children.
        let (mut split, mut left) = ([f32::INFINITY; WIDTH - 1], [1; WIDTH - 1]);
        for children in 2..=WIDTH {
            let place = children - 2;
            for first in 1..children {
                let cost = a.cost[first - 1] + b.cost[children - first - 1];
                if cost < split[place] {
                    (split[place], left[place]) = (cost, first as u8);
                }
            }
        }
        let as_node = area + split[WIDTH - 2];
        let as_block = if uniform.is_some() { area * BLOCK_COST } else { f32::INFINITY };
        let is_block = as_block <= as_node && uniform.is_some();
        let mut cost = [as_node.min(as_block); WIDTH - 1];
        for place in 1..WIDTH - 1 {
            if split[place - 1] < cost[place - 1] {
                cost[place] = split[place - 1];
            } else {
                (cost[place], left[place - 1]) = (cost[place - 1], 0);
            }
        }
        Self { cost, left, is_block, uniform }
    }
}
