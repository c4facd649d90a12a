//! [`check_medium`]: densities of a medium describe its sampling.

use upbp_media::{Medium, RaySegment, SegmentDensity, Spectrum};

use super::{Check, ContractViolation, DRAWS, Random, is_light, require};
use crate::scene::BoundingSphere;

/// Segments that are looked at.
const SEGMENTS: usize = 16;

/// Cells of the histogram of distances, equally likely.
const CELLS: usize = 8;

/// Checks the contract of [`Medium`] on random segments inside `bounds`: ranges of all values, that walks
/// pass and stop as often as `segment` says, in each lane as often as `segment_lanes` says, wherever the
/// segment ends, and can stop wherever light is scattered; that lanes with equal extinctions are equal, that
/// a walk the other way has the densities that the first one is told of it, that transmittance is a product
/// over pieces, and that points drawn for their light bring what is `emitted`.
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
        check_emission(medium, &segment, &mut random)?;
        check_equal_lanes(medium, &segment)?;
        for lane in [None, Some(0), Some(1), Some(2)] {
            let walks = Walks { medium, lane };
            check_distances(&walks, &segment, &mut random)?;
            check_stops(&walks, &segment)?;
            check_other_way(&walks, &segment)?;
        }
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

/// The walks through a medium, or those in one of its lanes.
struct Walks<'a, M> {
    medium: &'a M,
    lane: Option<usize>,
}

impl<M: Medium> Walks<'_, M> {
    fn sample_distance(&self, segment: &RaySegment, u: [f32; 2]) -> Option<f32> {
        match self.lane {
            Some(lane) => self.medium.sample_lane(segment, lane, u),
            None => self.medium.sample_distance(segment, u[0], u[1]),
        }
    }

    fn density(&self, segment: &RaySegment) -> Result<SegmentDensity, ContractViolation> {
        let whole = self.medium.segment(segment);
        let density = match self.lane {
            Some(lane) => {
                let lanes = self.medium.segment_lanes(segment);
                SegmentDensity {
                    transmittance: lanes.transmittance,
                    pass_probability: lanes.pass_probability[lane],
                    stop_at_end: lanes.stop_at_end[lane],
                    stop_at_start: lanes.stop_at_start[lane],
                }
            }
            None => whole,
        };
        let case = (segment, self.lane, density);
        let fraction = |x: f64| (0.0..=1.0).contains(&x);
        let transmits = density.transmittance.to_array().iter().all(|&t| fraction(t.into()));
        require(transmits, "transmittance is in [0, 1]", case)?;
        let is_same = (0..3).all(|c| (density.transmittance[c] - whole.transmittance[c]).abs() <= 1e-5);
        require(is_same, "lanes pass what the medium passes", case)?;
        require(fraction(density.pass_probability), "the probability to pass is in [0, 1]", case)?;
        let stops = [density.stop_at_start, density.stop_at_end];
        let are_usable = stops.iter().all(|p| p.is_finite() && *p >= 0.0);
        require(are_usable, "densities are finite and not negative", case)?;
        let passes = !self.medium.scatters();
        require(
            !passes || (density.pass_probability == 1.0 && stops == [0.0; 2]),
            "nothing stops a walk that is never scattered",
            case,
        )?;
        Ok(density)
    }
}

fn check_product(medium: &impl Medium, segment: &RaySegment) -> Check {
    let middle = 0.5 * (segment.start + segment.end);
    let walks = Walks { medium, lane: None };
    let whole = walks.density(segment)?.transmittance;
    let parts = walks.density(&RaySegment { end: middle, ..*segment })?.transmittance
        * walks.density(&RaySegment { start: middle, ..*segment })?.transmittance;
    let agrees = (0..3).all(|c| (whole[c] - parts[c]).abs() <= 1e-4);
    require(agrees, "transmittance is the product over pieces", (segment, whole, parts))
}

