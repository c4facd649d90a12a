//! Checkers for what a host implements: call them in the host's own tests.
//!
//! A renderer whose densities do not describe its sampling is wrong without looking wrong. These functions
//! draw from an implementation and compare with what it says about itself: that every sample agrees with
//! the functions that evaluate it, that frequencies follow densities, and that densities integrate to one.
//! They use their own fixed random numbers: an implementation passes always or never.
//!
//! Frequencies are compared by Pearson's χ² on a grid of directions, at a significance of 10⁻⁶ per test; sums
//! of random terms within five standard errors. Equalities allow for single precision: one part in a
//! thousand.

use std::f64::consts::{PI, TAU};
use std::fmt::Debug;

use glam::{Vec2, Vec3};

use crate::Spectrum;
use crate::scene::{
    BoundingSphere, Bsdf, BsdfSample, Camera, Crossing, Emitter, EmitterKind, EmitterPoint, Interface, Scene,
    Walk,
};

/// An implementation does not keep a contract.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what}: {details}")]
pub struct ContractViolation {
    /// The rule that is broken.
    pub what: &'static str,
    /// Arguments and values of the first case found.
    pub details: String,
}

type Check = Result<(), ContractViolation>;

fn fail<T>(what: &'static str, details: impl Debug) -> Result<T, ContractViolation> {
    Err(ContractViolation { what, details: format!("{details:?}") })
}

fn require(condition: bool, what: &'static str, details: impl Debug) -> Check {
    if condition { Ok(()) } else { fail(what, details) }
}

/// Random numbers of the checkers: Steele et al., "Fast Splittable Pseudorandom Number Generators", OOPSLA
/// 2014.
struct Random(u64);

impl Random {
    /// Uniform in `[0, 1)`.
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1_u32 << 24) as f32
    }

    fn pair(&mut self) -> [f32; 2] {
        [self.next(), self.next()]
    }

    fn direction(&mut self) -> Vec3 {
        let [u, v] = self.pair();
        direction((1.0 - 2.0 * f64::from(u)).acos(), TAU * f64::from(v))
    }
}

fn direction(theta: f64, phi: f64) -> Vec3 {
    Vec3::new((theta.sin() * phi.cos()) as f32, (theta.sin() * phi.sin()) as f32, theta.cos() as f32)
}

/// Equal to one part in a thousand.
fn same(a: f32, b: f32) -> bool {
    (a - b).abs() <= 1e-3 * a.abs().max(b.abs()) || (a.abs() < 1e-30 && b.abs() < 1e-30)
}

fn same_spectrum(a: Spectrum, b: Spectrum) -> bool {
    (0..3).all(|channel| same(a[channel], b[channel]))
}

fn is_unit(v: Vec3) -> bool {
    (v.length_squared() - 1.0).abs() < 1e-4
}

fn is_light(value: Spectrum) -> bool {
    value.is_finite() && value.is_non_negative()
}

fn is_density(value: f32) -> bool {
    value.is_finite() && value >= 0.0
}

// ------------------------------------------------------------------------------------------------- surfaces

/// Cells of the grid of directions: equal steps of the polar angle and of the azimuth.
const THETA_CELLS: usize = 32;
const PHI_CELLS: usize = 32;
/// Points per cell and axis at which a density is integrated at first, and how often a cell may be halved.
/// Odd, so that a jump in the middle of a cell does not look converged.
const QUADRATURE: u32 = 5;
const MAX_HALVINGS: u32 = 6;
/// Draws per direction of arrival.
const DRAWS: usize = 40_000;

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

    let (expected, total) = integrate_pdf(bsdf, interface, from)?;
    require(total <= 1.01, "pdf integrates to at most one", (from, total))?;
    if !bsdf.is_connectible() {
        require(total == 0.0, "without a smooth lobe pdf is zero", (from, total))?;
    }

    let mut random = Random(seed);
    let mut observed = vec![0_u32; THETA_CELLS * PHI_CELLS];
    // Dirac lobes on the side of `from` and on the other: number of draws and their probability.
    let mut dirac = [(0_u32, 0.0_f32); 2];
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
            let lobe = &mut dirac[usize::from(sample.to.z * from.z < 0.0)];
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

// --------------------------------------------------------------------------------------------------- lights

