//! Copies of meshes, held to meshes of their own in the same places.

use std::f32::consts::{PI, TAU};

use glam::{Mat3, Quat};
use proptest::prelude::*;

use super::*;

/// A closed surface around the origin, wide or thin, with dents.
fn dented() -> impl Strategy<Value = TriangleMesh> {
    let sizes = [0.05_f32..1.0, 0.05_f32..1.0, 0.05_f32..1.0].prop_map(Vec3::from);
    let dents = prop::collection::vec(0.5_f32..1.0, 1..20);
    (2_u32..9, 3_u32..12, sizes, dents).prop_map(|(rings, steps, size, dents)| {
        let mut positions = vec![Vec3::Y * size, -Vec3::Y * size];
        for ring in 1..rings {
            for step in 0..steps {
                let (theta, phi) = (PI * ring as f32 / rings as f32, TAU * step as f32 / steps as f32);
                let outwards = Vec3::new(theta.sin() * phi.cos(), theta.cos(), -theta.sin() * phi.sin());
                positions.push(outwards * size * dents[positions.len() % dents.len()]);
            }
        }
        let at = |ring: u32, step: u32| match ring {
            0 => 0,
            ring if ring == rings => 1,
            ring => 2 + (ring - 1) * steps + step % steps,
        };
        let faces = (0..rings).flat_map(|ring| (0..steps).map(move |step| (ring, step)));
        let triangles = faces.flat_map(|(ring, step)| {
            let [a, b] = [at(ring, step), at(ring, step + 1)];
            let [c, d] = [at(ring + 1, step + 1), at(ring + 1, step)];
            let halves = [(ring > 0).then_some([a, d, b]), (ring + 1 < rings).then_some([b, d, c])];
            halves.into_iter().flatten()
        });
        TriangleMesh::new(positions, triangles.collect(), None).unwrap()
    })
}

/// Triangles anywhere, many in a plane across an axis.
fn soup() -> impl Strategy<Value = TriangleMesh> {
    let coordinate = || prop_oneof![(-1_i8..2).prop_map(f32::from), -1.0_f32..1.0];
    let position = [coordinate(), coordinate(), coordinate()].prop_map(Vec3::from);
    (3_usize..40).prop_flat_map(move |count| {
        let corner = 0..count as u32;
        let triangle = [corner.clone(), corner.clone(), corner];
        let parts = (prop::collection::vec(position.clone(), count), prop::collection::vec(triangle, 1..200));
        parts.prop_filter_map("no area", |(positions, triangles)| {
            TriangleMesh::new(positions, triangles, None).ok()
        })
    })
}

fn rotation() -> impl Strategy<Value = Mat3> {
    let axis = [-1.0_f32..1.0, -1.0..1.0, -1.0..1.0].prop_map(|axis| Vec3::from(axis).normalize_or(Vec3::X));
    let turned =
        (axis, 0.0..TAU).prop_map(|(axis, angle)| Mat3::from_quat(Quat::from_axis_angle(axis, angle)));
    prop_oneof![Just(Mat3::IDENTITY), turned]
}

/// Maps that keep angles.
fn even() -> impl Strategy<Value = Mat3> {
    (rotation(), prop_oneof![Just(1.0), -2.0_f32..2.0])
        .prop_filter_map("flat", |(rotation, scale)| (scale.abs() > 1e-3).then(|| rotation * scale))
}

/// Maps that mostly do not.
fn uneven() -> impl Strategy<Value = Mat3> {
    let factor = || prop_oneof![0.3_f32..3.0, -3.0_f32..-0.3];
    let stretch = [factor(), factor(), factor()].prop_map(|factors| Mat3::from_diagonal(Vec3::from(factors)));
    (rotation(), stretch, rotation()).prop_map(|(after, stretch, before)| after * stretch * before)
}

fn translation() -> impl Strategy<Value = Vec3> {
    [-4.0_f32..4.0, -4.0..4.0, -4.0..4.0].prop_map(Vec3::from)
}

/// Error of a corner in the scene: three products and sums of numbers up to ten.
const CORNER: f64 = 10.0 * 4.0 * f32::EPSILON as f64;

