//! The choice of lanes: whether sub-paths draw all their distances and directions by one channel
//! (`docs/theory.md`, section 6.13).

use upbp_estimators::PreparedScene;
use upbp_estimators::mis::Heuristic;
use upbp_estimators::scene::Scene;
use upbp_media::{lane_probabilities, lanes_cover};

use crate::error::{RenderError, SettingsError};
use crate::plan::Plan;
use crate::settings::Settings;

/// The probability of each lane; `None` without lanes.
pub(super) fn choose<S: Scene>(scene: &PreparedScene<'_, S>, settings: &Settings) -> Option<[f64; 3]> {
    if settings.heuristic != Heuristic::Balance {
        return None;
    }
    lane_probabilities(scene.scene.media())
}

/// Checks the lanes of a plan that is given.
///
/// # Errors
/// If the settings rule them out, or if the scene's media have a lane that is not drawn and no other is like
/// it: what scatters in it alone would be missing.
pub(super) fn check<S: Scene>(
    scene: &PreparedScene<'_, S>,
    plan: &Plan,
    settings: &Settings,
) -> Result<(), RenderError> {
    if plan.lanes.is_some() && settings.heuristic != Heuristic::Balance {
        return Err(RenderError::Settings(SettingsError {
            name: "heuristic",
            expected: "Balance, since the plan has lanes",
            found: format!("{:?}", settings.heuristic),
        }));
    }
    if let Some(lanes) = plan.lanes
        && !lanes_cover(scene.scene.media(), lanes)
    {
        return Err(RenderError::PlanValue(format!(
            "lanes: expected a probability above 0 for every channel that no other is like in the scene's media, \
             found {lanes:?}"
        )));
    }
    Ok(())
}
