//! [`check_emitter`]: emission, next event and hits of a light agree.

use std::f64::consts::{PI, TAU};

use glam::Vec3;

use super::moments::{Distribution, Mean, Places, Sources};
use super::{
    Check, ContractViolation, DRAWS, Random, direction, is_density, is_light, is_unit, require, same,
    same_spectrum,
};
use crate::random::ONE_MINUS_EPSILON;
use crate::scene::{BoundingSphere, Emission, Emitter, EmitterKind, EmitterPoint};

/// Checks the contract of [`Emitter`] in a scene with these bounds, for receivers at the given points, of
/// which the light of a surface or volume that shines must reach at least one.
pub fn check_emitter(emitter: &impl Emitter, bounds: &BoundingSphere, receivers: &[Vec3]) -> Check {
    let power = emitter.power(bounds);
    require(power.is_finite() && power >= 0.0, "power is finite and not negative", power)?;
    let place = emitter.bounds(bounds);
    let is_place = place.is_none_or(|place| place.is_valid() && !emitter.kind().is_infinite());
    require(is_place, "bounds are finite and ascending, with a unit axis, and of a finite light", place)?;
    check_densities(emitter, bounds, receivers)?;
    if emitter.kind().is_infinite() {
        // As when light sub-paths start around a point that matters.
        let centre = bounds.centre + 0.5 * bounds.radius * Vec3::X;
        check_densities(emitter, &BoundingSphere { centre, radius: 1.5 * bounds.radius }, receivers)?;
    }
    Ok(())
}

fn check_densities(emitter: &impl Emitter, bounds: &BoundingSphere, receivers: &[Vec3]) -> Check {
    let mut random = Random(7);
    let mut guided = Guided::default();
    let (mut shines, mut reaches) = (false, false);
    for _ in 0..2000 {
        shines |= check_emission(emitter, bounds, &mut random, &mut guided)?;
        for &receiver in receivers {
            reaches |= check_incident(emitter, bounds, receiver, &mut random)?;
        }
    }
    guided.check()?;
    // Without a receiver that it reaches, nothing compares what is chosen with what is emitted.
    let is_compared =
        reaches || !shines || !matches!(emitter.kind(), EmitterKind::Area | EmitterKind::Volume(_));
    require(is_compared, "a light that shines reaches some receiver", receivers)?;
    if emitter.kind().is_infinite() {
        check_disc(emitter, bounds, &mut random)?;
    }
    match emitter.kind() {
        EmitterKind::Area => {
            check_emitted_directions(emitter, bounds, &mut random)?;
            receivers
                .iter()
                .try_for_each(|&receiver| check_area_irradiance(emitter, bounds, receiver, &mut random))
        }
        EmitterKind::Point => {
            check_single(emitter, bounds, &mut random)?;
            check_point_directions(emitter, bounds, &mut random)
        }
        EmitterKind::Directional => check_single(emitter, bounds, &mut random),
        EmitterKind::Environment => check_environment_directions(emitter, bounds, &mut random),
        EmitterKind::Volume(_) => {
            check_emitted_directions(emitter, bounds, &mut random)?;
            receivers
                .iter()
                .try_for_each(|&receiver| check_volume_fluence(emitter, bounds, receiver, &mut random))
        }
    }
}

