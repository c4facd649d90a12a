//! Look-ups of segments equal a test of every segment.

use crate::support::{
    Random, SCALES_AND_PLACES, SPREADS, Spread, any_direction, any_radius, any_ray, far_positions, positions,
    radius_at,
};
use glam::Vec3;
use proptest::prelude::*;
use upbp_accel::{
    ClosestApproach, GrowingRadius, Ray, SearchRadius, Segment, SegmentTree, SplitParams, closest_approach,
};

fn tree(segments: &[Segment], pieces_per_segment: f32) -> SegmentTree {
    let with_index = segments.iter().zip(0..).map(|(&segment, index)| (segment, index)).collect();
    SegmentTree::build(with_index, SplitParams { pieces_per_segment })
}

fn bits(index: u32, hit: &ClosestApproach) -> (u32, [u32; 4]) {
    (index, [hit.t_ray, hit.t_segment, hit.distance, hit.sin_theta].map(f32::to_bits))
}

fn around_ray(tree: &SegmentTree, ray: &Ray, radius: impl Into<SearchRadius>) -> Vec<(u32, [u32; 4])> {
    let mut hits = Vec::new();
    tree.around_ray(ray, radius, |index, hit| hits.push(bits(index, &hit)));
    hits.sort_unstable();
    hits
}

fn brute_around_ray(
    segments: &[Segment],
    ray: &Ray,
    radius: impl Into<SearchRadius>,
) -> Vec<(u32, [u32; 4])> {
    let radius = radius.into();
    let hits = segments.iter().zip(0..).filter_map(|(segment, index)| {
        let hit = closest_approach(ray, segment, f32::INFINITY)?;
        (hit.distance < radius_at(radius, ray, hit.t_ray)).then(|| bits(index, &hit))
    });
    hits.collect()
}

fn around_point(tree: &SegmentTree, point: Vec3, radius: f32) -> Vec<(u32, u32, u32)> {
    let mut hits = Vec::new();
    tree.around_point(point, radius, |index, t, distance2| {
        hits.push((index, t.to_bits(), distance2.to_bits()));
    });
    hits.sort_unstable();
    hits
}

fn brute_around_point(segments: &[Segment], point: Vec3, radius: f32) -> Vec<(u32, u32, u32)> {
    let mut hits = Vec::new();
    for (segment, index) in segments.iter().zip(0..) {
        let from_origin = point - segment.origin;
        let t = from_origin.dot(segment.direction);
        let distance2 = (from_origin - t * segment.direction).length_squared();
        if distance2 < radius * radius && t >= segment.start && t < segment.end {
            hits.push((index, t.to_bits(), distance2.to_bits()));
        }
    }
    hits
}

/// Segments of all lengths that start at `origins`.
fn segments(origins: &[Vec3], scale: f32, random: &mut Random) -> Vec<Segment> {
    let shared = random.direction();
    let parallel = random.unit() < 0.3;
    let segment = |&origin: &Vec3| {
        let direction = if parallel { shared } else { any_direction(random) };
        let start = if random.unit() < 0.5 { 0.0 } else { random.unit() * scale };
        let end = start + scale * 10_f32.powf(random.unit() * 3.0 - 2.5);
        Segment { origin, direction, start, end }
    };
    origins.iter().map(segment).collect()
}

fn check(segments: &[Segment], scale: f32, offset: Vec3, queries: usize, random: &mut Random) -> usize {
    let trees = [0.0, 1.0, 3.5, 8.0].map(|pieces| tree(segments, pieces));
    let mut hits = 0;
    for _ in 0..queries {
        let radius = scale * 10_f32.powf(random.unit() * 3.0 - 2.5);
        let target = segments.get(random.below(segments.len().max(1)));
        let on_segment = target
            .map_or(offset, |target| target.at(target.start + (target.end - target.start) * random.unit()));
        let place = match random.below(3) {
            // The origin lies inside a kernel.
            0 => on_segment + random.cube() * radius * 0.5,
            1 => offset + random.cube() * 3.0 * scale,
            _ => offset + random.cube() * scale,
        };
        let ray = any_ray(place, on_segment - place, 0.4, scale, random);
        let of_ray = brute_around_ray(segments, &ray, radius);
        let of_point = brute_around_point(segments, place, radius);
        hits += of_ray.len() + of_point.len();
        for tree in &trees {
            assert_eq!(around_ray(tree, &ray, radius), of_ray, "{ray:?} {radius}");
            assert_eq!(around_point(tree, place, radius), of_point, "{place} {radius}");
        }
    }
    hits
}

