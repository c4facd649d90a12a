//! The lower half of `docs/gallery.md`: the shipped scene with everything, its layers, each technique alone.
//!
//! `cargo run --release --example gallery [-- SECONDS [FOLDER]]` renders six pictures of equal time and
//! writes them and the layers of the first one as PNG files to `docs/images`. Layers are the weighted
//! contributions to the first picture, at the same exposure.

use std::error::Error;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use upbp_core::{Settings, Stop, ToneMapping, write_png};
use upbp_scene::ReadyScene;
use upbp_scene::description::Count;

/// Pixels per side.
const SIZE: u32 = 360;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let seconds: f64 = arguments.next().map_or(Ok(60.0), |text| text.parse())?;
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = arguments.next().map_or_else(|| root.join("docs/images"), PathBuf::from);
    std::fs::create_dir_all(&folder)?;

    let side = Count::new(SIZE)?;
    let scene = ReadyScene::load_with(root.join("examples/scenes/cornell_media.ron"), |description| {
        description.film.width = side;
        description.film.height = side;
    })?;
    let stop = Stop { seconds: Some(seconds), ..Stop::default() };
    for (name, techniques) in [
        ("all", "bpt+surf+pp3d+pb2d+bb1d"),
        ("only_bpt", "bpt"),
        ("only_surf", "surf"),
        ("only_pp3d", "pp3d"),
        ("only_pb2d", "pb2d"),
        ("only_bb1d", "bb1d"),
    ] {
        let settings = Settings { techniques: techniques.parse()?, ..Settings::default() };
        let mut renderer = scene.renderer(settings.validate()?)?;
        renderer.render(&stop, |_| ControlFlow::Continue(()));
        println!("{name}\n{}", renderer.report());
        write_png(&folder.join(format!("{name}.png")), &renderer.film().image(), ToneMapping::default())?;
        if name == "all" {
            for layer in renderer.film().layers() {
                if let Some(image) = renderer.film().layer(layer) {
                    let name = format!("layer_{}.png", layer.name());
                    write_png(&folder.join(name), &image, ToneMapping::default())?;
                }
            }
        }
    }
    Ok(())
}
