//! Every light against the contract.

use std::f32::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

use glam::Mat3;
use upbp_accel::{AxisBox, Quad, Shape, Sphere, TriangleMesh};
use upbp_estimators::check::check_emitter;
use upbp_media::{BodyId, Homogeneous, PhaseFunction, Spectrum};

use super::*;
use crate::sampling;

const BOUNDS: BoundingSphere = BoundingSphere { centre: Vec3::new(0.5, 0.0, -1.0), radius: 4.0 };

fn receivers() -> [Vec3; 4] {
    [Vec3::new(0.3, 2.0, 0.1), Vec3::new(-1.0, 0.4, 1.5), Vec3::new(0.0, -3.0, 0.2), Vec3::new(0.1, 0.3, 0.0)]
}

fn check(light: impl Into<Light>) {
    let light = light.into();
    check_emitter(&light, &BOUNDS, &receivers()).unwrap_or_else(|violation| panic!("{light:?}\n{violation}"));
}

fn area(shape: impl Into<Shape>) -> Light {
    Light::Area(AreaLight::new(shape.into(), Spectrum::new(3.0, 2.0, 1.0)).unwrap())
}

fn tetrahedron() -> TriangleMesh {
    let corners =
        vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z].into_iter().map(|corner| corner * 0.3).collect();
    TriangleMesh::new(corners, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], None).unwrap()
}

fn spot(beam: f32, cutoff: f32) -> SpotLight {
    let axis = Vec3::new(1.0, -2.0, 0.5).normalize();
    SpotLight {
        position: Vec3::new(0.0, 1.0, 0.0),
        intensity: Spectrum::splat(2.0),
        cone: SpotCone { axis, beam, cutoff },
    }
}

fn image() -> Arc<EnvironmentImage> {
    let (width, height) = (16, 8);
    let pixels = (0..width * height).map(|i| match i {
        37 => Spectrum::new(30.0, 20.0, 10.0),
        i if i % 5 == 0 => Spectrum::ZERO,
        i => Spectrum::new(i as f32, 1.0, 0.5) * 0.02,
    });
    Arc::new(EnvironmentImage::new(width, height, pixels.collect()).unwrap())
}

fn tilt() -> Mat3 {
    Mat3::from_axis_angle(Vec3::new(2.0, -1.0, 3.0).normalize(), 1.9)
}

#[test]
fn area_lights_satisfy_the_contract() {
    check(area(Quad::new(Vec3::new(-0.5, 0.5, -0.5), Vec3::X, Vec3::Z * 1.5).unwrap()));
    check(area(Sphere::new(Vec3::new(0.2, 0.5, 0.0), 0.3).unwrap()));
    check(area(Sphere::new(Vec3::new(0.2, 0.5, 0.0), 1e-3).unwrap()));
    check(area(AxisBox::new(Vec3::new(-0.2, 0.6, -0.4), Vec3::new(0.4, 0.9, 0.1)).unwrap()));
    check(area(tetrahedron()));
}

fn volume(shape: impl Into<Shape>, sigma_a: Spectrum) -> Light {
    let medium = Homogeneous::new(sigma_a, Spectrum::splat(0.5), PhaseFunction::Isotropic).unwrap();
    let medium = medium.with_glow(Spectrum::new(3.0, 2.0, 1.0)).unwrap();
    Light::Volume(VolumeLight::new(BodyId(3), &shape.into(), Arc::new(medium), 4.0).unwrap())
}

#[test]
fn volumes_satisfy_the_contract() {
    let near = Sphere::new(Vec3::new(0.2, 0.5, 0.0), 0.3).unwrap();
    for sigma_a in [Spectrum::ZERO, Spectrum::splat(20.0), Spectrum::new(100.0, 1.0, 0.0)] {
        // The last receiver is inside.
        check(volume(near, sigma_a));
        check(volume(Sphere::new(Vec3::new(0.2, 0.5, 0.0), 1e-3).unwrap(), sigma_a));
        check(volume(AxisBox::new(Vec3::new(-0.2, 0.6, -0.4), Vec3::new(0.4, 0.9, 0.1)).unwrap(), sigma_a));
        check(volume(tetrahedron(), sigma_a));
    }
}

