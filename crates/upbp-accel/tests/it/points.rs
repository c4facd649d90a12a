//! Look-ups of points equal a test of every point.

use std::cell::RefCell;

use crate::support::{
    Random, SCALES_AND_PLACES, SPREADS, Spread, any_direction, any_radius, any_ray, far_positions, positions,
    radius_at,
};
use glam::Vec3;
use proptest::prelude::*;
use upbp_accel::{PointTree, Ray, SearchRadius};

/// A result that can be compared bit by bit, whatever the order.
type Hits = Vec<(u32, u32, u32)>;

fn tree(points: &[Vec3]) -> PointTree {
    PointTree::build(points.iter().zip(0..).map(|(&point, index)| (point, index)).collect())
}

fn ball(tree: &PointTree, centre: Vec3, radius: f32) -> Hits {
    let (mut hits, announced) = (Hits::new(), RefCell::new(Vec::new()));
    let ahead = |index| announced.borrow_mut().push(index);
    tree.in_ball_ahead(centre, radius, ahead, |index, distance2| {
        assert_eq!(announced.borrow()[hits.len()], index, "said before it is visited, in the same order");
        hits.push((index, distance2.to_bits(), 0));
    });
    assert_eq!(announced.borrow().len(), hits.len());
    hits.sort_unstable();
    hits
}

fn brute_ball(points: &[Vec3], centre: Vec3, radius: f32) -> Hits {
    let distance2 = points.iter().map(|&point| (point - centre).length_squared());
    distance2.zip(0..).filter(|&(d, _)| d < radius * radius).map(|(d, i)| (i, d.to_bits(), 0)).collect()
}

fn around(tree: &PointTree, ray: &Ray, radius: impl Into<SearchRadius>) -> Hits {
    let (mut hits, announced) = (Hits::new(), RefCell::new(Vec::new()));
    let ahead = |index| announced.borrow_mut().push(index);
    tree.around_ray_ahead(ray, radius, ahead, |index, t, distance2| {
        assert_eq!(announced.borrow()[hits.len()], index, "said before it is visited, in the same order");
        hits.push((index, t.to_bits(), distance2.to_bits()));
    });
    assert_eq!(announced.borrow().len(), hits.len());
    hits.sort_unstable();
    hits
}

fn brute_around(points: &[Vec3], ray: &Ray, radius: impl Into<SearchRadius>) -> Hits {
    let radius = radius.into();
    let mut hits = Vec::new();
    for (&point, index) in points.iter().zip(0..) {
        let from_origin = point - ray.origin;
        let t = from_origin.dot(ray.direction);
        let distance2 = (from_origin - t * ray.direction).length_squared();
        if distance2 < radius_at(radius, ray, t).powi(2) && t >= ray.t_min && t < ray.t_max {
            hits.push((index, t.to_bits(), distance2.to_bits()));
        }
    }
    hits
}

fn check(points: &[Vec3], scale: f32, offset: Vec3, queries: usize, random: &mut Random) -> usize {
    let tree = tree(points);
    assert_eq!(tree.len(), points.len());
    let mut hits = 0;
    for _ in 0..queries {
        let radius = scale * 10_f32.powf(random.unit() * 4.0 - 3.0);
        // Among the points or outside, and on a point: the origin may lie inside kernels.
        let place = match random.below(3) {
            0 => points.get(random.below(points.len().max(1))).copied().unwrap_or(offset),
            1 => offset + random.cube() * 3.0 * scale,
            _ => offset + random.cube() * scale,
        };
        let found = ball(&tree, place, radius);
        assert_eq!(found, brute_ball(points, place, radius));
        hits += found.len();

        let toward = points.get(random.below(points.len().max(1))).copied().unwrap_or(offset) - place;
        let ray = any_ray(place, toward, 0.3, scale, random);
        let found = around(&tree, &ray, radius);
        assert_eq!(found, brute_around(points, &ray, radius), "{ray:?} {radius}");
        hits += found.len();
    }
    hits
}

