//! The camera.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};
use upbp_estimators::scene::{Camera, CameraConnection, CameraRay, LensConnection};

/// A thin lens that looks along −z.
#[derive(Clone, Copy, Debug)]
pub struct ThinLens {
    /// Position of the middle of the lens.
    pub centre: Vec3,
    /// Pixels per side of the film.
    pub size: u32,
    /// Distance of the film in pixels.
    pub film_distance: f32,
    /// Radius of the lens, scene units; zero for a pinhole.
    pub radius: f32,
    /// Distance of the plane of focus, scene units.
    pub focus: f32,
}

impl ThinLens {
    fn pdf(&self, direction: Vec3) -> f32 {
        (self.film_distance / direction.z).powi(2) / -direction.z
    }

    /// The point of the lens, from its middle.
    fn offset(&self, [u, v]: [f32; 2]) -> Vec3 {
        let (sin, cos) = (TAU * v).sin_cos();
        self.radius * u.sqrt() * Vec3::new(cos, sin, 0.0)
    }

    /// The point of the chief ray of a place on the film at unit depth, from the middle of the lens.
    fn chief(&self, film: Vec2) -> Vec3 {
        let half = 0.5 * self.size as f32;
        Vec3::new(film.x - half, half - film.y, -self.film_distance) / self.film_distance
    }

    /// Area of the disc, in pixels, that is the image of a point at some depth.
    #[must_use]
    pub fn image_area(&self, depth: f32) -> f32 {
        let radius = self.radius * (1.0 / depth - 1.0 / self.focus) * self.film_distance;
        PI * radius * radius
    }
}

impl Camera for ThinLens {
    fn resolution(&self) -> (u32, u32) {
        (self.size, self.size)
    }

    fn ray(&self, film: Vec2, u_lens: [f32; 2]) -> Option<CameraRay> {
        let offset = self.offset(u_lens);
        let direction = (self.chief(film) * self.focus - offset).normalize();
        Some(CameraRay { origin: self.centre + offset, direction, pdf: self.pdf(direction) })
    }

    fn connect(&self, point: Vec3, u_lens: [f32; 2]) -> Option<CameraConnection> {
        let offset = self.offset(u_lens);
        let between = point - self.centre - offset;
        // Where the ray meets the plane of focus is where the chief ray meets it.
        let in_focus = offset + between * (self.focus / -between.z);
        let half = 0.5 * self.size as f32;
        let scale = self.film_distance / self.focus;
        let film = Vec2::new(half + in_focus.x * scale, half - in_focus.y * scale);
        let range = 0.0..self.size as f32;
        (between.z < 0.0 && range.contains(&film.x) && range.contains(&film.y)).then(|| CameraConnection {
            lens: self.centre + offset,
            film,
            pdf: self.pdf(between.normalize()),
        })
    }

    fn connect_at(&self, point: Vec3, film: Vec2) -> Option<LensConnection> {
        let relative = point - self.centre;
        let depth = -relative.z;
        let offset = (relative - self.chief(film) * depth) / (1.0 - depth / self.focus);
        let is_on_lens = depth > 0.0 && offset.length() < self.radius;
        is_on_lens.then(|| LensConnection {
            lens: self.centre + offset,
            pdf: self.pdf((relative - offset).normalize()),
            image_area: self.image_area(depth),
        })
    }

    fn is_pinhole(&self) -> bool {
        self.radius == 0.0
    }
}
