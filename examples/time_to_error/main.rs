//! Error over time, of any scenes with a reference and any sets of techniques.
//!
//! `cargo run --release --example time_to_error -- --scenes fog_cornell,glass_env --sets "pt;bpt;default" --time 30 --out
//! target/errors` writes `errors.csv` with all that was measured, and a plot per scene as SVG and as PNG, and prints a
//! table. In the table and the plots the noise of the reference is taken away.

mod analysis;
mod measure;
mod options;
mod plot;
mod subject;
mod table;

use std::error::Error;
use std::num::NonZeroUsize;
use std::path::Path;
use std::process::ExitCode;

use clap::Parser;
use upbp_core::{Settings, check_writable, write_png};

use analysis::Curve;
use options::Options;
use subject::Subject;

/// Exit code for input that cannot be rendered and output that cannot be written.
const BAD_INPUT: u8 = 2;

/// Pixels of a PNG file per unit of a plot.
const PIXELS_PER_UNIT: f32 = 2.0;

fn main() -> ExitCode {
    let options = Options::parse();
    let threads = options.threads.map_or(0, NonZeroUsize::get);
    let result = match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool.install(|| run(&options).map_err(|error| describe(&*error))),
        Err(error) => Err(error.to_string()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::from(BAD_INPUT)
        }
    }
}

/// An error with all its causes.
fn describe(error: &dyn Error) -> String {
    match error.source() {
        Some(cause) => format!("{error}\n  because: {}", describe(cause)),
        None => error.to_string(),
    }
}

fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    // Before the work, not after it.
    let settings = options.settings()?;
    let subjects = Subject::load_all(&options.scenes)?;
    std::fs::create_dir_all(&options.out)
        .map_err(|error| format!("cannot make the folder {}: {error}", options.out.display()))?;
    let table_path = options.out.join("errors.csv");
    check_writable(&table_path)?;

    let mut csv = table::CSV_HEADER.to_owned();
    println!("{}", table::head(&options.errors));
    for subject in &subjects {
        let mut curves = Vec::new();
        for set in &options.sets {
            let mut series = Vec::new();
            for &seed in &options.seeds {
                let settings = Settings { techniques: set.techniques, seed, ..settings.clone() };
                series.push((seed, measure::measure(subject, settings, options.time)?));
            }
            let curve = Curve::new(set.name.clone(), series, subject.floor);
            println!("{}", table::row(&subject.name, &curve, &options.errors));
            csv += &table::csv(&subject.name, &curve);
            curves.push(curve);
        }
        // What was measured stays, should a later scene fail.
        write(&table_path, &csv)?;
        plot(subject, &curves, &options.out)?;
    }
    Ok(())
}

fn plot(subject: &Subject, curves: &[Curve], folder: &Path) -> Result<(), Box<dyn Error>> {
    let drawing = plot::chart(&subject.name, curves, subject.floor.rmse);
    write(&folder.join(format!("{}.svg", subject.name)), &plot::svg(&drawing))?;
    write_png(
        &folder.join(format!("{}.png", subject.name)),
        &plot::rasterise(&drawing, PIXELS_PER_UNIT),
        1.0,
    )?;
    Ok(())
}

fn write(path: &Path, text: &str) -> Result<(), String> {
    std::fs::write(path, text).map_err(|error| format!("cannot write {}: {error}", path.display()))
}