#[test]
fn the_density_of_next_events_to_a_sphere_integrates_to_one() {
    let sphere = Sphere::new(Vec3::new(0.2, 0.5, 0.0), 0.3).unwrap();
    for sigma_a in [0.0, 5.0, 60.0] {
        let light = volume(sphere, Spectrum::new(sigma_a, 0.5 * sigma_a, 0.0));
        for receiver in [Vec3::new(2.0, 0.0, 1.0), Vec3::new(0.2, 0.85, 0.0), Vec3::new(0.25, 0.4, 0.1)] {
            // In directions and distances from the receiver, where the density has no pole.
            let (directions, distances) = (100, 300);
            let (nearest, farthest) = (0.0, sphere.centre().distance(receiver) + 0.3);
            let step = (farthest - nearest) / distances as f32;
            let axis = (sphere.centre() - receiver).normalize();
            let sine = 0.3 / sphere.centre().distance(receiver);
            let height = if sine > 1.0 { 2.0 } else { 1.0 - (1.0 - sine * sine).sqrt() };
            let mut sum = 0.0;
            for i in 0..directions * directions {
                let at = |i: i32| ((i % directions) as f32 + 0.5) / directions as f32;
                let u = [at(i), at(i / directions)].map(f64::from);
                let direction = sampling::fine::cone(axis.as_dvec3(), f64::from(height), u).as_vec3();
                for k in 0..distances {
                    let distance = nearest + (k as f32 + 0.5) * step;
                    let position = receiver + distance * direction;
                    if !sphere.contains(position) {
                        continue;
                    }
                    let point = EmitterPoint { position, normal: -direction };
                    let seen = light.hit(&BOUNDS, &point, -direction, receiver).unwrap();
                    sum += f64::from(seen.pdf_incident * distance * distance * step);
                }
            }
            sum *= f64::from(TAU * height) / f64::from(directions * directions);
            assert!((sum - 1.0).abs() < 0.02, "{sigma_a}, {receiver}: {sum}");
        }
    }
}

#[test]
fn a_volume_that_positions_cannot_tell_apart_is_never_chosen() {
    let light = |x: f32, radius: f32, sigma_a: f32| {
        let medium = Homogeneous::new(Spectrum::splat(sigma_a), Spectrum::ZERO, PhaseFunction::Isotropic);
        let medium = medium.unwrap().with_glow(Spectrum::ONE).unwrap();
        let sphere = Sphere::new(x * Vec3::X, radius).unwrap();
        VolumeLight::new(BodyId(0), &sphere.into(), Arc::new(medium), 4.0).unwrap().power(&BOUNDS)
    };
    assert!(light(0.0, 0.5, 0.0) > 0.0 && light(0.0, 0.5, 1e3) > 0.0);
    assert_eq!(light(0.0, 0.5, 1e5), 0.0, "too dense");
    assert!(light(0.1, 1e-5, 1.0) > 0.0);
    assert_eq!(light(4.0, 1e-5, 1.0), 0.0, "too small for its place");
    assert_eq!(light(0.0, 1e-6, 1.0), 0.0, "too small for the scene");
    assert_eq!(light(0.0, 1e15, 0.0), 0.0, "too large");
}

#[test]
fn next_events_to_a_sphere_far_away_lose_nothing() {
    let sphere = Sphere::new(Vec3::new(0.2, 0.5, 0.0), 1.0).unwrap();
    let light = area(sphere);
    let steps = 300;
    for distance in [10.0, 1e3, 1e5, 1e6, 3e6, 1e7] {
        let receiver = sphere.centre() + distance * Vec3::new(0.48, 0.6, 0.64);
        let mut sum = 0.0;
        for i in 0..steps * steps {
            let u = [i % steps, i / steps].map(|i| (i as f32 + 0.5) / steps as f32);
            // Radiance over the density per solid angle: the solid angle times the radiance.
            let Some(found) = light.sample_incident(&BOUNDS, receiver, u) else { continue };
            let cosine = found.point.normal.dot(-found.towards_light);
            let pdf = found.pdf * found.distance * found.distance / cosine;
            sum += f64::from(found.radiance.mean() / pdf);
        }
        let sine = 1.0 / f64::from(sphere.centre().distance(receiver));
        let solid_angle = f64::from(TAU) * sine * sine / (1.0 + (1.0 - sine * sine).sqrt());
        let found = sum / f64::from(steps * steps) / (2.0 * solid_angle);
        assert!((found - 1.0).abs() < 1e-3, "{distance}: {found}");
    }
}

