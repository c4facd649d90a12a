//! Russian roulettes that may be chosen.

use upbp_estimators::{Roulette, TechniqueSet};

/// Thresholds, ascending.
const THRESHOLDS: [f32; COUNT] = [0.25, 0.5, 0.7, 1.0];
/// Number of thresholds.
pub(super) const COUNT: usize = 4;
/// The number of the one that a pilot render runs with, from whose samples those of the others are predicted.
pub(super) const PILOT: usize = 1;

/// The roulette that a pilot render runs with, unless another is asked for. Then no other is a candidate.
pub(super) const OF_PILOT: Roulette = Roulette::Below(THRESHOLDS[PILOT]);

/// All roulettes that may be chosen.
pub(super) fn all() -> [Roulette; COUNT] {
    THRESHOLDS.map(Roulette::Below)
}

/// The number of a roulette, if a pilot render ran with `of_pilot`.
pub(super) fn number(roulette: Roulette, of_pilot: Roulette) -> usize {
    if roulette == of_pilot {
        return PILOT;
    }
    all().iter().position(|own| *own == roulette).unwrap_or(PILOT)
}

/// Camera sub-paths that get past vertices with this product of albedos, relative to those of the pilot
/// render.
pub(super) fn relative_pass_probability(number: usize, albedos: f32) -> f32 {
    // Far beyond all thresholds the ratio does not change.
    let albedos = albedos.max(1e-3);
    Roulette::Below(THRESHOLDS[number]).survival(albedos) / OF_PILOT.survival(albedos)
}

/// The roulette that did best, in geometric mean over many scenes. Where light sub-paths come to meet them,
/// long camera sub-paths tell less.
pub(super) const fn usual_roulette(techniques: TechniqueSet) -> Roulette {
    Roulette::Below(if techniques.intersects(TechniqueSet::LIGHT_PATHS) { 0.7 } else { 0.5 })
}
