//! The contract of a participating medium.

use std::sync::Arc;

use glam::Vec3;

use crate::{PhaseFunction, RaySegment, SegmentDensity, Spectrum};

/// A participating medium: transmittance, emission and sampled distances along stretches of rays.
///
/// The densities that [`segment`](Self::segment) reports are those of
/// [`sample_distance`](Self::sample_distance), whichever channel was drawn and whichever way the walk
/// goes. The estimators rest on this:
///
/// - `∫₀^ℓ p(t) dt + S(ℓ) = 1` on every segment: a walk stops somewhere or passes;
/// - `p(t) > 0` wherever the medium scatters light that arrives there, in any channel: no walk finds it
///   otherwise;
/// - neither depends on the throughput of the path, since the density must be computable from the other
///   end as well.
///
/// The transmittance of a segment is the product over its pieces; its probability to pass need not be, since
/// a mixture of channels draws anew on each piece. A density is therefore that of a walk only if it is
/// computed from the segments that the walk took, cut where the walk cut them.
///
/// A medium that does not scatter is never sampled: its segments are passed with probability one and
/// only attenuate. Coefficients and densities per length are in inverse scene units. Methods are called
/// from many threads at once and must give the same bits for the same arguments.
///
/// # Path-level lanes
///
/// A walk through media whose channels differ, in extinction or phase function, draws all its distances and
/// directions from the lane of one channel (`docs/theory.md`, section 6.13). A medium offers lanes by
/// [`lane_extinctions`](Self::lane_extinctions), [`segment_lanes`](Self::segment_lanes) and
/// [`sample_lane`](Self::sample_lane). The lane of channel `c` should pass at least the light that the
/// channel passes, `S_c ≥ T_c`, and stop at least where it scatters, `p_c ≥ σ_s,c T_c`: with the exponential
/// of the channel, `S_c = T_c` and `p_c = σ_t,c T_c`. That holds along any ray if the extinction varies in
/// space, as long as distances are sampled without bias. In a medium that says nothing, all three lanes are
/// the distribution of `segment` and `sample_distance`.
///
/// # Example
///
/// Ground fog, whose density falls exponentially with the height, in closed form. A host's own tests would
/// call `upbp_estimators::check::check_medium` as well.
///
/// ```
/// use upbp_media::glam::Vec3;
/// use upbp_media::{Medium, PhaseFunction, RaySegment, SegmentDensity, Spectrum};
///
/// /// Grey fog of extinction `exp(-y)`, of which the share `albedo` is scattered.
/// struct GroundFog {
///     albedo: f32,
/// }
///
/// impl GroundFog {
///     fn extinction(position: Vec3) -> f64 {
///         f64::from(-position.y).exp()
///     }
/// }
///
/// impl Medium for GroundFog {
///     fn scatters(&self) -> bool {
///         self.albedo > 0.0
///     }
///
///     fn segment(&self, segment: &RaySegment) -> SegmentDensity {
///         let slope = f64::from(segment.direction.y);
///         let at_start = Self::extinction(segment.at(segment.start));
///         let length = segment.length_f64();
///         let depth = at_start * if slope == 0.0 { length } else { -(-slope * length).exp_m1() / slope };
///         let passing = (-depth).exp();
///         let transmittance = Spectrum::splat(passing as f32);
///         if !self.scatters() {
///             return SegmentDensity::passing(transmittance);
///         }
///         SegmentDensity {
///             transmittance,
///             pass_probability: passing,
///             stop_at_end: Self::extinction(segment.at(segment.end)) * passing,
///             stop_at_start: at_start * passing,
///         }
///     }
///
///     fn sample_distance(&self, segment: &RaySegment, _channel: f32, u_distance: f32) -> Option<f32> {
///         let slope = f64::from(segment.direction.y);
///         let depth = -f64::ln_1p(-f64::from(u_distance)) / Self::extinction(segment.at(segment.start));
///         // Not a number where the fog thins out before it is that deep.
///         let length = if slope == 0.0 { depth } else { -f64::ln_1p(-slope * depth) / slope };
///         let stop = (f64::from(segment.start) + length) as f32;
///         (self.scatters() && stop < segment.end).then_some(stop)
///     }
///
///     fn sigma_s(&self, position: Vec3) -> Spectrum {
///         self.albedo * self.sigma_t(position)
///     }
///
///     fn sigma_t(&self, position: Vec3) -> Spectrum {
///         Spectrum::splat(Self::extinction(position) as f32)
///     }
///
///     fn phase(&self) -> &PhaseFunction {
///         &PhaseFunction::Isotropic
///     }
///
///     fn continuation(&self, _position: Vec3) -> f32 {
///         self.albedo
///     }
///
///     fn mean_free_path(&self) -> f32 {
///         1.0
///     }
/// }
///
/// let fog = GroundFog { albedo: 0.9 };
/// let up = RaySegment { origin: Vec3::ZERO, direction: Vec3::new(0.6, 0.8, 0.0), start: 0.0, end: 2.0 };
/// // A walk stops somewhere or passes: the density of stopping and the probability to pass add up to one.
/// let stops: f64 = (0..1000)
///     .map(|i| fog.segment(&RaySegment { end: 0.002 * (i as f32 + 0.5), ..up }).stop_at_end * 0.002)
///     .sum();
/// assert!((stops + fog.segment(&up).pass_probability - 1.0).abs() < 1e-6);
/// // Half of the walks stop before the median distance.
/// let median = fog.sample_distance(&up, 0.0, 0.5).expect("less than half of the walks pass");
/// assert!((fog.segment(&RaySegment { end: median, ..up }).pass_probability - 0.5).abs() < 1e-6);
/// // Walks in the other direction start in thinner fog.
/// let density = fog.segment(&up);
/// assert!(density.stop_at_start > density.stop_at_end);
/// ```
///
/// `Box<dyn Medium>` and `Arc<dyn Medium>` are media, too, for scenes with media of several types.
///
/// Source: `docs/theory.md`, sections 1.3 and 1.4.
pub trait Medium: Send + Sync {
    /// Whether the medium scatters light. If not, no walk ever stops in it.
    fn scatters(&self) -> bool;

