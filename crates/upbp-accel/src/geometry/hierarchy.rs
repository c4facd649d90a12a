//! The hierarchy over a scene's primitives: built by obvhs, walked here.
//!
//! The library's own traversal ignores `t_min` and misses boxes without thickness when a ray lies in their
//! plane; its builder degenerates to a list when many boxes share a centre. So such boxes are grouped before
//! the build, and the nodes are copied into a form with its own slab test.

use std::ops::{ControlFlow, Range};
use std::time::Duration;

use glam::{BVec3A, Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};

use crate::ray::Ray;

/// Factor on the far distance of a slab: the rounding of a difference, a reciprocal and a product, twice
/// over.
const SLAB_MARGIN: f32 = 1.0 + 8.0 * f32::EPSILON;

/// A node with aligned vectors: a slab test is a handful of vector instructions.
#[derive(Clone, Copy, Debug)]
struct Node {
    min: Vec3A,
    max: Vec3A,
    /// First primitive of a leaf, first of two children otherwise.
    first: u32,
    /// Number of primitives; zero for an inner node.
    count: u32,
}

/// A binary hierarchy of boxes.
#[derive(Clone, Debug)]
pub(super) struct Hierarchy {
    /// Root first; empty without primitives.
    nodes: Vec<Node>,
}

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

impl Hierarchy {
    /// Builds over boxes; also returns the order of the boxes in the leaves.
    pub(super) fn build(boxes: &[(Vec3, Vec3)]) -> (Self, Vec<u32>) {
        if boxes.is_empty() {
            return (Self { nodes: Vec::new() }, Vec::new());
        }
        let (members, groups) = group_by_centre(boxes);
        let built = build_bvh2(&groups, BvhBuildParams::medium_build(), &mut Duration::default());
        let mut order = Vec::with_capacity(boxes.len());
        let nodes = built
            .nodes
            .iter()
            .map(|node| {
                let aabb = node.aabb();
                let (min, max) = (aabb.min, aabb.max);
                if !node.is_leaf() {
                    return Node { min, first: node.first_index, max, count: 0 };
                }
                let first = order.len() as u32;
                let entries = node.first_index as usize..(node.first_index + node.prim_count) as usize;
                for &group in &built.primitive_indices[entries] {
                    order.extend_from_slice(&members[groups[group as usize].members.clone()]);
                }
                Node { min, first, max, count: order.len() as u32 - first }
            })
            .collect();
        debug_assert_eq!(order.len(), boxes.len());
        (Self { nodes }, order)
    }

    /// Calls `leaf` with the ranges of primitives that `ray` may meet, the nearer child of each node first.
    ///
    /// The second argument of `leaf` is the far end of the ray, which it may lower.
    pub(super) fn traverse(
        &self,
        ray: &Ray,
        mut leaf: impl FnMut(Range<usize>, &mut f32) -> ControlFlow<()>,
    ) {
        let mut t_max = ray.t_max;
        let slabs = Slabs::new(ray);
        let Some(root) = self.nodes.first() else { return };
        let Some(mut entry) = slabs.entry(root, t_max) else { return };
        let mut node = root;
        let mut stack = Stack::new();
        loop {
            if entry <= t_max {
                if node.count > 0 {
                    let first = node.first as usize;
                    if leaf(first..first + node.count as usize, &mut t_max).is_break() {
                        return;
                    }
                } else {
                    let (left, right) =
                        (&self.nodes[node.first as usize], &self.nodes[node.first as usize + 1]);
                    match (slabs.entry(left, t_max), slabs.entry(right, t_max)) {
                        (Some(near), Some(far)) if near <= far => {
                            stack.push((node.first + 1, far));
                            (node, entry) = (left, near);
                            continue;
                        }
                        (Some(far), Some(near)) => {
                            stack.push((node.first, far));
                            (node, entry) = (right, near);
                            continue;
                        }
                        (Some(near), None) => {
                            (node, entry) = (left, near);
                            continue;
                        }
                        (None, Some(near)) => {
                            (node, entry) = (right, near);
                            continue;
                        }
                        (None, None) => {}
                    }
                }
            }
            let Some((index, distance)) = stack.pop() else { return };
            (node, entry) = (&self.nodes[index as usize], distance);
        }
    }
}

