//! Shapes by themselves: validation, area sampling, inside and outside, leaving a surface.

use crate::support::{Random, visit_hits};
use glam::{Affine3A, Quat, Vec3};
use upbp_accel::{
    AxisBox, Border, GeometryError, Quad, Ray, SceneGeometry, Shape, Sphere, TriangleMesh, Visit,
    offset_origin,
};

/// Corners and triangles of a cube.
fn cube(min: Vec3, max: Vec3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let corner = |i: u32| {
        let pick = |bit: u32, low: f32, high: f32| if i >> bit & 1 == 0 { low } else { high };
        Vec3::new(pick(0, min.x, max.x), pick(1, min.y, max.y), pick(2, min.z, max.z))
    };
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    ((0..8).map(corner).collect(), triangles)
}

fn cube_mesh(min: Vec3, max: Vec3) -> TriangleMesh {
    let (positions, triangles) = cube(min, max);
    TriangleMesh::new(positions, triangles, None).unwrap()
}

fn every_kind(scale: f32, offset: Vec3) -> Vec<Shape> {
    let (u, v) = (Vec3::new(1.0, 0.5, -0.2), Vec3::new(-0.3, 1.0, 0.7));
    vec![
        Sphere::new(offset, scale).unwrap().into(),
        AxisBox::new(offset - scale, offset + Vec3::new(0.5, 1.0, 2.0) * scale).unwrap().into(),
        Quad::new(offset - (u + v) * 0.5 * scale, u * scale, v * scale).unwrap().into(),
        cube_mesh(offset - scale, offset + scale).into(),
        TriangleMesh::new(
            vec![offset - u * scale, offset + v * scale, offset + (u - v) * scale],
            vec![[0, 1, 2]],
            None,
        )
        .unwrap()
        .into(),
    ]
}

#[test]
fn bad_input_is_refused_with_its_place() {
    let nan = f32::NAN;
    assert!(matches!(Sphere::new(Vec3::NAN, 1.0), Err(GeometryError::NonFinite { .. })));
    assert!(matches!(Sphere::new(Vec3::ZERO, nan), Err(GeometryError::NonFinite { .. })));
    assert!(matches!(Sphere::new(Vec3::ZERO, 0.0), Err(GeometryError::Degenerate { .. })));
    assert!(matches!(Sphere::new(Vec3::ZERO, -1.0), Err(GeometryError::Degenerate { .. })));
    assert!(matches!(
        AxisBox::new(Vec3::ZERO, Vec3::new(1.0, 0.0, 1.0)),
        Err(GeometryError::Degenerate { .. })
    ));
    assert!(matches!(AxisBox::new(Vec3::ZERO, Vec3::INFINITY), Err(GeometryError::NonFinite { .. })));
    assert!(matches!(Quad::new(Vec3::ZERO, Vec3::X, Vec3::X * 2.0), Err(GeometryError::Degenerate { .. })));
    assert!(matches!(Quad::new(Vec3::ZERO, Vec3::X, Vec3::ZERO), Err(GeometryError::Degenerate { .. })));
    assert!(Quad::new(Vec3::ZERO, Vec3::X * 1e-30, Vec3::Y * 1e-30).is_ok());

    let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X * 2.0];
    let mesh = |positions: &[Vec3], triangles: &[[u32; 3]], normals: Option<Vec<Vec3>>| {
        TriangleMesh::new(positions.to_vec(), triangles.to_vec(), normals)
    };
    assert_eq!(
        mesh(&corners, &[[0, 1, 2], [0, 9, 1]], None).unwrap_err(),
        GeometryError::IndexOutOfRange { triangle: 1, vertex: 9, vertices: 4 }
    );
    assert_eq!(
        mesh(&[Vec3::ZERO, Vec3::NAN], &[], None).unwrap_err(),
        GeometryError::NonFiniteElement { what: "position", index: 1 }
    );
    assert_eq!(
        mesh(&corners, &[[0, 1, 2]], Some(vec![Vec3::Z])).unwrap_err(),
        GeometryError::NormalCount { positions: 4, normals: 1 }
    );
    let normals = Some(vec![Vec3::Z, Vec3::Z, Vec3::INFINITY, Vec3::Z]);
    assert_eq!(
        mesh(&corners, &[[0, 1, 2]], normals).unwrap_err(),
        GeometryError::NonFiniteElement { what: "normal", index: 2 }
    );
    assert!(matches!(mesh(&corners, &[[0, 1, 3]], None), Err(GeometryError::Degenerate { .. })));
    assert!(matches!(mesh(&corners, &[], None), Err(GeometryError::Degenerate { .. })));
    let partly = mesh(&corners, &[[0, 1, 3], [0, 1, 2], [2, 2, 1]], None).unwrap();
    assert_eq!((partly.triangle_count(), partly.dropped_triangles()), (1, 2));
    assert_eq!(partly.corners(0)[..], corners[..3]);
}

