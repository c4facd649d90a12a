//! From the choice of techniques to a stage of the plan.

use std::ops::RangeInclusive;

use upbp_estimators::scene::Scene;
use upbp_estimators::{Technique, TechniqueSet, World};

use crate::auto::choices::{BEAMS, plan};
use crate::auto::emitters;
use crate::auto::memory::LightCounts;
use crate::auto::statistics::Pilot;
use crate::auto::support::Census;
use crate::auto::{self, pilot_render::roulette};
use crate::budget::Budget;
use crate::plan::Stage;
use crate::radius::{Radius, RadiusSchedule};
use crate::settings::{CheckedSettings, LightPaths};

/// What chooses stages.
pub(crate) struct Planner {
    pub(crate) settings: CheckedSettings,
    /// All that the scene can use.
    pub(crate) everything: Stage,
    /// Memory beside the film.
    pub(crate) bytes: u64,
}

impl Planner {
    /// The stage that follows from a review, with what time there is for it.
    pub(crate) fn stage<S: Scene>(
        &self,
        world: &World<'_, S>,
        census: &Census,
        pilot: &Pilot,
        review: u32,
        budget: &Budget<'_>,
    ) -> Stage {
        let Self { settings, everything, .. } = self;
        if everything.techniques.without(TechniqueSet::PT).is_empty() {
            return everything.clone();
        }
        let of_trial = settings.roulette.unwrap_or(roulette::OF_TRIAL);
        let widest = self.widest(pilot.footprint);
        let radii = |relative: f64| {
            let surf = (f64::from(everything.radii.surf) * widest * relative) as f32;
            RadiusSchedule { surf, ..everything.radii }
        };
        let trial = Stage { roulette: of_trial, radii: radii(1.0), ..everything.clone() };
        let plan = plan(world, settings, &trial, auto::REVIEWS[review as usize]);
        let choice = auto::Choice {
            everything: &plan,
            bounds: self.bounds(world, census, pilot, plan.techniques, widest),
            most_paths: emitters::light_paths(pilot.vertices_per_path),
            timed: !settings.deterministic,
        };
        let candidate = auto::choose(world, &choice, review, budget);
        let count = |planned: u32, factor: f64| ((f64::from(planned) * factor) as u32).max(1);
        let light_paths =
            if candidate.needs_light() { count(everything.light_paths, candidate.light_paths) } else { 0 };
        let beam_paths = if candidate.techniques.intersects(BEAMS) {
            count(everything.beam_paths, candidate.beam_paths).min(light_paths)
        } else {
            0
        };
        Stage {
            techniques: candidate.techniques,
            light_paths,
            beam_paths,
            connections: everything.connections * candidate.connections as f32,
            roulette: roulette::numbered(candidate.roulette, of_trial),
            look_ups: candidate.look_ups(),
            radii: radii(candidate.surf_radius),
            ..everything.clone()
        }
    }

    /// What may be chosen: everything that settings do not fix.
    fn bounds<S: Scene>(
        &self,
        world: &World<'_, S>,
        census: &Census,
        pilot: &Pilot,
        techniques: TechniqueSet,
        widest: f64,
    ) -> auto::Bounds {
        /// Numbers of light sub-paths, relative to one per pixel.
        const LIGHT_PATHS: [f64; 3] = [0.0625, 0.25, 1.0];
        const BEAM_PATHS: [f64; 3] = [0.25, 1.0, 4.0];
        /// Per camera vertex, relative to one.
        const CONNECTIONS: [f64; 3] = [0.25, 0.5, 1.0];
        let Self { settings, everything, .. } = self;
        let fits = |factor: &f64| {
            let beams = f64::from(everything.beam_paths) * factor;
            let counts = LightCounts::expected(pilot, everything.light_paths, beams as u32);
            *factor <= 1.0 || counts.peak_bytes::<S::Bsdf>() < self.bytes as f64
        };
        auto::Bounds {
            techniques,
            always: if census.needs_merges { floor(census.techniques) } else { TechniqueSet::EMPTY },
            careful: if world.scene.has_specular_surfaces() {
                census.techniques.intersection(TechniqueSet::EMPTY.with(Technique::Surf))
            } else {
                TechniqueSet::EMPTY
            },
            light_paths: match settings.light_paths {
                LightPaths::Auto => LIGHT_PATHS.to_vec(),
                LightPaths::Count(_) => vec![1.0],
            },
            beam_paths: match settings.beams {
                None => BEAM_PATHS.into_iter().filter(fits).collect(),
                Some(_) => vec![1.0],
            },
            paths_per_beam_path: f64::from(everything.light_paths) / f64::from(everything.beam_paths.max(1)),
            connections: match settings.connections {
                None => CONNECTIONS.to_vec(),
                Some(_) => vec![1.0],
            },
            surf_radii: if widest > 1.0 { vec![1.0 / widest, 1.0] } else { vec![1.0] },
            roulettes: match settings.roulette {
                Some(_) => roulette::TRIAL..roulette::TRIAL + 1,
                None => 0..roulette::COUNT,
            },
        }
    }

    /// The widest radius of surface merging, relative to the usual one: the width of a pixel if that is more. It blurs what a pixel
    /// blurs anyway, so that the prediction, which knows nothing of blur, may be asked. Trials have this radius: they tell what
    /// fewer photons at a vertex would do, but not what more would.
    fn widest(&self, footprint: f32) -> f64 {
        /// A factor between these is worth a try.
        const FACTORS: RangeInclusive<f32> = 1.25..=4.0;
        let factor = (footprint / self.everything.radii.surf).min(*FACTORS.end());
        let tried = self.settings.radii.surf == Radius::Auto && FACTORS.contains(&factor);
        f64::from(if tried { factor } else { 1.0 })
    }
}

/// Merges find every path that has a vertex where anything but specular surfaces scatters: those on surfaces, and one kind of
/// those in media.
fn floor(techniques: TechniqueSet) -> TechniqueSet {
    let volume = [Technique::Pb2d, Technique::Pp3d, Technique::Bb1d, Technique::Bp2d];
    let one = volume.into_iter().find(|technique| techniques.has(*technique));
    one.into_iter().chain([Technique::Surf]).collect::<TechniqueSet>().intersection(techniques)
}
