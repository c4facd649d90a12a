//! Techniques, counts, kernels and the weights' constants of one iteration.

use glam::Vec3;
use upbp_accel::SearchRadius;
use upbp_media::{Medium, MediumId};

use crate::kernel::Kernel;
use crate::merge_periods::{MergePeriods, rank};
use crate::mis::{BeamExtent, Heuristic, MergeKind, MisPlan, VolumeMerge, VolumeMerges};
use crate::path::Interaction;
use crate::prepared_scene::arrives_in_part;
use crate::radius_field::RadiusField;
use crate::random::{Stream, StreamKind};
use crate::roulette::Roulette;
use crate::scene::Scene;
use crate::technique::{PerMerge, Technique, TechniqueSet};

/// The kernel of each merge.
pub type Kernels = PerMerge<Kernel>;

impl Kernels {
    /// No merges.
    pub const NONE: Self = {
        let none = Kernel::NONE;
        Self { surf: none, pp3d: none, pb2d: none, bp2d: none, bb1d: none }
    };

    /// The kernels that single precision holds wherever a field scales them, [`Kernel::NONE`] instead of the
    /// others.
    fn held_by(self, field: &RadiusField) -> Self {
        let held = |kernel: Kernel| {
            let ends = [field.least(), field.greatest()];
            let is_held = ends.iter().all(|factor| kernel.scaled(*factor).radius() > 0.0);
            if is_held { kernel } else { Kernel::NONE }
        };
        self.map(held)
    }

    /// The least radius of those that merge on surfaces and of those that do in media, scene units; infinite
    /// if none does.
    fn least_radii(&self) -> [f32; 2] {
        let least = |kernels: &[Kernel]| {
            let radii = kernels.iter().map(Kernel::radius);
            radii.filter(|radius| *radius > 0.0).fold(f32::INFINITY, f32::min)
        };
        let Self { surf, pp3d, pb2d, bp2d, bb1d } = *self;
        [least(&[surf]), least(&[pp3d, pb2d, bp2d, bb1d])]
    }
}

/// Path lengths that are rendered: the number of edges between the light and the camera, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathLengths {
    /// Fewest edges; 1 is a light that is seen directly.
    pub min: u32,
    /// Most edges.
    pub max: u32,
}

impl PathLengths {
    /// Whether a path of `edges` edges is rendered.
    #[inline]
    #[must_use]
    pub const fn contains(self, edges: u32) -> bool {
        self.min <= edges && edges <= self.max
    }
}

/// Everything that is fixed during one iteration; weights are exact for it.
#[derive(Clone, Debug, PartialEq)]
pub struct IterationPlan {
    /// Seed of all random streams.
    pub seed: u64,
    /// Index of the iteration.
    pub iteration: u64,
    /// The techniques that run.
    pub techniques: TechniqueSet,
    /// Light sub-paths.
    pub light_paths: u32,
    /// Light sub-paths that leave photon beams.
    pub beam_paths: u32,
    /// Light vertices that each camera vertex is connected to, on average.
    pub connections: f32,
    /// Points on lights that each camera vertex is connected to, on average.
    pub next_events: f32,
    /// Limits of the path length.
    pub lengths: PathLengths,
    /// Russian roulette.
    pub roulette: Roulette,
    /// Kernels with the radii of this iteration, where their scale is one.
    pub kernels: Kernels,
    /// Scale of radii over the scene.
    pub radius_field: RadiusField,
    /// Periods of photon queries.
    pub periods: MergePeriods,
    /// Ranks of the pixels whose turn it is to make them, each below its period.
    pub turns: PerMerge<u32>,
    /// Largest coordinates at which single precision still resolves the smallest kernel, on surfaces and in
    /// media, where the scale of radii is one; infinite without merges.
    pub resolved: [f32; 2],
    /// Counts and volumes for the weights.
    pub mis: MisPlan,
    /// Whether any of the techniques merges.
    pub merges: bool,
    /// Whether camera sub-paths tell the [`Features`](crate::Features) of what they see first.
    pub features: bool,
}

