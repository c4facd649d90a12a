//! The camera and its film.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

/// A ray of the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraRay {
    /// The point on the lens (or the pinhole).
    pub origin: Vec3,
    /// Unit direction into the scene.
    pub direction: Vec3,
    /// Density of the direction, sr⁻¹, for one sample uniform over **one pixel**, given the lens point:
    /// `(distance of a film on which a pixel has unit area / cos)² / cos` for a perspective camera
    /// (`docs/theory.md`, section 1.2).
    pub pdf: f32,
}

/// The camera as seen from a point of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraConnection {
    /// The point on the lens.
    pub lens: Vec3,
    /// Place of the point on the film, in pixels: pixel (i, j) covers `[i, i+1) × [j, j+1)`, row 0 at the
    /// top.
    pub film: Vec2,
    /// [`CameraRay::pdf`] of the direction from the lens point to the point.
    pub pdf: f32,
}

/// The lens point through which the camera sees a point of the scene at a given place of the film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensConnection {
    /// The point on the lens.
    pub lens: Vec3,
    /// [`CameraRay::pdf`] of the direction from the lens point to the point.
    pub pdf: f32,
    /// One over the density, per pixel's area, with which a uniform `u_lens` puts the image of the point
    /// there: the area of the disc that a thin lens makes of a point out of focus, in pixels.
    pub image_area: f32,
}

/// A rectangle of pixels, `[x, x + width) × [y, y + height)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PixelRect {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
}

impl PixelRect {
    /// The whole film of some width and height.
    #[must_use]
    pub const fn whole((width, height): (u32, u32)) -> Self {
        Self { x: 0, y: 0, width, height }
    }

    /// Number of pixels.
    #[must_use]
    pub const fn pixels(&self) -> u64 {
        self.width as u64 * self.height as u64
    }

    /// Whether this is a part of a film of some width and height, and not empty.
    #[must_use]
    pub fn is_part_of(&self, (width, height): (u32, u32)) -> bool {
        let is_within = |start: u32, size: u32, whole: u32| {
            size > 0 && start.checked_add(size).is_some_and(|end| end <= whole)
        };
        is_within(self.x, self.width, width) && is_within(self.y, self.height, height)
    }
}

/// A camera with an ideal lens: the value of a pixel is the mean radiance over its square and the lens.
///
/// `Box<dyn Camera>` and `Arc<dyn Camera>` are cameras, too, for hosts with cameras of several types.
pub trait Camera: Send + Sync {
    /// Width and height of the film in pixels.
    fn resolution(&self) -> (u32, u32);

    /// The part of the film that is rendered; images have its size. Within the film, not empty.
    fn crop(&self) -> PixelRect {
        PixelRect::whole(self.resolution())
    }

    /// The ray through `film` (in pixels). `u_lens` is uniform in `[0, 1)²`, for the lens point. `None` is a
    /// sample that sees nothing, and counts as black.
    fn ray(&self, film: Vec2, u_lens: [f32; 2]) -> Option<CameraRay>;

    /// The connection of `point` with the camera through the lens point that `u_lens` stands for; `None` if
    /// it is not on the film. The inverse of [`ray`](Self::ray): the same `u_lens` gives the same lens point.
    fn connect(&self, point: Vec3, u_lens: [f32; 2]) -> Option<CameraConnection>;

    /// The connection of `point` with the camera through the lens point from which it is seen at `film`;
    /// `None` if there is none. The inverse of [`ray`](Self::ray) where the place on the film is given
    /// instead of the lens point.
    ///
    /// With it small lamps out of focus are even discs, which else only the rays of the few lens points that
    /// meet them would show (`docs/theory.md`, section 2.8). The default leaves them to these rays.
    fn connect_at(&self, point: Vec3, film: Vec2) -> Option<LensConnection> {
        let _ = (point, film);
        None
    }

    /// Whether all rays start in one point, so that the bodies around the camera are looked up only once.
    fn is_pinhole(&self) -> bool;
}
