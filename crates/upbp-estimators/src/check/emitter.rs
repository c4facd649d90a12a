//! [`check_emitter`]: emission, next event and hits of a light agree.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use super::{Check, DRAWS, Random, direction, is_density, is_light, is_unit, require, same, same_spectrum};
use crate::scene::{BoundingSphere, Emission, Emitter, EmitterKind, EmitterPoint};

/// Checks the contract of [`Emitter`] in a scene with these bounds, for receivers at the given points, of
/// which a light that shines should reach at least one.
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
        EmitterKind::Volume(_) => receivers
            .iter()
            .try_for_each(|&receiver| check_volume_fluence(emitter, bounds, receiver, &mut random)),
    }
}

fn check_emission(emitter: &impl Emitter, bounds: &BoundingSphere, random: &mut Random) -> Check {
    let (u_position, u_direction) = (random.pair(), random.pair());
    let Some(emission) = emitter.sample_emission(bounds, u_position, u_direction) else {
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
        let outside = offset.dot(emission.direction) <= -bounds.radius * 0.999;
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
    check_coordinates(emitter, bounds, [u_position, u_direction], &emission, receiver)?;
    check_bounds(emitter, bounds, &emission)?;
    let seen = emitter.hit(bounds, &emission.point, emission.direction, receiver);
    require(seen.is_some() == kind.is_hittable(), "hit answers for lights that can be hit", emission)?;
    let Some(seen) = seen else { return Ok(()) };
    let agrees = same_spectrum(seen.radiance, emission.radiance)
        && same(seen.pdf_position, emission.pdf_position)
        && same(seen.pdf_direction, emission.pdf_direction);
    require(agrees, "hit agrees with sample_emission", (emission, seen))
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

/// Coordinates that are known start the same light again.
fn check_coordinates(
    emitter: &impl Emitter,
    bounds: &BoundingSphere,
    [u_position, u_direction]: [[f32; 2]; 2],
    emission: &Emission,
    receiver: Vec3,
) -> Check {
    let found = emitter.emission_coordinates(bounds, &emission.point, emission.direction, receiver);
    let Some(found) = found else { return Ok(()) };
    let pairs = [found.position.unwrap_or(u_position), found.direction.unwrap_or(u_direction)];
    let is_number = pairs.as_flattened().iter().all(|u| (-1e-4..=1.0001).contains(u));
    require(is_number, "coordinates of a start are random numbers", (emission, found))?;
    let [u_position, u_direction] = pairs.map(|pair| pair.map(|u| u.clamp(0.0, 1.0 - f32::EPSILON / 2.0)));
    // At the border rounding may draw nothing.
    let Some(again) = emitter.sample_emission(bounds, u_position, u_direction) else { return Ok(()) };
    let off = again.point.position.distance(emission.point.position);
    let is_same = off <= 1e-3 * bounds.radius && again.direction.distance(emission.direction) <= 1e-3;
    require(is_same, "coordinates of a start give that start", (emission, found, again))
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
    for _ in 0..DRAWS {
        let term = match emitter.sample_incident(bounds, receiver, random.pair()) {
            Some(incident) => fluence(&incident.point, incident.radiance.mean(), incident.pdf)?,
            None => 0.0,
        };
        chosen.add(term);
        let term = match emitter.sample_emission(bounds, random.pair(), random.pair()) {
            Some(emission) => fluence(&emission.point, emission.radiance.mean(), emission.pdf_position)?,
            None => 0.0,
        };
        emitted.add(term);
    }
    chosen.agrees(emitted.value(), "both ways to choose points give the same fluence")
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

/// A distribution of directions: every other one anywhere, and every other one in a cone around where light
/// comes from, which uniform directions may miss altogether.
struct Sources {
    axis: DVec3,
    /// One minus the cosine of the cone's half angle.
    height: f64,
}

impl Sources {
    /// By what the emitter draws: a cone of twice their angle.
    fn of(emitter: &impl Emitter, bounds: &BoundingSphere, random: &mut Random) -> Self {
        let drawn: Vec<DVec3> = (0..1000)
            .filter_map(|_| emitter.sample_emission(bounds, random.pair(), random.pair()))
            .map(|emission| emission.direction.as_dvec3())
            .collect();
        let axis = drawn.iter().sum::<DVec3>().normalize_or(DVec3::Z);
        let farthest = drawn.iter().map(|direction| versine(axis, *direction)).fold(0.0, f64::max);
        Self { axis, height: (4.0 * farthest).clamp(1e-12, 2.0) }
    }

    fn sample(&self, random: &mut Random) -> Vec3 {
        if random.next() < 0.5 {
            return random.direction();
        }
        let [u, v] = random.pair().map(f64::from);
        let (below_pole, (sin_phi, cos_phi)) = (u * self.height, (TAU * v).sin_cos());
        let sine = (below_pole * (2.0 - below_pole)).sqrt();
        let (tangent, bitangent) = self.axis.any_orthonormal_pair();
        let across = sine * (cos_phi * tangent + sin_phi * bitangent);
        (across + (1.0 - below_pole) * self.axis).as_vec3().normalize()
    }

    fn pdf(&self, direction: Vec3) -> f64 {
        let is_inside = versine(self.axis, direction.as_dvec3()) <= self.height;
        0.5 / (2.0 * TAU) + if is_inside { 0.5 / (TAU * self.height) } else { 0.0 }
    }
}

/// One minus the cosine of the angle between two unit vectors.
fn versine(a: DVec3, b: DVec3) -> f64 {
    0.5 * a.distance_squared(b)
}

/// `∫ pdf dω = 1` over all directions, and the same flux by emission, by choice and by quadrature.
fn check_environment_directions(
    emitter: &impl Emitter,
    bounds: &BoundingSphere,
    random: &mut Random,
) -> Check {
    let anywhere = EmitterPoint { position: bounds.centre, normal: Vec3::Z };
    let (mut density, mut flux) = (Mean::default(), Mean::default());
    let sources = Sources::of(emitter, bounds, random);
    for _ in 0..20 * DRAWS {
        let direction = sources.sample(random);
        let pdf = sources.pdf(direction);
        let seen = emitter.hit(bounds, &anywhere, direction, bounds.centre);
        density.add(seen.map_or(0.0, |seen| f64::from(seen.pdf_position) / pdf));
        flux.add(seen.map_or(0.0, |seen| f64::from(seen.radiance.mean()) / pdf));
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