/// The free choices of an [`IterationPlan`].
#[derive(Clone, Debug, PartialEq)]
pub struct IterationChoices {
    /// Seed of all random streams.
    pub seed: u64,
    /// Index of the iteration.
    pub iteration: u64,
    /// The techniques that run.
    pub techniques: TechniqueSet,
    /// Light sub-paths.
    pub light_paths: u32,
    /// Light sub-paths that leave photon beams, at most `light_paths`.
    pub beam_paths: u32,
    /// Light vertices that each camera vertex is connected to, on average: finite, not negative; a fraction
    /// is a probability.
    pub connections: f32,
    /// Points on lights that each camera vertex is connected to, on average: finite, not negative; a fraction
    /// is a probability.
    pub next_events: f32,
    /// Factor of emission hits, next events and connections in the weights (`docs/theory.md`, section 3.4):
    /// finite, positive. Their samples are independent where photons and beams are shared, by the merges of a
    /// camera sub-path and by pixels; one is the plain heuristic.
    pub camera_factor: f32,
    /// Expected number of connectible vertices of a light sub-path. Must be known before the iteration: a
    /// figure of the iteration itself would correlate with its samples.
    pub vertices_per_light_path: f64,
    /// Limits of the path length.
    pub lengths: PathLengths,
    /// Russian roulette.
    pub roulette: Roulette,
    /// Kernels, where the scale of radii is one.
    pub kernels: Kernels,
    /// Scale of radii over the scene.
    pub radius_field: RadiusField,
    /// Most mean free paths that a radius may be in a medium: positive; infinite for no limit. A radius that
    /// coordinates in the medium have digits for is always allowed.
    pub mean_free_paths: VolumeMerges<f32>,
    /// Periods of photon queries.
    pub periods: MergePeriods,
    /// Heuristic of the weights.
    pub heuristic: Heuristic,
    /// Extent of photon beams. All are short if light from infinity arrives in some channels and not in
    /// others.
    pub photon_beams: BeamExtent,
    /// Extent of query beams.
    pub query_beams: BeamExtent,
    /// The probability of each lane to be the hero of a sub-path, if walks run in lanes; they sum to one.
    pub lanes: Option<[f64; 3]>,
    /// Whether camera sub-paths tell the [`Features`](crate::Features) of what they see first.
    pub features: bool,
}

/// The kernels of a technique in a medium.
#[derive(Clone, Copy)]
pub(crate) struct MediumKernels {
    kernel: Kernel,
    greatest_scale: f32,
}

impl MediumKernels {
    /// The kernel where radii have some scale.
    #[inline]
    pub(crate) fn at(&self, scale: f32) -> Kernel {
        self.kernel.scaled(scale.min(self.greatest_scale))
    }

    /// Radii of searches along a ray.
    pub(crate) fn search_radius(&self, field: &RadiusField) -> SearchRadius {
        field.search_radius(self.kernel.radius(), self.greatest_scale)
    }
}

/// No limit on the radii of kernels in media, in mean free paths.
pub const NO_LIMIT: VolumeMerges<f32> = {
    let none = f32::INFINITY;
    VolumeMerges { pp3d: none, pb2d: none, bp2d: none, bb1d: none }
};

/// Least radius of a kernel, relative to the largest coordinate of its place: sixteen roundings. Positions
/// lie on the grid of what single precision can tell apart, and a kernel that holds a few of its nodes finds
/// all photons of one of them, or none.
pub const LEAST_RADIUS: f32 = 16.0 * f32::EPSILON;

/// `(r/ℓ)⁴` of a kernel in a medium, `w` of the factor `1 / (1 + w)` of its merges (`docs/theory.md`, section
/// 6.5): the light changes within a mean free path of a boundary, and a wider kernel averages over that.
/// Where no other technique finds a path, the factor cancels out of the weights.
fn width(kernel: &Kernel, mean_free_path: f32) -> f64 {
    let ratio = f64::from(kernel.radius()) / f64::from(mean_free_path);
    // A host may not know the mean free path.
    if ratio.is_nan() { 0.0 } else { ratio.powi(4) }
}

