//! Stretches of a ray inside one medium, and the densities that an edge accumulates over its stretches.
//!
//! A walk that leaves a vertex passes segments until it stops inside a segment or reaches a surface.
//! The combination of techniques asks for the density of that event in both directions of walking; both
//! are built here from two numbers per segment, so that no medium has to know of its neighbours.
//!
//! Source: `docs/theory.md`, section 1.3. Oracle: `tests::edge_equals_the_naive_product`.

use glam::Vec3;

use crate::{LaneValues, Spectrum};

/// The half-open interval `[start, end)` of a ray that lies inside one medium.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct RaySegment {
    /// Origin of the ray in scene units.
    pub origin: Vec3,
    /// Direction of the ray, a unit vector.
    pub direction: Vec3,
    /// Distance from `origin` at which the segment begins, in scene units; −∞ for light that has come from
    /// infinity.
    pub start: f32,
    /// Distance from `origin` at which the segment ends, in scene units; may be infinite.
    pub end: f32,
}

impl RaySegment {
    /// Length in scene units, in `[0, ∞]`: zero if the interval is reversed.
    #[inline]
    #[must_use]
    pub const fn length(&self) -> f32 {
        (self.end - self.start).max(0.0)
    }

    /// [`length`](Self::length) without the rounding of a subtraction in single precision.
    ///
    /// Densities use this one: pieces of a split segment then add up to the whole.
    #[inline]
    #[must_use]
    pub const fn length_f64(&self) -> f64 {
        (self.end as f64 - self.start as f64).max(0.0)
    }

    /// The point at `distance` from the origin of the ray.
    #[inline]
    #[must_use]
    pub fn at(&self, distance: f32) -> Vec3 {
        self.origin + distance * self.direction
    }
}

/// Transmittance and sampling densities of one segment, for both directions of walking; densities in each of
/// the [lanes](LaneValues) `L`.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct SegmentDensity<L = f64> {
    /// Transmittance `T` of the segment per channel, in `[0, 1]`.
    pub transmittance: Spectrum,
    /// Probability `S(ℓ)` that a walk passes the segment, in `[0, 1]`. The same in both directions.
    pub pass_probability: L,
    /// Density, per length, that a walk from start to end stops exactly at the end; zero in a medium that
    /// does not scatter.
    pub stop_at_end: L,
    /// Density, per length, that a walk from end to start stops exactly at the start; zero in a medium that
    /// does not scatter.
    pub stop_at_start: L,
}

impl<L: LaneValues> SegmentDensity<L> {
    /// A segment of vacuum: everything passes.
    pub const VACUUM: Self = Self::passing(Spectrum::ONE);

    /// A segment in which no walk ever stops: it only attenuates.
    #[inline]
    #[must_use]
    pub const fn passing(transmittance: Spectrum) -> Self {
        Self::symmetric(transmittance, L::ONE, L::ZERO)
    }

    /// A segment that looks the same from both ends: a walk passes it with the probability
    /// `pass_probability`, and stops at its far end with the density `stop`, per length.
    #[inline]
    #[must_use]
    pub const fn symmetric(transmittance: Spectrum, pass_probability: L, stop: L) -> Self {
        Self { transmittance, pass_probability, stop_at_end: stop, stop_at_start: stop }
    }
}

/// Transmittance and sampling densities of an edge between two vertices: the product over its segments, which
/// are pushed in the order of the forward walk.
///
/// With segments 1..m: `T = Π T_j`, `R = Π S_j`, `stop_at_end = (Π_{j<m} S_j) · p_m` and
/// `stop_at_start = p_1 · Π_{j>1} S_j` (`docs/theory.md`, section 1.3).
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct EdgeDensity<L = f64> {
    /// Transmittance of the edge per channel, in `[0, 1]`.
    pub transmittance: Spectrum,
    /// Probability `R` that a walk passes the whole edge, in `[0, 1]`. The same in both directions.
    pub pass_probability: L,
    /// Density, per length, that the forward walk stops exactly at the end.
    pub stop_at_end: L,
    /// Density, per length, that the backward walk stops exactly at the start.
    pub stop_at_start: L,
    /// Whether a segment was pushed: only the first sets `stop_at_start`.
    started: bool,
}

