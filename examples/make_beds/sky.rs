//! A clear sky without its sun, which is a light of its own in the scenes.

use std::path::Path;

use exr::prelude::write_rgb_file;
use glam::Vec3;

/// Pixels along the horizon.
const WIDTH: usize = 256;

/// Direction of the glow around the sun, in scenes without a rotation: behind the left shoulder of −z.
const SUN: Vec3 = Vec3::new(-0.57, 0.57, -0.59);

/// Radiance from a direction: pale at the horizon, deep blue above, a glow around the sun, and an earthy
/// brown below.
fn radiance(direction: Vec3) -> Vec3 {
    let height = direction.y.clamp(-1.0, 1.0);
    let glow = direction.dot(SUN.normalize()).max(0.0);
    let warm = Vec3::new(1.0, 0.9, 0.75) * (0.9 * glow.powi(24) + 0.2 * glow.powi(4));
    let (horizon, zenith) = (Vec3::new(0.82, 0.9, 1.0), Vec3::new(0.12, 0.27, 0.62));
    let sky = zenith.lerp(horizon, (-4.0 * height.max(0.0)).exp()) + warm;
    let ground = Vec3::new(0.22, 0.2, 0.17);
    // Over a pixel or two: an edge between two pixels would be a staircase.
    ground.lerp(sky, (0.5 + 20.0 * height).clamp(0.0, 1.0))
}

/// Writes the sky as a latitude-longitude image.
pub(crate) fn write(path: &Path) -> Result<(), exr::error::Error> {
    let height = WIDTH / 2;
    write_rgb_file(path, WIDTH, height, |x, y| {
        let longitude = ((x as f32 + 0.5) / WIDTH as f32 - 0.5) * std::f32::consts::TAU;
        let latitude = (0.5 - (y as f32 + 0.5) / height as f32) * std::f32::consts::PI;
        let direction =
            Vec3::new(latitude.cos() * longitude.sin(), latitude.sin(), -latitude.cos() * longitude.cos());
        radiance(direction).into()
    })
}
