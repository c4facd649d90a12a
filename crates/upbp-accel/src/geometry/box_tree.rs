//! Boxes, and the search for those around a point.

use std::ops::ControlFlow;

use glam::Vec3;

use super::build::{Boxed, Leaves, build};
use super::error::GeometryError;
use super::hierarchy::{BlockRef, Child, Hierarchy, Kind, MAX_INDEX, Visitor};
use super::lane_ray::{LaneRay, SlabRay};
use crate::ray::Ray;
use crate::simd::{Task, Wide, run};

/// Boxes behind a hierarchy that finds those around a point.
#[derive(Clone, Debug)]
pub struct BoxTree {
    boxes: Vec<(Vec3, Vec3)>,
    hierarchy: Hierarchy,
}

impl BoxTree {
    /// Builds the hierarchy over boxes, each by its least and its greatest coordinates.
    ///
    /// # Errors
    /// A corner that is not finite, or more boxes than can be indexed.
    pub fn new(boxes: impl IntoIterator<Item = (Vec3, Vec3)>) -> Result<Self, GeometryError> {
        let boxes: Vec<_> = boxes.into_iter().collect();
        if boxes.len() > MAX_INDEX {
            return Err(GeometryError::TooManyPrimitives { count: boxes.len() });
        }
        if let Some(index) = boxes.iter().position(|(min, max)| !(min.is_finite() && max.is_finite())) {
            return Err(GeometryError::NonFiniteElement { what: "box", index });
        }
        let boxed: Vec<_> = boxes.iter().map(|&(min, max)| Boxed { min, max, kind: Kind::Box }).collect();
        let mut block = |kind, members: &[u32]| Child::block(kind, members[0] as usize, 1);
        Ok(Self { boxes, hierarchy: build(&boxed, Leaves::BOXES, &mut block) })
    }

    /// Calls `visit` with the number of each box that `point` lies in, or on, in no particular but always the
    /// same order.
    pub fn for_each_around(&self, point: Vec3, mut visit: impl FnMut(usize)) {
        let is_around = |(min, max): (Vec3, Vec3)| min.cmple(point).all() && point.cmple(max).all();
        let check = |index| {
            if is_around(self.boxes[index]) {
                visit(index);
            }
        };
        run(Around { hierarchy: &self.hierarchy, point, check });
    }
}

/// A search for boxes around a point, or almost.
struct Around<'a, V> {
    hierarchy: &'a Hierarchy,
    point: Vec3,
    check: V,
}

impl<V: FnMut(usize)> Task for Around<'_, V> {
    #[inline(always)]
    fn run(self, wide: impl Wide) {
        let Self { hierarchy, point, check } = self;
        // A ray that ends where it starts.
        let ray = LaneRay::new(wide, &Ray::new(point, Vec3::X).with_range(0.0, 0.0));
        let _ = hierarchy.traverse::<false, SlabRay<_>, _>(wide, &ray, (), &mut 0.0, &mut Each(check));
    }
}

struct Each<V>(V);

impl<V: FnMut(usize)> Visitor for Each<V> {
    #[inline(always)]
    fn visit<W: Wide>(&mut self, _: W, _: &LaneRay<W>, block: BlockRef, _: &mut f32) -> ControlFlow<()> {
        (self.0)(block.index);
        ControlFlow::Continue(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn coordinate() -> impl Strategy<Value = f32> {
        prop_oneof![(-3_i8..4).prop_map(f32::from), -3.0_f32..3.0]
    }

    fn point() -> impl Strategy<Value = Vec3> {
        [coordinate(), coordinate(), coordinate()].prop_map(Vec3::from)
    }

    proptest! {
        #[test]
        fn every_box_around_a_point_is_found(
            boxes in prop::collection::vec((point(), point()), 0..60),
            points in prop::collection::vec(point(), 20),
            exponent in -30_i32..30,
        ) {
            let scale = 10_f32.powi(exponent);
            let boxes: Vec<_> = boxes.into_iter().map(|(a, b)| (a.min(b) * scale, a.max(b) * scale)).collect();
            let tree = BoxTree::new(boxes.iter().copied()).unwrap();
            for point in points.into_iter().map(|point| point * scale) {
                let is_around = |&index: &usize| {
                    let (min, max) = boxes[index];
                    (0..3).all(|axis| min[axis] <= point[axis] && point[axis] <= max[axis])
                };
                let mut found = Vec::new();
                tree.for_each_around(point, |index| found.push(index));
                found.sort_unstable();
                prop_assert_eq!(found, (0..boxes.len()).filter(is_around).collect::<Vec<_>>());
            }
        }
    }
}
