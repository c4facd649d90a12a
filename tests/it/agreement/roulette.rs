//! Russian roulette: it changes what an image costs and how noisy it is, and not what it shows.

use std::path::Path;

use upbp_core::{Roulette, Settings, Techniques};
use upbp_scene::ReadyScene;
use upbp_testing::{Estimate, assert_same, channels, iterate, render_channels};

/// Walks by the albedo at every vertex against walks that are spared, and that never end: 12 iterations each,
/// so that their spread tells the standard error to a fifth.
#[test]
fn means_do_not_depend_on_the_roulette() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let scene =
        ReadyScene::load(root.join("examples/scenes/reference/fog_cornell.ron")).expect("a valid scene");
    for techniques in ["pt", "bpt+surf+pb2d"] {
        let of = |roulette, seed: u64| -> [Estimate; 3] {
            let settings = Settings {
                seed,
                techniques: techniques.parse::<Techniques>().expect("techniques"),
                max_length: 10,
                roulette: Some(roulette),
                progressive: false,
                ..Settings::default()
            };
            render_channels(&scene, &settings, 12)
        };
        let expected = of(Roulette::Below(1.0), 0);
        assert!(expected.iter().all(|found| found.error < 5e-3 * found.mean), "{expected:?}");
        for (roulette, seed) in [(Roulette::Below(0.5), 1), (Roulette::Below(0.05), 2), (Roulette::Off, 3)] {
            assert_same(of(roulette, seed), expected, 0.01, &format!("{techniques}, {roulette:?}"));
        }
    }
}

/// Inside of a block of glass, of which most light does not get out: of paths of more than 300 edges, which
/// roulette thins out, there is as much as without it.
#[test]
fn reflections_without_end_keep_their_mean() {
    let scene = ReadyScene::from_ron_str(
        "(version: 1, camera: Perspective(origin: (0.5, 0.2, 0.6), target: (0, 0, 0), fov_degrees: 70),
        film: (width: 16, height: 16), materials: {\"glass\": Dielectric(1.5), \"black\": Lambert(0)},
        shapes: [(geometry: Box(min: (-1, -1, -1), max: (1, 1, 1)), material: \"glass\"),
            (geometry: Sphere(centre: (-0.3, 0.1, 0.2), radius: 0.1), material: \"black\", emission: 1)])",
        "",
    )
    .expect("a valid scene");
    let of = |roulette, first: u64| -> [Estimate; 3] {
        let image_mean = |seed| {
            let settings = Settings {
                seed,
                techniques: "hit".parse::<Techniques>().expect("a technique"),
                min_length: 301,
                max_length: 800,
                roulette: Some(roulette),
                ..Settings::default()
            };
            iterate(&scene, &settings, 2).1.mean()
        };
        channels(&(first..first + 32).map(image_mean).collect::<Vec<_>>())
    };
    let expected = of(Roulette::Off, 0);
    assert!(expected.iter().all(|found| found.error < 0.05 * found.mean), "{expected:?}");
    assert_same(of(Roulette::Below(0.5), 100), expected, 0.07, "glass");
}
