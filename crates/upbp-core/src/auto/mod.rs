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
//! step must gain more than [a fixed part](search::LEAST_GAIN) and more than its own standard error.
//!
//! The pilot render grows until no other candidate is likely to be better by more than that part and until it
//! has as many light sub-paths as the full plan, or as there is room for, but takes at most
//! [2 %](PILOT_PART) of the work that the render is going to do, or the time that is left for the
//! preparation. Where techniques are off that find much, emitters are chosen once more for the others; radii
//! stay as they are.
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
mod thinned;
mod variance;
mod volumes;

use upbp_estimators::PreparedScene;
use upbp_estimators::scene::Scene;
use upbp_media::Lanes;

use crate::deadline::{Budget, Clock};
use crate::error::RenderError;
use crate::plan::{FrozenPlan, Plan};
use crate::settings::{CheckedSettings, Techniques};
use candidate::{Candidates, finished};
use cost::Cost;
use full_plan::{Inputs, Planner};
use memory_limit::Room;
use pilot_render::{Limits, PilotRender, Size};
use statistics::{FEW_LIGHT_PATHS, LIGHT_PATHS, Statistics};
use technique_support::TechniqueSupport;
use variance::Variance;

pub(crate) use full_plan::iteration_plan;

/// Part of the render's work that pilot renders may take, unless the first one takes more.
const PILOT_PART: f64 = 0.02;
/// The most by which the pixels of a pilot render grow that is too small to be trusted, as the first ones are
/// where time is limited.
const GROWTH_AT_FIRST: u32 = 8;
/// The most by which the pixels of a pilot render grow that leaves candidates in doubt.
const GROWTH_IN_DOUBT: u32 = 2;
/// The most by which the light sub-paths for each pixel grow: what was not met at all leaves nothing in
/// doubt.
const GROWTH_OF_LIGHT: u32 = 4;
/// Part of what is left of the time, and of all room for samples, that the next pilot render is planned to
/// take: both grow faster than its size.
const PLANNED: f64 = 0.7;
/// Part of the time of a preparation that the statistics may take, if there is a limit of time.
const TIME_FOR_STATISTICS: f64 = 0.2;
/// Part of that time that pilot renders may take at least: they have what the steps before them leave.
const TIME_FOR_PILOT: f64 = 0.4;
/// Part of the light of light sub-paths that is much for techniques to find that are off then.
const MUCH: f64 = 0.2;
/// Part of that time that is kept for what may come after pilot renders, another choice of emitters.
const TIME_AFTER_PILOT: f64 = emitters::TIME_FOR_EMITTERS + TIME_FOR_VERTICES;
/// Part of that time that another look at the length of light sub-paths may take after that.
const TIME_FOR_VERTICES: f64 = 0.05;

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
    let choice = match given {
        Some(frozen) => check(scene, settings, &frozen, budget)?,
        None => choose_anew(scene, settings, budget)?,
    };
    if budget.canceller.is_cancelled() { Err(RenderError::Cancelled) } else { Ok(choice) }
}

/// Checks a plan that is given, and lets the scene choose emitters as it says.
fn check<S: Scene>(
    scene: &mut PreparedScene<'_, S>,
    settings: &CheckedSettings,
    frozen: &FrozenPlan,
    budget: &mut Budget<'_>,
) -> Result<Choice, RenderError> {
    let plan = frozen.plan;
    plan.validate().map_err(RenderError::PlanValue)?;
    scene.set_emitter_choice(&frozen.emitters).map_err(RenderError::PlanEmitters)?;
    let support = TechniqueSupport::of(scene, settings)?;
    support.check(&plan)?;
    let room = Room::of(scene, settings, support.techniques, plan.lanes.is_some(), true)?;
    lanes::check(scene, &plan, settings)?;
    let lanes = plan.lanes;
    let inputs = Inputs { settings, techniques: plan.techniques, lanes };
    let statistics = if lanes.is_some() {
        measure::<S, [f64; 3]>(scene, inputs, &room, budget)?
    } else {
        measure::<S, f64>(scene, inputs, &room, budget)?
    };
    room.fits::<S>(&plan, &statistics)?;
    Ok(Choice { support, room, statistics, plan })
}

/// Chooses a plan, and the emitters for it.
fn choose_anew<S: Scene>(
    scene: &mut PreparedScene<'_, S>,
    settings: &CheckedSettings,
    budget: &mut Budget<'_>,
) -> Result<Choice, RenderError> {
    volumes::choose(scene, settings, settings.techniques.candidates(), budget)?;
    let support = TechniqueSupport::of(scene, settings)?;
    let lanes = lanes::choose(scene, settings);
    let room = Room::of(scene, settings, support.techniques, lanes.is_some(), false)?;
    let inputs = Inputs { settings, techniques: support.techniques, lanes };
    if lanes.is_some() {
        choose_in::<S, [f64; 3]>(scene, inputs, support, room, budget)
    } else {
        choose_in::<S, f64>(scene, inputs, support, room, budget)
    }
}