#[test]
fn points_and_spots_satisfy_the_contract() {
    check(Light::Point(PointLight { position: Vec3::new(0.1, 0.9, 0.2), intensity: Spectrum::splat(5.0) }));
    for (beam, cutoff) in [(0.2, 0.5), (0.3, 0.3), (0.0, 1.0), (0.5, FRAC_PI_2), (1.0, PI), (PI, PI)] {
        check(Light::Spot(spot(beam, cutoff)));
    }
    // Nothing starts beside the cone.
    let (light, aside) = (spot(0.2, 0.5), Vec3::new(0.0, 0.5, 2.0).normalize());
    let point = EmitterPoint { position: light.position, normal: aside };
    assert!(light.emission_coordinates(&BOUNDS, &point, aside, aside).is_none());
}

#[test]
fn infinite_lights_satisfy_the_contract() {
    let direction = Vec3::new(0.2, -1.0, 0.3).normalize();
    check(Light::Directional(DirectionalLight { direction, irradiance: Spectrum::splat(2.0) }));
    for diameter in [1.7e-4, 0.01, 0.3, 1.5, PI] {
        check(Light::Sun(SunLight::new(direction, Spectrum::new(2.0, 1.0, 0.5), diameter)));
    }
    check(Light::Constant(ConstantEnvironment { radiance: Spectrum::new(1.0, 0.5, 0.2) }));
    check(Light::Image(ImageEnvironment::new(image(), 1.0, 0.0)));
    check(Light::Image(ImageEnvironment::new(image(), 0.3, 2.1)));
    check(Light::Image(ImageEnvironment::new(image(), 0.3, 2.1).turned(tilt())));
}

#[test]
fn the_sun_lights_a_plane_by_its_irradiance() {
    let direction = Vec3::new(0.2, -1.0, 0.3).normalize();
    for diameter in [1.7e-4, 0.01, 0.3, 1.5, PI] {
        let light = SunLight::new(direction, Spectrum::splat(2.0), diameter);
        let steps = 300;
        let mut sum = 0.0;
        for i in 0..steps * steps {
            let u = [i % steps, i / steps].map(|i| (i as f32 + 0.5) / steps as f32);
            let Some(found) = light.sample_incident(&BOUNDS, Vec3::ZERO, u) else { continue };
            sum -= f64::from(found.radiance.mean() / found.pdf * found.towards_light.dot(direction));
            // It is seen where it shines from, and nowhere else.
            assert!(light.hit(&BOUNDS, &found.point, -found.towards_light, Vec3::ZERO).is_some());
        }
        let irradiance = sum / f64::from(steps * steps);
        assert!((irradiance / 2.0 - 1.0).abs() < 1e-4, "{diameter}: {irradiance}");
        let rim = 0.5 * diameter;
        let (tangent, _) = upbp_media::orthonormal_basis(direction);
        for (angle, is_seen) in [(0.0, true), (0.99 * rim, true), (1.01 * rim, false), (PI, false)] {
            let along = (angle.cos() * direction + angle.sin() * tangent).normalize();
            let point = EmitterPoint { position: Vec3::ZERO, normal: along };
            assert_eq!(
                light.hit(&BOUNDS, &point, along, Vec3::ZERO).is_some(),
                is_seen,
                "{diameter} {angle}"
            );
            assert_eq!(light.emission_coordinates(&BOUNDS, &point, along, BOUNDS.centre).is_some(), is_seen);
        }
    }
}

