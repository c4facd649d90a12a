//! A foreign renderer's scene, rendered with nothing but `upbp-core`.
//!
//! `cargo run --release --example host_renderer` writes `host_renderer.exr` and `host_renderer.png`.

mod scene;
#[cfg(test)]
mod tests;

use std::error::Error;
use std::ops::ControlFlow;
use std::path::Path;

use upbp_core::{Renderer, Settings, Start, Stop, ToneMapping, write_exr, write_png};

fn main() -> Result<(), Box<dyn Error>> {
    let room = scene::Room::new(256)?;
    let settings = Settings::default();
    let stop = Stop { seconds: Some(20.0), ..Stop::default() };
    // The choice of techniques has to know how much time there is.
    let start = Start { stop, ..Start::default() };
    let mut renderer = Renderer::start(&room, settings.validate()?, start)?;
    // Room::new(256): what its content depends on.
    renderer.identify_scene("host room", &256_u32.to_le_bytes());
    renderer.render(&stop, |now| {
        println!("{:3.0} %, estimated relMSE {}", 100.0 * now.fraction, now.estimated_error);
        ControlFlow::Continue(())
    });
    let report = renderer.report();
    println!("{report}");
    write_exr(Path::new("host_renderer.exr"), renderer.state(), &report)?;
    write_png(Path::new("host_renderer.png"), &renderer.film().image(), ToneMapping::default())?;
    Ok(())
}
