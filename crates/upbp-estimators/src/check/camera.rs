//! [`check_camera`]: rays and connections of a camera are each other's inverse.

use glam::Vec2;

use super::{Check, Random, is_density, is_unit, require, same};
use crate::scene::{Camera, CameraRay};

/// Checks the contract of [`Camera`]: that `connect` inverts `ray`, and that the density of a pixel's
/// directions is one over its solid angle on average; that some place of the film has a ray, and that all
/// start at finite points, those of a pinhole in one; and, where there is a
/// [`connect_at`](Camera::connect_at), that it inverts `ray` and knows how densely the lens puts images of a
/// point.
pub fn check_camera(camera: &impl Camera) -> Check {
    let (width, height) = camera.resolution();
    require(width > 0 && height > 0, "the film is not empty", (width, height))?;
    let crop = camera.crop();
    require(crop.is_part_of((width, height)), "the crop is a part of the film", crop)?;
    let size = Vec2::new(width as f32, height as f32);
    let mut random = Random(3);
    let mut seen = 0;
    for _ in 0..2000 {
        let film = Vec2::from(random.pair()) * (size * 0.999);
        let u_lens = random.pair();
        let distance = 0.1 + 10.0 * random.next();
        let Some(ray) = camera.ray(film, u_lens) else { continue };
        let distance = distance.max(least_distance(&ray));
        seen += 1;
        let case = (film, u_lens, ray);
        require(ray.origin.is_finite(), "a ray starts at a finite point", case)?;
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
    require(seen > 0, "some place of the film has a ray", (width, height))?;
    for _ in 0..20 {
        let corner = (Vec2::from(random.pair()) * (size - Vec2::ONE)).floor();
        check_pixel(camera, corner, random.pair())?;
    }
    for _ in 0..20 {
        let film = Vec2::from(random.pair()) * size;
        check_images(camera, film, random.pair(), 0.1 + 10.0 * random.next())?;
    }
    Ok(())
}

/// Least distance at which rounding of coordinates does not turn the direction from the lens to a point.
fn least_distance(ray: &CameraRay) -> f32 {
    0.02 * ray.origin.length()
}

/// The images that all of the lens makes of a point that is seen at `film`.
fn check_images(camera: &impl Camera, film: Vec2, u_lens: [f32; 2], distance: f32) -> Check {
    const STEPS: u32 = 128;
    let grid = |i: u32| [i % STEPS, i / STEPS].map(|k| (k as f32 + 0.5) / STEPS as f32);
    let Some(ray) = camera.ray(film, u_lens) else { return Ok(()) };
    let point = ray.origin + ray.direction * distance.max(least_distance(&ray));
    let Some(connection) = camera.connect_at(point, film) else { return Ok(()) };
    let case = (film, u_lens, ray, connection);
    let is_density = is_density(connection.image_area) && connection.image_area > 0.0;
    require(is_density, "an image out of focus has an area", case)?;
    let images: Vec<_> =
        (0..STEPS * STEPS).filter_map(|i| camera.connect(point, grid(i))).map(|seen| seen.film).collect();
    let least = images.iter().fold(Vec2::INFINITY, |least, image| least.min(*image));
    let most = images.iter().fold(Vec2::NEG_INFINITY, |most, image| most.max(*image));
    // Narrower discs are lost in the rounding of places on the film.
    if (most - least).min_element() < 1e-3 * longer_side(camera) {
        return Ok(());
    }
    let at_lens = camera.connect(point, u_lens).map_or(connection.lens, |seen| seen.lens);
    let near = connection.lens.distance(at_lens) <= 0.01 * lens_size(camera) + 1e-4 * at_lens.length();
    require(near, "connect_at finds the lens point of the ray", (case, at_lens))?;
    require(same(connection.pdf, ray.pdf), "connect_at gives the density of ray", case)?;

    let (start, sides) = (0.75 * least + 0.25 * most, 0.5 * (most - least));
    let is_inside = |image: &&Vec2| {
        let offset = **image - start;
        offset.cmpge(Vec2::ZERO).all() && offset.cmplt(sides).all()
    };
    let share = images.iter().filter(is_inside).count() as f64 / f64::from(STEPS * STEPS);
    let density = |i: u32| {
        let seen = camera.connect_at(point, start + Vec2::from(grid(i)) * sides);
        seen.map_or(0.0, |seen| 1.0 / f64::from(seen.image_area))
    };
    let mean = (0..STEPS * STEPS).map(density).sum::<f64>() / f64::from(STEPS * STEPS);
    let expected = mean * f64::from(sides.x) * f64::from(sides.y);
    // Places of two grids: what lies on the rim of the window is counted or not.
    let within = (share - expected).abs() <= 0.02 * expected.max(share) + 0.005;
    require(within, "images of a point have the density of connect_at", (case, share, expected))
}

/// The longer side of the film.
fn longer_side(camera: &impl Camera) -> f32 {
    let (width, height) = camera.resolution();
    width.max(height) as f32
}

/// The distance between two far points of the lens.
fn lens_size(camera: &impl Camera) -> f32 {
    let (width, height) = camera.resolution();
    let middle = 0.5 * Vec2::new(width as f32, height as f32);
    let [a, b] = [[0.0, 0.5], [0.999, 0.5]].map(|u_lens| camera.ray(middle, u_lens));
    a.zip(b).map_or(0.0, |(a, b)| a.origin.distance(b.origin))
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
