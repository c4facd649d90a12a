//! Tone mapping: linear radiance of any size becomes values that a screen can show.

use std::str::FromStr;

/// Radiance of middle grey, which both curves leave as it is.
#[cfg(test)]
const MIDDLE_GREY: f32 = 0.18;

/// The way from linear radiance to a PNG: exposure first, then the tone curve, then the transfer curve of
/// sRGB.
///
/// The default keeps all values that a screen can show and clips the others.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToneMapping {
    /// Exposure in stops: radiance is multiplied by two to the power of this.
    pub exposure: f32,
    /// Curve for values near one and above.
    pub curve: ToneCurve,
}

/// A curve from exposed radiance to linear values in `[0, 1]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneCurve {
    /// Values are clipped to `[0, 1]`, each channel for itself.
    #[default]
    Plain,
    /// Highlights roll off and lose their colour as they do on film, shadows become a little darker, and
    /// middle grey (0.18) stays where it is. White is reached at 17.6.
    ///
    /// The curve is S. Hill's fit of the reference transforms of the Academy Color Encoding System (ACES) for
    /// an sRGB screen.
    Filmic,
}

impl ToneCurve {
    /// All curves.
    pub const ALL: [Self; 2] = [Self::Plain, Self::Filmic];

    /// The name of the curve: `plain` or `filmic`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::Filmic => "filmic",
        }
    }
}

impl FromStr for ToneCurve {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|curve| curve.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(" or ");
            format!("expected {names}, found `{name}`")
        })
    }
}

impl ToneMapping {
    /// The linear values that a screen shows for the radiance of a pixel, in `[0, 1]` where that is not NaN.
    #[must_use]
    pub fn apply(&self, radiance: [f32; 3]) -> [f32; 3] {
        let exposed = radiance.map(|value| value * self.exposure.exp2());
        match self.curve {
            ToneCurve::Plain => exposed,
            ToneCurve::Filmic => filmic(exposed),
        }
        .map(|value| value.clamp(0.0, 1.0))
    }
}

fn filmic(radiance: [f32; 3]) -> [f32; 3] {
    /// From linear sRGB to the primaries in which the curve holds, and back.
    const IN: [[f32; 3]; 3] =
        [[0.597_19, 0.354_58, 0.048_23], [0.076_00, 0.908_34, 0.015_66], [0.028_40, 0.133_83, 0.837_77]];
    const OUT: [[f32; 3]; 3] = [
        [1.604_75, -0.531_08, -0.073_67],
        [-0.102_08, 1.108_13, -0.006_05],
        [-0.003_27, -0.072_76, 1.076_02],
    ];
    /// Keeps middle grey.
    const SCALE: f32 = 1.459_4;
    /// Far above white, and small enough for squares.
    const BRIGHTEST: f32 = 1e6;
    let mix =
        |rows: [[f32; 3]; 3], v: [f32; 3]| rows.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
    let curve =
        |v: f32| (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951) + 0.238_081);
    mix(OUT, mix(IN, radiance.map(|value| (value * SCALE).clamp(0.0, BRIGHTEST))).map(curve))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filmic(exposure: f32, grey: f32) -> f32 {
        let mapping = ToneMapping { exposure, curve: ToneCurve::Filmic };
        let [r, g, b] = mapping.apply([grey; 3]);
        assert!((r - g).abs() < 1e-3 && (b - g).abs() < 1e-3, "grey stays grey: {r} {g} {b}");
        g
    }

    #[test]
    fn plain_clips_and_a_stop_doubles() {
        let plain = ToneMapping::default();
        let values = [0.3, 7.0, -1.0];
        assert_eq!(plain.apply(values), [0.3, 1.0, 0.0]);
        assert_eq!(ToneMapping { exposure: 1.0, ..plain }.apply(values), [0.6, 1.0, 0.0]);
        assert_eq!(ToneMapping { exposure: -2.0, ..plain }.apply([0.3, 7.0, 2.0]), [0.075, 1.0, 0.5]);
    }

    #[test]
    fn filmic_keeps_middle_grey_and_rolls_off() {
        assert_eq!(filmic(0.0, 0.0), 0.0);
        assert!((filmic(0.0, MIDDLE_GREY) - MIDDLE_GREY).abs() < 1e-3, "{}", filmic(0.0, MIDDLE_GREY));
        assert!((filmic(1.0, 0.5 * MIDDLE_GREY) - MIDDLE_GREY).abs() < 1e-3);
        let values: Vec<f32> = (0..80).map(|n| filmic(0.0, 0.01 * 1.1_f32.powi(n))).collect();
        assert!(values.is_sorted(), "{values:?}");
        assert!(filmic(0.0, 1.0) < 0.8 && filmic(0.0, 17.0) < 1.0 && filmic(0.0, 18.0) == 1.0);
    }

    #[test]
    fn filmic_highlights_lose_their_colour() {
        let mapping = ToneMapping { exposure: 0.0, curve: ToneCurve::Filmic };
        let [red, green, blue] = mapping.apply([30.0, 1.0, 1.0]);
        assert!(red == 1.0 && green > 0.6 && blue > 0.3, "{red} {green} {blue}");
    }

    #[test]
    fn nothing_is_out_of_range() {
        let all = [0.0, -1.0, 1e-45, 1e38, f32::MAX, f32::INFINITY, f32::NEG_INFINITY];
        for curve in ToneCurve::ALL {
            for exposure in [-20.0, 0.0, 20.0] {
                for value in all {
                    let shown = ToneMapping { exposure, curve }.apply([value, 1.0, 0.0]);
                    assert!(
                        shown.iter().all(|v| (0.0..=1.0).contains(v)),
                        "{curve:?} {exposure} {value}: {shown:?}"
                    );
                }
                assert!(ToneMapping { exposure, curve }.apply([f32::NAN; 3])[0].is_nan());
            }
        }
    }

    #[test]
    fn curves_have_names() {
        assert_eq!(ToneCurve::ALL.map(|curve| curve.name().parse()), ToneCurve::ALL.map(Ok));
        assert_eq!("film".parse::<ToneCurve>().unwrap_err(), "expected plain or filmic, found `film`");
    }
}