impl<L: LaneValues> EdgeDensity<L> {
    /// An edge without segments: everything passes, nothing stops.
    pub const EMPTY: Self = Self {
        transmittance: Spectrum::ONE,
        pass_probability: L::ONE,
        stop_at_end: L::ZERO,
        stop_at_start: L::ZERO,
        started: false,
    };

    /// Appends the next segment of the forward walk.
    #[inline]
    pub fn push(&mut self, segment: &SegmentDensity<L>) {
        self.stop_at_end = self.pass_probability.times(segment.stop_at_end);
        self.stop_at_start = if self.started {
            self.stop_at_start.times(segment.pass_probability)
        } else {
            segment.stop_at_start
        };
        self.pass_probability = self.pass_probability.times(segment.pass_probability);
        self.transmittance *= segment.transmittance;
        self.started = true;
    }

    /// Appends a stretch of vacuum.
    ///
    /// It attenuates nothing, but it has to be counted at either end of an edge: a vertex there is not
    /// inside a medium, and the densities of stopping there are zero.
    #[inline]
    pub fn push_vacuum(&mut self) {
        self.stop_at_end = L::ZERO;
        // The start keeps its density: the stretch is passed with probability one, and as the first
        // segment it finds the zero of an empty edge.
        self.started = true;
    }

    /// The edge with one more segment at its end.
    #[inline]
    #[must_use]
    pub fn with(mut self, segment: &SegmentDensity<L>) -> Self {
        self.push(segment);
        self
    }

    /// Distance-sampling density of the forward walk: per length if the end is a vertex in a medium (which
    /// then scatters), the probability to pass if it is on a surface.
    #[inline]
    #[must_use]
    pub const fn forward(&self, end_in_medium: bool) -> L {
        if end_in_medium { self.stop_at_end } else { self.pass_probability }
    }

    /// Distance-sampling density of the backward walk: per length if the start is a vertex in a medium (which
    /// then scatters), the probability to pass if it is on a surface.
    #[inline]
    #[must_use]
    pub const fn backward(&self, start_in_medium: bool) -> L {
        if start_in_medium { self.stop_at_start } else { self.pass_probability }
    }
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;
    use crate::{Homogeneous, Medium, PhaseFunction};

    /// A piece of an edge; `None` is vacuum.
    type Piece = Option<SegmentDensity>;

    fn apart(value: f64, expected: f64) -> f64 {
        if value == expected { 0.0 } else { (value / expected - 1.0).abs() }
    }

    fn edge(pieces: &[Piece]) -> EdgeDensity {
        let mut edge = EdgeDensity::EMPTY;
        for piece in pieces {
            match piece {
                Some(density) => edge.push(density),
                None => edge.push_vacuum(),
            }
        }
        edge
    }

    /// The pieces as a walk from the other end meets them.
    fn reversed(pieces: &[Piece]) -> Vec<Piece> {
        let swap = |density: SegmentDensity| SegmentDensity {
            stop_at_end: density.stop_at_start,
            stop_at_start: density.stop_at_end,
            ..density
        };
        pieces.iter().rev().map(|piece| piece.map(swap)).collect()
    }

    fn pieces() -> impl Strategy<Value = Vec<Piece>> {
        // Densities at the two ends differ, as they do in media that vary along the ray.
        let density = (0.01_f32..1.0, 0.01_f64..1.0, 0.0_f64..5.0, 0.0_f64..5.0).prop_map(
            |(transmittance, pass_probability, stop_at_end, stop_at_start)| SegmentDensity {
                transmittance: Spectrum::new(transmittance, 1.0, 0.5 * transmittance),
                pass_probability,
                stop_at_end,
                stop_at_start,
            },
        );
        vec(proptest::option::weighted(0.8, density), 1..12)
    }

