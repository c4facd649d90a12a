//! Phase functions: the distribution of directions after a collision.
//!
//! All directions are directions of *propagation*, before and after the collision: equal vectors mean
//! straight on. Values are normalised over the sphere in every channel. A grey value is also the density that
//! [`PhaseFunction::sample`] draws with; where the channels differ, the density is the mean of the three.
//!
//! Source: `docs/theory.md`, sections 1.1 and 7. Oracles: quadrature over the sphere and histograms.

mod blend;
mod deflection;
mod draine;
mod henyey_greenstein;
mod per_channel;
mod rayleigh;
mod tabulated;
#[cfg(test)]
mod tests;

use glam::Vec3;

pub use self::blend::Blend;
use self::deflection::{Deflection, UNIFORM, isotropic};
pub use self::draine::Draine;
pub use self::henyey_greenstein::Asymmetry;
pub use self::per_channel::PerChannel;
pub use self::tabulated::Tabulated;
use crate::{Lanes, MediaError, Spectrum};

/// The largest single-precision number below one.
const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

/// A phase function, symmetric about the direction of propagation.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum PhaseFunction {
    /// Equal in all directions: `1 / 4π` per steradian.
    Isotropic,
    /// One lobe, forward for positive asymmetry and backward for negative.
    HenyeyGreenstein(Asymmetry),
    /// Scattering by particles much smaller than the wavelength, unpolarised.
    Rayleigh,
    /// The lobe of Henyey and Greenstein times `1 + α cos² θ`.
    Draine(Draine),
    /// Linear in the cosine between the angles of a table.
    Tabulated(Tabulated),
    /// A weighted sum of others.
    Blend(Blend),
    /// One for each channel.
    PerChannel(PerChannel),
}

/// The value of a phase function between two directions, and the density of its sampling.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct PhaseValue {
    /// Value per steradian, at most three times the density in each channel.
    pub value: Spectrum,
    /// Density per steradian with which a walk without lanes draws the direction; one in lane `c` draws it
    /// with `value[c]`.
    pub pdf: f32,
}

impl PhaseValue {
    /// A value that is equal in all channels, and is the density.
    #[inline]
    const fn grey(value: f32) -> Self {
        Self { value: Spectrum::splat(value), pdf: value }
    }
}

/// A direction drawn from a phase function, by a walk in the lanes `L`.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct PhaseSample<L = f64> {
    /// Unit direction of propagation after the collision.
    pub after: Vec3,
    /// Value over the mean density of the lanes with their shares; one if the channels do not differ.
    pub weight: Spectrum,
    /// Density of the draw in each lane, per steradian. Zero, and the weight with it, if the direction was
    /// rounded out of what a table allows.
    pub pdf: L,
}

impl PhaseFunction {
    /// The Henyey-Greenstein phase function with asymmetry (mean cosine) `g`.
    ///
    /// # Errors
    ///
    /// Unless `-1 < g < 1`.
    pub fn henyey_greenstein(g: f32) -> Result<Self, MediaError> {
        Ok(Self::HenyeyGreenstein(Asymmetry::new(g)?))
    }

    /// Two lobes of Henyey and Greenstein; the first has the `share` of all scattering.
    ///
    /// # Errors
    ///
    /// Unless both asymmetries are above -1 and below 1, and the share above 0 and below 1.
    pub fn two_lobes(g: [f32; 2], share: f32) -> Result<Self, MediaError> {
        if !(share > 0.0 && share < 1.0) {
            let (what, expected) = ("the share of the first lobe", "a number above 0 and below 1");
            return Err(MediaError::OutOfRange { what, value: share, expected });
        }
        let [first, second] = g.map(Self::henyey_greenstein);
        Self::blend(vec![(share, first?), (1.0 - share, second?)])
    }

