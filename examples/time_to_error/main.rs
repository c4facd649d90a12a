//! Error over time, of any scenes with a reference and any sets of techniques.
//!
//! `cargo run --release --example time_to_error -- --scenes fog_cornell,glass_env --sets "pt;bpt;auto"
//! --time 30 --out target/errors` writes `errors.csv` with all that was measured, and a plot per scene as SVG
//! and as PNG, and prints tables, which are in `summary.md` too. In tables and plots the noise of the
//! reference is taken away. Errors over scales are means of those of blocks of 1, 4, 8 and 16 pixels a side,
//! each times its pixels: where neighbours share errors, as blotches and streaks do, they are larger.
//!
//! Without `--scenes` and `--sets` it renders the whole suite in half an hour on two cores, with `--quick` in
//! less than five minutes, and judges the choice of techniques by the program (`verdict`).

mod analysis;
mod measure;
mod options;
mod plot;
mod subject;
mod table;
mod verdict;

use std::error::Error;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use upbp_core::{
    Content, ErrorPoint, Output, OutputError, RenderError, Settings, TechniqueSet, ToneMapping,
    check_outputs, describe, write_png, write_text,
};

use analysis::Curve;
use options::{NamedSet, Options};
use subject::Subject;
use verdict::Verdict;

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

fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    // Before the work, not after it.
    let settings = options.settings()?;
    let subjects = Subject::load_all(&options.scenes)?;
    std::fs::create_dir_all(&options.out)
        .map_err(|error| format!("cannot make the folder {}: {error}", options.out.display()))?;
    let table_path = options.out.join("errors.csv");
    let summary_path = options.out.join("summary.md");
    check_files(&table_path, &summary_path, &subjects, options)?;

    let (sets, seeds, seconds) = (options.sets()?, options.seeds(), options.seconds());
    let mut csv = table::CSV_HEADER.to_owned();
    let mut summary = String::new();
    let mut say = |line: &str| {
        println!("{line}");
        summary += line;
        summary.push('\n');
    };
    say(&table::head(&options.errors));
    let (mut verdicts, mut over_scales) = (Vec::new(), Vec::new());
    for subject in &subjects {
        let mut curves = Vec::new();
        for (set, series) in sets.iter().zip(series(subject, &sets, &settings, &seeds, seconds)?) {
            let curve = Curve::new(set.name.clone(), series, subject.floor);
            say(&table::row(&subject.name, &curve, &options.errors));
            csv += &table::csv(&subject.name, &curve);
            curves.push(curve);
        }
        // What was measured stays, should a later scene fail.
        write_text(&table_path, &csv)?;
        plot(subject, &curves, &options.out)?;
        verdicts.extend(Verdict::new(&subject.name, &curves, seconds));
        let curves: Vec<Curve> = curves.iter().map(Curve::over_scales).collect();
        over_scales.extend(Verdict::new(&subject.name, &curves, seconds));
    }
    say(&format!("\n## Errors of pixels\n\n{}", verdict::markdown(&mut verdicts)));
    say(&format!("\n## Errors over scales\n\n{}", verdict::markdown(&mut over_scales)));
    write_text(&summary_path, &summary)?;
    Ok(())
}

/// Errors over time, by seed.
type Series = Vec<(u64, Vec<ErrorPoint>)>;

/// Renders a scene with all sets and seeds; a series for each set. A scene may not have what a set needs, so
/// that two sets are the same in it: those are rendered once. The choice of the program costs time of its own
/// and is always rendered. A set that finds no light has no points.
fn series(
    subject: &Subject,
    sets: &[NamedSet],
    settings: &Settings,
    seeds: &[u64],
    seconds: f64,
) -> Result<Vec<Series>, Box<dyn Error>> {
    let mut series = vec![Series::new(); sets.len()];
    for &seed in seeds {
        let mut renderers = Vec::new();
        // Which of them is that of each set.
        let mut places: Vec<(Option<TechniqueSet>, Option<usize>)> = Vec::new();
        for set in sets {
            let settings = Settings { techniques: set.techniques, seed, ..settings.clone() };
            let renderer = match measure::prepare(subject, settings, seconds) {
                Err(RenderError::NoLight { .. }) if !set.is_auto() => {
                    places.push((None, None));
                    continue;
                }
                renderer => renderer.map_err(|error| format!("{}: {error}", subject.name))?,
            };
            let fixed = (!set.is_auto()).then(|| renderer.support().techniques);
            let same = places.iter().find(|(other, _)| fixed.is_some() && *other == fixed);
            let place = same.map_or(Some(renderers.len()), |(_, place)| *place);
            if same.is_none() {
                renderers.push(renderer);
            }
            places.push((fixed, place));
        }
        let points = measure::measure(subject, renderers, seconds);
        for (series, (_, place)) in series.iter_mut().zip(places) {
            series.push((seed, place.map_or_else(Vec::new, |place| points[place].clone())));
        }
    }
    Ok(series)
}

/// The files of the plots of a scene: SVG and PNG.
fn plots(subject: &Subject, folder: &Path) -> [PathBuf; 2] {
    ["svg", "png"].map(|ending| folder.join(format!("{}.{ending}", subject.name)))
}

/// Checks that everything can be written, and destroys nothing.
fn check_files(
    table: &Path,
    summary: &Path,
    subjects: &[Subject],
    options: &Options,
) -> Result<(), Box<dyn Error>> {
    let plots: Vec<_> = subjects.iter().map(|subject| plots(subject, &options.out)).collect();
    let output = |role, path, content| Output { role, path, content };
    let mut outputs = vec![
        output("the table", table, Content::Text("scene,set,")),
        output("the summary", summary, Content::Text("| scene")),
    ];
    for [svg, png] in &plots {
        outputs.extend([output("a plot", svg, Content::Text("<svg")), output("a plot", png, Content::Png)]);
    }
    let settings = options.settings.iter().map(|path| ("the settings", path.as_path()));
    let read = subjects.iter().flat_map(|subject| &subject.files);
    let read = read.map(|path| ("a file of a scene", path.as_path()));
    Ok(check_outputs(&outputs, &settings.chain(read).collect::<Vec<_>>())?)
}

fn plot(subject: &Subject, curves: &[Curve], folder: &Path) -> Result<(), OutputError> {
    let drawing = plot::chart(&subject.name, curves, subject.floor.rmse);
    let [svg, png] = plots(subject, folder);
    write_text(&svg, &plot::svg(&drawing))?;
    write_png(&png, &plot::rasterise(&drawing, PIXELS_PER_UNIT), ToneMapping::default())
}
