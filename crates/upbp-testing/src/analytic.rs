//! The table of cases, and what is done with every result.

use serde::Deserialize;
use serde_json::Value;
use upbp_core::{Radii, Radius, Settings};
use upbp_scene::ReadyScene;

use crate::statistics::Estimate;

/// A case of the table.
#[derive(Debug, Deserialize)]
pub struct Case {
    /// Name of the case.
    pub id: String,
    kind: String,
    inputs: Value,
    expected: Value,
    /// Accuracy of what is expected: absolute.
    pub accuracy: f64,
}

impl Case {
    /// A number among the inputs.
    pub fn input(&self, name: &str) -> f64 {
        self.inputs[name].as_f64().unwrap_or_else(|| panic!("{}: no number `{name}`", self.id))
    }

    /// A number among the inputs that may be absent.
    pub fn optional(&self, name: &str) -> Option<f64> {
        self.inputs[name].as_f64()
    }

    /// Numbers among the inputs.
    pub fn inputs(&self, name: &str) -> Vec<f64> {
        self.numbers(&self.inputs[name], name)
    }

    /// A word among the inputs.
    pub fn word(&self, name: &str) -> &str {
        self.inputs[name].as_str().unwrap_or_else(|| panic!("{}: no text `{name}`", self.id))
    }

    /// An expected value, by its path of names.
    pub fn expected(&self, path: &[&str]) -> f64 {
        let value = path.iter().fold(&self.expected, |value, name| &value[*name]);
        value.as_f64().unwrap_or_else(|| panic!("{}: nothing expected of {path:?}", self.id))
    }

    /// A list of what is expected.
    pub fn expected_list(&self, name: &str) -> Vec<f64> {
        self.numbers(&self.expected[name], name)
    }

    fn numbers(&self, value: &Value, name: &str) -> Vec<f64> {
        let numbers = || value.as_array()?.iter().map(Value::as_f64).collect::<Option<Vec<_>>>();
        numbers()
            .filter(|list| !list.is_empty())
            .unwrap_or_else(|| panic!("{}: no numbers `{name}`", self.id))
    }
}

/// The cases of a kind.
pub fn cases(kind: &str) -> Vec<Case> {
    let all: Vec<Case> =
        serde_json::from_str(include_str!("../../../tests/data/analytic.json")).expect("a list of cases");
    let chosen: Vec<Case> = all.into_iter().filter(|case| case.kind == kind).collect();
    assert!(!chosen.is_empty(), "no case of {kind}");
    chosen
}

/// Results beside what is expected.
#[derive(Debug)]
pub struct Table {
    noise: f64,
    failures: Vec<String>,
}

impl Table {
    /// A table of results whose standard errors are at most a part `noise` of what is expected: from larger
    /// ones nothing could be told.
    pub const fn new(noise: f64) -> Self {
        Self { noise, failures: Vec::new() }
    }

    /// A result with its standard error. `slack` is what it may differ without being wrong: accuracy of the
    /// expected value, finite geometry, kernel bias.
    pub fn check(&mut self, name: &str, result: Estimate, expected: f64, slack: f64) {
        let difference = result.mean - expected;
        // Below single precision an error means nothing.
        let sigmas = if result.error > 1e-6 * expected.abs() {
            format!(", {:+.2} sigma", difference / result.error)
        } else {
            String::new()
        };
        let row = format!(
            "{name:52} {:.6e} ± {:.1e}, expected {expected:.6e}: {:+.3} %{sigmas}",
            result.mean,
            result.error,
            100.0 * difference / expected,
        );
        println!("{row}");
        // A result without any spread, such as zero, is compared by the slack and single precision alone.
        let bar = 4.0 * result.error + slack + 1e-5 * expected.abs();
        if !(difference.abs() <= bar) {
            self.failures.push(row);
        } else if !(result.error <= self.noise * expected.abs()) {
            self.failures.push(format!("{row}: too noisy to tell"));
        }
    }

    /// Fails if any result was beyond its bar.
    pub fn finish(self) {
        assert!(self.failures.is_empty(), "beyond the bar:\n{}", self.failures.join("\n"));
    }
}

/// A scene from the parts of its description that matter.
pub fn scene(parts: &str) -> ReadyScene {
    let text = format!("(version: 1,\n{parts}\n)");
    match ReadyScene::from_ron_str(&text, "") {
        Ok(scene) => scene,
        Err(error) => panic!("{error}\n{text}"),
    }
}

/// A camera whose film of `size` squared pixels covers so little that all pixels see the same.
pub fn narrow_camera(origin: [f64; 3], target: [f64; 3], size: u32) -> String {
    let along = [0, 1, 2].map(|i| target[i] - origin[i]);
    // Upright along the axis that the view is farthest from.
    let axis = (0..3).min_by(|a, b| along[*a].abs().total_cmp(&along[*b].abs())).unwrap_or(0);
    let mut up = [0.0; 3];
    up[axis] = 1.0;
    format!(
        "camera: Perspective(origin: {}, target: {}, up: {}, fov_degrees: 0.02),\nfilm: (width: {size}, height: {size}),",
        vector(origin),
        vector(target),
        vector(up)
    )
}

/// A vector in a scene file.
pub fn vector(v: [f64; 3]) -> String {
    format!("({:?}, {:?}, {:?})", v[0], v[1], v[2])
}

/// A homogeneous medium in a scene file.
pub fn medium(sigma_a: f64, sigma_s: f64, g: f64) -> String {
    let phase = if g == 0.0 { "Isotropic".to_owned() } else { format!("HenyeyGreenstein({g:?})") };
    format!("Homogeneous(sigma_a: {sigma_a:?}, sigma_s: {sigma_s:?}, phase: {phase})")
}

/// Settings for a set of techniques, with fixed radii if there are any.
pub fn settings(techniques: &str, radius: Option<f64>) -> Settings {
    let radius = radius.map_or(Radius::Auto, |radius| Radius::Absolute(radius as f32));
    Settings {
        techniques: techniques.parse().expect("technique names"),
        radii: Radii::all(radius),
        progressive: radius == Radius::Auto,
        // Thick slabs that hardly absorb have long paths.
        max_length: 1_000_000,
        ..Settings::default()
    }
}
