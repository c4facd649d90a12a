//! Pieces of long segments.
//!
//! The box of a diagonal segment is mostly empty, and grows with the square of the length. Pieces have
//! smaller boxes; each owns a half-open part of its segment, so that a hit belongs to exactly one piece.

use super::closest_approach::Segment;

/// The number of pieces that long segments are split into.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplitParams {
    /// Greatest number of pieces per segment, on average; values up to one leave segments whole. One segment
    /// has at most 64.
    pub pieces_per_segment: f32,
}

impl SplitParams {
    /// Every segment is one piece.
    pub const WHOLE: Self = Self { pieces_per_segment: 1.0 };
}

impl Default for SplitParams {
    /// Four pieces per segment: more are up to a fifth faster among long beams and slower among short ones,
    /// and take memory in proportion.
    fn default() -> Self {
        Self { pieces_per_segment: 4.0 }
    }
}

/// A part of a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    /// The segment's place in the list.
    pub(super) segment: u32,
    pub(super) start: f32,
    pub(super) end: f32,
}

/// Most pieces of one segment: one that is far longer than the others does not take the pieces of all.
const MOST: f64 = 64.0;

/// Splits usable segments into pieces of about the same length.
pub(super) fn split<'a>(
    segments: impl ExactSizeIterator<Item = &'a Segment> + Clone,
    params: SplitParams,
) -> Vec<Piece> {
    let count = segments.len() as f64;
    let length = |segment: &Segment| f64::from(segment.end) - f64::from(segment.start);
    let total: f64 = segments.clone().map(length).sum();
    // Rounding up adds one piece per segment at most.
    let extra = (f64::from(params.pieces_per_segment) - 1.0).max(0.0) * count;
    let target = total / extra;

    let mut pieces = Vec::with_capacity((total / target + count).min(MOST * count) as usize);
    for (index, segment) in segments.enumerate() {
        let parts = (length(segment) / target).ceil().clamp(1.0, MOST);
        let mut start = segment.start;
        for part in 1..=parts as u32 {
            let end = if f64::from(part) < parts {
                (f64::from(segment.start) + length(segment) * (f64::from(part) / parts)) as f32
            } else {
                segment.end
            };
            // Where single precision does not tell the ends apart, there is nothing in between.
            if start < end {
                pieces.push(Piece { segment: index as u32, start, end });
                start = end;
            }
        }
    }
    pieces
}
