//! The camera and its film.

use upbp_estimators::scene::PixelRect;

use super::builder::Builder;
use crate::camera::{PerspectiveCamera, PerspectiveView};
use crate::description::Camera;

/// The least width of a pixel in the middle of the image, radians: directions in single precision are up to
/// an eighth of it apart.
const LEAST_PIXEL: f64 = 4.0 * f32::EPSILON as f64;

impl Builder<'_> {
    pub(super) fn camera(&mut self) -> Option<PerspectiveCamera> {
        let film = &self.description.film;
        let (width, height) = (film.width.get(), film.height.get());
        let whole = PixelRect::whole((width, height));
        let crop = film.crop.map_or(whole, |crop| PixelRect {
            x: crop.x,
            y: crop.y,
            width: crop.width.get(),
            height: crop.height.get(),
        });
        let ends = (u64::from(crop.x) + u64::from(crop.width), u64::from(crop.y) + u64::from(crop.height));
        if ends.0 > u64::from(width) || ends.1 > u64::from(height) {
            let message = format!(
                "the crop ends at ({}, {}), outside of the {width} x {height} pixels",
                ends.0, ends.1
            );
            self.problem("film", message);
        }
        let Camera::Perspective { origin, target, up, fov_degrees, lens_radius, focus_distance } =
            &self.description.camera;
        let view = PerspectiveView {
            origin: origin.get(),
            target: target.get(),
            up: up.get(),
            horizontal_fov: fov_degrees.get().to_radians(),
            lens_radius: lens_radius.get(),
            focus_distance: focus_distance
                .map_or_else(|| origin.get().distance(target.get()), crate::description::Positive::get),
        };
        let pixel = 2.0 * (0.5 * f64::from(fov_degrees.get()).to_radians()).tan() / f64::from(width);
        if pixel < LEAST_PIXEL {
            let message = format!(
                "`fov_degrees` over the width of the film makes pixels {pixel:.1e} radians wide, expected at least {LEAST_PIXEL:.1e}: narrower ones are lost in single precision"
            );
            self.problem("camera", message);
        }
        if view.origin == view.target {
            self.problem("camera", "`origin` and `target` are the same point");
        } else if PerspectiveCamera::new(&view, width, height, whole).is_none() {
            let has_direction = view.origin.distance(view.target).is_normal();
            let message = if has_direction {
                "`up` is zero or along the direction of view"
            } else {
                "`origin` and `target` are too near to each other, or too far"
            };
            self.problem("camera", message);
        }
        PerspectiveCamera::new(&view, width, height, crop)
    }
}
