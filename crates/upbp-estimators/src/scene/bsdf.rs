//! Scattering of light by surfaces.

use glam::Vec3;
use upbp_media::Spectrum;

/// Direction in which a path is walked: this decides on which side of a surface the light is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Walk {
    /// From an emitter: the walk carries flux, and arrives at a vertex from the light's side.
    Light,
    /// From the camera: the walk carries importance, and arrives at a vertex from the camera's side.
    Camera,
}

impl Walk {
    /// The walk from the other end.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::Light => Self::Camera,
            Self::Camera => Self::Light,
        }
    }
}

/// The refractive indices on the two sides of a surface where a path meets it.
///
/// They follow from the bodies that the path is in (`docs/theory.md`, section 1.7), so that a glass in
/// water refracts as a glass in water; a material knows only what it is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interface {
    /// Index on the side that the normal points to (+z in local coordinates).
    pub above: f32,
    /// Index on the other side (−z).
    pub below: f32,
}

impl Interface {
    /// A surface with the same index on both sides.
    pub const MATCHED: Self = Self { above: 1.0, below: 1.0 };

    /// The interface as seen with the normal on the other side: the indices change places.
    #[must_use]
    pub const fn turned(self) -> Self {
        Self { above: self.below, below: self.above }
    }
}

/// A direction drawn by [`Bsdf::sample`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// The new direction, local, pointing away from the surface, a unit vector.
    pub to: Vec3,
    /// The factor for the throughput. Smooth lobe: `eval · |to.z| / pdf`. Dirac lobe: reflectance or
    /// transmittance over `pdf`, and on [`Walk::Camera`] times `(η_from / η_to)²` at a transmission, because
    /// radiance is compressed where flux is not (`docs/theory.md`, section 1.6).
    pub weight: Spectrum,
    /// Smooth lobe: [`Bsdf::pdf`] of this direction, sr⁻¹. Dirac lobe: the discrete probability of it.
    pub pdf: f32,
    /// Density or probability of the reversed event: arriving from `to` and leaving towards `from`.
    pub pdf_reverse: f32,
    /// Whether the lobe is a Dirac: mirror reflection or refraction at a smooth surface.
    pub delta: bool,
}

/// A pair of directions of smooth lobes, looked at by [`Bsdf::evaluate`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfEvaluation {
    /// [`Bsdf::eval`], with the light on the side where the walk has it.
    pub value: Spectrum,
    /// [`Bsdf::pdf`] of the walk.
    pub pdf: f32,
    /// [`Bsdf::pdf`] of a walk the other way.
    pub pdf_reverse: f32,
    /// [`Bsdf::continuation`] of the walk.
    pub continuation: f32,
    /// [`Bsdf::continuation`] of a walk the other way.
    pub continuation_reverse: f32,
}

/// The scattering of a surface at one point.
///
/// A value of this type is what remains of a material after textures are looked up: it is copied into every
/// light vertex, so it should be small. All directions are local, z along the shading normal, and point
/// **away** from the surface. The walks turn world directions into local ones, reject those on which the
/// geometric and the shading normal disagree, and apply the adjoint correction for shading normals.
///
/// Contract, checked by [`check_bsdf`](crate::check::check_bsdf): values and densities are finite and not
/// negative; `pdf` is the density of `sample` and integrates to at most one over the sphere of directions;
/// `sample` agrees with `eval` and `pdf`; nothing depends on which thread asks.
pub trait Bsdf: Copy + Send + Sync {
    /// Value of the smooth lobes, sr⁻¹, without a cosine: radiance scattered `towards_camera` per irradiance
    /// that arrives from `towards_light`. Includes the compression of radiance at a rough refraction, hence
    /// is not symmetric there: `f(l, c) / η_c² = f(c, l) / η_l²`.
    fn eval(&self, towards_light: Vec3, towards_camera: Vec3, interface: Interface) -> Spectrum;

    /// Density, sr⁻¹, with which [`sample`](Self::sample) chooses `to` by a smooth lobe after arriving from
    /// `from`, the choice of the lobe included.
    fn pdf(&self, from: Vec3, to: Vec3, interface: Interface) -> f32;

    /// Draws a direction after arriving from `from`. `None`: nothing is scattered.
    /// `u_lobe` and `u` are uniform in `[0, 1)`.
    fn sample(
        &self,
        from: Vec3,
        walk: Walk,
        interface: Interface,
        u_lobe: f32,
        u: [f32; 2],
    ) -> Option<BsdfSample>;

    /// All that a walk asks about leaving to `to` after arriving from `from`; `None` if [`eval`](Self::eval)
    /// is black.
    ///
    /// A host with several kinds of surfaces overrides it to tell them apart once instead of five times.
    #[inline]
    fn evaluate(&self, from: Vec3, to: Vec3, walk: Walk, interface: Interface) -> Option<BsdfEvaluation> {
        let value = match walk {
            Walk::Camera => self.eval(to, from, interface),
            Walk::Light => self.eval(from, to, interface),
        };
        (!value.is_black()).then(|| BsdfEvaluation {
            value,
            pdf: self.pdf(from, to, interface),
            pdf_reverse: self.pdf(to, from, interface),
            continuation: self.continuation(from),
            continuation_reverse: self.continuation(to),
        })
    }

    /// Whether there is a smooth lobe, so that paths can be connected and merged here.
    fn is_connectible(&self) -> bool;

    /// Probability in `(0, 1]` to continue a walk that arrives from `from`: local Russian roulette. It may
    /// depend on nothing but the point and `from`, since the walk of the other side has to know it.
    ///
    /// Tell the albedo. With the default, one, walks in a closed scene go on until nothing is left of them,
    /// over hundreds of vertices.
    fn continuation(&self, from: Vec3) -> f32 {
        let _ = from;
        1.0
    }

    /// Share of the light from `from` that is scattered, by channel in `[0, 1]`: for denoisers. No estimate
    /// of light depends on it. By default grey, the probability to continue.
    fn albedo(&self, from: Vec3) -> Spectrum {
        Spectrum::splat(self.continuation(from))
    }
}
