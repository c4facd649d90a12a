//! Phase functions from tables: measured, or from the theory of Mie.
//!
//! Source: `docs/theory.md`, section 7. Oracle: `tests` of the parent module.

use std::f64::consts::TAU;
use std::sync::Arc;

use super::deflection::Deflection;
use crate::MediaError;

/// The smallest distance of two angles of a table in degrees: some 300 roundings of a direction.
const MIN_STEP: f32 = 0.001;

/// A phase function that is linear in the cosine between the angles of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Tabulated {
    /// From straight on to the horizon.
    forward: Hemisphere,
    /// From straight back to the horizon.
    backward: Hemisphere,
}

/// Half of a table, by `x = 1 − |cos θ|`: a peak at its pole keeps all digits.
#[derive(Clone, Debug, PartialEq)]
struct Hemisphere {
    /// Shared by clones: a scene may name a long table many times.
    nodes: Arc<[Node]>,
}

#[derive(Copy, Clone, Debug, PartialEq)]
struct Node {
    /// `1 − |cos θ|`, in `[0, 1]`.
    x: f32,
    /// Density per steradian.
    density: f32,
    /// Probability of a direction between the pole and this node.
    below: f64,
}

impl Tabulated {
    /// From angles in degrees, which rise from 0 to 180, and values in any unit.
    pub(super) fn new(rows: impl ExactSizeIterator<Item = (f32, f32)>) -> Result<Self, MediaError> {
        let rows = checked(rows)?;
        let cosine = |degrees: f32| f64::from(degrees).to_radians().cos();
        // The horizon belongs to both halves.
        let after = rows.partition_point(|&(degrees, _)| degrees < 90.0);
        let ((angle0, value0), (angle1, value1)) = (rows[after - 1], rows[after]);
        let horizon = if angle1 == 90.0 {
            f64::from(value1)
        } else {
            let (cos0, cos1) = (cosine(angle0), cosine(angle1));
            (f64::from(value1) * cos0 - f64::from(value0) * cos1) / (cos0 - cos1)
        };
        let half = |rows: &mut dyn Iterator<Item = (f32, f32)>| {
            let pole = rows.map(|(degrees, value)| {
                let sine = (0.5 * f64::from(degrees).to_radians()).sin();
                ((2.0 * sine * sine) as f32, f64::from(value))
            });
            pole.chain([(1.0, horizon)]).collect::<Vec<_>>()
        };
        let forward = half(&mut rows[..after].iter().copied());
        let beyond = rows[after..].iter().rev().filter(|&&(degrees, _)| degrees > 90.0);
        let backward = half(&mut beyond.map(|&(degrees, value)| (180.0 - degrees, value)));
        let integral = integral(&forward) + integral(&backward);
        let rounded =
            |nodes: Vec<(f32, f64)>| nodes.into_iter().map(move |(x, value)| (x, (value / integral) as f32));
        let forward = Hemisphere::new(rounded(forward));
        let backward = Hemisphere::new(rounded(backward));
        let whole = forward.probability() + backward.probability();
        if !(integral > 0.0 && whole.is_finite()) {
            let (what, expected) = ("the integral of the table", "a number above zero");
            return Err(MediaError::OutOfRange { what, value: integral as f32, expected });
        }
        Ok(Self { forward: forward.scaled(whole.recip()), backward: backward.scaled(whole.recip()) })
    }

    #[inline]
    pub(super) fn value(&self, deflection: Deflection<f32>) -> f32 {
        if deflection.one_minus_cos < deflection.one_plus_cos {
            self.forward.value(deflection.one_minus_cos)
        } else {
            self.backward.value(deflection.one_plus_cos)
        }
    }

    pub(super) fn mean_cosine(&self) -> f32 {
        (self.forward.moment() - self.backward.moment()) as f32
    }

    /// The angle at the fraction `u` of the distribution, counted from straight back.
    pub(super) fn sample(&self, u: f32) -> Deflection<f64> {
        let u = f64::from(u);
        if u < self.backward.probability() {
            let one_plus_cos = self.backward.sample(u);
            Deflection { one_minus_cos: 2.0 - one_plus_cos, one_plus_cos }
        } else {
            let one_minus_cos = self.forward.sample(1.0 - u);
            Deflection { one_minus_cos, one_plus_cos: 2.0 - one_minus_cos }
        }
    }
}

impl Hemisphere {
    fn new(nodes: impl Iterator<Item = (f32, f32)>) -> Self {
        let mut made: Vec<Node> = Vec::new();
        for (x, density) in nodes {
            let below = made.last().map_or(0.0, |before| {
                before.below + cell([(before.x, f64::from(before.density)), (x, f64::from(density))])
            });
            made.push(Node { x, density, below });
        }
        Self { nodes: made.into() }
    }

