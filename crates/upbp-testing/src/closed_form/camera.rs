//! The camera.

use glam::{Vec2, Vec3};
use upbp_estimators::scene::{Camera, CameraConnection, CameraRay};

/// A pinhole that looks along −z.
#[derive(Clone, Copy, Debug)]
pub struct Pinhole {
    /// Position of the pinhole.
    pub centre: Vec3,
    /// Pixels per side of the film.
    pub size: u32,
    /// Distance of the film in pixels.
    pub film_distance: f32,
}

impl Pinhole {
    fn pdf(&self, direction: Vec3) -> f32 {
        (self.film_distance / direction.z).powi(2) / -direction.z
    }
}

impl Camera for Pinhole {
    fn resolution(&self) -> (u32, u32) {
        (self.size, self.size)
    }

    fn ray(&self, film: Vec2, _: [f32; 2]) -> Option<CameraRay> {
        let half = 0.5 * self.size as f32;
        let direction = Vec3::new(film.x - half, half - film.y, -self.film_distance).normalize();
        Some(CameraRay { origin: self.centre, direction, pdf: self.pdf(direction) })
    }

    fn connect(&self, point: Vec3, _: [f32; 2]) -> Option<CameraConnection> {
        let between = point - self.centre;
        let half = 0.5 * self.size as f32;
        let scale = self.film_distance / -between.z;
        let film = Vec2::new(half + between.x * scale, half - between.y * scale);
        let range = 0.0..self.size as f32;
        (between.z < 0.0 && range.contains(&film.x) && range.contains(&film.y)).then(|| CameraConnection {
            lens: self.centre,
            film,
            pdf: self.pdf(between.normalize()),
        })
    }

    fn is_pinhole(&self) -> bool {
        true
    }
}
