//! The report of a render, for people and for scripts.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;
use upbp_estimators::{Counters, PerMerge, Technique};

use crate::auto::technique_support::TechniqueSupport;
use crate::film::{ErrorEstimate, IterationSet};
use crate::plan::Plan;
use crate::state::{ErrorPoint, ErrorSeries, PassSeconds, State};

/// Report of a render. In JSON, numbers that are not finite are `null`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Report {
    /// Version of the renderer.
    pub version: String,
    /// Techniques that the scene can use.
    pub support: TechniqueSupport,
    /// Width and height of what is rendered: of the crop, if there is one.
    pub size: [u32; 2],
    /// Seed of the random numbers.
    pub seed: u64,
    /// Iterations done.
    pub iterations: u64,
    /// Iterations that are on the film: ranges with their ends excluded.
    pub iteration_set: IterationSet,
    /// Iterations of which only some of the pixels are on the film, with their share.
    pub begun: BTreeMap<u64, f64>,
    /// A number of the film's bits: equal for equal films, however they came about.
    pub film_fingerprint: String,
    /// Seconds of rendering by pass.
    pub seconds: PassSeconds,
    /// The setting `deterministic`: whether limits of time and the machine's memory had no influence on the
    /// plan, if the render chose it.
    pub deterministic: bool,
    /// Techniques, sample counts and first radii.
    pub plan: Plan,
    /// Radii of the iteration with the largest index, where the scale of radii is one, scene units; without a
    /// meaning for techniques that the plan does not run.
    pub last_radii: PerMerge<f32>,
    /// Counts over all iterations.
    pub counters: Counters,
    /// Part of the image's mean luminance that each layer holds.
    pub shares: Vec<(&'static str, f64)>,
    /// Largest number of bytes that light vertices, beams and their trees took.
    pub map_bytes: u64,
    /// Bytes that the render was expected to need: the film, and an iteration or the writing of an image.
    pub expected_bytes: u64,
    /// Estimated relMSE of the image, without the bias of kernels and light that no technique finds; `None`
    /// before there are two halves.
    pub estimated_error: Option<ErrorEstimate>,
    /// Estimated error over scales ([`crate::Image::relative_mse_over_scales`]): larger than that of pixels
    /// where neighbours share errors, as blotches and streaks do.
    pub estimated_over_scales: Option<f64>,
    /// Error against a reference over time, if there is one.
    pub series: ErrorSeries,
}

impl State {
    /// A summary of all that was done so far.
    #[must_use]
    pub fn report(&self) -> Report {
        let Self { identity, record, film } = self;
        let last = film.iteration_set().last().unwrap_or(0);
        let radii = identity.plan.radii.kernels(last);
        let error = film.error_map().map(|map| map.estimate());
        Report {
            version: identity.version.clone(),
            support: identity.support.clone(),
            size: [film.rect().width, film.rect().height],
            seed: identity.settings.seed,
            iterations: film.iterations(),
            iteration_set: film.iteration_set().clone(),
            begun: film.begun(),
            film_fingerprint: film.fingerprint(),
            seconds: record.times.seconds(),
            deterministic: identity.settings.deterministic,
            plan: identity.plan,
            last_radii: radii.map(|kernel| kernel.radius()),
            counters: record.counters,
            shares: film.shares().into_iter().map(|(layer, share)| (layer.name(), share)).collect(),
            map_bytes: record.map_bytes,
            expected_bytes: record.expected_bytes,
            estimated_error: error,
            estimated_over_scales: error
                .zip(film.shared_error())
                .map(|(error, ratio)| error.relative_mse * ratio),
            series: record.series.clone(),
        }
    }
}

impl Report {
    /// Sentences about whatever makes the picture wrong; they are part of the text of the report.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let c = &self.counters;
        let edges = c.camera_edges as f64 + c.light_edges as f64;
        let mut warnings = Vec::new();
        if c.cut_walks > 0 {
            warnings.push(format!(
                "light is missing: {} camera sub-paths were ended by the limit of the path length; raise max_length",
                c.cut_walks
            ));
        }
        if c.dropped > 0 {
            warnings.push(format!(
                "{} contributions, sub-paths or pixels were negative or not finite and are left out",
                c.dropped
            ));
        }
        if c.lost_walks > 0 {
            warnings.push(format!(
                "{} walks were lost: they left the scene inside of a body (is a mesh not closed?), or a ray of the \
                 camera or a hit was not finite or not ahead",
                c.lost_walks
            ));
        }
        // Scenes in order have up to a few in 10⁶: rays that only just touch, or meet edges where surfaces
        // cut each other.
        if c.boundary_conflicts as f64 > 1e-5 * edges {
            warnings.push(format!(
                "{} boundaries on {edges:.1e} edges contradict the bodies around them and were ignored: do bodies \
                 almost touch, or does a mesh overlap itself?",
                c.boundary_conflicts
            ));
        }
        warnings
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [width, height] = self.size;
        writeln!(f, "{}\nplan: {}", self.support, self.plan)?;
        let s = &self.seconds;
        write!(f, "{width} x {height}, {} iterations", self.iterations)?;
        for (iteration, share) in &self.begun {
            write!(f, " and {:.0} % of iteration {iteration}", 100.0 * share)?;
        }
        writeln!(
            f,
            " in {:.1} s (preparation {:.1}, light {:.1}, build {:.1}, camera {:.1}, film {:.1})",
            s.total(),
            s.preparation,
            s.light,
            s.build,
            s.camera,
            s.film
        )?;
        let c = &self.counters;
        writeln!(
            f,
            "{} light vertices and {} beams in all, {:.1} MiB at most",
            c.light_vertices,
            c.photon_beams,
            self.map_bytes as f64 / 1_048_576.0
        )?;
        write!(f, "contributions:")?;
        for technique in Technique::ALL {
            let count = c.contributions_of(technique);
            if count > 0 {
                write!(f, " {} {count}", technique.name())?;
            }
        }
        writeln!(f)?;
        write!(f, "shares:")?;
        for (layer, share) in &self.shares {
            write!(f, " {layer} {:.1} %", 100.0 * share)?;
        }
        writeln!(f)?;
        match self.estimated_error {
            Some(error) => {
                write!(f, "estimated relMSE: {error}")?;
                if let Some(over_scales) = self.estimated_over_scales {
                    write!(f, "; over scales {over_scales:.2e}")?;
                }
                writeln!(f)?;
            }
            None => writeln!(f, "estimated relMSE: unknown before there is an even and an odd iteration")?,
        }
        for warning in self.warnings() {
            writeln!(f, "{warning}")?;
        }
        if let Some(last) = self.series.points().last() {
            let ErrorPoint { relative_mse, over_scales, rmse, .. } = last;
            writeln!(
                f,
                "against the reference: relMSE {relative_mse:.3e} ({over_scales:.3e} over scales), RMSE {rmse:.3e}"
            )?;
        }
        Ok(())
    }
}
