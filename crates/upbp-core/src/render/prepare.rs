//! The preparation of a render, before its first iteration.

use std::fmt;
use std::time::Instant;

use upbp_estimators::scene::{Camera, PixelRect, Scene};
use upbp_estimators::{LightMap, PreparedScene};

use super::engine::{Engine, SceneEngine};
use super::renderer::Renderer;
use crate::auto;
use crate::deadline::{Budget, Canceller, Preparing, Stop};
use crate::error::RenderError;
use crate::film::{Film, Image};
use crate::plan::FrozenPlan;
use crate::settings::CheckedSettings;
use crate::state::{Identity, PassTimes, Record, SAMPLES, State};

/// Circumstances of a render, besides its scene and settings.
#[derive(Default)]
pub struct Start<'a> {
    /// A plan that was made before, perhaps on another machine: that of a state which is going to be
    /// [resumed](crate::Renderer::resume), by [`Identity::frozen_plan`], or one from a file. `None` for one
    /// that is made now. A plan has to go with the techniques and the heuristic of the settings; what the
    /// settings say of sample counts, roulette and radii is not asked for beside it.
    pub plan: Option<FrozenPlan>,
    /// Stops the preparation, and the render after it.
    pub canceller: Canceller,
    /// The rules by which the render is going to end, as far as they are known: the choice of a plan takes
    /// about 2 % of the work, and the preparation 5 % of the time, or up to half a second of a short render
    /// (at most a sixth of it), unless that is too little to learn anything. If time is limited, there are so
    /// few light sub-paths that there are several iterations. If choices are to be
    /// [deterministic](crate::Settings::deterministic), all limits are ignored.
    pub stop: Stop,
    /// An image of the size of what is rendered: [`render`](crate::Renderer::render) compares with it after
    /// each iteration, and the errors are a [series](crate::ErrorSeries) of the state and its report.
    pub reference: Option<Image>,
    /// A callback that is told of each step of the preparation before it begins.
    pub progress: Option<&'a mut (dyn FnMut(Preparing) + Send)>,
}

impl fmt::Debug for Start<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Start")
            .field("plan", &self.plan.as_ref().map(|frozen| frozen.plan))
            .field("canceller", &self.canceller)
            .field("stop", &self.stop)
            .finish_non_exhaustive()
    }
}

fn check_reference(image: &Image, rect: PixelRect) -> Result<(), RenderError> {
    let found = if (image.width, image.height) != (rect.width, rect.height) {
        format!("{} x {}", image.width, image.height)
    } else if !image.is_whole() {
        format!("{} in all", image.pixels.len())
    } else if let Some(index) = image.pixels.iter().position(|pixel| !pixel.iter().all(|v| v.is_finite())) {
        // All errors would be no number.
        let (index, width) = (index as u64, u64::from(image.width));
        format!("one that is not finite, in column {} of row {} from 0", index % width, index / width)
    } else {
        return Ok(());
    };
    Err(RenderError::Reference { expected: [rect.width, rect.height], found })
}

/// Prepares the scene, and chooses the plan unless one is given: a render that has not begun.
pub(super) fn prepare<'a, S: Scene>(
    scene: &'a S,
    settings: CheckedSettings,
    start: Start<'_>,
) -> Result<Renderer<'a>, RenderError> {
    let begun = Instant::now();
    let Start { plan, canceller, stop, reference, progress } = start;
    stop.check()?;
    let rect = scene.camera().crop();
    if let Some(image) = &reference {
        check_reference(image, rect)?;
    }
    let stop = if settings.deterministic { Stop::default() } else { stop };
    let mut budget = Budget { start: begun, canceller: canceller.clone(), stop, progress };
    let mut prepared = PreparedScene::new(scene)?;
    let choice = auto::choose(&mut prepared, &settings, plan, &mut budget)?;
    let identity = Identity {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        samples: SAMPLES,
        scene: String::new(),
        fingerprint: String::new(),
        film: scene.camera().resolution(),
        crop: rect,
        settings: settings.into_inner(),
        support: choice.support,
        plan: choice.plan,
        emitters: prepared.emitter_choice().clone(),
    };
    let record = Record {
        times: PassTimes { preparation: begun.elapsed(), ..PassTimes::default() },
        expected_bytes: choice.room.expected_bytes::<S>(&choice.plan, &choice.statistics),
        ..Record::default()
    };
    let film = Film::new(rect, choice.plan.techniques, identity.settings.features);
    let statistics = choice.statistics;
    let engine: Box<dyn Engine + 'a> = if choice.plan.lanes.is_some() {
        Box::new(SceneEngine::<S, [f64; 3]> { scene: prepared, statistics, map: LightMap::empty() })
    } else {
        Box::new(SceneEngine::<S, f64> { scene: prepared, statistics, map: LightMap::empty() })
    };
    Ok(Renderer::begin(engine, State { identity, record, film }, reference, canceller))
}
