//! [`check_bsdf`]: sampling, density and value of a surface's scattering agree.

use std::f64::consts::{PI, TAU};

use glam::Vec3;

use super::{
    Check, ContractViolation, DRAWS, Random, direction, fail, is_density, is_light, is_unit, require, same,
    same_spectrum,
};
use crate::scene::{Bsdf, BsdfSample, Interface, Walk};

/// Cells of the grid of directions: equal steps of the polar angle and of the azimuth.
const THETA_CELLS: usize = 32;
const PHI_CELLS: usize = 32;
/// Points per cell and axis at which a density is integrated at first, and how often a cell may be halved.
/// Odd, so that a jump in the middle of a cell does not look converged.
const QUADRATURE: u32 = 5;
const MAX_HALVINGS: u32 = 6;

/// Checks the contract of [`Bsdf`] with the given indices, for directions of arrival on both sides, from
/// normal to grazing.
///
/// Lobes narrower than about 2° may fall between the points at which densities are integrated first.
pub fn check_bsdf(bsdf: &impl Bsdf, interface: Interface) -> Check {
    for (case, theta_degrees) in
        [0.0_f64, 20.0, 50.0, 75.0, 86.0, 94.0, 120.0, 160.0, 180.0].into_iter().enumerate()
    {
        let from = direction(theta_degrees.to_radians(), 0.7 + case as f64);
        check_bsdf_from(bsdf, interface, from, case as u64)?;
    }
    Ok(())
}

fn check_bsdf_from(bsdf: &impl Bsdf, interface: Interface, from: Vec3, seed: u64) -> Check {
    let continuation = bsdf.continuation(from);
    require(continuation > 0.0 && continuation <= 1.0, "continuation is in (0, 1]", (from, continuation))?;

    let albedo = bsdf.albedo(from);
    let share = is_light(albedo) && (0..3).all(|channel| albedo[channel] <= 1.001);
    require(share, "albedo is in [0, 1]", (from, albedo))?;

    let (expected, total) = integrate_pdf(bsdf, interface, from)?;
    require(total <= 1.01, "pdf integrates to at most one", (from, total))?;
    if !bsdf.is_connectible() {
        require(total == 0.0, "without a smooth lobe pdf is zero", (from, total))?;
    }

    let mut random = Random(seed);
    let mut observed = vec![0_u32; THETA_CELLS * PHI_CELLS];
    // Dirac lobes on the side of `from` and on the other: number of draws and their probability.
    let mut dirac = [(0_u32, 0.0_f32); 2];
    // By side and walk.
    let mut is_checked = [[false; 2]; 2];
    let mut rest = 0_u32;
    for draw in 0..DRAWS {
        let (u_lobe, u) = (random.next(), random.pair());
        let walk = if draw % 2 == 0 { Walk::Light } else { Walk::Camera };
        let Some(sample) = bsdf.sample(from, walk, interface, u_lobe, u) else {
            rest += 1;
            continue;
        };
        check_bsdf_sample(bsdf, interface, from, walk, &sample)?;
        if sample.delta {
            rest += 1;
            let side = usize::from(sample.to.z * from.z < 0.0);
            let lobe = &mut dirac[side];
            if !std::mem::replace(&mut is_checked[side][draw % 2], true) {
                check_dirac_reverse(bsdf, interface, from, walk, &sample, &mut random)?;
            }
            *lobe = (lobe.0 + 1, sample.pdf);
        } else {
            observed[cell(sample.to)] += 1;
        }
    }
    for (count, probability) in dirac {
        let (mean, p) = (DRAWS as f64 * f64::from(probability), f64::from(probability));
        let error = (mean * (1.0 - p)).sqrt() + 1.0;
        let within = (f64::from(count) - mean).abs() <= 5.0 * error;
        require(within, "a Dirac lobe is drawn with its probability", (from, count, mean))?;
    }
    compare_histogram(&observed, &expected, rest, 1.0 - total, from)
}