/// Checks the contract of [`Emitter`] for receivers at the given points, of which a light that shines
/// should reach at least one.
pub fn check_emitter(emitter: &impl Emitter, bounds: &BoundingSphere, receivers: &[Vec3]) -> Check {
    let power = emitter.power(bounds);
    require(power.is_finite() && power >= 0.0, "power is finite and not negative", power)?;
    let mut random = Random(7);
    for _ in 0..2000 {
        check_emission(emitter, bounds, &mut random)?;
        for &receiver in receivers {
            check_incident(emitter, bounds, receiver, &mut random)?;
        }
    }
    match emitter.kind() {
        EmitterKind::Area => receivers
            .iter()
            .try_for_each(|&receiver| check_area_irradiance(emitter, bounds, receiver, &mut random)),
        EmitterKind::Point => check_point_directions(emitter, bounds, &mut random),
        EmitterKind::Directional => Ok(()),
        EmitterKind::Environment => check_environment_directions(emitter, bounds, &mut random),
    }
}

fn check_emission(emitter: &impl Emitter, bounds: &BoundingSphere, random: &mut Random) -> Check {
    let Some(emission) = emitter.sample_emission(bounds, random.pair(), random.pair()) else {
        return Ok(());
    };
    let kind = emitter.kind();
    require(is_unit(emission.direction), "light goes along a unit vector", emission)?;
    require(emission.point.position.is_finite(), "light starts at a finite point", emission)?;
    require(is_light(emission.radiance), "emitted light is finite and not negative", emission)?;
    let densities = [emission.pdf_position, emission.pdf_direction];
    require(densities.iter().all(|&p| is_density(p) && p > 0.0), "what is emitted has densities", emission)?;
    if kind.is_infinite() {
        let offset = emission.point.position - bounds.centre;
        let outside = offset.dot(emission.direction) <= -bounds.radius;
        require(outside, "light from infinity starts before the scene", emission)?;
        let across = offset.reject_from_normalized(emission.direction).length();
        require(across <= bounds.radius * 1.001, "light from infinity starts on the disc", emission)?;
        let disc = 1.0 / (std::f32::consts::PI * bounds.radius * bounds.radius);
        require(same(emission.pdf_direction, disc), "the disc is sampled uniformly", emission)?;
    }
    if kind == EmitterKind::Area {
        let cosine = emission.direction.dot(emission.point.normal);
        require(cosine > 0.0, "a surface emits on the side of its normal", emission)?;
    }
    let receiver = emission.point.position + emission.direction * bounds.radius;
    let seen = emitter.hit(bounds, &emission.point, emission.direction, receiver);
    require(seen.is_some() == kind.is_hittable(), "hit answers for lights that can be hit", emission)?;
    let Some(seen) = seen else { return Ok(()) };
    let agrees = same_spectrum(seen.radiance, emission.radiance)
        && same(seen.pdf_position, emission.pdf_position)
        && same(seen.pdf_direction, emission.pdf_direction);
    require(agrees, "hit agrees with sample_emission", (emission, seen))
}

fn check_incident(
    emitter: &impl Emitter,
    bounds: &BoundingSphere,
    receiver: Vec3,
    random: &mut Random,
) -> Check {
    let Some(incident) = emitter.sample_incident(bounds, receiver, random.pair()) else {
        return Ok(());
    };
    let kind = emitter.kind();
    let case = (receiver, incident);
    require(is_unit(incident.towards_light), "the direction to a light is a unit vector", case)?;
    require(is_light(incident.radiance), "incident light is finite and not negative", case)?;
    let densities = [incident.pdf, incident.pdf_position, incident.pdf_direction];
    require(densities.iter().all(|&p| is_density(p)), "densities are finite and not negative", case)?;
    require(incident.pdf > 0.0, "what is chosen has a density", case)?;
    if kind.is_infinite() {
        require(incident.distance == f32::INFINITY, "an infinite light has no distance", case)?;
    } else {
        let there = receiver + incident.towards_light * incident.distance;
        let near = there.distance(incident.point.position) <= 1e-4 * (incident.distance + receiver.length());
        require(near, "direction and distance lead to the chosen point", case)?;
    }
    let Some(seen) = emitter.hit(bounds, &incident.point, -incident.towards_light, receiver) else {
        return require(!kind.is_hittable(), "a chosen point of a light can be hit", case);
    };
    let agrees = same_spectrum(seen.radiance, incident.radiance)
        && same(seen.pdf_incident, incident.pdf)
        && same(seen.pdf_position, incident.pdf_position)
        && same(seen.pdf_direction, incident.pdf_direction);
    require(agrees, "hit agrees with sample_incident", (case, seen))?;
    let alone =
        emitter.pdf_incident(bounds, &incident.point, -incident.towards_light, receiver, seen.pdf_position);
    require(same(alone, incident.pdf), "pdf_incident agrees with sample_incident", (case, alone))
}

