//! Next event estimation at the lens: a point on an emitter that is out of focus, and the lens point from
//! which it is seen at the pixel's sample (`docs/theory.md`, section 2.8).

use upbp_media::Lanes;

use crate::camera_output::Output;
use crate::mis::Densities;
use crate::observer::{Completion, LightEnd, ObservedSample, Observer};
use crate::path::{Context, Target, clear_edge};
use crate::random::Stream;
use crate::scene::{Crossing, Emitter, LensConnection, Scene};
use crate::technique::Technique;

/// Connects points on emitters with the lens, as many as the plan says.
pub(crate) fn next_events_at_lens<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    stream: &mut Stream,
    crossings: &mut Vec<Crossing>,
    out: &mut Output<'_, O>,
) {
    let (Context { prepared, plan }, film) = (*context, out.film);
    if plan.next_events == 0.0 || !plan.lengths.contains(1) || prepared.lens_emitters(film).is_empty() {
        return;
    }
    for _ in 0..stream.round(plan.next_events) {
        next_event_at_lens::<S, L, O>(context, stream, crossings, out);
        out.observer.call(Technique::Nee, 0);
    }
}

fn next_event_at_lens<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    stream: &mut Stream,
    crossings: &mut Vec<Crossing>,
    out: &mut Output<'_, O>,
) {
    let (Context { prepared, plan }, film) = (*context, out.film);
    let (scene, mis) = (prepared.scene, &plan.mis);
    let Some((emitter, point)) = prepared.choose_through_lens(film, stream.uniform(), stream.pair()) else {
        return;
    };
    let Some((LensConnection { lens, pdf, .. }, pdf_point)) =
        prepared.connect_through_lens(emitter, &point, film)
    else {
        return;
    };
    let between = point.position - lens;
    let distance = between.length();
    let direction = between / distance;
    let light = &scene.emitters()[emitter.0 as usize];
    let Some(seen) = light.hit(prepared.emission_bounds(), &point, -direction, lens) else { return };
    out.counters.shadow_rays += 1;
    let target = Target::Surface(point.position, point.normal);
    let stack = prepared.stack_at_camera(lens);
    let Some(density) = clear_edge::<_, L>(scene, &stack, lens, &target, crossings) else { return };

    let cos_light = f64::from(-point.normal.dot(direction));
    let pdf_ray = f64::from(pdf) * cos_light / f64::from(distance).powi(2);
    let passes = density.pass_probability.mean(&L::prior(&mis.lanes));
    let weight = mis.nee_weight(pdf_point, pdf_ray * passes, O::Densities::ZERO);
    out.record(&ObservedSample {
        technique: Technique::Nee,
        camera_depth: 0,
        completion: Completion::Lens {
            light: LightEnd { emitter, point, direction: -direction },
            lens,
            film,
        },
        weight,
        value: density.transmittance
            * seen.radiance
            * (pdf_ray / (pdf_point * f64::from(plan.next_events))) as f32,
    });
}
