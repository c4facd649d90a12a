//! What happens once, before the first iteration.

use std::time::Instant;

use upbp_estimators::scene::{Camera, EmitterId, Scene};
use upbp_estimators::{LightMap, Technique, TechniqueSet, World};

use crate::auto::choices::{self, everything, stage};
use crate::auto::emitters::{self, EmitterChoices};
use crate::auto::memory::{self, LightCounts};
use crate::auto::planner::Planner;
use crate::auto::statistics::{self, Pilot};
use crate::auto::support::Census;
use crate::budget::Budget;
use crate::budget::{Canceller, Halt};
use crate::error::RenderError;
use crate::film::Film;
use crate::plan::RenderPlan;
use crate::render::engine::{Engine, SceneEngine};
use crate::report::PassTimes;
use crate::settings::CheckedSettings;
use crate::settings::Techniques;
use crate::state::{Identity, Record, State, fingerprint};

/// A render that has not begun.
pub(crate) struct Prepared<'a> {
    pub(crate) engine: Box<dyn Engine + 'a>,
    /// None if the plan is given.
    pub(crate) planner: Option<Planner>,
    pub(crate) canceller: Canceller,
    pub(crate) state: State,
}

/// How a render begins, besides its scene and settings.
#[derive(Default)]
pub struct Start<'a> {
    /// A plan that was made before, perhaps on another machine, and does not change. `None` for one that is made now.
    pub plan: Option<RenderPlan>,
    /// Stops the preparation, and the render after it.
    pub canceller: Canceller,
    /// Seconds that the whole render may take. The preparation takes a twentieth at most, unless that is too little to learn anything, and
    /// chooses so few light sub-paths that there are several iterations; if choices are to be
    /// [deterministic](crate::Settings::deterministic), neither. The render itself ends by [`Stop`](crate::Stop).
    pub seconds: Option<f64>,
    /// Is told what comes next, before each step of the preparation.
    pub progress: Option<&'a mut (dyn FnMut(Preparing) + Send)>,
}

/// A step of the preparation of a render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preparing {
    /// What is done now.
    pub step: &'static str,
    /// Part of the steps that are done, in `[0, 1)`.
    pub fraction: f64,
}

/// Part of the render's time that the preparation may take, and every later choice of techniques.
pub(crate) const PREPARATION: f64 = 0.05;
/// Part of the preparation's time that measuring emitters may take, and looking around for radii; the rest is for the choice of techniques.
const TIME_FOR_EMITTERS: f64 = 0.3;
const TIME_FOR_RADII: f64 = 0.2;
/// Part of the render's time that the light sub-paths of an iteration may take.
const LIGHT_TIME: f64 = 0.05;