/// Mean of random terms, and its standard error.
#[derive(Default)]
struct Mean {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Mean {
    fn add(&mut self, term: f64) {
        self.count += 1.0;
        self.sum += term;
        self.squares += term * term;
    }

    fn value(&self) -> (f64, f64) {
        let mean = self.sum / self.count;
        (mean, ((self.squares / self.count - mean * mean).max(0.0) / self.count).sqrt())
    }

    fn agrees(&self, expected: (f64, f64), what: &'static str) -> Check {
        let (mean, error) = self.value();
        let tolerance = 5.0 * error.hypot(expected.1) + 2e-3 * expected.0.abs();
        require((mean - expected.0).abs() <= tolerance, what, (mean, error, expected))
    }
}

/// The light that falls on a receiver must be the same by points for it and by points of emission. Meant for
/// convex lights: the second way does not see that a surface hides itself.
fn check_area_irradiance(
    emitter: &impl Emitter,
    bounds: &BoundingSphere,
    receiver: Vec3,
    random: &mut Random,
) -> Check {
    let (mut chosen, mut emitted) = (Mean::default(), Mean::default());
    for _ in 0..DRAWS {
        let term = emitter.sample_incident(bounds, receiver, random.pair()).map_or(0.0, |incident| {
            let cosine = incident.point.normal.dot(-incident.towards_light).max(0.0);
            incident.radiance.mean() * cosine / (incident.distance * incident.distance * incident.pdf)
        });
        chosen.add(f64::from(term));
        let term = emitter.sample_emission(bounds, random.pair(), random.pair()).map_or(0.0, |emission| {
            let between = receiver - emission.point.position;
            let towards = between.normalize_or_zero();
            let cosine = emission.point.normal.dot(towards).max(0.0);
            let seen = emitter.hit(bounds, &emission.point, towards, receiver);
            let radiance = seen.map_or(0.0, |seen| seen.radiance.mean());
            radiance * cosine / (between.length_squared() * emission.pdf_position)
        });
        emitted.add(f64::from(term));
    }
    chosen.agrees(emitted.value(), "both ways to choose points give the same irradiance")
}

/// `∫ pdf_direction dω = 1` around a point, seen by receivers around it.
fn check_point_directions(emitter: &impl Emitter, bounds: &BoundingSphere, random: &mut Random) -> Check {
    let Some(position) = (0..100)
        .find_map(|_| emitter.sample_emission(bounds, random.pair(), random.pair()))
        .map(|emission| emission.point.position)
    else {
        return Ok(());
    };
    let mut power = Mean::default();
    let (rows, columns) = (600, 1200);
    let (theta_step, phi_step) = (PI / f64::from(rows), TAU / f64::from(columns));
    let (mut density, mut flux) = (0.0, 0.0);
    for row in 0..rows {
        let theta = (f64::from(row) + 0.5) * theta_step;
        for column in 0..columns {
            let receiver = position + direction(theta, (f64::from(column) + 0.5) * phi_step) * bounds.radius;
            if let Some(incident) = emitter.sample_incident(bounds, receiver, [0.5; 2]) {
                let solid_angle = theta.sin() * theta_step * phi_step;
                density += f64::from(incident.pdf_direction) * solid_angle;
                flux += f64::from(incident.radiance.mean()) * solid_angle;
            }
        }
    }
    // A cone's rim cuts through the grid: a few per cent for the narrowest that this is meant for.
    require((density - 1.0).abs() < 0.03, "the density of directions integrates to one", density)?;
    for _ in 0..DRAWS {
        let emission = emitter.sample_emission(bounds, random.pair(), random.pair());
        power.add(emission.map_or(0.0, |e| f64::from(e.radiance.mean() / e.pdf_direction)));
    }
    power.agrees((flux, 0.006 * flux), "emission carries the flux that receivers see")
}

/// `∫ pdf dω = 1` over all directions, and the same flux by emission, by choice and by quadrature.
fn check_environment_directions(
    emitter: &impl Emitter,
    bounds: &BoundingSphere,
    random: &mut Random,
) -> Check {
    let anywhere = EmitterPoint { position: bounds.centre, normal: Vec3::Z };
    let (mut density, mut flux) = (Mean::default(), Mean::default());
    for _ in 0..20 * DRAWS {
        let direction = random.direction();
        let seen = emitter.hit(bounds, &anywhere, direction, bounds.centre);
        density.add(seen.map_or(0.0, |seen| f64::from(seen.pdf_position) * 2.0 * TAU));
        flux.add(seen.map_or(0.0, |seen| f64::from(seen.radiance.mean()) * 2.0 * TAU));
    }
    density.agrees((1.0, 0.0), "the density of directions integrates to one")?;
    let (mut chosen, mut emitted) = (Mean::default(), Mean::default());
    for _ in 0..DRAWS {
        let incident = emitter.sample_incident(bounds, bounds.centre, random.pair());
        chosen.add(incident.map_or(0.0, |i| f64::from(i.radiance.mean() / i.pdf)));
        let emission = emitter.sample_emission(bounds, random.pair(), random.pair());
        emitted.add(emission.map_or(0.0, |e| f64::from(e.radiance.mean() / e.pdf_position)));
    }
    chosen.agrees(flux.value(), "next event estimation sees all of the environment")?;
    emitted.agrees(flux.value(), "emission sees all of the environment")
}

// --------------------------------------------------------------------------------------------------- camera

/// Checks the contract of [`Camera`]: that `connect` inverts `ray`, and that the density of a pixel's
/// directions is one over its solid angle on average.
pub fn check_camera(camera: &impl Camera) -> Check {
    let (width, height) = camera.resolution();
    require(width > 0 && height > 0, "the film is not empty", (width, height))?;
    let crop = camera.crop();
    let inside = crop.width > 0
        && crop.height > 0
        && crop.x.checked_add(crop.width).is_some_and(|end| end <= width)
        && crop.y.checked_add(crop.height).is_some_and(|end| end <= height);
    require(inside, "the crop is a part of the film", crop)?;
    let size = Vec2::new(width as f32, height as f32);
    let mut random = Random(3);
    for _ in 0..2000 {
        let film = Vec2::from(random.pair()) * (size * 0.999);
        let u_lens = random.pair();
        let distance = 0.1 + 10.0 * random.next();
        let Some(ray) = camera.ray(film, u_lens) else { continue };
        let case = (film, u_lens, ray);
        require(is_unit(ray.direction), "a ray's direction is a unit vector", case)?;
        require(is_density(ray.pdf) && ray.pdf > 0.0, "a ray has a density", case)?;
        let Some(connection) = camera.connect(ray.origin + ray.direction * distance, u_lens) else {
            let margin = film.min(size - film).min_element();
            require(margin < 0.01, "a point on a ray is seen", case)?;
            continue;
        };
        let near = connection.film.distance(film) < 1e-4 * size.max_element() + 1e-2;
        require(near, "connect inverts ray", (case, connection))?;
        let tolerance = 1e-4 * (ray.origin.length() + f32::MIN_POSITIVE);
        let same_lens = connection.lens.distance(ray.origin) <= tolerance;
        require(same_lens, "the same numbers give the same lens point", (case, connection))?;
        require(same(connection.pdf, ray.pdf), "connect gives the density of ray", (case, connection))?;
    }
    for _ in 0..20 {
        let corner = (Vec2::from(random.pair()) * (size - Vec2::ONE)).floor();
        check_pixel(camera, corner, random.pair())?;
    }
    Ok(())
}

/// `E[1 / pdf]` over a pixel is its solid angle.
fn check_pixel(camera: &impl Camera, corner: Vec2, u_lens: [f32; 2]) -> Check {
    const STEPS: u32 = 16;
    let mut solid_angle = 0.0;
    for i in 0..STEPS * STEPS {
        let place = Vec2::new((i % STEPS) as f32 + 0.5, (i / STEPS) as f32 + 0.5) / STEPS as f32;
        let Some(ray) = camera.ray(corner + place, u_lens) else { return Ok(()) };
        solid_angle += f64::from(1.0 / ray.pdf) / f64::from(STEPS * STEPS);
    }
    let direction = |offset| camera.ray(corner + offset, u_lens).map(|ray| ray.direction.as_dvec3());
    let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y].map(direction);
    let [Some(a), Some(b), Some(c), Some(d)] = corners else { return Ok(()) };
    // Differences first: the triple product of nearly parallel unit vectors cancels. A small spherical
    // triangle; Van Oosterom and Strackee 1983.
    let triangle = |a: glam::DVec3, b: glam::DVec3, c: glam::DVec3| {
        let volume = a.dot((b - a).cross(c - a)).abs();
        2.0 * volume.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
    };
    let expected = triangle(a, b, c) + triangle(a, c, d);
    // Directions are rounded to single precision: a pixel's edge has that error, relative to its length.
    let tolerance = 1e-3 + 4.0 * f64::from(f32::EPSILON) / expected.sqrt();
    let within = (solid_angle - expected).abs() <= tolerance * expected;
    require(within, "a pixel's density is one over its solid angle", (corner, solid_angle, expected))
}

