//! The perspective camera, with a pinhole or a thin lens.
//!
//! For the image position (x, y) in `[0, 1]²`, y from the top, the chief ray has the direction
//! `forward + (2x−1) tan(fov/2) right + (1−2y) tan(fov/2) (height/width) up`. A thin lens bends all rays of a
//! pixel through the point where the chief ray meets the plane of focus.
//!
//! On a film at distance `D = width / (2 tan(fov/2))` a pixel has unit area, so that a ray at angle θ has the
//! density `(D / cos θ)² / cos θ` (`docs/theory.md`, section 1.2). With a lens the film is mapped onto the
//! plane of focus at distance f, where a pixel has the area `(f/D)²` and is `f / cos θ` away from the lens
//! point: the same formula, with the angle of the actual ray.
//!
//! A point at depth z, as far off the axis as x, is seen along the chief ray z c through the lens point o if
//! `x = o (1 − z/f) + z c`. Over the lens its image moves by `D |1 − z/f| / z` per length.

use glam::{DVec2, Vec2, Vec3};
use upbp_estimators::scene::{Camera, CameraConnection, CameraRay, LensConnection, PixelRect};

use crate::sampling;

/// Position, direction and lens of a [`PerspectiveCamera`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PerspectiveView {
    /// Pinhole, or centre of the lens, scene units.
    pub origin: Vec3,
    /// The point in the middle of the image, scene units.
    pub target: Vec3,
    /// The direction that is upright in the image.
    pub up: Vec3,
    /// Full horizontal angle of the image, radians, in `(0, π)`.
    pub horizontal_fov: f32,
    /// Radius of the lens, scene units; zero for a pinhole.
    pub lens_radius: f32,
    /// Distance from the lens to the plane of focus, scene units, positive.
    pub focus_distance: f32,
}

/// A perspective camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PerspectiveCamera {
    origin: Vec3,
    forward: Vec3,
    right: Vec3,
    up: Vec3,
    /// Half width and half height of the image at unit distance.
    half_size: Vec2,
    lens_radius: f32,
    focus_distance: f32,
    width: u32,
    height: u32,
    crop: PixelRect,
}

impl PerspectiveCamera {
    /// A camera with a film of `width` × `height` square pixels, of which `crop` is rendered. `None` if the
    /// view has no direction or is upright along it, if a number is out of its range, if the film is empty,
    /// or if the crop is empty or leaves the film.
    #[must_use]
    pub fn new(view: &PerspectiveView, width: u32, height: u32, crop: PixelRect) -> Option<Self> {
        let forward = (view.target.as_dvec3() - view.origin.as_dvec3()).try_normalize()?;
        let right = forward.cross(view.up.as_dvec3().try_normalize()?);
        // Below this the upright direction has no digits across the view.
        if right.length() < 1e-6 {
            return None;
        }
        let right = right.normalize();
        let half_width = (0.5 * f64::from(view.horizontal_fov)).tan();
        let half_size =
            Vec2::new(half_width as f32, (half_width * f64::from(height) / f64::from(width)) as f32);
        let valid = (0.0..std::f32::consts::PI).contains(&view.horizontal_fov)
            && crop.is_part_of((width, height))
            && half_size.is_finite()
            && half_size.min_element() > 0.0
            && view.lens_radius.is_finite()
            && view.lens_radius >= 0.0
            && view.focus_distance.is_finite()
            && view.focus_distance > 0.0;
        valid.then(|| Self {
            origin: view.origin,
            forward: forward.as_vec3(),
            right: right.as_vec3(),
            up: right.cross(forward).as_vec3(),
            half_size,
            lens_radius: view.lens_radius,
            focus_distance: view.focus_distance,
            width,
            height,
            crop,
        })
    }

    /// The camera, moved by a vector in scene units.
    #[must_use]
    pub fn translated(self, by: Vec3) -> Self {
        Self { origin: self.origin + by, ..self }
    }

    /// Pinhole, or centre of the lens, scene units.
    #[must_use]
    pub const fn origin(&self) -> Vec3 {
        self.origin
    }

    /// Radius of the lens, 0 for a pinhole, scene units.
    #[must_use]
    pub const fn lens_radius(&self) -> f32 {
        self.lens_radius
    }

    /// Unit vector into the middle of the image.
    #[must_use]
    pub const fn forward(&self) -> Vec3 {
        self.forward
    }

