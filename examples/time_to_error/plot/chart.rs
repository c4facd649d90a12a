//! RMSE over seconds, both axes logarithmic.

use super::{Anchor, Colour, Drawing, INK, LETTER, Point, Shape};
use crate::analysis::Curve;

const WIDTH: f32 = 720.0;
const HEIGHT: f32 = 440.0;
/// The frame within the drawing.
const LEFT: f32 = 78.0;
const RIGHT: f32 = 700.0;
const TOP: f32 = 44.0;
const BOTTOM: f32 = 384.0;

const FAINT: Colour = [232, 232, 232];
const GRID: Colour = [200, 200, 200];
const FLOOR: Colour = [150, 150, 150];

/// Colours that people with any sight tell apart.
const COLOURS: [Colour; 7] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [86, 180, 233],
    [230, 159, 0],
    [110, 110, 110],
];

/// A logarithmic axis from one place of the drawing to another.
struct Axis {
    /// Decimal logarithms of the ends.
    range: [f64; 2],
    ends: [f32; 2],
}

impl Axis {
    /// An axis with room for all values and a little more.
    fn new(values: impl Iterator<Item = f64>, ends: [f32; 2]) -> Self {
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for value in values.map(f64::log10).filter(|value| value.is_finite()) {
            range = [range[0].min(value), range[1].max(value)];
        }
        if range[0] > range[1] {
            range = [0.0, 0.0];
        }
        let margin = (0.04 * (range[1] - range[0])).max(0.05);
        Self { range: [range[0] - margin, range[1] + margin], ends }
    }

    fn place(&self, value: f64) -> f32 {
        let part = (value.log10() - self.range[0]) / (self.range[1] - self.range[0]);
        self.ends[0] + part as f32 * (self.ends[1] - self.ends[0])
    }

    /// Values with a line: the value, whether it is a power of ten, and its label, if it has one.
    fn ticks(&self) -> Vec<(f64, bool, Option<String>)> {
        let [low, high] = self.range;
        // Too few powers of ten to read the axis by need company.
        let few = (low.ceil() as i32..=high.floor() as i32).count() < 3;
        let mut ticks = Vec::new();
        for decade in low.floor() as i32..=high.floor() as i32 {
            for digit in 1..10_u8 {
                let value = f64::from(digit) * 10_f64.powi(decade);
                if (low..=high).contains(&value.log10()) {
                    let labelled = digit == 1 || few && (digit == 2 || digit == 5);
                    let label = if (-2..=3).contains(&decade) {
                        format!("{value:.*}", decade.min(0).unsigned_abs() as usize)
                    } else {
                        format!("{digit}e{decade}")
                    };
                    ticks.push((value, digit == 1, labelled.then_some(label)));
                }
            }
        }
        ticks
    }
}

/// The curves of a scene; `floor` is the RMSE that the noise of the reference makes.
pub(crate) fn chart(title: &str, curves: &[Curve], floor: f64) -> Drawing {
    let values = |c: usize| curves.iter().flat_map(Curve::rmse).map(move |point| point[c]);
    let x = Axis::new(values(0), [LEFT, RIGHT]);
    let y = Axis::new(values(1), [BOTTOM, TOP]);
    let mut shapes = Vec::new();
    frame(&mut shapes, title, &x, &y);
    // Only where curves are: a very good reference must not stretch the axis.
    if (y.range[0]..y.range[1]).contains(&floor.log10()) {
        let height = y.place(floor);
        shapes.push(Shape::Line { points: vec![[LEFT, height], [RIGHT, height]], colour: FLOOR, width: 1.0 });
        text(&mut shapes, [LEFT + 6.0, height - 4.0], Anchor::Start, "noise of the reference (subtracted)");
    }
    for (i, curve) in curves.iter().enumerate() {
        let colour = COLOURS[i % COLOURS.len()];
        let points = curve.rmse().into_iter().map(|[t, e]| [x.place(t), y.place(e)]).collect();
        shapes.push(Shape::Line { points, colour, width: 2.0 });
        // Errors fall: there is room at the upper right.
        let label = match curve.slope() {
            Some(slope) => format!("{}: slope {slope:.2}", curve.name),
            None => curve.name.clone(),
        };
        let height = TOP + 18.0 + 17.0 * i as f32;
        let sample = vec![[RIGHT - 34.0, height], [RIGHT - 10.0, height]];
        shapes.push(Shape::Line { points: sample, colour, width: 3.0 });
        text(&mut shapes, [RIGHT - 42.0, height + 0.5 * LETTER], Anchor::End, &label);
    }
    Drawing { width: WIDTH, height: HEIGHT, shapes }
}

/// Grid, axes and what they mean.
fn frame(shapes: &mut Vec<Shape>, title: &str, x: &Axis, y: &Axis) {
    let mut grid = |points: [Point; 2], decade: bool| {
        let colour = if decade { GRID } else { FAINT };
        shapes.push(Shape::Line { points: points.to_vec(), colour, width: 1.0 });
    };
    for (value, decade, _) in x.ticks() {
        grid([[x.place(value), TOP], [x.place(value), BOTTOM]], decade);
    }
    for (value, decade, _) in y.ticks() {
        grid([[LEFT, y.place(value)], [RIGHT, y.place(value)]], decade);
    }
    let corners = [[LEFT, TOP], [RIGHT, TOP], [RIGHT, BOTTOM], [LEFT, BOTTOM], [LEFT, TOP]];
    shapes.push(Shape::Line { points: corners.to_vec(), colour: INK, width: 1.2 });
    for (value, _, label) in x.ticks() {
        if let Some(label) = label {
            text(shapes, [x.place(value), BOTTOM + 18.0], Anchor::Middle, &label);
        }
    }
    for (value, _, label) in y.ticks() {
        if let Some(label) = label {
            text(shapes, [LEFT - 8.0, y.place(value) + 0.5 * LETTER], Anchor::End, &label);
        }
    }
    let (across, down) = (0.5 * (LEFT + RIGHT), 0.5 * (TOP + BOTTOM));
    text(shapes, [across, TOP - 16.0], Anchor::Middle, title);
    text(shapes, [across, BOTTOM + 42.0], Anchor::Middle, "seconds of rendering");
    shapes.push(Shape::Text {
        at: [24.0, down],
        anchor: Anchor::Middle,
        upwards: true,
        text: "RMSE".to_owned(),
    });
}

fn text(shapes: &mut Vec<Shape>, at: Point, anchor: Anchor, text: &str) {
    shapes.push(Shape::Text { at, anchor, upwards: false, text: text.to_owned() });
}