impl IterationPlan {
    /// Derives the weights' constants, so that counts and what runs cannot disagree.
    #[must_use]
    pub fn new<S: Scene>(scene: &S, choices: &IterationChoices) -> Self {
        let IterationChoices { techniques, light_paths, radius_field, .. } = *choices;
        let of_set = |technique| {
            let known = choices.kernels.get(technique).filter(|_| techniques.has(technique));
            known.copied().unwrap_or(Kernel::NONE)
        };
        let kernels = Kernels::from_fn(of_set).held_by(&radius_field);
        let beam_paths = choices.beam_paths.min(light_paths);
        let periods = choices.periods;
        let on = |technique, value: f64| {
            if techniques.has(technique) { value / f64::from(periods.period(technique)) } else { 0.0 }
        };
        let paths = f64::from(light_paths);
        let beams = f64::from(beam_paths);
        // The two numbers of a photon beam are counted with N_B, all others with N_L (docs/theory.md, section
        // 2.1).
        let merge = |technique: Technique, kernel: &Kernel| {
            let paths = if technique.uses_beams() { beams } else { paths };
            on(technique, paths * kernel.effective_volume())
        };
        let in_medium = |(id, medium): (u32, &S::Medium)| {
            // Twice the least one, so that no rounding of the two makes it too narrow.
            let resolved = 2.0 * LEAST_RADIUS * scene.medium_extent(MediumId(id));
            let mean_free_path = medium.mean_free_path();
            VolumeMerges::from_fn(|technique| {
                let kernel = kernels.get(technique).unwrap_or(&Kernel::NONE);
                let width = width(kernel, mean_free_path);
                let most = *choices.mean_free_paths.get(technique).unwrap_or(&f32::INFINITY);
                let scale = (most * mean_free_path).max(resolved) / kernel.radius();
                // A host may not know the mean free path.
                let is_limited = most.is_finite() && mean_free_path >= 0.0 && scale > 0.0;
                let greatest_scale = if is_limited { scale } else { f32::INFINITY };
                let is_held = kernel.scaled(radius_field.least().min(greatest_scale)).radius() > 0.0;
                let merges = medium.scatters() && is_held;
                let count = if merges { merge(technique, kernel) / (1.0 + width) } else { 0.0 };
                VolumeMerge { count, width, greatest_scale }
            })
        };
        // Expected samples of one connection: draws per vertex over stored vertices per light path.
        let connect = if choices.vertices_per_light_path > 0.0 && light_paths > 0 {
            on(Technique::Connect, f64::from(choices.connections) / choices.vertices_per_light_path)
        } else {
            0.0
        };
        let merges = techniques.iter().any(Technique::merges);
        // Long ones would have to be divided by the probability that the light arrives at all
        // (docs/theory.md, section 2.6).
        let photon_beams = if arrives_in_part(scene) { BeamExtent::Short } else { choices.photon_beams };
        let camera_factor = f64::from(choices.camera_factor);
        let mis = MisPlan {
            heuristic: choices.heuristic,
            hit: on(Technique::Hit, camera_factor),
            nee: on(Technique::Nee, camera_factor * f64::from(choices.next_events)),
            connect: camera_factor * connect,
            light_tracing: on(Technique::LightTracing, paths),
            surf: merge(Technique::Surf, &kernels.surf),
            volume: (0..).zip(scene.media()).map(in_medium).collect(),
            photon_beams,
            query_beams: choices.query_beams,
            lanes: choices.lanes.unwrap_or_default(),
        };
        Self {
            seed: choices.seed,
            iteration: choices.iteration,
            techniques,
            light_paths,
            beam_paths,
            connections: if connect > 0.0 { choices.connections } else { 0.0 },
            next_events: if techniques.has(Technique::Nee) { choices.next_events } else { 0.0 },
            lengths: choices.lengths,
            roulette: choices.roulette,
            kernels,
            // Weights without merges know no radius.
            radius_field: if merges { radius_field } else { RadiusField::Uniform },
            resolved: kernels.least_radii().map(|radius| radius / LEAST_RADIUS),
            periods,
            turns: periods.turns(choices.seed, choices.iteration),
            mis,
            merges,
            features: choices.features,
        }
    }

    /// The iteration with fewer light sub-paths, each of which counts for more, for pilot renders. Weights
    /// stay those of the whole number.
    #[must_use]
    pub fn thinned(&self, light_paths: u32, beam_paths: u32) -> Self {
        let light_paths = light_paths.min(self.light_paths);
        Self { light_paths, beam_paths: beam_paths.min(self.beam_paths).min(light_paths), ..self.clone() }
    }

    /// The iteration with other numbers of light sub-paths, for runs that ask where light goes. Weights stay
    /// those of the whole number, and with fewer light sub-paths kernels are so much wider, within limits,
    /// that photon points are merged as often: what is found is blurred instead of rare.
    #[must_use]
    pub fn blurred(&self, light_paths: u32, beam_paths: u32) -> Self {
        /// The most times that a radius grows.
        const WIDEST: f32 = 10.0;
        let fewer = (self.light_paths as f32 / light_paths.max(1) as f32).max(1.0);
        let [square, cube] = [fewer.sqrt(), fewer.cbrt()].map(|factor| factor.min(WIDEST));
        let Kernels { surf, pp3d, pb2d, bp2d, bb1d } = self.kernels;
        let kernels = Kernels {
            surf: surf.scaled(square),
            pp3d: pp3d.scaled(cube),
            pb2d: pb2d.scaled(square),
            bp2d,
            bb1d,
        };
        Self { light_paths, beam_paths: beam_paths.min(light_paths), kernels, ..self.clone() }
    }

    /// The random numbers of one sub-path of the iteration.
    #[must_use]
    pub fn stream(&self, kind: StreamKind, index: u64) -> Stream {
        Stream::new(self.seed, self.iteration, kind, index)
    }

    /// Whether vertices of light sub-paths are stored, for connections or merges.
    #[must_use]
    pub fn stores_vertices(&self) -> bool {
        self.connections > 0.0 || self.merges_by(Technique::Surf) || self.stores_medium_photons()
    }

