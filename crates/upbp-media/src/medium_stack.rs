//! The bodies that a point is inside of, and the medium that counts there.
//!
//! Bodies may overlap: a marble in a glass of milk, a glass whose water reaches into its wall. Where they
//! do, the one with the highest priority wins, and among equals the one entered last. Every sub-path
//! carries such a list; a surface whose priority is below the current one is not there for the path.
//!
//! Source: `docs/theory.md`, section 1.7; priorities after Schmidt and Budge, "Simple Nested
//! Dielectrics in Ray Traced Images", JGT 7(2), 2002.

/// Index of a medium in its scene, below `u32::MAX`.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MediumId(pub u32);

/// Index of a closed body in its scene.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BodyId(pub u32);

/// The inside of a closed body, as its surface announces it.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Interior {
    /// The body.
    pub body: BodyId,
    /// The medium that fills the body; `None` for vacuum.
    pub medium: Option<MediumId>,
    /// Rank where bodies overlap: the body of the highest priority counts, among equals the last entered.
    pub priority: i32,
    /// Index of refraction, relative to vacuum.
    pub ior: f32,
}

/// The outcome of crossing a boundary.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
#[must_use]
pub enum Crossed {
    /// The stack has changed.
    Done,
    /// Entered a body that the point is already inside of: ignored.
    AlreadyInside,
    /// Left a body that the point is not inside of: ignored.
    NotInside,
}

/// A medium or none, in four bytes.
#[derive(Copy, Clone, PartialEq)]
struct Filling(u32);

impl Filling {
    const VACUUM: u32 = u32::MAX;

    #[inline]
    const fn new(medium: Option<MediumId>) -> Self {
        match medium {
            Some(medium) => Self(medium.0),
            None => Self(Self::VACUUM),
        }
    }

    #[inline]
    const fn get(self) -> Option<MediumId> {
        if self.0 == Self::VACUUM { None } else { Some(MediumId(self.0)) }
    }
}

/// An [`Interior`] as it is stored.
#[derive(Copy, Clone)]
struct Entry {
    body: BodyId,
    filling: Filling,
    priority: i32,
    ior: f32,
}

impl Entry {
    #[inline]
    const fn interior(self) -> Interior {
        Interior { body: self.body, medium: self.filling.get(), priority: self.priority, ior: self.ior }
    }
}

/// The bodies that a point is inside of, by ascending priority, among equals in order of entering.
///
/// The list has no limit. Rays that look ahead walk a copy: that of a few bodies takes a few vector
/// instructions.
pub struct MediumStack {
    /// The first `few` entries are in use, unless there are more bodies than entries.
    bodies: [Entry; Self::FEW],
    outside: Filling,
    few: u8,
    /// All bodies, if there are more than [`FEW`](Self::FEW); else empty.
    many: Vec<Entry>,
}

impl MediumStack {
    /// Number of bodies that are stored without an allocation.
    const FEW: usize = 6;

    /// The list of a point outside all bodies, in the medium `outside` (`None` for vacuum), of refractive
    /// index 1.
    #[inline]
    #[must_use]
    pub const fn new(outside: Option<MediumId>) -> Self {
        const UNUSED: Entry = Entry { body: BodyId(0), filling: Filling::new(None), priority: 0, ior: 1.0 };
        Self { bodies: [UNUSED; Self::FEW], outside: Filling::new(outside), few: 0, many: Vec::new() }
    }

    #[inline]
    fn entries(&self) -> &[Entry] {
        if self.many.is_empty() { &self.bodies[..usize::from(self.few)] } else { &self.many }
    }