/// A walk the other way has the probability that a Dirac lobe reports of it, and carries as much.
fn check_dirac_reverse(
    bsdf: &impl Bsdf,
    interface: Interface,
    from: Vec3,
    walk: Walk,
    sample: &BsdfSample,
    random: &mut Random,
) -> Check {
    /// Draws, by which a lobe is found that has at least the [least](LEAST) probability.
    const MOST: usize = 4000;
    const LEAST: f32 = 0.005;
    let other = walk.other();
    let is_back = |back: &BsdfSample| back.delta && back.to.distance(from) < 1e-3;
    let draw = |_| bsdf.sample(sample.to, other, interface, random.next(), random.pair());
    let back = (0..MOST).map(draw).find_map(|back| back.filter(is_back));
    let case = (from, walk, sample, back);
    let Some(back) = back else {
        return require(sample.pdf_reverse < LEAST, "a Dirac lobe leads back as probably as it says", case);
    };
    let agrees = same(back.pdf, sample.pdf_reverse) && same(back.pdf_reverse, sample.pdf);
    require(agrees, "a Dirac lobe leads back as probably as it says", case)?;
    let index = |direction: Vec3| if direction.z > 0.0 { interface.above } else { interface.below };
    let flux = |from: Vec3, walk: Walk, sample: &BsdfSample| {
        let is_compressed = walk == Walk::Camera && from.z * sample.to.z < 0.0;
        let ratio = if is_compressed { index(from) / index(sample.to) } else { 1.0 };
        sample.weight * (sample.pdf / (ratio * ratio))
    };
    let is_same = same_spectrum(flux(from, walk, sample), flux(sample.to, other, &back));
    require(is_same, "a Dirac lobe is reciprocal up to the squared index", case)
}

/// The rules for a single draw.
fn check_bsdf_sample(
    bsdf: &impl Bsdf,
    interface: Interface,
    from: Vec3,
    walk: Walk,
    sample: &BsdfSample,
) -> Check {
    let case = (from, walk, sample);
    require(is_unit(sample.to), "a sampled direction is a unit vector", case)?;
    require(is_light(sample.weight), "a weight is finite and not negative", case)?;
    require(is_density(sample.pdf) && sample.pdf > 0.0, "what is sampled has a density", case)?;
    require(is_density(sample.pdf_reverse), "a reverse density is finite and not negative", case)?;
    if sample.delta {
        let discrete = sample.pdf <= 1.0 && sample.pdf_reverse <= 1.0;
        return require(discrete, "a Dirac lobe reports probabilities", case);
    }
    require(bsdf.is_connectible(), "a smooth lobe can be connected to", case)?;
    let (forward, reverse) = (bsdf.pdf(from, sample.to, interface), bsdf.pdf(sample.to, from, interface));
    require(same(forward, sample.pdf), "sample reports the density that pdf gives", (case, forward))?;
    require(same(reverse, sample.pdf_reverse), "pdf_reverse is pdf of the reversed event", (case, reverse))?;
    let (light, camera) = match walk {
        Walk::Light => (from, sample.to),
        Walk::Camera => (sample.to, from),
    };
    let value = bsdf.eval(light, camera, interface);
    require(is_light(value), "a value is finite and not negative", (case, value))?;
    let at_once = bsdf.evaluate(from, sample.to, walk, interface);
    let agrees = at_once.map_or(value.is_black(), |at_once| {
        let [own, other] = [from, sample.to].map(|from| bsdf.continuation(from));
        same_spectrum(at_once.value, value)
            && same(at_once.pdf, forward)
            && same(at_once.pdf_reverse, reverse)
            && same(at_once.continuation, own)
            && same(at_once.continuation_reverse, other)
    });
    require(agrees, "evaluate says what eval, pdf and continuation say", (case, at_once))?;
    let weight = value * (sample.to.z.abs() / sample.pdf);
    require(same_spectrum(weight, sample.weight), "weight is eval · |cos| / pdf", (case, weight))?;
    let index = |direction: Vec3| if direction.z > 0.0 { interface.above } else { interface.below };
    let back = bsdf.eval(camera, light, interface) * (index(camera) / index(light)).powi(2);
    require(same_spectrum(value, back), "eval is reciprocal up to the squared index", (case, value, back))
}

fn cell(direction: Vec3) -> usize {
    let theta = f64::from(direction.x.hypot(direction.y)).atan2(f64::from(direction.z));
    let phi = f64::from(direction.y).atan2(f64::from(direction.x));
    let row = (theta / PI * THETA_CELLS as f64) as usize;
    let column = (phi.rem_euclid(TAU) / TAU * PHI_CELLS as f64) as usize;
    row.min(THETA_CELLS - 1) * PHI_CELLS + column.min(PHI_CELLS - 1)
}

