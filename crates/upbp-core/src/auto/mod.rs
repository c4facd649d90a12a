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
use candidate::Candidates;
use cost::Cost;
use memory_limit::Room;
use pilot_render::recorder::TECHNIQUES;
use pilot_render::{Limits, PilotRender, Size};
use statistics::Statistics;
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
    if let Some(frozen) = &given {
        frozen.plan.validate().map_err(RenderError::PlanValue)?;
    }
    match &given {
        Some(frozen) => scene.set_emitter_choice(&frozen.emitters).map_err(RenderError::PlanEmitters)?,
        None => volumes::choose(scene, settings, settings.techniques.candidates(), budget)?,
    }
    let support = TechniqueSupport::of(scene, settings, given.as_ref())?;
    let room = Room::of(scene, settings, support.techniques, given.is_some())?;
    let lanes = match &given {
        Some(frozen) => lanes::of_plan(scene, &frozen.plan, settings)?,
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
    let techniques = given.as_ref().map_or(support.techniques, |frozen| frozen.plan.techniques);
    let found = match &given {
        Some(_) => [0.0; TECHNIQUES],
        None => emitters::choose::<S, L>(scene, settings, techniques, lanes, &room, budget)?,
    };
    budget.step("looking around", 0.3)?;
    let allowance = budget.part(TIME_FOR_STATISTICS);
    let most = statistics::LIGHT_PATHS;
    let mut statistics =
        statistics::measure::<S, L>(scene, settings, techniques, lanes, most, &room, &allowance)?;
    budget.step("choosing techniques", 0.5)?;
    let plan = if let Some(frozen) = given {
        room.fits::<S>(&frozen.plan, &statistics)?
    } else {
        let full = full_plan::full_plan(scene, settings, techniques, &statistics, &room, budget);
        if is_auto && full.uses_light_paths() {
            let most = full_plan::most_light_paths(scene, settings, &statistics, &full, &room, budget);
            let is_room = |counts| room.holds::<S>(counts, &statistics);
            let candidates = Candidates::new(scene, settings, &support, &statistics, full, most, is_room);
            let limits = Limits::of::<S, L>(&room);
            let mut plan = best_plan::<S, L>(scene, settings, &candidates, limits, budget);
            let missed: f64 = techniques.without(plan.techniques).iter().map(|off| found[off as usize]).sum();
            if !plan.uses_light_paths() || missed > MUCH * found.iter().sum::<f64>() {
                // What they miss is left to the techniques that are on.
                scene.choose_emitters_by_power();
                emitters::choose::<S, L>(scene, settings, plan.techniques, lanes, &room, budget)?;
                let allowance = budget.part(TIME_FOR_VERTICES);
                let few = statistics::FEW_LIGHT_PATHS;
                let on = plan.techniques;
                let again = statistics::measure::<S, L>(scene, settings, on, lanes, few, &room, &allowance)?;
                if again.vertices_per_path > 0.0 {
                    plan.vertices_per_light_path = again.vertices_per_path;
                }
                if again.vertices_per_path + again.beams_per_path > 0.0 {
                    let paths = [plan.light_paths, plan.beam_paths];
                    [plan.light_paths, plan.beam_paths] = room.limited::<S>(paths, &again);
                    statistics = again;
                }
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
    limits: Limits,
    budget: &Budget<'_>,
) -> Plan {
    let allowance = budget.rest(TIME_AFTER_PILOT, TIME_FOR_PILOT);
    let enough = Size::enough_pixels(scene, candidates.full.techniques);
    let most = Size::most_pixels(scene);
    let mut size = Size::LEAST;
    if !allowance.is_limited() {
        size.pixels = enough;
    }
    let (mut plan, mut spent) = (None, 0.0);
    loop {
        let mut clock = Clock::start();
        let Some(mut pilot) =
            PilotRender::run::<S, L>(scene, settings, &candidates.full, size, limits, &allowance.halt())
        else {
            // No time, or more samples than there is room for.
            if plan.is_some() || allowance.halt().now() || size.pixels <= Size::LEAST.pixels {
                return plan.unwrap_or(candidates.usual());
            }
            size.pixels = (size.pixels / 4).max(Size::LEAST.pixels);
            continue;
        };
        let cost = Cost::of(&pilot).of_pilot();
        pilot.iterations = Cost::of(&pilot).iterations(&plan.unwrap_or(candidates.usual()), &budget.stop);
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