    /// The bodies that the point is inside of, the current one last.
    #[must_use]
    pub fn bodies(&self) -> impl DoubleEndedIterator<Item = Interior> + '_ {
        self.entries().iter().map(|entry| entry.interior())
    }

    /// The body of the highest priority, whose medium counts; `None` outside all bodies.
    #[inline]
    #[must_use]
    pub fn top(&self) -> Option<Interior> {
        self.entries().last().map(|entry| entry.interior())
    }

    /// The medium at the point; `None` for vacuum.
    #[inline]
    #[must_use]
    pub fn medium(&self) -> Option<MediumId> {
        self.entries().last().map_or(self.outside, |entry| entry.filling).get()
    }

    /// Index of refraction at the point; 1 outside all bodies.
    #[inline]
    #[must_use]
    pub fn ior(&self) -> f32 {
        self.entries().last().map_or(1.0, |entry| entry.ior)
    }

    /// Whether the point is inside of `body`, on top or hidden.
    #[inline]
    #[must_use]
    pub fn contains(&self, body: BodyId) -> bool {
        self.entries().iter().any(|entry| entry.body == body)
    }

    /// The number of bodies that the point is inside of.
    #[inline]
    #[must_use]
    pub fn len(&self) -> usize {
        self.entries().len()
    }

    /// Whether the point is outside all bodies.
    #[inline]
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.entries().is_empty()
    }

    /// Enters a body, above all others of at most its priority.
    #[inline]
    pub fn enter(&mut self, interior: Interior) -> Crossed {
        if self.contains(interior.body) {
            return Crossed::AlreadyInside;
        }
        let Interior { body, medium, priority, ior } = interior;
        let entry = Entry { body, filling: Filling::new(medium), priority, ior };
        let len = self.len();
        let slot = self.entries().partition_point(|below| below.priority <= priority);
        if len < Self::FEW {
            self.bodies.copy_within(slot..len, slot + 1);
            self.bodies[slot] = entry;
            self.few += 1;
        } else {
            if len == Self::FEW {
                self.many.extend(self.bodies);
            }
            self.many.insert(slot, entry);
        }
        Crossed::Done
    }

    /// Leaves a body, wherever in the list it is.
    #[inline]
    pub fn leave(&mut self, body: BodyId) -> Crossed {
        let len = self.len();
        let Some(slot) = self.entries().iter().position(|entry| entry.body == body) else {
            return Crossed::NotInside;
        };
        if len <= Self::FEW {
            self.bodies.copy_within(slot + 1..len, slot);
            self.few -= 1;
        } else {
            self.many.remove(slot);
            if let Ok(few) = self.many[..].try_into() {
                self.bodies = few;
                self.many.clear();
            }
        }
        Crossed::Done
    }

    /// Crosses the surface of a body, inwards if `entering`.
    #[inline]
    pub fn cross(&mut self, interior: Interior, entering: bool) -> Crossed {
        if entering { self.enter(interior) } else { self.leave(interior.body) }
    }
}

impl Clone for MediumStack {
    /// Copies a few bodies without a call.
    #[inline]
    fn clone(&self) -> Self {
        let many = if self.many.is_empty() { Vec::new() } else { self.many.clone() };
        Self { bodies: self.bodies, outside: self.outside, few: self.few, many }
    }

    #[inline]
    fn clone_from(&mut self, other: &Self) {
        (self.bodies, self.outside, self.few) = (other.bodies, other.outside, other.few);
        if !(self.many.is_empty() && other.many.is_empty()) {
            self.many.clone_from(&other.many);
        }
    }
}

impl PartialEq for MediumStack {
    /// Compares the bodies, their order and the medium outside; unused slots do not matter.
    fn eq(&self, other: &Self) -> bool {
        self.outside == other.outside && self.bodies().eq(other.bodies())
    }
}

impl std::fmt::Debug for MediumStack {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("MediumStack")
            .field("outside", &self.outside.get())
            .field("bodies", &self.bodies().collect::<Vec<_>>())
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;
    use proptest::sample::subsequence;

    use super::*;

    fn interior(body: u32, priority: i32) -> Interior {
        Interior { body: BodyId(body), medium: Some(MediumId(body)), priority, ior: 1.0 + body as f32 }
    }

    #[test]
    fn outside_everything_is_the_global_medium() {
        let stack = MediumStack::new(Some(MediumId(7)));
        assert!(stack.is_empty());
        assert_eq!((stack.medium(), stack.ior()), (Some(MediumId(7)), 1.0));
        assert_eq!((stack.top(), stack.len()), (None, 0));
    }

    #[test]
    fn a_body_of_vacuum_hides_what_is_around_it() {
        let mut stack = MediumStack::new(Some(MediumId(7)));
        assert_eq!(stack.enter(Interior { medium: None, ..interior(1, 0) }), Crossed::Done);
        assert_eq!((stack.medium(), stack.ior()), (None, 2.0));
        assert_eq!(stack.leave(BodyId(1)), Crossed::Done);
        assert_eq!(stack, MediumStack::new(Some(MediumId(7))));
    }

