//! Everything that is sampled, with the random numbers at the ends of their range: 0 and the largest below 1.
//!
//! All answers are finite, have a positive density, and lie where the contract says. Materials:
//! `upbp-scene/src/material/tests.rs`.

use glam::{Vec2, Vec3};
use upbp_core::media::{Homogeneous, Medium, PhaseFunction, RaySegment, Spectrum};
use upbp_core::scene::{Camera, Emitter, EmitterKind, PixelRect, Scene};
use upbp_scene::{PerspectiveCamera, PerspectiveView, ReadyScene};

const NUMBERS: [f32; 5] = [0.0, 1.0 / 16_777_216.0, 0.25, 0.5, 1.0 - f32::EPSILON / 2.0];

fn pairs() -> impl Iterator<Item = [f32; 2]> {
    NUMBERS.into_iter().flat_map(|a| NUMBERS.map(|b| [a, b]))
}

fn directions() -> impl Iterator<Item = Vec3> {
    let steps = [-1.0_f32, -1e-4, 0.0, 0.3, 1.0];
    let all = steps.into_iter().flat_map(move |x| steps.into_iter().map(move |y| (x, y)));
    all.flat_map(move |(x, y)| steps.map(|z| Vec3::new(x, y, z))).filter_map(Vec3::try_normalize)
}

#[test]
fn phase_functions() {
    let hg = |g| PhaseFunction::henyey_greenstein(g).unwrap();
    let mut functions = vec![PhaseFunction::Isotropic, PhaseFunction::Rayleigh];
    for g in [1e-30, 1e-6, 0.5, 0.9, 0.99999, 1.0 - f32::EPSILON / 2.0] {
        functions.extend([hg(g), hg(-g)]);
    }
    functions
        .push(PhaseFunction::blend(vec![(1e-12, hg(0.99999)), (1.0, hg(-0.9)), (1e-3, hg(0.5))]).unwrap());
    for phase in &functions {
        for before in directions() {
            for u in pairs() {
                let sample = phase.sample::<f64>(before, (), &(), u);
                assert!(sample.after.is_normalized(), "{phase:?} {before} {u:?}: {sample:?}");
                assert!(sample.pdf.is_finite() && sample.pdf > 0.0, "{phase:?} {before} {u:?}: {sample:?}");
                let pdf = sample.pdf as f32;
                assert_eq!(pdf, phase.eval(before, sample.after).pdf);
                assert_eq!(pdf, phase.eval(sample.after, before).pdf, "{phase:?}: not reciprocal");
            }
        }
    }
}

#[test]
fn distances() {
    let sigmas = [0.0_f32, 1e-30, 1e-12, 1e-6, 1.0, 1e6, 1e12];
    let mut media = Vec::new();
    for a in sigmas {
        for b in sigmas {
            for (absorbs, scatters) in [([0.0; 3], [a, b, b]), ([a; 3], [b; 3]), ([a, b, 0.0], [b, 0.0, a])] {
                let phase = PhaseFunction::Isotropic;
                media.push(Homogeneous::new(absorbs.into(), scatters.into(), phase).unwrap());
            }
        }
    }
    let ranges = [0.0_f32, 1e-30, 1e-6, 1.0, 1e6, 1e30].into_iter().flat_map(|start| {
        [start.next_up(), start + 1e-7, start + 1.0, start + 1e12, f32::INFINITY].map(|end| (start, end))
    });
    for (start, end) in ranges.filter(|(start, end)| start < end) {
        let segment = RaySegment { origin: Vec3::ZERO, direction: Vec3::X, start, end };
        for medium in &media {
            let passed = medium.segment(&segment);
            assert!((0.0..=1.0).contains(&passed.pass_probability), "{medium:?} {segment:?}: {passed:?}");
            assert!(passed.transmittance.is_finite(), "{medium:?} {segment:?}: {passed:?}");
            for u in pairs() {
                let Some(t) = medium.sample_distance(&segment, u[0], u[1]) else { continue };
                assert!((start..end).contains(&t), "{medium:?} {segment:?} {u:?}: {t}");
                let density = medium.segment(&RaySegment { end: t, ..segment });
                let fine = density.stop_at_end > 0.0 && density.stop_at_end.is_finite();
                assert!(fine, "{medium:?} {segment:?} {u:?}: {density:?}");
                // The throughput of a collision: no channel has less than 0.05 of 1.1 of the samples.
                for c in 0..3 {
                    let weight = f64::from(medium.sigma_t(Vec3::ZERO)[c] * density.transmittance[c])
                        / density.stop_at_end;
                    assert!(weight <= 22.1, "{medium:?} {segment:?} {u:?}: {weight}");
                }
            }
        }
    }
}

