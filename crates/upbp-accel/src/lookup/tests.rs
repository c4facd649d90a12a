//! Queries find the same, in the same order and after as many tests, with whatever instructions.

use glam::Vec3;
use proptest::prelude::*;

use super::*;
use crate::ray::Ray;

fn place() -> impl Strategy<Value = Vec3> {
    [-1.0_f32..1.0, -1.0..1.0, -1.0..1.0].prop_map(Vec3::from)
}

fn direction() -> impl Strategy<Value = Vec3> {
    place().prop_map(|place| place.normalize_or(Vec3::Z))
}

fn radius() -> impl Strategy<Value = SearchRadius> {
    let growing = (place(), 0.0_f32..0.1, 0.0_f32..0.2).prop_map(|(centre, offset, slope)| {
        SearchRadius::Growing(GrowingRadius { centre, offset, slope, least: 0.02, most: 0.3 })
    });
    prop_oneof![(0.01_f32..0.5).prop_map(SearchRadius::Constant), growing]
}

proptest! {
    #[test]
    fn points_are_found_alike(
        points in prop::collection::vec(place(), 1..600),
        (centre, towards, radius) in (place(), direction(), radius()),
        distance in 0.05_f32..0.5,
    ) {
        let tree = PointTree::build(points.into_iter().zip(0..).collect());
        let (mut best, mut plain) = (Vec::new(), Vec::new());
        let tests = tree.in_ball(centre, distance, |point, distance2| best.push((point, distance2)));
        let plain_tests = tree.in_ball_plainly(centre, distance, &|_| {}, &mut |point, distance2| {
            plain.push((point, distance2));
        });
        prop_assert_eq!((tests, best), (plain_tests, plain));

        let ray = Ray::new(centre, towards).with_range(0.0, 1.5);
        let (mut best, mut plain) = (Vec::new(), Vec::new());
        let tests = tree.around_ray(&ray, radius, |point, t, distance2| best.push((point, t, distance2)));
        let plain_tests = tree.around_ray_plainly(&ray, radius, &|_| {}, &mut |point, t, distance2| {
            plain.push((point, t, distance2));
        });
        prop_assert_eq!((tests, best), (plain_tests, plain));
    }

    #[test]
    fn segments_are_found_alike(
        segments in prop::collection::vec((place(), direction(), 0.01_f32..1.0), 1..200),
        (centre, towards, radius) in (place(), direction(), radius()),
        distance in 0.05_f32..0.5,
    ) {
        let segment = |(origin, direction, end)| Segment { origin, direction, start: 0.0, end };
        let segments = segments.into_iter().map(segment).zip(0..).collect();
        let tree = SegmentTree::build(segments, SplitParams::default());
        let (mut best, mut plain) = (Vec::new(), Vec::new());
        let tests = tree.around_point(centre, distance, |beam, s, distance2| best.push((beam, s, distance2)));
        let plain_tests = tree.around_point_plainly(centre, distance, &mut |beam, s, distance2| {
            plain.push((beam, s, distance2));
        });
        prop_assert_eq!((tests, best), (plain_tests, plain));

        let ray = Ray::new(centre, towards).with_range(0.0, 1.5);
        let (mut best, mut plain) = (Vec::new(), Vec::new());
        let tests = tree.around_ray(&ray, radius, |beam, approach| best.push((beam, approach)));
        let plain_tests = tree.around_ray_plainly(&ray, radius, &mut |beam, approach| plain.push((beam, approach)));
        prop_assert_eq!((tests, best), (plain_tests, plain));
    }
}