#[test]
fn areas_and_bounds_are_right() {
    let scale = 2.0;
    let areas: Vec<f32> = every_kind(scale, Vec3::ONE).iter().map(Shape::area).collect();
    let quad = Vec3::new(1.0, 0.5, -0.2).cross(Vec3::new(-0.3, 1.0, 0.7)).length() * 4.0;
    for (area, expected) in areas.iter().zip([50.265_484, 2.0 * (24.0 + 12.0 + 18.0), quad, 96.0, 1.5 * quad])
    {
        assert!((area / expected - 1.0).abs() < 1e-5, "{area} instead of {expected}");
    }
    let volumes: Vec<f32> = every_kind(scale, Vec3::ONE).iter().map(Shape::volume).collect();
    for (volume, expected) in volumes.iter().zip([33.510_323, 72.0, 0.0, 64.0, 0.0]) {
        assert!((volume - expected).abs() < 1e-4, "{volume} instead of {expected}");
    }
    assert!((cube_mesh(Vec3::splat(9.0), Vec3::splat(11.0)).signed_volume() - 8.0).abs() < 1e-5);
}

#[test]
fn area_samples_are_uniform() {
    let count = 40_000;
    let mut random = Random::new(21);
    for shape in every_kind(1.0, Vec3::new(3.0, -2.0, 1.0)) {
        let scene = SceneGeometry::build(vec![shape.clone()]).unwrap();
        let (min, max) = shape.aabb();
        // The true mean of position and normal from a fine grid, with the jittered one against it.
        let side = 500_u16;
        let grid = (0..side).flat_map(|i| (0..side).map(move |j| (i, j)));
        let centre = |i: u16| (f32::from(i) + 0.5) / f32::from(side);
        let mean =
            grid.map(|(i, j)| shape.sample_area([centre(i), centre(j)]).0.as_dvec3()).sum::<glam::DVec3>()
                / f64::from(side).powi(2);
        let (mut sum, mut missed) = (glam::DVec3::ZERO, 0);
        for _ in 0..count {
            let (position, normal) = shape.sample_area(random.square());
            sum += position.as_dvec3();
            assert!((normal.length() - 1.0).abs() < 1e-5);
            // A ray straight at the sample meets the surface there.
            let ray = Ray::new(position + normal, -normal).with_range(0.99, 1.01);
            missed += u32::from(scene.closest(ray).is_none_or(|hit| (hit.t - 1.0).abs() >= 1e-5));
        }
        // Samples within rounding of an edge.
        assert!(1000 * missed < count, "{missed} of {shape:?}");
        let sigma = f64::from((max - min).length()) / (f64::from(count) * 12.0).sqrt();
        assert!((sum / f64::from(count) - mean).length() < 5.0 * sigma, "{shape:?}");
    }

    // Against exact moments, which do not come from the sampler: E[z²] on a unit sphere is 1/3, and a
    // box's share of samples per face is its share of the area.
    let sphere = Sphere::new(Vec3::ZERO, 1.0).unwrap();
    let block = AxisBox::new(Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0)).unwrap();
    let cube = cube_mesh(Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0));
    let (mut z2, mut faces) = (0.0_f64, [[0.0_f64; 3]; 2]);
    for _ in 0..count {
        let u = random.square();
        z2 += f64::from(sphere.sample_area(u).0.z).powi(2);
        for (kind, normal) in [block.sample_area(u).1, cube.sample_area(u).1].into_iter().enumerate() {
            faces[kind][normal.abs().max_position()] += 1.0;
        }
    }
    assert!((z2 / f64::from(count) - 1.0 / 3.0).abs() < 5.0 * 0.3 / f64::from(count).sqrt());
    for shares in faces {
        for (share, area) in shares.iter().zip([6.0, 3.0, 2.0]) {
            assert!((share / f64::from(count) - area / 11.0).abs() < 5.0 * 0.5 / f64::from(count).sqrt());
        }
    }
    // Extremes of the random numbers stay on the surface.
    let top = 1.0_f32.next_down();
    for shape in every_kind(1.0, Vec3::ZERO) {
        for u in [[0.0, 0.0], [top, top], [0.0, top], [top, 0.0]] {
            let (position, normal) = shape.sample_area(u);
            let (min, max) = shape.aabb();
            assert!(position.cmpge(min - 1e-6).all() && position.cmple(max + 1e-6).all());
            assert!((normal.length() - 1.0).abs() < 1e-5);
        }
    }
}