    /// The phase function of Draine: that of Henyey and Greenstein with asymmetry `g` times `1 + α cos² θ`.
    ///
    /// # Errors
    ///
    /// Unless `-1 < g < 1` and `α` is finite and not negative.
    pub fn draine(g: f32, alpha: f32) -> Result<Self, MediaError> {
        Ok(Self::Draine(Draine::new(g, alpha)?))
    }

    /// Mie scattering of visible light by the water droplets of fog and clouds, by their diameter in
    /// micrometres: the blend that Jendersie and d'Eon fitted (2023). It has the forward peak and the rise
    /// backwards, and neither fogbow nor glory, which take a [table](Self::tabulated).
    ///
    /// # Errors
    ///
    /// Unless the diameter is above 0 and at most 50; the best fit is from 5.
    pub fn droplets(diameter_um: f32) -> Result<Self, MediaError> {
        let ([g, g_draine, alpha], share) = draine::droplets(diameter_um)?;
        Self::blend(vec![(1.0 - share, Self::henyey_greenstein(g)?), (share, Self::draine(g_draine, alpha)?)])
    }

    /// A table of angles in degrees and values in any unit, linear in the cosine between the angles. Each
    /// channel is scaled to an integral of one.
    ///
    /// # Errors
    ///
    /// Unless the angles rise from 0 to 180 by at least 0.001, and the values are finite and not negative, in
    /// every channel not all zero.
    pub fn tabulated(rows: &[(f32, Spectrum)]) -> Result<Self, MediaError> {
        let channel = |channel: usize| {
            Tabulated::new(rows.iter().map(|(degrees, value)| (*degrees, value[channel])))
                .map(Self::Tabulated)
        };
        Ok(Self::per_channel([channel(0)?, channel(1)?, channel(2)?]))
    }

    /// A phase function for each of red, green and blue. Of one that itself has three, its own channel
    /// counts; three that are equal become one.
    #[must_use]
    pub fn per_channel(channels: [Self; 3]) -> Self {
        let per_channel = PerChannel::new(channels);
        let [r, g, b] = per_channel.channels();
        if r == g && g == b { r.clone() } else { Self::PerChannel(per_channel) }
    }

    /// A sum of phase functions, with weights that are scaled to add up to one. Blends among the parts
    /// are taken apart; parts below the range of `f32` beside the others are left out.
    ///
    /// # Errors
    ///
    /// If there is no part, or a weight is not finite and positive.
    pub fn blend(parts: Vec<(f32, PhaseFunction)>) -> Result<Self, MediaError> {
        Ok(Self::Blend(Blend::new(parts)?))
    }

    /// The value per steradian between two unit directions of propagation.
    ///
    /// Keeps its digits at the tip of a narrow peak, where a cosine in single precision has none left.
    /// Symmetric in its arguments.
    #[inline]
    #[must_use]
    pub fn eval(&self, before: Vec3, after: Vec3) -> PhaseValue {
        self.value(Deflection::between(before, after))
    }

    /// Draws the direction after a collision, for a unit direction `before` and two uniform numbers in `[0,
    /// 1)`, by a walk with this hero whose lanes have `shares`.
    #[inline]
    #[must_use]
    pub fn sample<L: Lanes>(
        &self,
        before: Vec3,
        hero: L::Hero,
        shares: &L::Shares,
        u: [f32; 2],
    ) -> PhaseSample<L> {
        let after = self.sample_direction(before, L::channel(hero), u);
        // From the direction as it was rounded, not from `u`: in a narrow peak the two differ by percents,
        // and whoever evaluates the density later only has the direction.
        let value = self.eval(before, after);
        let pdf = L::of_phase(&value);
        let mean = pdf.mean(shares) as f32;
        let weight = if mean > 0.0 { value.value / mean } else { Spectrum::ZERO };
        PhaseSample { after, weight, pdf }
    }

    /// Whether two channels see different phase functions.
    pub(crate) fn differs(&self, channel: usize, other: usize) -> bool {
        match self {
            Self::Blend(_) | Self::PerChannel(_) => self.channel(channel) != self.channel(other),
            _ => false,
        }
    }