/// Whether a start brings light.
fn check_emission(
    emitter: &impl Emitter,
    bounds: &BoundingSphere,
    random: &mut Random,
    guided: &mut Guided,
) -> Result<bool, ContractViolation> {
    let (u_position, u_direction) = (random.pair(), random.pair());
    let Some(emission) = emitter.sample_emission(bounds, u_position, u_direction) else {
        return Ok(false);
    };
    let is_bright = !emission.radiance.is_black();
    let kind = emitter.kind();
    require(is_unit(emission.direction), "light goes along a unit vector", emission)?;
    require(emission.point.position.is_finite(), "light starts at a finite point", emission)?;
    require(is_light(emission.radiance), "emitted light is finite and not negative", emission)?;
    let densities = [emission.pdf_position, emission.pdf_direction];
    require(densities.iter().all(|&p| is_density(p) && p > 0.0), "what is emitted has densities", emission)?;
    if kind.is_infinite() {
        let offset = emission.point.position - bounds.centre;
        let outside = offset.dot(emission.direction) <= -bounds.radius * 0.999;
        require(outside, "light from infinity starts before the scene", emission)?;
        let across = offset.reject_from_normalized(emission.direction).length();
        require(across <= bounds.radius * 1.001, "light from infinity starts on the disc", emission)?;
        let disc = 1.0 / (std::f32::consts::PI * bounds.radius * bounds.radius);
        require(
            same(emission.pdf_direction, disc),
            "the density on the disc is one over its area",
            emission,
        )?;
    }
    if kind == EmitterKind::Area {
        let cosine = emission.direction.dot(emission.point.normal);
        require(cosine > 0.0, "a surface emits on the side of its normal", emission)?;
    }
    let receiver = emission.point.position + emission.direction * bounds.radius;
    check_coordinates(emitter, bounds, [u_position, u_direction], &emission, receiver, guided)?;
    check_bounds(emitter, bounds, &emission)?;
    let seen = emitter.hit(bounds, &emission.point, emission.direction, receiver);
    require(seen.is_some() == kind.is_hittable(), "hit answers for lights that can be hit", emission)?;
    let Some(seen) = seen else { return Ok(is_bright) };
    let agrees = same_spectrum(seen.radiance, emission.radiance)
        && same(seen.pdf_position, emission.pdf_position)
        && same(seen.pdf_direction, emission.pdf_direction);
    require(agrees, "hit agrees with sample_emission", (emission, seen))?;
    Ok(is_bright)
}

/// Light starts within the bounds of its emitter, and goes where these say.
fn check_bounds(emitter: &impl Emitter, bounds: &BoundingSphere, emission: &Emission) -> Check {
    let Some(place) = emitter.bounds(bounds) else { return Ok(()) };
    let at = emission.point.position;
    let nearest = at.clamp(place.min, place.max);
    let rounding = 1e-5 * (at.length() + (place.max - place.min).length());
    require(at.distance(nearest) <= rounding, "light starts within the bounds of its emitter", (place, at))?;
    let angle = |cos: f32| cos.clamp(-1.0, 1.0).acos();
    let most = angle(place.cos_normals) + angle(place.cos_emission);
    let is_towards = angle(emission.direction.dot(place.axis)) <= most + 1e-3;
    require(is_towards, "light goes within the angles of its emitter's bounds", (place, emission))
}

/// Starts whose coordinates are known.
#[derive(Default)]
struct Guided {
    /// Pairs that are known, by the first of them.
    axes: Option<[bool; 2]>,
    starts: u32,
    /// Those that the coordinates give again to most digits.
    exact: u32,
}

impl Guided {
    fn check(&self) -> Check {
        let numbers = (self.exact, self.starts);
        // The rest may be at poles and rims, where few digits are left.
        require(10 * self.exact >= 9 * self.starts, "coordinates of most starts give them exactly", numbers)
    }
}

/// Coordinates that are known start the same light again.
fn check_coordinates(
    emitter: &impl Emitter,
    bounds: &BoundingSphere,
    [u_position, u_direction]: [[f32; 2]; 2],
    emission: &Emission,
    receiver: Vec3,
    guided: &mut Guided,
) -> Check {
    let found = emitter.emission_coordinates(bounds, &emission.point, emission.direction, receiver);
    let Some(found) = found else { return Ok(()) };
    let axes = [found.position.is_some(), found.direction.is_some()];
    let is_known = *guided.axes.get_or_insert(axes) == axes;
    require(is_known, "which coordinates are known does not depend on the ray", (emission, found))?;
    let pairs = [found.position.unwrap_or(u_position), found.direction.unwrap_or(u_direction)];
    let is_number = pairs.as_flattened().iter().all(|u| (-1e-4..=1.0001).contains(u));
    require(is_number, "coordinates of a start are random numbers", (emission, found))?;
    let [u_position, u_direction] = pairs.map(|pair| pair.map(|u| u.clamp(0.0, ONE_MINUS_EPSILON)));
    // At the border rounding may draw nothing.
    let Some(again) = emitter.sample_emission(bounds, u_position, u_direction) else { return Ok(()) };
    let off = again.point.position.distance(emission.point.position);
    let turn = again.direction.distance(emission.direction);
    let within = |part: f32| off <= part * bounds.radius && turn <= part;
    guided.starts += 1;
    guided.exact += u32::from(within(1e-4));
    require(within(1e-3), "coordinates of a start give that start", (emission, found, again))
}

