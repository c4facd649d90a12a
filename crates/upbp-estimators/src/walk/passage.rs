//! The way of a ray from a vertex to the next surface, as a list of stretches inside one medium each.
//!
//! Index-matched boundaries are not vertices: they cut an edge into segments (`docs/theory.md`, section 1.7).

use glam::Vec3;
use upbp_accel::Ray;
use upbp_media::{EdgeDensity, Interior, Medium, MediumId, MediumStack, RaySegment};

use crate::scene::{Crossing, Hit, Scene};

/// A stretch of an edge inside one medium.
#[derive(Clone, Copy, Debug)]
pub struct Span {
    /// Where it begins, distance along the ray in scene units.
    pub start: f32,
    /// Where it ends; may be infinite.
    pub end: f32,
    /// The medium, `None` for vacuum.
    pub medium: Option<MediumId>,
    /// What the edge has accumulated up to `start`.
    pub before: EdgeDensity,
    /// How many of the passage's crossings lie before it.
    crossings: usize,
}

/// A ray from a vertex to the next surface that scatters, or to infinity.
pub struct Passage<B> {
    /// Where the ray starts.
    pub origin: Vec3,
    /// Its direction.
    pub direction: Vec3,
    /// Stretches in order, adjoining, from 0 to the surface.
    pub spans: Vec<Span>,
    /// The surface.
    pub hit: Option<Hit<B>>,
    /// The bodies at the start.
    start: MediumStack,
    /// The bodies at the end.
    end: MediumStack,
    crossings: Vec<Crossing>,
    found: Vec<Crossing>,
    /// Boundaries that contradicted the bodies that the ray was in, since they were last taken.
    conflicts: u64,
}

/// What happens at the boundary of a body, given the bodies that a ray is in.
///
/// A boundary inside a stronger body, or of a body that is hidden by one, is no surface: the body is entered or left, and
/// the ray goes on (`docs/theory.md`, section 1.7).
pub(crate) fn is_hidden(stack: &MediumStack, interior: &Interior, entering: bool) -> bool {
    if entering {
        interior.priority < stack.priority()
    } else {
        stack.top().is_none_or(|top| top.body != interior.body)
    }
}

impl<B: Copy> Passage<B> {
    /// An empty one; [`trace`](Self::trace) fills it, again and again without allocation.
    #[must_use]
    pub fn new() -> Self {
        Self {
            origin: Vec3::ZERO,
            direction: Vec3::Z,
            spans: Vec::new(),
            hit: None,
            start: MediumStack::new(None),
            end: MediumStack::new(None),
            crossings: Vec::new(),
            found: Vec::new(),
            conflicts: 0,
        }
    }

    /// Follows a ray from `origin`, which lies in the bodies of `stack`.
    pub fn trace<S: Scene<Bsdf = B>>(
        &mut self,
        scene: &S,
        origin: Vec3,
        direction: Vec3,
        stack: &MediumStack,
    ) {
        self.origin = origin;
        self.direction = direction;
        self.start = *stack;
        self.spans.clear();
        self.crossings.clear();
        let mut ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
        let mut now = *stack;
        let mut span =
            Span { start: 0.0, end: 0.0, medium: now.medium(), before: EdgeDensity::EMPTY, crossings: 0 };
        self.hit = loop {
            self.found.clear();
            let hit = scene.trace(&ray, &mut self.found);
            for i in 0..self.found.len() {
                let crossing = self.found[i];
                self.cross(scene, &mut now, &mut span, crossing);
            }
            match hit {
                Some(Hit { interior: Some(interior), t, geometric_normal, .. }) => {
                    let entering = direction.dot(geometric_normal) < 0.0;
                    if !is_hidden(&now, &interior, entering) {
                        break hit;
                    }
                    self.cross(
                        scene,
                        &mut now,
                        &mut span,
                        Crossing { t, interior, entering, scatters: true },
                    );
                    ray.t_min = t * (1.0 + 4.0 * f32::EPSILON) + f32::MIN_POSITIVE;
                }
                _ => break hit,
            }
        };
        span.end = self.hit.as_ref().map_or(f32::INFINITY, |hit| hit.t);
        if span.end > span.start || self.spans.is_empty() {
            self.spans.push(span);
        }
        self.end = now;
    }

    fn cross<S: Scene>(&mut self, scene: &S, now: &mut MediumStack, span: &mut Span, crossing: Crossing) {
        if now.cross(crossing.interior, crossing.entering) != upbp_media::Crossing::Done {
            self.conflicts += 1;
        }
        self.crossings.push(crossing);
        // An invisible boundary between two parts of the same medium changes nothing, not even a density.
        if now.medium() == span.medium {
            return;
        }
        // Rounding may put a boundary behind one that was crossed before.
        let t = crossing.t.max(span.start);
        if t > span.start {
            span.end = t;
            self.spans.push(*span);
            span.before = self.density_to(scene, span, t);
        }
        span.start = t;
        span.medium = now.medium();
        span.crossings = self.crossings.len();
    }

    /// What the edge accumulates from its start to `t` in `span`.
    #[inline]
    pub fn density_to<S: Scene>(&self, scene: &S, span: &Span, t: f32) -> EdgeDensity {
        let mut density = span.before;
        match span.medium {
            Some(medium) => density.push(&scene.media()[medium.0 as usize].segment(&self.segment(span, t))),
            None => density.push_vacuum(),
        }
        density
    }

    /// The number of boundaries so far that contradicted the bodies that the ray was in; the count starts anew.
    pub fn take_conflicts(&mut self) -> u64 {
        std::mem::take(&mut self.conflicts)
    }

    /// What the edge accumulates to its end.
    pub fn density<S: Scene>(&self, scene: &S) -> EdgeDensity {
        self.spans.last().map_or(EdgeDensity::EMPTY, |span| self.density_to(scene, span, span.end))
    }

    /// The part of `span` before `t`.
    #[inline]
    #[must_use]
    pub fn segment(&self, span: &Span, t: f32) -> RaySegment {
        RaySegment { origin: self.origin, direction: self.direction, start: span.start, end: t }
    }

    /// The bodies around the point at distance `t`, which lies in `span`.
    ///
    /// A span may hold crossings of its own: boundaries hidden in a stronger body, which change no medium.
    #[must_use]
    pub fn stack_in(&self, span: &Span, t: f32) -> MediumStack {
        let mut stack = self.start;
        for (i, crossing) in self.crossings.iter().enumerate() {
            if i >= span.crossings && crossing.t > t {
                break;
            }
            let _ = stack.cross(crossing.interior, crossing.entering);
        }
        stack
    }

    /// The bodies at the end, before the surface.
    #[must_use]
    pub const fn stack_at_end(&self) -> &MediumStack {
        &self.end
    }
}

impl<B: Copy> Default for Passage<B> {
    fn default() -> Self {
        Self::new()
    }
}
