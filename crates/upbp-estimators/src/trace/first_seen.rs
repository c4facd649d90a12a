//! Features of the first vertex of a camera sub-path that scatters, and the light that it meets before.

use glam::Vec3;
use upbp_media::Spectrum;

use crate::camera_output::CameraWalk;
use crate::features::Features;
use crate::path::Arrived;
use crate::scene::Scene;
use crate::technique::Layer;

/// Notes of a camera sub-path up to its first vertex with a smooth lobe.
pub(super) struct FirstSeen {
    /// Whether features are asked for.
    has_features: bool,
    features: Features,
    /// Length of the way, scene units.
    travelled: f32,
    /// Light up to that vertex, once the sub-path is there.
    light: Option<Spectrum>,
}

impl FirstSeen {
    /// Notes of a sub-path that starts, with [`Features`] or without.
    pub(super) const fn new(has_features: bool) -> Self {
        Self { has_features, features: Features::NONE, travelled: 0.0, light: None }
    }

    /// The sub-path arrives at a vertex from `from`, and has met `light` so far.
    #[inline]
    pub(super) fn arrive<S: Scene, L>(
        &mut self,
        scene: &S,
        arrived: &Arrived<'_, S::Bsdf, L>,
        from: Vec3,
        throughput: Spectrum,
        light: Spectrum,
    ) {
        if self.light.is_some() {
            return;
        }
        let Arrived { interaction, position, distance, .. } = arrived;
        let is_connectible = interaction.is_connectible();
        if self.has_features {
            self.travelled += distance;
            let features = Features::at(scene, interaction, *position, from, throughput, self.travelled);
            // Not a mirror: roulette may end the walk there. What is black is seen.
            if is_connectible || features.albedo.is_black() {
                self.features = features;
            }
        }
        if is_connectible {
            self.light = Some(light);
        }
    }

    /// The sub-path leaves the scene.
    pub(super) const fn escape(&mut self) {
        if self.light.is_none() {
            self.features = Features::NONE;
        }
    }

    /// The result of a sub-path that brings `layers` to its pixel.
    pub(super) fn finish(self, layers: [Spectrum; Layer::COUNT]) -> CameraWalk {
        let seen = self.light.unwrap_or(layers[Layer::Bpt as usize]);
        let features = if self.has_features { self.features.with_light(seen) } else { Features::NONE };
        CameraWalk { layers, seen, features }
    }
}