/// `∫ pdf dω` over each cell, and over all.
fn integrate_pdf(
    bsdf: &impl Bsdf,
    interface: Interface,
    from: Vec3,
) -> Result<(Vec<f64>, f64), ContractViolation> {
    let mut violation = None;
    let mut density = |theta: f64, phi: f64| {
        let to = direction(theta, phi);
        let pdf = bsdf.pdf(from, to, interface);
        if !is_density(pdf) {
            violation = Some((from, to, pdf));
            return 0.0;
        }
        f64::from(pdf) * theta.sin()
    };
    let (rows, columns) = (THETA_CELLS as f64, PHI_CELLS as f64);
    let cells: Vec<f64> = (0..THETA_CELLS * PHI_CELLS)
        .map(|cell| {
            let size = [PI / rows, TAU / columns];
            let corner = [(cell / PHI_CELLS) as f64 * size[0], (cell % PHI_CELLS) as f64 * size[1]];
            let coarse = midpoint_rule(&mut density, corner, size);
            integrate_cell(&mut density, corner, size, coarse, MAX_HALVINGS)
        })
        .collect();
    if let Some(case) = violation {
        return fail("a density is finite and not negative", case);
    }
    let total = cells.iter().sum();
    Ok((cells, total))
}

/// Refines a cell until its integral no longer changes: a lobe at grazing incidence is long and thin.
fn integrate_cell(
    density: &mut impl FnMut(f64, f64) -> f64,
    corner: [f64; 2],
    size: [f64; 2],
    coarse: f64,
    halvings: u32,
) -> f64 {
    let half = size.map(|side| 0.5 * side);
    let quarters = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
        .map(|[i, j]| [corner[0] + i * half[0], corner[1] + j * half[1]])
        .map(|corner| (corner, midpoint_rule(density, corner, half)));
    let fine: f64 = quarters.iter().map(|(_, integral)| integral).sum();
    if halvings == 0 || (fine - coarse).abs() <= 1e-3 * fine + 1e-7 {
        return fine;
    }
    quarters
        .iter()
        .map(|&(corner, integral)| integrate_cell(density, corner, half, integral, halvings - 1))
        .sum()
}

fn midpoint_rule(density: &mut impl FnMut(f64, f64) -> f64, corner: [f64; 2], size: [f64; 2]) -> f64 {
    let step = size.map(|side| side / f64::from(QUADRATURE));
    let mut sum = 0.0;
    for i in 0..QUADRATURE {
        for j in 0..QUADRATURE {
            let at = [f64::from(i) + 0.5, f64::from(j) + 0.5];
            sum += density(corner[0] + at[0] * step[0], corner[1] + at[1] * step[1]);
        }
    }
    sum * step[0] * step[1]
}

/// Pearson's test of draws per cell, and of those in no cell, against probabilities.
fn compare_histogram(observed: &[u32], expected: &[f64], rest: u32, rest_share: f64, from: Vec3) -> Check {
    let mut statistic = 0.0;
    let mut classes = 0_u32;
    let mut add = |count: f64, mean: f64| {
        // The quadrature's own error, a fraction of a per cent of the mean, is no fault of the density.
        let excess = ((count - mean).abs() - 3e-3 * mean).max(0.0);
        statistic += excess * excess / mean;
        classes += 1;
    };
    // Cells too empty for the normal approximation go together.
    let (mut pooled_count, mut pooled_mean) = (0.0, 0.0);
    let all = observed.iter().zip(expected).map(|(&count, &share)| (count, share));
    for (count, share) in all.chain([(rest, rest_share.max(0.0))]) {
        let (count, mean) = (f64::from(count), share * DRAWS as f64);
        if mean >= 10.0 {
            add(count, mean);
        } else {
            pooled_count += count;
            pooled_mean += mean;
        }
    }
    if pooled_mean >= 10.0 {
        add(pooled_count, pooled_mean);
    } else {
        let excess = pooled_count > pooled_mean + 5.0 * (pooled_mean + 10.0).sqrt();
        require(!excess, "nothing is drawn where the density is zero", (from, pooled_count, pooled_mean))?;
    }
    // Wilson and Hilferty 1931: the cube root of χ²/k is normal. 4.75 standard deviations are 10⁻⁶.
    let k = f64::from(classes.max(1));
    let limit = k * (1.0 - 2.0 / (9.0 * k) + 4.75 * (2.0 / (9.0 * k)).sqrt()).powi(3);
    require(statistic <= limit, "frequencies follow the density", (from, statistic, limit, classes))
}
