//! The pixels that a pilot render looks at.

use upbp_estimators::scene::PixelRect;

/// Cells of the picture, one pixel of each of which a pilot render looks at.
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
        let side = (width * height / f64::from(cells)).sqrt().max(1.0);
        let [columns, rows] = [width, height].map(|length| (length / side).ceil() as u32);
        Self { rect, side, columns, rows }
    }

    pub(crate) const fn cells(&self) -> u32 {
        self.columns * self.rows
    }

    /// Pixels of the picture.
    pub(crate) fn pixels(&self) -> f64 {
        f64::from(self.rect.width) * f64::from(self.rect.height)
    }

    pub(crate) const fn columns(&self) -> usize {
        self.columns as usize
    }

    /// The pixel that stands for a cell.
    pub(super) fn pixel(&self, cell: u32) -> [u32; 2] {
        let place =
            |index: u32, size: u32| ((f64::from(index) + 0.5) * self.side).min(f64::from(size - 1)) as u32;
        let (column, row) = (cell % self.columns, cell / self.columns);
        [self.rect.x + place(column, self.rect.width), self.rect.y + place(row, self.rect.height)]
    }

    /// The cell of a pixel.
    pub(super) fn cell(&self, [x, y]: [u32; 2]) -> u32 {
        let index = |offset: u32, count: u32| ((f64::from(offset) / self.side) as u32).min(count - 1);
        index(y - self.rect.y, self.rows) * self.columns + index(x - self.rect.x, self.columns)
    }
}