#[test]
fn inside_and_outside_are_told_apart() {
    let mut random = Random::new(22);
    for (scale, offset) in [(1e-6, Vec3::ZERO), (1.0, Vec3::ZERO), (1e6, Vec3::ZERO), (1.0, Vec3::splat(1e4))]
    {
        let cube = cube_mesh(offset - scale, offset + scale);
        let block = AxisBox::new(offset - scale, offset + scale).unwrap();
        assert_eq!(cube.aabb(), block.aabb());
        for _ in 0..2000 {
            let point = offset + random.cube() * 1.5 * scale;
            let (min, max) = block.aabb();
            if point.cmpeq(min).any() || point.cmpeq(max).any() {
                continue;
            }
            assert_eq!(cube.contains(point), Some(block.contains(point)), "{point} at {scale} {offset}");
        }
        // Straight through corners and along diagonals of the faces.
        for point in [Vec3::ZERO, Vec3::splat(0.5), Vec3::new(0.5, 0.5, -0.5)] {
            assert_eq!(cube.contains(offset + point * scale), Some(true));
        }
        let sphere = Sphere::new(offset, scale).unwrap();
        assert!(sphere.contains(offset) && !sphere.contains(offset + Vec3::splat(0.6) * scale));
    }
    for shape in every_kind(1.0, Vec3::ZERO) {
        assert_eq!(shape.contains(Vec3::splat(0.1)).is_some(), shape.is_closed());
    }
}

#[test]
fn only_meshes_without_a_border_are_closed() {
    let (positions, triangles) = cube(Vec3::ZERO, Vec3::ONE);
    let border = |triangles: &[[u32; 3]]| {
        TriangleMesh::new(positions.clone(), triangles.to_vec(), None).unwrap().border()
    };
    assert_eq!(border(&triangles), Border::Nowhere);
    let Border::Open(edges) = border(&triangles[1..]) else { panic!("a hole") };
    let corners = triangles[0].map(|vertex| positions[vertex as usize]);
    assert!(edges.count == 3 && edges.one.iter().all(|end| corners.contains(end)), "{edges:?}");
    let doubled = border(&[&triangles[..], &triangles[..1]].concat());
    assert!(matches!(doubled, Border::Crowded(edges) if edges.count == 3), "a doubled triangle: {doubled:?}");
    let doubled = border(&[&triangles[..], &triangles[..]].concat());
    assert!(matches!(doubled, Border::Crowded(edges) if edges.count == 18), "a doubled cube: {doubled:?}");
    let mut flipped = triangles.clone();
    flipped[3].swap(0, 1);
    let mixed = border(&flipped);
    assert!(matches!(mixed, Border::BetweenWindings(edges) if edges.count == 3), "{mixed:?}");
    // What is missing comes first.
    assert!(matches!(border(&flipped[1..]), Border::Open(_)));

    // Own vertices for every triangle, as files with flat normals have.
    let separate = triangles.iter().flatten().map(|&vertex| positions[vertex as usize]).collect();
    let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    assert!(TriangleMesh::new(separate, indices, None).unwrap().is_closed());
}

