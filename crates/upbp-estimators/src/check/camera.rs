//! [`check_camera`]: rays and connections of a camera are each other's inverse.

use glam::Vec2;

use super::{Check, Random, is_density, is_unit, require, same};
use crate::scene::Camera;

/// Checks the contract of [`Camera`]: that `connect` inverts `ray`, and that the density of a pixel's
/// directions is one over its solid angle on average; and that the rays of a pinhole start in one point.
pub fn check_camera(camera: &impl Camera) -> Check {
    let (width, height) = camera.resolution();
    require(width > 0 && height > 0, "the film is not empty", (width, height))?;
    let crop = camera.crop();
    let inside = crop.width > 0
        && crop.height > 0
        && crop.x.checked_add(crop.width).is_some_and(|end| end <= width)
        && crop.y.checked_add(crop.height).is_some_and(|end| end <= height);
    require(inside, "the crop is a part of the film", crop)?;
    let size = Vec2::new(width as f32, height as f32);
    let mut random = Random(3);
    for _ in 0..2000 {
        let film = Vec2::from(random.pair()) * (size * 0.999);
        let u_lens = random.pair();
        let distance = 0.1 + 10.0 * random.next();
        let Some(ray) = camera.ray(film, u_lens) else { continue };
        let case = (film, u_lens, ray);
        require(is_unit(ray.direction), "a ray's direction is a unit vector", case)?;
        require(is_density(ray.pdf) && ray.pdf > 0.0, "a ray has a density", case)?;
        if camera.is_pinhole() {
            let other = camera.ray(film, random.pair()).map_or(ray.origin, |other| other.origin);
            require(other == ray.origin, "all rays of a pinhole start there", (case, other))?;
        }
        let Some(connection) = camera.connect(ray.origin + ray.direction * distance, u_lens) else {
            let margin = film.min(size - film).min_element();
            require(margin < 0.01, "a point on a ray is seen", case)?;
            continue;
        };
        let near = connection.film.distance(film) < 1e-4 * size.max_element() + 1e-2;
        require(near, "connect inverts ray", (case, connection))?;
        let tolerance = 1e-4 * (ray.origin.length() + f32::MIN_POSITIVE);
        let same_lens = connection.lens.distance(ray.origin) <= tolerance;
        require(same_lens, "the same numbers give the same lens point", (case, connection))?;
        require(same(connection.pdf, ray.pdf), "connect gives the density of ray", (case, connection))?;
    }
    for _ in 0..20 {
        let corner = (Vec2::from(random.pair()) * (size - Vec2::ONE)).floor();
        check_pixel(camera, corner, random.pair())?;
    }
    Ok(())
}

/// `E[1 / pdf]` over a pixel is its solid angle.
fn check_pixel(camera: &impl Camera, corner: Vec2, u_lens: [f32; 2]) -> Check {
    const STEPS: u32 = 16;
    let mut solid_angle = 0.0;
    for i in 0..STEPS * STEPS {
        let place = Vec2::new((i % STEPS) as f32 + 0.5, (i / STEPS) as f32 + 0.5) / STEPS as f32;
        let Some(ray) = camera.ray(corner + place, u_lens) else { return Ok(()) };
        solid_angle += f64::from(1.0 / ray.pdf) / f64::from(STEPS * STEPS);
    }
    let direction = |offset| camera.ray(corner + offset, u_lens).map(|ray| ray.direction.as_dvec3());
    let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y].map(direction);
    let [Some(a), Some(b), Some(c), Some(d)] = corners else { return Ok(()) };
    // Differences first: the triple product of nearly parallel unit vectors cancels. A small spherical
    // triangle; Van Oosterom and Strackee 1983.
    let triangle = |a: glam::DVec3, b: glam::DVec3, c: glam::DVec3| {
        let volume = a.dot((b - a).cross(c - a)).abs();
        2.0 * volume.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
    };
    let expected = triangle(a, b, c) + triangle(a, c, d);
    // Directions are rounded to single precision: a pixel's edge has that error, relative to its length.
    let tolerance = 1e-3 + 4.0 * f64::from(f32::EPSILON) / expected.sqrt();
    let within = (solid_angle - expected).abs() <= tolerance * expected;
    require(within, "a pixel's density is one over its solid angle", (corner, solid_angle, expected))
}