#[test]
fn the_flux_of_a_spot_is_the_integral_of_its_falloff() {
    for (beam, cutoff) in
        [(0.0_f32, 1.0_f32), (0.2, 0.5), (0.4, 0.4), (0.4, 0.4001), (1e-3, 2e-3), (1.0, 3.0), (PI, PI)]
    {
        let cone = spot(beam, cutoff).cone;
        let steps = 20_000;
        let (tangent, _) = upbp_media::orthonormal_basis(cone.axis);
        let integral: f64 = (0..steps)
            .map(|i| (f64::from(i) + 0.5) / f64::from(steps) * f64::from(cutoff))
            .map(|angle| {
                let (sin, cos) = angle.sin_cos();
                let direction = (cone.axis.as_dvec3() * cos + tangent.as_dvec3() * sin).as_vec3();
                f64::from(cone.falloff(direction)) * sin * f64::from(cutoff) / f64::from(steps)
            })
            .sum::<f64>()
            * f64::from(TAU);
        let relative = f64::from(cone.solid_angle()) / integral - 1.0;
        assert!(relative.abs() < 2e-3, "{beam} {cutoff}: {} {integral}", cone.solid_angle());
    }
    assert!((spot(PI, PI).cone.solid_angle() - 2.0 * TAU).abs() < 1e-5);
}

/// The mean of what light sub-paths carry, over a sequence that fills the four random numbers of a start
/// evenly (Roberts 2018).
#[test]
fn power_is_what_emission_carries() {
    let (sphere, cuboid) = (Sphere::new(Vec3::Y, 0.3).unwrap(), AxisBox::new(Vec3::ZERO, Vec3::ONE).unwrap());
    let infinite = [
        Light::Directional(DirectionalLight { direction: Vec3::NEG_Y, irradiance: Spectrum::splat(2.0) }),
        Light::Sun(SunLight::new(Vec3::NEG_Y, Spectrum::splat(2.0), 0.01)),
        Light::Sun(SunLight::new(Vec3::NEG_Y, Spectrum::splat(2.0), 2.0)),
        Light::Constant(ConstantEnvironment { radiance: Spectrum::new(1.0, 0.5, 0.2) }),
        Light::Image(ImageEnvironment::new(image(), 3.0, 0.4)),
        Light::Image(ImageEnvironment::new(image(), 3.0, 0.4).turned(tilt())),
    ];
    let finite = [
        area(Quad::new(Vec3::ZERO, Vec3::X, Vec3::Z * 1.5).unwrap()),
        area(sphere),
        area(tetrahedron()),
        volume(sphere, Spectrum::splat(20.0)),
        volume(cuboid, Spectrum::ZERO),
        Light::Point(PointLight { position: Vec3::Y, intensity: Spectrum::splat(5.0) }),
    ];
    let spots = [(0.2, 0.5), (0.0, 1.0), (1.0, PI)].map(|(beam, cutoff)| Light::Spot(spot(beam, cutoff)));
    for light in infinite.into_iter().chain(finite).chain(spots) {
        let count = 10_000;
        let carried = (0..count).map(|i| {
            let [a, b, c, d] = [0.856_674_883, 0.733_891_857, 0.628_706_721, 0.538_597_257]
                .map(|step| ((step * f64::from(i)).fract() as f32).min(1.0 - f32::EPSILON));
            light.sample_emission(&BOUNDS, [a, b], [c, d]).map_or(0.0, |emission| {
                let cos = match light.kind() {
                    EmitterKind::Area => emission.direction.dot(emission.point.normal),
                    _ => 1.0,
                };
                f64::from(emission.radiance.mean() * cos / (emission.pdf_position * emission.pdf_direction))
            })
        });
        let (mean, power) = (carried.sum::<f64>() / f64::from(count), f64::from(light.power(&BOUNDS)));
        assert!((mean / power - 1.0).abs() < 0.01, "{light:?}: {mean}, told {power}");
    }
}

