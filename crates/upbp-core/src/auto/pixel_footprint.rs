//! The field that kernel radii follow: the width of a pixel over the scene (`docs/theory.md`, section 5.4).

use glam::{Vec2, Vec3};
use upbp_estimators::scene::Camera;
use upbp_estimators::{FootprintField, RadiusField};

use super::photon_distances::median;

/// Rays along each side of the film that tell how wide pixels are.
const RAYS: u8 = 5;
/// Part of the visible places that lie beyond the distance at which radii stop growing: so few need no
/// kernels of their own.
pub(super) const FAR: f32 = 0.05;
/// Part of the places below the least width that radii follow. All camera sub-paths cross what is near the
/// camera, where photons are as rare as elsewhere: radii that shrink towards it find none in thin media, and
/// the few that they find are bright.
const NEAR: f32 = 0.25;
/// Radii follow widths of pixels that differ by more than this factor.
const LEAST_RANGE: f32 = 2.0;

/// The field over `places`, where camera sub-paths meet things first.
pub(super) fn field(camera: &impl Camera, places: impl Iterator<Item = Vec3>) -> RadiusField {
    let Some(PixelWidth { eye, offset, slope }) = PixelWidth::of(camera) else {
        return RadiusField::Uniform;
    };
    let mut widths: Vec<f32> = places.map(|place| offset + slope * (place - eye).length()).collect();
    widths.retain(|width| width.is_finite() && *width > 0.0);
    let Some(typical) = median(&mut widths) else { return RadiusField::Uniform };
    widths.sort_unstable_by(f32::total_cmp);
    let width = |part: f32| widths[(part * (widths.len() - 1) as f32) as usize];
    let [least, most] = [width(NEAR), width(1.0 - FAR)];
    let field = FootprintField {
        eye: eye.to_array(),
        offset: offset / typical,
        slope: slope / typical,
        least: least / typical,
        most: most.min(FootprintField::RANGE * least) / typical,
    };
    let field = RadiusField::Footprint(field);
    if most > LEAST_RANGE * least && field.is_valid(0.0) { field } else { RadiusField::Uniform }
}

/// Width of a pixel as a function of the distance to the camera, measured from rays: whatever kind of camera
/// it is.
struct PixelWidth {
    /// The middle of the places that rays start at.
    eye: Vec3,
    /// Width where rays start, scene units.
    offset: f32,
    /// Growth per distance.
    slope: f32,
}

impl PixelWidth {
    fn of(camera: &impl Camera) -> Option<Self> {
        let (width, height) = camera.resolution();
        let step = Vec2::new(width as f32, height as f32) / f32::from(RAYS);
        let ray = |i: u8, j: u8| {
            let film = (Vec2::new(f32::from(i), f32::from(j)) + 0.5) * step;
            camera.ray(film, [0.5; 2]).filter(|ray| ray.origin.is_finite() && ray.direction.is_finite())
        };
        let first = ray(RAYS / 2, RAYS / 2)?.origin;
        let (mut moved, mut rays, mut offsets, mut slopes) = (Vec3::ZERO, 0.0, Vec::new(), Vec::new());
        for (i, j) in (0..RAYS).flat_map(|i| (0..RAYS).map(move |j| (i, j))) {
            let Some(here) = ray(i, j) else { continue };
            (moved, rays) = (moved + (here.origin - first), rays + 1.0);
            for (next, pixels) in [((i + 1, j), step.x), ((i, j + 1), step.y)] {
                let inside = next.0 < RAYS && next.1 < RAYS;
                let Some(next) = inside.then(|| ray(next.0, next.1)).flatten() else { continue };
                offsets.push((next.origin - here.origin).length() / pixels);
                slopes.push((next.direction - here.direction).length() / pixels);
            }
        }
        Some(Self { eye: first + moved / rays, offset: median(&mut offsets)?, slope: median(&mut slopes)? })
    }
}

#[cfg(test)]
mod tests {
    use upbp_estimators::scene::{CameraConnection, CameraRay};

    use super::*;

    /// Rays from a plane of 2 by 1, which spread by an angle of as much.
    struct Spreading {
        parallel: f32,
        spread: f32,
    }

    impl Camera for Spreading {
        fn resolution(&self) -> (u32, u32) {
            (200, 100)
        }

        fn ray(&self, film: Vec2, _: [f32; 2]) -> Option<CameraRay> {
            let at = (film - Vec2::new(100.0, 50.0)) / 100.0;
            let at = Vec3::new(at.x, at.y, 0.0);
            let direction = (Vec3::Z + self.spread * at).normalize();
            Some(CameraRay { origin: Vec3::X + self.parallel * at, direction, pdf: 1.0 })
        }

        fn connect(&self, _: Vec3, _: [f32; 2]) -> Option<CameraConnection> {
            None
        }

        fn is_pinhole(&self) -> bool {
            self.parallel == 0.0
        }
    }

    #[test]
    fn widths_of_pixels_are_those_of_rays() {
        for (parallel, spread) in [(0.0, 0.2), (1.0, 0.0), (0.3, 0.1), (0.0, 1e-5)] {
            let found = PixelWidth::of(&Spreading { parallel, spread }).unwrap();
            assert!((found.eye - Vec3::X).length() < 1e-6, "{}", found.eye);
            assert!((found.offset - 0.01 * parallel).abs() < 1e-6 * parallel + 1e-9, "{}", found.offset);
            assert!((found.slope / (0.01 * spread).max(1e-9) - 1.0).abs() < 0.03 || spread == 0.0);
        }
    }

    #[test]
    fn radii_follow_where_pixels_differ_and_only_there() {
        let along = |from: i32, to: i32| (from..to).map(|i| Vec3::new(1.0, 0.0, 0.1 * i as f32));
        let camera = Spreading { parallel: 0.0, spread: 0.5 };
        let field = super::field(&camera, along(10, 1000));
        assert!((field.at(Vec3::new(1.0, 0.0, 50.45)) - 1.0).abs() < 0.02, "{field:?}");
        let ratio = field.at(Vec3::new(1.0, 0.0, 90.0)) / field.at(Vec3::new(1.0, 0.0, 30.0));
        assert!((ratio - 3.0).abs() < 0.03, "{field:?}");
        // No less than at the nearer quarter.
        assert!((field.least() - 0.51).abs() < 0.02, "{field:?}");
        assert_eq!(field.at(Vec3::X), field.least());
        assert_eq!(super::field(&camera, along(50, 90)), RadiusField::Uniform);
        assert_eq!(super::field(&camera, std::iter::empty()), RadiusField::Uniform);
        let orthographic = Spreading { parallel: 1.0, spread: 0.0 };
        assert_eq!(super::field(&orthographic, along(10, 1000)), RadiusField::Uniform);
    }
}