/// Takes the census, runs the pilot, and makes a plan, unless one is given.
pub(crate) fn prepare<'a, S: Scene>(
    scene: &'a S,
    settings: CheckedSettings,
    begin: Start<'_>,
) -> Result<Prepared<'a>, RenderError> {
    let start = Instant::now();
    let Start { plan: frozen, canceller, seconds, mut progress } = begin;
    let seconds = seconds.filter(|_| !settings.deterministic);
    let budget = Budget::new(&canceller, seconds.map(|seconds| PREPARATION * seconds));
    let mut tell = |step, fraction| {
        if let Some(progress) = &mut progress {
            progress(Preparing { step, fraction });
        }
        if canceller.is_cancelled() { Err(RenderError::Cancelled) } else { Ok(()) }
    };
    let mut world = World::new(scene)?;
    let census = Census::with_light(&world, settings.techniques.candidates(), settings.max_length)?;
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
    let memory = memory::budget(settings.memory);
    let film_bytes = Film::memory_bytes(rect, techniques);
    // Light vertices have gone when an image is written.
    let output_bytes = Film::output_bytes(rect, techniques);
    if film_bytes + output_bytes > memory {
        return Err(RenderError::Memory {
            width: rect.width,
            height: rect.height,
            needed: (film_bytes + output_bytes).div_ceil(1 << 20),
            budget: memory >> 20,
        });
    }
    let light_bytes = match settings.memory {
        // What is free now says nothing of other machines.
        None if settings.deterministic => memory::LIGHT_BYTES,
        _ => memory - film_bytes,
    };
    let without_pilot: TechniqueSet =
        [Technique::Hit, Technique::Nee, Technique::LightTracing].into_iter().collect();
    let look = |world: &World<'_, S>, light_paths, part| {
        let only_light_tracing = techniques.without(without_pilot).is_empty();
        if only_light_tracing && !(seconds.is_some() && techniques.has(Technique::LightTracing)) {
            return Ok(Pilot::default());
        }
        let run =
            |part, halt: &Halt<'_>| statistics::run(world, &settings, techniques, light_paths, part, halt);
        budget.part(part).largest(true, run).ok_or(RenderError::Cancelled)
    };
    let [few, many] = statistics::LIGHT_PATHS;
    tell("measuring lights", 0.0)?;
    let measure = || -> Result<_, RenderError> {
        let pilot = look(&world, few, 0.2 * TIME_FOR_EMITTERS)?;
        let light_paths = emitters::light_paths_for(scene.emitters().len(), pilot.vertices_per_path);
        let plan = |techniques| {
            let stage = stage(&world, &settings, techniques, &pilot, [light_paths, light_paths / 8]);
            choices::plan(&world, &settings, &stage, 0)
        };
        let camera = techniques.intersection(TechniqueSet::PT);
        let may_be_alone = matches!(settings.techniques, Techniques::Auto) && camera != techniques;
        let alone = may_be_alone.then(|| plan(camera));
        let budget = budget.part(0.8 * TIME_FOR_EMITTERS);
        EmitterChoices::measure(&world, &plan(techniques), alone.as_ref(), &budget)
            .ok_or(RenderError::Cancelled)
    };
    let emitters = if scene.emitters().len() > 1 { Some(measure()?) } else { None };
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
    tell("looking around", TIME_FOR_EMITTERS)?;
    let pilot = look(&world, many, TIME_FOR_RADII)?;
    let pixels = rect.width.saturating_mul(rect.height);
    for stage in frozen.iter().flat_map(RenderPlan::stages) {
        let counts = LightCounts::expected(&pilot, stage.light_paths, stage.beam_paths);
        let needed = film_bytes + counts.peak_bytes::<S::Bsdf>() as u64;
        if needed > memory {
            return Err(RenderError::PlanMemory {
                from: stage.from,
                needed: needed.div_ceil(1 << 20),
                budget: memory >> 20,
            });
        }
    }
    let most = match seconds {
        // A quick look need not wait for a light sub-path per pixel.
        Some(seconds) if pilot.light_path_seconds > 0.0 => {
            ((LIGHT_TIME * seconds / pilot.light_path_seconds) as u32).clamp(1, pixels)
        }
        _ => pixels,
    };
    let everything = everything(&world, &settings, techniques, &pilot, most, light_bytes);
    let planner = Planner { settings: settings.clone(), everything, bytes: light_bytes };
    tell("choosing techniques", TIME_FOR_EMITTERS + TIME_FOR_RADII)?;
    let (plan, planner) = match (frozen, settings.techniques) {
        (Some(plan), _) => (plan, None),
        (None, Techniques::Auto) => {
            let budget = budget.part(1.0 - TIME_FOR_EMITTERS - TIME_FOR_RADII);
            (RenderPlan::new(planner.stage(&world, &census, &pilot, 0, &budget)), Some(planner))
        }
        (None, Techniques::Set(_)) => (RenderPlan::new(planner.everything), None),
    };
    if canceller.is_cancelled() {
        return Err(RenderError::Cancelled);
    }
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
    let film = Film::new(rect, identity.plan.techniques());
    let mut record =
        Record { times: PassTimes { pilot: start.elapsed(), ..PassTimes::default() }, ..Record::default() };
    let first = identity.plan.stage(0);
    let counts = LightCounts::expected(&pilot, first.light_paths, first.beam_paths);
    record.expected_bytes = film_bytes + output_bytes.max(counts.peak_bytes::<S::Bsdf>() as u64);
    Ok(Prepared {
        engine: Box::new(SceneEngine { world, emitters, pilot, map: LightMap::empty() }),
        planner,
        canceller,
        state: State { identity, record, film },
    })
}