// ---------------------------------------------------------------------------------------------------- scene

/// Checks that the questions of [`Scene`] get consistent answers along random rays through its bounds: hits
/// lie on their ray, `trace` and `is_clear` find what `intersect` does, and the bodies around a point
/// follow from the boundaries on the way to it.
///
/// Rays that graze an edge can be answered either way, so that one ray in a hundred may disagree.
pub fn check_scene(scene: &impl Scene) -> Check {
    let bounds = scene.bounds();
    require(bounds.radius.is_finite() && bounds.radius > 0.0, "bounds have a radius", bounds)?;
    require(bounds.centre.is_finite(), "bounds have a centre", bounds)?;
    let mut random = Random(11);
    let mut violations = Vec::new();
    let rays = 2000;
    for _ in 0..rays {
        let origin = bounds.centre + random.direction() * (1.2 * bounds.radius);
        let target = bounds.centre + random.direction() * (bounds.radius * random.next());
        let Some(direction) = (target - origin).try_normalize() else { continue };
        let ray = crate::Ray { origin, direction, t_min: 0.0, t_max: 4.0 * bounds.radius };
        violations.extend(check_ray(scene, &ray, &mut random).err());
    }
    if violations.len() * 100 > rays {
        let first = violations.swap_remove(0);
        return Err(ContractViolation { details: format!("{first:?}"), ..first });
    }
    Ok(())
}