#[test]
fn every_spread_scale_and_place_equals_brute_force() {
    let mut random = Random::new(5);
    for spread in SPREADS {
        for (scale, offset) in SCALES_AND_PLACES {
            for count in [1, 8, 9, 65, 600] {
                let origins = positions(spread, count, scale, offset, &mut random);
                let segments = segments(&origins, scale, &mut random);
                let hits = check(&segments, scale, offset, 40, &mut random);
                assert!(count < 600 || hits > 0, "{spread:?} {scale} {offset} tests nothing");
            }
        }
    }
}

#[test]
fn queries_from_far_away_with_a_radius_near_rounding_equal_brute_force() {
    let mut random = Random::new(9);
    let mut hits = 0;
    for distance in [1e2, 1e4, 1e6] {
        let origins = positions(Spread::Uniform, 1000, 1.0, Vec3::ZERO, &mut random);
        let beams = segments(&origins, 1.0, &mut random);
        let tree = tree(&beams, 4.0);
        for _ in 0..1000 {
            let origin = any_direction(&mut random) * distance;
            let target = beams[random.below(beams.len())];
            let place = target.at(target.start + (target.end - target.start) * random.unit());
            let ray = Ray::new(origin, (place - origin).normalize());
            let radius = distance * f32::EPSILON * 10_f32.powf(random.unit() * 2.0 - 1.0);
            let found = around_ray(&tree, &ray, radius);
            assert_eq!(found, brute_around_ray(&beams, &ray, radius), "{ray:?} {radius}");
            hits += found.len();
        }
        // Segments that are measured from far away, looked up close by.
        let distant: Vec<Segment> = beams
            .iter()
            .map(|beam| {
                let origin = beam.origin - beam.direction * distance;
                let [start, end] = [beam.start + distance, beam.end + distance];
                Segment { origin, direction: beam.direction, start, end: end.max(start.next_up()) }
            })
            .collect();
        let tree = self::tree(&distant, 4.0);
        for _ in 0..1000 {
            let target = distant[random.below(distant.len())];
            let place = target.at(target.start + (target.end - target.start) * random.unit());
            let radius = distance * f32::EPSILON * 10_f32.powf(random.unit() * 2.0 - 1.0);
            // At an end the box is as narrow as the test is wide by its rounding.
            for place in [place, target.at(target.start), target.at(target.end)] {
                let found = around_point(&tree, place, radius);
                assert_eq!(found, brute_around_point(&distant, place, radius), "{place} {radius}");
                hits += found.len();
            }
            let ray = Ray::new(place - random.direction() * 0.5, any_direction(&mut random));
            assert_eq!(around_ray(&tree, &ray, radius), brute_around_ray(&distant, &ray, radius));
        }
    }
    assert!(hits > 1000);
}

/// Beams in a scene of size one, and beams in clear air around it, measured from where they start or from
/// the scene.
fn near_and_far(count: usize, mean: f32, random: &mut Random) -> Vec<Segment> {
    let near = positions(Spread::Uniform, count, 1.0, Vec3::ZERO, random);
    let mut beams: Vec<Segment> = near
        .into_iter()
        .map(|origin| Segment { origin, direction: any_direction(random), start: 0.0, end: 0.3 })
        .collect();
    for place in far_positions(count, mean, random) {
        let (origin, distance) = (random.cube(), place.length());
        beams.push(if random.unit() < 0.5 {
            Segment { origin: place, direction: random.direction(), start: 0.0, end: 0.3 * distance }
        } else {
            Segment { origin, direction: place / distance, start: distance, end: 1.5 * distance }
        });
    }
    beams
}

#[test]
fn beams_near_and_far_equal_brute_force() {
    let mut random = Random::new(10);
    let mut hits = [0; 4];
    for mean in [1e2, 1e4, 1e6] {
        let beams = near_and_far(1000, mean, &mut random);
        let tree = tree(&beams, 4.0);
        for _ in 0..1000 {
            let [from, to] = [0; 2].map(|_| {
                let beam = beams[random.below(beams.len())];
                beam.at(beam.start + (beam.end - beam.start) * random.unit())
            });
            let place = if random.unit() < 0.5 { from } else { random.cube() };
            let ray = any_ray(place, to - place, 0.8, place.distance(to), &mut random);
            let radius = any_radius(place.distance(to), &mut random);
            let found = around_ray(&tree, &ray, radius);
            assert_eq!(found, brute_around_ray(&beams, &ray, radius), "{ray:?} {radius:?}");
            for &(index, ..) in &found {
                hits[usize::from(index >= 1000)] += 1;
            }
            let radius = radius_at(radius, &ray, 0.0);
            let found = around_point(&tree, to, radius);
            assert_eq!(found, brute_around_point(&beams, to, radius), "{to} {radius}");
            for &(index, ..) in &found {
                hits[2 + usize::from(index >= 1000)] += 1;
            }
        }
    }
    assert!(hits.iter().all(|&hits| hits > 300), "{hits:?}");
}

