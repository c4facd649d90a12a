//! Kernel radii: where they start and how they shrink (`docs/theory.md`, section 5).

use serde::{Deserialize, Serialize};
use upbp_estimators::mis::VolumeMerges;
use upbp_estimators::{Kernel, Kernels, NO_LIMIT, PerMerge, RadiusField, Technique, TechniqueSet};

/// The largest radius of a kernel, scene units: single precision holds the values of all kernels.
pub(crate) const LARGEST_RADIUS: f32 = 1e12;

/// The most that automatic radii in a medium are in the first iteration, in mean free paths. With 1, merges
/// next to the surface of a ball that is lit from everywhere lose 5 to 7 % of the light in ten iterations.
pub(crate) const MOST_MEAN_FREE_PATHS: f32 = 0.3;

/// The first radius of a kernel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Radius {
    /// A radius that a few sub-paths tell: as many photons in a kernel as smooth well, within bounds relative
    /// to what the picture shows, over the scene as the width of a pixel, and in a medium at most some of its
    /// mean free paths. None follows the width of a pixel if one of them has another setting, nor mean free
    /// paths if that is one with photons in media.
    #[default]
    Auto,
    /// A fraction of the radius of the scene's bounding sphere; what comes of it is bounded as an
    /// [absolute](Self::Absolute) radius is.
    Scene(f32),
    /// A radius in scene units. From 1e-12 to 1e12 it is used as it is, and none below what single precision
    /// tells apart where the picture is; others are moved to the nearest of these.
    Absolute(f32),
}

/// The first radius of each merge technique.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Radii {
    /// Surface merging.
    pub surf: Radius,
    /// Photon points around points.
    pub pp3d: Radius,
    /// Photon points around query beams.
    pub pb2d: Radius,
    /// Photon beams around points.
    pub bp2d: Radius,
    /// Photon beams around query beams.
    pub bb1d: Radius,
}

impl Radii {
    /// First radii that are the same for all merge techniques.
    #[must_use]
    pub const fn all(radius: Radius) -> Self {
        Self { surf: radius, pp3d: radius, pb2d: radius, bp2d: radius, bb1d: radius }
    }

    /// The first radius of a technique; [automatic](Radius::Auto) if it does not merge.
    pub(crate) fn of(&self, technique: Technique) -> Radius {
        let Self { surf, pp3d, pb2d, bp2d, bb1d } = *self;
        PerMerge { surf, pp3d, pb2d, bp2d, bb1d }.get(technique).copied().unwrap_or(Radius::Auto)
    }

    /// Whether all that `techniques` use are [automatic](Radius::Auto).
    pub(crate) fn are_auto(&self, techniques: TechniqueSet) -> bool {
        techniques.iter().all(|technique| self.of(technique) == Radius::Auto)
    }
}

/// Radii over iterations and over the scene: `r_i(x) = r_0 (1 + i)^−γ φ(x)`.
///
/// `γ = 1/(d + 4)` for a kernel of `d` dimensions balances variance and squared bias of what merges alone can
/// find, and is consistent, since `0 < γ < 1/d` (section 5.1).
///
/// A technique that a choice of techniques has left out keeps its radius, which then has no effect.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RadiusSchedule {
    /// Radius of surface merging in iteration 0 where `φ` is one, scene units, as all of them; 0 if it cannot
    /// run.
    pub surf: f32,
    /// Radius of photon points around points, scene units; 0 if it cannot run.
    pub pp3d: f32,
    /// Radius of photon points around query beams, scene units; 0 if it cannot run.
    pub pb2d: f32,
    /// Radius of photon beams around points, scene units; 0 if it cannot run.
    pub bp2d: f32,
    /// Radius of photon beams around query beams, scene units; 0 if it cannot run.
    pub bb1d: f32,
    /// `φ`, the same for all techniques.
    pub field: RadiusField,
    /// The most that radii in a medium are in iteration 0, in mean free paths; `None` for no limit. They
    /// shrink as all do, and never below what coordinates in the medium have digits for.
    #[serde(default)]
    pub most_mean_free_paths: Option<f32>,
    /// Whether radii shrink at all.
    pub progressive: bool,
    /// Radii do not shrink below this, scene units: coordinates of what the picture shows have no more
    /// digits.
    pub floor: f32,
}

impl RadiusSchedule {
    /// The first radius of a technique, 0 if it does not merge.
    pub(crate) fn first(&self, technique: Technique) -> f32 {
        let Self { surf, pp3d, pb2d, bp2d, bb1d, .. } = *self;
        PerMerge { surf, pp3d, pb2d, bp2d, bb1d }.get(technique).copied().unwrap_or(0.0)
    }

