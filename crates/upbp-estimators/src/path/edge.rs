//! Edges: the way of a ray from a vertex to the next surface, as a list of stretches inside one medium each,
//! and the distance at which a walk stops.
//!
//! Index-matched boundaries are not vertices: they cut an edge into segments (`docs/theory.md`, section 1.7).
//! In a dense medium a walk stops long before the next surface, so the distance is drawn first and the ray is
//! followed no farther, unless somebody needs all of it.

use glam::Vec3;
use upbp_accel::Ray;
use upbp_media::{BodyId, EdgeDensity, Lanes, Medium, MediumId, MediumStack, RaySegment};

use super::crossing::{correction, correction_of_escape, cross_all, is_surface, may_correct};
use super::interaction::MediumInterface;
use super::walk_state::WalkState;
use crate::iteration::IterationPlan;
use crate::mis::BeamExtent;
use crate::random::Stream;
use crate::scene::{Crossing, Hit, MAX_CROSSINGS, Scene};
use crate::technique::Technique;

/// Distance along a ray that must be known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// To the next surface: long beams, emission along the ray, media in which rounding matters.
    ToSurface,
    /// Until the walk stops: what lies behind is unknown.
    ToStop,
}

/// A stretch of an edge inside one medium.
#[derive(Clone, Copy, Debug)]
pub struct MediumSpan<L = f64> {
    /// Distance along the ray where it begins, scene units; −∞ for light that has come from infinity.
    pub start: f32,
    /// Distance along the ray where it ends; may be infinite.
    pub end: f32,
    /// The medium, `None` for vacuum.
    pub medium: Option<MediumId>,
    /// Densities of the edge up to `start`.
    pub before: EdgeDensity<L>,
    /// Number of the ray's crossings before it.
    crossings: usize,
}

impl<L> MediumSpan<L> {
    /// The medium itself, of the scene that the edge was traced in; `None` for vacuum.
    #[inline]
    pub(crate) fn medium_in<'s, S: Scene>(&self, scene: &'s S) -> Option<&'s S::Medium> {
        self.medium.map(|medium| &scene.media()[medium.0 as usize])
    }
}

/// A ray from a vertex to the next surface that scatters, to infinity, or to where the walk stops in a
/// medium. Its densities are those of each of the [`Lanes`] `L`.
#[derive(Debug)]
pub struct EdgeTrace<B, L: Lanes = f64> {
    /// The ray; the edge begins at its lower end.
    pub ray: Ray,
    /// Stretches in order, adjoining, from the ray's lower end to the surface or to infinity. With
    /// [`Extent::ToStop`] the one in which the walk stops is the last, and its end means nothing.
    pub spans: Vec<MediumSpan<L>>,
    /// Stop of the walk in a medium: index of the stretch and distance along the ray.
    pub stop: Option<(usize, f32)>,
    /// The surface; with [`Extent::ToStop`] only if the walk gets there.
    pub hit: Option<Hit<B>>,
    /// The bodies at the start.
    start: MediumStack,
    /// The bodies at the end, around the stop or before the surface, if the ray has crossed a boundary.
    end: MediumStack,
    /// The bodies behind the surface, if it bounds one.
    behind: MediumStack,
    crossings: Vec<Crossing>,
    found: Vec<Crossing>,
    /// Boundaries that contradicted the bodies that the ray was thought to be in, since they were last taken.
    conflicts: u64,
    /// Whether the ray met what cannot be, or more than can be followed.
    lost: bool,
}

/// The medium inside of the bodies of `stack`. One that the scene does not have is vacuum: a broken contract,
/// which [`check_scene`](crate::check::check_scene) finds.
pub(crate) fn medium_of<S: Scene>(scene: &S, stack: &MediumStack) -> Option<MediumId> {
    stack.medium().filter(|medium| (medium.0 as usize) < scene.media().len())
}

/// Appends the stretch of `ray` from `start` to `end`, in a medium or in vacuum, to the densities of an edge.
#[inline]
pub(crate) fn push_stretch<S: Scene, L: Lanes>(
    scene: &S,
    density: &mut EdgeDensity<L>,
    ray: &Ray,
    medium: Option<MediumId>,
    start: f32,
    end: f32,
) {
    match medium {
        Some(medium) => {
            let segment = RaySegment { origin: ray.origin, direction: ray.direction, start, end };
            density.push(&L::segment(&scene.media()[medium.0 as usize], &segment));
        }
        None => density.push_vacuum(),
    }
}

