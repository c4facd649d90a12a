//! Determinism: a scene, settings and a seed give the same bits, whatever the number of threads, and however
//! the iterations are shared out among runs.

use std::path::Path;

use exr::math::Vec2;
use exr::meta::MetaData;
use proptest::prelude::*;
use upbp_core::{LightPaths, Renderer, Settings, State, StateError, TechniqueSet, read_exr, write_exr};
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
            deterministic: true,
            ..Settings::default()
        };
        let mut renderer = upbp_testing::renderer(&scene, settings);
        for _ in 0..3 {
            assert!(renderer.iterate());
        }
        let film = renderer.film();
        let layers = film.layers().filter_map(|layer| film.layer(layer));
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
    for techniques in ["all", "bpt", "auto"] {
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
            // Next event only: connections and merges depend on the light sub-paths, whose number follows the
            // crop.
            techniques: "pt".parse().expect("technique names"),
            ..Settings::default()
        };
        let mut renderer = upbp_testing::renderer(&scene, settings);
        assert!(renderer.iterate());
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("crop_{crop}.exr"));
        write_exr(&path, renderer.state(), &renderer.report()).expect("a folder for tests");
        (renderer.film().image(), path)
    };
    let ((whole, whole_file), (part, part_file)) = (render(false), render(true));
    assert_eq!((part.width, part.height), (16, 8));
    for (i, pixel) in part.pixels.iter().enumerate() {
        let (x, y) = (8 + i % 16, 4 + i / 16);
        assert_eq!(*pixel, whole.pixels[y * 32 + x]);
    }
    // A compositor finds the place of the part in the whole.
    for (file, position, size) in [(whole_file, (0, 0), (32, 32)), (part_file, (8, 4), (16, 8))] {
        let header = &MetaData::read_from_file(&file, false).expect("an image").headers[0];
        let display = header.shared_attributes.display_window;
        assert_eq!((display.position, display.size), (Vec2(0, 0), Vec2(32, 32)), "{}", file.display());
        let place = header.own_attributes.layer_position;
        assert_eq!((place, header.layer_size), (position.into(), size.into()), "{}", file.display());
        assert_eq!(read_exr(&file).expect("an image").pixels.len(), size.0 * size.1);
    }
}

/// A render of a small room with everything, by one run or a part of one.
fn room_renderer(room: &ReadyScene) -> Renderer<'_> {
    let settings = Settings {
        techniques: "all".parse().expect("technique names"),
        light_paths: LightPaths::Count(200),
        beams: Some(20),
        ..Settings::default()
    };
    let mut renderer = upbp_testing::renderer(room, settings);
    renderer.identify_scene("room", b"room");
    renderer
}

/// Iterations of the shared render.
const SHARED: u64 = 8;

/// By way of the bytes of a file, as between machines.
fn through_a_file(state: &State) -> State {
    let mut bytes = Vec::new();
    state.write(&mut bytes).expect("a vector takes all");
    let read = State::read(bytes.as_slice()).expect("what was written");
    assert_eq!(&read, state);
    read
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    /// Every iteration goes to one of four runs; the runs' states are merged in some order; the last run goes
    /// on from what the others have done.
    #[test]
    fn any_split_over_runs_gives_the_bits_of_one_run(
        run_of in proptest::collection::vec(0..4_usize, SHARED as usize),
        order in Just(vec![0, 1, 2]).prop_shuffle(),
        threads in 1..4_usize,
    ) {
        let room = upbp_testing::room(6);
        let mut whole = room_renderer(&room);
        whole.set_range(0..SHARED);
        while whole.iterate() {}

        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        let last = pool.install(|| {
            let mut states = Vec::new();
            for run in 0..3 {
                let mut renderer = room_renderer(&room);
                for index in (0..SHARED).filter(|index| run_of[*index as usize] == run) {
                    renderer.set_range(index..index + 1);
                    assert!(renderer.iterate());
                }
                states.push(through_a_file(renderer.state()));
            }
            let mut merged = room_renderer(&room).state().clone();
            for run in order {
                merged.merge(states[run].clone()).expect("disjoint slices");
            }
            let mut last = room_renderer(&room);
            last.resume(merged).expect("the same render");
            last.set_range(0..SHARED);
            while last.iterate() {}
            last.state().clone()
        });
        prop_assert!(last.film() == whole.film());
        prop_assert_eq!(last.film().fingerprint(), whole.film().fingerprint());
        prop_assert_eq!(last.report().counters, whole.report().counters);
        prop_assert_eq!(last.film().iterations(), SHARED);
    }
}

#[test]
fn what_does_not_belong_together_is_refused_by_name() {
    let room = upbp_testing::room(6);
    let render = |change: fn(&mut Settings), scene: &[u8], first: u64| {
        let mut settings = Settings {
            techniques: TechniqueSet::STANDARD.into(),
            light_paths: LightPaths::Count(100),
            ..Settings::default()
        };
        change(&mut settings);
        let mut renderer = upbp_testing::renderer(&room, settings);
        renderer.identify_scene("room", scene);
        renderer.set_range(first..first + 2);
        while renderer.iterate() {}
        renderer.state().clone()
    };
    let base = render(|_| (), b"room", 0);
    for (change, scene, word) in [
        ((|_| ()) as fn(&mut Settings), &b"hall"[..], "scene is"),
        (|s| s.seed = 1, b"room", "seed is 0 in one and 1 in the other"),
        (|s| s.techniques = "bpt".parse().expect("a technique"), b"room", "techniques is"),
        (
            |s| s.light_paths = LightPaths::Count(101),
            b"room",
            "light_paths is 100 in one and 101 in the other",
        ),
        (|s| s.max_length = 9, b"room", "max_length is 16384 in one and 9 in the other"),
        (|s| s.progressive = false, b"room", "progressive is true"),
        (|s| s.radii.surf = upbp_core::Radius::Absolute(0.5), b"room", "radii.surf is"),
    ] {
        let mut merged = base.clone();
        let error = merged.merge(render(change, scene, 2)).expect_err(word);
        assert!(matches!(error, StateError::Different { .. }) && error.to_string().contains(word), "{error}");
        assert_eq!(merged, base, "nothing has changed");
    }
    // What has no influence may differ.
    let mut merged = base.clone();
    merged.merge(render(|s| s.memory = Some(3000), b"room", 2)).expect("the same render");
    assert_eq!(merged.film().iteration_set().to_string(), "0..4");

    let error = merged.merge(render(|_| (), b"room", 3)).expect_err("an overlap");
    assert_eq!(error.to_string(), "iterations 3..4 are in both");
}
