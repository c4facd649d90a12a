//! What follows from the pilot and the budget: counts and radii of all iterations.

use upbp_estimators::scene::Scene;
use upbp_estimators::{LookUps, PathLengths, Plan, PlanChoices, Roulette, Technique, TechniqueSet, World};

use crate::auto::memory::LightCounts;
use crate::auto::neighbours::Neighbours;
use crate::auto::statistics::Pilot;
use crate::plan::Stage;
use crate::radius::{Radius, RadiusSchedule};
use crate::settings::{CheckedSettings, LightPaths, Settings};

/// The techniques with photon beams.
pub(crate) const BEAMS: TechniqueSet = TechniqueSet::EMPTY.with(Technique::Bp2d).with(Technique::Bb1d);

/// The largest first radius of photon beams, relative to the scene's.
const LARGEST_BEAM_RADIUS: f32 = 3e-3;

/// A stage with all of `techniques`, with at most so many light sub-paths unless they are counted by the settings, and what may take `bytes`
/// beside the film.
pub(crate) fn everything<S: Scene>(
    world: &World<'_, S>,
    settings: &CheckedSettings,
    techniques: TechniqueSet,
    pilot: &Pilot,
    most_light_paths: u32,
    bytes: u64,
) -> Stage {
    let wanted = match settings.light_paths {
        LightPaths::Auto => most_light_paths,
        LightPaths::Count(count) => count,
    };
    let wanted_beams = settings
        .beams
        .unwrap_or_else(|| enough_beams(world, settings, pilot).min(wanted / 10).max(1))
        .min(wanted);
    // Need grows in proportion: a part of the sub-paths takes this part of the memory.
    let need = LightCounts::expected(pilot, wanted, wanted_beams).peak_bytes::<S::Bsdf>();
    let part = (bytes as f64 / need.max(1.0)).min(1.0);
    let afford = |count: u32| ((f64::from(count) * part) as u32).max(1);
    let (light_paths, beam_paths) = (afford(wanted), afford(wanted_beams));
    stage(world, settings, techniques, pilot, [light_paths, beam_paths])
}

/// A stage with so many light sub-paths, of which so many leave beams.
pub(crate) fn stage<S: Scene>(
    world: &World<'_, S>,
    settings: &CheckedSettings,
    techniques: TechniqueSet,
    pilot: &Pilot,
    [light_paths, beam_paths]: [u32; 2],
) -> Stage {
    let uses = |set: TechniqueSet, paths: u32| if techniques.intersects(set) { paths } else { 0 };
    Stage {
        from: 0,
        techniques,
        light_paths: uses(TechniqueSet::ALL.without(TechniqueSet::PT), light_paths),
        beam_paths: uses(BEAMS, beam_paths),
        connections: settings.connections.unwrap_or(1.0),
        next_events: settings.next_events.unwrap_or(1.0),
        roulette: settings.roulette.unwrap_or(usual_roulette(techniques)),
        look_ups: LookUps::ALL,
        vertices_per_light_path: pilot.vertices_per_path,
        radii: first_radii(world, settings, techniques, pilot, [light_paths, beam_paths]),
    }
}

/// The roulette that did best, in geometric mean over many scenes. Where light sub-paths come to meet them, long camera sub-paths tell
/// less.
pub(crate) const fn usual_roulette(techniques: TechniqueSet) -> Roulette {
    Roulette::Below(if techniques.without(TechniqueSet::PT).is_empty() { 0.5 } else { 0.7 })
}

/// Light sub-paths with beams such that a query beam meets a few of them. More cost more than they tell: their look-ups
/// soon take most of an iteration.
fn enough_beams<S: Scene>(world: &World<'_, S>, settings: &CheckedSettings, pilot: &Pilot) -> u32 {
    /// Photon beams within the kernel of a query beam.
    const HITS: f64 = 1.0;
    let largest = LARGEST_BEAM_RADIUS * world.bounds.radius;
    let (found, radius) = match (pilot.bb1d, settings.radii.bb1d) {
        (Some(found), Radius::Auto) => (found, largest),
        (Some(found), Radius::Scene(fraction)) => (found, fraction * world.bounds.radius),
        (Some(found), Radius::Absolute(radius)) => (found, radius),
        (None, _) => return 1024,
    };
    found.paths(HITS, f64::from(radius)).clamp(64.0, 1e6) as u32
}

/// First radii for so many light sub-paths, of which so many leave beams.
fn first_radii<S: Scene>(
    world: &World<'_, S>,
    settings: &CheckedSettings,
    techniques: TechniqueSet,
    pilot: &Pilot,
    [light_paths, beam_paths]: [u32; 2],
) -> RadiusSchedule {
    let scene = world.bounds.radius;
    let radius = |technique, choice, found: Option<Neighbours>, count: f64, paths: u32, most: f32| {
        if !techniques.has(technique) {
            return 0.0;
        }
        match choice {
            Radius::Absolute(radius) => radius,
            Radius::Scene(fraction) => fraction * scene,
            Radius::Auto => found
                .map_or(most * scene, |n| n.radius(count, f64::from(paths)))
                .clamp(0.1 * most * scene, most * scene),
        }
    };
    let radii = &settings.radii;
    RadiusSchedule {
        surf: radius(Technique::Surf, radii.surf, pilot.surf, 8.0, light_paths, 3e-3),
        pp3d: radius(Technique::Pp3d, radii.pp3d, pilot.pp3d, 8.0, light_paths, 5e-3),
        pb2d: radius(Technique::Pb2d, radii.pb2d, pilot.pb2d, 8.0, light_paths, 3e-3),
        bp2d: radius(Technique::Bp2d, radii.bp2d, pilot.bp2d, 8.0, beam_paths, 3e-3),
        bb1d: radius(Technique::Bb1d, radii.bb1d, pilot.bb1d, 15.0, beam_paths, LARGEST_BEAM_RADIUS),
        progressive: settings.progressive,
        // Positions have a relative precision of 6e-8.
        floor: 1e-6 * scene,
    }
}

/// The plan of an iteration of a stage.
pub(crate) fn plan<S: Scene>(
    world: &World<'_, S>,
    settings: &Settings,
    stage: &Stage,
    iteration: u64,
) -> Plan {
    Plan::new(
        world.scene,
        &PlanChoices {
            seed: settings.seed,
            iteration,
            techniques: stage.techniques,
            light_paths: stage.light_paths,
            beam_paths: stage.beam_paths,
            connections: stage.connections,
            next_events: stage.next_events,
            vertices_per_light_path: stage.vertices_per_light_path,
            lengths: PathLengths { min: settings.min_length, max: settings.max_length },
            roulette: stage.roulette,
            kernels: stage.radii.kernels(iteration),
            look_ups: stage.look_ups,
            heuristic: settings.heuristic,
            photon_beams: settings.photon_beams,
            query_beams: settings.query_beams,
        },
    )
}
