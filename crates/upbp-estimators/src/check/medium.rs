//! [`check_medium`]: densities of a medium describe its sampling.

use upbp_media::{Medium, RaySegment, SegmentDensity};

use super::{Check, DRAWS, Random, is_light, require};
use crate::scene::BoundingSphere;

/// Segments that are looked at.
const SEGMENTS: usize = 16;

/// Cells of the histogram of distances.
const CELLS: usize = 8;

/// Checks the contract of [`Medium`] on random segments inside `bounds`: ranges of all values, that walks
/// pass and stop as often as `segment` says, and that transmittance is a product over pieces.
pub fn check_medium(medium: &impl Medium, bounds: &BoundingSphere) -> Check {
    let mut random = Random(13);
    let path = medium.mean_free_path();
    require(path > 0.0, "the mean free path is positive, or infinite", path)?;
    for _ in 0..SEGMENTS {
        let [a, b] = [(); 2].map(|()| bounds.centre + random.direction() * (bounds.radius * random.next()));
        let Some(direction) = (b - a).try_normalize() else { continue };
        let [start, length] = [bounds.radius * random.next(), a.distance(b)];
        let origin = a - direction * start;
        let segment = RaySegment { origin, direction, start, end: start + length };
        check_coefficients(medium, &segment)?;
        check_product(medium, &segment)?;
        check_distances(medium, &segment, &mut random)?;
    }
    Ok(())
}

fn check_coefficients(medium: &impl Medium, segment: &RaySegment) -> Check {
    let position = segment.at(segment.start);
    let (sigma_s, sigma_t) = (medium.sigma_s(position), medium.sigma_t(position));
    require(
        is_light(sigma_s) && is_light(sigma_t),
        "coefficients are finite and not negative",
        (sigma_s, sigma_t),
    )?;
    let scatters_less = (0..3).all(|c| sigma_s[c] <= sigma_t[c] * (1.0 + 1e-5));
    require(scatters_less, "scattering is a part of extinction", (sigma_s, sigma_t))?;
    require(medium.scatters() || sigma_s.is_black(), "what scatters says so", sigma_s)?;
    let continuation = medium.continuation(position);
    require(continuation > 0.0 && continuation <= 1.0, "continuation is in (0, 1]", continuation)?;
    let emitted = medium.emitted(segment);
    require(is_light(emitted), "emitted light is finite and not negative", (segment, emitted))?;
    require(medium.emits() || emitted.is_black(), "what emits says so", (segment, emitted))
}

fn density(medium: &impl Medium, segment: &RaySegment) -> Result<SegmentDensity, super::ContractViolation> {
    let density = medium.segment(segment);
    let case = (segment, density);
    let fraction = |x: f64| (0.0..=1.0).contains(&x);
    let transmits = density.transmittance.to_array().iter().all(|&t| fraction(t.into()));
    require(transmits, "transmittance is in [0, 1]", case)?;
    require(fraction(density.pass_probability), "the probability to pass is in [0, 1]", case)?;
    let stops = [density.stop_at_start, density.stop_at_end];
    require(stops.iter().all(|p| p.is_finite() && *p >= 0.0), "densities are finite and not negative", case)?;
    let passes = !medium.scatters();
    require(
        !passes || (density.pass_probability == 1.0 && stops == [0.0; 2]),
        "nothing stops a walk that is never scattered",
        case,
    )?;
    Ok(density)
}

fn check_product(medium: &impl Medium, segment: &RaySegment) -> Check {
    let middle = 0.5 * (segment.start + segment.end);
    let whole = density(medium, segment)?.transmittance;
    let parts = density(medium, &RaySegment { end: middle, ..*segment })?.transmittance
        * density(medium, &RaySegment { start: middle, ..*segment })?.transmittance;
    let agrees = (0..3).all(|c| (whole[c] - parts[c]).abs() <= 1e-4);
    require(agrees, "transmittance is the product over pieces", (segment, whole, parts))
}

fn check_distances(medium: &impl Medium, segment: &RaySegment, random: &mut Random) -> Check {
    let end = |cell: usize| {
        let share = cell as f32 / CELLS as f32;
        if cell == CELLS { segment.end } else { segment.start + share * (segment.end - segment.start) }
    };
    let mut observed = [0_u32; CELLS];
    for _ in 0..DRAWS {
        let Some(t) = medium.sample_distance(segment, random.next(), random.next()) else { continue };
        let inside = t >= segment.start && t < segment.end;
        require(medium.scatters() && inside, "a walk stops inside of the segment", (segment, t))?;
        let stop = density(medium, &RaySegment { end: t, ..*segment })?;
        require(stop.stop_at_end > 0.0, "where a walk stops there is a density", (segment, t, stop))?;
        observed[(1..CELLS).take_while(|&cell| t >= end(cell)).count()] += 1;
    }
    let mut total = 0.0;
    for (cell, &count) in observed.iter().enumerate() {
        // Simpson's rule on four pieces of the cell.
        let (from, step) = (end(cell), 0.25 * (end(cell + 1) - end(cell)));
        let mut expected = 0.0;
        for (i, weight) in [1.0, 4.0, 2.0, 4.0, 1.0].into_iter().enumerate() {
            let at = RaySegment { end: from + step * i as f32, ..*segment };
            expected += weight * density(medium, &at)?.stop_at_end * f64::from(step) / 3.0;
        }
        total += expected;
        require(agree(count, expected), "distances follow the density", (segment, cell, count, expected))?;
    }
    let pass_probability = density(medium, segment)?.pass_probability;
    require(
        (total + pass_probability - 1.0).abs() < 0.01,
        "a walk stops somewhere or passes",
        (segment, total, pass_probability),
    )
}

/// Whether a number of draws fits a probability: within five standard errors and one per cent of quadrature.
fn agree(count: u32, probability: f64) -> bool {
    let mean = DRAWS as f64 * probability;
    (f64::from(count) - mean).abs() <= 5.0 * mean.sqrt() + 0.01 * mean + 3.0
}
