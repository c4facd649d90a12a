//! Short renders that become estimates of the image mean.

use upbp_core::scene::{Camera as _, PixelRect, Scene as _};
use upbp_core::{Image, Renderer, Settings, Start, Stop};
use upbp_scene::ReadyScene;
use upbp_scene::description::{Count, Film};

use crate::root;
use crate::statistics::{Estimate, channels};

/// The room of `examples/host_renderer`, from a scene file, `side` pixels wide and high.
pub fn room(side: u32) -> ReadyScene {
    let side = Count::new(side).expect("a positive number");
    let path = root().join("tests/data/room.ron");
    ReadyScene::load_with(path, |description| {
        description.film = Film { width: side, height: side, crop: None };
    })
    .expect("a valid scene")
}

/// A renderer of a scene and settings that cannot be refused.
pub fn renderer(scene: &ReadyScene, settings: Settings) -> Renderer<'_> {
    scene.renderer(settings.validate().expect("valid settings")).expect("a scene that can be rendered")
}

/// As [`renderer`], of a render that ends after some iterations: where it chooses its techniques, the choice
/// takes a small part of their work.
pub fn short_renderer(scene: &ReadyScene, settings: Settings, iterations: u64) -> Renderer<'_> {
    let stop = Stop { iterations: Some(iterations), ..Stop::default() };
    scene
        .start_renderer(settings.validate().expect("valid settings"), Start { stop, ..Start::default() })
        .expect("a scene that can be rendered")
}

/// As [`renderer`], with a series of errors: those against a grey picture.
pub fn comparing_renderer(scene: &ReadyScene, settings: Settings) -> Renderer<'_> {
    let PixelRect { width, height, .. } = scene.camera().crop();
    let reference = Image { width, height, pixels: vec![[0.5; 3]; (width * height) as usize] };
    let start = Start { reference: Some(reference), ..Start::default() };
    scene
        .start_renderer(settings.validate().expect("valid settings"), start)
        .expect("a scene that can be rendered")
}

/// Renders `iterations` iterations and returns the image mean of each, per channel, and the image.
pub fn iterate(scene: &ReadyScene, settings: &Settings, iterations: u64) -> (Vec<[f64; 3]>, Image) {
    iterate_by(renderer(scene, settings.clone()), iterations)
}

fn iterate_by(mut renderer: Renderer<'_>, iterations: u64) -> (Vec<[f64; 3]>, Image) {
    let mut means = Vec::new();
    let mut before = [0.0; 3];
    for n in 1..=iterations {
        assert!(renderer.iterate());
        let sum = renderer.film().image().mean().map(|v| v * n as f64);
        means.push(std::array::from_fn(|c| sum[c] - before[c]));
        before = sum;
    }
    (means, renderer.film().image())
}

/// Renders `iterations` iterations and returns the estimate of the image mean over the channels, and the
/// image.
pub fn render(scene: &ReadyScene, settings: &Settings, iterations: u64) -> (Estimate, Image) {
    render_by(renderer(scene, settings.clone()), iterations)
}

/// Runs `iterations` iterations of a renderer, of any scene, and returns what [`render`] returns.
pub fn render_by(renderer: Renderer<'_>, iterations: u64) -> (Estimate, Image) {
    let (means, image) = iterate_by(renderer, iterations);
    let grey: Vec<f64> = means.iter().map(|m| m.iter().sum::<f64>() / 3.0).collect();
    (Estimate::of(&grey), image)
}

/// Renders `iterations` iterations and returns the estimate of the image mean per channel.
pub fn render_channels(scene: &ReadyScene, settings: &Settings, iterations: u64) -> [Estimate; 3] {
    channels(&iterate(scene, settings, iterations).0)
}