#[test]
fn the_density_of_an_image_integrates_to_one() {
    let light = ImageEnvironment::new(image(), 1.0, 0.4);
    let (rows, columns) = (800, 1600);
    let mut integral = 0.0;
    for row in 0..rows {
        let theta = (f64::from(row) + 0.5) / f64::from(rows) * std::f64::consts::PI;
        for column in 0..columns {
            let phi = (f64::from(column) + 0.5) / f64::from(columns) * std::f64::consts::TAU;
            let direction = glam::DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            integral += f64::from(light.radiance_and_pdf(direction.as_vec3()).1) * theta.sin();
        }
    }
    integral *= std::f64::consts::PI / f64::from(rows) * std::f64::consts::TAU / f64::from(columns);
    assert!((integral - 1.0).abs() < 1e-3, "{integral}");
}

#[test]
fn an_image_is_oriented_as_documented() {
    let (width, height) = (8, 4);
    let lit = |x: usize, y: usize, rotation: f32| {
        let mut pixels = vec![Spectrum::ZERO; width * height];
        pixels[y * width + x] = Spectrum::ONE;
        ImageEnvironment::new(Arc::new(EnvironmentImage::new(width, height, pixels).unwrap()), 1.0, rotation)
    };
    // Just right of the middle and above the horizon; a quarter turn counter-clockwise moves −z to −x.
    let ahead = Vec3::new(0.1, 0.1, -1.0).normalize();
    assert!(lit(4, 1, 0.0).radiance_and_pdf(ahead).1 > 0.0);
    assert!(lit(6, 1, 0.0).radiance_and_pdf(Vec3::new(1.0, 0.1, 0.1).normalize()).1 > 0.0);
    let left = Vec3::new(-1.0, 0.1, -0.1).normalize();
    assert!(lit(4, 1, FRAC_PI_2).radiance_and_pdf(left).1 > 0.0);
    // Then a quarter turn about x, which moves −z to +y and leaves −x, and one about z, which moves −x to −y.
    let about_x = Mat3::from_rotation_x(FRAC_PI_2);
    let up = Vec3::new(0.1, 1.0, 0.1).normalize();
    assert!(lit(4, 1, 0.0).turned(about_x).radiance_and_pdf(up).1 > 0.0);
    let turned = lit(4, 1, FRAC_PI_2).turned(about_x).turned(Mat3::from_rotation_z(FRAC_PI_2));
    let [down, beside] = [-0.1, 0.1].map(|x| turned.radiance_and_pdf(Vec3::new(x, -1.0, 0.1).normalize()).1);
    assert!(down > 0.0 && beside == 0.0);
    // All draws land in the only lit pixel.
    let light = lit(4, 1, 0.7);
    let draws = (0..1000_u16).map(|i| [f32::from(i) / 1000.0, f32::from(i * 37 % 1000) / 1000.0]);
    let found = draws.filter(|&u| light.sample_incident(&BOUNDS, Vec3::ZERO, u).is_some()).count();
    // At the pixel's edge rounding may put one into the next.
    assert!(found >= 999, "{found}");
}

#[test]
fn images_that_are_no_light_are_refused() {
    let message =
        |width, height, pixels| EnvironmentImage::new(width, height, pixels).unwrap_err().to_string();
    let white = Spectrum::ONE;
    assert!(message(0, 0, vec![]).starts_with("has 0 pixels"));
    assert!(message(2, 2, vec![white; 3]).starts_with("has 3 pixels"));
    assert!(message(usize::MAX, 2, vec![]).ends_with("x 2 pixels, expected at most 134217728 in all"));
    // As it is read from a file, whose pixels are not kept then.
    assert!(message(32768, 16384, vec![]).starts_with("has 32768 x 16384 pixels, expected at most"));
    assert_eq!(message(2, 1, vec![Spectrum::ZERO; 2]), "is black everywhere");
    let negative = Spectrum::new(0.0, -1.0, 0.0);
    assert!(message(2, 1, vec![white, negative]).starts_with("pixel (1, 0) is [0.0, -1.0, 0.0]"));
    assert!(
        message(2, 1, vec![Spectrum::splat(f32::NAN), white]).starts_with("pixel (0, 0) is [NaN, NaN, NaN]")
    );
    let infinite = Spectrum::new(0.0, 0.0, f32::INFINITY);
    assert!(message(1, 2, vec![white, infinite]).starts_with("pixel (0, 1) is [0.0, 0.0, inf]"));
}

