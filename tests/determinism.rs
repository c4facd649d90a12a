//! The same scene, settings and seed give the same bits, whatever the number of threads.

use upbp_core::{LightPaths, Renderer, Settings};
use upbp_scene::ReadyScene;
use upbp_scene::description::Count;

/// Bits of all layers and of the variance after three iterations.
fn bits(threads: usize, techniques: &str) -> Vec<u32> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/scenes/cornell_media.ron");
    let side = Count::new(40).expect("a positive count");
    let scene = ReadyScene::load_with(path, |description| {
        description.film.width = side;
        description.film.height = side;
    })
    .expect("the shipped scene");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
    pool.install(|| {
        let settings = Settings {
            techniques: techniques.parse().expect("technique names"),
            light_paths: LightPaths::Count(3000),
            beams: Some(200),
            ..Settings::default()
        };
        let mut renderer =
            Renderer::new(&scene, settings.validate().expect("valid settings")).expect("a renderer");
        for _ in 0..3 {
            assert!(renderer.iterate());
        }
        let film = renderer.film();
        let layers = film.layers().iter().filter_map(|layer| film.layer(*layer));
        layers
            .chain([film.image(), film.variance()])
            .flat_map(|i| i.pixels)
            .flatten()
            .map(f32::to_bits)
            .collect()
    })
}

#[test]
fn one_two_and_four_threads_give_the_same_bits() {
    for techniques in ["all", "bpt"] {
        let one = bits(1, techniques);
        assert!(one.iter().any(|b| *b != 0));
        assert!(one == bits(2, techniques), "{techniques}: two threads differ from one");
        assert!(one == bits(4, techniques), "{techniques}: four threads differ from one");
    }
}

#[test]
fn a_crop_shows_the_same_camera_samples_as_the_whole() {
    let render = |crop: bool| {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/scenes/cornell_media.ron");
        let count = |n| Count::new(n).expect("a positive count");
        let scene = ReadyScene::load_with(path, |description| {
            description.film.width = count(32);
            description.film.height = count(32);
            if crop {
                description.film.crop =
                    Some(upbp_scene::description::Crop { x: 8, y: 4, width: count(16), height: count(8) });
            }
        })
        .expect("the shipped scene");
        let settings = Settings {
            // Next event only: connections and merges depend on the light sub-paths, whose number follows the crop.
            techniques: "pt".parse().expect("technique names"),
            ..Settings::default()
        };
        let mut renderer =
            Renderer::new(&scene, settings.validate().expect("valid settings")).expect("a renderer");
        assert!(renderer.iterate());
        renderer.film().image()
    };
    let (whole, part) = (render(false), render(true));
    assert_eq!((part.width, part.height), (16, 8));
    for (i, pixel) in part.pixels.iter().enumerate() {
        let (x, y) = (8 + i % 16, 4 + i / 16);
        assert_eq!(*pixel, whole.pixels[y * 32 + x]);
    }
}
