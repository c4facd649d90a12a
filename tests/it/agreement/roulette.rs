//! Russian roulette: it changes what an image costs and how noisy it is, and not what it shows.

use std::path::Path;

use upbp_core::{Roulette, Settings, Techniques};
use upbp_scene::ReadyScene;
use upbp_testing::{Estimate, assert_same, channels, iterate};

/// Walks by the albedo at every vertex against walks that are spared, and that never end: 32 seeds of one
/// iteration each, so that their spread tells the standard error to an eighth.
#[test]
fn means_do_not_depend_on_the_roulette() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let scene =
        ReadyScene::load(root.join("examples/scenes/reference/fog_cornell.ron")).expect("a valid scene");
    for techniques in ["pt", "bpt+surf+pb2d"] {
        let of = |roulette, first: u64| -> [Estimate; 3] {
            let image_mean = |seed| {
                let settings = Settings {
                    seed,
                    techniques: techniques.parse::<Techniques>().expect("techniques"),
                    max_length: 10,
                    roulette: Some(roulette),
                    ..Settings::default()
                };
                iterate(&scene, &settings, 1).1.mean()
            };
            channels(&(first..first + 32).map(image_mean).collect::<Vec<_>>())
        };
        let expected = of(Roulette::Below(1.0), 0);
        for (roulette, first) in
            [(Roulette::Below(0.5), 100), (Roulette::Below(0.05), 200), (Roulette::Off, 300)]
        {
            assert_same(of(roulette, first), expected, &format!("{techniques}, {roulette:?}"));
        }
    }
}
