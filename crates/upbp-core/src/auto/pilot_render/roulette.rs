//! The roulettes that are tried.

use upbp_estimators::Roulette;

/// Thresholds, ascending.
const TRIED: [f32; COUNT] = [0.25, 0.5, 0.7, 1.0];
/// Their number.
pub(crate) const COUNT: usize = 4;
/// The one that a trial runs with, from which what the others would do is predicted.
pub(crate) const TRIAL: usize = 1;

/// What a trial runs with, unless another roulette is asked for. Then nothing else is tried.
pub(crate) const OF_TRIAL: Roulette = Roulette::Below(TRIED[TRIAL]);

/// A roulette by its number.
pub(crate) fn numbered(number: usize, of_trial: Roulette) -> Roulette {
    if number == TRIAL { of_trial } else { Roulette::Below(TRIED[number]) }
}

/// How many camera sub-paths get past vertices with this product of albedos, relative to the trial's.
pub(crate) fn relative_reach(number: usize, albedos: f32) -> f32 {
    // Far beyond all thresholds the ratio does not change.
    let albedos = albedos.max(1e-3);
    Roulette::Below(TRIED[number]).reach(albedos) / OF_TRIAL.reach(albedos)
}
