//! Light that the facets of a rough surface send to each other, which a model of single scattering loses.
//!
//! With `E(μ)` the share of light from a direction of cosine `μ` that is scattered once and leaves, what is
//! missing, `m = 1 − E`, is given back by a smooth lobe. With the sides s and o of the surface, values as in
//! [`RoughDielectric`](super::RoughDielectric) without the index that compresses radiance,
//!
//! ```text
//! reflected:  a_s m_s(μ_i) m_s(μ_c)        M_s = ∫ m_s μ dω
//! passed:     b m_s(μ_i) m_o(μ_c)          a_s M_s + η_o² b M_o = 1
//! ```
//!
//! is reciprocal, and scatters just what is missing from either side, for any `b`. Taken is the largest with
//! which no more of the missing light passes than does, from that side, of the light that is scattered once.
//!
//! Source: Kulla and Conty, "Revisiting Physically Based Shading at Imageworks", SIGGRAPH courses 2017, for
//! reflection. Oracle: `tests::rough_glass_loses_nothing`.

use std::f32::consts::FRAC_1_PI;
use std::sync::OnceLock;

use glam::Vec3;

use super::facet::scattered;
use super::fresnel::refraction;
use super::local::sample_cosine;
use super::trowbridge_reitz::TrowbridgeReitz;

/// Nodes along the root of the roughness, from 0 to 1.
const ROUGHNESSES: usize = 33;
/// Nodes along the root, with its sign, of the contrast of indices, `(η_to − η_from) / (η_to + η_from)`. Odd,
/// so that one is 0, where the missing light has a kink.
const CONTRASTS: usize = 65;
/// Contrast of the outermost nodes, that of indices as different as scenes allow.
const LARGEST_CONTRAST: f32 = 0.98;
/// Nodes along the cosine.
const COSINES: usize = 48;
/// Facets that are drawn for each node, by a Fibonacci lattice.
const FACETS: u32 = 987;
const FIBONACCI: u32 = 610;
/// Points at which missing light is summed over cosines.
const POINTS: u32 = 512;
/// Least mean of what is missing for there to be a lobe.
const LEAST: f32 = 1e-7;

/// The missing light of one roughness and contrast, from the side of the light.
#[derive(Clone, Copy)]
struct Row {
    /// At the nodes along the cosine.
    missing: [f32; COSINES],
    /// Mean over directions, `2 ∫ m μ dμ`.
    mean: f32,
    /// Share that passes of the light that is scattered once, mean over directions.
    passed: f32,
}

/// Rows by roughness and contrast, filled as they are needed.
static TABLE: [[OnceLock<Row>; CONTRASTS]; ROUGHNESSES] =
    [const { [const { OnceLock::new() }; CONTRASTS] }; ROUGHNESSES];

/// The row of two nodes.
fn row(i: usize, j: usize) -> &'static Row {
    TABLE[i][j].get_or_init(|| {
        let root = 2.0 * j as f32 / (CONTRASTS - 1) as f32 - 1.0;
        Row::new((i as f32 / (ROUGHNESSES - 1) as f32).powi(2), LARGEST_CONTRAST * root * root.abs())
    })
}

/// Place of a cosine among the nodes, from 0 to 1. Masking is a function of `μ / α` near the horizon.
fn place(mu: f32, alpha: f32) -> f32 {
    mu * (1.0 + alpha) / (mu + alpha)
}

impl Row {
    /// By drawing facets that the light sees.
    fn new(alpha: f32, contrast: f32) -> Self {
        if alpha == 0.0 {
            return Self { missing: [0.0; COSINES], mean: 0.0, passed: 1.0 };
        }
        let normals = TrowbridgeReitz { alpha };
        let eta = (1.0 + contrast) / (1.0 - contrast);
        let at = |place: f32| {
            // The horizon itself sees no facet from the front.
            let mu = (place * alpha / (1.0 + alpha - place)).clamp(1e-4, 1.0);
            let mut sums = [0.0; 2];
            for i in 0..FACETS {
                let u = [i, i * FIBONACCI % FACETS].map(|k| (k as f32 + 0.5) / FACETS as f32);
                let parts = scattered_once(normals, mu, eta, u);
                sums = [sums[0] + parts[0], sums[1] + parts[1]];
            }
            sums.map(|sum| sum / FACETS as f32)
        };
        let nodes: [_; COSINES] = std::array::from_fn(|k| at(k as f32 / (COSINES - 1) as f32));
        let missing = nodes.map(|[reflected, passed]| (1.0 - reflected - passed).max(0.0));
        let mean_of = |value: &dyn Fn(f32) -> f32| {
            let mu = |i| (i as f32 + 0.5) / POINTS as f32;
            (0..POINTS).map(|i| 2.0 * mu(i) * value(place(mu(i), alpha))).sum::<f32>() / POINTS as f32
        };
        let passed = mean_of(&|place| interpolate(&nodes.map(|[_, passed]| passed), place));
        let mean = mean_of(&|place| interpolate(&missing, place));
        Self { missing, mean, passed: passed / (1.0 - mean) }
    }
}

