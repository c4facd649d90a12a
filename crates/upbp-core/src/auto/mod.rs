//! The choice of the plan of a render (`docs/theory.md`, section 6.2).
//!
//! First [techniques](technique_support) are left out that cannot contribute to the picture; this is exact.
//! Then small runs with random numbers of their own look at the scene: they tell which emitting media are
//! worth to be lights ([volumes]), radii and the room that light sub-paths need ([statistics]), which lights
//! are worth samples ([emitters]), and where on them light sub-paths should start ([guides]). From these
//! follows the [full plan](full_plan): all techniques, a light sub-path per pixel.
//!
//! If techniques are to be chosen, a [pilot render](pilot_render) runs the full plan at a few hundred pixels
//! and writes down every sample with the density of each technique there. From it follow the [variance] and
//! the [cost] of an iteration of any other plan, and a [search] over [candidates](candidate) takes the plan
//! with the least product of both. Predictions are noisy, so there is one rule for all steps of the search: a
//! step must gain more than [a fixed part](search::GAIN) and more than its own standard error.
//!
//! The pilot render grows until no other candidate is likely to be better by more than that part, or until it
//! has taken [2 %](PILOT_PART) of the work that the render is going to do, whichever comes first.
//!
//! None of these samples is part of the picture: whatever is chosen, the picture is unbiased. The choice
//! counts work and looks at no clock, so that it can be repeated, unless a limit of time holds.

mod candidate;
mod cost;
mod emitters;
mod full_plan;
mod guides;
mod lanes;
pub(crate) mod memory_limit;
mod parallel_walks;
mod photon_distances;
mod pilot_render;
mod pixel_footprint;
mod roulette;
mod search;
pub(crate) mod statistics;
pub(crate) mod technique_support;
mod variance;
mod volumes;

use upbp_estimators::PreparedScene;
use upbp_estimators::TechniqueSet;
use upbp_estimators::scene::Scene;
use upbp_media::Lanes;

use crate::deadline::Budget;
use crate::error::RenderError;
use crate::plan::{FrozenPlan, Plan};
use crate::settings::{CheckedSettings, Techniques};
use candidate::Candidates;
use cost::Cost;
use memory_limit::Room;
use pilot_render::{PilotRender, Size};
use statistics::Statistics;
use technique_support::TechniqueSupport;
use variance::Variance;

pub(crate) use full_plan::iteration_plan;

/// Part of the render's work that pilot renders may take, unless the first one takes more.
const PILOT_PART: f64 = 0.02;
/// Factor by which a pilot render grows.
const GROWTH: u32 = 2;
/// Parts of the time of a preparation that the statistics and the pilot renders may take, if there is a limit
/// of time.
const TIME_FOR_STATISTICS: f64 = 0.2;
const TIME_FOR_PILOT: f64 = 0.4;

/// A plan, with what was learnt on the way to it.
pub(crate) struct Choice {
    pub(crate) support: TechniqueSupport,
    pub(crate) room: Room,
    pub(crate) statistics: Statistics,
    pub(crate) plan: Plan,
}

/// Chooses the plan of a render, and the emitters that sub-paths begin at under it; or checks the plan that
/// is `given`.
pub(crate) fn choose<S: Scene>(
    scene: &mut PreparedScene<'_, S>,
    settings: &CheckedSettings,
    given: Option<FrozenPlan>,
    budget: &mut Budget<'_>,
) -> Result<Choice, RenderError> {
    budget.step("measuring lights", 0.0)?;
    match &given {
        Some(frozen) => scene.set_emitter_choice(&frozen.emitters)?,
        None => volumes::choose(scene, settings, settings.techniques.candidates(), budget)?,
    }
    let support = TechniqueSupport::of(scene, settings, given.as_ref())?;
    let room = Room::of(scene, settings, support.techniques)?;
    let lanes = match &given {
        Some(frozen) => lanes::of_plan(&frozen.plan, settings)?,
        None => lanes::choose(scene, settings),
    };
    if lanes.is_some() {
        choose_in::<S, [f64; 3]>(scene, settings, given, support, room, lanes, budget)
    } else {
        choose_in::<S, f64>(scene, settings, given, support, room, lanes, budget)
    }
}

