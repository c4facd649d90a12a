//! The test beds: scenes as people have them, with all meshes made by code.
//!
//! `cargo run --release --example make_beds [-- FOLDER]` writes six scenes with their meshes and a sky
//! (default `out/beds`), in a second, always the same bytes; then `upbp render out/beds/terrace.ron`.

mod bathroom;
mod hall;
mod mesh;
mod milk;
mod sky;
mod still_life;
mod street_lamp;
mod terrace;
#[cfg(test)]
mod tests;
mod vessel;

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Parser;
use mesh::Mesh;

/// Writes six scenes with their meshes and a sky.
#[derive(Parser)]
struct Options {
    /// Folder to write to
    #[arg(value_name = "FOLDER", default_value = "out/beds")]
    folder: PathBuf,
}

/// A scene and the meshes that it names.
struct Bed {
    name: &'static str,
    /// The scene file, from `examples/scenes/beds`.
    scene: &'static str,
    /// Names of meshes, without ending, and the crease angles of their normals in degrees.
    meshes: Vec<(&'static str, Mesh, f64)>,
}

fn beds() -> [Bed; 6] {
    [terrace::bed(), bathroom::bed(), still_life::bed(), street_lamp::bed(), hall::bed(), milk::bed()]
}

/// Writes everything to a folder; meshes to a folder of the scene's name in it.
fn write(beds: &[Bed], folder: &Path) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(folder)?;
    sky::write(&folder.join("sky.exr"))?;
    for bed in beds {
        std::fs::create_dir_all(folder.join(bed.name))?;
        for (name, mesh, crease) in &bed.meshes {
            std::fs::write(folder.join(bed.name).join(format!("{name}.obj")), mesh.to_obj(*crease))?;
        }
        std::fs::write(folder.join(format!("{}.ron", bed.name)), bed.scene)?;
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let Options { folder } = Options::parse();
    let beds = beds();
    write(&beds, &folder)?;
    for bed in &beds {
        let triangles: usize = bed.meshes.iter().map(|(_, mesh, _)| mesh.triangles.len()).sum();
        println!("{}: {triangles} triangles", folder.join(format!("{}.ron", bed.name)).display());
    }
    Ok(())
}
