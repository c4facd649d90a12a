//! Weights of completed paths from the two sub-path ends (`docs/theory.md`, section 4.4).

use upbp_media::Lanes;

use super::counts::MisPlan;
use super::density_sum::{Densities, Weight};
use super::recursion::VertexMis;
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
    /// A connection, from the [ends](VertexMis::end) of the two sub-paths. (4.5)
    #[inline]
    #[must_use]
    pub fn connect_weight<D: Densities>(&self, light: D, camera: D) -> Weight<D> {
        let own = self.pow(self.connect);
        Weight { own, all: D::of(Technique::Connect, own) + light + camera }
    }

    /// Light tracing, from the [end](VertexMis::end) of the light sub-path.
    #[inline]
    #[must_use]
    pub fn light_tracing_weight<D: Densities>(&self, light: D) -> Weight<D> {
        let own = self.pow(self.light_tracing);
        Weight { own, all: D::of(Technique::LightTracing, own) + light }
    }

    /// Next event estimation, from the [end](VertexMis::end) of the camera sub-path, whose density is
    /// `L_0/p_nee` times that of the light sub-path. `pdf` is `p_nee`; `hit_density` is `C_0`, 0 for a light
    /// that cannot be hit.
    #[inline]
    #[must_use]
    pub fn nee_weight<D: Densities>(&self, pdf: f64, hit_density: f64, camera: D) -> Weight<D> {
        let own = self.pow(self.nee);
        let hit = self.pow(self.hit * hit_density / pdf);
        Weight { own, all: D::of(Technique::Nee, own) + D::of(Technique::Hit, hit) + camera }
    }

    /// A camera sub-path hit an emitter by its first edge: next events at the lens make the path with the
    /// density `pdf`, the hit itself with `hit_density`, `C_0`.
    #[inline]
    #[must_use]
    pub fn direct_hit_weight<D: Densities>(&self, pdf: f64, hit_density: f64) -> Weight<D> {
        let own = self.pow(self.hit);
        let nee = self.pow(self.nee * pdf / hit_density);
        Weight { own, all: D::of(Technique::Hit, own) + D::of(Technique::Nee, nee) }
    }

    /// A camera sub-path hit an emitter: `connect` and `below` are those on arrival at the light, with next
    /// events as connections; `pdf_incident` is `p_nee`, the others `L_0` and `ρL_0`.
    #[inline]
    #[must_use]
    pub fn hit_weight<D: Densities, L: Lanes>(
        &self,
        vertex: &VertexMis<D, L>,
        pdf_incident: f64,
        pdf_position: f64,
        pdf_direction: f64,
    ) -> Weight<D> {
        let own = self.pow(self.hit);
        let below = L::blend(D::ZERO, &vertex.below, &L::prior(&self.lanes));
        let all = D::of(Technique::Hit, own)
            + vertex.connect * self.pow(pdf_incident)
            + below * self.pow(pdf_position * pdf_direction);
        Weight { own, all }
    }
}
