//! Media and their phase functions.

use std::collections::BTreeMap;

use upbp_media::{Homogeneous, MediumId, PhaseFunction};

use super::builder::Builder;
use crate::description::{Medium, Phase, SceneDescription, tabulated};
use crate::error::Shortened;
use crate::phase_table;

/// Numbers of the media that something is filled with: a scene need not be ready for others.
pub(super) fn number(description: &SceneDescription) -> BTreeMap<&str, MediumId> {
    let used = description.used_media();
    let names = description.media.names().filter(|name| used.contains(name));
    names.zip(0..).map(|(name, number)| (name, MediumId(number))).collect()
}

impl Builder<'_> {
    /// The media that have a number, in its order; `None` if there are problems with any.
    pub(super) fn media(&mut self, ids: &BTreeMap<&str, MediumId>) -> Option<Vec<Homogeneous>> {
        let mut media = Vec::new();
        for (name, medium) in self.description.media.iter() {
            let made = self.homogeneous(medium);
            let made =
                made.map_err(|error| self.problem(format!("medium `{}`", Shortened(name)), error)).ok();
            if made.is_none() || ids.contains_key(name) {
                media.push(made);
            }
        }
        media.into_iter().collect()
    }

    fn homogeneous(&mut self, medium: &Medium) -> Result<Homogeneous, String> {
        let Medium::Homogeneous { sigma_a, sigma_s, phase, emission, glow } = medium;
        if !emission.get().is_black() && (emission.get() * sigma_a.get()).is_black() {
            return Err(
                "`emission` is that of what absorbs, and `sigma_a` is 0 there; a `glow` needs none".into()
            );
        }
        let phase = self.phase_function(phase)?;
        Homogeneous::new(sigma_a.get(), sigma_s.get(), phase)
            .and_then(|medium| medium.with_emission(emission.get()))
            .and_then(|medium| medium.with_glow(glow.get()))
            .map_err(|error| error.to_string())
    }

    fn phase_function(&mut self, phase: &Phase) -> Result<PhaseFunction, String> {
        let made = match phase {
            Phase::Isotropic => Ok(PhaseFunction::Isotropic),
            Phase::Rayleigh => Ok(PhaseFunction::Rayleigh),
            Phase::HenyeyGreenstein(g) => {
                let [r, g, b] = g.get().to_array().map(PhaseFunction::henyey_greenstein);
                r.and_then(|r| Ok(PhaseFunction::per_channel([r, g?, b?])))
            }
            Phase::TwoLobes { g, share } => PhaseFunction::two_lobes(g.map(Into::into), share.get()),
            Phase::Draine { g, alpha } => PhaseFunction::draine(g.get(), alpha.get()),
            Phase::Droplets(diameter) => PhaseFunction::droplets(diameter.get()),
            Phase::Table(rows) => tabulated(rows),
            Phase::TableFile { file } => return self.phase_table(file),
            Phase::Blend(parts) => {
                let parts = parts.iter().map(|(weight, part)| Ok((weight.get(), self.phase_function(part)?)));
                PhaseFunction::blend(parts.collect::<Result<_, String>>()?)
            }
            Phase::PerChannel { r, g, b } => {
                let [r, g, b] = [r, g, b].map(|phase| self.phase_function(phase));
                Ok(PhaseFunction::per_channel([r?, g?, b?]))
            }
        };
        made.map_err(|error| error.to_string())
    }

    fn phase_table(&mut self, file: &str) -> Result<PhaseFunction, String> {
        if let Some(known) = self.tables.get(file) {
            return known.clone();
        }
        let path = self.path(file);
        let bytes = self.open(&path, phase_table::MAX_FILE).map_err(|error| error.to_string());
        let table = bytes.and_then(phase_table::read);
        let table = table.map_err(|error| format!("table `{}`: {error}", self.shown_path(file)));
        self.tables.insert(file.to_owned(), table.clone());
        table
    }
}
