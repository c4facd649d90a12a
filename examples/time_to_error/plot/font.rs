//! Letters made of lines, for pictures that need no font of the system.

use super::Point;

/// Height of the base line and of capitals on the grid of [`glyph`].
const BASE: f32 = 2.0;
const CAPITAL: f32 = 8.0;
/// Space between letters, grid units.
const SPACE: f32 = 1.7;

/// The lines of a text with capitals of the given height, from the origin to the right, heights upwards; and
/// its length.
pub(super) fn lines(text: &str, height: f32) -> (Vec<Vec<Point>>, f32) {
    let unit = height / (CAPITAL - BASE);
    let mut lines = Vec::new();
    let mut left = 0.0;
    for letter in text.chars() {
        let mut width = 0.0_f32;
        for line in glyph(letter).split('|') {
            let digits: Vec<f32> =
                line.chars().filter_map(|c| c.to_digit(10)).map(|digit| digit as f32).collect();
            width = digits.chunks_exact(2).map(|at| at[0]).fold(width, f32::max);
            lines.push(
                digits.chunks_exact(2).map(|at| [(left + at[0]) * unit, (at[1] - BASE) * unit]).collect(),
            );
        }
        left += width + SPACE;
    }
    (lines, (left - SPACE).max(0.0) * unit)
}

/// A letter on a grid: lines between points of two digits, across and up. Most capitals look like small
/// letters; a box is what has no picture.
fn glyph(letter: char) -> &'static str {
    match letter {
        ' ' => "12",
        'E' => "38 08 02 32|05 25",
        'M' => "02 08 25 48 42",
        'R' => "02 08 28 37 36 25 05|15 32",
        'S' => "37 28 18 07 06 15 25 34 33 22 12 03",
        'a' => "36 32|33 22 12 03 05 16 26 35",
        'b' => "08 02|03 12 22 33 35 26 16 05",
        'c' => "35 26 16 05 03 12 22 33",
        'd' => "38 32|33 22 12 03 05 16 26 35",
        'e' => "04 34 35 26 16 05 03 12 22 33",
        'f' => "28 17 12|06 26",
        'g' => "36 31 20 10 01|33 22 12 03 05 16 26 35",
        'h' => "08 02|05 16 26 35 32",
        'i' => "06 02|08 08",
        'j' => "16 11 00|18 18",
        'k' => "08 02|26 04 22",
        'l' => "08 02",
        'm' => "06 02|05 16 25 22|25 36 45 42",
        'n' => "06 02|05 16 26 35 32",
        'o' => "16 26 35 33 22 12 03 05 16",
        'p' => "06 00|05 16 26 35 33 22 12 03",
        'q' => "36 30|35 26 16 05 03 12 22 33",
        'r' => "06 02|05 16 26",
        's' => "35 26 16 05 14 24 33 22 12 03",
        't' => "18 13 22|06 26",
        'u' => "06 03 12 22 33|36 32",
        'v' => "06 22 46",
        'w' => "06 12 25 32 46",
        'x' => "06 32|02 36",
        'y' => "06 13|26 00",
        'z' => "06 36 02 32",
        '0' => "18 28 37 33 22 12 03 07 18",
        '1' => "06 18 12|02 22",
        '2' => "07 18 28 37 36 02 32",
        '3' => "07 18 28 37 36 25 15|25 34 33 22 12 03",
        '4' => "22 28 04 34",
        '5' => "38 08 05 25 34 33 22 12 03",
        '6' => "37 28 18 07 03 12 22 33 34 25 15 04",
        '7' => "08 38 12",
        '8' => "15 06 07 18 28 37 36 25 15 04 03 12 22 33 34 25",
        '9' => "03 12 22 33 37 28 18 07 06 15 25 36",
        '-' | '−' => "05 35",
        '+' => "05 45|23 27",
        '_' => "01 31",
        '.' => "02 02",
        ',' => "12 01",
        ':' => "03 03|06 06",
        '=' => "04 34|06 36",
        '/' => "00 38",
        '(' => "18 06 04 12",
        ')' => "08 16 14 02",
        'A'..='Z' => glyph(letter.to_ascii_lowercase()),
        _ => "02 08 38 32 02",
    }
}