#[test]
fn images_of_another_shape_are_others() {
    let of = |width, height| EnvironmentImage::new(width, height, vec![Spectrum::ONE; 8]).unwrap();
    assert_eq!(of(4, 2).fingerprint(), of(4, 2).fingerprint());
    assert_ne!(of(4, 2).fingerprint(), of(2, 4).fingerprint());
}

#[test]
fn images_are_read_from_openexr() {
    let path = std::env::temp_dir().join(format!("upbp-scene-environment-{}.exr", std::process::id()));
    exr::prelude::write_rgb_file(&path, 4, 2, |x, y| (x as f32, y as f32, 0.5_f32)).unwrap();
    let image = EnvironmentImage::load(&path);
    std::fs::remove_file(&path).unwrap();
    let image = image.unwrap();
    assert_eq!(image.size(), (4, 2));
    assert_eq!(image.lookup(Vec3::new(-0.1, 0.1, -1.0).normalize()).0, Spectrum::new(1.0, 0.0, 0.5));
    assert_eq!(image.lookup(Vec3::new(0.1, -0.1, -1.0).normalize()).0, Spectrum::new(2.0, 1.0, 0.5));
}

#[test]
fn what_is_below_zero_in_an_image_is_no_light() {
    let path = std::env::temp_dir().join(format!("upbp-scene-below-zero-{}.exr", std::process::id()));
    let load = |below: f32| {
        exr::prelude::write_rgb_file(&path, 2, 1, |_, _| (below, 1.0_f32, 0.5_f32)).unwrap();
        let image = EnvironmentImage::load(&path);
        std::fs::remove_file(&path).unwrap();
        image.map(|image| image.lookup(Vec3::NEG_Z).0).map_err(|error| error.to_string())
    };
    assert_eq!(load(-0.25), Ok(Spectrum::new(0.0, 1.0, 0.5)));
    // In all pixels there is no finite value to take.
    for bad in [f32::NEG_INFINITY, f32::NAN, f32::INFINITY] {
        assert!(load(bad).unwrap_err().contains("expected finite values of at least zero"), "{bad}");
    }
}

#[test]
fn infinite_pixels_of_an_image_count_as_its_largest_value() {
    let path = std::env::temp_dir().join(format!("upbp-scene-infinite-{}.exr", std::process::id()));
    let load = |last: f32| {
        let red = move |x: usize| if x == 1 { last } else { x as f32 };
        exr::prelude::write_rgb_file(&path, 4, 1, |x, _| (red(x), 0.5_f32, last)).unwrap();
        let image = EnvironmentImage::load(&path);
        std::fs::remove_file(&path).unwrap();
        image
    };
    assert!(load(f32::INFINITY).is_err(), "no finite blue");
    assert_eq!(load(7.0).unwrap().infinite_pixels(), 0);
    exr::prelude::write_rgb_file(&path, 4, 1, |x, _| {
        let sun = if x == 1 { f32::INFINITY } else { x as f32 };
        (sun, 0.5_f32, sun)
    })
    .unwrap();
    let image = EnvironmentImage::load(&path);
    std::fs::remove_file(&path).unwrap();
    let image = image.unwrap();
    assert_eq!(image.infinite_pixels(), 1);
    // The second of four pixels ends where the middle is.
    let sun = image.lookup(Vec3::new(-0.1, 0.0, -1.0).normalize()).0;
    assert_eq!(sun, Spectrum::new(3.0, 0.5, 3.0));
}

#[test]
fn the_sides_of_a_cube_are_no_sky() {
    use exr::meta::attribute::EnvironmentMap;
    use exr::prelude::*;
    let path = std::env::temp_dir().join(format!("upbp-scene-cube-{}.exr", std::process::id()));
    let message = |kind: EnvironmentMap| {
        let channels = SpecificChannels::rgb(|_| (1.0_f32, 1.0_f32, 1.0_f32));
        let attributes = LayerAttributes { environment_map: Some(kind), ..LayerAttributes::default() };
        let layer = Layer::new((2, 12), attributes, Encoding::FAST_LOSSLESS, channels);
        exr::image::Image::from_layer(layer).write().to_file(&path).unwrap();
        let image = EnvironmentImage::load(&path);
        std::fs::remove_file(&path).unwrap();
        image.err().map(|error| error.to_string())
    };
    let expected = "shows the six sides of a cube, expected a latitude-longitude image: convert it";
    assert_eq!(message(EnvironmentMap::Cube).as_deref(), Some(expected));
    assert_eq!(message(EnvironmentMap::LatitudeLongitude), None);
}