/// The places on the disc in front of the scene where light from infinity starts.
fn check_disc(emitter: &impl Emitter, bounds: &BoundingSphere, random: &mut Random) -> Check {
    let mut moments: [Mean; 5] = Default::default();
    for _ in 0..DRAWS {
        let (u_position, u_direction) = (random.pair(), random.pair());
        let Some(emission) = emitter.sample_emission(bounds, u_position, u_direction) else {
            // Light that misses the scene need not be started.
            if emitter.sample_emission(bounds, random.pair(), u_direction).is_some() {
                return Ok(());
            }
            continue;
        };
        let offset = (emission.point.position - bounds.centre).as_dvec3() / f64::from(bounds.radius);
        let (tangent, bitangent) = emission.direction.as_dvec3().any_orthonormal_pair();
        let [x, y] = [tangent, bitangent].map(|axis| axis.dot(offset));
        for (mean, term) in moments.iter_mut().zip([x, y, x * x - 0.25, y * y - 0.25, x * y]) {
            mean.add(term);
        }
    }
    let mut drawn = moments.iter().filter(|moment| !moment.is_empty());
    drawn.try_for_each(|moment| moment.agrees((0.0, 2e-4), "the disc is sampled uniformly"))
}

/// A light that has one point or one direction: what is emitted is what receivers on its way see.
fn check_single(emitter: &impl Emitter, bounds: &BoundingSphere, random: &mut Random) -> Check {
    let draws: Vec<_> =
        (0..1000).filter_map(|_| emitter.sample_emission(bounds, random.pair(), random.pair())).collect();
    let brightest = draws.iter().map(|emission| emission.radiance.mean()).fold(0.0, f32::max);
    let densest = draws.iter().map(|emission| emission.pdf_direction).fold(0.0, f32::max);
    let close = |a: f32, b: f32, largest: f32| same(a, b) || (a - b).abs() <= 1e-3 * largest;
    let mut violations = Vec::new();
    for emission in &draws {
        require(same(emission.pdf_position, 1.0), "the density of a Dirac is one", emission)?;
        let position = emission.point.position;
        // So far that coordinates have the digits of the direction.
        let receiver = position + emission.direction * bounds.radius.max(0.02 * position.length());
        let Some(incident) = emitter.sample_incident(bounds, receiver, random.pair()) else {
            let is_dark = emission.radiance.mean() <= 1e-3 * brightest;
            let seen = require(is_dark, "what is emitted is seen on its way", (emission, receiver));
            violations.extend(seen.err());
            continue;
        };
        let case = (emission, incident);
        let are_one = same(incident.pdf, 1.0) && same(incident.pdf_position, 1.0);
        require(are_one, "the density of a Dirac is one", case)?;
        let opposite = incident.towards_light.distance(-emission.direction) <= 1e-3;
        require(opposite, "light is seen where it comes from", case)?;
        let agrees = close(incident.radiance.mean(), emission.radiance.mean(), brightest)
            && close(incident.pdf_direction, emission.pdf_direction, densest);
        violations.extend(require(agrees, "what is emitted is what is seen", case).err());
    }
    // At the edges of a beam and of the pixels of a projected image rounding decides.
    if violations.len() * 100 <= draws.len() { Ok(()) } else { Err(violations.swap_remove(0)) }
}

/// Whether a draw brings light to the receiver.
fn check_incident(
    emitter: &impl Emitter,
    bounds: &BoundingSphere,
    receiver: Vec3,
    random: &mut Random,
) -> Result<bool, ContractViolation> {
    let Some(incident) = emitter.sample_incident(bounds, receiver, random.pair()) else {
        return Ok(false);
    };
    let is_bright = !incident.radiance.is_black();
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
        require(!kind.is_hittable(), "a chosen point of a light can be hit", case)?;
        return Ok(is_bright);
    };
    let agrees = same_spectrum(seen.radiance, incident.radiance)
        && same(seen.pdf_incident, incident.pdf)
        && same(seen.pdf_position, incident.pdf_position)
        && same(seen.pdf_direction, incident.pdf_direction);
    require(agrees, "hit agrees with sample_incident", (case, seen))?;
    let alone =
        emitter.pdf_incident(bounds, &incident.point, -incident.towards_light, receiver, seen.pdf_position);
    require(same(alone, incident.pdf), "pdf_incident agrees with sample_incident", (case, alone))?;
    Ok(is_bright)
}