proptest! {
    /// Bounds decide the bounds of a scene, and so its pictures: to the bit, at any scale and place.
    #[test]
    fn bounds_of_copies_are_those_of_their_corners(
        mesh in prop_oneof![dented(), soup()],
        linear in prop_oneof![even(), uneven()],
        translation in translation(),
        exponent in -20_i32..20,
        far in 0_i32..8,
        moved in translation(),
    ) {
        let (scale, far) = (10_f32.powi(exponent), 10_f32.powi(far));
        let to_scene = Affine3A::from_mat3_translation(linear * scale, translation * scale * far);
        let (copy, own) = (mesh.placed(&to_scene), mesh.transformed(&to_scene));
        let (Ok(copy), Ok(own)) = (copy.clone(), own.clone()) else {
            prop_assert_eq!(copy.map(|copy| copy.aabb()), own.map(|own| own.aabb()));
            return Ok(());
        };
        prop_assert_eq!(copy.aabb(), own.aabb());
        let by = moved * scale * far;
        let copies = [copy.clone().translated(by), copy].map(|copy| copy.aabb());
        prop_assert_eq!(copies, [own.clone().translated(by), own].map(|own| own.aabb()));
    }

    #[test]
    fn areas_and_volumes_of_copies_are_those_of_their_triangles(
        mesh in dented(),
        linear in prop_oneof![even(), uneven()],
        translation in translation(),
    ) {
        let to_scene = Affine3A::from_mat3_translation(linear, translation);
        let placed = (mesh.placed(&to_scene), mesh.transformed(&to_scene));
        let (Ok(copy), Ok(own)) = placed else { return Ok(()) };
        let around = |[a, b, c]: [Vec3; 3]| f64::from(a.distance(b) + b.distance(c) + c.distance(a));
        let around: f64 = own.each().map(around).sum();
        let area = f64::from(own.area());
        prop_assert!((f64::from(copy.area()) - area).abs() < CORNER * around + 1e-6 * area);
        let corners: Vec<_> = own.each().flatten().collect();
        let triangles = (0..own.triangle_count()).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let volume = f64::from(TriangleMesh::new(corners, triangles, None).unwrap().signed_volume());
        prop_assert!(volume > 0.0);
        prop_assert!((f64::from(copy.signed_volume()) - volume).abs() < CORNER * area + 1e-6 * volume);
        // Volumes decide the order of bodies: no rounding of corners may change it, wherever they are.
        let far = Vec3::splat(1e3);
        for mesh in [own.clone(), own.translated(far), copy.clone().translated(far)] {
            prop_assert_eq!(mesh.signed_volume(), copy.signed_volume());
        }
    }

    /// Points are drawn by the areas of the mesh: they are as dense in each triangle of a copy.
    #[test]
    fn areas_of_a_mesh_are_in_proportion_to_those_of_its_even_copies(
        mesh in dented(),
        linear in even(),
        translation in translation(),
    ) {
        let to_scene = Affine3A::from_mat3_translation(linear, translation);
        let placed = (mesh.placed(&to_scene), mesh.transformed(&to_scene));
        let (Ok(copy), Ok(own)) = placed else { return Ok(()) };
        let [(shared, factor), (each, _)] = [&copy, &own].map(TriangleMesh::areas);
        let mut before = [0.0; 2];
        for (triangle, (&shared, &each)) in own.each().zip(shared.cumulative.iter().zip(&each.cumulative)) {
            let [a, b, c] = triangle;
            let around = f64::from(a.distance(b) + b.distance(c) + c.distance(a));
            let areas = [shared * factor - before[0], each - before[1]];
            prop_assert!((areas[0] - areas[1]).abs() < CORNER * around + 1e-6 * areas[1], "{areas:?}");
            before = [shared * factor, each];
        }
    }

    #[test]
    fn normals_lie_in_the_cone(
        mesh in prop_oneof![dented(), soup()],
        linear in even(),
        translation in translation(),
    ) {
        let to_scene = Affine3A::from_mat3_translation(linear, translation);
        let placed = (mesh.placed(&to_scene), mesh.transformed(&to_scene));
        let (Ok(copy), Ok(own)) = placed else { return Ok(()) };
        if let Some((axis, cos)) = copy.normal_cone() {
            for (triangle, [a, b, c]) in (0..).zip(own.each()) {
                // A corner off by an error turns a triangle by that over its height.
                let edge = (b - a).length().max((c - b).length()).max((a - c).length());
                let height = own.across(triangle).length() / f64::from(edge);
                let turned = 4.0 * CORNER / height + 1e-6;
                // The angle of a cosine near one has half of its digits.
                let off = f64::from(own.geometric_normal(triangle).dot(axis).clamp(-1.0, 1.0)).acos();
                prop_assert!(off <= f64::from(cos).acos() + turned + 1e-3, "{off} {cos}");
            }
        }
    }
}

#[test]
fn copies_share_what_does_not_depend_on_their_place() {
    let mesh = TriangleMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]], None).unwrap();
    let place = |linear: Mat3| mesh.placed(&Affine3A::from_mat3_translation(linear, Vec3::ONE)).unwrap();
    let turned = place(Mat3::from_rotation_x(0.3) * -2.5);
    let stretched = place(Mat3::from_diagonal(Vec3::new(1.0, 1.01, 1.0)));
    assert!(Arc::ptr_eq(turned.model(), mesh.model()) && Arc::ptr_eq(stretched.model(), mesh.model()));
    let table = |mesh: &TriangleMesh| mesh.areas().0.cumulative.as_ptr();
    assert_eq!(table(&turned), table(&mesh));
    assert_ne!(table(&stretched), table(&mesh));
}

