//! The command line.

use std::error::Error;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::str::FromStr;

use clap::Parser;
use upbp_core::{Settings, TechniqueSet};

/// Renders scenes with several sets of techniques and compares their errors over time.
#[derive(Debug, Parser)]
#[command(version, about)]
pub(crate) struct Options {
    /// Scenes: names of reference scenes, `all` for every one of them, or pairs SCENE.ron=REF.exr
    #[arg(long, value_delimiter = ',', default_value = "all")]
    pub(crate) scenes: Vec<String>,
    /// Sets of techniques, separated by semicolons; `default` is the default one
    #[arg(long, value_delimiter = ';', default_value = "bpt;default")]
    pub(crate) sets: Vec<NamedSet>,
    /// Seeds; curves are geometric means over them
    #[arg(long, value_delimiter = ',', default_value = "1")]
    pub(crate) seeds: Vec<u64>,
    /// Seconds of rendering per scene, set and seed
    #[arg(long, value_name = "SECONDS", value_parser = positive, default_value = "30")]
    pub(crate) time: f64,
    /// Values of relMSE whose time is wanted
    #[arg(long, value_delimiter = ',', value_parser = positive, default_value = "1e-2,1e-3")]
    pub(crate) errors: Vec<f64>,
    /// Settings file (RON); sets and seeds override it
    #[arg(long, value_name = "FILE")]
    pub(crate) settings: Option<PathBuf>,
    /// Folder for the CSV file and the plots; it is made if it is not there
    #[arg(long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Threads [default: one per core]
    #[arg(long, value_name = "T")]
    pub(crate) threads: Option<NonZeroUsize>,
}

impl Options {
    /// The settings file, if there is one.
    pub(crate) fn settings(&self) -> Result<Settings, Box<dyn Error>> {
        let Some(path) = &self.settings else { return Ok(Settings::default()) };
        let text = std::fs::read_to_string(path)
            .map_err(|error| format!("cannot read {}: {error}", path.display()))?;
        Ok(Settings::from_ron(&text).map_err(|error| format!("{}:{error}", path.display()))?)
    }
}

/// A set of techniques with the name it was asked for.
#[derive(Clone, Debug)]
pub(crate) struct NamedSet {
    pub(crate) name: String,
    pub(crate) techniques: TechniqueSet,
}

impl FromStr for NamedSet {
    type Err = <TechniqueSet as FromStr>::Err;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let name = text.trim().to_owned();
        let techniques = if name == "default" { TechniqueSet::default() } else { name.parse()? };
        Ok(Self { name, techniques })
    }
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("expected a positive number".to_owned()),
    }
}