#[test]
fn every_spread_scale_and_place_equals_brute_force() {
    let mut random = Random::new(1);
    for spread in SPREADS {
        for (scale, offset) in SCALES_AND_PLACES {
            for count in [1, 7, 8, 9, 64, 65, 513, 3000] {
                let points = positions(spread, count, scale, offset, &mut random);
                let hits = check(&points, scale, offset, 30, &mut random);
                assert!(count < 513 || hits > 0, "{spread:?} {scale} {offset} tests nothing");
            }
        }
    }
}

#[test]
fn many_coincident_points_are_all_found() {
    let points = vec![Vec3::new(1.0, 2.0, 3.0); 50_000];
    let tree = tree(&points);
    assert_eq!(ball(&tree, points[0], 1e-6).len(), points.len());
    let ray = Ray::new(Vec3::new(1.0, 2.0, 0.0), Vec3::Z);
    assert_eq!(around(&tree, &ray, 1e-6).len(), points.len());
    assert_eq!(around(&tree, &ray.with_range(0.0, 3.0), 1e-6).len(), 0, "t_max is excluded");
    assert_eq!(around(&tree, &ray.with_range(3.0, 4.0), 1e-6).len(), points.len(), "t_min is included");
}

#[test]
fn rays_from_far_away_with_a_radius_near_rounding_equal_brute_force() {
    let mut random = Random::new(9);
    let mut hits = 0;
    for distance in [1e2, 1e4, 1e6] {
        for spread in SPREADS {
            let points = positions(spread, 2000, 1.0, Vec3::ZERO, &mut random);
            let tree = tree(&points);
            for _ in 0..300 {
                let origin = any_direction(&mut random) * distance;
                let target = points[random.below(points.len())];
                let ray = Ray::new(origin, (target - origin).normalize());
                let radius = distance * f32::EPSILON * 10_f32.powf(random.unit() * 2.0 - 1.0);
                let found = around(&tree, &ray, radius);
                assert_eq!(found, brute_around(&points, &ray, radius), "{ray:?} {radius}");
                hits += found.len();
            }
        }
    }
    assert!(hits > 1000);
}

#[test]
fn points_near_and_far_equal_brute_force() {
    let mut random = Random::new(10);
    let mut hits = [0; 2];
    for mean in [1e2, 1e4, 1e6] {
        let mut points = positions(Spread::Uniform, 2000, 1.0, Vec3::ZERO, &mut random);
        points.extend(far_positions(2000, mean, &mut random));
        let tree = tree(&points);
        for _ in 0..600 {
            let [from, to] = [0; 2].map(|_| points[random.below(points.len())]);
            let place = if random.unit() < 0.5 { from } else { random.cube() };
            let ray = any_ray(place, to - place, 0.8, place.distance(to), &mut random);
            let radius = any_radius(place.distance(to), &mut random);
            let found = around(&tree, &ray, radius);
            assert_eq!(found, brute_around(&points, &ray, radius), "{ray:?} {radius:?}");
            for &(index, ..) in &found {
                hits[usize::from(index >= 2000)] += 1;
            }
        }
    }
    assert!(hits.iter().all(|&hits| hits > 300), "{hits:?}");
}

#[test]
fn far_points_do_not_widen_the_search_among_near_ones() {
    let mut random = Random::new(11);
    let mut points = positions(Spread::Uniform, 10_000, 1.0, Vec3::ZERO, &mut random);
    let near = tree(&points);
    points.extend(far_positions(10_000, 1e6, &mut random));
    let all = tree(&points);
    let (mut among_near, mut among_all) = (0, 0);
    for _ in 0..200 {
        let ray = Ray::new(random.cube(), any_direction(&mut random)).with_range(0.0, 1.0);
        let radius = any_radius(1.0, &mut random);
        among_near += near.around_ray(&ray, radius, |_, _, _| {});
        among_all += all.around_ray(&ray, radius, |_, _, _| {});
    }
    assert!(among_all < 2 * among_near, "{among_all} instead of {among_near}");
}