#[test]
fn pieces_share_no_corner() {
    let cubes =
        [(Vec3::ZERO, Vec3::ONE), (Vec3::splat(2.0), Vec3::splat(4.0)), (Vec3::splat(9.0), Vec3::splat(9.5))];
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for (min, max) in cubes {
        let (corners, faces) = cube(min, max);
        let first = positions.len() as u32;
        positions.extend(corners);
        triangles.extend(faces.into_iter().map(|face| face.map(|vertex| first + vertex)));
    }
    let mesh = TriangleMesh::new(positions, triangles, None).unwrap();
    let moved = Affine3A::from_translation(Vec3::X);
    for (mesh, by) in [
        (mesh.clone(), Vec3::ZERO),
        (mesh.placed(&moved).unwrap(), Vec3::X),
        (mesh.transformed(&moved).unwrap(), Vec3::X),
    ] {
        let pieces: Vec<_> = mesh.pieces().collect();
        assert_eq!(pieces.len(), cubes.len());
        for (min, max) in cubes {
            let inside = |(point, normal): &&(Vec3, Vec3)| {
                let (behind, front) = (point - normal * 0.01, point + normal * 0.01);
                let holds = |p: Vec3| (min + by).cmple(p).all() && p.cmple(max + by).all();
                holds(behind) && !holds(front)
            };
            assert_eq!(pieces.iter().filter(inside).count(), 1, "{pieces:?}");
        }
    }
}

#[test]
fn copies_are_meshes_where_they_are_placed() {
    let turned = Affine3A::from_scale_rotation_translation(
        Vec3::new(2.0, 2.0, -0.5),
        Quat::from_axis_angle(Vec3::new(1.0, 2.0, 3.0).normalize(), 0.7),
        Vec3::new(5.0, -3.0, 1.0),
    );
    let tilted = Affine3A::from_cols_array(&[1.0, 0.0, 0.0, 0.3, 1.0, 0.0, 0.0, 0.2, 1.0, 0.0, 0.0, 9.0]);
    let normals = |positions: &[Vec3]| positions.iter().map(|p| (*p - 0.5).normalize()).collect::<Vec<_>>();
    let (positions, triangles) = cube(Vec3::ZERO, Vec3::ONE);
    let model = TriangleMesh::new(positions.clone(), triangles.clone(), Some(normals(&positions))).unwrap();
    // Normals keep their digits, whatever the scale.
    let tiny = model.placed(&Affine3A::from_scale(Vec3::splat(1e-25))).unwrap();
    let scene = SceneGeometry::build(vec![tiny.into()]).unwrap();
    let ray = Ray::new(Vec3::new(2e-26, 3e-26, 1e-24), -Vec3::Z);
    let point = scene.surface(&ray, &scene.closest(ray).unwrap());
    assert!(point.shading_normal.distance(point.geometric_normal) > 0.1, "{point:?}");

    for to_scene in [turned, tilted] {
        let copy = model.placed(&to_scene).unwrap();
        let in_scene: Vec<_> = positions.iter().map(|p| to_scene.transform_point3(*p)).collect();
        let mut triangles = triangles.clone();
        if to_scene.matrix3.determinant() < 0.0 {
            for triangle in &mut triangles {
                triangle.swap(1, 2);
            }
        }
        let to_normals = to_scene.matrix3.inverse().transpose();
        let normals = normals(&positions).into_iter().map(|normal| to_normals * normal).collect();
        let own = TriangleMesh::new(in_scene, triangles, Some(normals)).unwrap();
        assert!(copy.is_closed() && copy.signed_volume() > 0.0);
        assert!((copy.signed_volume() / own.signed_volume() - 1.0).abs() < 1e-5);
        assert!((copy.area() / own.area() - 1.0).abs() < 1e-5);
        for i in 0..8 {
            let u = [i as f32 / 8.0, 0.3];
            let ((a, normal_a), (b, normal_b)) = (copy.sample_area(u), own.sample_area(u));
            assert!(a.distance(b) < 1e-5 && normal_a.distance(normal_b) < 1e-5, "{a} {b}");
        }
        let centre = to_scene.transform_point3(Vec3::splat(0.5));
        let [copy, own] = [copy, own].map(|mesh| SceneGeometry::build(vec![mesh.into()]).unwrap());
        let mut random = Random::new(16);
        for _ in 0..200 {
            let target = to_scene.transform_point3(random.cube() * 0.5 + 0.5);
            let origin = centre + random.cube() * 9.0;
            let ray = Ray::new(origin, (target - origin).normalize());
            let [a, b] = [&copy, &own].map(|scene| scene.surface(&ray, &scene.closest(ray).unwrap()));
            assert!(a.position.distance(b.position) < 1e-4, "{a:?} {b:?}");
            assert!(a.geometric_normal.distance(b.geometric_normal) < 1e-4, "{a:?} {b:?}");
            assert!(a.shading_normal.distance(b.shading_normal) < 1e-3, "{a:?} {b:?}");
        }
    }
}