    /// The radius of a technique in some iteration, or between two.
    fn at(&self, technique: Technique, iteration: f64) -> f32 {
        let first = self.first(technique);
        if first <= 0.0 {
            return 0.0;
        }
        let gamma = 1.0 / (f64::from(dimension(technique)) + 4.0);
        let shrink = if self.progressive { (1.0 + iteration).powf(-gamma) } else { 1.0 };
        ((f64::from(first) * shrink) as f32).max(first.min(self.floor / self.field.least()))
    }

    /// The kernels of an iteration where `φ` is one.
    pub(crate) fn kernels(&self, iteration: u64) -> Kernels {
        Kernels::from_fn(|technique| Kernel::of(technique, self.at(technique, iteration as f64)))
    }

    /// Most mean free paths of a radius in a medium in an iteration.
    pub(crate) fn mean_free_paths(&self, iteration: u64) -> VolumeMerges<f32> {
        let Some(most) = self.most_mean_free_paths else { return NO_LIMIT };
        VolumeMerges::from_fn(|technique| {
            let first = self.first(technique);
            if first > 0.0 { most * (self.at(technique, iteration as f64) / first) } else { f32::INFINITY }
        })
    }

    /// Photons within a kernel over those of the first iteration, mean over a number of iterations, which is
    /// about that of the one at a third of them; 1 for techniques that do not merge.
    pub(crate) fn mean_photons(&self, technique: Technique, iterations: f64) -> f64 {
        self.photons(technique, (iterations - 1.0) / 3.0)
    }

    /// Photons within a kernel over those of the first iteration, harmonic mean over a number of iterations:
    /// variances, whose sum the iterations have, are inverse to photons. About that of the one at two fifths.
    pub(crate) fn harmonic_mean_photons(&self, technique: Technique, iterations: f64) -> f64 {
        self.photons(technique, 0.42 * (iterations - 1.0))
    }

    /// Photons within a kernel in some iteration, or between two, over those of the first one.
    fn photons(&self, technique: Technique, iteration: f64) -> f64 {
        let first = self.first(technique);
        if first > 0.0 {
            (f64::from(self.at(technique, iteration)) / f64::from(first)).powi(dimension(technique))
        } else {
            1.0
        }
    }
}

/// Dimensions of the kernel of a technique, 0 if it does not merge.
const fn dimension(technique: Technique) -> i32 {
    match technique {
        Technique::Pp3d => 3,
        Technique::Surf | Technique::Pb2d | Technique::Bp2d => 2,
        Technique::Bb1d => 1,
        Technique::Hit | Technique::Nee | Technique::Connect | Technique::LightTracing => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radii_follow_the_optimal_exponents() {
        let schedule = RadiusSchedule {
            surf: 1.0,
            pp3d: 1.0,
            pb2d: 1.0,
            bp2d: 0.0,
            bb1d: 1.0,
            field: RadiusField::Uniform,
            most_mean_free_paths: None,
            progressive: true,
            floor: 1e-6,
        };
        let last = schedule.kernels(999);
        let slope = |radius: f32| f64::from(radius).ln() / 1000_f64.ln();
        assert!((slope(last.surf.radius()) + 1.0 / 6.0).abs() < 1e-6);
        assert!((slope(last.pp3d.radius()) + 1.0 / 7.0).abs() < 1e-6);
        assert!((slope(last.pb2d.radius()) + 1.0 / 6.0).abs() < 1e-6);
        assert!((slope(last.bb1d.radius()) + 1.0 / 5.0).abs() < 1e-6);
        assert_eq!(last.bp2d, Kernel::NONE);
        let fixed = RadiusSchedule { progressive: false, ..schedule };
        assert_eq!(fixed.kernels(999), fixed.kernels(0));
        assert_eq!(fixed.mean_photons(Technique::Pp3d, 999.0), 1.0);
        assert_eq!(schedule.mean_photons(Technique::Connect, 999.0), 1.0);
        for technique in [Technique::Surf, Technique::Pp3d, Technique::Pb2d, Technique::Bb1d] {
            for iterations in [1, 2, 5, 10, 100, 3000] {
                let photons = || (0..iterations).map(|i| schedule.photons(technique, f64::from(i)));
                let mean = photons().sum::<f64>() / f64::from(iterations);
                let found = schedule.mean_photons(technique, f64::from(iterations));
                assert!((found / mean - 1.0).abs() < 0.1, "{technique:?}, {iterations}: {found}, {mean}");
                let mean = f64::from(iterations) / photons().map(f64::recip).sum::<f64>();
                let found = schedule.harmonic_mean_photons(technique, f64::from(iterations));
                assert!((found / mean - 1.0).abs() < 0.03, "{technique:?}, {iterations}: {found}, {mean}");
            }
        }
    }
}
