//! Renders the reference scenes with many sets of techniques and compares them with images of an independent
//! renderer.
//!
//! `cargo run --release --example validate` takes an hour and a half; `-- --quick` some minutes.
//! Prints a table and ends with exit code 1 if a bar was missed.
//!
//! Sets without merges are unbiased: mean of the picture, tiles and pixels must agree within the noise, and
//! the noise of the mean must be low. With merges there is kernel bias, which the default settings must keep
//! below 1 %. Merges alone (`hit` sees lights directly, merging at any vertex that is not specular covers the
//! rest) are stated, and rendered once more with fixed radii r, r/2, r/4: where kernels lie inside of their
//! medium bias falls like r², what sticks out of it is a loss that falls like r.

use std::error::Error;
use std::fmt::Write as _;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use upbp_core::{
    Content, Output, Radii, Radius, Renderer, Settings, Stop, Technique, TechniqueSet, check_outputs,
    describe, write_text,
};
use upbp_scene::ReadyScene;
use upbp_testing::Estimate;
use upbp_testing::reference::{Comparison, Reference, Spread};
use upbp_testing::shipped::{Group, SCENES, Shipped, names};

const SETS: [&str; 8] = [
    "pt",
    "bpt",
    "bpt+surf+pp3d+pb2d+bb1d",
    "all",
    "hit+surf+pp3d",
    "hit+surf+pb2d",
    "hit+surf+bp2d",
    "hit+surf+bb1d",
];

/// Scenes for the exponents: no specular surfaces, so that `hit` is needed for nothing but the lights
/// themselves.
const EXPONENT_SCENES: [&str; 1] = ["fog_cornell"];

/// Largest of the three radii, relative to the scene.
const EXPONENT_RADIUS: f32 = 0.04;

/// Standard errors that the mean may be off.
const MEAN_SIGMAS: f64 = 4.0;
/// Percent that the mean of an unbiased set may be off.
const UNBIASED_PERCENT: f64 = 0.5;
/// Percent that the mean of the default mixture may be off.
const MIXED_PERCENT: f64 = 1.0;
/// Standard errors that a tile of an unbiased set may be off.
const TILE_SIGMAS: f64 = 4.5;
/// Share of the pixels of an unbiased set that may be beyond 3.5 standard errors.
const OUTLIERS: f64 = 0.01;
/// With fewer iterations the spread of a pixel is known too badly for that.
const PIXEL_ITERATIONS: u64 = 256;
/// With fewer iterations no error is known.
const LEAST_ITERATIONS: u64 = 16;

/// Compares renders of the reference scenes with images of an independent renderer.
#[derive(Debug, Parser)]
#[command(version, about)]
struct Options {
    /// Seconds of rendering per scene and set
    #[arg(long, default_value_t = 60.0)]
    time: f64,
    /// Scenes [default: those whose reference another renderer made]
    #[arg(long, value_delimiter = ',')]
    scenes: Vec<String>,
    /// Sets of techniques [default: a selection]
    #[arg(long, value_delimiter = ',')]
    sets: Vec<TechniqueSet>,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// 4 seconds each, the bars in percent and the exponents left out
    #[arg(long)]
    quick: bool,
    /// Write the table as CSV too
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
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
    let scenes: Vec<&str> = if options.scenes.is_empty() {
        names(Group::Reference).collect()
    } else {
        options.scenes.iter().map(String::as_str).collect()
    };
    let sets = if options.sets.is_empty() {
        SETS.iter().map(|set| set.parse()).collect::<Result<_, _>>()?
    } else {
        options.sets.clone()
    };
    let seconds = if options.quick { 4.0 } else { options.time };
    if let Some(path) = &options.csv {
        // Before the work, not after it.
        let read: Vec<_> = SCENES.iter().flat_map(|shipped| [shipped.scene(), shipped.reference()]).collect();
        let inputs: Vec<_> = read.iter().map(|path| ("a scene or a reference", path.as_path())).collect();
        check_outputs(
            &[Output { role: "the table", path, content: Content::Text("scene,techniques,") }],
            &inputs,
        )?;
    }
    let mut csv = "scene,techniques,iterations,mean_r,mean_g,mean_b,error_r,error_g,error_b,sigmas_r,sigmas_g,sigmas_b,\
        percent_r,percent_g,percent_b,chi_square,outliers,tile_sigmas,relative_mse,missed\n"
        .to_owned();
    let mut good = true;
    println!(
        "| scene | techniques | iterations | mean: % (σ) R | G | B | χ² | pixels > 3.5 σ | worst tile | relMSE | |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for name in &scenes {
        let (scene, reference) = open(name)?;
        for techniques in &sets {
            let settings =
                Settings { techniques: (*techniques).into(), seed: options.seed, ..Settings::default() };
            let stop = Stop { seconds: Some(seconds), ..Stop::default() };
            let (renderer, spread) = render(&scene, settings, &stop)?;
            let film = renderer.film();
            let result = Comparison::new(film, &spread, &reference);
            let missed = judge(&result, *techniques, film.iterations(), options.quick);
            good &= missed.is_none();
            let missed = missed.unwrap_or_default();
            let mean = [0, 1, 2].map(|c| format!("{:+.3} ({:+.2})", result.percent[c], result.sigmas[c]));
            println!(
                "| {name} | {techniques} | {} | {} | {:.2} | {:.2} % | {:.2} σ | {:.1e} | {missed} |",
                film.iterations(),
                mean.join(" | "),
                result.chi_square,
                100.0 * result.outliers,
                result.tile,
                result.relative_mse,
            );
            let list = |values: [f64; 3]| values.map(|v| v.to_string()).join(",");
            writeln!(
                csv,
                "{name},{techniques},{},{},{},{},{},{},{},{},{},{missed}",
                film.iterations(),
                list(result.mean.map(|m| m.mean)),
                list(result.mean.map(|m| m.error)),
                list(result.sigmas),
                list(result.percent),
                result.chi_square,
                result.outliers,
                result.tile,
                result.relative_mse,
            )?;
        }
        let floor = reference.floor().relative_mse;
        println!("| {name} | *the reference itself* | | | | | | | | {floor:.1e} | |");
    }
    if !options.quick {
        let chosen: Vec<&str> = scenes.into_iter().filter(|name| EXPONENT_SCENES.contains(name)).collect();
        exponents(&chosen, seconds)?;
    }
    if let Some(path) = &options.csv {
        write_text(path, &csv)?;
    }
    Ok(good)
}

