//! Lamps that a lens shows out of focus.

use std::f64::consts::PI;

use glam::Vec2;
use upbp_core::Settings;
use upbp_estimators::PreparedScene;
use upbp_estimators::scene::Scene;
use upbp_scene::ReadyScene;
use upbp_testing::render;

/// A square that shines in the middle of the picture, in a haze.
fn scene(side: f64, lens: f64) -> ReadyScene {
    let text = format!(
        "(version: 1, outside: \"haze\",
        camera: Perspective(origin: (0, 0, 0), target: (0, 0, -1), fov_degrees: 30, lens_radius: {lens:?},
            focus_distance: {FOCUS:?}),
        film: (width: {SIZE:?}, height: {SIZE:?}),
        media: {{\"haze\": Homogeneous(sigma_a: (0, {1:?}, {2:?}), sigma_s: 0)}},
        materials: {{\"black\": Lambert(0)}},
        shapes: [
            (geometry: Quad(origin: (-{0:?}, -{0:?}, -{DISTANCE:?}), edge_u: ({side:?}, 0, 0), edge_v: (0, {side:?}, 0)),
             material: \"black\", emission: 7),
        ])",
        0.5 * side, HAZE[1], HAZE[2]
    );
    ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{error}\n{text}"))
}

const SIZE: u32 = 96;
const FOCUS: f64 = 3.0;
const DISTANCE: f64 = 10.0;
const HAZE: [f64; 3] = [0.0, 0.05, 0.2];

/// Distance of a film on which a pixel has unit area.
fn film_distance() -> f64 {
    f64::from(SIZE) / (2.0 * 15.0_f64.to_radians().tan())
}

#[test]
fn a_small_lamp_out_of_focus_is_an_even_disc() {
    let (side, lens) = (0.004, 0.2);
    let image_radius = film_distance() * lens * (1.0 / FOCUS - 1.0 / DISTANCE);
    let sharp = film_distance() * side / DISTANCE;
    let settings = Settings { techniques: "pt".parse().unwrap(), ..Settings::default() };
    let (_, image) = render(&scene(side, lens), &settings, 1);
    let (mut inside, mut worst) = (0, 0.0_f64);
    for (i, pixel) in image.pixels.iter().enumerate() {
        let place = [i as u32 % SIZE, i as u32 / SIZE].map(|k| f64::from(k) + 0.5 - 0.5 * f64::from(SIZE));
        let distance = place[0].hypot(place[1]);
        for (value, haze) in pixel.iter().zip(HAZE) {
            // The light of the sharp image, spread evenly.
            let expected = 7.0 * (-haze * DISTANCE).exp() * (sharp / image_radius).powi(2) / PI;
            if distance < image_radius - 1.0 {
                inside += 1;
                worst = worst.max((f64::from(*value) / expected - 1.0).abs());
            } else if distance > image_radius + 1.0 {
                assert!(f64::from(*value) < 1e-3 * expected, "{value} at {place:?}");
            }
        }
    }
    println!("{inside} values inside, worst off by {worst:.1e}");
    assert!(inside > 400);
    // The square has a size, and the lens sees it aslant by up to 0.02.
    assert!(worst < 2e-3, "{worst}");
}

#[test]
fn rays_that_meet_a_lamp_and_connections_with_it_share_its_light() {
    // As wide as the disc that the lens makes of each of its points.
    let scene = scene(0.4, 0.1);
    let estimate = |techniques: &str| {
        let settings = Settings { techniques: techniques.parse().unwrap(), ..Settings::default() };
        render(&scene, &settings, 400).0
    };
    let (hit, both) = (estimate("hit"), estimate("hit+nee"));
    let (sigmas, percent) = (both.sigmas(&hit), both.percent(&hit));
    println!("hit {hit:?}, both {both:?}: {sigmas:.2} sigma, {percent:+.3} %");
    assert!(sigmas.abs() < 4.0 && hit.error < 5e-3 * hit.mean);
    assert!(both.error < 0.7 * hit.error);
}

#[test]
fn a_place_of_the_film_chooses_among_few_lamps() {
    const DRAWS: usize = 100_000;
    let lamp = |i: usize| {
        format!(
            "(geometry: Sphere(centre: ({:?}, 0, -10), radius: 0.01), material: \"black\", emission: {i}),",
            i as f32 * 0.01 - 0.25
        )
    };
    let scene = |lens: f32| {
        let text = format!(
            "(version: 1, camera: Perspective(origin: (0, 0, 0), target: (0, 0, -1), fov_degrees: 30,
                lens_radius: {lens:?}, focus_distance: 3),
            film: (width: 96, height: 96), materials: {{\"black\": Lambert(0)}}, shapes: [{}])",
            (1..=50).map(lamp).collect::<String>()
        );
        ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{error}\n{text}"))
    };
    // A pinhole, and a lens that shows them as sharp.
    for lens in [0.0, 1e-4] {
        assert!(!PreparedScene::new(&scene(lens)).unwrap().has_lens_emitters());
    }
    let scene = scene(0.2);
    let prepared = PreparedScene::new(&scene).unwrap();
    assert!(prepared.lens_emitters(Vec2::new(2.0, 90.0)).is_empty());
    let middle = Vec2::new(48.0, 48.0);
    let lamps = prepared.lens_emitters(middle);
    assert!((20..=32).contains(&lamps.len()), "{} lamps", lamps.len());
    let mut counts = vec![0.0; scene.emitters().len()];
    for i in 0..DRAWS {
        let u = (i as f32 + 0.5) / DRAWS as f32;
        counts[prepared.choose_through_lens(middle, u, [0.5; 2]).unwrap().0.0 as usize] += 1.0 / DRAWS as f64;
    }
    for &(emitter, probability) in lamps {
        let found: f64 = counts[emitter.0 as usize];
        assert!((found - f64::from(probability)).abs() < 1e-4, "{emitter:?}: {found}, not {probability}");
        counts[emitter.0 as usize] = 0.0;
    }
    assert_eq!(counts.iter().sum::<f64>(), 0.0, "others are chosen");
}
