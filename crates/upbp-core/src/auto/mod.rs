//! The choice of techniques and sample counts by efficiency (`docs/theory.md`, section 6(a)).
//!
//! A [trial](pilot_render) of a few thousand sub-paths with everything on is written down; from it follow the [variance](variance) and the
//! [cost] of any other plan; a [search] takes the one with the least product of both. The sub-paths of trials have random numbers of their
//! own and add nothing to the picture: whatever is chosen, the picture is unbiased.

pub(crate) mod choices;
mod cost;
pub(crate) mod emitters;
pub(crate) mod memory;
mod neighbours;
mod pilot_render;
pub(crate) mod planner;
mod search;
pub(crate) mod statistics;
pub(crate) mod support;
mod variance;

use upbp_estimators::scene::{Camera, Scene};
use upbp_estimators::{Plan, TechniqueSet, World};

use cost::Costs;
use pilot_render::PASSES;
use pilot_render::grid::Grid;
pub(crate) use search::Bounds;
use search::Candidate;
use variance::Prediction;

use crate::budget::Budget;
use crate::budget::Halt;

/// The iterations before which the plan is chosen, again and again: radii have shrunk, and a larger trial is worth its time.
pub(crate) const REVIEWS: [u64; 3] = [0, 512, 4096];
/// The factor by which a change must make the product of variance and cost smaller.
const GAINS: [f64; REVIEWS.len()] = [0.93, 0.96, 0.98];
/// The first trial looks at one of so many pixels, more of them where no media make it slow, within bounds,
const PIXELS_PER_CELL: [u32; 2] = [12, 4];
const CELLS: [u32; 2] = [400, 2048];
/// and the next one at so many times as many.
const GROWTH: u32 = 2;
/// A trial that has too many samples is made again with so many times less,
const SMALLER: u32 = 4;
/// but not with less than so many, which would tell nothing.
const LEAST_CELLS: u32 = 25;
/// Light sub-paths per cell in a pass of the trial.
const LIGHT_PATHS_PER_CELL: u32 = 2;

/// What may be chosen.
pub(crate) struct Choice<'a> {
    /// Everything that the scene can use, with the full number of light sub-paths.
    pub(crate) everything: &'a Plan,
    pub(crate) bounds: Bounds,
    /// Camera sub-paths, and light sub-paths, of a pass at most: what is written down must fit into memory.
    pub(crate) most_paths: u32,
    /// Whether time may be measured.
    pub(crate) timed: bool,
}

/// Makes the choice of a review, by the number of it: everything, if there is no time for a choice.
pub(crate) fn choose<S: Scene>(
    world: &World<'_, S>,
    choice: &Choice<'_>,
    review: u32,
    budget: &Budget<'_>,
) -> Candidate {
    budget
        .largest(false, |part, halt| choose_by_part(world, choice, review, part, halt))
        .unwrap_or_else(|| Candidate::everything(&choice.bounds))
}

/// Makes the choice with a part of a trial. `None` if it was halted.
fn choose_by_part<S: Scene>(
    world: &World<'_, S>,
    choice: &Choice<'_>,
    review: u32,
    part: f64,
    halt: &Halt<'_>,
) -> Option<Candidate> {
    let plan = choice.everything;
    let crop = world.scene.camera().crop();
    let media = plan.techniques.intersects(TechniqueSet::VOLUME_MERGES);
    let pixels_per_cell = PIXELS_PER_CELL[usize::from(!media)];
    let first = (crop.width.saturating_mul(crop.height) / pixels_per_cell).clamp(CELLS[0], CELLS[1]);
    let full = (first * GROWTH.pow(review)).min(choice.most_paths);
    let mut cells = ((part * f64::from(full)) as u32).max(LEAST_CELLS);
    while cells >= LEAST_CELLS {
        let grid = Grid::new(crop, cells);
        let paths = choice.most_paths.min(LIGHT_PATHS_PER_CELL * cells);
        let trial = pilot_render::run(world, plan, &grid, paths, PASSES * review, choice.timed, halt);
        if halt.now() {
            return None;
        }
        if let Some(trial) = trial {
            let costs = Costs::of(&trial);
            let prediction = Prediction::new(trial, &grid);
            return Some(search::best(&prediction, &costs, &choice.bounds, GAINS[review as usize]));
        }
        // As many photons are looked up less often and by less sub-paths.
        cells /= SMALLER;
    }
    Some(Candidate::everything(&choice.bounds))
}