fn lights(scale: f32) -> ReadyScene {
    let [s, area] = [scale, scale * scale];
    let text = format!(
        "(version: 1, camera: Perspective(origin: (0.0, 0.0, {s:?}), target: (0.0, 0.0, 0.0), fov_degrees: 40),
        film: (width: 4, height: 4), materials: {{\"black\": Lambert(0)}},
        shapes: [
            (geometry: Sphere(centre: (0.0, {s:?}, 0.0), radius: {s:?}), material: \"black\", emission: 1),
            (geometry: Sphere(centre: (0.0, {:?}, 0.0), radius: {:?}), material: \"black\", emission: 1),
            (geometry: Quad(origin: (0.0, 0.0, 0.0), edge_u: ({s:?}, 0.0, 0.0), edge_v: (0.0, {:?}, 0.0)), material: \"black\",
                emission: (1e12, 0, 1e-12)),
            (geometry: Box(min: (0.0, 0.0, -{s:?}), max: ({s:?}, {s:?}, 0.0)), material: \"black\", emission: 1),
            (geometry: Mesh(positions: [(0.0, 0.0, 0.0), ({s:?}, 0.0, 0.0), (0.0, {s:?}, 0.0)], indices: [(0, 1, 2)]),
                material: \"black\", emission: 1),
        ],
        lights: [
            Point(position: (0.0, {:?}, 0.0), intensity: {area:?}),
            Spot(position: (0.0, {:?}, 0.0), direction: (0, -1, 0), intensity: {area:?}, cutoff_degrees: 0.01),
            Spot(position: (0.0, {:?}, 0.0), direction: (1, 1, 1), intensity: {area:?}, cutoff_degrees: 180),
            Spot(position: (0.0, {:?}, 0.0), direction: (0, -1, 0), intensity: {area:?}, beam_degrees: 10, cutoff_degrees: 20),
            Directional(direction: (0, -1, 0), irradiance: 1),
            Constant(1),
        ])",
        3.0 * s,
        1e-3 * s,
        1e-3 * s,
        4.0 * s,
        4.0 * s,
        4.0 * s,
        4.0 * s,
    );
    match ReadyScene::from_ron_str(&text, "") {
        Ok(scene) => scene,
        Err(error) => panic!("{error}\n{text}"),
    }
}

#[test]
fn emitters() {
    for scale in [1e-6_f32, 1.0, 1e6] {
        let scene = lights(scale);
        let bounds = scene.bounds();
        // Far, near, on the lights, and in their middle.
        let receivers = [
            Vec3::ZERO,
            Vec3::new(0.0, scale, 0.0),
            Vec3::new(0.0, 2.0 * scale, 0.0),
            Vec3::new(0.0, 2.0 * scale, 1e-6 * scale),
            Vec3::new(0.0, 3.0 * scale, 0.0),
            Vec3::new(0.0, 4.0 * scale, 0.0),
            Vec3::splat(0.25 * scale),
            Vec3::splat(3.0 * scale),
            Vec3::splat(1e4 * scale),
        ];
        for light in scene.emitters() {
            for (u, v) in pairs().flat_map(|u| pairs().map(move |v| (u, v))) {
                if let Some(emission) = light.sample_emission(&bounds, u, v) {
                    let fine = emission.direction.is_normalized()
                        && emission.point.position.is_finite()
                        && emission.radiance.is_finite()
                        && emission.radiance.is_non_negative()
                        && [emission.pdf_position, emission.pdf_direction]
                            .iter()
                            .all(|p| p.is_finite() && *p > 0.0);
                    assert!(fine, "scale {scale}, {light:?}, {u:?} {v:?}: {emission:?}");
                }
            }
            for (receiver, u) in receivers.into_iter().flat_map(|r| pairs().map(move |u| (r, u))) {
                if let Some(incident) = light.sample_incident(&bounds, receiver, u) {
                    let fine = incident.towards_light.is_normalized()
                        && incident.distance > 0.0
                        && (incident.distance.is_finite() || light.kind() != EmitterKind::Area)
                        && incident.radiance.is_finite()
                        && incident.radiance.is_non_negative()
                        && incident.pdf.is_finite()
                        && incident.pdf > 0.0
                        && incident.pdf_position.is_finite()
                        && incident.pdf_direction.is_finite();
                    assert!(fine, "scale {scale}, {light:?}, {receiver} {u:?}: {incident:?}");
                }
            }
        }
    }
}

#[test]
fn cameras() {
    for (scale, degrees, lens) in [1e-6_f32, 1.0, 1e6].into_iter().flat_map(|scale| {
        [0.001_f32, 40.0, 179.0]
            .into_iter()
            .flat_map(move |fov| [0.0_f32, 0.1].map(|lens| (scale, fov, lens)))
    }) {
        let view = PerspectiveView {
            origin: Vec3::new(scale, 0.0, scale),
            target: Vec3::ZERO,
            up: Vec3::Y,
            horizontal_fov: degrees.to_radians(),
            lens_radius: lens * scale,
            focus_distance: scale,
        };
        let rect = PixelRect { x: 0, y: 0, width: 64, height: 48 };
        let camera = PerspectiveCamera::new(&view, 64, 48, rect).expect("a camera");
        for (film, u) in pairs().flat_map(|film| pairs().map(move |u| (film, u))) {
            let film = Vec2::from(film) * Vec2::new(64.0, 48.0);
            let Some(ray) = camera.ray(film, u) else { panic!("{view:?} {film} {u:?}: no ray") };
            let fine = ray.direction.is_normalized()
                && ray.origin.is_finite()
                && ray.pdf.is_finite()
                && ray.pdf > 0.0;
            assert!(fine, "{view:?} {film} {u:?}: {ray:?}");
            // What is seen is connected to the film, if at all, with the same density.
            if let Some(back) = camera.connect(ray.origin + ray.direction * scale, u) {
                assert!((back.pdf / ray.pdf - 1.0).abs() < 1e-2, "{view:?} {film} {u:?}: {ray:?} {back:?}");
            }
            for point in [camera.origin(), ray.origin, Vec3::ZERO, Vec3::splat(f32::MAX), Vec3::NAN] {
                if let Some(back) = camera.connect(point, u) {
                    assert!(back.pdf.is_finite() && back.film.is_finite(), "{view:?} {point}: {back:?}");
                }
            }
        }
    }
}

#[test]
fn spectra_of_extremes_are_refused_or_kept() {
    for bad in [f32::NAN, f32::INFINITY, -1.0, f32::NEG_INFINITY] {
        let spectrum = Spectrum::new(1.0, bad, 1.0);
        assert!(Homogeneous::new(spectrum, Spectrum::ONE, PhaseFunction::Isotropic).is_err());
        assert!(Homogeneous::new(Spectrum::ONE, spectrum, PhaseFunction::Isotropic).is_err());
    }
    // Each is finite, the sum is not.
    let huge = Spectrum::splat(f32::MAX);
    assert!(Homogeneous::new(huge, huge, PhaseFunction::Isotropic).is_err());
}
