//! A drawing as SVG.

use std::fmt::Write as _;

use super::{Anchor, Colour, Drawing, INK, LETTER, Shape};

/// The text of an SVG file.
pub(crate) fn svg(drawing: &Drawing) -> String {
    let Drawing { width, height, shapes } = drawing;
    // Capital letters are about 0.72 of the size of a font.
    let size = LETTER / 0.72;
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
         height=\"{height}\" font-family=\"sans-serif\" font-size=\"{size:.1}\" fill=\"{}\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n",
        hex(INK)
    );
    for shape in shapes {
        // Writing to a string cannot fail.
        let _ = match shape {
            Shape::Line { points, colour, width } => {
                let list: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
                writeln!(
                    text,
                    "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" \
                     stroke-linejoin=\"round\"/>",
                    list.join(" "),
                    hex(*colour)
                )
            }
            Shape::Text { at: [x, y], anchor, upwards, text: content } => {
                let anchor = match anchor {
                    Anchor::Start => "start",
                    Anchor::Middle => "middle",
                    Anchor::End => "end",
                };
                let turn =
                    if *upwards { format!(" transform=\"rotate(-90 {x} {y})\"") } else { String::new() };
                writeln!(
                    text,
                    "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\"{turn}>{}</text>",
                    escape(content)
                )
            }
        };
    }
    text + "</svg>\n"
}

fn hex([r, g, b]: Colour) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
