//! One render: its error over time.

use std::error::Error;
use std::ops::ControlFlow;

use upbp_core::{ErrorPoint, Film, Renderer, Settings, Stop};
use upbp_scene::ReadyScene;

use crate::subject::Subject;

/// Ratio of the numbers of iterations at which errors are taken.
const SPACING: f64 = 1.1;

/// A render that has not begun: the census is taken, the pilot has run.
pub(crate) fn prepare(
    subject: &Subject,
    settings: Settings,
) -> Result<Renderer<'_, ReadyScene>, Box<dyn Error>> {
    let renderer = Renderer::new(&subject.scene, settings.validate()?)?;
    let (rect, reference) = (renderer.film().rect(), &subject.reference);
    if (reference.width, reference.height) != (rect.width, rect.height) {
        return Err(format!(
            "{}: expected a reference of {} x {} pixels, found {} x {}",
            subject.name, rect.width, rect.height, reference.width, reference.height
        )
        .into());
    }
    Ok(renderer)
}

/// Renders for some time and takes the error after iterations at geometric distances, and after the last one.
/// Seconds are those of rendering, the pilot included; taking errors does not count.
pub(crate) fn measure(
    subject: &Subject,
    mut renderer: Renderer<'_, ReadyScene>,
    seconds: f64,
) -> Vec<ErrorPoint> {
    let reference = &subject.reference;
    let point = |film: &Film, seconds| {
        let image = film.image();
        ErrorPoint {
            seconds,
            iterations: film.iterations(),
            relative_mse: image.relative_mse(reference),
            rmse: image.rmse(reference),
        }
    };
    let mut points: Vec<ErrorPoint> = Vec::new();
    let mut next = 1;
    renderer.render(&Stop { seconds: Some(seconds), ..Stop::default() }, |now| {
        if now.iterations >= next {
            points.push(point(now.film, now.seconds));
            next = ((now.iterations as f64 * SPACING) as u64).max(now.iterations + 1);
        }
        ControlFlow::Continue(())
    });
    let film = renderer.film();
    if points.last().is_none_or(|last| last.iterations < film.iterations()) {
        points.push(point(film, renderer.report().seconds.total()));
    }
    points
}