/// Directions from a surface or a volume must be drawn by their density. Directions that are drawn evenly and
/// looked at with `hit` tell how much light goes where.
fn check_emitted_directions(emitter: &impl Emitter, bounds: &BoundingSphere, random: &mut Random) -> Check {
    let is_area = emitter.kind() == EmitterKind::Area;
    let functions = |emission: &Emission, direction: Vec3| {
        let Vec3 { x, y, z } = direction;
        let cosine = if is_area { direction.dot(emission.point.normal) } else { 0.0 };
        [x, y, z, x * y, cosine, cosine * cosine].map(f64::from)
    };
    let cosine = |emission: &Emission, direction: Vec3| {
        if is_area { direction.dot(emission.point.normal).max(0.0) } else { 1.0 }
    };
    let (mut drawn, mut even) = (Distribution::default(), Distribution::default());
    for _ in 0..DRAWS {
        // A place from which some directions bring nothing counts as often as any other.
        let u_position = random.pair();
        let mut draw = |_| emitter.sample_emission(bounds, u_position, random.pair());
        let Some((failed, emission)) = (0..64).map(&mut draw).enumerate().find_map(|(i, e)| Some((i, e?)))
        else {
            continue;
        };
        let light = if failed > 0 { 0.0 } else { emission.radiance.mean() };
        let light = light * cosine(&emission, emission.direction);
        let light = light / (emission.pdf_position * emission.pdf_direction);
        drawn.add(f64::from(light), functions(&emission, emission.direction));
        let direction = random.direction();
        let receiver = emission.point.position + direction * bounds.radius;
        let seen = emitter.hit(bounds, &emission.point, direction, receiver);
        let radiance = seen.map_or(0.0, |seen| seen.radiance.mean());
        let light = radiance * cosine(&emission, direction) / emission.pdf_position;
        even.add(f64::from(light), functions(&emission, direction));
    }
    drawn.agrees(&even, "emission follows the density of directions")
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
    let (mut places_chosen, mut places_emitted) = (Distribution::default(), Distribution::default());
    let places = Places::of(emitter, bounds, random);
    for _ in 0..DRAWS {
        let incident = emitter.sample_incident(bounds, receiver, random.pair());
        let term = incident.map_or(0.0, |incident| {
            let cosine = incident.point.normal.dot(-incident.towards_light).max(0.0);
            let term =
                incident.radiance.mean() * cosine / (incident.distance * incident.distance * incident.pdf);
            places_chosen.add(f64::from(term), places.functions(incident.point.position));
            term
        });
        chosen.add(f64::from(term));
        let emission = emitter.sample_emission(bounds, random.pair(), random.pair());
        let term = emission.map_or(0.0, |emission| {
            let between = receiver - emission.point.position;
            let towards = between.normalize_or_zero();
            let cosine = emission.point.normal.dot(towards).max(0.0);
            let seen = emitter.hit(bounds, &emission.point, towards, receiver);
            let radiance = seen.map_or(0.0, |seen| seen.radiance.mean());
            let term = radiance * cosine / (between.length_squared() * emission.pdf_position);
            places_emitted.add(f64::from(term), places.functions(emission.point.position));
            term
        });
        emitted.add(f64::from(term));
    }
    chosen.agrees(emitted.value(), "both ways to choose points give the same irradiance")?;
    places_chosen.agrees(&places_emitted, "both ways to choose points give the same light everywhere")
}

