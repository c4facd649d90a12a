//! Oracles of the unit tests: quadrature, random numbers with a fixed seed, and a goodness-of-fit test.

use glam::Vec3;

/// Quantile of the standard normal distribution at which the tests reject: a right sampler fails with
/// probability 3·10⁻⁵, once, when the seed is chosen.
const REJECT: f64 = 4.0;

/// `SplitMix64`.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in `[0, 1)`, a multiple of 2⁻²⁴.
    pub(crate) fn uniform(&mut self) -> f32 {
        (self.bits() >> 40) as f32 * (-24.0_f32).exp2()
    }

    /// Uniform on the unit sphere.
    pub(crate) fn direction(&mut self) -> Vec3 {
        let z = 2.0 * self.uniform() - 1.0;
        let (sin, cos) = (std::f32::consts::TAU * self.uniform()).sin_cos();
        let radius = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(radius * cos, radius * sin, z).normalize()
    }
}

/// `∫_a^b f`, by five-point Gauss-Legendre on `panels` equal intervals.
pub(crate) fn integrate(f: impl Fn(f64) -> f64, a: f64, b: f64, panels: usize) -> f64 {
    const NODES: [(f64, f64); 5] = [
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
        (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ];
    let half = 0.5 * (b - a) / panels as f64;
    let panel = |index: usize| {
        let middle = a + (2 * index + 1) as f64 * half;
        NODES.iter().map(|(x, weight)| weight * f(middle + half * x)).sum::<f64>() * half
    };
    (0..panels).map(panel).sum()
}

/// `∫_0^b f` for a function that varies by powers of `x`: panels that halve towards zero.
pub(crate) fn integrate_towards_zero(f: impl Fn(f64) -> f64, b: f64) -> f64 {
    let octave = |k: i32| integrate(&f, b * 0.5_f64.powi(k + 1), b * 0.5_f64.powi(k), 4);
    (0..100).map(octave).sum()
}

/// Asserts that counts fit their expectations, by Pearson's χ² at the significance of [`REJECT`].
pub(crate) fn assert_fits(observed: &[u32], expected: &[f64], what: &str) {
    assert_eq!(observed.len(), expected.len());
    assert!(expected.iter().all(|&count| count > 20.0), "{what}: cells too small");
    let chi2: f64 = observed
        .iter()
        .zip(expected)
        .map(|(&observed, expected)| (f64::from(observed) - expected).powi(2) / expected)
        .sum();
    // The Wilson-Hilferty approximation of the quantile.
    let freedom = (observed.len() - 1) as f64;
    let a = 2.0 / (9.0 * freedom);
    let limit = freedom * (1.0 - a + REJECT * a.sqrt()).powi(3);
    assert!(chi2 < limit, "{what}: chi-square {chi2} above {limit} with {freedom} degrees of freedom");
}

/// Asserts that numbers are uniform in `[0, 1)`, in 64 cells.
pub(crate) fn assert_uniform(numbers: impl Iterator<Item = f64>, what: &str) {
    let mut cells = [0_u32; 64];
    for number in numbers {
        assert!((-1e-9..1.0 + 1e-9).contains(&number), "{what}: {number}");
        cells[((number * 64.0) as usize).min(63)] += 1;
    }
    let total: u32 = cells.iter().sum();
    assert_fits(&cells, &[f64::from(total) / 64.0; 64], what);
}