/// Checks that lanes with equal extinctions are equal: walks draw only one of them.
fn check_equal_lanes(medium: &impl Medium, segment: &RaySegment) -> Check {
    let extinctions = medium.lane_extinctions().unwrap_or(Spectrum::ZERO);
    let density = medium.segment_lanes(segment);
    let values = [density.pass_probability, density.stop_at_start, density.stop_at_end];
    for (a, b) in [(0, 1), (0, 2), (1, 2)].into_iter().filter(|&(a, b)| extinctions[a] == extinctions[b]) {
        let are_equal = values.iter().all(|of| (of[a] - of[b]).abs() <= 1e-3 * of[a].max(of[b]));
        require(are_equal, "lanes of equal extinctions are equal", (segment, extinctions, density))?;
    }
    Ok(())
}

/// Checks that a walk can stop where light arrives and is scattered; a lane, where its channel is.
fn check_stops<M: Medium>(walks: &Walks<'_, M>, segment: &RaySegment) -> Check {
    for part in [0.0, 0.25, 0.5, 0.75, 1.0] {
        let end = segment.start + part * segment.length();
        let density = walks.density(&RaySegment { end, ..*segment })?;
        let scattered = density.transmittance * walks.medium.sigma_s(segment.at(end));
        let is_scattered = (0..3).any(|c| walks.lane.is_none_or(|lane| lane == c) && scattered[c] > 0.0);
        let case = (segment, walks.lane, end, density);
        require(
            !is_scattered || density.stop_at_end > 0.0,
            "a walk can stop where light is scattered",
            case,
        )?;
    }
    Ok(())
}

/// Checks that a walk from the end to the start passes as often, and stops with the density that `segment`
/// says of it.
fn check_other_way<M: Medium>(walks: &Walks<'_, M>, segment: &RaySegment) -> Check {
    let direction = -segment.direction;
    let origin = segment.at(segment.end) - direction * segment.start;
    let [there, back] =
        [walks.density(segment)?, walks.density(&RaySegment { origin, direction, ..*segment })?];
    let case = (segment, walks.lane, there, back);
    let alike = |a: f64, b: f64| (a - b).abs() <= 0.01 * a.max(b) + 1e-5;
    let passes = alike(there.pass_probability, back.pass_probability);
    require(passes, "walks pass as often the other way", case)?;
    let stops = [[there.stop_at_start, back.stop_at_end], [there.stop_at_end, back.stop_at_start]];
    require(
        stops.iter().all(|&[told, own]| (told - own).abs() <= 0.01 * told.max(own)),
        "a walk the other way stops with the density that is told of it",
        case,
    )
}

/// Checks that points that are drawn for their light bring what the segment emits; a medium that tells no
/// source is in no body that is an emitter.
fn check_emission(medium: &impl Medium, segment: &RaySegment, random: &mut Random) -> Check {
    let middle = segment.at(0.5 * (segment.start + segment.end));
    if !medium.emits() || medium.source(middle).is_black() {
        return Ok(());
    }
    let (mut sum, mut squares) = ([0.0; 3], [0.0; 3]);
    for _ in 0..DRAWS {
        let Some(t) = medium.sample_emitted(segment, random.next()) else { continue };
        let case = (segment, t);
        require(t >= segment.start && t < segment.end, "a point of light is inside of the segment", case)?;
        let pdf = medium.pdf_emitted(segment, t);
        require(pdf > 0.0 && pdf.is_finite(), "where light is looked at there is a density", (case, pdf))?;
        let transmittance = medium.segment(&RaySegment { end: t, ..*segment }).transmittance;
        let source = medium.source(segment.at(t));
        for c in 0..3 {
            let value = f64::from(transmittance[c] * source[c]) / pdf;
            sum[c] += value;
            squares[c] += value * value;
        }
    }
    let draws = DRAWS as f64;
    let emitted = medium.emitted(segment);
    let mean = sum.map(|sum| sum / draws);
    let agrees = (0..3).all(|c| {
        let error = ((squares[c] / draws - mean[c] * mean[c]).max(0.0) / draws).sqrt();
        (mean[c] - f64::from(emitted[c])).abs() <= 5.0 * error + 1e-3 * f64::from(emitted[c])
    });
    require(agrees, "points of light bring what is emitted", (segment, emitted, mean))
}

