//! Renders a case under guard and says what is wrong with the result.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock, mpsc};
use std::time::{Duration, Instant};

use upbp_core::{Counters, Film, FrozenPlan, RenderError, Settings, Start};
use upbp_scene::ReadyScene;

use crate::processor;
use crate::statistics::Estimate;

/// A render that takes more processor seconds has hung.
const LIMIT: f64 = 60.0;

/// Time between two looks at the processor time of a case.
const LOOK: Duration = Duration::from_secs(1);

/// Part of all contributions that may be dropped.
const DROPPED: f64 = 1e-5;

/// Part of all edges at which a walk may be lost.
const LOST: f64 = 1e-5;

/// The outcome of a render.
#[derive(Clone, Debug)]
pub(crate) struct Render {
    /// Image means by channel.
    pub means: [Estimate; 3],
    pub counters: Counters,
    /// Camera sub-paths.
    pub camera_paths: u64,
    pub seconds: f64,
}

impl Render {
    /// Result of a scene that is black.
    fn black(start: Instant) -> Self {
        Self {
            means: [Estimate::exactly(0.0); 3],
            counters: Counters::default(),
            camera_paths: 1,
            seconds: start.elapsed().as_secs_f64(),
        }
    }

    /// Camera sub-paths that the limit of the length has cut, as a part of all.
    pub(crate) fn cut(&self) -> f64 {
        self.counters.cut_walks as f64 / self.camera_paths as f64
    }
}

/// Renders in a thread of its own: a panic, an endless loop and whatever may not be on a film are errors.
pub(crate) fn render(
    scene: &str,
    settings: &Settings,
    plan: Option<FrozenPlan>,
    iterations: u64,
) -> Result<Render, String> {
    let (text, settings) = (scene.to_owned(), settings.clone());
    let (send, receive) = mpsc::channel();
    let id = Arc::new(OnceLock::new());
    let own_id = Arc::clone(&id);
    let thread = std::thread::spawn(move || {
        let render = move || {
            let _ = own_id.set(std::fs::read_link("/proc/thread-self"));
            render_here(&text, settings, plan, iterations)
        };
        let result = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .build()
            .map_err(|error| error.to_string())
            .and_then(|pool| pool.install(render));
        // Nobody listens any more after the limit.
        let _ = send.send(result);
    });
    loop {
        match receive.recv_timeout(LOOK) {
            Ok(result) => return result,
            Err(mpsc::RecvTimeoutError::Timeout) => {
                let id = id.get().and_then(|id| id.as_ref().ok());
                let used = id.and_then(|id| processor::seconds(&Path::new("/proc").join(id)));
                if used.is_some_and(|used| used > LIMIT) {
                    return Err(format!("does not end within {LIMIT} seconds of processor time"));
                }
            }
            Err(mpsc::RecvTimeoutError::Disconnected) => {
                return Err(match thread.join() {
                    Err(panic) => format!("panics: {}", message(&*panic)),
                    Ok(()) => "ends without a result".into(),
                });
            }
        }
    }
}

fn message(panic: &(dyn std::any::Any + Send)) -> String {
    panic
        .downcast_ref::<String>()
        .cloned()
        .or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned()))
        .unwrap_or_default()
}

fn render_here(
    text: &str,
    settings: Settings,
    plan: Option<FrozenPlan>,
    iterations: u64,
) -> Result<Render, String> {
    let start = Instant::now();
    let scene = ReadyScene::from_ron_str(text, "").map_err(|error| format!("refused: {error}"))?;
    let settings = settings.validate().map_err(|error| format!("refused: {error}"))?;
    let mut renderer = match scene.start_renderer(settings, Start { plan, ..Start::default() }) {
        // Where nothing scatters and no light can be hit: rightly so.
        Err(RenderError::NoLight { possible, .. }) if possible.is_empty() => return Ok(Render::black(start)),
        renderer => renderer.map_err(|error| format!("refused: {error}"))?,
    };
    let (mut values, mut before): (Vec<[f64; 3]>, _) = (Vec::new(), [0.0; 3]);
    for n in 1..=iterations {
        renderer.iterate();
        let sum = renderer.film().image().mean().map(|mean| mean * n as f64);
        values.push(std::array::from_fn(|c| sum[c] - before[c]));
        before = sum;
    }
    check_film(renderer.film())?;
    let counters = renderer.report().counters;
    check_counters(&counters)?;
    let rect = renderer.film().rect();
    Ok(Render {
        means: std::array::from_fn(|c| Estimate::of(&values.iter().map(|v| v[c]).collect::<Vec<_>>())),
        counters,
        camera_paths: u64::from(rect.width) * u64::from(rect.height) * iterations,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// No layer has anything that is not finite or negative.
fn check_film(film: &Film) -> Result<(), String> {
    let layers = film.layers().filter_map(|layer| Some((layer.name(), film.layer(layer)?)));
    for (name, image) in layers.chain([("image", film.image())]) {
        for (index, pixel) in image.pixels.iter().enumerate() {
            if !pixel.iter().all(|value| value.is_finite() && *value >= 0.0) {
                return Err(format!("{name}: pixel {index} is {pixel:?}"));
            }
        }
    }
    Ok(())
}

fn check_counters(counters: &Counters) -> Result<(), String> {
    let contributions: u64 = counters.contributions.iter().sum();
    let dropped = counters.dropped as f64 / (contributions + counters.dropped).max(1) as f64;
    if dropped > DROPPED {
        return Err(format!("{} of {contributions} contributions are dropped", counters.dropped));
    }
    let edges = counters.light_edges + counters.camera_edges;
    if counters.lost_walks as f64 > LOST * edges as f64 {
        return Err(format!("{} walks are lost, of {edges} edges", counters.lost_walks));
    }
    Ok(())
}

/// Whether two means differ by more than noise and `slack`, relative to the second.
pub(crate) fn differs(a: &Estimate, b: &Estimate, slack: f64) -> Option<String> {
    // A spread of a few iterations is itself noisy, and the means are rounded.
    let bar = SIGMAS * a.error.hypot(b.error) + (slack + 1e-5) * b.mean.abs();
    let difference = a.mean - b.mean;
    (!(difference.abs() <= bar)).then(|| {
        let percent = 100.0 * difference / b.mean;
        let sigmas = difference / a.error.hypot(b.error);
        format!(
            "{:.6e} ± {:.1e} against {:.6e} ± {:.1e}: {percent:+.3} %, {sigmas:+.1} sigma",
            a.mean, a.error, b.mean, b.error
        )
    })
}

/// Standard errors that two means may differ by.
const SIGMAS: f64 = 5.0;

/// The results of jobs `0..count`, of which `workers` run at a time.
pub fn in_parallel<T: Send>(count: usize, workers: usize, job: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let work = || {
        let take = || Some(next.fetch_add(1, Ordering::Relaxed)).filter(|index| *index < count);
        std::iter::from_fn(take).map(|index| (index, job(index))).collect::<Vec<_>>()
    };
    let mut results: Vec<(usize, T)> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        threads.into_iter().flat_map(|thread| thread.join().expect("jobs do not panic")).collect()
    });
    results.sort_by_key(|(index, _)| *index);
    results.into_iter().map(|(_, result)| result).collect()
}
