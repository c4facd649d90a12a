//! Scenes of shapes: hits lie on surfaces, meshes have no gaps, distances are accurate.

use crate::support::{Random, any_direction, visit_hits};
use glam::{Affine3A, DVec3, Vec3};
use upbp_accel::{AxisBox, Candidate, Quad, Ray, SceneGeometry, Shape, ShapeId, Sphere, TriangleMesh, Visit};

/// A closed surface that is not convex: a sphere with dents.
fn dented_ball(rings: u32, centre: Vec3, radius: f32) -> TriangleMesh {
    let mut positions = Vec::new();
    for ring in 0..=rings {
        for step in 0..2 * rings {
            let theta = std::f32::consts::PI * ring as f32 / rings as f32;
            let phi = std::f32::consts::PI * step as f32 / rings as f32;
            // Exactly on the axis at the poles, where all vertices coincide.
            let sin = if ring == 0 || ring == rings { 0.0 } else { theta.sin() };
            let r = radius * (1.0 + 0.3 * sin * (3.0 * phi).sin());
            positions.push(centre + r * Vec3::new(sin * phi.cos(), theta.cos(), sin * phi.sin()));
        }
    }
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for step in 0..2 * rings {
            let next = (step + 1) % (2 * rings);
            let [a, b] = [ring * 2 * rings + step, ring * 2 * rings + next];
            let [c, d] = [a + 2 * rings, b + 2 * rings];
            triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    TriangleMesh::new(positions, triangles, None).unwrap()
}

fn random_mesh(triangles: usize, scale: f32, offset: Vec3, random: &mut Random) -> TriangleMesh {
    let mut positions = Vec::new();
    for _ in 0..triangles {
        let centre = offset + random.cube() * scale;
        positions.extend([(); 3].map(|()| centre + random.cube() * 0.2 * scale));
    }
    let indices = (0..triangles as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    TriangleMesh::new(positions, indices, None).unwrap()
}

fn random_shapes(count: usize, scale: f32, offset: Vec3, random: &mut Random) -> Vec<Shape> {
    let shape = |_| {
        let centre = offset + random.cube() * scale;
        let size = scale * 10_f32.powf(-2.0 * random.unit());
        match random.below(4) {
            0 => Sphere::new(centre, size * 0.5).unwrap().into(),
            1 => {
                let mut extent = Vec3::splat(size * 0.5);
                extent[random.below(3)] *= if random.unit() < 0.3 { 0.05 } else { 1.0 };
                AxisBox::new(centre - extent, centre + extent).unwrap().into()
            }
            2 => {
                let u = any_direction(random);
                Quad::new(centre, u * size, u.any_orthogonal_vector() * size).unwrap().into()
            }
            _ => random_mesh(5, scale, offset, random).into(),
        }
    };
    (0..count).map(shape).collect()
}

fn all_hits(scene: &SceneGeometry, ray: Ray) -> Vec<Candidate> {
    let mut hits = Vec::new();
    visit_hits(scene, ray, &mut |candidate| {
        hits.push(*candidate);
        Visit::Continue
    });
    hits.sort_by(|a, b| a.t.total_cmp(&b.t).then((a.shape, a.primitive).cmp(&(b.shape, b.primitive))));
    hits
}

fn random_ray(scale: f32, offset: Vec3, random: &mut Random) -> Ray {
    let origin = offset + random.cube() * scale * if random.unit() < 0.5 { 1.0 } else { 4.0 };
    let t_min = if random.unit() < 0.5 { 0.0 } else { random.unit() * scale };
    let t_max = if random.unit() < 0.5 { f32::INFINITY } else { t_min + random.unit() * 3.0 * scale };
    let direction = if random.unit() < 0.5 {
        any_direction(random)
    } else {
        (offset + random.cube() * scale * 0.5 - origin).normalize_or(Vec3::X)
    };
    Ray::new(origin, direction).with_range(t_min, t_max)
}

#[test]
fn intersections_lie_on_the_surface() {
    let mut random = Random::new(12);
    for scale in [1e-6, 1.0, 1e6] {
        let shapes = random_shapes(40, scale, Vec3::ZERO, &mut random);
        let scene = SceneGeometry::build(shapes).unwrap();
        for _ in 0..500 {
            let ray = random_ray(scale, Vec3::ZERO, &mut random);
            for hit in all_hits(&scene, ray) {
                let point = scene.surface(&ray, &hit);
                let along = (point.position - ray.origin).dot(ray.direction);
                assert!((along - hit.t).abs() < 1e-5 * scale, "{along} instead of {}", hit.t);
                // A slanted triangle amplifies rounding across the ray.
                let across = (point.position - ray.at(hit.t)).length();
                assert!(across < 1e-5 * scale, "{across} off at scale {scale}");
                assert!((point.geometric_normal.length() - 1.0).abs() < 1e-6);
                assert_eq!(point.shading_normal, point.geometric_normal);
                let uv = scene.uv(&hit, &point);
                assert!(uv.iter().all(|u| (-1e-6..=1.0 + 1e-6).contains(u)), "{uv:?}");
                assert_eq!(scene.is_entering(&ray, &hit), point.geometric_normal.dot(ray.direction) < 0.0);
            }
        }
    }
}

#[test]
fn spheres_and_boxes_report_where_a_line_enters_and_leaves() {
    let sphere = Sphere::new(Vec3::new(0.0, 0.0, 5.0), 2.0).unwrap();
    let block = AxisBox::new(Vec3::new(-1.0, -1.0, 10.0), Vec3::new(1.0, 1.0, 12.0)).unwrap();
    let scene = SceneGeometry::build(vec![sphere.into(), block.into()]).unwrap();
    let ray = Ray::new(Vec3::ZERO, Vec3::Z);
    let hits: Vec<_> = all_hits(&scene, ray).iter().map(|hit| (hit.t, hit.shape.0, hit.primitive)).collect();
    assert_eq!(hits, [(3.0, 0, 0), (7.0, 0, 1), (10.0, 1, 4), (12.0, 1, 5)]);
    let normals: Vec<_> =
        all_hits(&scene, ray).iter().map(|hit| scene.surface(&ray, hit).geometric_normal).collect();
    assert_eq!(normals, [-Vec3::Z, Vec3::Z, -Vec3::Z, Vec3::Z]);
    let inside = Ray::new(Vec3::new(0.0, 0.0, 5.0), Vec3::Z);
    assert_eq!(all_hits(&scene, inside).first().map(|hit| (hit.t, hit.primitive)), Some((2.0, 1)));
    // The range is open.
    assert_eq!(all_hits(&scene, ray.with_range(3.0, 12.0)).len(), 2);
    assert_eq!(
        scene.bounds(),
        (
            Vec3::new(-2.0, -2.0, 3.0).map(f32::next_down),
            Vec3::new(2.0_f32.next_up(), 2.0_f32.next_up(), 12.0)
        )
    );
}

#[test]
fn a_visitor_may_shorten_the_ray_or_stop() {
    let spheres = (0..50).map(|i| Sphere::new(Vec3::Z * (2.0 + i as f32), 0.25).unwrap().into()).collect();
    let scene = SceneGeometry::build(spheres).unwrap();
    let ray = Ray::new(Vec3::ZERO, Vec3::Z);
    assert_eq!(all_hits(&scene, ray).len(), 100);

    let mut visits = 0;
    visit_hits(&scene, ray, &mut |_| {
        visits += 1;
        Visit::Stop
    });
    assert_eq!(visits, 1);

    let mut limit = f32::INFINITY;
    let mut kept = 0;
    visit_hits(&scene, ray, &mut |candidate| {
        assert!(candidate.t < limit);
        limit = limit.min(10.0);
        kept += u32::from(candidate.t < 10.0);
        Visit::ShrinkTo(10.0)
    });
    assert_eq!(kept, 17);

    // A greater distance does not lengthen the ray again.
    let mut order = Vec::new();
    visit_hits(&scene, ray, &mut |candidate| {
        order.push(candidate.t);
        Visit::ShrinkTo(if order.len() == 1 { candidate.t } else { 1e9 })
    });
    assert!(order.iter().all(|&t| t <= order[0]));
}

#[test]
fn an_empty_scene_has_no_hits() {
    let scene = SceneGeometry::build(Vec::new()).unwrap();
    let ray = Ray::new(Vec3::ZERO, Vec3::X);
    assert!(scene.closest(ray).is_none() && !scene.any(ray));
    assert_eq!(scene.bounds(), (Vec3::ZERO, Vec3::ZERO));
    assert!(scene.shapes().is_empty());
}

#[test]
fn rays_in_the_plane_of_thin_boxes_meet_them() {
    // The hierarchy's boxes around these quads have no thickness, and rays lie in their planes' boxes.
    let thin = 1e-6;
    for axis in 0..3 {
        let mut extent = Vec3::ONE;
        extent[axis] = thin;
        let shapes: Vec<Shape> = (0..20)
            .map(|i| {
                let mut centre = Vec3::ZERO;
                centre[(axis + 1) % 3] = 3.0 * i as f32;
                AxisBox::new(centre - extent, centre + extent).unwrap().into()
            })
            .collect();
        let scene = SceneGeometry::build(shapes).unwrap();
        for sign in [0.0, -0.0] {
            for place in [0.0, thin, -thin, 0.5 * thin] {
                let mut origin = Vec3::ZERO;
                origin[(axis + 1) % 3] = -9.0;
                origin[axis] = place;
                let mut direction = Vec3::splat(sign);
                direction[(axis + 1) % 3] = 1.0;
                let hits = all_hits(&scene, Ray::new(origin, direction));
                assert_eq!(hits.len(), 40, "axis {axis}, {place:e}");
            }
        }
    }
}

#[test]
fn a_thousand_coincident_shapes_stay_usable() {
    let scene = SceneGeometry::build(vec![Sphere::new(Vec3::ONE, 0.5).unwrap().into(); 20_000]).unwrap();
    let ray = Ray::new(Vec3::new(1.0, 1.0, -3.0), Vec3::Z);
    assert_eq!(all_hits(&scene, ray).len(), 40_000);
    assert_eq!(scene.closest(ray).map(|hit| hit.t), Some(3.5));
    assert!(!scene.any(Ray::new(Vec3::ZERO, Vec3::X)));
}

/// Where all neighbours are as good as each other, a builder may join one pair at a time.
#[test]
fn rows_of_equal_shapes_are_built_at_once() {
    for (count, step, radius) in [(100_000, 1.0, 0.4), (100_000, 1e20, 1e19), (10_000, 1e-30, 4e-31)] {
        let at = |i: u32| Vec3::new(i as f32 * step, 0.0, 0.0);
        let ball = |i| Sphere::new(at(i), radius).unwrap().into();
        let scene = SceneGeometry::build((0..count).map(ball).collect()).unwrap();
        if step == 1.0 {
            for i in [0, 1, 77_777, count - 1] {
                let hit = scene.closest(Ray::new(at(i) + 3.0 * Vec3::Z, Vec3::NEG_Z));
                assert_eq!(hit.map(|hit| hit.shape), Some(ShapeId(i)));
            }
        }
    }
}

#[test]
fn a_regular_grid_is_met_without_gaps() {
    // Rays through vertices and along edges of a height field: each meets it exactly once.
    let n = 100_u32;
    let at = |x: u32, y: u32| Vec3::new(x as f32, y as f32, ((x * 7 + y * 13) % 5) as f32 * 0.1);
    let positions = (0..=n).flat_map(|y| (0..=n).map(move |x| at(x, y))).collect();
    let corner = |x: u32, y: u32| y * (n + 1) + x;
    let triangles = (0..n)
        .flat_map(|y| (0..n).map(move |x| (x, y)))
        .flat_map(|(x, y)| {
            let [a, b, c, d] = [corner(x, y), corner(x + 1, y), corner(x, y + 1), corner(x + 1, y + 1)];
            [[a, b, d], [a, d, c]]
        })
        .collect();
    let scene =
        SceneGeometry::build(vec![TriangleMesh::new(positions, triangles, None).unwrap().into()]).unwrap();
    for x in 1..4 * n {
        for y in 1..4 * n {
            let origin = Vec3::new(x as f32 / 4.0, y as f32 / 4.0, 10.0);
            if x < 4 * n - 4 && y < 4 * n - 4 {
                assert_eq!(all_hits(&scene, Ray::new(origin, -Vec3::Z)).len(), 1, "{origin}");
            }
        }
    }
}

#[test]
fn distances_agree_with_double_precision() {
    // Möller and Trumbore's formula, independent of the sheared test.
    let mut random = Random::new(13);
    let mut hits = 0;
    for _ in 0..20_000 {
        let corners = [random.cube(), random.cube(), random.cube()];
        let ray = Ray::new(random.cube() * 2.0, any_direction(&mut random));
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        let (e1, e2, d) = (b - a, c - a, ray.direction.as_dvec3());
        let p = d.cross(e2);
        let determinant = e1.dot(p);
        let s = ray.origin.as_dvec3() - a;
        let u = s.dot(p) / determinant;
        let q = s.cross(e1);
        let v = d.dot(q) / determinant;
        let t = e2.dot(q) / determinant;
        let margin = u.min(v).min(1.0 - u - v);
        if margin.abs() < 1e-4 || t.abs() < 1e-4 || determinant.abs() < 1e-3 {
            continue;
        }
        let mesh = TriangleMesh::new(corners.to_vec(), vec![[0, 1, 2]], None).unwrap();
        let scene = SceneGeometry::build(vec![mesh.into()]).unwrap();
        let hit = scene.closest(ray);
        assert_eq!(hit.is_some(), margin > 0.0 && t > 0.0);
        if let Some(hit) = hit {
            hits += 1;
            assert!((f64::from(hit.t) - t).abs() < 1e-5 * t.max(1.0));
            assert!(DVec3::new(u - hit.uv[0] as f64, v - hit.uv[1] as f64, 0.0).length() < 1e-3);
        }
    }
    assert!(hits > 200, "{hits}");
}

#[test]
fn small_far_and_large_near_spheres_are_met_accurately() {
    for (distance, radius) in [(1e5_f32, 1e-2_f32), (1e6, 1.0), (1e3, 1e-4), (2.0, 1.0)] {
        let scene =
            SceneGeometry::build(vec![Sphere::new(Vec3::new(0.0, 0.0, distance), radius).unwrap().into()])
                .unwrap();
        // 0.6 and 0.8 of the radius to the side: the depth is 0.8 and 0.6 of it.
        for (side, depth) in [(0.6_f32, 0.8_f64), (0.8, 0.6)] {
            let ray = Ray::new(Vec3::new(side * radius, 0.0, 0.0), Vec3::Z);
            let hits = all_hits(&scene, ray);
            let expected = [-1.0, 1.0].map(|sign| (distance as f64 + sign * depth * radius as f64) as f32);
            assert_eq!(hits.len(), 2);
            for (hit, expected) in hits.iter().zip(expected) {
                assert!((hit.t - expected).abs() <= 2.0 * f32::EPSILON * distance, "{} {expected}", hit.t);
            }
        }
    }
    let floor = Sphere::new(Vec3::new(0.0, -1e6, 0.0), 1e6).unwrap();
    let scene = SceneGeometry::build(vec![floor.into()]).unwrap();
    let hit = scene.closest(Ray::new(Vec3::Y, -Vec3::Y)).unwrap();
    assert!((hit.t - 1.0).abs() < 1e-6, "{}", hit.t);
}

#[test]
fn closed_meshes_are_crossed_an_even_number_of_times() {
    let mesh = dented_ball(24, Vec3::ZERO, 1.0);
    assert!(mesh.is_closed());
    let positions: Vec<_> = (0..mesh.triangle_count()).flat_map(|triangle| mesh.corners(triangle)).collect();
    let scene = SceneGeometry::build(vec![mesh.into()]).unwrap();
    let mut random = Random::new(14);
    for _ in 0..20_000 {
        // Aim at a vertex or at the middle of two, from outside.
        let target = positions[random.below(positions.len())];
        let other = positions[random.below(positions.len())];
        let target = if random.unit() < 0.5 { target } else { (target + other) * 0.5 };
        let direction = any_direction(&mut random);
        let hits = all_hits(&scene, Ray::new(target - direction * 4.0, direction));
        assert!(hits.len().is_multiple_of(2), "{} crossings", hits.len());
        // The parity does not depend on the direction.
        let inside = random.cube() * 1.3;
        let crossings = all_hits(&scene, Ray::new(inside, direction)).len();
        assert_eq!(scene.shapes()[0].contains(inside), Some(!crossings.is_multiple_of(2)));
    }
}

/// A glass fibre: a ray that is given to one side by rounding is not to miss the box of that side's block.
#[test]
fn long_edges_of_a_thin_rod_have_no_gaps() {
    const SIDES: u32 = 64;
    let corner = |side: u32, z: f32| {
        let (sin, cos) = (std::f32::consts::TAU * (side % SIDES) as f32 / SIDES as f32).sin_cos();
        Vec3::new(0.0005 * cos, 0.0005 * sin, z)
    };
    let positions = (0..SIDES).flat_map(|side| [corner(side, -0.5), corner(side, 0.5)]).collect();
    let quad = |side| [2 * side, 2 * side + 1, 2 * ((side + 1) % SIDES), 2 * ((side + 1) % SIDES) + 1];
    let triangles = (0..SIDES).map(quad).flat_map(|[a, b, c, d]| [[a, c, d], [a, d, b]]).collect();
    let rod = TriangleMesh::new(positions, triangles, None).unwrap();
    let scene = SceneGeometry::build(vec![rod.into()]).unwrap();
    let mut random = Random::new(5);
    let mut lost = 0;
    for _ in 0..200_000 {
        let origin = 0.0004 * random.unit() * corner(random.below(64) as u32, 0.0).normalize();
        let origin = origin + (random.unit() - 0.5) * 0.8 * Vec3::Z;
        // As near to an edge as its ends are told apart from there.
        let along = origin.z + 0.003 * (random.unit() - 0.5);
        let target = corner(random.below(64) as u32, along) + 2e-8 * random.cube();
        let ray = Ray::new(origin, (target - origin).normalize());
        lost += usize::from(scene.closest(ray).is_none());
    }
    assert_eq!(lost, 0);
}

/// Rays along the seam of two tiles, some of which only meet one by rounding.
#[test]
fn seams_between_copies_have_no_gaps() {
    const SIZE: f32 = 1000.0;
    let corners = [[0.0, -1.0], [0.0, 1.0], [1.0, 1.0], [1.0, -1.0]];
    let positions = corners.map(|[x, z]| SIZE * Vec3::new(x, 0.0, z)).to_vec();
    let tile = TriangleMesh::new(positions, vec![[0, 1, 2], [0, 2, 3]], None).unwrap();
    let at = |x: f32| tile.placed(&Affine3A::from_translation(Vec3::new(x, 0.0, 0.0))).unwrap();
    let scene = SceneGeometry::build(vec![at(-SIZE).into(), at(0.0).into()]).unwrap();
    let mut random = Random::new(8);
    let mut lost = 0;
    for _ in 0..50_000 {
        let origin = Vec3::new(random.unit() - 0.5, 0.1 + 0.9 * random.unit(), 0.0);
        let target = Vec3::new(1e-4 * (random.unit() - 0.5), 0.0, 1.0 + 3.0 * random.unit());
        lost += usize::from(scene.closest(Ray::new(origin, (target - origin).normalize())).is_none());
    }
    assert_eq!(lost, 0);
}

#[test]
fn the_number_of_threads_does_not_show() {
    let mut random = Random::new(15);
    let mesh = random_mesh(20_000, 1.0, Vec3::ZERO, &mut random);
    let ray = Ray::new(Vec3::splat(-2.0), Vec3::ONE.normalize());
    let visits = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let scene = pool.install(|| SceneGeometry::build(vec![mesh.clone().into()])).unwrap();
        let mut order = Vec::new();
        visit_hits(&scene, ray, &mut |candidate| {
            order.push(candidate.primitive);
            Visit::Continue
        });
        order
    };
    let once = visits(1);
    assert!(once.len() > 10);
    assert_eq!(once, visits(2));
}