/// Distance that stops of walks keep from boundaries and surfaces, lest they come out beyond them, in
/// roundings of the largest coordinate. What coincides is nearer to each other than this.
const ROUNDINGS: f32 = 64.0;
/// The part of a mean free path that a stop is moved by at most.
const MOST_OF_FREE_PATH: f32 = 1.0 / 128.0;

/// The decision where a walk stops, while it is followed.
struct FreeFlight<'a, L: Lanes> {
    extent: Extent,
    /// The lane that distances are drawn from.
    hero: L::Hero,
    stream: &'a mut Stream,
    /// The random numbers that decide in the current stretch.
    decision: Option<[f32; 2]>,
    /// Distance where the walk stops if the current medium goes on; infinite if it never does, or if that is
    /// not known yet, where the ray is followed to the surface anyway.
    stop: f32,
    /// The largest coordinate of the ray's origin, without its sign.
    largest_coordinate: f32,
}

impl<L: Lanes> FreeFlight<'_, L> {
    /// Distance to which the ray has to be followed if the current medium goes on: to all that the stop has
    /// to keep off.
    fn max_distance(&self) -> f32 {
        self.stop + 2.0 * self.inset(self.stop)
    }

    /// Distance that a stop at distance `t` keeps from boundaries.
    fn inset(&self, t: f32) -> f32 {
        ROUNDINGS * f32::EPSILON * (self.largest_coordinate + t)
    }

    /// The stop at distance `t`, moved away from the boundaries next to it; at distance 0 there is none.
    fn stop_between<M: Medium>(&self, [before, behind]: [f32; 2], t: f32, medium: &M) -> f32 {
        let inset = self.inset(t);
        if (before == 0.0 || t - before > inset) && behind - t > inset {
            return t;
        }
        let inset = inset.min(MOST_OF_FREE_PATH * medium.mean_free_path());
        let least = if before == 0.0 { t.min(0.5 * behind) } else { before + inset };
        let most = behind - inset;
        let middle = 0.5 * (before + behind);
        if least < most { t.clamp(least, most) } else { middle.min(behind.next_down()).max(before) }
    }
}

impl<B: Copy, L: Lanes> EdgeTrace<B, L> {
    /// Follows `ray`, whose origin lies in the bodies of `stack` but for rounding (a boundary that
    /// contradicts them corrects them), and draws where the walk stops.
    ///
    /// The way begins at the ray's lower end: 0, or −∞ for light that has come from infinity to the origin,
    /// through the medium around everything without a stop. It does not stop in its first stretch, then. The
    /// ray's upper end does not count.
    pub fn trace<S: Scene<Bsdf = B>>(
        &mut self,
        scene: &S,
        ray: &Ray,
        stack: &MediumStack,
        extent: Extent,
        state: &mut WalkState<L>,
    ) {
        self.ray = *ray;
        self.start.clone_from(stack);
        self.crossings.clear();
        self.lost = false;
        let mut corrections = 0;
        while let Some(correction) = self.follow(scene, extent, state, corrections) {
            self.conflicts += 1;
            if !may_correct(corrections) {
                self.lose();
                return;
            }
            self.crossings.truncate(corrections);
            self.crossings.push(correction);
            corrections += 1;
        }
        if let Some((span, t)) = self.stop
            && !self.crossings.is_empty()
        {
            self.end = self.stack_in(&self.spans[span], t);
        }
    }

    /// The bodies behind the last crossing so far. Most rays have none, and copy no list.
    #[inline]
    fn bodies(&self) -> &MediumStack {
        if self.crossings.is_empty() { &self.start } else { &self.end }
    }

    /// Gives the ray up: there is nothing on it.
    fn lose(&mut self) {
        self.spans.clear();
        self.stop = None;
        self.hit = None;
        self.lost = true;
    }

    /// Whether nothing is known of the ray, since the scene's answers cannot be true.
    #[must_use]
    pub(crate) const fn is_lost(&self) -> bool {
        self.lost
    }