/// Sorts primitives by the centres of their boxes, and groups those with the same centre.
fn group_by_centre(boxes: &[(Vec3, Vec3)]) -> (Vec<u32>, Vec<Group>) {
    let centre = |index: u32| {
        let (min, max) = boxes[index as usize];
        (min * 0.5 + max * 0.5).to_array().map(f32::to_bits)
    };
    let mut members: Vec<u32> = (0..boxes.len() as u32).collect();
    members.sort_by_cached_key(|&index| centre(index));
    let mut groups: Vec<Group> = Vec::with_capacity(boxes.len());
    for (place, &index) in members.iter().enumerate() {
        let (min, max) = boxes[index as usize];
        let bounds = Aabb::new(Vec3A::from(min), Vec3A::from(max));
        match groups.last_mut() {
            Some(group) if centre(members[group.members.start]) == centre(index) => {
                group.bounds = group.bounds.union(&bounds);
                group.members.end = place + 1;
            }
            _ => groups.push(Group { bounds, members: place..place + 1 }),
        }
    }
    (members, groups)
}

/// A ray, prepared for tests against boxes.
struct Slabs {
    origin: Vec3A,
    inverse: Vec3A,
    /// Axes along which the direction is negative.
    negative: BVec3A,
    t_min: f32,
}

impl Slabs {
    fn new(ray: &Ray) -> Self {
        let inverse = Vec3A::from(ray.direction).recip();
        let negative = BVec3A::from_array(inverse.to_array().map(f32::is_sign_negative));
        Self { origin: ray.origin.into(), inverse, negative, t_min: ray.t_min }
    }

    /// The distance at which the ray enters the box, if that is before `t_max`.
    ///
    /// A zero component of the direction gives infinite distances to both planes of its axis, or NaN for a
    /// plane that holds the origin. The comparisons are written so that a NaN does not constrain: a ray that
    /// lies in a face, or in a box without thickness, meets it.
    #[inline]
    fn entry(&self, node: &Node, t_max: f32) -> Option<f32> {
        let (near, far) = (Vec3A::splat(self.t_min), Vec3A::splat(t_max));
        let enter = (Vec3A::select(self.negative, node.max, node.min) - self.origin) * self.inverse;
        let exit = (Vec3A::select(self.negative, node.min, node.max) - self.origin) * self.inverse;
        let exit = exit * SLAB_MARGIN;
        let near = Vec3A::select(enter.cmpgt(near), enter, near).max_element();
        let far = Vec3A::select(exit.cmplt(far), exit, far).min_element();
        (near <= far).then_some(near)
    }
}

/// A stack that lives in an array and moves to the heap when a hierarchy is deeper than usual.
///
/// Short, because every ray clears it: depth grows with the logarithm of the number of primitives.
struct Stack {
    array: [(u32, f32); 24],
    length: usize,
    spilled: Vec<(u32, f32)>,
}

impl Stack {
    fn new() -> Self {
        Self { array: [(0, 0.0); 24], length: 0, spilled: Vec::new() }
    }

    #[inline]
    fn push(&mut self, entry: (u32, f32)) {
        if self.length < self.array.len() {
            self.array[self.length] = entry;
            self.length += 1;
        } else {
            self.spilled.push(entry);
        }
    }

    #[inline]
    fn pop(&mut self) -> Option<(u32, f32)> {
        if let Some(entry) = self.spilled.pop() {
            return Some(entry);
        }
        self.length = self.length.checked_sub(1)?;
        Some(self.array[self.length])
    }
}
