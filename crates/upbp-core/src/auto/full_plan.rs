//! The full plan: all techniques, a light sub-path per pixel if memory and time allow, and first radii.

use upbp_estimators::mis::Heuristic;
use upbp_estimators::scene::{Camera, Scene};
use upbp_estimators::{
    IterationChoices, IterationPlan, LEAST_RADIUS, MergePeriods, PathLengths, PerMerge, PreparedScene,
    Technique, TechniqueSet,
};

use super::memory_limit::Room;
use super::roulette::usual_roulette;
use super::statistics::Statistics;
use crate::deadline::Budget;
use crate::plan::Plan;
use crate::radius_schedule::{LARGEST_RADIUS, MOST_MEAN_FREE_PATHS, Radius, RadiusSchedule};
use crate::settings::{CheckedSettings, LightPaths, Settings};

/// The smallest automatic first radii, relative to the largest ones.
const SMALLEST: f32 = 0.1;
/// The least first radius that settings give, scene units: single precision holds the values of all kernels.
const LEAST_GIVEN: f32 = 1e-12;
/// Part of the render's time that the light sub-paths of an iteration may take: a quick look need not wait
/// for a light sub-path per pixel.
const LIGHT_TIME: f64 = 0.05;
/// Photons in the smallest automatic kernel from which on more light sub-paths are not worth their time.
/// Where one kernel holds all that is lit, every query would visit every photon.
const CROWD: f64 = 1024.0;

/// Largest automatic first radius, relative to the [size](Planner::size) of what the picture shows.
///
/// Beams are narrow and many, since they cost a query only where it meets them: half as wide and twice as
/// many leave as much noise in a pixel, and half of what neighbours have in common.
const fn largest_radius(technique: Technique) -> f32 {
    match technique {
        Technique::Pp3d => 5e-3,
        Technique::Bb1d => 7.5e-4,
        _ => 3e-3,
    }
}

/// Photons or beams within an automatic first kernel, mean over queries.
const fn photons(technique: Technique) -> f64 {
    if matches!(technique, Technique::Bb1d) { 15.0 } else { 8.0 }
}

/// Choices that are made before light sub-paths are counted.
#[derive(Clone, Copy)]
pub(super) struct Inputs<'a> {
    pub(super) settings: &'a CheckedSettings,
    pub(super) techniques: TechniqueSet,
    /// The probability of each lane, if walks run in lanes.
    pub(super) lanes: Option<[f64; 3]>,
}

/// Makes plans that have all techniques, by the statistics of sub-paths.
pub(super) struct Planner<'a, 's, S: Scene> {
    pub(super) scene: &'a PreparedScene<'s, S>,
    pub(super) inputs: Inputs<'a>,
    pub(super) statistics: &'a Statistics,
}

impl<S: Scene> Planner<'_, '_, S> {
    /// A plan with a light sub-path per pixel, or as many as settings, memory and time allow.
    pub(super) fn full_plan(&self, room: &Room, budget: &Budget<'_>) -> Plan {
        let settings = self.inputs.settings;
        let crop = self.scene.scene.camera().crop();
        let pixels = crop.width.saturating_mul(crop.height);
        let wanted = match settings.light_paths {
            LightPaths::Count(count) => count,
            LightPaths::Auto => (self.in_time(budget).min(self.crowding()) as u32).clamp(1, pixels),
        };
        let wanted_beams =
            settings.beams.unwrap_or_else(|| self.enough_beams().min(wanted / 3).max(1)).min(wanted).max(1);
        self.plan_with(room.limited::<S>([wanted, wanted_beams], self.statistics))
    }

    /// The most light sub-paths that memory and time allow beside the beams of the full plan, and that do not
    /// crowd kernels.
    pub(super) fn most_light_paths(&self, full: &Plan, room: &Room, budget: &Budget<'_>) -> u32 {
        // Beams are no more than in the full plan: so this is a little less than what there is room for.
        let in_room = room.most_paths::<S>(full, self.statistics);
        self.in_time(budget).min(self.crowding()).min(in_room) as u32
    }

    /// Light sub-paths that are traced in the part of a limit of time that is theirs in an iteration.
    fn in_time(&self, budget: &Budget<'_>) -> f64 {
        let each = self.statistics.light_path_seconds;
        let seconds = budget.stop.seconds.filter(|_| each > 0.0);
        seconds.map_or(f64::INFINITY, |seconds| LIGHT_TIME * seconds / each)
    }

    /// A plan with given numbers of light sub-paths, and of those with beams.
    pub(super) fn plan_with(&self, [light_paths, beam_paths]: [u32; 2]) -> Plan {
        let Inputs { settings, techniques, lanes } = self.inputs;
        let uses = |set: TechniqueSet, paths: u32| if techniques.intersects(set) { paths } else { 0 };
        Plan {
            techniques,
            light_paths: uses(TechniqueSet::LIGHT_PATHS, light_paths),
            beam_paths: uses(TechniqueSet::BEAMS, beam_paths),
            connections: settings.connections.unwrap_or(1.0),
            next_events: settings.next_events.unwrap_or(1.0),
            camera_factor: 1.0,
            roulette: settings.roulette.unwrap_or(usual_roulette(techniques)),
            periods: MergePeriods::ONE,
            vertices_per_light_path: self.statistics.vertices_per_path,
            radii: self.first_radii([light_paths, beam_paths]),
            lanes,
        }
    }

