//! The camera and its film.

use glam::{Vec2, Vec3};

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
    /// Where the point is imaged, in pixels: pixel (i, j) covers `[i, i+1) × [j, j+1)`, row 0 at the top.
    pub film: Vec2,
    /// [`CameraRay::pdf`] of the direction from the lens point to the point.
    pub pdf: f32,
}

/// A rectangle of pixels, `[x, x + width) × [y, y + height)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

/// A camera with an ideal lens: the value of a pixel is the mean radiance over its square and the lens.
///
/// # Example
///
/// A pinhole:
///
/// ```
/// use glam::{Vec2, Vec3};
/// use upbp_estimators::check::check_camera;
/// use upbp_estimators::scene::{Camera, CameraConnection, CameraRay};
///
/// /// A pinhole that looks along −z, with a field of view of 90 degrees.
/// struct Pinhole {
///     position: Vec3,
///     /// Pixels per side of the film.
///     size: u32,
/// }
///
/// impl Pinhole {
///     /// Distance of a film on which a pixel has unit area, which is half as many pixels wide.
///     fn film_distance(&self) -> f32 {
///         0.5 * self.size as f32
///     }
///
///     fn pdf(&self, direction: Vec3) -> f32 {
///         let cos = -direction.z;
///         (self.film_distance() / cos).powi(2) / cos
///     }
/// }
///
/// impl Camera for Pinhole {
///     fn resolution(&self) -> (u32, u32) {
///         (self.size, self.size)
///     }
///
///     fn ray(&self, film: Vec2, _: [f32; 2]) -> Option<CameraRay> {
///         let half = self.film_distance();
///         let direction = Vec3::new(film.x - half, half - film.y, -half).normalize();
///         Some(CameraRay { origin: self.position, direction, pdf: self.pdf(direction) })
///     }
///
///     fn connect(&self, point: Vec3, _: [f32; 2]) -> Option<CameraConnection> {
///         let (half, between) = (self.film_distance(), point - self.position);
///         let film = half + Vec2::new(between.x, -between.y) * (half / -between.z);
///         let inside = film.cmpge(Vec2::ZERO).all() && film.cmplt(Vec2::splat(2.0 * half)).all();
///         (between.z < 0.0 && inside).then(|| CameraConnection {
///             lens: self.position,
///             film,
///             pdf: self.pdf(between.normalize()),
///         })
///     }
///
///     fn is_pinhole(&self) -> bool {
///         true
///     }
/// }
///
/// let camera = Pinhole { position: Vec3::new(0.0, 0.0, 3.0), size: 64 };
/// check_camera(&camera)?;
/// let centre = camera.connect(Vec3::ZERO, [0.5; 2]).expect("in the middle of the film");
/// assert_eq!(centre.film, Vec2::splat(32.0));
/// # Ok::<(), upbp_estimators::check::ContractViolation>(())
/// ```
pub trait Camera: Send + Sync {
    /// Width and height of the film in pixels.
    fn resolution(&self) -> (u32, u32);

    /// The part of the film that is rendered; images have its size. Within the film, not empty.
    fn crop(&self) -> PixelRect {
        let (width, height) = self.resolution();
        PixelRect { x: 0, y: 0, width, height }
    }

    /// The ray through `film` (in pixels). `u_lens` is uniform in `[0, 1)²`, for the lens point.
    fn ray(&self, film: Vec2, u_lens: [f32; 2]) -> Option<CameraRay>;

    /// How the camera sees `point` through the lens point that `u_lens` stands for; `None` if it is not on the film.
    /// The inverse of [`ray`](Self::ray): the same `u_lens` gives the same lens point.
    fn connect(&self, point: Vec3, u_lens: [f32; 2]) -> Option<CameraConnection>;

    /// Whether all rays start in one point, so that the bodies around the camera are looked up only once.
    fn is_pinhole(&self) -> bool;
}
