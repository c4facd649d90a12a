//! Weights of completed paths from the two sub-path ends (`docs/theory.md`, section 4.4).

use super::plan::MisPlan;

/// One sub-path's end, seen from the completed path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End {
    /// `F`: the sum of the merge factors at the vertex, as the heuristic takes it.
    pub merges: f64,
    /// `B`: all techniques that split the path before the vertex.
    pub before: f64,
}

impl End {
    fn sum(self, plan: &MisPlan, density: f64) -> f64 {
        // The density may be zero (the other walk cannot get here) while B is anything.
        if density > 0.0 { plan.pow(density) * (self.merges + self.before) } else { 0.0 }
    }
}

impl MisPlan {
    /// A merge with factor `factor` (of the sum `merges`) between two sub-paths that end at the same vertex. (4.4)
    #[inline]
    #[must_use]
    pub fn merge_weight(&self, factor: f64, merges: f64, before_light: f64, before_camera: f64) -> f64 {
        factor / (merges + before_light + before_camera)
    }

    /// A connection; `light_density` is the density `C` of the light vertex as the camera sub-path would sample it,
    /// `camera_density` that of the camera vertex, `L`. (4.5)
    #[inline]
    #[must_use]
    pub fn connect_weight(&self, light: End, light_density: f64, camera: End, camera_density: f64) -> f64 {
        let own = self.pow(self.connect);
        own / (own + light.sum(self, light_density) + camera.sum(self, camera_density))
    }

    /// Light tracing; `light_density` as for a connection.
    #[inline]
    #[must_use]
    pub fn light_tracing_weight(&self, light: End, light_density: f64) -> f64 {
        let own = self.pow(self.light_tracing);
        own / (own + light.sum(self, light_density))
    }

    /// Next event estimation. `pdf` is `p_nee`; `pdf_position` is `L_0`; `hit_density` is `C_0`, 0 for a light that cannot
    /// be hit; `camera_density` is `L_1`.
    #[inline]
    #[must_use]
    pub fn nee_weight(
        &self,
        pdf: f64,
        pdf_position: f64,
        hit_density: f64,
        camera: End,
        camera_density: f64,
    ) -> f64 {
        let own = self.pow(self.nee);
        let hit = self.pow(self.hit * hit_density / pdf);
        own / (own + hit + camera.sum(self, pdf_position / pdf * camera_density))
    }

    /// A camera sub-path hit an emitter: `connect` and `below` are the tip on arrival at the light, with next events as
    /// connections; `pdf_incident` is `p_nee`, the others `L_0` and `ρL_0`.
    #[inline]
    #[must_use]
    pub fn hit_weight(
        &self,
        tip: &super::Tip,
        pdf_incident: f64,
        pdf_position: f64,
        pdf_direction: f64,
    ) -> f64 {
        let own = self.pow(self.hit);
        own / (own
            + self.pow(pdf_incident) * tip.connect
            + self.pow(pdf_position * pdf_direction) * tip.below)
    }
}
