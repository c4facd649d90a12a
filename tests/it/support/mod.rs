//! Scenes, renders and their statistics, shared by the tests of the workspace.

#![allow(dead_code, reason = "each test uses its part")]

use upbp_core::{Image, Renderer, Settings};
use upbp_scene::ReadyScene;
use upbp_scene::description::{Count, Film};

pub(crate) mod cases;
pub(crate) mod closed_form;
pub(crate) mod readers;
pub(crate) mod stress;

/// A mean over independent iterations, with its standard error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Estimate {
    /// Mean of the image: of the three channels, or of one.
    pub(crate) mean: f64,
    /// Standard error of it, from the spread of the iterations.
    pub(crate) error: f64,
}

impl Estimate {
    /// Mean and standard error of independent values.
    pub(crate) fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        Self { mean, error: (variance / n).sqrt() }
    }

    /// A value that is known.
    pub(crate) const fn exactly(mean: f64) -> Self {
        Self { mean, error: 0.0 }
    }

    /// Difference to another independent estimate in standard errors.
    pub(crate) fn sigmas(&self, other: &Self) -> f64 {
        (self.mean - other.mean) / self.error.hypot(other.error)
    }
}

/// The room of `examples/host_renderer`, as a scene file, `side` pixels wide and high.
pub(crate) fn room(side: u32) -> ReadyScene {
    let side = Count::new(side).expect("a positive number");
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/room.ron");
    ReadyScene::load_with(path, |description| {
        description.film = Film { width: side, height: side, crop: None };
    })
    .expect("a valid scene")
}

/// A render that cannot be refused.
pub(crate) fn renderer(scene: &ReadyScene, settings: Settings) -> Renderer<'_> {
    scene.renderer(settings.validate().expect("valid settings")).expect("a scene that can be rendered")
}

/// Renders `iterations` iterations and returns the image mean of each, per channel, and the image.
pub(crate) fn iterate(scene: &ReadyScene, settings: &Settings, iterations: u64) -> (Vec<[f64; 3]>, Image) {
    iterate_by(renderer(scene, settings.clone()), iterations)
}

/// The same by a renderer of any scene.
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

/// Renders `iterations` iterations and returns the estimate of the image mean, and the image.
pub(crate) fn render(scene: &ReadyScene, settings: &Settings, iterations: u64) -> (Estimate, Image) {
    render_by(renderer(scene, settings.clone()), iterations)
}

/// The same by a renderer of any scene.
pub(crate) fn render_by(renderer: Renderer<'_>, iterations: u64) -> (Estimate, Image) {
    let (means, image) = iterate_by(renderer, iterations);
    let grey: Vec<f64> = means.iter().map(|m| m.iter().sum::<f64>() / 3.0).collect();
    (Estimate::of(&grey), image)
}

/// Renders `iterations` iterations and returns the estimate of the image mean per channel.
pub(crate) fn render_channels(scene: &ReadyScene, settings: &Settings, iterations: u64) -> [Estimate; 3] {
    channels(&iterate(scene, settings, iterations).0)
}

/// Mean and standard error of independent values, per channel.
pub(crate) fn channels(values: &[[f64; 3]]) -> [Estimate; 3] {
    std::array::from_fn(|c| Estimate::of(&values.iter().map(|v| v[c]).collect::<Vec<_>>()))
}

/// Asserts that estimates agree within 4 standard errors, per channel.
pub(crate) fn assert_same(found: [Estimate; 3], expected: [Estimate; 3], what: &str) {
    for (found, expected) in found.iter().zip(&expected) {
        let sigmas = found.sigmas(expected);
        println!("{what}: {found:?}, expected {expected:?}, {sigmas:.2} sigma");
        assert!(sigmas.abs() < 4.0, "{what}: {found:?}, expected {expected:?}");
    }
}