#[test]
fn copies_that_are_flat_or_nowhere_are_refused() {
    let model = cube_mesh(Vec3::ZERO, Vec3::ONE);
    let flat = Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0));
    assert!(matches!(model.placed(&flat), Err(GeometryError::Degenerate { .. })));
    let far = Affine3A::from_translation(Vec3::splat(1e12));
    assert!(matches!(model.placed(&far), Err(GeometryError::Degenerate { .. })));
    let nowhere = Affine3A::from_translation(Vec3::NAN);
    assert!(matches!(model.placed(&nowhere), Err(GeometryError::NonFinite { .. })));
    let large = Affine3A::from_scale(Vec3::splat(1e30));
    assert!(model.placed(&large).is_ok());
    let too_large = model.placed(&large).unwrap().placed(&large);
    assert!(matches!(too_large, Err(GeometryError::NonFinite { .. })));
}

#[test]
fn shading_normals_are_interpolated_on_the_side_of_the_surface() {
    let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
    let normals = vec![Vec3::Z, Vec3::new(1.0, 0.0, 1.0), -Vec3::new(0.0, 1.0, 1.0)];
    let mesh = TriangleMesh::new(corners, vec![[0, 1, 2]], Some(normals)).unwrap();
    let scene = SceneGeometry::build(vec![mesh.into()]).unwrap();
    let shade = |x: f32, y: f32| {
        let ray = Ray::new(Vec3::new(x, y, 1.0), -Vec3::Z);
        scene.surface(&ray, &scene.closest(ray).unwrap())
    };
    let point = shade(0.5, 0.01);
    assert_eq!(point.geometric_normal, Vec3::Z);
    assert!(point.shading_normal.dot(Vec3::new(0.5, 0.0, 1.0).normalize()) > 0.99);
    assert!(shade(0.05, 0.9).shading_normal.z > 0.0);
}

#[test]
fn the_length_of_a_normal_does_not_matter() {
    let shading_normal = |lengths: [f32; 3]| {
        let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        let unit = [Vec3::Z, Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, -0.6, 0.8)];
        let normals = (0..3).map(|corner| unit[corner] * lengths[corner]).collect();
        let mesh = TriangleMesh::new(corners, vec![[0, 1, 2]], Some(normals)).unwrap();
        let scene = SceneGeometry::build(vec![mesh.into()]).unwrap();
        let ray = Ray::new(Vec3::new(0.3, 0.4, 1.0), -Vec3::Z);
        scene.surface(&ray, &scene.closest(ray).unwrap()).shading_normal
    };
    let expected = shading_normal([1.0; 3]);
    for lengths in [[1.0, 10.0, 0.5], [1e-30, 3.0, 1e30]] {
        assert!(shading_normal(lengths).distance(expected) < 1e-6, "{lengths:?}");
    }
    // One without a length leaves it to the others.
    let expected = (0.3 * Vec3::new(0.6, 0.0, 0.8) + 0.4 * Vec3::new(0.0, -0.6, 0.8)).normalize();
    assert!(shading_normal([0.0, 1.0, 1.0]).distance(expected) < 1e-6);
}

