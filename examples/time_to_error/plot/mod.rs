//! Plots: a drawing of lines and texts, written as SVG or as pixels.

mod chart;
mod font;
mod raster;
mod svg;

pub(crate) use chart::chart;
pub(crate) use raster::rasterise;
pub(crate) use svg::svg;

/// A colour, sRGB.
type Colour = [u8; 3];

/// A place, units from the top left corner.
type Point = [f32; 2];

/// The end of a text that is at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Anchor {
    Start,
    Middle,
    End,
}

#[derive(Debug)]
enum Shape {
    Line { points: Vec<Point>, colour: Colour, width: f32 },
    Text { at: Point, anchor: Anchor, upwards: bool, text: String },
}

/// A picture before it has pixels.
#[derive(Debug)]
pub(crate) struct Drawing {
    width: f32,
    height: f32,
    shapes: Vec<Shape>,
}

/// Height of a capital letter.
const LETTER: f32 = 9.0;

const INK: Colour = [40, 40, 40];