    /// Transmittance of one segment, and the densities of walks to pass it or to stop at its ends.
    fn segment(&self, segment: &RaySegment) -> SegmentDensity;

    /// Draws the distance from the ray's origin, in scene units and in `[start, end)`, at which a walk from
    /// start to end stops; `None` if it passes the segment.
    ///
    /// `u_channel` and `u_distance` are uniform in `[0, 1)`. With `u_distance = 0` a walk may stop
    /// exactly at the start.
    ///
    /// The end may be infinite, even in a medium that fills a finite body: the walks ask before they know
    /// where the body ends. Up to rounding the distance must not depend on the end, but for the `None` of one
    /// that is not reached.
    fn sample_distance(&self, segment: &RaySegment, u_channel: f32, u_distance: f32) -> Option<f32>;

    /// The extinction with which the lane of each channel draws distances, in inverse scene units, 0 for a
    /// lane that always passes. `None` if the medium has no lanes of its own: then all three are equal.
    ///
    /// Tells with the [phase function](Self::phase) which lanes are equal, and how much they differ. Equal
    /// numbers promise lanes that are equal on every segment, of which walks draw only one. Where the
    /// extinction varies in space, numbers of its size do, its largest values for instance, as long as those
    /// of lanes that differ anywhere are not equal.
    fn lane_extinctions(&self) -> Option<Spectrum> {
        None
    }

    /// The largest factor, over the channels and over lengths, by which the second moment of a walk grows on
    /// a segment, which it passes or stops and scatters in, if distances are drawn by
    /// [`sample_distance`](Self::sample_distance) and directions by [`PhaseFunction::sample`], roulette by
    /// [`continuation`](Self::continuation) included (`docs/theory.md`, section 6.13). At least one, that of
    /// a segment without a length. If it is one, walks need no lanes, however long they are. The default,
    /// infinity, is for media of which it is unknown.
    fn mixture_growth(&self) -> f64 {
        f64::INFINITY
    }

    /// Transmittance and densities of a [`segment`](Self::segment), the densities for walks in each lane.
    fn segment_lanes(&self, segment: &RaySegment) -> SegmentDensity<[f64; 3]> {
        let SegmentDensity { transmittance, pass_probability, stop_at_end, stop_at_start } =
            self.segment(segment);
        SegmentDensity {
            transmittance,
            pass_probability: [pass_probability; 3],
            stop_at_end: [stop_at_end; 3],
            stop_at_start: [stop_at_start; 3],
        }
    }

    /// Distance of a walk in one lane, as [`sample_distance`](Self::sample_distance) samples it.
    ///
    /// `u` are two uniform numbers in `[0, 1)`; the second decides, the first is there for media that need
    /// another, or more digits.
    fn sample_lane(&self, segment: &RaySegment, lane: usize, u: [f32; 2]) -> Option<f32> {
        let _ = lane;
        self.sample_distance(segment, u[0], u[1])
    }

