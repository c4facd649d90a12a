//! Sets of iterations, by their indices.

use std::fmt;
use std::ops::Range;

use serde::{Deserialize, Serialize};

/// Indices of iterations are below this: as many numbers fit into the sums of a film.
pub const MAX_ITERATIONS: u64 = super::exact_sum::MAX_COUNT;

/// A set of iterations. What a film holds, and what a state file says that it holds.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Vec<(u64, u64)>", into = "Vec<(u64, u64)>")]
pub struct IterationSet {
    /// Ascending, not empty, with gaps in between.
    ranges: Vec<Range<u64>>,
}

impl IterationSet {
    /// The number of iterations.
    #[must_use]
    pub fn len(&self) -> u64 {
        self.ranges.iter().map(|range| range.end - range.start).sum()
    }

    /// Whether the set has no iterations.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ranges.is_empty()
    }

    /// The maximal ranges, ascending.
    #[must_use]
    pub fn ranges(&self) -> &[Range<u64>] {
        &self.ranges
    }

    /// The largest index.
    #[must_use]
    pub fn last(&self) -> Option<u64> {
        self.ranges.last().map(|range| range.end - 1)
    }

    /// The least index of `range` that is not in the set.
    #[must_use]
    pub(crate) fn first_missing(&self, range: &Range<u64>) -> Option<u64> {
        let next = match self.ranges.get(self.following(range.start)) {
            Some(own) if own.start <= range.start => own.end,
            _ => range.start,
        };
        (next < range.end).then_some(next)
    }

    /// Whether the set has this index.
    #[must_use]
    pub fn contains(&self, index: u64) -> bool {
        self.ranges.get(self.following(index)).is_some_and(|own| own.start <= index)
    }

    /// Number of indices of `range` in the set.
    #[must_use]
    pub(crate) fn count_in(&self, range: &Range<u64>) -> u64 {
        self.ranges.iter().map(|own| overlap(own, range).map_or(0, |both| both.end - both.start)).sum()
    }

    /// The first range that is in both sets.
    #[must_use]
    pub(crate) fn overlap(&self, other: &Self) -> Option<Range<u64>> {
        let mut others = other.ranges.iter().peekable();
        self.ranges.iter().find_map(|own| {
            while others.next_if(|theirs| theirs.end <= own.start).is_some() {}
            others.peek().and_then(|theirs| overlap(own, theirs))
        })
    }

    /// Adds an index below [`MAX_ITERATIONS`].
    pub(crate) fn insert(&mut self, index: u64) {
        let own = index..index + 1;
        self.union(&Self { ranges: [own].into() });
    }

    /// Adds the indices of another set.
    pub(crate) fn union(&mut self, other: &Self) {
        self.ranges.extend_from_slice(&other.ranges);
        self.ranges.sort_unstable_by_key(|range| range.start);
        self.ranges.dedup_by(|next, last| {
            let joined = next.start <= last.end;
            if joined {
                last.end = last.end.max(next.end);
            }
            joined
        });
    }

    /// The place of the first range that ends behind `index`.
    fn following(&self, index: u64) -> usize {
        self.ranges.partition_point(|range| range.end <= index)
    }
}

fn overlap(a: &Range<u64>, b: &Range<u64>) -> Option<Range<u64>> {
    let both = a.start.max(b.start)..a.end.min(b.end);
    (!both.is_empty()).then_some(both)
}

impl From<IterationSet> for Vec<(u64, u64)> {
    fn from(set: IterationSet) -> Self {
        set.ranges.into_iter().map(|range| (range.start, range.end)).collect()
    }
}

impl TryFrom<Vec<(u64, u64)>> for IterationSet {
    type Error = String;

    fn try_from(pairs: Vec<(u64, u64)>) -> Result<Self, String> {
        let mut least = 0;
        for &(start, end) in &pairs {
            if start < least || start >= end || end > MAX_ITERATIONS {
                return Err(format!("iterations: expected ascending ranges with gaps, found {start}..{end}"));
            }
            least = end + 1;
        }
        Ok(Self { ranges: pairs.into_iter().map(|(start, end)| start..end).collect() })
    }
}

impl fmt::Display for IterationSet {
    /// Ranges, as in `0..40, 50..60`; of many the first few.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        /// Ranges that are shown.
        const SHOWN: usize = 8;
        if self.is_empty() {
            return write!(f, "none");
        }
        for (i, range) in self.ranges.iter().take(SHOWN).enumerate() {
            write!(f, "{}{}..{}", if i > 0 { ", " } else { "" }, range.start, range.end)?;
        }
        match self.ranges.len().saturating_sub(SHOWN) {
            0 => Ok(()),
            more => write!(f, " and {more} ranges more"),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    fn set(indices: &BTreeSet<u64>) -> IterationSet {
        let mut set = IterationSet::default();
        // From both ends, so that ranges grow on both sides and join.
        let mut left: Vec<_> = indices.iter().copied().collect();
        while let Some(last) = left.pop() {
            set.insert(last);
            left.reverse();
        }
        set
    }

    proptest! {
        #[test]
        fn is_a_set(
            a in proptest::collection::btree_set(0..40_u64, 0..30),
            b in proptest::collection::btree_set(0..40_u64, 0..30),
            start in 0..40_u64,
            length in 0..20_u64,
        ) {
            let (own, other) = (set(&a), set(&b));
            prop_assert_eq!(own.len(), a.len() as u64);
            prop_assert_eq!(own.is_empty(), a.is_empty());
            prop_assert_eq!(own.last(), a.last().copied());
            prop_assert_eq!(own.ranges().iter().cloned().flatten().collect::<BTreeSet<_>>(), a.clone());
            prop_assert_eq!(own.contains(start), a.contains(&start));
            let range = start..start + length;
            prop_assert_eq!(own.first_missing(&range), range.clone().find(|i| !a.contains(i)));
            prop_assert_eq!(own.count_in(&range), range.filter(|i| a.contains(i)).count() as u64);
            let common = own.overlap(&other);
            prop_assert_eq!(common.clone().map(|c| c.start), a.intersection(&b).next().copied());
            prop_assert!(common.into_iter().flatten().all(|i| a.contains(&i) && b.contains(&i)));
            let mut both = own.clone();
            both.union(&other);
            prop_assert_eq!(both, set(&a.union(&b).copied().collect()));
            let pairs: Vec<(u64, u64)> = own.clone().into();
            prop_assert_eq!(IterationSet::try_from(pairs), Ok(own));
        }
    }

    #[test]
    fn what_is_not_a_set_of_ranges_is_refused() {
        for pairs in
            [vec![(1, 1)], vec![(2, 1)], vec![(0, 2), (2, 3)], vec![(4, 5), (1, 2)], vec![(0, u64::MAX)]]
        {
            assert!(IterationSet::try_from(pairs).is_err());
        }
        let set = IterationSet::try_from(vec![(0, 3), (5, 6)]).unwrap();
        assert_eq!(set.to_string(), "0..3, 5..6");
        assert_eq!(IterationSet::default().to_string(), "none");
    }
}