    proptest! {
        #[test]
        fn edge_equals_the_naive_product(pieces in pieces()) {
            let edge = edge(&pieces);
            let densities: Vec<_> =
                pieces.iter().map(|piece| piece.unwrap_or(SegmentDensity::VACUUM)).collect();
            let (first, last) = (densities[0], densities[densities.len() - 1]);
            let pass_probability =
                |range: &[SegmentDensity]| range.iter().map(|s| s.pass_probability).product::<f64>();
            let end = pass_probability(&densities[..densities.len() - 1]) * last.stop_at_end;
            let start = first.stop_at_start * pass_probability(&densities[1..]);
            prop_assert!(apart(edge.pass_probability, pass_probability(&densities)) < 1e-14);
            prop_assert!(apart(edge.forward(true), end) < 1e-14);
            prop_assert!(apart(edge.backward(true), start) < 1e-14);
            prop_assert_eq!(edge.forward(false), edge.pass_probability);
            prop_assert_eq!(edge.backward(false), edge.pass_probability);
            for channel in 0..3 {
                let product: f64 =
                    densities.iter().map(|s| f64::from(s.transmittance[channel])).product();
                prop_assert!(apart(f64::from(edge.transmittance[channel]), product) < 1e-5);
            }
        }

        #[test]
        fn walking_back_swaps_the_two_densities(pieces in pieces()) {
            let (there, back) = (edge(&pieces), edge(&reversed(&pieces)));
            prop_assert!(apart(there.stop_at_end, back.stop_at_start) < 1e-14);
            prop_assert!(apart(there.stop_at_start, back.stop_at_end) < 1e-14);
            prop_assert!(apart(there.pass_probability, back.pass_probability) < 1e-14);
        }

        #[test]
        fn beam_factor_times_density_is_the_probability_to_pass(
            stretches in vec((1e-3_f32..10.0, 1e-3_f32..3.0), 1..8),
        ) {
            let mut edge = EdgeDensity::EMPTY;
            let mut start = 0.0;
            let (mut first_sigma, mut last_sigma) = (0.0, 0.0);
            for &(sigma, length) in &stretches {
                let medium = Homogeneous::new(
                    Spectrum::ZERO, Spectrum::splat(sigma), PhaseFunction::Isotropic,
                ).unwrap();
                let (origin, direction, end) = (Vec3::ZERO, Vec3::X, start + length);
                edge.push(&medium.segment(&RaySegment { origin, direction, start, end }));
                start = end;
                last_sigma = f64::from(sigma);
                if first_sigma == 0.0 { first_sigma = last_sigma; }
            }
            let (short_light, short_camera) =
                (edge.pass_probability / edge.forward(true), edge.pass_probability / edge.backward(true));
            // One channel: the factor is 1/σ at the end that stops the walk, whatever lies between.
            prop_assert!(apart(short_light * last_sigma, 1.0) < 1e-14);
            prop_assert!(apart(short_camera * first_sigma, 1.0) < 1e-14);
        }
    }

    #[test]
    fn an_edge_without_segments_passes() {
        let edge = EdgeDensity::<f64>::EMPTY;
        assert_eq!((edge.pass_probability, edge.transmittance), (1.0, Spectrum::ONE));
        assert_eq!((edge.forward(true), edge.backward(true)), (0.0, 0.0));
    }

    #[test]
    fn one_segment_gives_both_densities() {
        let density = SegmentDensity {
            transmittance: Spectrum::splat(0.5),
            pass_probability: 0.25,
            stop_at_end: 3.0,
            stop_at_start: 7.0,
        };
        let edge = EdgeDensity::EMPTY.with(&density);
        assert_eq!((edge.forward(true), edge.backward(true), edge.pass_probability), (3.0, 7.0, 0.25));
    }

    #[test]
    fn vacuum_at_an_end_forbids_stopping_there() {
        let density = SegmentDensity {
            transmittance: Spectrum::ONE,
            pass_probability: 0.25,
            stop_at_end: 3.0,
            stop_at_start: 7.0,
        };
        let after = edge(&[Some(density), None]);
        assert_eq!((after.forward(true), after.backward(true), after.pass_probability), (0.0, 7.0, 0.25));
        let before = edge(&[None, Some(density)]);
        assert_eq!((before.forward(true), before.backward(true), before.pass_probability), (3.0, 0.0, 0.25));
    }

    #[test]
    fn a_length_is_never_negative_or_not_a_number() {
        let length = |start, end| {
            let segment = RaySegment { origin: Vec3::ZERO, direction: Vec3::Z, start, end };
            (f64::from(segment.length()), segment.length_f64())
        };
        assert_eq!(length(1.0, 3.5), (2.5, 2.5));
        assert_eq!(length(2.0, 1.0), (0.0, 0.0));
        assert_eq!(length(0.0, f32::INFINITY), (f64::INFINITY, f64::INFINITY));
        assert_eq!(length(f32::INFINITY, f32::INFINITY), (0.0, 0.0));
        assert_eq!(length(f32::NAN, 1.0), (0.0, 0.0));
    }
}
