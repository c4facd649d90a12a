//! The build of the hierarchy: obvhs builds a binary one, which is collapsed to eight children per node.
//!
//! The collapse has the least cost by the surface area heuristic that the binary hierarchy allows (Ylitie,
//! Karras, Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017).
//! The builder degenerates to a list when many boxes share a centre, so such boxes are grouped before; and it
//! joins one pair at a time in a row of boxes that are all as good as each other, so it does not see them as
//! they are.

use std::collections::BTreeMap;
use std::ops::Range;

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, SortPrecision};
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

/// Distance from a triangle at which rays may meet it by rounding, relative to its longest extent.
const EDGE_ROUNDING: f32 = 4.0 * f32::EPSILON;

/// A primitive as the build sees it.
#[derive(Clone, Copy)]
pub(super) struct Boxed {
    pub(super) min: Vec3,
    pub(super) max: Vec3,
    pub(super) kind: Kind,
}

impl Boxed {
    /// A triangle. Its box holds what the exact test accepts: projected corners are rounded as their
    /// distances are, so that a ray that just passes a long edge may meet the triangle.
    pub(super) fn triangle([a, b, c]: [Vec3; 3]) -> Self {
        Self::around(a.min(b).min(c), a.max(b).max(c), Kind::Triangle)
    }

    /// A copy of a mesh, by the bounds of its corners. Its box holds those of its triangles.
    pub(super) fn copy((min, max): (Vec3, Vec3)) -> Self {
        Self::around(min, max, Kind::Box)
    }

    fn around(min: Vec3, max: Vec3, kind: Kind) -> Self {
        let margin = EDGE_ROUNDING * (max - min).max_element();
        // Of a small triangle far from the origin the margin is less than a rounding, but not nothing.
        let min = (min - margin).min(min.map(f32::next_down));
        let max = (max + margin).max(max.map(f32::next_up));
        Self { min, max, kind }
    }
}

/// Makes a block of some primitives of a kind. Not a type parameter, so that the build is compiled once.
type Pack<'a> = &'a mut dyn FnMut(Kind, &[u32]) -> Child;

/// Builds over primitives.
pub(super) fn build(boxes: &[Boxed], leaves: Leaves, pack: Pack<'_>) -> Hierarchy {
    if boxes.len() <= leaves.small {
        let all: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut roots = Vec::new();
        by_kind(boxes, leaves, &all, |kind, members| roots.push(pack(kind, members)));
        return Hierarchy { nodes: Vec::new(), roots };
    }
    let (members, groups) = group_by_centre(boxes);
    let mut tree = binary_tree(&seen_by_builder(&groups));
    fit(&mut tree, &groups);
    let binary = Binary { boxes, leaves, members, groups, tree };
    let choices = binary.choices();
    let mut collapse = Collapse { binary, choices, nodes: Vec::new(), pack };
    let roots = vec![collapse.emit()];
    Hierarchy { nodes: collapse.nodes, roots }
}

/// The tree of obvhs's medium preset, with a box per leaf. Not by its `build_bvh2`, which is compiled for
/// every search distance.
fn binary_tree(boxes: &[Aabb]) -> Bvh2 {
    /// Neighbours on either side that are looked at for the one that a node is joined with.
    const SEARCH: usize = 14;
    /// Rounds of joining, from the leaves on, that look at the nearest one only.
    const QUICK_ROUNDS: usize = 3;
    /// Part of the nodes that are tried at other places.
    const REINSERTED: f32 = 0.05;
    let mut tree = Bvh2::zeroed(boxes.len());
    let indices = (0..boxes.len() as u32).collect();
    // 21 bits per axis do not tell the triangles of a statue apart on a ground a million times as wide.
    let precision = SortPrecision::U128;
    let mut builder = PlocBuilder::with_capacity(boxes.len());
    builder.build_ploc::<SEARCH, _>(&mut tree, boxes, indices, precision, QUICK_ROUNDS);
    ReinsertionOptimizer::default().run(&mut tree, REINSERTED, None);
    tree
}

/// Gives all nodes the boxes of what is below them. Not by obvhs's `refit_all`, whose stack is as deep as a
/// tree before its nodes are tried at other places.
fn fit(tree: &mut Bvh2, groups: &[Group]) {
    let (mut order, mut waiting) = (Vec::with_capacity(tree.nodes.len()), vec![0]);
    while let Some(index) = waiting.pop() {
        order.push(index);
        let node = &tree.nodes[index as usize];
        if !node.is_leaf() {
            waiting.extend([node.first_index, node.first_index + 1]);
        }
    }
    for index in order.into_iter().rev() {
        let node = &tree.nodes[index as usize];
        let first = node.first_index as usize;
        let bounds = if node.is_leaf() {
            groups[tree.primitive_indices[first] as usize].bounds
        } else {
            tree.nodes[first].aabb().union(tree.nodes[first + 1].aabb())
        };
        tree.nodes[index as usize].set_aabb(bounds);
    }
}

