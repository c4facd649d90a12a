//! A view into the walks: every vertex, every accepted sample with its weight, and the calls of techniques.

use glam::{Vec2, Vec3};
use upbp_media::Spectrum;

use crate::mis::{Densities, Weight};
use crate::path::Interaction;
use crate::scene::{CameraRay, EmitterId, EmitterPoint};
use crate::technique::Technique;

/// The light end of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightEnd {
    /// The emitter.
    pub emitter: EmitterId,
    /// The point on it; for an infinite emitter only `direction` counts.
    pub point: EmitterPoint,
    /// Direction of the light that leaves it.
    pub direction: Vec3,
}

/// An interior vertex of a sub-path that has scattered.
#[derive(Clone, Copy, Debug)]
pub struct ObservedVertex<B> {
    /// Edges from the sub-path's end to this vertex.
    pub depth: u32,
    /// Position, scene units.
    pub position: Vec3,
    /// Scattering at the vertex.
    pub interaction: Interaction<B>,
    /// Whether it scattered by a Dirac lobe.
    pub delta: bool,
    /// Probability of the vertex to continue the walk, 1 without roulette.
    pub albedo: f32,
}

/// The way the two sub-paths of a sample are joined.
#[derive(Clone, Copy, Debug)]
pub enum Completion<B> {
    /// The camera sub-path went through a medium that emits.
    Emission,
    /// The camera sub-path reached the light.
    Hit(LightEnd),
    /// A camera vertex and a point on a light.
    Nee {
        /// The light's point.
        light: LightEnd,
        /// The camera vertex.
        camera: (Vec3, Interaction<B>),
    },
    /// A point on a light and the lens.
    Lens {
        /// The light's point.
        light: LightEnd,
        /// The point of the lens.
        lens: Vec3,
        /// Place on the film, in pixels.
        film: Vec2,
    },
    /// A light vertex and a camera vertex.
    Connect {
        /// The light sub-path.
        path: u32,
        /// The light vertex, and its depth.
        light: (Vec3, Interaction<B>, u32),
        /// The camera vertex.
        camera: (Vec3, Interaction<B>),
    },
    /// A light vertex and the lens.
    LightTracing {
        /// The light sub-path.
        path: u32,
        /// The light vertex, and its depth.
        light: (Vec3, Interaction<B>, u32),
        /// The point of the lens.
        lens: Vec3,
        /// Density of the camera ray.
        pdf: f32,
    },
    /// Two vertices within a kernel.
    Merge {
        /// The light sub-path.
        path: u32,
        /// The photon (a point of the beam), and its depth.
        light: (Vec3, u32),
        /// The query point (a point of the beam).
        camera: (Vec3, Interaction<B>),
    },
}

/// An accepted sample.
#[derive(Clone, Copy, Debug)]
pub struct ObservedSample<B, D = f64> {
    /// The technique.
    pub technique: Technique,
    /// Edges of the camera sub-path up to the joint.
    pub camera_depth: u32,
    /// The way the sub-paths are joined.
    pub completion: Completion<B>,
    /// Weight of the technique.
    pub weight: Weight<D>,
    /// Contribution before weighting.
    pub value: Spectrum,
}

/// Receives what the walks do. All methods do nothing by default and then cost nothing, if the type is known.
pub trait Observer<B> {
    /// The type of densities in weights: `f64`, or, to tell techniques apart,
    /// [`ByTechnique`](crate::mis::ByTechnique).
    type Densities: Densities;

    /// A light sub-path starts.
    fn light_end(&mut self, path: u32, end: &LightEnd) {
        let _ = (path, end);
    }

    /// A light sub-path's vertex has scattered.
    fn light_vertex(&mut self, path: u32, vertex: &ObservedVertex<B>) {
        let _ = (path, vertex);
    }

    /// A camera sub-path starts at a place of the film, in pixels.
    fn camera_end(&mut self, film: Vec2, ray: &CameraRay) {
        let _ = (film, ray);
    }

    /// A camera sub-path's vertex has scattered.
    fn camera_vertex(&mut self, vertex: &ObservedVertex<B>) {
        let _ = vertex;
    }

    /// The walk has called a technique: tried one next event, connection or splat, or made one photon query.
    /// `tests` is the number of nodes, leaves and blocks of a tree over photons or beams that a query looked
    /// at, 0 for other calls.
    fn call(&mut self, technique: Technique, tests: u32) {
        let _ = (technique, tests);
    }

    /// A sample was accepted. Samples of light tracing come with the light sub-paths.
    fn sample(&mut self, sample: &ObservedSample<B, Self::Densities>) {
        let _ = sample;
    }
}

/// Any observer, by calls through a table: for those that see a few thousand paths, so that walks are not
/// compiled for each type.
pub type DynObserver<'a, B, D = f64> = dyn Observer<B, Densities = D> + 'a;

/// An observer that sees nothing and costs nothing: for renders.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoObserver;

impl<B> Observer<B> for NoObserver {
    type Densities = f64;
}
