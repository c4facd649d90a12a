//! Answers equal those of the exact tests of all primitives, without a tree or a test in single precision.

use std::f32::consts::{PI, TAU};

use glam::{Affine3A, DVec3, Mat3};
use proptest::prelude::*;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng as _;

use super::super::{Quad, TriangleMesh};
use super::*;
use crate::geometry::triangle::RayShear;

struct Random(Xoshiro256PlusPlus);

impl Random {
    fn unit(&mut self) -> f32 {
        (self.0.next_u64() >> 40) as f32 / (1_u64 << 24) as f32
    }

    fn cube(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    fn below(&mut self, count: usize) -> usize {
        (self.0.next_u64() % count as u64) as usize
    }

    /// Mostly along an axis or in a plane.
    fn direction(&mut self) -> Vec3 {
        let mut direction = self.cube();
        for _ in 0..self.below(4) {
            direction[self.below(3)] = if self.unit() < 0.5 { 0.0 } else { -0.0 };
        }
        direction.normalize_or(-Vec3::Z)
    }

    /// On a grid of few places, so that shapes touch and coincide, or anywhere.
    fn place(&mut self) -> Vec3 {
        if self.unit() < 0.5 { (self.cube() * 2.0).round() * 0.5 } else { self.cube() }
    }

    /// A shape near the origin; about as large as the scene, or small, or thin.
    fn shape(&mut self, scale: f32, offset: Vec3) -> Option<Shape> {
        let size = scale * 10_f32.powf(-6.0 * self.unit() * self.unit());
        let at = offset + self.place() * scale;
        let shape = match self.below(4) {
            0 => Sphere::new(at, size).ok()?.into(),
            1 => {
                let mut extent = self.cube().abs() * size;
                extent[self.below(3)] *= if self.unit() < 0.3 { 1e-7 } else { 1.0 };
                AxisBox::new(at - extent, at + extent).ok()?.into()
            }
            2 => Quad::new(at, self.place() * size, self.place() * scale).ok()?.into(),
            _ => {
                let positions: Vec<_> = (0..12).map(|_| at + self.place() * size).collect();
                let triangles = (0..20).map(|_| [(); 3].map(|()| self.below(12) as u32)).collect();
                TriangleMesh::new(positions, triangles, None).ok()?.into()
            }
        };
        Some(shape)
    }

    /// A map that may turn, mirror, stretch and shear.
    fn placement(&mut self, scale: f32, offset: Vec3) -> Affine3A {
        let mut map = Mat3::from_rotation_z(TAU * self.unit()) * Mat3::from_rotation_x(TAU * self.unit());
        match self.below(4) {
            0 => map = Mat3::IDENTITY,
            1 => map *= Mat3::from_diagonal(self.cube() * 3.0),
            2 => map *= 10_f32.powf(3.0 * self.unit() - 2.0),
            _ => map.x_axis += self.cube() * 0.5,
        }
        // About a place in the scene.
        let [from, to] = [self.place(), self.place()].map(|place| offset + place * scale);
        Affine3A::from_mat3_translation(map, to - map * from)
    }

    fn ray(&mut self, shapes: &[Shape], scale: f32, offset: Vec3) -> Ray {
        let mut origin = offset + self.place() * scale * [1.0, 1.0, 4.0, 1e3][self.below(4)];
        if !shapes.is_empty() && self.unit() < 0.3 {
            origin = shapes[self.below(shapes.len())].sample_area([self.unit(), self.unit()]).0;
        }
        let target = (offset + self.place() * scale).as_dvec3() - origin.as_dvec3();
        let direction =
            if self.unit() < 0.5 { target.normalize_or(DVec3::Y).as_vec3() } else { self.direction() };
        let t_min = if self.unit() < 0.5 { 0.0 } else { self.unit() * scale };
        let t_max = if self.unit() < 0.5 { f32::INFINITY } else { t_min + 3.0 * self.unit() * scale };
        Ray { origin, direction, t_min, t_max }
    }
}

/// All intersections, by shape and part.
fn brute_force(shapes: &[Shape], ray: &Ray) -> Vec<Candidate> {
    let mut hits = Vec::new();
    for (shape, index) in shapes.iter().zip(0..) {
        let mut add = |t: f64, primitive: u32, uv: [f32; 2]| {
            let t = t as f32;
            if t > ray.t_min && t < ray.t_max {
                hits.push(Candidate { t, shape: ShapeId(index), primitive, uv });
            }
        };
        match shape {
            Shape::Sphere(sphere) => {
                let roots = sphere.intersect(ray.origin, ray.direction).into_iter().flatten();
                roots.zip(0..).for_each(|(t, root)| add(t, root, [0.0; 2]));
            }
            Shape::Quad(quad) => {
                if let Some((t, uv)) = quad.intersect(ray.origin, ray.direction) {
                    add(t, 0, uv);
                }
            }
            Shape::Box(axis_box) => {
                let faces = axis_box.intersect(ray.origin, ray.direction).into_iter().flatten();
                faces.for_each(|(t, face)| add(t, face, [0.0; 2]));
            }
            Shape::Mesh(mesh) => {
                let shear = RayShear::new(ray.origin, ray.direction);
                for triangle in 0..mesh.triangle_count() {
                    if let Some(hit) = shear.intersect(mesh.corners(triangle)) {
                        add(hit.t, triangle, hit.weights);
                    }
                }
            }
        }
    }
    hits.sort_by(|a, b| a.t.total_cmp(&b.t).then((a.shape, a.primitive).cmp(&(b.shape, b.primitive))));
    hits
}

/// Checks all queries of some rays; returns the number of intersections.
fn check(shapes: usize, rays: usize, scale: f32, offset: Vec3, random: &mut Random) -> usize {
    let mut shapes: Vec<_> = (0..shapes).filter_map(|_| random.shape(scale, offset)).collect();
    let meshes: Vec<_> = shapes
        .iter()
        .filter_map(|shape| if let Shape::Mesh(mesh) = shape { Some(mesh) } else { None })
        .collect();
    let mut copies = Vec::new();
    for mesh in meshes {
        for _ in 0..random.below(3) {
            copies.extend(mesh.placed(&random.placement(scale, offset)).ok().map(Shape::from));
        }
    }
    shapes.extend(copies);
    let scene = SceneGeometry::build(shapes.clone()).unwrap();
    let mut found = 0;
    for _ in 0..rays {
        let ray = random.ray(&shapes, scale, offset);
        let expected = brute_force(&shapes, &ray);
        let (mut best, mut plain) = (Vec::new(), Vec::new());
        let mut collect = |candidate: &Candidate| {
            best.push(*candidate);
            Visit::Continue
        };
        scene.for_each_hit(ray, &mut collect);
        scene.search_plainly(ray, &mut |candidate| {
            plain.push(*candidate);
            Visit::Continue
        });
        assert_eq!(best, plain, "instruction sets differ: {ray:?}");
        best.sort_by(|a, b| a.t.total_cmp(&b.t).then((a.shape, a.primitive).cmp(&(b.shape, b.primitive))));
        assert_eq!(best, expected, "{ray:?} {shapes:?}");
        assert_eq!(scene.closest(ray), expected.first().copied(), "{ray:?} {shapes:?}");
        assert_eq!(scene.any(ray), !expected.is_empty(), "{ray:?} {shapes:?}");
        found += expected.len();
    }
    found
}

#[test]
fn any_scale_and_place_equals_brute_force() {
    let mut random = Random(Xoshiro256PlusPlus::seed_from_u64(1));
    let mut found = 0;
    for scale in [1e-30, 1e-18, 1e-6, 1.0, 1e6, 1e15, 1e18] {
        for offset in [Vec3::ZERO, Vec3::new(1e3, -1e3, 1e3), Vec3::new(0.0, 3e6, 0.0)] {
            for shapes in [1, 9, 40, 300] {
                found += check(shapes, 200, scale, offset * scale, &mut random);
            }
        }
    }
    assert!(found > 50_000, "{found}");
}

/// A closed surface with dents, and triangles of all sizes.
fn dented(random: &mut Random, centre: Vec3, radius: f32) -> Option<TriangleMesh> {
    let (rings, steps) = (2 + random.below(12) as u32, 3 + random.below(20) as u32);
    let mut positions = vec![centre + Vec3::Y * radius, centre - Vec3::Y * radius];
    for ring in 1..rings {
        for step in 0..steps {
            let (theta, phi) = (PI * ring as f32 / rings as f32, TAU * step as f32 / steps as f32);
            let outwards = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            positions.push(centre + outwards * radius * (0.3 + random.unit()));
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
        let [c, d] = [at(ring + 1, step), at(ring + 1, step + 1)];
        let halves = [(ring > 0).then_some([a, b, d]), (ring + 1 < rings).then_some([a, d, c])];
        halves.into_iter().flatten()
    });
    TriangleMesh::new(positions, triangles.collect(), None).ok()
}

proptest! {
    #[test]
    fn contains_equals_the_test_of_all_triangles(seed: u64, exponent in -12_i32..12, far in 0_i32..4) {
        let mut random = Random(Xoshiro256PlusPlus::seed_from_u64(seed));
        let scale = 10_f32.powi(exponent);
        let offset = random.cube() * scale * (10_f32.powi(far) - 1.0);
        let mut shapes: Vec<_> = (0..6).filter_map(|_| random.shape(scale, offset)).collect();
        for _ in 0..3 {
            let (centre, radius) = (offset + random.place() * scale, scale * random.unit());
            let Some(mesh) = dented(&mut random, centre, radius) else { continue };
            shapes.extend(mesh.placed(&random.placement(scale, offset)).ok().map(Shape::from));
            shapes.push(mesh.into());
        }
        let scene = SceneGeometry::build(shapes.clone()).unwrap();
        let mut inside = 0;
        for (shape, id) in shapes.iter().zip(0..) {
            let (min, max) = shape.aabb();
            for _ in 0..30 {
                let point = min + (max - min) * (random.cube() * 0.6 + 0.5);
                prop_assert_eq!(scene.contains(ShapeId(id), point), shape.contains(point), "{} {:?}", point, shape);
                inside += usize::from(shape.contains(point) == Some(true));
            }
        }
        prop_assert!(inside > 0);
    }

    #[test]
    fn random_scenes_equal_brute_force(seed: u64, shapes in 0_usize..80, exponent in -12_i32..12, far in 0_i32..7) {
        let mut random = Random(Xoshiro256PlusPlus::seed_from_u64(seed));
        let scale = 10_f32.powi(exponent);
        let offset = random.cube() * scale * (10_f32.powi(far) - 1.0);
        check(shapes, 20, scale, offset, &mut random);
    }
}