    /// For each channel the factor by which the second moment of a walk grows where it scatters, if
    /// directions are drawn by [`sample`](Self::sample): `∫ ρ_c² / p dω`. One if channels do not differ.
    pub(crate) fn turn_growth(&self) -> [f64; 3] {
        /// Points of the quadrature, over the distribution of the channel.
        const POINTS: u32 = 1024;
        /// One over the golden ratio.
        const STEP: f64 = 0.618_033_988_749_894_8;
        if !(self.differs(0, 1) || self.differs(0, 2)) {
            return [1.0; 3];
        }
        [0, 1, 2].map(|channel| {
            let ratio = |i: u32| {
                let u = [(f64::from(i) + 0.5) / f64::from(POINTS), (STEP * f64::from(i)).fract()];
                let after = self.sample_direction(Vec3::Z, Some(channel), u.map(|u| u as f32));
                let PhaseValue { value, pdf } = self.eval(Vec3::Z, after);
                if pdf > 0.0 { f64::from(value[channel] / pdf) } else { 0.0 }
            };
            (0..POINTS).map(ratio).sum::<f64>() / f64::from(POINTS)
        })
    }

    /// Mean cosine of the angle between the directions of propagation, in `(-1, 1)`.
    #[must_use]
    pub fn mean_cosine(&self) -> Spectrum {
        match self {
            Self::Isotropic | Self::Rayleigh => Spectrum::ZERO,
            Self::HenyeyGreenstein(g) => Spectrum::splat(g.get()),
            Self::Draine(draine) => Spectrum::splat(draine.mean_cosine()),
            Self::Tabulated(table) => Spectrum::splat(table.mean_cosine()),
            Self::Blend(blend) => blend.mean_cosine(),
            Self::PerChannel(channels) => channels.mean_cosine(),
        }
    }

    /// The phase function that one channel sees.
    fn channel(&self, channel: usize) -> Self {
        match self {
            Self::Blend(blend) => Self::Blend(blend.channel(channel)),
            Self::PerChannel(channels) => channels.channels()[channel].clone(),
            grey => grey.clone(),
        }
    }

    #[inline]
    fn value(&self, deflection: Deflection<f32>) -> PhaseValue {
        PhaseValue::grey(match self {
            Self::Isotropic => UNIFORM,
            Self::HenyeyGreenstein(g) => henyey_greenstein::value(*g, deflection),
            Self::Rayleigh => rayleigh::value(deflection),
            Self::Draine(draine) => draine.value(deflection),
            Self::Tabulated(table) => table.value(deflection),
            Self::Blend(blend) => return blend.value(deflection),
            Self::PerChannel(channels) => return channels.value(deflection),
        })
    }

    /// Draws the direction after a collision, for one channel or for any.
    #[inline]
    fn sample_direction(&self, before: Vec3, channel: Option<usize>, [u_angle, u_azimuth]: [f32; 2]) -> Vec3 {
        let deflection = match self {
            Self::Isotropic => isotropic(u_angle),
            Self::HenyeyGreenstein(g) => henyey_greenstein::sample(*g, f64::from(u_angle)),
            Self::Rayleigh => rayleigh::sample(u_angle),
            Self::Draine(draine) => draine.sample(u_angle),
            Self::Tabulated(table) => table.sample(u_angle),
            Self::Blend(blend) => {
                let (part, u_azimuth) = blend.choose(u_azimuth);
                return part.sample_direction(before, channel, [u_angle, u_azimuth]);
            }
            Self::PerChannel(channels) => {
                let (part, u_azimuth) = match channel {
                    Some(channel) => (&channels.channels()[channel], u_azimuth),
                    None => channels.choose(u_azimuth),
                };
                return part.sample_direction(before, None, [u_angle, u_azimuth]);
            }
        };
        deflection.direction(before, u_azimuth)
    }
}