#[test]
fn a_ray_that_leaves_a_surface_does_not_meet_it_again() {
    let mut random = Random::new(23);
    let (mut lost, mut total) = (0, 0);
    for scale in [1e-6, 1e-3, 1.0, 1e6] {
        for place in [
            Vec3::ZERO,
            // The scene's origin close to the surface.
            Vec3::new(1.0, 0.0, 0.0),
            Vec3::new(-1.0, 1.0, 1.0 + 1e-6),
            Vec3::new(10.0, -3.0, 7.0),
            Vec3::new(-1e3, 2e3, 5e3),
        ] {
            for shape in every_kind(scale, place * scale) {
                let scene = SceneGeometry::build(vec![shape.clone()]).unwrap();
                for _ in 0..500 {
                    let target = shape.sample_area(random.square()).0;
                    let origin = target + random.direction() * scale * 10_f32.powf(random.unit() * 3.0 - 1.0);
                    let Some(towards) = (target - origin).try_normalize() else { continue };
                    let ray = Ray::new(origin, towards);
                    let Some(hit) = scene.closest(ray) else { continue };
                    let point = scene.surface(&ray, &hit);
                    let normal = point.geometric_normal;
                    for _ in 0..8 {
                        // Grazing directions are the hard ones.
                        let sideways = random.direction();
                        let direction = match random.below(3) {
                            0 => sideways,
                            1 => (sideways.reject_from(normal).normalize_or(Vec3::X) + normal * 1e-3)
                                .normalize(),
                            _ => (sideways.reject_from(normal).normalize_or(Vec3::X) - normal * 1e-3)
                                .normalize(),
                        };
                        let leaving = direction.dot(normal) > 0.0;
                        let start = offset_origin(point.position, normal, direction);
                        assert!((start - point.position).length() <= 1e-5 * point.position.length() + 1e-30);
                        let mut again = 0;
                        visit_hits(&scene, Ray::new(start, direction), &mut |_| {
                            again += 1;
                            Visit::Continue
                        });
                        // Outwards nothing; inwards the far side of what is closed, once, unless the point
                        // rounds to an edge.
                        let expected = usize::from(shape.is_closed() && !leaving);
                        assert!(again <= expected, "{shape:?} from {} along {direction}", point.position);
                        lost += expected - again;
                        total += 1;
                    }
                }
            }
        }
    }
    assert!(total > 100_000 && lost * 10_000 < total, "{lost} of {total}");
}

#[test]
fn points_of_a_wide_ground_are_as_exact_as_their_coordinates() {
    for tilt in [0.0, 0.25_f32] {
        let (u, v) = (Vec3::new(0.0, 0.0, 2e7), Vec3::new(2e7, 2e7 * tilt, 0.0));
        let corner = Vec3::new(-1e7, -1e7 * tilt, -1e7);
        let quad = Quad::new(corner, u, v).unwrap();
        let corners = vec![corner, corner + u, corner + u + v, corner + v];
        let mesh = TriangleMesh::new(corners, vec![[0, 1, 2], [0, 2, 3]], None).unwrap();
        for shape in [Shape::from(quad), Shape::from(mesh)] {
            let scene = SceneGeometry::build(vec![shape]).unwrap();
            for i in 0..100 {
                let towards = Vec3::new((i as f32).sin(), -0.3, (0.7 * i as f32).cos()).normalize();
                let ray = Ray::new(Vec3::new(0.2, 1.0, -0.4), towards);
                let found = scene.surface(&ray, &scene.closest(ray).unwrap()).position;
                // The ground is y = tilt x.
                let [origin, direction] = [ray.origin, ray.direction].map(Vec3::as_dvec3);
                let tilt = f64::from(tilt);
                let t = (origin.y - tilt * origin.x) / (tilt * direction.x - direction.y);
                let expected = origin + t * direction;
                let error = (found.as_dvec3() - expected).abs().max_element();
                assert!(error <= 1.2e-7 * expected.abs().max_element(), "{found}, expected {expected}");
            }
        }
    }
}

#[test]
fn points_are_as_exact_for_rays_from_far_away() {
    let shapes: [Shape; 3] = [
        Sphere::new(Vec3::new(0.1, 0.2, -0.3), 0.5).unwrap().into(),
        AxisBox::new(Vec3::splat(-0.4), Vec3::new(0.3, 0.5, 0.6)).unwrap().into(),
        cube_mesh(Vec3::splat(-0.4), Vec3::new(0.3, 0.5, 0.6)).into(),
    ];
    for shape in shapes {
        let scene = SceneGeometry::build(vec![shape]).unwrap();
        for i in 0..200 {
            // Towards a point in them, from a million units.
            let direction =
                Vec3::new((i as f32).sin(), (1.7 * i as f32).sin(), (0.7 * i as f32).cos()).normalize();
            let ray = Ray::new(Vec3::new(0.1, 0.11, 0.12) - direction * 1e6, direction);
            let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
            // Rounding of the start may put the ray beside them.
            let Some(candidate) = scene.closest(ray) else { continue };
            let found = scene.surface(&ray, &candidate).position.as_dvec3();
            let off_ray = (found - origin).cross(direction).length();
            assert!(off_ray < 2e-7, "{found} is {off_ray} beside the ray");
        }
    }
}
