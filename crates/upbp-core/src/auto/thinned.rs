//! Lists that stay short, however much is pushed: walks that hardly ever end would fill all memory.

/// A list of which every second element is left out whenever it has `MOST`, an even number.
pub(super) struct Thinned<T, const MOST: usize> {
    kept: Vec<T>,
    /// Elements for each that is kept, a power of two.
    step: usize,
    count: usize,
}

impl<T, const MOST: usize> Default for Thinned<T, MOST> {
    fn default() -> Self {
        Self { kept: Vec::new(), step: 1, count: 0 }
    }
}

impl<T, const MOST: usize> Thinned<T, MOST> {
    pub(super) fn push(&mut self, element: T) {
        const { assert!(MOST.is_multiple_of(2), "every second element of an odd number is not half of them") };
        if self.count.is_multiple_of(self.step) {
            if self.kept.len() == MOST {
                self.thin_to(2 * self.step);
            }
            self.kept.push(element);
        }
        self.count += 1;
    }

    /// Keeps one of `step` elements, a multiple of the step so far.
    fn thin_to(&mut self, step: usize) {
        let ratio = step / self.step;
        let mut index = 0;
        self.kept.retain(|_| {
            index += 1;
            (index - 1) % ratio == 0
        });
        self.step = step;
    }

    /// The elements of all lists, as thin as the thinnest one.
    pub(super) fn joined(mut lists: Vec<Self>) -> Vec<T> {
        let step = lists.iter().map(|list| list.step).max().unwrap_or(1);
        for list in &mut lists {
            list.thin_to(step);
        }
        lists.into_iter().flat_map(|list| list.kept).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOST: usize = 512;

    /// The numbers from 0 up to a count, pushed one by one.
    fn numbers(count: usize) -> Thinned<usize, MOST> {
        let mut list = Thinned::default();
        for number in 0..count {
            list.push(number);
        }
        list
    }

    #[test]
    fn lists_are_thinned_evenly() {
        for count in [0, 1, MOST, MOST + 1, 100_000] {
            let list = numbers(count);
            assert!(list.kept.len() <= MOST && 2 * list.kept.len() >= count.min(MOST));
            assert!(list.kept.iter().copied().eq((0..count).step_by(list.step)), "of {count}");
        }
        assert!(Thinned::joined(vec![numbers(3), numbers(2)]).into_iter().eq([0, 1, 2, 0, 1]));
        // A list that was thinned has no less weight than one that was not.
        let found = Thinned::joined(vec![numbers(MOST), numbers(4 * MOST)]);
        let of_first = found.windows(2).position(|pair| pair[1] < pair[0]).map_or(0, |last| last + 1);
        assert_eq!(found.len(), 5 * of_first, "{of_first}");
    }
}
