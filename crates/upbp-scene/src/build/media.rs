//! Media and their phase functions.

use upbp_media::{Homogeneous, MediaError, PhaseFunction};

use super::builder::Builder;
use crate::description::{Medium, Phase};

impl Builder<'_> {
    pub(super) fn media(&mut self) -> Vec<Homogeneous> {
        let mut media = Vec::new();
        for (name, medium) in self.description.media.iter() {
            match homogeneous(medium) {
                Ok(medium) => media.push(medium),
                Err(error) => self.problem(format!("medium `{name}`"), error),
            }
        }
        media
    }
}

fn homogeneous(medium: &Medium) -> Result<Homogeneous, MediaError> {
    let Medium::Homogeneous { sigma_a, sigma_s, phase, emission } = medium;
    Homogeneous::new(sigma_a.get(), sigma_s.get(), phase_function(phase)?)?.with_emission(emission.get())
}

fn phase_function(phase: &Phase) -> Result<PhaseFunction, MediaError> {
    match phase {
        Phase::Isotropic => Ok(PhaseFunction::Isotropic),
        Phase::Rayleigh => Ok(PhaseFunction::Rayleigh),
        Phase::HenyeyGreenstein(g) => PhaseFunction::henyey_greenstein(g.get()),
        Phase::Blend(parts) => {
            let parts = parts.iter().map(|(weight, part)| Ok((weight.get(), phase_function(part)?)));
            PhaseFunction::blend(parts.collect::<Result<_, _>>()?)
        }
    }
}