/// Chooses among the techniques that the scene can use, with walks in the lanes `L`.
fn choose_in<S: Scene, L: Lanes>(
    scene: &mut PreparedScene<'_, S>,
    inputs: Inputs<'_>,
    support: TechniqueSupport,
    room: Room,
    budget: &mut Budget<'_>,
) -> Result<Choice, RenderError> {
    let found = emitters::choose::<S, L>(scene, inputs, &room, budget)?;
    let statistics = measure::<S, L>(scene, inputs, &room, budget)?;
    let planner = Planner { scene, inputs, statistics: &statistics };
    let full = planner.full_plan(&room, budget);
    if inputs.settings.techniques != Techniques::Auto || !full.uses_light_paths() {
        return Ok(Choice { support, room, statistics, plan: full });
    }
    let most = planner.most_light_paths(&full, &room, budget);
    let is_room = |counts| room.holds::<S>(counts, &statistics);
    let candidates = Candidates::new(&planner, &support, full, most, is_room);
    let limits = Limits::of::<S, L>(&room);
    let plan = best_plan::<S, L>(scene, inputs.settings, &candidates, limits, budget);
    let mut choice = Choice { support, room, statistics, plan };
    let missed: f64 = inputs.techniques.without(plan.techniques).iter().map(|off| found[off as usize]).sum();
    if !plan.uses_light_paths() || missed > MUCH * found.iter().sum::<f64>() {
        let inputs = Inputs { techniques: plan.techniques, ..inputs };
        choose_emitters_again::<S, L>(scene, inputs, &mut choice, budget)?;
    }
    Ok(choice)
}

/// Chooses emitters once more, for the techniques that are on: what the others miss is left to these.
fn choose_emitters_again<S: Scene, L: Lanes>(
    scene: &mut PreparedScene<'_, S>,
    inputs: Inputs<'_>,
    Choice { room, statistics, plan, .. }: &mut Choice,
    budget: &Budget<'_>,
) -> Result<(), RenderError> {
    scene.choose_emitters_by_power();
    emitters::choose::<S, L>(scene, inputs, room, budget)?;
    let allowance = budget.part(TIME_FOR_VERTICES);
    let again = statistics::measure::<S, L>(scene, inputs, FEW_LIGHT_PATHS, room, &allowance)?;
    if again.vertices_per_path > 0.0 {
        plan.vertices_per_light_path = again.vertices_per_path;
    }
    if again.vertices_per_path + again.beams_per_path > 0.0 {
        let paths = [plan.light_paths, plan.beam_paths];
        [plan.light_paths, plan.beam_paths] = room.limited::<S>(paths, &again);
        *statistics = again;
    }
    Ok(())
}

/// Measures sub-paths for radii and memory.
fn measure<S: Scene, L: Lanes>(
    scene: &PreparedScene<'_, S>,
    inputs: Inputs<'_>,
    room: &Room,
    budget: &mut Budget<'_>,
) -> Result<Statistics, RenderError> {
    budget.step("looking around", 0.3)?;
    let allowance = budget.part(TIME_FOR_STATISTICS);
    let statistics = statistics::measure::<S, L>(scene, inputs, LIGHT_PATHS, room, &allowance)?;
    budget.step("choosing techniques", 0.5)?;
    Ok(statistics)
}

/// The best of the candidates by a pilot render that is large enough, or by the largest that there is time
/// for.
fn best_plan<S: Scene, L: Lanes>(
    scene: &PreparedScene<'_, S>,
    settings: &CheckedSettings,
    candidates: &Candidates,
    limits: Limits,
    budget: &Budget<'_>,
) -> Plan {
    let allowance = budget.rest(TIME_AFTER_PILOT, TIME_FOR_PILOT);
    let enough = Size::enough_pixels(scene, candidates.usual.techniques);
    let most = Size::most_pixels(scene);
    let mut size = Size::LEAST;
    if !allowance.is_limited() {
        size.pixels = enough;
    }
    let usual = finished(candidates.usual);
    let (mut plan, mut spent) = (None, 0.0);
    loop {
        let mut clock = Clock::start();
        let Some(mut pilot) =
            PilotRender::run::<S, L>(scene, settings, &candidates.of_pilot, size, limits, &allowance.halt())
        else {
            // No time, or more samples than there is room for.
            if plan.is_some() || allowance.halt().now() || size.pixels <= Size::LEAST.pixels {
                return plan.unwrap_or(usual);
            }
            size.pixels = (size.pixels / 4).max(Size::LEAST.pixels);
            continue;
        };
        let cost = Cost::of(&pilot).of_pilot();
        pilot.iterations = Cost::of(&pilot).iterations(&plan.unwrap_or(usual), &budget.stop);
        let variance = Variance::of(pilot);
        let found = search::best(&variance, candidates);
        plan = Some(found.plan);
        let pilot = variance.pilot();
        let affordable = PLANNED * allowance.time_ratio(clock.lap()).min(pilot.room_taken.recip());
        let at_most = |growth: u32| affordable.min(f64::from(growth)) as u32;
        if 2 * size.pixels < enough {
            let growth = at_most(GROWTH_AT_FIRST);
            if growth < 2 {
                return found.plan;
            }
            size.pixels = (growth * size.pixels).min(enough);
            continue;
        }
        let in_doubt = !found.is_clear && size.pixels < most;
        let (part, growth) = if in_doubt {
            (&mut size.pixels, at_most(GROWTH_IN_DOUBT))
        } else {
            (&mut size.light_paths, at_most(GROWTH_OF_LIGHT).min(pilot.more_light_paths as u32))
        };
        spent += cost;
        if growth < 2 || spent + f64::from(growth) * cost > PILOT_PART * found.work(&budget.stop) {
            return found.plan;
        }
        *part *= growth;
    }
}