#[test]
fn empty_and_extreme_queries_are_answered() {
    let none = tree(&[]);
    assert!(none.is_empty());
    assert!(ball(&none, Vec3::ZERO, f32::INFINITY).is_empty());
    assert!(around(&none, &Ray::new(Vec3::ZERO, Vec3::X), 1.0).is_empty());

    let points = positions(Spread::Uniform, 100, 1.0, Vec3::ZERO, &mut Random::new(2));
    let tree = tree(&points);
    let ray = Ray::new(Vec3::ZERO, Vec3::X).with_range(-10.0, 10.0);
    for radius in [0.0, -1.0, f32::NAN] {
        assert!(ball(&tree, points[0], radius).is_empty());
        assert!(around(&tree, &ray, radius).is_empty());
    }
    for radius in [1e3, 1e18, 1e30, f32::MAX, f32::INFINITY] {
        assert_eq!(ball(&tree, Vec3::ZERO, radius).len(), 100);
        assert_eq!(around(&tree, &ray, radius).len(), 100);
    }
}

#[test]
fn points_that_are_not_finite_are_dropped() {
    let mut points = positions(Spread::Uniform, 100, 1.0, Vec3::ZERO, &mut Random::new(3));
    points[10].x = f32::NAN;
    points[20].y = f32::INFINITY;
    points[99].z = f32::NEG_INFINITY;
    let tree = tree(&points);
    assert_eq!(tree.len(), 97);
    assert_eq!(ball(&tree, Vec3::ZERO, f32::INFINITY).len(), 97);
}

/// A node, a leaf for each 64 points, eight blocks for each leaf: so large a ball meets the boxes of blocks
/// without points, too.
#[test]
fn queries_tell_what_they_look_at() {
    for (count, all) in [(0, 0), (8, 1 + 1 + 8), (64, 1 + 1 + 8), (100, 1 + 2 + 16)] {
        let points = positions(Spread::Uniform, count, 1.0, Vec3::ZERO, &mut Random::new(count as u64));
        let tree = tree(&points);
        assert_eq!(tree.in_ball(Vec3::ZERO, 1e6, |_, _| {}), all, "{count}");
        // The boxes of the root are looked at to find that the ball, or the ray, meets none.
        let ray = Ray::new(Vec3::splat(1e3), Vec3::X);
        assert_eq!(tree.in_ball(Vec3::splat(1e6), 1.0, |_, _| {}), all.min(1), "{count}");
        assert_eq!(tree.around_ray(&ray, 1.0, |_, _, _| {}), all.min(1), "{count}");
        for radius in [0.0, -1.0, f32::NAN] {
            assert_eq!(tree.in_ball(Vec3::ZERO, radius, |_, _| {}), 0, "{count}");
            assert_eq!(tree.around_ray(&ray, radius, |_, _, _| {}), 0, "{count}");
        }
    }
}

#[test]
fn the_number_of_threads_does_not_show() {
    let points = positions(Spread::Clustered, 100_000, 1.0, Vec3::ZERO, &mut Random::new(4));
    let visits = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let tree = pool.install(|| tree(&points));
        let mut order = Vec::new();
        tree.in_ball(Vec3::ZERO, 1.0, |index, _| order.push(index));
        order
    };
    let once = visits(1);
    assert!(once.len() > 1000);
    assert_eq!(once, visits(2));
    assert_eq!(once, visits(3));
}

proptest! {
    #[test]
    fn random_points_equal_brute_force(
        seed: u64, count in 0_usize..300, spread in 0_usize..5, exponent in -6_i32..6, far in 0_i32..6,
    ) {
        let mut random = Random::new(seed);
        let scale = 10_f32.powi(exponent);
        let offset = random.direction() * (10_f32.powi(far) - 1.0) * scale;
        let points = positions(SPREADS[spread], count, scale, offset, &mut random);
        check(&points, scale, offset, 10, &mut random);
    }
}