    /// The vector from the centre of the lens to the lens point of `u_lens`, scene units.
    fn lens_offset(&self, u_lens: [f32; 2]) -> Vec3 {
        if self.is_pinhole() {
            return Vec3::ZERO;
        }
        let p = sampling::disc(u_lens) * self.lens_radius;
        p.x * self.right + p.y * self.up
    }

    /// The chief ray of a film point at unit depth: its coordinates along `right` and `up`.
    fn across(&self, film: Vec2) -> Vec2 {
        // From −1 to 1, y upwards.
        (film / self.film_size() * 2.0 - Vec2::ONE) * Vec2::new(1.0, -1.0) * self.half_size
    }

    /// Distance of a film on which a pixel has unit area.
    fn film_distance(&self) -> f32 {
        self.width as f32 / (2.0 * self.half_size.x)
    }

    fn film_size(&self) -> Vec2 {
        Vec2::new(self.width as f32, self.height as f32)
    }

    /// Density of a unit direction, per steradian and pixel.
    fn pdf(&self, direction: Vec3) -> f32 {
        let cosine = direction.dot(self.forward);
        (self.film_distance() / cosine).powi(2) / cosine
    }
}

impl Camera for PerspectiveCamera {
    fn resolution(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    fn crop(&self) -> PixelRect {
        self.crop
    }

    fn ray(&self, film: Vec2, u_lens: [f32; 2]) -> Option<CameraRay> {
        let across = self.across(film);
        let chief = self.forward + across.x * self.right + across.y * self.up;
        let offset = self.lens_offset(u_lens);
        // Relative to the centre of the lens: far from the origin of the scene, absolute points lose digits.
        let through = if self.lens_radius > 0.0 { chief * self.focus_distance - offset } else { chief };
        let direction = through.try_normalize()?;
        Some(CameraRay { origin: self.origin + offset, direction, pdf: self.pdf(direction) })
    }

    fn connect(&self, point: Vec3, u_lens: [f32; 2]) -> Option<CameraConnection> {
        let offset = self.lens_offset(u_lens);
        let between = (point - self.origin) - offset;
        let depth = between.dot(self.forward);
        let direction = between.try_normalize()?;
        if depth <= 0.0 {
            return None;
        }
        // Where the ray meets the plane of focus, seen from the centre of the lens, at unit distance.
        let on_focus = between / depth + offset / self.focus_distance;
        let centred = Vec2::new(on_focus.dot(self.right), on_focus.dot(self.up)) / self.half_size;
        let film = (centred * Vec2::new(1.0, -1.0) + Vec2::ONE) * 0.5 * self.film_size();
        let inside = film.cmpge(Vec2::ZERO).all() && film.cmplt(self.film_size()).all();
        let pdf = self.pdf(direction);
        (inside && pdf.is_finite()).then(|| CameraConnection { lens: self.origin + offset, film, pdf })
    }

    fn connect_at(&self, point: Vec3, film: Vec2) -> Option<LensConnection> {
        let relative = (point - self.origin).as_dvec3();
        let [x, y, depth] = [self.right, self.up, self.forward].map(|axis| relative.dot(axis.as_dvec3()));
        // Near the plane of focus this is a difference of almost equal numbers.
        let defocus = 1.0 - depth / f64::from(self.focus_distance);
        let on_lens = (DVec2::new(x, y) - self.across(film).as_dvec2() * depth) / defocus;
        let radius = f64::from(self.lens_radius);
        // A pinhole has no other points, nor what is in focus another image.
        if !(depth > 0.0 && on_lens.length_squared() < radius * radius) {
            return None;
        }
        let offset = on_lens.x as f32 * self.right + on_lens.y as f32 * self.up;
        let direction = (relative - offset.as_dvec3()).try_normalize()?.as_vec3();
        let image_radius = radius * f64::from(self.film_distance()) * defocus / depth;
        let image_area = (std::f64::consts::PI * image_radius * image_radius) as f32;
        let pdf = self.pdf(direction);
        let is_density = image_area > 0.0 && image_area.is_finite() && pdf.is_finite();
        is_density.then(|| LensConnection { lens: self.origin + offset, pdf, image_area })
    }

    fn is_pinhole(&self) -> bool {
        self.lens_radius == 0.0
    }
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};
    use upbp_estimators::check::check_camera;
    use upbp_estimators::scene::{Camera, PixelRect};

    use super::{PerspectiveCamera, PerspectiveView};

