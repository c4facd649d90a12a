//! A scene made ready for the walks: emitters with their probabilities, bounds, the bodies around the camera.

use upbp_media::{Medium, MediumStack, RaySegment};

use crate::scene::{BoundingSphere, Camera, Emitter, EmitterId, EmitterKind, Scene};

/// What is derived once from a [`Scene`].
pub struct World<'a, S: Scene> {
    /// The scene.
    pub scene: &'a S,
    /// Its bounds.
    pub bounds: BoundingSphere,
    selection: Selection,
    environments: Vec<EmitterId>,
    camera_stack: Option<MediumStack>,
    emitting_media: bool,
}

impl<'a, S: Scene> World<'a, S> {
    /// Looks at the scene once: emitters' powers, bounds, the camera's surroundings.
    ///
    /// # Errors
    /// Bounds that are not positive and finite, a power that is negative or not finite, a crop outside of the film,
    /// a medium that does not exist around the scene.
    pub fn new(scene: &'a S) -> Result<Self, WorldError> {
        let bounds = scene.bounds();
        if !(bounds.radius > 0.0 && bounds.radius.is_finite() && bounds.centre.is_finite()) {
            return Err(WorldError::Bounds { centre: bounds.centre.to_array(), radius: bounds.radius });
        }
        if let Some(outside) = scene.outside()
            && outside.0 as usize >= scene.media().len()
        {
            return Err(WorldError::Outside { medium: outside.0, media: scene.media().len() });
        }
        let camera = scene.camera();
        let (width, height) = camera.resolution();
        let crop = camera.crop();
        let inside = |start: u32, size: u32, whole: u32| {
            size > 0 && start.checked_add(size).is_some_and(|end| end <= whole)
        };
        if !inside(crop.x, crop.width, width) || !inside(crop.y, crop.height, height) {
            return Err(WorldError::Crop { width, height });
        }
        // Light from infinity does not get through an infinite medium: such emitters are never chosen.
        let everything =
            RaySegment { origin: bounds.centre, direction: glam::Vec3::Z, start: 0.0, end: f32::INFINITY };
        let closed = scene
            .outside()
            .is_some_and(|m| scene.media()[m.0 as usize].segment(&everything).transmittance.is_black());
        let mut powers = Vec::with_capacity(scene.emitters().len());
        let mut environments = Vec::new();
        for (index, emitter) in scene.emitters().iter().enumerate() {
            let power = emitter.power(&bounds);
            if !(power.is_finite() && power >= 0.0) {
                return Err(WorldError::Power { emitter: index, power });
            }
            let reaches = !(closed && emitter.kind().is_infinite());
            powers.push(if reaches { f64::from(power) } else { 0.0 });
            if reaches && power > 0.0 && emitter.kind() == EmitterKind::Environment {
                environments.push(EmitterId(index as u32));
            }
        }
        let camera_stack = camera
            .is_pinhole()
            .then(|| {
                let centre = glam::Vec2::new(
                    crop.x as f32 + 0.5 * crop.width as f32,
                    crop.y as f32 + 0.5 * crop.height as f32,
                );
                camera.ray(centre, [0.5; 2]).map(|ray| scene.stack_at(ray.origin))
            })
            .flatten();
        let emitting_media = scene.media().iter().any(Medium::emits);
        let selection = Selection::new(&powers);
        Ok(Self { scene, bounds, selection, environments, camera_stack, emitting_media })
    }

    /// Chooses an emitter by power; returns its probability. `None` without light.
    #[must_use]
    pub fn choose_emitter(&self, u: f32) -> Option<(EmitterId, f32)> {
        self.selection.choose(u)
    }

    /// The probability with which an emitter is chosen; 0 if it does not exist.
    #[must_use]
    pub fn emitter_probability(&self, emitter: EmitterId) -> f32 {
        self.selection.probability(emitter)
    }

    /// The emitters that every escaping ray hits.
    #[must_use]
    pub fn environments(&self) -> &[EmitterId] {
        &self.environments
    }

    /// Whether any emitter can be chosen.
    #[must_use]
    pub fn has_emitters(&self) -> bool {
        self.selection.total > 0.0
    }

    /// Whether any medium emits light.
    #[must_use]
    pub const fn has_emitting_media(&self) -> bool {
        self.emitting_media
    }

    /// The bodies around a point of the lens.
    #[must_use]
    pub fn stack_at_camera(&self, lens: glam::Vec3) -> MediumStack {
        self.camera_stack.unwrap_or_else(|| self.scene.stack_at(lens))
    }
}

/// A discrete distribution over emitters.
#[derive(Clone, Debug)]
struct Selection {
    /// Running sums of the powers.
    cumulative: Vec<f64>,
    total: f64,
}

impl Selection {
    fn new(powers: &[f64]) -> Self {
        let mut total = 0.0;
        let cumulative = powers
            .iter()
            .map(|power| {
                total += power;
                total
            })
            .collect();
        Self { cumulative, total }
    }

    fn choose(&self, u: f32) -> Option<(EmitterId, f32)> {
        let target = f64::from(u) * self.total;
        let index = self.cumulative.partition_point(|&sum| sum <= target);
        let emitter = EmitterId(u32::try_from(index).ok()?);
        (index < self.cumulative.len()).then(|| (emitter, self.probability(emitter)))
    }

    fn probability(&self, emitter: EmitterId) -> f32 {
        let index = emitter.0 as usize;
        let Some(&end) = self.cumulative.get(index) else { return 0.0 };
        let start = if index == 0 { 0.0 } else { self.cumulative[index - 1] };
        ((end - start) / self.total) as f32
    }
}

/// What is wrong with a scene as a whole.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WorldError {
    /// Bounds.
    #[error(
        "bounds of the scene: expected a finite centre and a positive finite radius, found {centre:?} and {radius}"
    )]
    Bounds {
        /// Centre that was given.
        centre: [f32; 3],
        /// Radius that was given.
        radius: f32,
    },
    /// Power of an emitter.
    #[error("emitter {emitter}: expected a finite power >= 0, found {power}")]
    Power {
        /// Index of the emitter.
        emitter: usize,
        /// Its power.
        power: f32,
    },
    /// Crop of the camera.
    #[error("crop: expected a non-empty part of the film of {width} x {height} pixels")]
    Crop {
        /// Width of the film.
        width: u32,
        /// Height of the film.
        height: u32,
    },
    /// The medium around everything.
    #[error("medium around the scene: index {medium}, but there are {media} media")]
    Outside {
        /// The index.
        medium: u32,
        /// The number of media.
        media: usize,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn emitters_are_chosen_in_proportion_and_dark_ones_never() {
        let selection = Selection::new(&[0.0, 1.0, 0.0, 3.0, 0.0]);
        assert_eq!(selection.choose(0.0), Some((EmitterId(1), 0.25)));
        assert_eq!(selection.choose(0.249), Some((EmitterId(1), 0.25)));
        assert_eq!(selection.choose(0.25), Some((EmitterId(3), 0.75)));
        assert_eq!(selection.choose(1.0 - f32::EPSILON / 2.0), Some((EmitterId(3), 0.75)));
        assert_eq!(Selection::new(&[]).choose(0.5), None);
        assert_eq!(Selection::new(&[0.0]).choose(0.5), None);
        assert_eq!(selection.probability(EmitterId(9)), 0.0);
    }
}
