//! A drawing as pixels, with soft edges.

use upbp_core::Image;

use super::{Anchor, Colour, Drawing, INK, LETTER, Point, Shape, font};

/// A line of a letter relative to its height.
const PEN: f32 = 0.13;

/// An image of the drawing on white, `scale` pixels per unit.
pub(crate) fn rasterise(drawing: &Drawing, scale: f32) -> Image {
    let (width, height) = ((drawing.width * scale) as u32, (drawing.height * scale) as u32);
    let pixels = vec![[1.0; 3]; width as usize * height as usize];
    let mut image = Image { width, height, pixels };
    for shape in &drawing.shapes {
        match shape {
            Shape::Line { points, colour, width } => {
                let points = points.iter().map(|[x, y]| [x * scale, y * scale]).collect();
                stroke(&mut image, &[points], width * scale, *colour);
            }
            Shape::Text { at, anchor, upwards, text } => {
                let (mut lines, length) = font::lines(text, LETTER);
                let start = match anchor {
                    Anchor::Start => 0.0,
                    Anchor::Middle => -0.5 * length,
                    Anchor::End => -length,
                };
                for [x, y] in lines.iter_mut().flatten() {
                    let (along, up) = (*x + start, *y);
                    let [dx, dy] = if *upwards { [-up, -along] } else { [along, -up] };
                    [*x, *y] = [(at[0] + dx) * scale, (at[1] + dy) * scale];
                }
                stroke(&mut image, &lines, PEN * LETTER * scale, INK);
            }
        }
    }
    image
}

/// Draws lines of one colour, with round ends, as one shape: where they overlap they are no darker.
fn stroke(image: &mut Image, lines: &[Vec<Point>], width: f32, colour: Colour) {
    let reach = 0.5 * width + 0.5;
    let mut low = [f32::INFINITY; 2];
    let mut high = [0.0_f32; 2];
    for point in lines.iter().flatten() {
        for c in 0..2 {
            low[c] = low[c].min(point[c]);
            high[c] = high[c].max(point[c]);
        }
    }
    // Pixels are squares between integers.
    let limits = [image.width as f32, image.height as f32];
    let from = [0, 1].map(|c| (low[c] - reach).floor().clamp(0.0, limits[c]) as usize);
    let to = [0, 1].map(|c| (high[c] + reach).ceil().clamp(0.0, limits[c]) as usize);
    let ink = colour.map(linear);
    for y in from[1]..to[1] {
        for x in from[0]..to[0] {
            let pixel = [x as f32 + 0.5, y as f32 + 0.5];
            let segments = lines.iter().flat_map(|line| line.windows(2));
            let distance = segments.map(|s| distance(pixel, s[0], s[1])).fold(f32::INFINITY, f32::min);
            let cover = (reach - distance).clamp(0.0, 1.0);
            let under = &mut image.pixels[y * image.width as usize + x];
            for c in 0..3 {
                under[c] += cover * (ink[c] - under[c]);
            }
        }
    }
}

/// Distance of a point from the segment between two others.
fn distance(point: Point, a: Point, b: Point) -> f32 {
    let (along, to) = ([b[0] - a[0], b[1] - a[1]], [point[0] - a[0], point[1] - a[1]]);
    let square = along[0] * along[0] + along[1] * along[1];
    let part =
        if square > 0.0 { ((to[0] * along[0] + to[1] * along[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
    (to[0] - part * along[0]).hypot(to[1] - part * along[1])
}

/// The inverse of the sRGB curve, which the image file applies.
fn linear(value: u8) -> f32 {
    let v = f32::from(value) / 255.0;
    if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}
