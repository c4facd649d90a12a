//! Look-ups on whatever floats there are: nothing panics, and what is found keeps the contract.

use glam::Vec3;
use proptest::prelude::*;
use upbp_accel::{PointTree, Ray, Segment, SegmentTree, SplitParams};

/// Numbers that break formulas, among ordinary ones.
fn number() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => -2.0_f32..2.0,
        1 => prop::sample::select(vec![
            0.0, -0.0, 1.0, -1.0, f32::MIN_POSITIVE, 1e-42, 1e-20, 1e-7, 1e7, 1e18, 1e20, f32::MAX, f32::MIN,
            f32::INFINITY, f32::NEG_INFINITY, f32::NAN,
        ]),
    ]
}

fn vector() -> impl Strategy<Value = Vec3> {
    [number(), number(), number()].prop_map(Vec3::from)
}

/// Mostly unit vectors, which is what callers guarantee.
fn direction() -> impl Strategy<Value = Vec3> {
    prop_oneof![
        6 => vector().prop_map(|v| v.try_normalize().unwrap_or(Vec3::X)),
        3 => prop::sample::select(vec![Vec3::X, -Vec3::Y, Vec3::Z]),
        1 => vector(),
    ]
}

fn segment() -> impl Strategy<Value = Segment> {
    (vector(), direction(), number(), number()).prop_map(|(origin, direction, start, length)| Segment {
        origin,
        direction,
        start,
        end: start + length,
    })
}

fn ray() -> impl Strategy<Value = Ray> {
    (vector(), direction(), number(), number()).prop_map(|(origin, direction, a, b)| Ray {
        origin,
        direction,
        t_min: a,
        t_max: b,
    })
}

/// Elements, some many times.
fn crowd<T: Clone + std::fmt::Debug>(one: impl Strategy<Value = T>) -> impl Strategy<Value = Vec<T>> {
    (prop::collection::vec(one, 0..60), 0_usize..200).prop_map(|(mut all, copies)| {
        if let Some(first) = all.first().cloned() {
            all.extend(std::iter::repeat_n(first, copies));
        }
        all
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn points(points in crowd(vector()), ray in ray(), radius in number()) {
        let finite = points.iter().filter(|p| p.is_finite()).count();
        let tree = PointTree::build(points.iter().copied().zip(0..).collect());
        prop_assert_eq!(tree.len(), finite);
        let mut found = vec![0; points.len()];
        tree.in_ball(ray.origin, radius, |index, distance2| {
            found[index as usize] += 1;
            assert!(distance2 >= 0.0 && distance2 < radius * radius, "{distance2} {radius}");
        });
        prop_assert!(found.iter().all(|count| *count <= 1));
        let mut found = vec![0; points.len()];
        tree.around_ray(&ray, radius, |index, t, distance2| {
            found[index as usize] += 1;
            assert!(t >= ray.t_min && t < ray.t_max && distance2 >= 0.0, "{t} {distance2}");
        });
        prop_assert!(found.iter().all(|count| *count <= 1));
    }

    #[test]
    fn segments(segments in crowd(segment()), ray in ray(), radius in number()) {
        let all = segments.iter().copied().zip(0..).collect();
        let tree = SegmentTree::build(all, SplitParams::default());
        let usable = |segment: &&Segment| {
            let Segment { origin, direction, start, end } = segment;
            origin.is_finite() && direction.is_finite() && start.is_finite() && end.is_finite() && start < end
        };
        prop_assert_eq!(tree.len(), segments.iter().filter(usable).count());
        let mut found = vec![0; segments.len()];
        tree.around_ray(&ray, radius, |index, approach| {
            found[index as usize] += 1;
            let segment = &segments[index as usize];
            assert!(approach.t_ray >= ray.t_min && approach.t_ray < ray.t_max);
            assert!(approach.t_segment >= segment.start && approach.t_segment < segment.end);
            assert!(approach.distance >= 0.0 && approach.distance < radius);
            assert!(approach.sin_theta > 0.0 && approach.sin_theta <= 1.0);
        });
        prop_assert!(found.iter().all(|count| *count <= 1));
        let mut found = vec![0; segments.len()];
        tree.around_point(ray.origin, radius, |index, t, distance2| {
            found[index as usize] += 1;
            assert!(t >= segments[index as usize].start && t < segments[index as usize].end && distance2 >= 0.0);
        });
        prop_assert!(found.iter().all(|count| *count <= 1));
    }
}