#[test]
fn far_beams_do_not_widen_the_search_among_near_ones() {
    let mut random = Random::new(11);
    let beams = near_and_far(10_000, 1e6, &mut random);
    // Whole: near ones would be split only where they are alone.
    let (near, all) = (tree(&beams[..10_000], 1.0), tree(&beams, 1.0));
    let (mut of_rays, mut of_points) = ([0; 2], [0; 2]);
    for _ in 0..200 {
        let place = random.cube();
        let ray = Ray::new(place, any_direction(&mut random)).with_range(0.0, 1.0);
        let radius = any_radius(1.0, &mut random);
        for (tree, index) in [(&near, 0), (&all, 1)] {
            of_rays[index] += tree.around_ray(&ray, radius, |_, _| {});
            of_points[index] += tree.around_point(place, 0.05, |_, _, _| {});
        }
    }
    for [among_near, among_all] in [of_rays, of_points] {
        // Some boxes of far beams hold the scene.
        assert!(among_all < 3 * among_near, "{among_all} instead of {among_near}");
    }
}

#[test]
fn identical_beams_are_each_found_once() {
    let beam = Segment { origin: Vec3::ZERO, direction: Vec3::ONE.normalize(), start: 0.0, end: 10.0 };
    let tree = tree(&vec![beam; 10_000], 8.0);
    assert!(tree.pieces() > 20_000, "{} pieces", tree.pieces());
    let ray = Ray::new(beam.at(5.0) - Vec3::Y * 3.0, Vec3::Y);
    let indices: Vec<u32> = around_ray(&tree, &ray, 0.1).into_iter().map(|hit| hit.0).collect();
    assert_eq!(indices, (0..10_000).collect::<Vec<_>>());
    let indices: Vec<u32> = around_point(&tree, beam.at(5.0), 0.1).into_iter().map(|hit| hit.0).collect();
    assert_eq!(indices, (0..10_000).collect::<Vec<_>>());
}

#[test]
fn places_between_pieces_belong_to_one() {
    // Rays across a beam at distances that include all joints of its pieces.
    let beam = Segment { origin: Vec3::new(-4.0, 0.0, 0.0), direction: Vec3::X, start: 0.0, end: 8.0 };
    for pieces in 1..=9_u8 {
        let tree = tree(&[beam], f32::from(pieces));
        for step in 0..8 * 9 * 8 * 7 {
            let s = step as f32 / (9.0 * 8.0 * 7.0);
            let ray = Ray::new(Vec3::new(s - 4.0, 0.05, -1.0), Vec3::Z);
            assert_eq!(around_ray(&tree, &ray, 0.1).len(), 1, "{s}");
            assert_eq!(around_point(&tree, Vec3::new(s - 4.0, 0.05, 0.0), 0.1).len(), 1, "{s}");
        }
        let end = Ray::new(Vec3::new(4.0, 0.05, -1.0), Vec3::Z);
        assert!(around_ray(&tree, &end, 0.1).is_empty(), "the end is excluded");
    }
}

#[test]
fn the_number_of_pieces_is_bounded() {
    let mut random = Random::new(6);
    let origins = positions(Spread::Uniform, 2000, 1.0, Vec3::ZERO, &mut random);
    let mut segments = segments(&origins, 1.0, &mut random);
    segments[17].end = 1e6;
    for pieces in [1.0, 2.0, 8.0] {
        let tree = tree(&segments, pieces);
        assert!(tree.pieces() >= tree.len());
        assert!(tree.pieces() as f32 <= pieces * tree.len() as f32, "{} of {pieces}", tree.pieces());
    }
    // Whatever is asked for.
    assert!(tree(&segments, f32::INFINITY).pieces() <= 64 * segments.len());
}