/// The light of a volume must be the same by points for a receiver and by points of emission, out to the same
/// distances. Near the receiver the second way does not converge, so that near light counts less.
fn check_volume_fluence(
    emitter: &impl Emitter,
    bounds: &BoundingSphere,
    receiver: Vec3,
    random: &mut Random,
) -> Check {
    let near = 0.1 * bounds.radius;
    let fluence = |point: &EmitterPoint, radiance: f32, pdf: f32| {
        let passage = emitter.pdf_passage(point);
        require(passage > 0.0 && is_density(passage), "a passage has a density", (point, passage))?;
        Ok(f64::from(radiance / (receiver.distance_squared(point.position) + near * near) / pdf))
    };
    let (mut chosen, mut emitted) = (Mean::default(), Mean::default());
    let (mut places_chosen, mut places_emitted) = (Distribution::default(), Distribution::default());
    let places = Places::of(emitter, bounds, random);
    // Light that seldom gets out is seldom chosen for a receiver, and counts much where it is.
    let is_often = |point: &EmitterPoint| {
        let towards = (receiver - point.position).normalize_or_zero();
        let seen = emitter.hit(bounds, point, towards, receiver);
        seen.is_some_and(|seen| seen.pdf_incident >= 0.1 * seen.pdf_position)
    };
    for _ in 0..DRAWS {
        let mut term = 0.0;
        if let Some(incident) = emitter.sample_incident(bounds, receiver, random.pair()) {
            term = fluence(&incident.point, incident.radiance.mean(), incident.pdf)?;
            let light = if is_often(&incident.point) { term } else { 0.0 };
            places_chosen.add(light, places.functions(incident.point.position));
        }
        chosen.add(term);
        let mut term = 0.0;
        if let Some(emission) = emitter.sample_emission(bounds, random.pair(), random.pair()) {
            term = fluence(&emission.point, emission.radiance.mean(), emission.pdf_position)?;
            let light = if is_often(&emission.point) { term } else { 0.0 };
            places_emitted.add(light, places.functions(emission.point.position));
        }
        emitted.add(term);
    }
    chosen.agrees(emitted.value(), "both ways to choose points give the same fluence")?;
    places_chosen.agrees(&places_emitted, "both ways to choose points give the same light everywhere")
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
    let sources = Sources::of(emitter, bounds, random);
    let (mut drawn, mut even) = (Distribution::default(), Distribution::default());
    for _ in 0..DRAWS {
        let emission = emitter.sample_emission(bounds, random.pair(), random.pair());
        let term = emission.map_or(0.0, |e| f64::from(e.radiance.mean() / e.pdf_direction));
        power.add(term);
        if let Some(emission) = emission {
            drawn.add(term, sources.functions(emission.direction));
        }
        let direction = sources.sample(random);
        let receiver = position + direction * bounds.radius;
        if let Some(incident) = emitter.sample_incident(bounds, receiver, [0.5; 2]) {
            let term = f64::from(incident.radiance.mean()) / sources.pdf(direction);
            even.add(term, sources.functions(direction));
        }
    }
    power.agrees((flux, 0.006 * flux), "emission carries the flux that receivers see")?;
    drawn.agrees(&even, "emission follows the density of directions")
}

/// `∫ pdf dω = 1` over all directions, and the same flux by emission, by choice and by quadrature.
fn check_environment_directions(
    emitter: &impl Emitter,
    bounds: &BoundingSphere,
    random: &mut Random,
) -> Check {
    let anywhere = EmitterPoint { position: bounds.centre, normal: Vec3::Z };
    let (mut density, mut flux) = (Mean::default(), Mean::default());
    let mut all = Distribution::default();
    let sources = Sources::of(emitter, bounds, random);
    for _ in 0..20 * DRAWS {
        let direction = sources.sample(random);
        let pdf = sources.pdf(direction);
        let seen = emitter.hit(bounds, &anywhere, direction, bounds.centre);
        density.add(seen.map_or(0.0, |seen| f64::from(seen.pdf_position) / pdf));
        let light = seen.map_or(0.0, |seen| f64::from(seen.radiance.mean()) / pdf);
        flux.add(light);
        all.add(light, sources.functions(direction));
    }
    density.agrees((1.0, 0.0), "the density of directions integrates to one")?;
    let (mut chosen, mut emitted) = (Mean::default(), Mean::default());
    let (mut directions_chosen, mut directions_emitted) = (Distribution::default(), Distribution::default());
    for _ in 0..DRAWS {
        let mut light = 0.0;
        if let Some(incident) = emitter.sample_incident(bounds, bounds.centre, random.pair()) {
            light = f64::from(incident.radiance.mean() / incident.pdf);
            directions_chosen.add(light, sources.functions(-incident.towards_light));
        }
        chosen.add(light);
        let mut light = 0.0;
        if let Some(emission) = emitter.sample_emission(bounds, random.pair(), random.pair()) {
            light = f64::from(emission.radiance.mean() / emission.pdf_position);
            directions_emitted.add(light, sources.functions(emission.direction));
        }
        emitted.add(light);
    }
    chosen.agrees(flux.value(), "next event estimation sees all of the environment")?;
    emitted.agrees(flux.value(), "emission sees all of the environment")?;
    directions_chosen.agrees(&all, "next event estimation follows the density of directions")?;
    directions_emitted.agrees(&all, "emission follows the density of directions")
}