/// The boxes of groups, wider by a thousandth and some roundings, each by an amount of its own, so that
/// hardly any pair is as good as another, and in units in which no area is too large or too small for a
/// number.
fn seen_by_builder(groups: &[Group]) -> Vec<Aabb> {
    /// The most that a box grows, relative to its extent and to its coordinates.
    const GROWTH: [f32; 2] = [1.0 / 1024.0, 16.0 * f32::EPSILON];
    let coordinates = |group: &Group| group.bounds.min.abs().max(group.bounds.max.abs()).max_element();
    let largest = groups.iter().map(coordinates).fold(f32::MIN_POSITIVE, f32::max);
    let scale = (-largest.log2().floor()).clamp(-126.0, 126.0).exp2();
    let seen = |(index, group): (usize, &Group)| {
        let (min, max) = (group.bounds.min * scale, group.bounds.max * scale);
        // The finaliser of MurmurHash3, but for its last step.
        let mut hash = (index as u32 ^ index as u32 >> 16).wrapping_mul(0x85eb_ca6b);
        hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
        let part = (hash >> 8) as f32 / (1 << 24) as f32;
        let growth = |corner: Vec3A| part * (GROWTH[0] * (max - min) + GROWTH[1] * corner.abs());
        Aabb::new(min - growth(min), max + growth(max))
    };
    groups.iter().enumerate().map(seen).collect()
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

/// Least costs of a binary node and all below it.
#[derive(Clone, Copy)]
struct Subtree {
    /// Cost with up to one, two, ... seven children of a wide node.
    cost: [f32; WIDTH - 1],
    /// Kind of the primitives if it is the same for all, and their number if that fits into a block.
    uniform: Option<(Kind, u32)>,
}

/// The form that a binary node and all below it take at the least cost.
#[derive(Clone, Copy)]
struct Choice {
    /// Of two, three, ... eight children of a wide node, those that the left half gets; zero: one fewer is as
    /// good.
    left: [u8; WIDTH - 1],
    /// Whether a single child is a block, instead of a node.
    is_block: bool,
}

impl Choice {
    const LEAF: Self = Self { left: [0; WIDTH - 1], is_block: true };
}

/// Subtrees whose choices are found in parallel, at least.
const PIECES: usize = 64;

/// The binary hierarchy over groups of primitives.
struct Binary<'a> {
    boxes: &'a [Boxed],
    leaves: Leaves,
    members: Vec<u32>,
    groups: Vec<Group>,
    tree: Bvh2,
}

impl Binary<'_> {
    /// Both halves of a node, unless it is a leaf.
    fn halves(&self, index: u32) -> Option<[u32; 2]> {
        let node = &self.tree.nodes[index as usize];
        (!node.is_leaf()).then_some([node.first_index, node.first_index + 1])
    }

    /// Primitives of a leaf.
    fn members_of(&self, leaf: u32) -> &[u32] {
        let node = &self.tree.nodes[leaf as usize];
        let group = &self.groups[self.tree.primitive_indices[node.first_index as usize] as usize];
        &self.members[group.members.clone()]
    }

    /// The choice for every node.
    fn choices(&self) -> Vec<Choice> {
        let whole = half_area(self.tree.nodes[0].aabb()).max(f64::MIN_POSITIVE);
        let (mut above, mut roots) = (Vec::new(), vec![0]);
        while roots.len() < PIECES && roots.iter().any(|&root| self.halves(root).is_some()) {
            let mut below = Vec::new();
            for root in roots {
                match self.halves(root) {
                    Some(halves) => {
                        above.push((root, halves));
                        below.extend(halves);
                    }
                    None => below.push(root),
                }
            }
            roots = below;
        }
        let found: Vec<_> = roots.par_iter().map(|&root| self.choices_below(root, whole)).collect();
        let mut choices = vec![Choice::LEAF; self.tree.nodes.len()];
        let mut subtrees = BTreeMap::new();
        for (root, (subtree, below)) in roots.into_iter().zip(found) {
            subtrees.insert(root, subtree);
            for (index, choice) in below {
                choices[index as usize] = choice;
            }
        }
        for (index, halves) in above.into_iter().rev() {
            let (subtree, choice) = self.over(index, halves.map(|half| &subtrees[&half]), whole);
            subtrees.insert(index, subtree);
            choices[index as usize] = choice;
        }
        choices
    }

    /// The subtree at a node, and the choices for all in it that are no leaves.
    fn choices_below(&self, root: u32, whole: f64) -> (Subtree, Vec<(u32, Choice)>) {
        let (mut order, mut waiting) = (Vec::new(), vec![root]);
        while let Some(index) = waiting.pop() {
            order.push(index);
            waiting.extend(self.halves(index).into_iter().flatten());
        }
        // Backwards every node follows on its second half, and that on the first.
        let mut choices = Vec::with_capacity(order.len() / 2);
        let mut done: Vec<Subtree> = Vec::new();
        for index in order.into_iter().rev() {
            let subtree = if let (Some(_), [.., first, second]) = (self.halves(index), &done[..]) {
                let (subtree, choice) = self.over(index, [first, second], whole);
                choices.push((index, choice));
                done.truncate(done.len() - 2);
                subtree
            } else {
                self.leaf(index, whole)
            };
            done.push(subtree);
        }
        (done[0], choices)
    }

    /// The subtree that a leaf is.
    fn leaf(&self, index: u32, whole: f64) -> Subtree {
        let members = self.members_of(index);
        let kind = self.boxes[members[0] as usize].kind;
        let same = members.iter().all(|&index| self.boxes[index as usize].kind == kind);
        let uniform = (same && members.len() <= self.leaves.block).then_some((kind, members.len() as u32));
        Subtree { cost: [self.area(index, whole) * BLOCK_COST; WIDTH - 1], uniform }
    }

    /// The subtree at a node over those at both halves.
    fn over(&self, index: u32, [a, b]: [&Subtree; 2], whole: f64) -> (Subtree, Choice) {
        let uniform = match (a.uniform, b.uniform) {
            (Some((kind, count)), Some((other, more)))
                if kind == other && (count + more) as usize <= self.leaves.block =>
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
        let area = self.area(index, whole);
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
        (Subtree { cost, uniform }, Choice { left, is_block })
    }

    /// Surface area of a node's box, as a part of `whole`.
    fn area(&self, index: u32, whole: f64) -> f32 {
        (half_area(self.tree.nodes[index as usize].aabb()) / whole) as f32
    }
}