/// Linear interpolation between nodes at equal steps; `place` from 0 to 1.
fn interpolate(nodes: &[f32], place: f32) -> f32 {
    let (index, part) = split(place, nodes.len());
    (1.0 - part) * nodes[index] + part * nodes[index + 1]
}

/// The node below a place from 0 to 1, and the part of the way to the next.
fn split(place: f32, nodes: usize) -> (usize, f32) {
    let scaled = place.clamp(0.0, 1.0) * (nodes - 1) as f32;
    let index = (scaled as usize).min(nodes - 2);
    (index, scaled - index as f32)
}

/// The missing light from one side: four rows and their parts.
struct Side {
    alpha: f32,
    rows: [(&'static Row, f32); 4],
    mean: f32,
    passed: f32,
}

impl Side {
    fn new(alpha: f32, eta_from: f32, eta_to: f32) -> Self {
        let contrast = (eta_to - eta_from) / (eta_to + eta_from) / LARGEST_CONTRAST;
        let root = contrast.abs().sqrt().copysign(contrast);
        let (i, a) = split(alpha.sqrt(), ROUGHNESSES);
        let (j, c) = split(0.5 * (root + 1.0), CONTRASTS);
        let rows = [
            (row(i, j), (1.0 - a) * (1.0 - c)),
            (row(i, j + 1), (1.0 - a) * c),
            (row(i + 1, j), a * (1.0 - c)),
            (row(i + 1, j + 1), a * c),
        ];
        let sum = |value: fn(&Row) -> f32| rows.iter().map(|(row, part)| part * value(row)).sum();
        Self { alpha, rows, mean: sum(|row| row.mean), passed: sum(|row| row.passed) }
    }

    fn missing(&self, cos: f32) -> f32 {
        let place = place(cos.abs(), self.alpha);
        self.rows.iter().map(|(row, part)| part * interpolate(&row.missing, place)).sum()
    }
}

/// The lobe of light that facets send to each other, for light from one side.
pub(super) struct Lobe {
    from: Side,
    to: Side,
    /// Share of the lobe that passes the surface.
    passes: f32,
    /// The same for light from the other side.
    passes_back: f32,
    eta_to: f32,
}

/// The lobe between two directions, for light from the first and for light from the second.
pub(super) struct LobeParts {
    /// Value, without the index that compresses radiance.
    pub(super) value: f32,
    /// Shares of the light that the lobe scatters.
    pub(super) shares: [f32; 2],
    /// Densities of the direction that the light leaves in.
    pub(super) pdfs: [f32; 2],
}

impl Lobe {
    /// The lobe between two indices of refraction; `None` if nothing is missing.
    pub(super) fn new(normals: TrowbridgeReitz, [eta_from, eta_to]: [f32; 2]) -> Option<Self> {
        let from = Side::new(normals.alpha, eta_from, eta_to);
        let to = Side::new(normals.alpha, eta_to, eta_from);
        if from.mean < LEAST || to.mean < LEAST {
            return None;
        }
        let ratio = (eta_to / eta_from).powi(2) * to.mean / from.mean;
        let passes = from.passed.min(to.passed * ratio);
        Some(Self { from, to, passes, passes_back: passes / ratio, eta_to })
    }

    /// Share of the light from this direction that the lobe scatters.
    pub(super) fn share(&self, cos_from: f32) -> f32 {
        self.from.missing(cos_from)
    }

    /// Draws a direction of the lobe.
    pub(super) fn sample(&self, from: Vec3, u_side: f32, u: [f32; 2]) -> Vec3 {
        let to = sample_cosine(from, u);
        if u_side < self.passes { Vec3::new(to.x, to.y, -to.z) } else { to }
    }

    /// The lobe between two directions. They are cosine-weighted on either side.
    pub(super) fn between(&self, cos_from: f32, cos_to: f32) -> LobeParts {
        let (side, parts, eta) = if cos_from * cos_to > 0.0 {
            (&self.from, [1.0 - self.passes; 2], 1.0)
        } else {
            (&self.to, [self.passes, self.passes_back], self.eta_to)
        };
        let shares = [self.from.missing(cos_from), side.missing(cos_to)];
        LobeParts {
            value: FRAC_1_PI * parts[0] * shares[0] * shares[1] / (side.mean * eta * eta),
            shares,
            pdfs: [parts[0] * cos_to.abs(), parts[1] * cos_from.abs()].map(|pdf| FRAC_1_PI * pdf),
        }
    }
}

/// The parts of the light from a direction with the cosine `mu` that a facet, drawn among those which it
/// sees, reflects and refracts out of the surface; `eta` is the index beyond over that on this side.
fn scattered_once(normals: TrowbridgeReitz, mu: f32, eta: f32, u: [f32; 2]) -> [f32; 2] {
    let above = Vec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, mu);
    let Some(normal) = normals.sample_visible(above, u) else { return [0.0; 2] };
    let reflectance = refraction(above.dot(normal).clamp(0.0, 1.0), 1.0, eta).reflectance;
    let leaves = |reflects| {
        let to = scattered(above, normal, [1.0, eta], reflects);
        to.map_or(0.0, |to| normals.shadowing_masking(above, to) / normals.masking(above))
    };
    [reflectance * leaves(true), (1.0 - reflectance) * leaves(false)]
}