#[test]
fn a_part_of_a_picture_is_no_sky() {
    use exr::prelude::*;
    let path = std::env::temp_dir().join(format!("upbp-scene-part-{}.exr", std::process::id()));
    let message = |position: (i32, i32), whole: (usize, usize)| {
        let channels = SpecificChannels::rgb(|_| (1.0_f32, 1.0_f32, 1.0_f32));
        let attributes = LayerAttributes::default().with_position(position.into());
        let layer = Layer::new((4, 1), attributes, Encoding::FAST_LOSSLESS, channels);
        let mut image = exr::image::Image::from_layer(layer);
        image.attributes.display_window = IntegerBounds::from_dimensions(whole);
        image.write().to_file(&path).unwrap();
        let image = EnvironmentImage::load(&path);
        std::fs::remove_file(&path).unwrap();
        image.err().map(|error| error.to_string())
    };
    assert_eq!(message((0, 0), (4, 1)), None);
    let part = Some("has 4 x 1 pixels of a picture of 4 x 2, expected all of them".to_owned());
    assert_eq!(message((0, 0), (4, 2)), part);
    assert!(message((0, 1), (4, 1)).is_some(), "another place");
}

#[test]
fn a_receiver_inside_or_on_a_sphere_finds_its_density() {
    let sphere = Sphere::new(Vec3::ZERO, 1.0).unwrap();
    let light = area(sphere);
    // Very near the surface points are chosen on all of it, few of them on the side that is seen; from inside
    // no front is.
    let receivers = [(1.0, 0..=100), (1.0001, 0..=100), (1.01, 95..=100), (0.5, 0..=0), (1e4, 95..=100)];
    for (x, expected) in receivers {
        let draws = (0..100_u16).map(|i| [f32::from(i) / 100.0, f32::from(i * 7 % 100) / 100.0]);
        let found: Vec<_> = draws.filter_map(|u| light.sample_incident(&BOUNDS, Vec3::X * x, u)).collect();
        assert!(expected.contains(&found.len()), "{x}: {}", found.len());
        assert!(found.iter().all(|incident| incident.pdf.is_finite() && incident.pdf > 0.0), "{x}");
    }
}

#[test]
fn parallel_light_has_as_many_rays_as_random_numbers_have_digits() {
    // Ten thousand units wide; on a thing of a hundredth of a unit only the last digits differ.
    let bounds = BoundingSphere { centre: Vec3::ZERO, radius: 1e4 };
    let cell = f64::from(bounds.radius) * 2.0 / 16_777_216.0;
    for direction in [Vec3::NEG_Y, Vec3::new(1.0, -2.0, 0.5).normalize()] {
        let light = DirectionalLight { direction, irradiance: Spectrum::splat(1.0) };
        let place = |u: [f32; 2], digits: [f32; 2]| {
            let emission = light.sample_emission(&bounds, u, digits).unwrap();
            let start = emission.point.position.as_dvec3();
            let direction = direction.as_dvec3();
            start - start.dot(direction) * direction
        };
        let u = [0.5 + 37.0 / 16_777_216.0, 0.5 - 5.0 / 16_777_216.0];
        let mut places: Vec<_> =
            (0..1024).map(|i| i as f32 / 1024.0).map(|d| place(u, [d, 1.0 - d])).collect();
        // Roundings of the start are as large as a cell, unless coordinates are small.
        let most = if direction == Vec3::NEG_Y { 2.0 * cell } else { 6.0 * cell };
        assert!(places.iter().all(|other| other.distance(places[0]) < most));
        places.sort_by(|a, b| a.x.total_cmp(&b.x));
        places.dedup();
        assert!(places.len() > 500, "{} of 1024", places.len());
    }
}
