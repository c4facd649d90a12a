//! Settings of a render, and their validation.

mod techniques;

use serde::{Deserialize, Serialize};
use upbp_estimators::Roulette;
use upbp_estimators::mis::{BeamExtent, Heuristic};

use crate::error::{SettingsError, TextError};
use crate::plan::PER_VERTEX;
use crate::radius_schedule::{Radii, Radius};

pub use techniques::{Techniques, UnknownTechniques};

/// A number of light sub-paths per iteration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum LightPaths {
    /// One light sub-path per pixel, within the memory budget; fewer or more where [`Techniques::Auto`] finds
    /// that this pays.
    #[default]
    Auto,
    /// A given number, within the memory budget.
    Count(u32),
}

/// Settings of a render. All have defaults; a settings file names those that differ.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// `"auto"`, or a set as in `"bpt+surf+pp3d+pb2d+bb1d"`, of which what the scene cannot use is left out.
    pub techniques: Techniques,
    /// Choose the plan as if the render had no limits, so that every run with the same seed chooses the same,
    /// whenever it ends.
    pub deterministic: bool,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Light sub-paths per iteration. A count is kept, within the memory budget, whatever is chosen.
    pub light_paths: LightPaths,
    /// Light sub-paths that leave photon beams; `None` for as many as small runs find useful, or, if
    /// techniques are chosen, a quarter of that or four times as many where it pays.
    pub beams: Option<u32>,
    /// Light vertices that every camera vertex is connected to, on average, in `[0.001, 1000]`; `None` for
    /// one.
    pub connections: Option<f32>,
    /// Points on lights that every camera vertex is connected to, on average, in `[0.001, 1000]`; `None` for
    /// one.
    pub next_events: Option<f32>,
    /// Fewest edges of a path between light and camera, at least 1.
    pub min_length: u32,
    /// Most edges of a path, at least `min_length` and at most 1,048,576. Thick media that hardly absorb need
    /// many: walks that are cut are counted in the report.
    pub max_length: u32,
    /// Russian roulette; `None` for the one that is chosen with the techniques, or usual for them.
    pub roulette: Option<Roulette>,
    /// Balance or power heuristic.
    pub heuristic: Heuristic,
    /// Extent of photon beams. All are short if light from infinity arrives in some channels and not in
    /// others.
    pub photon_beams: BeamExtent,
    /// Extent of query beams.
    pub query_beams: BeamExtent,
    /// First kernel radii.
    pub radii: Radii,
    /// Whether radii shrink, so that the result converges.
    pub progressive: bool,
    /// Whether the film has [albedo, normal and depth](crate::FeatureImages) besides the picture, for
    /// denoisers and compositing.
    pub features: bool,
    /// Memory for light vertices, beams, their trees and the film, MiB; `None` for half of what is free, on
    /// the machine and in its control groups, where Linux tells, else 2048 MiB. If choices are
    /// [deterministic](Self::deterministic), light vertices, beams and their trees then take at most 2048 MiB
    /// on any machine; a plan that is given may take all that is free.
    pub memory: Option<u32>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            techniques: Techniques::Auto,
            deterministic: false,
            seed: 0,
            light_paths: LightPaths::Auto,
            beams: None,
            connections: None,
            next_events: None,
            min_length: 1,
            max_length: 16_384,
            roulette: None,
            heuristic: Heuristic::Balance,
            photon_beams: BeamExtent::Short,
            query_beams: BeamExtent::Long,
            radii: Radii::default(),
            progressive: true,
            features: false,
            memory: None,
        }
    }
}

/// Settings that passed [`Settings::validate`], which alone makes them.
///
/// A renderer takes no others:
///
/// ```
/// use upbp_core::scene::Scene;
/// use upbp_core::{RenderError, Renderer, Settings};
///
/// fn renderer<S: Scene>(scene: &S, settings: Settings) -> Result<Renderer<'_>, RenderError> {
///     Renderer::new(scene, settings.validate()?)
/// }
/// ```
///
/// ```compile_fail,E0308
/// use upbp_core::scene::Scene;
/// use upbp_core::{RenderError, Renderer, Settings};
///
/// fn renderer<S: Scene>(scene: &S, settings: Settings) -> Result<Renderer<'_>, RenderError> {
///     Renderer::new(scene, settings)
/// }
/// ```
///
/// They are read like [`Settings`], and changed before they are checked:
///
/// ```
/// use upbp_core::{CheckedSettings, Settings, SettingsError};
///
/// fn with_seed(mut settings: Settings) -> Result<CheckedSettings, SettingsError> {
///     settings.seed = 7;
///     settings.validate()
/// }
/// assert_eq!(with_seed(Settings::default())?.seed, 7);
/// # Ok::<(), SettingsError>(())
/// ```
///
/// ```compile_fail,E0594
/// use upbp_core::{CheckedSettings, Settings, SettingsError};
///
/// fn with_seed(mut settings: CheckedSettings) -> Result<CheckedSettings, SettingsError> {
///     settings.seed = 7;
///     Ok(settings)
/// }
/// ```
///
/// ```compile_fail,E0423
/// use upbp_core::{CheckedSettings, Settings, SettingsError};
///
/// fn with_seed(mut settings: Settings) -> Result<CheckedSettings, SettingsError> {
///     settings.seed = 7;
///     Ok(CheckedSettings(settings))
/// }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct CheckedSettings(Settings);

