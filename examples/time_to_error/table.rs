//! Results as text: one CSV file, one Markdown table.

use std::fmt::Write as _;

use crate::analysis::{Curve, Reached};

/// First line of the CSV file.
pub(crate) const CSV_HEADER: &str = "scene,set,seed,seconds,iterations,relmse,over_scales,rmse\n";

/// The measured points of a curve as they are, noise of the reference included.
pub(crate) fn csv(scene: &str, curve: &Curve) -> String {
    let mut text = String::new();
    for (seed, points) in &curve.series {
        for p in points {
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "{scene},{},{seed},{:.6},{},{:.6e},{:.6e},{:.6e}",
                curve.name, p.seconds, p.iterations, p.relative_mse, p.over_scales, p.rmse
            );
        }
    }
    text
}

/// The head of the table.
pub(crate) fn head(errors: &[f64]) -> String {
    let times: Vec<String> = errors.iter().map(|error| format!(" s to {error:e} |")).collect();
    let rules = "---|".repeat(7 + errors.len());
    format!(
        "| scene | set | iterations | s / iteration | relMSE | relMSE × s | slope |{}\n|{rules}",
        times.concat()
    )
}

/// A row of the table.
pub(crate) fn row(scene: &str, curve: &Curve, errors: &[f64]) -> String {
    let (iterations, seconds, error) = curve.end();
    let none = if iterations > 0.0 { "in the noise" } else { "no light" };
    let number = |value: Option<f64>| value.map_or_else(|| none.to_owned(), |v| format!("{v:.2e}"));
    let slope = curve.slope().map_or_else(|| "–".to_owned(), |slope| format!("{slope:.2}"));
    let mut row = format!(
        "| {scene} | {} | {iterations:.0} | {:.3} | {} | {} | {slope} |",
        curve.name,
        seconds / iterations.max(1.0),
        number(error),
        number(error.map(|error| error * seconds)),
    );
    for error in errors {
        let text = match curve.time_to(*error) {
            Some(Reached::Before(seconds)) => format!("< {seconds:.2}"),
            Some(Reached::At(seconds)) => format!("{seconds:.2}"),
            Some(Reached::Not(seconds)) => format!("> {seconds:.1}"),
            None => "–".to_owned(),
        };
        let _ = write!(row, " {text} |");
    }
    row
}
