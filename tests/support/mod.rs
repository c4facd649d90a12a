//! Statistics of renders, shared by the tests of the workspace.

#![allow(dead_code, reason = "each test uses its part")]

use upbp_core::scene::Scene;
use upbp_core::{Image, Renderer, Settings};

/// A mean over independent iterations, with its standard error.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// Mean of the image, mean of the three channels.
    pub mean: f64,
    /// Standard error of it, from the spread of the iterations.
    pub error: f64,
}

impl Estimate {
    /// Difference to another independent estimate in standard errors.
    pub fn sigmas(&self, other: &Self) -> f64 {
        (self.mean - other.mean) / self.error.hypot(other.error)
    }
}

/// Renders `iterations` iterations and returns the estimate of the image mean, and the image.
pub fn render<S: Scene>(scene: &S, settings: &Settings, iterations: u64) -> (Estimate, Image) {
    let checked = settings.clone().validate().expect("valid settings");
    let mut renderer = Renderer::new(scene, checked).expect("a scene that can be rendered");
    let mut sums = Vec::new();
    let mut before = 0.0;
    for n in 1..=iterations {
        assert!(renderer.iterate());
        let image = renderer.film().image();
        let total = image.mean().iter().sum::<f64>() / 3.0 * n as f64;
        sums.push(total - before);
        before = total;
    }
    let n = iterations as f64;
    let mean = before / n;
    let variance = sums.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (Estimate { mean, error: (variance / n).sqrt() }, renderer.film().image())
}