    /// Follows the ray, after the first crossings, which are corrections. Ends with another one if there must
    /// be.
    fn follow<S: Scene<Bsdf = B>>(
        &mut self,
        scene: &S,
        extent: Extent,
        state: &mut WalkState<L>,
        corrections: usize,
    ) -> Option<Crossing> {
        self.spans.clear();
        self.stop = None;
        self.hit = None;
        let mut flight = FreeFlight::<L> {
            extent,
            hero: state.hero,
            stream: &mut state.stream,
            decision: None,
            stop: f32::INFINITY,
            largest_coordinate: self.ray.origin.abs().max_element(),
        };
        let medium = medium_of(scene, &self.start);
        let start = self.ray.t_min;
        let mut span = MediumSpan { start, end: start, medium, before: EdgeDensity::EMPTY, crossings: 0 };
        self.enter(scene, &span, &mut flight);
        if (1..=corrections).any(|i| self.cross(scene, &mut span, &mut flight, i, i < corrections)) {
            return None;
        }
        let mut ray = self.ray.with_range(0.0, flight.max_distance());
        loop {
            self.found.clear();
            let hit = scene.trace(&ray, &mut self.found);
            // What breaks the contract may come again and again.
            let is_sound = hit.as_ref().is_none_or(|hit| hit.is_sound(ray.t_min));
            if !is_sound || self.crossings.len() + self.found.len() >= MAX_CROSSINGS {
                self.lose();
                return None;
            }
            let known = hit.as_ref().map_or(ray.t_max, |hit| hit.t);
            let boundary = hit.as_ref().and_then(|hit| hit.crossing(self.ray.direction));
            // What coincides with the surface of a body counts together with it.
            let before = match boundary {
                Some(_) => self.found.partition_point(|crossing| crossing.t < known),
                None => self.found.len(),
            };
            for i in 0..before {
                if self.found[i].t > flight.max_distance() {
                    break;
                }
                let correction = correction(self.bodies(), &self.found[i..=i], &self.crossings);
                if correction.is_some() {
                    return correction;
                }
                self.crossings.push(self.found[i]);
                let more = i + 1 < before && self.found[i + 1].t == self.found[i].t;
                if self.cross(scene, &mut span, &mut flight, self.crossings.len(), more) {
                    return None;
                }
            }
            if let Some(hit) = hit
                && known <= flight.max_distance()
            {
                if let Some(boundary) = boundary {
                    let correction = self.look_behind(before, boundary);
                    if correction.is_some() {
                        return correction;
                    }
                }
                if boundary.is_none_or(|boundary| is_surface(self.bodies(), &self.behind, &boundary)) {
                    if !self.close(scene, &mut span, &flight, known) {
                        self.hit = Some(hit);
                    }
                    return None;
                }
                for i in before..self.found.len() {
                    self.crossings.push(self.found[i]);
                    let more = i + 1 < self.found.len();
                    if self.cross(scene, &mut span, &mut flight, self.crossings.len(), more) {
                        return None;
                    }
                }
                ray.t_min = known * (1.0 + 4.0 * f32::EPSILON) + f32::MIN_POSITIVE;
            } else if flight.max_distance() <= known {
                let escapes = flight.max_distance() == f32::INFINITY;
                let correction = escapes.then(|| correction_of_escape(self.bodies(), &self.crossings));
                if correction.flatten().is_none() {
                    self.close(scene, &mut span, &flight, f32::INFINITY);
                }
                return correction.flatten();
            } else {
                // The medium has become thinner. A boundary at the end of what is known is still to come.
                ray.t_min = known.next_down();
            }
            ray.t_max = flight.max_distance();
        }
    }

    /// Puts `boundary` among what was found at its distance, from the one `before` on, and tells which bodies
    /// are behind all of that; or the correction that there must be first.
    #[inline]
    fn look_behind(&mut self, before: usize, boundary: Crossing) -> Option<Crossing> {
        // Into a body before out of one, as all crossings at a distance.
        let place = if boundary.entering { before } else { self.found.len() };
        self.found.insert(place, boundary);
        let place = &self.found[before..];
        let correction = correction(self.bodies(), place, &self.crossings);
        if correction.is_none() {
            let Self { crossings, start, end, behind, .. } = self;
            behind.clone_from(if crossings.is_empty() { start } else { end });
            cross_all(behind, place);
        }
        correction
    }