    /// The half with probabilities that make up for the rounding of densities.
    fn scaled(self, scale: f64) -> Self {
        Self { nodes: self.nodes.iter().map(|node| Node { below: node.below * scale, ..*node }).collect() }
    }

    /// Probability of a direction in this half.
    fn probability(&self) -> f64 {
        self.nodes[self.nodes.len() - 1].below
    }

    #[inline]
    fn value(&self, x: f32) -> f32 {
        let end = self.nodes.partition_point(|node| node.x < x).clamp(1, self.nodes.len() - 1);
        let (a, b) = (&self.nodes[end - 1], &self.nodes[end]);
        // Both shares from differences: beside a tall node the value of a low one would not survive.
        let (from_a, to_b) = ((x - a.x).max(0.0), (b.x - x).max(0.0));
        (a.density * to_b + b.density * from_a) / (b.x - a.x)
    }

    /// The mean of `|cos θ|` over the sphere, counting this half alone.
    fn moment(&self) -> f64 {
        let in_cell = |cell: &[Node]| {
            let [(x0, p0), (x1, p1)] =
                [&cell[0], &cell[1]].map(|node| (f64::from(node.x), f64::from(node.density)));
            // ∫ (1 − x) p dx of a linear p, by Simpson's rule: exact.
            let middle = (1.0 - 0.5 * (x0 + x1)) * 2.0 * (p0 + p1);
            TAU * (x1 - x0) / 6.0 * ((1.0 - x0) * p0 + middle + (1.0 - x1) * p1)
        };
        self.nodes.windows(2).map(in_cell).sum()
    }

    /// `1 − |cos θ|` below which directions have the probability `below`.
    fn sample(&self, below: f64) -> f64 {
        // Never in a cell without probability, not even at the ends.
        let below = below.max(f64::MIN_POSITIVE).min(self.probability());
        let end = self.nodes.partition_point(|node| node.below < below).clamp(1, self.nodes.len() - 1);
        let (a, b) = (&self.nodes[end - 1], &self.nodes[end]);
        let share = ((below - a.below) / (b.below - a.below)).clamp(0.0, 1.0);
        let (p0, p1) = (f64::from(a.density), f64::from(b.density));
        // The root of a quadratic, in the form that does not cancel for equal densities.
        let root = (p0 * p0 + share * (p1 * p1 - p0 * p0)).max(0.0).sqrt();
        let t = share * (p0 + p1) / (p0 + root);
        let (x0, x1) = (f64::from(a.x), f64::from(b.x));
        x0 + t.clamp(0.0, 1.0) * (x1 - x0)
    }
}

fn checked(rows: impl ExactSizeIterator<Item = (f32, f32)>) -> Result<Vec<(f32, f32)>, MediaError> {
    if rows.len() == 0 {
        let (what, expected) = ("the table of a phase function", "at least the angles 0 and 180 degrees");
        return Err(MediaError::Empty { what, expected });
    }
    let last = rows.len() - 1;
    let mut checked: Vec<(f32, f32)> = Vec::with_capacity(last + 1);
    for (index, (degrees, value)) in rows.enumerate() {
        /// Angles are single-precision numbers near to what a table says.
        const LEAST_DIFFERENCE: f32 = 0.95 * MIN_STEP;
        let what = "angle";
        let wrong = |expected| Err(MediaError::EntryOutOfRange { what, index, value: degrees, expected });
        let rises = checked.last().is_none_or(|&(before, _)| degrees - before >= LEAST_DIFFERENCE);
        match index {
            0 if degrees != 0.0 => return wrong("0 degrees, where tables start"),
            _ if index == last && degrees != 180.0 => return wrong("180 degrees, where tables end"),
            _ if !rises => return wrong("at least 0.001 degrees more than the angle before"),
            _ => {}
        }
        if !(value.is_finite() && value >= 0.0) {
            let (what, expected) = ("value", "a finite number of at least zero");
            return Err(MediaError::EntryOutOfRange { what, index, value, expected });
        }
        checked.push((degrees, value));
    }
    Ok(checked)
}

/// The integral over a cell between two pairs of `1 − |cos θ|` and density.
fn cell([(x0, p0), (x1, p1)]: [(f32, f64); 2]) -> f64 {
    TAU * 0.5 * (f64::from(x1) - f64::from(x0)) * (p0 + p1)
}

fn integral(nodes: &[(f32, f64)]) -> f64 {
    nodes.windows(2).map(|nodes| cell([nodes[0], nodes[1]])).sum()
}