    /// Whether photon points in media are stored.
    #[must_use]
    pub fn stores_medium_photons(&self) -> bool {
        self.merges_by(Technique::Pp3d) || self.merges_by(Technique::Pb2d)
    }

    /// Whether photon beams are stored.
    #[must_use]
    pub fn stores_beams(&self) -> bool {
        self.merges_by(Technique::Bp2d) || self.merges_by(Technique::Bb1d)
    }

    /// Whether any camera sub-paths merge by `technique`, anywhere.
    #[must_use]
    pub fn merges_by(&self, technique: Technique) -> bool {
        match technique {
            Technique::Surf => self.mis.surf > 0.0,
            _ => self.mis.volume.iter().any(|merges| merges.get(technique).is_some_and(VolumeMerge::is_on)),
        }
    }

    /// Whether any camera sub-paths merge by `technique` in a medium.
    #[inline]
    #[must_use]
    pub(crate) fn merges_in(&self, medium: MediumId, technique: Technique) -> bool {
        self.mis.merges_in(medium).get(technique).is_some_and(VolumeMerge::is_on)
    }

    /// The techniques of a pixel's camera sub-path: all but those whose photon queries other pixels make.
    #[inline]
    pub(crate) fn techniques_at(&self, pixel: [u32; 2]) -> TechniqueSet {
        if self.periods == MergePeriods::ONE {
            return self.techniques;
        }
        let has_turn = |technique: &Technique| match self.turns.get(*technique) {
            Some(turn) => *turn == rank(pixel, self.periods.period(*technique)),
            None => true,
        };
        self.techniques.iter().filter(has_turn).collect()
    }

    /// The scale of kernel radii at a place, of those in media or of those on surfaces; 0, which is no
    /// merges, where such a kernel would be narrower than [`LEAST_RADIUS`].
    #[inline]
    pub(crate) fn radius_scale(&self, position: Vec3, in_medium: bool) -> f32 {
        let scale = self.radius_field.at(position);
        let resolved = self.resolved[usize::from(in_medium)];
        if position.abs().max_element() <= scale * resolved { scale } else { 0.0 }
    }

    /// The kernels of a technique in a medium.
    #[inline]
    pub(crate) fn kernels_in(&self, medium: MediumId, technique: Technique) -> MediumKernels {
        MediumKernels {
            kernel: *self.kernels.get(technique).unwrap_or(&Kernel::NONE),
            greatest_scale: self
                .mis
                .merges_in(medium)
                .get(technique)
                .map_or(f32::INFINITY, |merge| merge.greatest_scale),
        }
    }

    /// The merges that a path with this sine between its lines takes part in at a vertex, where kernel radii
    /// have some scale.
    #[inline]
    pub(crate) fn merge_kind<B>(&self, vertex: &Interaction<B>, sin_theta: f64, scale: f32) -> MergeKind {
        let scale = f64::from(scale);
        match vertex {
            _ if !self.merges => MergeKind::None,
            Interaction::Surface(_) => MergeKind::Surface { scale },
            Interaction::Medium(medium) => MergeKind::Medium { medium: *medium, sin_theta, scale },
        }
    }

    /// Factor of a photon in a merge: one over the number of light sub-paths, times the period of its
    /// queries.
    #[inline]
    pub(crate) fn per_photon(&self, technique: Technique) -> f32 {
        let paths = if technique.uses_beams() { self.beam_paths } else { self.light_paths };
        self.periods.period(technique) as f32 / paths as f32
    }

    /// The light sub-paths that are traced: all, or none if no technique uses any.
    #[must_use]
    pub fn traced_light_paths(&self) -> u32 {
        if self.needs_light_paths() { self.light_paths } else { 0 }
    }

    /// Whether light sub-paths are of any use.
    #[must_use]
    pub fn needs_light_paths(&self) -> bool {
        self.light_paths > 0
            && (self.mis.light_tracing > 0.0 || self.stores_vertices() || self.stores_beams())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radius_field::FootprintField;

    /// A kernel that is none at some places only would be in the weights there.
    #[test]
    fn kernels_that_a_field_scales_out_of_single_precision_are_none() {
        let field = FootprintField { eye: [0.0; 3], offset: 0.0, slope: 1.0, least: 0.05, most: 3.0 };
        let ball = |radius| Kernels { pp3d: Kernel::ball(radius), ..Kernels::NONE };
        for (radius, is_held) in [(1e-12, false), (1e-11, true), (1e11, true), (1e12, false)] {
            assert!(Kernel::ball(radius).radius() > 0.0, "{radius}: held where the factor is one");
            let kernels = ball(radius).held_by(&RadiusField::Footprint(field));
            assert_eq!(kernels.pp3d.radius() > 0.0, is_held, "{radius}");
            assert_eq!(ball(radius).held_by(&RadiusField::Uniform), ball(radius));
        }
    }
}