    #[test]
    fn the_highest_priority_counts_then_the_most_recent() {
        let mut stack = MediumStack::new(None);
        for (body, priority, top) in [(1, 5, 1), (2, 3, 1), (3, 5, 3), (4, 5, 4), (5, i32::MIN, 4), (6, 9, 6)]
        {
            assert_eq!(stack.cross(interior(body, priority), true), Crossed::Done);
            assert_eq!(stack.medium(), Some(MediumId(top)), "after entering {body}");
        }
        for (body, top) in [(4, 6), (6, 3), (3, 1), (1, 2), (2, 5)] {
            assert_eq!(stack.cross(interior(body, 0), false), Crossed::Done);
            assert_eq!(stack.medium(), Some(MediumId(top)), "after leaving {body}");
        }
    }

    #[test]
    fn contradictions_are_reported_and_ignored() {
        let mut stack = MediumStack::new(None);
        assert_eq!(stack.leave(BodyId(1)), Crossed::NotInside);
        assert_eq!(stack.enter(interior(1, 0)), Crossed::Done);
        // The second time even with another priority.
        assert_eq!(stack.enter(interior(1, 3)), Crossed::AlreadyInside);
        assert_eq!((stack.len(), stack.top()), (1, Some(interior(1, 0))));
        assert_eq!(stack.leave(BodyId(2)), Crossed::NotInside);
        assert_eq!(stack.len(), 1);
    }

    #[test]
    fn equality_does_not_see_bodies_that_were_left() {
        let (mut one, mut other) = (MediumStack::new(None), MediumStack::new(None));
        for body in [1, 2] {
            assert_eq!(one.enter(interior(body, 0)), Crossed::Done);
        }
        assert_eq!(one.leave(BodyId(2)), Crossed::Done);
        assert_eq!(other.enter(interior(1, 0)), Crossed::Done);
        assert_eq!(one, other);
        assert_ne!(one, MediumStack::new(None));
        assert_ne!(MediumStack::new(None), MediumStack::new(Some(MediumId(0))));
    }

    proptest! {
        #[test]
        fn agrees_with_a_search_through_the_history(
            bodies in prop_oneof![Just(12_u32), Just(60)],
            steps in vec((0_u32..60, -2_i32..3, prop::bool::weighted(0.6)), 0..160),
        ) {
            let mut stack = MediumStack::new(Some(MediumId(99)));
            // In order of entering.
            let mut history: Vec<Interior> = Vec::new();
            for (body, priority, entering) in steps {
                let interior = interior(body % bodies, priority);
                let inside = history.iter().position(|other| other.body == interior.body);
                let expected = match (entering, inside) {
                    (true, Some(_)) => Crossed::AlreadyInside,
                    (true, None) => { history.push(interior); Crossed::Done }
                    (false, Some(index)) => { history.remove(index); Crossed::Done }
                    (false, None) => Crossed::NotInside,
                };
                prop_assert_eq!(stack.cross(interior, entering), expected);
                // The last of the highest: `max_by_key` returns the last among equals.
                let top = history.iter().max_by_key(|interior| interior.priority);
                prop_assert_eq!(stack.top(), top.copied());
                prop_assert_eq!(stack.len(), history.len());
                prop_assert_eq!(stack.contains(interior.body), history.iter().any(|other| other.body == interior.body));
            }
        }

        #[test]
        fn the_order_of_distinct_priorities_does_not_matter(
            entering in Just((0_u32..10).collect::<Vec<_>>()).prop_shuffle(),
            leaving in subsequence((0_u32..10).collect::<Vec<_>>(), 0..10).prop_shuffle(),
        ) {
            let mut stack = MediumStack::new(None);
            for &body in &entering {
                prop_assert_eq!(stack.enter(interior(body, 10 * body.cast_signed())), Crossed::Done);
            }
            for &body in &leaving {
                prop_assert_eq!(stack.leave(BodyId(body)), Crossed::Done);
            }
            let left: Vec<_> = (0..10)
                .filter(|body| !leaving.contains(body))
                .map(|body| interior(body, 10 * body.cast_signed()))
                .collect();
            prop_assert_eq!(stack.bodies().collect::<Vec<_>>(), left.clone());
            prop_assert_eq!(stack.top(), left.last().copied());
        }
    }
}