/// Half of the surface area of a box.
fn half_area(aabb: &Aabb) -> f64 {
    let size = aabb.max.as_dvec3() - aabb.min.as_dvec3();
    size.x * size.y + size.y * size.z + size.z * size.x
}

/// The wide hierarchy in the making.
struct Collapse<'a> {
    binary: Binary<'a>,
    choices: Vec<Choice>,
    nodes: Vec<Node>,
    pack: Pack<'a>,
}

impl Collapse<'_> {
    /// Makes the wide hierarchy; returns its root.
    fn emit(&mut self) -> Child {
        let (mut waiting, mut below, mut children) = (Vec::new(), Vec::new(), Vec::new());
        let root = self.child(0, &mut waiting);
        while let Some((index, node)) = waiting.pop() {
            self.gather(index, WIDTH as u8, &mut below);
            for index in below.drain(..) {
                let aabb = *self.binary.tree.nodes[index as usize].aabb();
                children.push((self.child(index, &mut waiting), (aabb.min.into(), aabb.max.into())));
            }
            self.nodes[node] = Node::new(&children);
            children.clear();
        }
        root
    }

    /// Binary nodes that become the children of a wide node, if this one may take up `room` of them.
    fn gather(&self, index: u32, room: u8, found: &mut Vec<u32>) {
        let Some([first, second]) = self.binary.halves(index).filter(|_| room > 1) else {
            return found.push(index);
        };
        let left = self.choices[index as usize].left[room as usize - 2];
        if left > 0 {
            self.gather(first, left, found);
            self.gather(second, room - left, found);
        } else {
            self.gather(index, room - 1, found);
        }
    }

    /// The child that a binary node becomes; a node is reserved and filled later.
    fn child(&mut self, index: u32, waiting: &mut Vec<(u32, usize)>) -> Child {
        if !self.choices[index as usize].is_block {
            waiting.push((index, self.nodes.len()));
            self.nodes.push(Node::new(&[]));
            return Child::node(self.nodes.len() - 1);
        }
        let mut members = Vec::with_capacity(WIDTH);
        let mut below = vec![index];
        while let Some(index) = below.pop() {
            match self.binary.halves(index) {
                Some([first, second]) => below.extend([second, first]),
                None => members.extend_from_slice(self.binary.members_of(index)),
            }
        }
        self.blocks(&members)
    }

    /// Blocks of any number of primitives, below nodes of their own if there are several.
    fn blocks(&mut self, members: &[u32]) -> Child {
        let Binary { boxes, leaves, .. } = self.binary;
        let mut level = Vec::new();
        by_kind(boxes, leaves, members, |kind, members| {
            let around = members.iter().map(|&index| &boxes[index as usize]);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_are_wider_than_triangles_wherever_they_are() {
        for offset in [0.0, 1.0, -300.0, 1e6] {
            let corners = [Vec3::ZERO, 0.1 * Vec3::X, 0.1 * Vec3::Y].map(|corner| corner + offset);
            let [a, b, c] = corners;
            let Boxed { min, max, .. } = Boxed::triangle(corners);
            assert!(min.cmplt(a.min(b).min(c)).all() && max.cmpgt(a.max(b).max(c)).all(), "{offset}");
        }
    }
}