    /// Number of light sub-paths with which the smallest kernels that are chosen hold a [crowd](CROWD) of
    /// photon points; infinite without such kernels.
    fn crowding(&self) -> f64 {
        let Inputs { settings, techniques, .. } = self.inputs;
        let statistics = self.statistics;
        let size = self.size();
        // No kernel holds more photons than there are.
        let all = CROWD / statistics.vertices_per_path.max(1.0);
        let is_chosen = |technique: &Technique| settings.radii.of(*technique) == Radius::Auto;
        let points = techniques.without(TechniqueSet::BEAMS).iter().filter(is_chosen);
        let paths = points.filter_map(|technique| {
            let found = statistics.neighbours_of(technique)?;
            let smallest = SMALLEST * largest_radius(technique) * size;
            Some(found.paths(CROWD, f64::from(smallest)).max(all))
        });
        paths.fold(f64::INFINITY, f64::min)
    }

    /// Light sub-paths with beams such that a query beam meets a few beams. More cost more than they tell:
    /// their queries soon take most of an iteration.
    fn enough_beams(&self) -> u32 {
        /// Photon beams within the kernel of a query beam.
        const HITS: f64 = 1.0;
        /// The fewest: they are to tell something of what there is.
        const FEWEST: f64 = 256.0;
        let Some(found) = self.statistics.neighbours.bb1d else { return 1024 };
        let radius = match self.inputs.settings.radii.bb1d {
            Radius::Auto => largest_radius(Technique::Bb1d) * self.size(),
            Radius::Scene(fraction) => fraction * self.scene.bounds.radius,
            Radius::Absolute(radius) => radius,
        };
        found.paths(HITS, f64::from(radius)).clamp(FEWEST, 1e6) as u32
    }

    /// Width of what the picture shows, where its camera sub-paths first scatter, and at most the radius of
    /// the scene: what kernels may blur has nothing to do with what lies around the picture.
    fn size(&self) -> f32 {
        let (width, height) = self.scene.scene.camera().resolution();
        let (picture, radius) =
            (self.statistics.footprint * width.max(height) as f32, self.scene.bounds.radius);
        if picture > 0.0 { picture.min(radius) } else { radius }
    }

    /// First radii for numbers of light sub-paths, and of those with beams.
    fn first_radii(&self, [light_paths, beam_paths]: [u32; 2]) -> RadiusSchedule {
        let Inputs { settings, techniques, .. } = self.inputs;
        let statistics = self.statistics;
        let size = self.size();
        let floor = 2.0 * LEAST_RADIUS * statistics.largest_coordinate;
        // Where coordinates have no digits for it, the least radius may be beyond the largest one.
        let given = |radius: f32| radius.max(floor.max(LEAST_GIVEN)).min(LARGEST_RADIUS);
        let radius = |technique: Technique| {
            if !techniques.has(technique) {
                return 0.0;
            }
            let most = largest_radius(technique);
            let paths = if technique.uses_beams() { beam_paths } else { light_paths };
            match settings.radii.of(technique) {
                Radius::Absolute(radius) => given(radius),
                Radius::Scene(fraction) => given(fraction * self.scene.bounds.radius),
                Radius::Auto => statistics
                    .neighbours_of(technique)
                    .map_or(most * size, |found| found.radius(photons(technique), f64::from(paths)))
                    .clamp(SMALLEST * most * size, most * size)
                    .min(statistics.radius_field.largest_radius().min(LARGEST_RADIUS)),
            }
        };
        let PerMerge { surf, pp3d, pb2d, bp2d, bb1d } = PerMerge::from_fn(radius);
        RadiusSchedule {
            surf,
            pp3d,
            pb2d,
            bp2d,
            bb1d,
            field: statistics.radius_field,
            most_mean_free_paths: settings
                .radii
                .are_auto(techniques.intersection(TechniqueSet::VOLUME_MERGES))
                .then_some(MOST_MEAN_FREE_PATHS),
            progressive: settings.progressive,
            floor,
        }
    }
}

/// The first iteration of a plan, for runs that tell the densities of techniques from their parts in weights:
/// with the heuristic whose weights do, whichever the render has, and without features, which nobody asks
/// these runs for.
pub(super) fn pilot_plan<S: Scene>(
    scene: &PreparedScene<'_, S>,
    settings: &Settings,
    plan: &Plan,
) -> IterationPlan {
    let settings = Settings { heuristic: Heuristic::Balance, features: false, ..settings.clone() };
    iteration_plan(scene, &settings, plan, 0)
}

/// The plan of one iteration.
pub(crate) fn iteration_plan<S: Scene>(
    scene: &PreparedScene<'_, S>,
    settings: &Settings,
    plan: &Plan,
    iteration: u64,
) -> IterationPlan {
    IterationPlan::new(
        scene.scene,
        &IterationChoices {
            seed: settings.seed,
            iteration,
            techniques: plan.techniques,
            light_paths: plan.light_paths,
            beam_paths: plan.beam_paths,
            connections: plan.connections,
            next_events: plan.next_events,
            camera_factor: plan.camera_factor,
            vertices_per_light_path: plan.vertices_per_light_path,
            lengths: PathLengths { min: settings.min_length, max: settings.max_length },
            roulette: plan.roulette,
            kernels: plan.radii.kernels(iteration),
            radius_field: plan.radii.field,
            mean_free_paths: plan.radii.mean_free_paths(iteration),
            periods: plan.periods,
            heuristic: settings.heuristic,
            photon_beams: settings.photon_beams,
            query_beams: settings.query_beams,
            lanes: plan.lanes,
            features: settings.features,
        },
    )
}
