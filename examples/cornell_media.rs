//! A scene file rendered for a minute: how the crates are wired together.
//!
//! `cargo run --release --example cornell_media [-- SCENE.ron [OUT.exr]]` renders the shipped scene, or
//! another one, and writes an OpenEXR image and a PNG beside it. The program `upbp` (`crates/upbp-cli`) does
//! the same with options, signals, and states to go on from.

use std::error::Error;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use indicatif::{ProgressBar, ProgressStyle};
use upbp_core::{
    Content, Output, Settings, Start, Stop, ToneMapping, check_outputs, describe, write_exr, write_png,
};
use upbp_scene::ReadyScene;

/// Ends after a minute, or when more iterations would hardly be seen.
const STOP: Stop = Stop { iterations: Some(400), seconds: Some(60.0), error: None };

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes/cornell_media.ron");
    let default = PathBuf::from("cornell_media.exr");
    let result = match arguments.as_slice() {
        [first, ..] if first.to_string_lossy().starts_with('-') => Err("there are no options".into()),
        [] => render(&shipped, &default),
        [scene] => render(scene, &default),
        [scene, output] => render(scene, output),
        _ => Err("expected a scene and an image to write".into()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {}\n\nUsage: cornell_media [SCENE.ron [OUT.exr]]", describe(&*error));
            ExitCode::from(2)
        }
    }
}

fn render(path: &Path, exr: &Path) -> Result<(), Box<dyn Error>> {
    // A scene: here from a file. Any other type that implements `upbp_core::scene::Scene` does, too
    // (`examples/host_renderer`).
    let scene = ReadyScene::load(path)?;

    // Nothing is written over what is read, or over a file of another kind; and better now than after the
    // work.
    let png = exr.with_extension("png");
    let outputs = [
        Output { role: "the image", path: exr, content: Content::Exr },
        Output { role: "the PNG beside it", path: &png, content: Content::Png },
    ];
    let read = scene.files().iter().map(|file| ("a file of the scene", file.as_path()));
    check_outputs(&outputs, &[("the scene", path)].into_iter().chain(read).collect::<Vec<_>>())?;

    // Settings are checked once. By default the renderer chooses its techniques from small pilot renders, for
    // the time that there is.
    let settings = Settings::default();
    let start = Start { stop: STOP, ..Start::default() };
    let mut renderer = scene.start_renderer(settings.validate()?, start)?;
    renderer.identify_scene(&path.display().to_string(), &scene.hash().to_le_bytes());

    let bar = ProgressBar::new(100).with_style(ProgressStyle::with_template("{elapsed} {wide_bar} {msg}")?);
    renderer.render(&STOP, |now| {
        bar.set_position((100.0 * now.fraction) as u64);
        bar.set_message(format!("iteration {}", now.iterations));
        ControlFlow::Continue(())
    });
    bar.finish();

    // All that is known of the render is in its state.
    let report = renderer.report();
    write_exr(exr, renderer.state(), &report)?;
    write_png(&png, &renderer.film().image(), ToneMapping::default())?;
    println!("{report}wrote {} and {}", exr.display(), png.display());
    Ok(())
}
