//! What happens once, before the first iteration.

use std::time::Instant;

use upbp_estimators::scene::{Camera, EmitterId, Scene};
use upbp_estimators::{Technique, TechniqueSet, World};

use crate::census::Census;
use crate::choices::{self, everything, stage};
use crate::emitters::{self, EmitterChoices};
use crate::engine::{Engine, SceneEngine};
use crate::error::RenderError;
use crate::film::Film;
use crate::memory::LightCounts;
use crate::passes::Lists;
use crate::pilot::{self, Pilot};
use crate::planner::Planner;
use crate::report::PassTimes;
use crate::settings::CheckedSettings;
use crate::stage::{RenderPlan, Stage};
use crate::state::{Identity, Record, State, fingerprint};
use crate::techniques::Techniques;

/// A render that has not begun.
pub(crate) struct Prepared<'a> {
    pub(crate) engine: Box<dyn Engine + 'a>,
    /// None if the plan is given.
    pub(crate) planner: Option<Planner>,
    pub(crate) state: State,
}

/// Takes the census, runs the pilot, and makes a plan, unless one is given.
pub(crate) fn prepare<S: Scene>(
    scene: &S,
    settings: CheckedSettings,
    frozen: Option<RenderPlan>,
) -> Result<Prepared<'_>, RenderError> {
    let start = Instant::now();
    let mut world = World::new(scene)?;
    let census = Census::take(&world, settings.techniques.candidates(), settings.max_length);
    let techniques = census.techniques;
    if let Some(stage) =
        frozen.iter().flat_map(RenderPlan::stages).find(|s| !s.techniques.without(techniques).is_empty())
    {
        return Err(RenderError::Plan {
            from: stage.from,
            extra: stage.techniques.without(techniques),
            techniques,
        });
    }
    let rect = scene.camera().crop();
    let budget = u64::from(settings.memory) << 20;
    let film_bytes = Film::memory_bytes(rect, techniques);
    // Light vertices have gone when an image is written.
    let output_bytes = Film::output_bytes(rect, techniques);
    if film_bytes + output_bytes > budget {
        return Err(RenderError::Memory {
            width: rect.width,
            height: rect.height,
            needed: (film_bytes + output_bytes).div_ceil(1 << 20),
            budget: u64::from(settings.memory),
        });
    }
    let without_pilot: TechniqueSet =
        [Technique::Hit, Technique::Nee, Technique::LightTracing].into_iter().collect();
    let look = |world: &World<'_, S>, light_paths| {
        if techniques.without(without_pilot).is_empty() {
            Pilot::default()
        } else {
            pilot::run(world, &settings, techniques, light_paths)
        }
    };
    let [few, many] = pilot::LIGHT_PATHS;
    let emitters = (scene.emitters().len() > 1).then(|| {
        let pilot = look(&world, few);
        let light_paths = emitters::light_paths_for(scene.emitters().len(), pilot.vertices_per_path);
        let plan = |techniques| {
            let stage = stage(&world, &settings, techniques, &pilot, [light_paths, light_paths / 8]);
            // Measured with sums as weights, which do not know merges apart.
            choices::plan(&world, &settings, &Stage { correlation: None, ..stage }, 0)
        };
        let camera = techniques.intersection(TechniqueSet::PT);
        let may_be_alone = matches!(settings.techniques, Techniques::Auto) && camera != techniques;
        let alone = may_be_alone.then(|| plan(camera));
        EmitterChoices::measure(&world, &plan(techniques), alone.as_ref())
    });
    let mut probabilities = Vec::new();
    // With light sub-paths last: the pilot and trials have some.
    for has_light_paths in [false, true] {
        if let Some(emitters) = &emitters {
            emitters.apply(&mut world, has_light_paths);
        }
        for emitter in (0..scene.emitters().len() as u32).map(EmitterId) {
            let chosen = [world.emission_probability(emitter), world.next_event_probability(emitter)];
            probabilities.extend(chosen.map(f32::to_le_bytes).as_flattened());
        }
    }
    let pilot = look(&world, many);
    let pixels = rect.width.saturating_mul(rect.height);
    for stage in frozen.iter().flat_map(RenderPlan::stages) {
        let counts = LightCounts::expected(&pilot, stage.light_paths, stage.beam_paths);
        let needed = film_bytes + counts.peak_bytes::<S::Bsdf>(stage.correlation.is_some()) as u64;
        if needed > budget {
            return Err(RenderError::PlanMemory {
                from: stage.from,
                needed: needed.div_ceil(1 << 20),
                budget: u64::from(settings.memory),
            });
        }
    }
    let everything = everything(&world, &settings, techniques, &pilot, pixels, budget - film_bytes);
    let planner = Planner { settings: settings.clone(), everything, bytes: budget - film_bytes };
    let (plan, planner) = match (frozen, settings.techniques) {
        (Some(plan), _) => (plan, None),
        (None, Techniques::Auto) => {
            (RenderPlan::new(planner.stage(&world, &census, &pilot, 0)), Some(planner))
        }
        (None, Techniques::Set(_)) => (RenderPlan::new(planner.everything), None),
    };
    let identity = Identity {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        scene: String::new(),
        fingerprint: String::new(),
        film: scene.camera().resolution(),
        part: (rect.x, rect.y, rect.width, rect.height),
        settings: settings.into_inner(),
        census,
        emitters: fingerprint(&probabilities),
        plan,
    };
    let film = Film::new(rect, techniques);
    let mut record =
        Record { times: PassTimes { pilot: start.elapsed(), ..PassTimes::default() }, ..Record::default() };
    let first = identity.plan.stage(0);
    let counts = LightCounts::expected(&pilot, first.light_paths, first.beam_paths);
    record.expected_bytes =
        film_bytes + output_bytes.max(counts.peak_bytes::<S::Bsdf>(first.correlation.is_some()) as u64);
    Ok(Prepared {
        engine: Box::new(SceneEngine {
            world,
            emitters,
            pilot,
            lists: Lists::default(),
            lists_apart: Lists::default(),
        }),
        planner,
        state: State { identity, record, film },
    })
}