fn check_distances<M: Medium>(walks: &Walks<'_, M>, segment: &RaySegment, random: &mut Random) -> Check {
    let upto = |end: f32| walks.density(&RaySegment { end, ..*segment });
    let passes = |end: f32| upto(end).map(|density| density.pass_probability);
    let whole = passes(segment.end)?;
    // Ends of the cells: where equal parts of what stops have stopped.
    let mut ends = [segment.end; CELLS];
    for (cell, end) in ends[..CELLS - 1].iter_mut().enumerate() {
        let left = 1.0 - (1.0 - whole) * (cell + 1) as f64 / CELLS as f64;
        let (mut low, mut high) = (segment.start, segment.end);
        for _ in 0..32 {
            let middle = 0.5 * (low + high);
            *(if passes(middle)? > left { &mut low } else { &mut high }) = middle;
        }
        *end = high;
    }
    let mut observed = [0_u32; CELLS];
    for _ in 0..DRAWS {
        let u = [random.next(), random.next()];
        let stop = walks.sample_distance(segment, u);
        check_without_end(walks, segment, u, stop)?;
        let Some(t) = stop else { continue };
        let case = (segment, walks.lane, t);
        let is_inside = t >= segment.start && t < segment.end;
        require(walks.medium.scatters() && is_inside, "a walk stops inside of the segment", case)?;
        require(upto(t)?.stop_at_end > 0.0, "where a walk stops there is a density", case)?;
        observed[ends.iter().take_while(|end| t >= **end).count()] += 1;
    }
    let mut before = 1.0;
    for (count, end) in observed.into_iter().zip(ends) {
        let after = passes(end)?;
        let case = (segment, walks.lane, end, count, before - after);
        require(agree(count, before - after), "walks stop where fewer pass", case)?;
        before = after;
        check_density(&upto, segment, walks.medium.sigma_t(segment.at(end)), end)?;
    }
    Ok(())
}

/// Checks that a walk that stops in the segment does so in one without an end, too, and that one that passes
/// does not stop before the end.
fn check_without_end<M: Medium>(
    walks: &Walks<'_, M>,
    segment: &RaySegment,
    u: [f32; 2],
    stop: Option<f32>,
) -> Check {
    let without_end = walks.sample_distance(&RaySegment { end: f32::INFINITY, ..*segment }, u);
    let nearest = stop.unwrap_or(segment.end);
    let rounding = 1e-3 * (nearest - segment.start) + 8.0 * f32::EPSILON * nearest.abs();
    let agrees = match without_end {
        Some(t) => t >= nearest - rounding && (stop.is_none() || t <= nearest + rounding),
        None => stop.is_none(),
    };
    let case = (segment, walks.lane, u, stop, without_end);
    require(agrees, "where a walk stops does not depend on the end", case)
}

/// Checks that the density to stop at the `end` of a part of the segment is the rate at which fewer pass.
fn check_density(
    upto: &impl Fn(f32) -> Result<SegmentDensity, ContractViolation>,
    segment: &RaySegment,
    sigma_t: Spectrum,
    end: f32,
) -> Check {
    let here = upto(end)?;
    // A hundredth of the shortest mean free path to both sides, unless positions are too coarse to tell.
    let step = 0.01 / sigma_t.max_component();
    let (low, high) = (end - step, end + step);
    let is_fine = step > 1e3 * f32::EPSILON * high.abs();
    if here.pass_probability == 0.0 || !(is_fine && low > segment.start && high < segment.end) {
        return Ok(());
    }
    let rate = (upto(low)?.pass_probability - upto(high)?.pass_probability) / f64::from(high - low);
    require(
        (rate - here.stop_at_end).abs() <= 0.02 * here.stop_at_end,
        "walks stop at the rate at which fewer pass",
        (segment, end, rate, here),
    )
}

/// Whether a number of draws fits a probability: within five standard errors, and one part in a thousand.
fn agree(count: u32, probability: f64) -> bool {
    let mean = DRAWS as f64 * probability;
    (f64::from(count) - mean).abs() <= 5.0 * mean.sqrt() + 1e-3 * mean + 3.0
}