    fn view() -> PerspectiveView {
        PerspectiveView {
            origin: Vec3::new(1.4, 1.2, 3.2),
            target: Vec3::new(0.0, 0.5, 0.0),
            up: Vec3::Y,
            horizontal_fov: 32.0_f32.to_radians(),
            lens_radius: 0.0,
            focus_distance: 1.0,
        }
    }

    fn camera(view: &PerspectiveView) -> PerspectiveCamera {
        PerspectiveCamera::new(view, 96, 64, PixelRect { x: 0, y: 0, width: 96, height: 64 }).unwrap()
    }

    #[test]
    fn axes_are_those_of_the_reference_suite() {
        // `forward`, `right` and `up` of the reference scene `forward_hg_box`.
        let camera = camera(&view());
        let expected = [
            (camera.forward, Vec3::new(-0.393_004_23, -0.196_502_12, -0.898_295_4)),
            (camera.right, Vec3::new(0.916_157_34, 0.0, -0.400_818_83)),
            (camera.up, Vec3::new(-0.078_761_75, 0.980_503_4, -0.180_026_85)),
        ];
        for (actual, expected) in expected {
            assert!(actual.distance(expected) < 1e-6, "{actual} {expected}");
        }
    }

    #[test]
    fn corners_are_where_the_conventions_say() {
        let camera = camera(&view());
        let t = 16.0_f32.to_radians().tan();
        let top_left = (camera.forward - t * camera.right + t * 64.0 / 96.0 * camera.up).normalize();
        let ray = camera.ray(Vec2::ZERO, [0.0; 2]).unwrap();
        assert!(ray.direction.distance(top_left) < 1e-6);
        assert_eq!(ray.origin, view().origin);
    }

    #[test]
    fn pinhole_and_lens_satisfy_the_contract() {
        check_camera(&camera(&view())).unwrap();
        let lens = PerspectiveView { lens_radius: 0.2, focus_distance: 3.0, ..view() };
        check_camera(&camera(&lens)).unwrap();
        let wide = PerspectiveView { horizontal_fov: 150.0_f32.to_radians(), ..view() };
        check_camera(&camera(&wide)).unwrap();
    }

    #[test]
    fn all_rays_of_a_film_point_meet_in_the_plane_of_focus() {
        let view = PerspectiveView { lens_radius: 0.3, focus_distance: 2.5, ..view() };
        let camera = camera(&view);
        let film = Vec2::new(20.3, 50.7);
        let meet = |u_lens| {
            let ray = camera.ray(film, u_lens).unwrap();
            let depth = 2.5 / ray.direction.dot(camera.forward);
            ray.origin + ray.direction * depth
        };
        for u in [[0.1, 0.9], [0.7, 0.2], [0.99, 0.01]] {
            assert!(meet(u).distance(meet([0.5, 0.5])) < 1e-5);
        }
    }

    #[test]
    fn a_pinhole_is_in_focus_everywhere() {
        let film = Vec2::new(20.3, 50.7);
        let ray = |focus_distance| camera(&PerspectiveView { focus_distance, ..view() }).ray(film, [0.5; 2]);
        let usual = ray(1.0).unwrap();
        for focus_distance in [f32::MIN_POSITIVE, 1e-21, 0.3, 1e30] {
            assert_eq!(ray(focus_distance).map(|ray| ray.direction), Some(usual.direction));
        }
    }

    #[test]
    fn what_is_behind_or_beside_is_not_seen() {
        let camera = camera(&view());
        let behind = camera.origin - camera.forward;
        assert!(camera.connect(behind, [0.5; 2]).is_none());
        let beside = camera.origin + camera.forward + camera.right;
        assert!(camera.connect(beside, [0.5; 2]).is_none());
        assert!(camera.connect(camera.origin, [0.5; 2]).is_none());
    }

    #[test]
    fn views_without_a_direction_and_crops_off_the_film_are_refused() {
        let full = PixelRect { x: 0, y: 0, width: 8, height: 8 };
        let refused = |view: PerspectiveView, width, crop| {
            assert!(PerspectiveCamera::new(&view, width, 8, crop).is_none());
        };
        refused(PerspectiveView { target: view().origin, ..view() }, 8, full);
        refused(PerspectiveView { up: view().target - view().origin, ..view() }, 8, full);
        refused(PerspectiveView { horizontal_fov: 7.0, ..view() }, 8, full);
        refused(view(), 0, full);
        refused(view(), 8, PixelRect { x: 4, ..full });
        refused(view(), 8, PixelRect { x: u32::MAX, ..full });
        refused(view(), 8, PixelRect { width: 0, ..full });
    }
}
