//! Radii that are a function of place: searches along rays equal a test of every item with its own radius
//! (`docs/theory.md`, section 5.4).

use glam::Vec3;
use proptest::collection::vec;
use proptest::prelude::*;
use upbp_accel::{PointTree, Ray, Segment, SegmentTree, SplitParams, closest_approach};
use upbp_estimators::{FootprintField, Kernel, RadiusField};

fn place() -> impl Strategy<Value = Vec3> {
    [-1.0_f32..1.0, -1.0..1.0, -1.0..1.0].prop_map(Vec3::from)
}

fn direction() -> impl Strategy<Value = Vec3> {
    prop_oneof![3 => place(), 1 => Just(Vec3::X), 1 => Just(Vec3::NEG_Z)]
        .prop_map(|v| v.normalize_or(Vec3::Y))
}

fn field() -> impl Strategy<Value = RadiusField> {
    let eye = prop_oneof![2 => place(), 1 => Just(Vec3::ZERO)];
    let offset = prop_oneof![Just(0.0_f32), 0.0..1.0_f32];
    let field = (eye, offset, 0.05..3.0_f32, 0.01..1.0_f32, 1.0..100.0_f32);
    let footprint = field.prop_map(|(eye, offset, slope, least, ratio)| {
        let eye = eye.to_array();
        RadiusField::Footprint(FootprintField { eye, offset, slope, least, most: ratio * least })
    });
    prop_oneof![9 => footprint, 1 => Just(RadiusField::Uniform)]
}

/// A ray among the items, or through the eye.
fn ray() -> impl Strategy<Value = Ray> {
    let range = prop_oneof![Just((0.0, f32::INFINITY)), (0.0..1.0_f32, 1.0..3.0_f32)];
    let origin = prop_oneof![3 => place(), 1 => Just(Vec3::ZERO)];
    (origin, direction(), range)
        .prop_map(|(origin, direction, (t_min, t_max))| Ray::new(origin, direction).with_range(t_min, t_max))
}

/// Whether what was found is what lies within the radius: all of which the distance is less than the radius,
/// none of which it is more, and each once. The distance is given as a part of the radius at the place; where
/// the two are equal within rounding, either is right.
fn are_those_within(found: &[(u32, u32)], all: &[(u32, u32, f32)]) -> bool {
    let count = |hit: (u32, u32)| found.iter().filter(|other| **other == hit).count();
    let is_right = |&(index, t, part): &(u32, u32, f32)| match count((index, t)) {
        0 => part > 0.9999,
        1 => part < 1.0001,
        _ => false,
    };
    all.iter().all(is_right) && found.iter().all(|hit| all.iter().any(|(index, t, _)| (*index, *t) == *hit))
}

#[test]
fn fields_of_a_wider_range_than_they_may_have_are_refused() {
    let field = |most| {
        RadiusField::Footprint(FootprintField { eye: [0.0; 3], offset: 0.1, slope: 0.5, least: 0.2, most })
    };
    assert!([0.2, 1.0, 0.2 * FootprintField::RANGE].into_iter().all(|most| field(most).is_valid(0.1)));
    assert!(
        [0.19, 0.21 * FootprintField::RANGE, f32::NAN].into_iter().all(|most| !field(most).is_valid(0.1))
    );
}

/// The greatest scale in a medium: of some fields below all, in between, or above.
fn greatest() -> impl Strategy<Value = f32> {
    prop_oneof![Just(f32::INFINITY), 0.05_f32..3.0]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(400) })]

    #[test]
    fn radii_change_by_at_most_a_tenth_of_the_distance(field in field(), a in place(), b in place()) {
        let radius = field.largest_radius().min(1e3);
        prop_assert!(field.is_valid(radius) && (field == RadiusField::Uniform || !field.is_valid(1.001 * radius)));
        let difference = radius * (field.at(a) - field.at(b)).abs();
        prop_assert!(difference <= 0.1 * (a - b).length() + 1e-5 * radius * field.at(a), "{difference}");
    }

    #[test]
    fn points_around_a_ray_equal_brute_force(
        field in field(), ray in ray(), radius in 0.01..0.3_f32, greatest in greatest(), points in vec(place(), 1..200),
    ) {
        let tree = PointTree::build(points.iter().copied().zip(0_u32..).collect());
        let mut found = Vec::new();
        tree.around_ray(&ray, field.search_radius(radius, greatest), |index, t, _| found.push((index, t.to_bits())));
        let brute = points.iter().zip(0..).filter_map(|(point, index)| {
            let offset = *point - ray.origin;
            let t = offset.dot(ray.direction);
            let distance = (offset - t * ray.direction).length();
            let part = distance / (radius * field.at(ray.at(t)).min(greatest));
            (t >= ray.t_min && t < ray.t_max).then_some((index, t.to_bits(), part))
        });
        prop_assert!(are_those_within(&found, &brute.collect::<Vec<_>>()));
    }

    #[test]
    fn segments_around_a_ray_equal_brute_force(
        field in field(),
        ray in ray(),
        radius in 0.01..0.3_f32,
        greatest in greatest(),
        segments in vec((place(), direction(), 0.1..2.0_f32), 1..200),
    ) {
        let segment = |&(origin, direction, end): &(Vec3, Vec3, f32)| Segment { origin, direction, start: 0.0, end };
        let segments: Vec<_> = segments.iter().map(segment).collect();
        let tree = SegmentTree::build(segments.iter().copied().zip(0_u32..).collect(), SplitParams::default());
        let mut found = Vec::new();
        tree.around_ray(&ray, field.search_radius(radius, greatest), |index, approach| {
            found.push((index, approach.t_ray.to_bits()));
        });
        let brute = segments.iter().zip(0..).filter_map(|(segment, index)| {
            let approach = closest_approach(&ray, segment, f32::INFINITY)?;
            let part = approach.distance / (radius * field.at(ray.at(approach.t_ray)).min(greatest));
            Some((index, approach.t_ray.to_bits(), part))
        });
        prop_assert!(are_those_within(&found, &brute.collect::<Vec<_>>()));
    }

    #[test]
    fn a_scaled_kernel_is_the_one_of_the_scaled_radius(radius in 1e-6..1e6_f32, factor in 0.01..100.0_f32) {
        for make in [Kernel::disc, Kernel::ball, Kernel::parabolic_disc, Kernel::parabolic_line] {
            prop_assert_eq!(make(radius).scaled(factor), make(factor * radius));
            prop_assert_eq!(make(radius).scaled(1.0), make(radius));
        }
        prop_assert_eq!(Kernel::NONE.scaled(factor), Kernel::NONE);
    }
}
