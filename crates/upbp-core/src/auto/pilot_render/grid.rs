//! The pixels of a pilot render.

use upbp_estimators::scene::PixelRect;

use super::blocks;

/// Cells of the picture, one pixel of each of which a pilot render has.
pub(crate) struct Grid {
    rect: PixelRect,
    side: f64,
    columns: u32,
    rows: u32,
}

impl Grid {
    /// A grid of about this number of cells, or of one per pixel.
    pub(crate) fn new(rect: PixelRect, cells: u32) -> Self {
        let [width, height] = [rect.width, rect.height].map(f64::from);
        let even = (width * height / f64::from(cells)).sqrt();
        // A strip that is narrower than such a cell has one row of them.
        let is_strip = even > width.min(height);
        let side = if is_strip { width.max(height) / f64::from(cells) } else { even };
        let side = side.max(1.0);
        let [columns, rows] = [width, height].map(|length| (length / side).ceil() as u32);
        Self { rect, side, columns, rows }
    }

    pub(crate) const fn cells(&self) -> u32 {
        self.columns * self.rows
    }

    /// Pixels of the picture.
    pub(crate) const fn pixels(&self) -> f64 {
        self.rect.pixels() as f64
    }

    pub(crate) const fn columns(&self) -> usize {
        self.columns as usize
    }

    /// The pixel that stands for a cell.
    pub(super) fn pixel(&self, cell: u32) -> [u32; 2] {
        // The middle of what the picture has of the cell.
        let place = |index: u32, size: u32| {
            let [start, end] = [index, index + 1].map(|i| (f64::from(i) * self.side).min(f64::from(size)));
            (0.5 * (start + end)).min(f64::from(size - 1)) as u32
        };
        let (column, row) = (cell % self.columns, cell / self.columns);
        [self.rect.x + place(column, self.rect.width), self.rect.y + place(row, self.rect.height)]
    }

    /// A pixel near the one that stands for a cell, and the weight of what both have in common in the errors
    /// of blocks. `None` where the picture ends.
    ///
    /// Its distance is drawn such that all cells together estimate sums over the pixels of blocks.
    pub(crate) fn partner(&self, cell: u32) -> Option<([u32; 2], f64)> {
        let (offset, weight) = blocks::offset(cell);
        let [x, y] = self.pixel(cell);
        let moved = |place: u32, start: u32, size: u32, offset: i32| {
            // What blocks have in common is the same on the other side.
            let places = [offset, -offset].map(|offset| place.checked_add_signed(offset));
            places.into_iter().flatten().find(|place| (start..start + size).contains(place))
        };
        let x = moved(x, self.rect.x, self.rect.width, offset[0])?;
        let y = moved(y, self.rect.y, self.rect.height, offset[1])?;
        Some(([x, y], weight))
    }

    /// The cell of a pixel.
    pub(super) fn cell(&self, [x, y]: [u32; 2]) -> u32 {
        let index = |offset: u32, count: u32| ((f64::from(offset) / self.side) as u32).min(count - 1);
        index(y - self.rect.y, self.rows) * self.columns + index(x - self.rect.x, self.columns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_strip_has_no_more_than_twice_as_many_cells_as_are_asked_for() {
        for (width, height) in
            [(3840, 2160), (3840, 154), (3840, 40), (3840, 1), (1, 3840), (16384, 3), (7, 5)]
        {
            for asked in [1, 25, 400, 20_000] {
                let grid = Grid::new(PixelRect { x: 3, y: 4, width, height }, asked);
                let most = (2.0 * f64::from(asked) + 7.0).min(f64::from(width * height));
                let cells = grid.cells();
                assert!(f64::from(cells) <= most, "{width} x {height}, {asked}: {cells}");
            }
        }
    }
}
