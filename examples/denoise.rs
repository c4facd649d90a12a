//! Denoises a rendered image by Intel's Open Image Denoise, where its program `oidnDenoise` is installed.
//!
//! `cargo run --release --example denoise -- IN.exr OUT.exr` reads an image of `upbp render --features`,
//! hands picture, albedo and normal over as PFM files, and writes what comes back, with a PNG beside it.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::{env, fs, io};

use exr::prelude::{AnyChannels, FlatSamples, read_first_flat_layer_from_file};
use upbp_core::{Content, Image, Output, ToneMapping, check_outputs, describe, write_image, write_png};

fn main() -> ExitCode {
    let arguments: Vec<_> = env::args_os().skip(1).map(PathBuf::from).collect();
    let result = match arguments.as_slice() {
        [_, output] if output.extension().is_none_or(|extension| extension != "exr") => {
            Err("the image to write is an OpenEXR file: its name ends in .exr".into())
        }
        [input, output] => denoise(input, output),
        _ => Err("expected an image and an image to write".into()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {}\n\nUsage: denoise IN.exr OUT.exr", describe(&*error));
            ExitCode::from(2)
        }
    }
}

fn denoise(input: &Path, output: &Path) -> Result<(), Box<dyn Error>> {
    let png = output.with_extension("png");
    let outputs = [
        Output { role: "the image", path: output, content: Content::Exr },
        Output { role: "the PNG beside it", path: &png, content: Content::Png },
    ];
    check_outputs(&outputs, &[("the noisy image", input)])?;
    let file = read_first_flat_layer_from_file(input)
        .map_err(|error| format!("{}: {error}", input.display()))?
        .layer_data;
    let image = |names: [&str; 3]| -> Result<Image, String> {
        let [r, g, b] = names.map(|name| samples(&file.channel_data, name));
        let (Some(r), Some(g), Some(b)) = (r, g, b) else {
            return Err(format!("{} has no layer {}: render with --features", input.display(), names[0]));
        };
        let pixels = r.iter().zip(g).zip(b).map(|((r, g), b)| [*r, *g, *b]).collect();
        Ok(Image { width: file.size.width() as u32, height: file.size.height() as u32, pixels })
    };
    let folder = env::temp_dir().join(format!("upbp-denoise-{}", std::process::id()));
    fs::create_dir(&folder)?;
    let result = (|| {
        let mut program = Command::new("oidnDenoise");
        for (option, names) in [
            ("--hdr", ["R", "G", "B"]),
            ("--alb", ["albedo.R", "albedo.G", "albedo.B"]),
            ("--nrm", ["normal.X", "normal.Y", "normal.Z"]),
        ] {
            let path = folder.join(format!("{}.pfm", &option[2..]));
            fs::write(&path, to_pfm(&image(names)?))?;
            program.arg(option).arg(path);
        }
        let denoised = folder.join("denoised.pfm");
        let status = program.arg("--output").arg(&denoised).status().map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => "oidnDenoise of Open Image Denoise is not in the PATH".to_owned(),
            _ => format!("oidnDenoise: {error}"),
        })?;
        if !status.success() {
            return Err(format!("oidnDenoise: {status}").into());
        }
        from_pfm(&fs::read(denoised)?)
    })();
    fs::remove_dir_all(&folder)?;
    let image = result?;
    write_image(output, &image)?;
    write_png(&png, &image, ToneMapping::default())?;
    println!("wrote {} and {}", output.display(), png.display());
    Ok(())
}

fn samples<'a>(channels: &'a AnyChannels<FlatSamples>, name: &str) -> Option<&'a [f32]> {
    match &channels.list.iter().find(|channel| channel.name == *name)?.sample_data {
        FlatSamples::F32(samples) => Some(samples),
        _ => None,
    }
}

/// A portable float map: rows from the bottom, the least byte first.
fn to_pfm(image: &Image) -> Vec<u8> {
    let mut bytes = format!("PF\n{} {}\n-1.0\n", image.width, image.height).into_bytes();
    let rows = image.pixels.chunks(image.width as usize).rev();
    bytes.extend(rows.flatten().flatten().flat_map(|value| value.to_le_bytes()));
    bytes
}

fn from_pfm(bytes: &[u8]) -> Result<Image, Box<dyn Error>> {
    let mut lines = bytes.splitn(4, |byte| *byte == b'\n');
    let mut line = || str::from_utf8(lines.next().unwrap_or_default());
    let (kind, size, scale) = (line()?, line()?, line()?);
    let size = size.split_once(' ').and_then(|(w, h)| Some((w.parse().ok()?, h.trim().parse().ok()?)));
    let (Some((width @ 1.., height)), "PF", Ok(-1.0)) = (size, kind, scale.trim().parse::<f32>()) else {
        return Err("what oidnDenoise wrote is no colour PFM file of this machine".into());
    };
    let values = lines.next().unwrap_or_default().chunks_exact(12).map(|pixel| {
        [0, 4, 8].map(|at| f32::from_le_bytes([pixel[at], pixel[at + 1], pixel[at + 2], pixel[at + 3]]))
    });
    let values: Vec<[f32; 3]> = values.collect();
    let pixels = values.chunks(width as usize).rev().flatten().copied().collect();
    Ok(Image { width, height, pixels })
}
