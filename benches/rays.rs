//! Rays against surfaces, and the build of the hierarchy.
//!
//! Names are `scene/rays/question`, as in `sphere-1m/incoherent/any`; throughput is in rays. Coherent rays
//! come from a camera in the order of its pixels, incoherent ones start anywhere in the scene and go
//! anywhere; for `any` they have an end. `build/SCENE` is in primitives.

use std::f32::consts::{PI, TAU};
use std::hint::black_box;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{Affine3A, Quat, Vec3};
use upbp_accel::{Quad, Ray, SceneGeometry, Shape, Sphere, TriangleMesh};
use upbp_estimators::{Stream, StreamKind};

/// Rays in a batch: the side of the camera's picture, squared.
const SIDE: usize = 128;

fn cube(random: &mut Stream) -> Vec3 {
    Vec3::new(random.uniform(), random.uniform(), random.uniform()) * 2.0 - 1.0
}

fn quad(origin: Vec3, u: Vec3, v: Vec3) -> Shape {
    Quad::new(origin, u, v).expect("edges with an angle").into()
}

/// The walls of a box without a front, a lamp, and a wall inside: 7 quads.
fn room() -> Vec<Shape> {
    let (x, y, z, low) = (Vec3::X * 2.0, Vec3::Y * 2.0, Vec3::Z * 2.0, Vec3::NEG_ONE);
    vec![
        quad(low, x, z),
        quad(low + y, x, z),
        quad(low, x, y),
        quad(low, y, z),
        quad(low + x, y, z),
        quad(Vec3::new(-0.25, 0.99, -0.25), Vec3::X * 0.5, Vec3::Z * 0.5),
        quad(Vec3::new(-0.4, -1.0, 0.1), Vec3::new(0.6, 0.0, 0.2), Vec3::Y * 0.9),
    ]
}

/// The room with more walls, and spheres: 20 primitives.
fn mixed() -> Vec<Shape> {
    let mut random = Stream::new(5, 0, StreamKind::Camera, 0);
    let mut shapes = room();
    shapes.extend((0..9).map(|_| quad(cube(&mut random) * 0.6, Vec3::X * 0.4, Vec3::new(0.0, 0.3, 0.2))));
    shapes.extend(
        (0..4).map(|_| -> Shape {
            Sphere::new(cube(&mut random) * 0.7, 0.25).expect("a positive radius").into()
        }),
    );
    shapes
}

/// A sphere with bumps.
fn bumpy_sphere(triangles: usize) -> TriangleMesh {
    let rings = (triangles as f32 / 4.0).sqrt() as u32;
    let steps = 2 * rings;
    let at = |ring: u32, step: u32| {
        let (theta, phi) = (PI * ring as f32 / rings as f32, TAU * step as f32 / steps as f32);
        let radius = 1.0 + 0.1 * theta.sin() * (13.0 * phi).sin() * (9.0 * theta).sin();
        radius * Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
    };
    let positions = (0..=rings).flat_map(|ring| (0..steps).map(move |step| at(ring, step))).collect();
    let faces = (0..rings).flat_map(|ring| (0..steps).map(move |step| (ring * steps, step)));
    let indices = faces.flat_map(|(row, step)| {
        let next = (step + 1) % steps;
        let [a, b, c, d] = [row + step, row + next, row + steps + step, row + steps + next];
        [[a, b, d], [a, d, c]]
    });
    TriangleMesh::new(positions, indices.collect(), None).expect("a mesh")
}

/// Triangles anywhere.
fn soup(triangles: usize) -> TriangleMesh {
    let mut random = Stream::new(6, 0, StreamKind::Camera, 0);
    let size = 1.2 / (triangles as f32).cbrt();
    let corners = (0..triangles).flat_map(|_| {
        let centre = cube(&mut random);
        [(); 3].map(|()| centre + cube(&mut random) * size)
    });
    let positions = corners.collect();
    let indices = (0..triangles as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    TriangleMesh::new(positions, indices, None).expect("a mesh")
}

/// Twenty-seven copies of a mesh, or as many meshes of their own.
fn balls(are_copies: bool) -> Vec<Shape> {
    let ball = bumpy_sphere(100_000);
    let copy = |number: u32| {
        let place = Vec3::new((number % 3) as f32, (number / 3 % 3) as f32, (number / 9) as f32) - 1.0;
        let turned = Quat::from_rotation_y(number as f32);
        let to_scene = Affine3A::from_scale_rotation_translation(Vec3::splat(0.25), turned, place * 0.6);
        let copy = if are_copies { ball.placed(&to_scene) } else { ball.transformed(&to_scene) };
        copy.expect("a copy").into()
    };
    (0..27).map(copy).collect()
}

fn rays(coherent: bool) -> Vec<Ray> {
    let mut random = Stream::new(7, 0, StreamKind::Camera, 0);
    let ray = |pixel: usize| {
        let (origin, target) = if coherent {
            let place = Vec3::new((pixel % SIDE) as f32, (pixel / SIDE) as f32, 0.0) / SIDE as f32;
            (Vec3::new(0.05, 0.02, 2.6), place * 2.0 - 1.0)
        } else {
            (cube(&mut random), cube(&mut random))
        };
        Ray::new(origin, (target - origin).normalize()).with_range(0.0, (target - origin).length())
    };
    (0..SIDE * SIDE).map(ray).collect()
}

fn scenes(criterion: &mut Criterion) {
    let mesh = |mesh: TriangleMesh| vec![Shape::from(mesh)];
    let scenes: [(&str, &dyn Fn() -> Vec<Shape>); 8] = [
        ("quads-7", &room),
        ("mixed-20", &mixed),
        ("sphere-100k", &|| mesh(bumpy_sphere(100_000))),
        ("sphere-1m", &|| mesh(bumpy_sphere(1_000_000))),
        ("soup-100k", &|| mesh(soup(100_000))),
        ("soup-1m", &|| mesh(soup(1_000_000))),
        ("copies-27-of-100k", &|| balls(true)),
        ("meshes-27-of-100k", &|| balls(false)),
    ];
    for (name, shapes) in scenes {
        let shapes = shapes();
        let scene = SceneGeometry::build(shapes.clone()).expect("a scene");
        let mut group = criterion.benchmark_group(name);
        group.sample_size(10).throughput(Throughput::Elements((SIDE * SIDE) as u64));
        for (kind, rays) in [("coherent", rays(true)), ("incoherent", rays(false))] {
            group.bench_function(BenchmarkId::new(kind, "nearest"), |bencher| {
                let nearest = |ray: &Ray| scene.closest(ray.with_range(0.0, f32::INFINITY));
                bencher.iter(|| rays.iter().filter_map(nearest).map(|hit| hit.t).sum::<f32>());
            });
            group.bench_function(BenchmarkId::new(kind, "any"), |bencher| {
                bencher.iter(|| rays.iter().filter(|ray| scene.any(**ray)).count());
            });
        }
        group.finish();
        let mut group = criterion.benchmark_group("build");
        group.sample_size(10).bench_function(name, |bencher| {
            let build = |shapes| black_box(SceneGeometry::build(shapes));
            bencher.iter_batched(|| shapes.clone(), build, BatchSize::PerIteration);
        });
        group.finish();
    }
}

criterion_group!(benches, scenes);
criterion_main!(benches);
