//! The places of photons. With a single light their places depend on seed, iteration and index alone, so a
//! camera can be put exactly on one of them.

use glam::Vec3;
use upbp_core::Settings;
use upbp_estimators::observer::NoObserver;
use upbp_estimators::path::{Context, LightChunk, Scratch};
use upbp_estimators::trace::trace_light_path;
use upbp_estimators::{PreparedScene, StreamKind};
use upbp_scene::ReadyScene;

/// Vertices of the light sub-paths of the first iteration.
pub(crate) fn photons(scene: &str, settings: &Settings) -> Result<Vec<Vec3>, String> {
    let scene = ReadyScene::from_ron_str(scene, "").map_err(|error| format!("refused: {error}"))?;
    let settings = settings.clone().validate().map_err(|error| format!("refused: {error}"))?;
    let mut renderer = scene.renderer(settings).map_err(|error| format!("refused: {error}"))?;
    let plan = renderer.iteration_plan(0);
    let world = PreparedScene::new(&scene).map_err(|error| format!("refused: {error}"))?;
    let context = Context { prepared: &world, plan: &plan };
    let (mut scratch, mut out) = (Scratch::default(), LightChunk::default());
    for path in 0..plan.light_paths {
        trace_light_path(&context, StreamKind::Light, path, &mut scratch, &mut out, &mut NoObserver);
    }
    renderer.iterate();
    let (counted, own) = (renderer.report().counters, &out.counters);
    if (counted.light_edges, counted.light_vertices) != (own.light_edges, own.light_vertices) {
        return Err("the renderer has other light sub-paths".to_owned());
    }
    Ok(out.vertices.iter().map(|vertex| vertex.position).collect())
}