    /// Scattering coefficient at `position`, in inverse scene units.
    fn sigma_s(&self, position: Vec3) -> Spectrum;

    /// Extinction coefficient at `position`, in inverse scene units: absorption plus scattering.
    fn sigma_t(&self, position: Vec3) -> Spectrum;

    /// The phase function, the same everywhere in the medium.
    fn phase(&self) -> &PhaseFunction;

    /// Whether the medium emits light. If not, [`emitted`](Self::emitted) is black.
    fn emits(&self) -> bool {
        false
    }

    /// Radiance that the medium inside the segment emits towards `start`: `∫ T(start, t) j dt` with the
    /// [source](Self::source) j, in W m⁻² sr⁻¹.
    fn emitted(&self, segment: &RaySegment) -> Spectrum {
        let _ = segment;
        Spectrum::ZERO
    }

    /// Radiance that the medium emits per length at `position`, in W m⁻² sr⁻¹ per scene unit, the same in all
    /// directions: `σ_a L_e` where it emits what it absorbs.
    ///
    /// Needed only where light sub-paths start in the medium, in a body that is an emitter: the light that
    /// rays meet is [`emitted`](Self::emitted).
    fn source(&self, position: Vec3) -> Spectrum {
        let _ = position;
        Spectrum::ZERO
    }

    /// Draws the distance from the ray's origin, in `[start, end)`, of a point whose light is looked at;
    /// `None` if nothing is seen. `u` is uniform in `[0, 1)`.
    ///
    /// Good in proportion to the light that it sends to `start`; the default is uniform, and sees nothing of
    /// a segment without an end, as no body has.
    fn sample_emitted(&self, segment: &RaySegment, u: f32) -> Option<f32> {
        let length = segment.length();
        (length > 0.0 && length.is_finite())
            .then(|| (segment.start + u * length).min(segment.end.next_down()))
    }

    /// Density, per length, of [`sample_emitted`](Self::sample_emitted) at `distance`: positive wherever the
    /// [source](Self::source) is.
    fn pdf_emitted(&self, segment: &RaySegment, distance: f32) -> f64 {
        let _ = distance;
        1.0 / segment.length_f64()
    }

    /// Probability in `(0, 1]` that a walk goes on after a collision at `position`.
    ///
    /// Depends on the position alone, so that both directions of walking agree on it.
    fn continuation(&self, position: Vec3) -> f32;

    /// One over the mean extinction, in scene units; infinite without extinction. For heuristics: it steers
    /// the weights of techniques, never their sum, bounds automatic radii of kernels in the medium, and how
    /// near to a boundary walks stop.
    fn mean_free_path(&self) -> f32;
}

/// Media behind a pointer, so that a scene may have media of several types: all methods are passed on.
macro_rules! passed_on {
    ($($pointer:ty),*) => {$(
        impl<M: Medium + ?Sized> Medium for $pointer {
            passed_on! { methods:
                scatters() -> bool;
                segment(segment: &RaySegment) -> SegmentDensity;
                sample_distance(segment: &RaySegment, u_channel: f32, u_distance: f32) -> Option<f32>;
                lane_extinctions() -> Option<Spectrum>;
                mixture_growth() -> f64;
                segment_lanes(segment: &RaySegment) -> SegmentDensity<[f64; 3]>;
                sample_lane(segment: &RaySegment, lane: usize, u: [f32; 2]) -> Option<f32>;
                sigma_s(position: Vec3) -> Spectrum;
                sigma_t(position: Vec3) -> Spectrum;
                phase() -> &PhaseFunction;
                emits() -> bool;
                emitted(segment: &RaySegment) -> Spectrum;
                source(position: Vec3) -> Spectrum;
                sample_emitted(segment: &RaySegment, u: f32) -> Option<f32>;
                pdf_emitted(segment: &RaySegment, distance: f32) -> f64;
                continuation(position: Vec3) -> f32;
                mean_free_path() -> f32;
            }
        }
    )*};
    (methods: $($name:ident($($argument:ident: $type:ty),*) -> $result:ty;)*) => {$(
        #[inline]
        fn $name(&self, $($argument: $type),*) -> $result {
            (**self).$name($($argument),*)
        }
    )*};
}

passed_on!(&M, Box<M>, Arc<M>);
