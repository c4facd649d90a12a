//! Weights of completed paths from the two sub-path ends (`docs/theory.md`, section 4.4).

use super::counts::MisPlan;
use super::density_sum::{Densities, Weight};
use super::recursion::{End, VertexMis};
use crate::technique::Technique;

impl<D: Densities> Weight<D> {
    /// A merge with factor `factor` (of the sum `merges`) between two sub-paths that end at the same vertex.
    /// (4.4)
    #[inline]
    #[must_use]
    pub fn of_merge(factor: f64, merges: D, before_light: D, before_camera: D) -> Self {
        Self { own: factor, all: merges + before_light + before_camera }
    }
}

impl MisPlan {
    /// A connection; `light_density` is the density `C` of the light vertex as the camera sub-path would
    /// sample it, `camera_density` that of the camera vertex, `L`. (4.5)
    #[inline]
    #[must_use]
    pub fn connect_weight<D: Densities>(
        &self,
        light: End<D>,
        light_density: f64,
        camera: End<D>,
        camera_density: f64,
    ) -> Weight<D> {
        let own = self.pow(self.connect);
        let connect = D::of(Technique::Connect, own);
        let light = light.sum(self, light_density);
        Weight { own, all: connect + light + camera.sum(self, camera_density) }
    }

    /// Light tracing; `light_density` as for a connection.
    #[inline]
    #[must_use]
    pub fn light_tracing_weight<D: Densities>(&self, light: End<D>, light_density: f64) -> Weight<D> {
        let own = self.pow(self.light_tracing);
        Weight { own, all: D::of(Technique::LightTracing, own) + light.sum(self, light_density) }
    }

    /// Next event estimation. `pdf` is `p_nee`; `pdf_position` is `L_0`; `hit_density` is `C_0`, 0 for a
    /// light that cannot be hit; `camera_density` is `L_1`.
    #[inline]
    #[must_use]
    pub fn nee_weight<D: Densities>(
        &self,
        pdf: f64,
        pdf_position: f64,
        hit_density: f64,
        camera: End<D>,
        camera_density: f64,
    ) -> Weight<D> {
        let own = self.pow(self.nee);
        let hit = self.pow(self.hit * hit_density / pdf);
        let here = D::of(Technique::Nee, own) + D::of(Technique::Hit, hit);
        Weight { own, all: here + camera.sum(self, pdf_position / pdf * camera_density) }
    }

    /// A camera sub-path hit an emitter: `connect` and `below` are those on arrival at the light, with next
    /// events as connections; `pdf_incident` is `p_nee`, the others `L_0` and `ρL_0`.
    #[inline]
    #[must_use]
    pub fn hit_weight<D: Densities>(
        &self,
        vertex: &VertexMis<D>,
        pdf_incident: f64,
        pdf_position: f64,
        pdf_direction: f64,
    ) -> Weight<D> {
        let own = self.pow(self.hit);
        let all = D::of(Technique::Hit, own)
            + vertex.connect * self.pow(pdf_incident)
            + vertex.below * self.pow(pdf_position * pdf_direction);
        Weight { own, all }
    }
}
