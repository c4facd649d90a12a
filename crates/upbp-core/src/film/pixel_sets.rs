//! Sets of pixels, each spread evenly over the picture: an iteration that has to stop early leaves a coarse
//! picture of everything and not the upper rows of a fine one.
//!
//! A pixel belongs to a set by its place in a square of 16 × 16 pixels, counted from the corner of what is
//! rendered. The first set is a grid of one pixel per square; four, sixteen, 64 and 256 sets are grids of
//! half the spacing each.

/// Number of sets.
pub(crate) const SETS: u32 = 256;

/// Side of a square in pixels.
const SIDE: usize = 16;

/// The set of each pixel of a square, by row and column.
const SET: [[u8; SIDE]; SIDE] = {
    let mut table = [[0; SIDE]; SIDE];
    let mut i = 0;
    while i < SIDE * SIDE {
        let (x, y) = (i % SIDE, i / SIDE);
        // The lowest digits of a place count most; of each four pixels first two on a diagonal.
        let (mut set, mut bit) = (0, 0);
        while bit < 4 {
            let (a, b) = (x >> bit & 1, y >> bit & 1);
            set = 4 * set + 2 * (a ^ b) + b;
            bit += 1;
        }
        table[y][x] = set as u8;
        i += 1;
    }
    table
};

/// The set of a pixel, by its place in what is rendered.
#[inline]
pub(crate) const fn set_of(x: usize, y: usize) -> u32 {
    SET[y % SIDE][x % SIDE] as u32
}

/// The pixels that stand for one that has no samples, nearest first; the last one is in the first set.
pub(crate) fn stand_ins(x: usize, y: usize) -> impl Iterator<Item = (usize, usize)> {
    [1, 3, 7, 15].into_iter().map(move |low: usize| (x & !low, y & !low))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_nested_grids() {
        for (sets, spacing) in [(1, 16), (4, 8), (16, 4), (64, 2), (256, 1)] {
            let mut seen = vec![0; SETS as usize];
            for (x, y) in (0..SIDE * SIDE).map(|i| (i % SIDE, i / SIDE)) {
                let on_grid = x % spacing == 0 && y % spacing == 0;
                assert_eq!(set_of(x, y) < sets, on_grid, "{x} {y} of {sets}");
                assert_eq!(set_of(x + 3 * SIDE, y + SIDE), set_of(x, y));
                seen[set_of(x, y) as usize] += 1;
            }
            assert!(seen.iter().all(|count| *count == 1));
        }
        // The second pixel of four is opposite of the first.
        assert_eq!(set_of(8, 8), 1);
    }

    #[test]
    fn stand_ins_are_of_coarser_grids() {
        let places: Vec<_> = stand_ins(31, 21).collect();
        assert_eq!(places, [(30, 20), (28, 20), (24, 16), (16, 16)]);
        assert_eq!(set_of(16, 16), 0);
    }
}