    /// Begins `span`: draws the distance in its medium.
    #[inline]
    fn enter<S: Scene<Bsdf = B>>(&self, scene: &S, span: &MediumSpan<L>, flight: &mut FreeFlight<'_, L>) {
        flight.stop = f32::INFINITY;
        if self.stop.is_some() || span.start == f32::NEG_INFINITY {
            return;
        }
        let Some(medium) = span.medium_in(scene) else { return };
        if !medium.scatters() {
            return;
        }
        // A stretch without length has not used its draw.
        let u = *flight.decision.get_or_insert_with(|| flight.stream.pair());
        if flight.extent == Extent::ToStop
            && let Some(t) = L::sample_distance(medium, &self.segment(span, f32::INFINITY), flight.hero, u)
            && t >= span.start
        {
            flight.stop = t;
        }
    }

    /// Ends `span` at `end`, a boundary, a surface or infinity, and decides whether the walk stops inside;
    /// whether that is all.
    #[inline]
    fn close<S: Scene<Bsdf = B>>(
        &mut self,
        scene: &S,
        span: &mut MediumSpan<L>,
        flight: &FreeFlight<'_, L>,
        end: f32,
    ) -> bool {
        span.end = end;
        if !(end > span.start || self.spans.is_empty()) {
            return false;
        }
        if self.stop.is_none()
            && let Some(u) = flight.decision
            && let Some(medium) = span.medium_in(scene)
            && medium.scatters()
        {
            // Next to its end, decided for the segment as it is: the rounding of a distance far from the
            // origin must not carry the stop over the end.
            let t = if flight.max_distance() < end {
                Some(flight.stop)
            } else if flight.stop < f32::INFINITY && flight.stop - flight.inset(flight.stop) > end {
                None
            } else {
                L::sample_distance(medium, &self.segment(span, end), flight.hero, u)
            };
            self.stop = t.map(|t| {
                // Boundaries that change no medium are within the stretch.
                let hidden = self.crossings[span.crossings..].iter().map(|crossing| crossing.t);
                let [before, behind] = hidden.fold([span.start, end], |[before, behind], at| {
                    if at <= t { [before.max(at), behind] } else { [before, behind.min(at)] }
                });
                (self.spans.len(), flight.stop_between([before, behind], t, medium))
            });
        }
        self.spans.push(*span);
        self.stop.is_some() && flight.extent == Extent::ToStop
    }

    /// Goes on behind the last of the first `crossings` crossings, unless there are `more` at its place;
    /// whether the walk has stopped before.
    fn cross<S: Scene<Bsdf = B>>(
        &mut self,
        scene: &S,
        span: &mut MediumSpan<L>,
        flight: &mut FreeFlight<'_, L>,
        crossings: usize,
        more: bool,
    ) -> bool {
        if crossings == 1 {
            self.end.clone_from(&self.start);
        }
        let crossing = self.crossings[crossings - 1];
        if self.end.cross(crossing.interior, crossing.entering) != upbp_media::Crossed::Done {
            self.conflicts += 1;
        }
        // Boundaries that coincide lead from the medium before them to the one behind. An invisible boundary
        // between two parts of the same medium changes nothing, not even a density.
        if more {
            return false;
        }
        let medium = medium_of(scene, &self.end);
        if medium == span.medium {
            return false;
        }
        // Rounding may put a boundary behind one that was crossed before.
        let t = crossing.t.max(span.start);
        // The first stretch counts even without a length: a vertex in its medium has a density there.
        if t > span.start || self.spans.is_empty() {
            if self.close(scene, span, flight, t) {
                return true;
            }
            span.before = self.density_to(scene, span, t);
            flight.decision = None;
        }
        span.start = t;
        span.medium = medium;
        span.crossings = crossings;
        self.enter(scene, span, flight);
        false
    }

    /// Densities of the edge from its start to `t` in `span`.
    #[inline]
    pub fn density_to<S: Scene>(&self, scene: &S, span: &MediumSpan<L>, t: f32) -> EdgeDensity<L> {
        let mut density = span.before;
        push_stretch(scene, &mut density, &self.ray, span.medium, span.start, t);
        density
    }