impl CheckedSettings {
    pub(crate) fn into_inner(self) -> Settings {
        self.0
    }
}

impl std::ops::Deref for CheckedSettings {
    type Target = Settings;

    fn deref(&self) -> &Settings {
        &self.0
    }
}

/// Most edges of a path: a bound of the memory of one sub-path, and of the time that a render goes on beyond
/// its limit, since no walk is broken off. That of walks which nothing else ends is tens of seconds here.
const MAX_LENGTH: u32 = 1 << 20;

impl Settings {
    /// Checks every value.
    ///
    /// # Errors
    /// The first setting that is out of its range, with what was expected.
    pub fn validate(self) -> Result<CheckedSettings, SettingsError> {
        let refuse = |name, expected, found: String| Err(SettingsError { name, expected, found });
        if self.techniques.candidates().is_empty() {
            return refuse("techniques", "at least one technique", self.techniques.to_string());
        }
        if self.light_paths == LightPaths::Count(0) {
            return refuse("light_paths", "at least 1", "0".into());
        }
        if self.beams == Some(0) {
            return refuse("beams", "at least 1 (leave out bb1d and bp2d for none)", "0".into());
        }
        for (name, count) in [("connections", self.connections), ("next_events", self.next_events)] {
            if let Some(count) = count
                && !PER_VERTEX.contains(&count)
            {
                return refuse(name, "0.001 to 1000", count.to_string());
            }
        }
        if let Some(Roulette::Below(least)) = self.roulette
            && !(least > 0.0 && least <= 1.0)
        {
            return refuse("roulette", "Off, or Below a number in (0, 1]", least.to_string());
        }
        if self.min_length == 0 {
            return refuse("min_length", "at least 1", "0".into());
        }
        if self.max_length < self.min_length {
            return refuse(
                "max_length",
                "at least min_length",
                format!("{} with min_length {}", self.max_length, self.min_length),
            );
        }
        if self.max_length > MAX_LENGTH {
            return refuse("max_length", "at most 1048576", self.max_length.to_string());
        }
        if self.memory == Some(0) {
            return refuse("memory", "at least 1 MiB", "0".into());
        }
        for (name, radius) in [
            ("radii.surf", self.radii.surf),
            ("radii.pp3d", self.radii.pp3d),
            ("radii.pb2d", self.radii.pb2d),
            ("radii.bp2d", self.radii.bp2d),
            ("radii.bb1d", self.radii.bb1d),
        ] {
            if let Radius::Scene(value) | Radius::Absolute(value) = radius
                && !(value > 0.0 && value.is_finite())
            {
                return refuse(name, "a positive finite radius", value.to_string());
            }
        }
        Ok(CheckedSettings(self))
    }

    /// Reads settings from RON text, such as `(techniques: "bpt", seed: 7)`.
    ///
    /// # Errors
    /// Line, column and reason of what is not understood.
    pub fn from_ron(text: &str) -> Result<Self, TextError> {
        let options =
            ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
        Ok(options.from_str(text)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_valid_and_survives_ron() {
        let settings = Settings::default();
        let text = ron::to_string(&settings).unwrap();
        assert_eq!(Settings::from_ron(&text).unwrap(), settings);
        assert_eq!(Settings::from_ron("()").unwrap(), settings);
        settings.validate().unwrap();
    }

    #[test]
    fn what_is_wrong_is_named() {
        let cases: [(&str, &str); 10] = [
            ("(light_paths: Count(0))", "light_paths"),
            ("(beams: 0)", "beams"),
            ("(connections: 0)", "connections"),
            ("(next_events: 1001)", "next_events"),
            ("(min_length: 0)", "min_length"),
            ("(min_length: 5, max_length: 4)", "max_length"),
            ("(max_length: 1048577)", "max_length"),
            ("(memory: 0)", "memory"),
            ("(radii: (pb2d: Absolute(0)))", "radii.pb2d"),
            ("(radii: (surf: Scene(inf)))", "radii.surf"),
        ];
        for (text, name) in cases {
            let error = Settings::from_ron(text).unwrap().validate().unwrap_err();
            assert_eq!(error.name, name);
        }
        let error = Settings::from_ron("(\n  seed: 1,\n  radius: 2,\n)").unwrap_err();
        assert_eq!(error.line, 3, "{error}");
        let words = ["1:15", "1:16"].map(|place| {
            format!(
                "{place}: expected a word, as `Auto` is one; \
                 numbers go with words, as in `Count(1000)` or `Absolute(0.01)`"
            )
        });
        for (text, message) in [
            ("(light_paths: 5)", words[0].as_str()),
            ("(radii: (surf: 3))", words[1].as_str()),
            ("(\n  memory: -1)", "2:12: the whole number is too large or negative"),
            ("(seed: 1e3)", "1:8: expected a whole number"),
        ] {
            assert_eq!(Settings::from_ron(text).unwrap_err().to_string(), message);
        }
        assert!(Settings::from_ron("(techniques: \"bpt+beams\")").unwrap_err().to_string().contains("beams"));
    }
}
