//! The command line.

use std::error::Error;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::str::FromStr;

use clap::Parser;
use upbp_core::{Settings, Techniques};

/// The set that is judged: the choice of the program.
pub(crate) const AUTO: &str = "auto";
/// Everything, whether it helps or not.
pub(crate) const EVERYTHING: &str = "everything";

/// Sets of a whole run.
const SETS: [&str; 10] = [
    AUTO,
    EVERYTHING,
    "pt",
    "bpt",
    "pt+lt",
    "bpt+surf",
    "bpt+surf+pp3d",
    "bpt+surf+pb2d",
    "bpt+surf+bb1d",
    "bpt+pb2d",
];
/// Sets of a quick run.
const QUICK_SETS: [&str; 5] = [AUTO, EVERYTHING, "pt", "bpt", "bpt+surf"];
/// Seeds of a whole run, of which a quick one takes the first.
const SEEDS: [u64; 3] = [1, 2, 3];
/// Seconds per line of a whole run: with all scenes less than half an hour.
const SECONDS: f64 = 3.0;
/// Seconds per line of a quick run: with all scenes less than five minutes.
const QUICK_SECONDS: f64 = 2.0;

/// Renders scenes with several sets of techniques and compares their errors over time.
#[derive(Debug, Parser)]
#[command(version, about)]
pub(crate) struct Options {
    /// Scenes: names of shipped ones, `suite` for all 18, `all` for the ten whose reference another renderer
    /// made, or pairs SCENE.ron=REF.exr
    #[arg(long, value_delimiter = ',', default_value = "suite")]
    pub(crate) scenes: Vec<String>,
    /// Sets of techniques, separated by semicolons; `auto` is the choice of the program, `everything`
    /// bpt+surf+pp3d+pb2d+bb1d [default: auto, everything, and eight smaller ones]
    #[arg(long, value_delimiter = ';')]
    sets: Vec<NamedSet>,
    /// Seeds; curves are geometric means over them [default: 1,2,3]
    #[arg(long, value_delimiter = ',')]
    seeds: Vec<u64>,
    /// Seconds of rendering per scene, set and seed [default: 3]
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    time: Option<f64>,
    /// Fewer sets, one seed and 2 seconds where nothing else is given
    #[arg(long)]
    pub(crate) quick: bool,
    /// Values of relMSE whose time is wanted
    #[arg(long, value_delimiter = ',', value_parser = positive, default_value = "1e-2,1e-3")]
    pub(crate) errors: Vec<f64>,
    /// Settings file (RON); sets and seeds override it
    #[arg(long, value_name = "FILE")]
    pub(crate) settings: Option<PathBuf>,
    /// Folder for the CSV file and the plots; it is made if it is not there
    #[arg(long, value_name = "FOLDER", default_value = "out/errors")]
    pub(crate) out: PathBuf,
    /// Threads [default: one per core]
    #[arg(long, value_name = "T")]
    pub(crate) threads: Option<NonZeroUsize>,
}

impl Options {
    /// The sets that were asked for.
    pub(crate) fn sets(&self) -> Result<Vec<NamedSet>, <NamedSet as FromStr>::Err> {
        let preset: &[&str] = if self.quick { &QUICK_SETS } else { &SETS };
        if self.sets.is_empty() {
            preset.iter().map(|name| name.parse()).collect()
        } else {
            Ok(self.sets.clone())
        }
    }

    pub(crate) fn seeds(&self) -> Vec<u64> {
        match (self.seeds.is_empty(), self.quick) {
            (false, _) => self.seeds.clone(),
            (true, true) => SEEDS[..1].to_vec(),
            (true, false) => SEEDS.to_vec(),
        }
    }

    /// Seconds per scene, set and seed.
    pub(crate) fn seconds(&self) -> f64 {
        self.time.unwrap_or(if self.quick { QUICK_SECONDS } else { SECONDS })
    }

    /// The settings file, if there is one.
    pub(crate) fn settings(&self) -> Result<Settings, Box<dyn Error>> {
        let Some(path) = &self.settings else { return Ok(Settings::default()) };
        let text =
            upbp_core::read_text(path).map_err(|error| format!("cannot read {}: {error}", path.display()))?;
        Ok(Settings::from_ron(&text).map_err(|error| format!("{}:{error}", path.display()))?)
    }
}

/// A set of techniques with the name it was asked for.
#[derive(Clone, Debug)]
pub(crate) struct NamedSet {
    pub(crate) name: String,
    pub(crate) techniques: Techniques,
}

impl NamedSet {
    /// Whether the program chooses.
    pub(crate) fn is_auto(&self) -> bool {
        self.name == AUTO
    }
}

impl FromStr for NamedSet {
    type Err = <Techniques as FromStr>::Err;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let name = text.trim().to_owned();
        let techniques = match name.as_str() {
            EVERYTHING => "bpt+surf+pp3d+pb2d+bb1d".parse()?,
            other => other.parse()?,
        };
        Ok(Self { name, techniques })
    }
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("expected a positive number".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(arguments: &[&str]) -> Options {
        Options::parse_from([&["time_to_error", "--out", "x"], arguments].concat())
    }

    #[test]
    fn what_is_given_overrides_the_presets() {
        let names = |options: &Options| -> Vec<String> {
            options.sets().unwrap().into_iter().map(|set| set.name).collect()
        };
        let (whole, quick) = (parse(&[]), parse(&["--quick"]));
        assert_eq!((whole.seeds().len(), quick.seeds().len()), (3, 1));
        assert!(quick.seconds() < whole.seconds());
        assert!(names(&quick).iter().all(|name| names(&whole).contains(name)));
        let given = parse(&["--quick", "--sets", "pt; bpt+surf", "--seeds", "7,8", "--time", "5"]);
        assert_eq!(names(&given), ["pt", "bpt+surf"]);
        assert_eq!((given.seeds(), given.seconds()), (vec![7, 8], 5.0));
    }

    #[test]
    fn everything_is_an_alias() {
        let everything: NamedSet = "everything".parse().unwrap();
        assert_eq!(everything.techniques, "bpt+surf+pp3d+pb2d+bb1d".parse().unwrap());
        assert!(!everything.is_auto());
        assert!("everthing".parse::<NamedSet>().is_err());
    }
}