fn open(name: &str) -> Result<(ReadyScene, Reference), Box<dyn Error>> {
    let shipped =
        Shipped::find(name).ok_or_else(|| format!("no scene with a reference is called `{name}`"))?;
    let path = shipped.reference();
    let reference = Reference::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok((ReadyScene::load(shipped.scene())?, reference))
}

fn render<'s>(
    scene: &'s ReadyScene,
    settings: Settings,
    stop: &Stop,
) -> Result<(Renderer<'s>, Spread), Box<dyn Error>> {
    let mut renderer = scene.renderer(settings.validate()?)?;
    let mut spread = Spread::default();
    renderer.render(stop, |now| {
        // Iteration by iteration.
        if now.film.begun().is_empty() {
            spread.add(now.film);
        }
        ControlFlow::Continue(())
    });
    // Errors need a number of iterations, however long they take.
    while renderer.film().iterations() < LEAST_ITERATIONS && renderer.iterate() {
        spread.add(renderer.film());
    }
    Ok((renderer, spread))
}

/// The bar that was missed, if any.
fn judge(result: &Comparison, techniques: TechniqueSet, iterations: u64, quick: bool) -> Option<String> {
    let merges = techniques.intersects(TechniqueSet::VOLUME_MERGES.with(Technique::Surf));
    let (sigmas, percent) = (result.worst_sigmas(), result.worst_percent());
    if !merges {
        if sigmas > MEAN_SIGMAS {
            return Some(format!("mean {sigmas:.1} σ"));
        }
        if percent > UNBIASED_PERCENT && !quick {
            return Some(format!("mean {percent:.2} %"));
        }
        if result.tile > TILE_SIGMAS && !quick {
            return Some(format!("tile {:.1} σ", result.tile));
        }
        if result.outliers > OUTLIERS && iterations >= PIXEL_ITERATIONS && !quick {
            return Some(format!("{:.1} % of the pixels", 100.0 * result.outliers));
        }
    } else if techniques.has(Technique::Nee) && percent > MIXED_PERCENT {
        // A short render is allowed its noise.
        let noise = (0..3).all(|c| result.sigmas[c].abs() < MEAN_SIGMAS);
        if !(quick && noise) {
            return Some(format!("mean {percent:.2} %"));
        }
    }
    None
}

/// Bias of merges alone with three fixed radii, and the exponents between them.
fn exponents(scenes: &[&str], seconds: f64) -> Result<(), Box<dyn Error>> {
    if scenes.is_empty() {
        return Ok(());
    }
    println!(
        "\nFixed radii r = {EXPONENT_RADIUS} of the scene's, merges alone, paths of two edges and more, green:\n"
    );
    println!("| scene | techniques | bias % at r | r/2 | r/4 | exponent r to r/2 | r/2 to r/4 |");
    println!("|---|---|---|---|---|---|---|");
    for name in scenes {
        let (scene, reference) = open(name)?;
        let stop = Stop { seconds: Some(seconds), ..Stop::default() };
        // What is left of the reference without the lights themselves.
        let direct = Settings { techniques: "hit".parse()?, max_length: 1, ..Settings::default() };
        let (_, direct) = render(&scene, direct, &stop)?;
        let expected = reference.mean()[1] - direct.mean()[1];
        for techniques in ["surf+pp3d", "surf+pb2d", "surf+bb1d"] {
            let mut bias: Vec<Estimate> = Vec::new();
            for divisor in [1.0, 2.0, 4.0] {
                let radius = Radius::Scene(EXPONENT_RADIUS / divisor);
                let settings = Settings {
                    techniques: techniques.parse()?,
                    radii: Radii::all(radius),
                    progressive: false,
                    min_length: 2,
                    ..Settings::default()
                };
                let (_, spread) = render(&scene, settings, &stop)?;
                bias.push(spread.mean()[1] - expected);
            }
            let percent: Vec<String> = bias
                .iter()
                .map(|b| {
                    format!("{:+.3} ± {:.3}", 100.0 * b.mean / expected.mean, 100.0 * b.error / expected.mean)
                })
                .collect();
            let exponent = |coarse: &Estimate, fine: &Estimate| {
                let error =
                    (coarse.error / coarse.mean).hypot(fine.error / fine.mean) / std::f64::consts::LN_2;
                format!("{:.2} ± {error:.2}", (coarse.mean / fine.mean).abs().log2())
            };
            println!(
                "| {name} | {techniques} | {} | {} | {} |",
                percent.join(" | "),
                exponent(&bias[0], &bias[1]),
                exponent(&bias[1], &bias[2]),
            );
        }
    }
    Ok(())
}