/// A ball of many small triangles.
fn fine_ball() -> TriangleMesh {
    let (rings, steps) = (60_u16, 120_u16);
    let corner = |ring: u16, step: u16| {
        let (theta, phi) =
            (PI * f32::from(ring) / f32::from(rings), TAU * f32::from(step) / f32::from(steps));
        Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
    };
    let positions = (0..=rings).flat_map(|ring| (0..steps).map(move |step| corner(ring, step))).collect();
    let at = |ring: u16, step: u16| u32::from(ring * steps + step % steps);
    let cells = (0..rings).flat_map(|ring| (0..steps).map(move |step| (ring, step)));
    let triangles = cells.flat_map(|(ring, step)| {
        let [a, b, c, d] = [at(ring, step), at(ring, step + 1), at(ring + 1, step + 1), at(ring + 1, step)];
        [[a, b, d], [b, c, d]]
    });
    TriangleMesh::new(positions, triangles.collect(), None).unwrap()
}

#[test]
fn a_copy_whose_triangles_are_lost_in_rounding_has_areas_of_its_own() {
    let ball = fine_ball();
    for (distance, is_shared) in [(0.0, true), (100.0, true), (1e5, false), (1e6, false)] {
        let to_scene = Affine3A::from_translation(distance * Vec3::new(1.0, 0.7, -0.4));
        let (copy, own) = (ball.placed(&to_scene).unwrap(), ball.transformed(&to_scene).unwrap());
        assert_eq!(copy.areas().0.cumulative.as_ptr() == ball.areas().0.cumulative.as_ptr(), is_shared);
        assert!((copy.area() / own.area() - 1.0).abs() < 1e-3, "{distance}: {} {}", copy.area(), own.area());
        for i in 0..1000_u16 {
            let (_, normal) = copy.sample_area([f32::from(i) / 1000.0, 0.4]);
            assert!(is_shared || normal.is_normalized(), "{distance}: {normal}");
        }
    }
}

#[test]
fn copies_can_be_made_in_parallel() {
    let ball = fine_ball();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(4).build().unwrap();
    let copies: Vec<_> = pool.install(|| {
        use rayon::prelude::*;
        let place = |i: u16| ball.placed(&Affine3A::from_translation(f32::from(i) * Vec3::X)).unwrap();
        (0..64_u16).into_par_iter().map(place).collect()
    });
    assert!(copies.iter().all(|copy| Arc::ptr_eq(copy.model(), copies[0].model())));
}

/// On faces, edges and corners of a cube: of two opposite rays one enters it at most.
#[test]
fn points_of_the_surface_are_not_inside() {
    let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32);
    let faces: [[u32; 4]; 6] =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = faces.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let cube = TriangleMesh::new((0..8).map(corner).collect(), triangles, None).unwrap();
    for i in 0..125 {
        let place = [i % 5, i / 5 % 5, i / 25];
        let is_inside = place.iter().all(|step| (1..4).contains(step));
        let point = Vec3::from(place.map(|step| step as f32 / 4.0));
        assert_eq!(cube.contains(point), Some(is_inside), "{point}");
    }
}

/// Planes that were one in a file are one as well as before when the scene is moved near its origin.
#[test]
fn coordinates_that_are_moved_are_as_coarse_as_before() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y].map(|corner| corner + Vec3::new(1e4, -2e4, 10.0));
    let mesh = TriangleMesh::new(corners.to_vec(), vec![[0, 1, 2]], None).unwrap();
    let rounded = Vec3::new(10_001.0, 2e4, 10.0);
    for mesh in [mesh.placed(&Affine3A::IDENTITY).unwrap(), mesh] {
        assert_eq!(mesh.most_rounded(), rounded);
        let moved = mesh.translated(-corners[0]);
        assert_eq!((moved.bounds.1, moved.most_rounded()), (Vec3::new(1.0, 1.0, 0.0), rounded));
    }
}

#[test]
fn triangles_that_a_copy_has_flattened_have_no_normal() {
    let positions = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let positions = positions.into_iter().chain(positions.map(|corner| 1e-4 * corner - Vec3::X)).collect();
    let mesh = TriangleMesh::new(positions, vec![[0, 1, 2], [3, 4, 5]], None).unwrap();
    let far = mesh.placed(&Affine3A::from_translation(Vec3::splat(1e5))).unwrap();
    let normals = |mesh: &TriangleMesh| mesh.pieces().map(|(_, normal)| normal).collect::<Vec<_>>();
    assert_eq!((normals(&mesh), normals(&far)), (vec![Vec3::Z; 2], vec![Vec3::Z, Vec3::ZERO]));
}