    /// The number of boundaries so far that contradicted the bodies that the ray was in; the count starts
    /// anew.
    pub fn take_conflicts(&mut self) -> u64 {
        std::mem::take(&mut self.conflicts)
    }

    /// Densities of the whole edge.
    pub fn density<S: Scene>(&self, scene: &S) -> EdgeDensity<L> {
        self.spans.last().map_or(EdgeDensity::EMPTY, |span| self.density_to(scene, span, span.end))
    }

    /// The spans that a beam along the edge runs through, each with the distance where the beam ends in it.
    pub(crate) fn beam_spans(&self, extent: BeamExtent) -> impl Iterator<Item = (&MediumSpan<L>, f32)> {
        let stop = match extent {
            BeamExtent::Short => self.stop,
            BeamExtent::Long => None,
        };
        let count = stop.map_or(self.spans.len(), |(last, _)| last + 1);
        self.spans[..count].iter().enumerate().map(move |(i, span)| match stop {
            Some((last, t)) if last == i => (span, t),
            _ => (span, span.end),
        })
    }

    /// The query beams along a camera edge for merges by `technique`: each with its span and medium. None if
    /// no light sub-path could complete a path, whose last edge is the `depth`-th from the camera.
    pub(crate) fn query_beams(
        &self,
        plan: &IterationPlan,
        depth: u32,
        technique: Technique,
    ) -> impl Iterator<Item = (&MediumSpan<L>, MediumId, Ray)> {
        // The photon's side has at least one edge.
        let completes = depth < plan.lengths.max;
        let spans = completes.then(|| self.beam_spans(plan.mis.query_beams)).into_iter().flatten();
        spans.filter_map(move |(span, end)| {
            let medium = span.medium.filter(|&medium| plan.merges_in(medium, technique))?;
            Some((span, medium, self.ray.with_range(span.start, end)))
        })
    }

    /// The part of `span` before `t`.
    #[inline]
    #[must_use]
    pub fn segment(&self, span: &MediumSpan<L>, t: f32) -> RaySegment {
        RaySegment { origin: self.ray.origin, direction: self.ray.direction, start: span.start, end: t }
    }

    /// The bodies around the point at distance `t`, which lies in `span`.
    ///
    /// A span may hold crossings of its own: boundaries hidden in a stronger body, which change no medium.
    #[must_use]
    pub fn stack_in(&self, span: &MediumSpan<L>, t: f32) -> MediumStack {
        let mut stack = self.start.clone();
        for (i, crossing) in self.crossings.iter().enumerate() {
            if i >= span.crossings && crossing.t > t {
                break;
            }
            let _ = stack.cross(crossing.interior, crossing.entering);
        }
        stack
    }

    /// Whether any of the bodies that count within `span` is such a one.
    pub(crate) fn any_body_in(&self, span: &MediumSpan<L>, is_such: impl Fn(BodyId) -> bool) -> bool {
        let counts = |stack: &MediumStack| stack.top().is_some_and(|top| is_such(top.body));
        let mut stack = self.start.clone();
        cross_all(&mut stack, &self.crossings[..span.crossings]);
        let within = &self.crossings[span.crossings..];
        counts(&stack)
            || within.iter().take_while(|crossing| crossing.t < span.end).any(|crossing| {
                let _ = stack.cross(crossing.interior, crossing.entering);
                counts(&stack)
            })
    }

    /// The bodies where the walk stops, or on the two sides of the surface.
    #[must_use]
    pub fn sides(&self) -> MediumInterface<'_> {
        let crosses =
            self.stop.is_none() && self.hit.as_ref().is_some_and(|hit| hit.boundary.interior().is_some());
        MediumInterface { near: self.bodies(), far: if crosses { &self.behind } else { self.bodies() } }
    }
}

impl<B: Copy, L: Lanes> Default for EdgeTrace<B, L> {
    /// An empty one; [`trace`](Self::trace) fills it, again and again without allocation.
    fn default() -> Self {
        Self {
            ray: Ray::new(Vec3::ZERO, Vec3::Z),
            spans: Vec::new(),
            stop: None,
            hit: None,
            start: MediumStack::new(None),
            end: MediumStack::new(None),
            behind: MediumStack::new(None),
            crossings: Vec::new(),
            found: Vec::new(),
            conflicts: 0,
            lost: false,
        }
    }
}
