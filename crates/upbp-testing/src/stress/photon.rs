//! The places of photons. By a given plan they depend on seed, iteration and index alone, so a camera can be
//! put exactly on one of them.

use glam::Vec3;
use upbp_core::{FrozenPlan, Settings, Start};
use upbp_estimators::observer::NoObserver;
use upbp_estimators::path::{Context, LightChunk, Scratch};
use upbp_estimators::scene::Scene;
use upbp_estimators::trace::trace_light_path;
use upbp_estimators::{Counters, PreparedScene, StreamKind};
use upbp_media::Lanes;
use upbp_scene::ReadyScene;

/// Vertices of the light sub-paths of the first iteration by a plan, or by the one that is chosen, with it.
pub(crate) fn photons(
    scene: &str,
    settings: &Settings,
    plan: Option<FrozenPlan>,
) -> Result<(Vec<Vec3>, FrozenPlan), String> {
    let scene = ReadyScene::from_ron_str(scene, "").map_err(|error| format!("refused: {error}"))?;
    let settings = settings.clone().validate().map_err(|error| format!("refused: {error}"))?;
    let start = Start { plan, ..Start::default() };
    let mut renderer = scene.start_renderer(settings, start).map_err(|error| format!("refused: {error}"))?;
    let frozen = renderer.state().identity().frozen_plan();
    let plan = renderer.iteration_plan(0);
    let mut world = PreparedScene::new(&scene).map_err(|error| format!("refused: {error}"))?;
    world.set_emitter_choice(&frozen.emitters).map_err(|error| format!("refused: {error}"))?;
    let context = Context { prepared: &world, plan: &plan };
    let (photons, own) =
        if frozen.plan.lanes.is_some() { trace::<_, [f64; 3]>(&context) } else { trace::<_, f64>(&context) };
    renderer.iterate();
    let counted = renderer.report().counters;
    if (counted.light_edges, counted.light_vertices) != (own.light_edges, own.light_vertices) {
        return Err("the renderer has other light sub-paths".to_owned());
    }
    Ok((photons, frozen))
}

/// Positions of all vertices of light sub-paths in the lanes `L`.
fn trace<S: Scene, L: Lanes>(context: &Context<'_, S>) -> (Vec<Vec3>, Counters) {
    let (mut scratch, mut out) = (Scratch::default(), LightChunk::<_, f64, L>::default());
    for path in 0..context.plan.light_paths {
        trace_light_path(context, StreamKind::Light, path, &mut scratch, &mut out, &mut NoObserver);
    }
    (out.vertices.iter().map(|vertex| vertex.position).collect(), out.counters)
}