fn check_ray(scene: &impl Scene, ray: &crate::Ray, random: &mut Random) -> Check {
    let radius = scene.bounds().radius;
    if let Some(hit) = scene.intersect(ray) {
        let case = (ray, hit.t, hit.geometric_normal, hit.shading_normal);
        require(hit.t > ray.t_min && hit.t < ray.t_max, "a hit is within the ray", case)?;
        let near = hit.position.distance(ray.origin + ray.direction * hit.t) < 1e-4 * radius;
        require(near, "a hit's position is on the ray", case)?;
        let units = is_unit(hit.geometric_normal) && is_unit(hit.shading_normal);
        require(units, "normals are unit vectors", case)?;
        let sides = hit.geometric_normal.dot(hit.shading_normal) >= 0.0;
        require(sides, "the shading normal is on the side of the geometric one", case)?;
    }
    let mut crossings = Vec::new();
    let hit = scene.trace(ray, &mut crossings);
    let end = hit.as_ref().map_or(ray.t_max, |hit| hit.t);
    require(
        is_ordered(&crossings, ray, end),
        "crossings are sorted and before the hit",
        (ray, &crossings, end),
    )?;
    require(crossings.iter().all(|c| !c.scatters), "trace only crosses null boundaries", (ray, &crossings))?;

    // Short of the hit nothing blocks; beyond an opaque one something does.
    let mut passed = Vec::new();
    let before = crate::Ray { t_max: end - 1e-3 * radius, ..*ray };
    let clear = before.t_max <= before.t_min || scene.is_clear(&before, &mut passed);
    require(clear, "nothing blocks before the nearest hit", (ray, end))?;
    if hit.is_some_and(|hit| hit.interior.is_none()) {
        let beyond = crate::Ray { t_max: end + 1e-3 * radius, ..*ray };
        require(!scene.is_clear(&beyond, &mut Vec::new()), "an opaque hit blocks", (ray, end))?;
    }

    // The bodies around a point of the first stretch: those at the start, and the boundaries since.
    let t = end * random.next();
    let near_boundary = crossings.iter().any(|crossing| (crossing.t - t).abs() < 1e-3 * radius);
    if near_boundary {
        return Ok(());
    }
    let mut stack = scene.stack_at(ray.origin);
    for crossing in crossings.iter().filter(|crossing| crossing.t < t) {
        let _ = stack.cross(crossing.interior, crossing.entering);
    }
    let there = scene.stack_at(ray.origin + ray.direction * t);
    require(stack == there, "the bodies around a point follow from the boundaries", (ray, t, stack, there))
}

fn is_ordered(crossings: &[Crossing], ray: &crate::Ray, end: f32) -> bool {
    crossings.is_sorted_by(|a, b| a.t <= b.t) && crossings.iter().all(|c| c.t > ray.t_min && c.t <= end)
}