/// Chooses as [`choose`] does, with walks in the lanes `L`.
fn choose_in<S: Scene, L: Lanes>(
    scene: &mut PreparedScene<'_, S>,
    settings: &CheckedSettings,
    given: Option<FrozenPlan>,
    support: TechniqueSupport,
    room: Room,
    lanes: Option<[f64; 3]>,
    budget: &mut Budget<'_>,
) -> Result<Choice, RenderError> {
    let is_auto = settings.techniques == Techniques::Auto;
    let techniques = support.techniques;
    if given.is_none() {
        emitters::choose::<S, L>(scene, settings, techniques, lanes, &room, budget)?;
    }
    budget.step("looking around", 0.3)?;
    let allowance = budget.part(TIME_FOR_STATISTICS);
    let most = statistics::LIGHT_PATHS;
    let statistics = statistics::measure::<S, L>(scene, settings, techniques, lanes, most, &allowance)?;
    budget.step("choosing techniques", 0.5)?;
    let plan = if let Some(frozen) = given {
        room.fits::<S>(&frozen.plan, &statistics)?
    } else {
        let full = full_plan::full_plan(scene, settings, techniques, &statistics, &room, budget);
        if is_auto && full.uses_light_paths() {
            let most = full_plan::most_light_paths(scene, settings, &statistics, &full, &room, budget);
            let is_room = |counts| room.holds::<S>(counts, &statistics);
            let candidates = Candidates::new(scene, settings, &support, &statistics, full, most, is_room);
            let plan = best_plan::<S, L>(scene, settings, &candidates, budget);
            if !plan.uses_light_paths() {
                // Next events have to find what light sub-paths would have found.
                scene.choose_emitters_by_power();
                let techniques = techniques.intersection(TechniqueSet::PT);
                emitters::choose::<S, L>(scene, settings, techniques, lanes, &room, budget)?;
            }
            plan
        } else {
            full
        }
    };
    if budget.canceller.is_cancelled() {
        Err(RenderError::Cancelled)
    } else {
        Ok(Choice { support, room, statistics, plan })
    }
}

/// The best of the candidates by a pilot render that is large enough, or by the largest that there is time
/// for.
fn best_plan<S: Scene, L: Lanes>(
    scene: &PreparedScene<'_, S>,
    settings: &CheckedSettings,
    candidates: &Candidates,
    budget: &Budget<'_>,
) -> Plan {
    let allowance = budget.part(TIME_FOR_PILOT);
    let enough = Size::enough(scene, candidates.full.techniques);
    let most = Size::most(scene);
    let mut size = if allowance.is_limited() { Size::LEAST } else { enough };
    let (mut plan, mut spent) = (None, 0.0);
    loop {
        let Some(pilot) =
            PilotRender::run::<S, L>(scene, settings, &candidates.full, size, &allowance.halt())
        else {
            // No time, or more samples than there is room for.
            if plan.is_some() || allowance.halt().now() || size <= Size::LEAST {
                return plan.unwrap_or(candidates.usual());
            }
            size = Size(size.0 / 4);
            continue;
        };
        let variance = Variance::of(pilot);
        let found = search::best(&variance, candidates);
        let cost = Cost::of(variance.pilot()).of_pilot();
        spent += cost;
        plan = Some(found.plan);
        let is_done = size >= enough
            && (found.is_clear
                || size >= most
                || spent + f64::from(GROWTH) * cost > PILOT_PART * found.work(&budget.stop));
        if is_done || !allowance.has_time_for(1.0) {
            return found.plan;
        }
        size = size.times(GROWTH);
    }
}
