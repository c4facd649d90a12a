//! Renders the whole stress matrix (`docs/validation.md`) and prints a table of what was run and what failed.
//!
//! `cargo run --release --example stress` takes minutes on two cores; `-- --filter transform` runs the
//! cases whose line contains the words. Ends with exit code 1 if any case failed.

use std::collections::BTreeMap;
use std::error::Error;
use std::num::NonZeroUsize;
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};

use upbp_core::describe;
use upbp_testing::stress::{Case, all, in_parallel};

/// Renders scenes at the ends of what a description can say.
#[derive(Debug, Parser)]
#[command(version, about)]
struct Options {
    /// Only cases whose line has all of these words
    #[arg(long, value_delimiter = ',')]
    filter: Vec<String>,
    /// Every n-th case only
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    every: u64,
    /// Cases at the same time [default: one per core]
    #[arg(long)]
    threads: Option<NonZeroUsize>,
    /// Print the cases instead of rendering them
    #[arg(long)]
    list: bool,
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(error) => {
            eprintln!("error: {}", describe(&*error));
            ExitCode::from(2)
        }
    }
}

fn run(options: &Options) -> Result<bool, Box<dyn Error>> {
    let chosen = |case: &Case| options.filter.iter().all(|word| case.to_string().contains(word.as_str()));
    let cases: Vec<Case> = all().into_iter().filter(chosen).step_by(options.every as usize).collect();
    if options.list {
        for case in &cases {
            println!("{case}");
        }
        return Ok(true);
    }
    let workers = match options.threads {
        Some(threads) => threads,
        None => std::thread::available_parallelism()?,
    };
    let start = Instant::now();
    let bar = ProgressBar::new(cases.len() as u64)
        .with_style(ProgressStyle::with_template("{bar:30} {pos}/{len} {eta} {msg}")?);
    let results = in_parallel(cases.len(), workers.get(), |index| {
        let result = cases[index].judge();
        if let Err(wrong) = &result {
            bar.suspend(|| println!("FAILED {}: {wrong}", cases[index]));
        }
        bar.inc(1);
        result
    });
    bar.finish_and_clear();
    Ok(report(&cases, &results, start.elapsed().as_secs_f64()))
}

/// The table; whether all cases hold.
fn report(cases: &[Case], results: &[Result<f64, String>], seconds: f64) -> bool {
    #[derive(Default)]
    struct Row {
        run: u32,
        failed: u32,
        seconds: f64,
        longest: f64,
    }
    let mut groups: BTreeMap<&str, Row> = BTreeMap::new();
    for (case, result) in cases.iter().zip(results) {
        let row = groups.entry(case.group).or_default();
        row.run += 1;
        match result {
            Ok(seconds) => {
                row.seconds += seconds;
                row.longest = row.longest.max(*seconds);
            }
            Err(_) => row.failed += 1,
        }
    }
    println!("| group | cases | failed | seconds of rendering | longest |\n|---|---|---|---|---|");
    for (group, row) in &groups {
        println!("| {group} | {} | {} | {:.0} | {:.1} |", row.run, row.failed, row.seconds, row.longest);
    }
    let failed: u32 = groups.values().map(|row| row.failed).sum();
    println!("{} cases, {failed} failed, {seconds:.0} s", results.len());
    failed == 0
}