#[test]
fn beams_are_split_where_it_pays() {
    let mut random = Random::new(7);
    let mut beams = |count, lamp: Option<Vec3>| -> Vec<(Segment, u32)> {
        let origins = positions(Spread::Uniform, count, 1.0, Vec3::ZERO, &mut random);
        let mut beam = |origin| Segment { origin, direction: random.direction(), start: 0.0, end: 1.0 };
        origins.into_iter().map(|origin| (beam(lamp.unwrap_or(origin)), 0)).collect()
    };
    assert_eq!(SplitParams::choose(&beams(10_000, None), 1e-3), SplitParams::default());
    // Queries as wide as beams are long look at all pieces, those without a width at none.
    let growing = |slope| GrowingRadius { centre: Vec3::ZERO, offset: 0.0, slope, least: 1e-3, most: 1.0 };
    let everywhere = beams(10_000, None);
    for (radius, expected) in [
        (SearchRadius::Constant(1.0), SplitParams::WHOLE),
        (SearchRadius::Constant(0.0), SplitParams::default()),
        (SearchRadius::Growing(growing(1e-3)), SplitParams::default()),
        (SearchRadius::Growing(growing(1.0)), SplitParams::WHOLE),
    ] {
        assert_eq!(SplitParams::choose(&everywhere, radius), expected, "{radius:?}");
    }
    let mut from_one_point = beams(10_000, Some(Vec3::ONE));
    assert_eq!(SplitParams::choose(&from_one_point, 1e-3), SplitParams::WHOLE);
    // Those that will be dropped do not matter.
    for (beam, _) in from_one_point.iter_mut().step_by(3) {
        beam.end = f32::NAN;
    }
    assert_eq!(SplitParams::choose(&from_one_point, 1e-3), SplitParams::WHOLE);
    for (beam, _) in &mut from_one_point {
        beam.end = f32::NAN;
    }
    assert_eq!(SplitParams::choose(&from_one_point, 1e-3), SplitParams::default());
    assert_eq!(SplitParams::choose(&[], 1e-3), SplitParams::default());
}

#[test]
fn empty_and_extreme_queries_are_answered() {
    let ray = Ray::new(Vec3::new(0.1, 0.2, 0.3), Vec3::X).with_range(-1e3, 1e3);
    let none = tree(&[], 8.0);
    assert!(none.is_empty());
    assert!(around_ray(&none, &ray, f32::INFINITY).is_empty());
    assert!(around_point(&none, Vec3::ZERO, f32::INFINITY).is_empty());

    let mut random = Random::new(7);
    let segments: Vec<Segment> = (0..100)
        .map(|_| Segment { origin: random.cube(), direction: random.direction(), start: -50.0, end: 50.0 })
        .collect();
    let tree = tree(&segments, 4.0);
    for radius in [0.0, -1.0, f32::NAN] {
        assert!(around_ray(&tree, &ray, radius).is_empty());
        assert!(around_point(&tree, segments[0].at(0.1), radius).is_empty());
    }
    for radius in [1e3, 1e18, 1e30, f32::MAX, f32::INFINITY] {
        assert_eq!(around_ray(&tree, &ray, radius), brute_around_ray(&segments, &ray, radius));
        assert_eq!(around_point(&tree, Vec3::ZERO, radius).len(), 100);
    }
}

#[test]
fn segments_that_cannot_be_used_are_dropped() {
    let good = Segment { origin: Vec3::ZERO, direction: Vec3::X, start: 0.0, end: 1.0 };
    let bad = [
        Segment { end: f32::INFINITY, ..good },
        Segment { start: f32::NAN, ..good },
        Segment { end: 0.0, ..good },
        Segment { direction: Vec3::NAN, ..good },
        Segment { origin: Vec3::INFINITY, ..good },
    ];
    let tree = tree(&[&bad[..], &[good]].concat(), 8.0);
    assert_eq!(tree.len(), 1);
    let hits = around_point(&tree, Vec3::new(0.5, 0.0, 0.0), 0.1);
    assert_eq!(hits.len(), 1);
    assert_eq!(hits[0].0, 5, "payloads stay with their segments");
}

#[test]
fn the_number_of_threads_does_not_show() {
    let mut random = Random::new(8);
    let origins = positions(Spread::Clustered, 20_000, 1.0, Vec3::ZERO, &mut random);
    let segments = segments(&origins, 1.0, &mut random);
    let ray = Ray::new(Vec3::splat(-2.0), Vec3::ONE.normalize());
    let visits = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let tree = pool.install(|| tree(&segments, 8.0));
        let mut order = Vec::new();
        tree.around_ray(&ray, 0.3, |index, _| order.push(index));
        order
    };
    let once = visits(1);
    assert!(once.len() > 100);
    assert_eq!(once, visits(2));
}

proptest! {
    #[test]
    fn random_segments_equal_brute_force(
        seed: u64, count in 0_usize..120, spread in 0_usize..5, exponent in -6_i32..6, far in 0_i32..6,
    ) {
        let mut random = Random::new(seed);
        let scale = 10_f32.powi(exponent);
        let offset = random.direction() * (10_f32.powi(far) - 1.0) * scale;
        let origins = positions(SPREADS[spread], count, scale, offset, &mut random);
        let segments = segments(&origins, scale, &mut random);
        check(&segments, scale, offset, 10, &mut random);
    }
}
