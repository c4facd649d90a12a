//! [`check_scene`]: hits, crossings and bodies of a scene agree.

use glam::{Vec2, Vec3};
use upbp_media::{Medium as _, MediumId, RaySegment, Spectrum};

use super::normals::Normals;
use super::{Check, Random, is_unit, require, same_spectrum, short_distance};
use crate::Ray;
use crate::path::{cross_all, has_surface};
use crate::scene::{
    Boundary, BoundingSphere, Bsdf, Camera as _, Crossing, Emission, Emitter, EmitterId, EmitterKind,
    EmitterPoint, Interface, PathEnd, Scene, Walk,
};

/// Checks that the questions of [`Scene`] get consistent answers along random rays through its bounds: hits
/// lie on their ray, normals belong to their surface and point out of bodies, what refracts has an inside
/// with an index of refraction, surfaces scatter as the scene says of all of them, `trace` and `is_clear`
/// find what `intersect` does, and the bodies around a point follow from the boundaries on the way to it.
///
/// Rays meet every light that has an area, and walks stop where it is: it is on no null boundary, nor on a
/// refracting surface that another body hides; its surface shines on the side that its light starts from, and
/// a volume as its medium does. All light from infinity passes what is around everything
/// alike; nothing is seen from where it is said to be [hidden](Scene::hides); media have
/// [extents](Scene::medium_extent).
///
/// Rays that graze an edge can be answered either way, so that one ray in a hundred may disagree, and of the
/// normals of a body one in ten.
pub fn check_scene(scene: &impl Scene) -> Check {
    let bounds = scene.bounds();
    require(bounds.radius.is_finite() && bounds.radius > 0.0, "bounds have a radius", bounds)?;
    require(bounds.centre.is_finite(), "bounds have a centre", bounds)?;
    let mut random = Random(11);
    check_lights(scene, &bounds, &mut random)?;
    check_outside(scene, &bounds, &mut random)?;
    check_extents(scene)?;
    check_hidden(scene, &bounds, &mut random)?;
    let mut violations = Vec::new();
    let mut normals = Normals::default();
    let rays = 2000;
    for _ in 0..rays {
        let target = bounds.centre + random.direction() * (bounds.radius * random.next());
        let Some(ray) = ray_through(&bounds, target, &mut random) else { continue };
        normals.look(scene, &ray)?;
        check_lobes(scene, &ray, &mut random)?;
        violations.extend(check_ray(scene, &ray, &mut random).err());
        if violations.len() * 100 > rays {
            break;
        }
    }
    let agree = violations.len() * 100 <= rays;
    if agree {
        // What is small was met by few of them.
        for _ in 0..10 * rays {
            let target = bounds.centre + random.direction() * (bounds.radius * random.next());
            look_through(scene, target, &mut random, &mut normals)?;
        }
        for place in normals.rare() {
            for _ in 0..RAYS_AT_RARE {
                look_through(scene, place, &mut random, &mut normals)?;
            }
        }
    }
    normals.check()?;
    if agree { Ok(()) } else { Err(violations.swap_remove(0)) }
}

/// Checks that lights are where the scene is, and that rays meet those with an area: weights count on it.
fn check_lights(scene: &impl Scene, bounds: &BoundingSphere, random: &mut Random) -> Check {
    for (index, emitter) in scene.emitters().iter().enumerate() {
        if emitter.kind().is_infinite() {
            continue;
        }
        let (mut starts, mut met) = (0, 0);
        for _ in 0..16 {
            let Some(emission) = emitter.sample_emission(bounds, random.pair(), random.pair()) else {
                continue;
            };
            let position = emission.point.position;
            let before = short_distance(bounds);
            let inside = position.distance(bounds.centre) <= bounds.radius + 10.0 * before;
            require(inside, "lights lie within the bounds", (bounds, position))?;
            let (origin, direction) = (position + emission.direction * before, -emission.direction);
            let ray = Ray { origin, direction, t_min: 0.0, t_max: 2.0 * before };
            let hit = scene.intersect(&ray).filter(|hit| hit.emitter == Some(EmitterId(index as u32)));
            let passes = hit.as_ref().is_some_and(|hit| hit.boundary.is_null());
            require(!passes, "no surface that light passes straight is a light", (index, ray))?;
            // Where they graze it, rounding may put the origin behind it.
            let is_judged = hit.as_ref().is_some_and(|hit| hit.geometric_normal.dot(direction).abs() > 1e-2);
            let is_there = !is_judged || stops_on_surface(scene, &ray);
            require(is_there, "no light is on a surface that another body hides", (index, ray))?;
            // Another part of a hollow lamp may be in front of it.
            let is_start = |position: Vec3| position.distance(emission.point.position) <= 0.1 * before;
            let start = hit.as_ref().filter(|hit| is_judged && is_start(hit.position));
            let shines = start.is_none_or(|hit| {
                let point = EmitterPoint { position: hit.position, normal: hit.geometric_normal };
                let seen = emitter.hit(bounds, &point, emission.direction, origin);
                seen.is_some_and(|seen| !seen.radiance.is_black())
            });
            let is_light = shines || emission.radiance.is_black();
            require(is_light, "a light shines on the side of its surface that it starts from", (index, ray))?;
            check_glow(scene, emitter, &emission)?;
            starts += 1;
            met += u32::from(hit.is_some());
        }
        let need_not_be_met = starts == 0 || emitter.kind() != EmitterKind::Area;
        require(need_not_be_met || met > 0, "rays meet lights that have an area", (index, starts))?;
    }
    Ok(())
}

/// Checks that light which starts in a volume is that of the medium there.
fn check_glow<S: Scene>(scene: &S, emitter: &S::Emitter, emission: &Emission) -> Check {
    let EmitterKind::Volume(body) = emitter.kind() else { return Ok(()) };
    let position = emission.point.position;
    let bodies = scene.stack_at(position);
    let Some(top) = bodies.top().filter(|top| top.body == body) else { return Ok(()) };
    let medium = top.medium.and_then(|medium| scene.media().get(medium.0 as usize));
    let source = medium.map_or(Spectrum::ZERO, |medium| medium.source(position));
    let is_that = same_spectrum(source, emission.radiance);
    require(is_that, "a volume shines as the medium in it", (body, emission, source))
}

/// Whether a walk along `ray` stops on the surface that it meets first, together with what coincides there.
fn stops_on_surface<S: Scene>(scene: &S, ray: &Ray) -> bool {
    let mut crossings = Vec::new();
    let Some(hit) = scene.trace(ray, &mut crossings) else { return false };
    let Some(boundary) = hit.crossing(ray.direction) else { return true };
    let before = crossings.partition_point(|crossing| crossing.t < hit.t);
    let mut bodies = scene.stack_at(ray.origin);
    cross_all(&mut bodies, &crossings[..before]);
    // Into a body before out of one, as all crossings at a distance.
    crossings.insert(if boundary.entering { before } else { crossings.len() }, boundary);
    has_surface(&bodies, &crossings[before..])
}

/// Checks that light from infinity passes the medium around everything wherever it comes from and goes to:
/// walks that start there are given one probability for all.
fn check_outside(scene: &impl Scene, bounds: &BoundingSphere, random: &mut Random) -> Check {
    let Some(outside) = scene.outside().and_then(|medium| scene.media().get(medium.0 as usize)) else {
        return Ok(());
    };
    if !scene.emitters().iter().any(|emitter| emitter.kind().is_infinite()) {
        return Ok(());
    }
    let mut first = None;
    for _ in 0..64 {
        let origin = bounds.centre + random.direction() * (bounds.radius * random.next());
        let ray = RaySegment { origin, direction: random.direction(), start: 0.0, end: f32::INFINITY };
        let density = outside.segment(&ray);
        let case = (ray, density.transmittance, density.pass_probability);
        let all_or_nothing = density.transmittance.to_array().iter().all(|t| *t == 0.0 || *t == 1.0);
        require(
            all_or_nothing,
            "what is around everything lets all light from infinity pass, or none",
            case,
        )?;
        let passes = (density.transmittance, density.pass_probability);
        require(
            *first.get_or_insert(passes) == passes,
            "what is around everything lets light from infinity pass alike everywhere",
            case,
        )?;
    }
    Ok(())
}

fn check_extents(scene: &impl Scene) -> Check {
    (0..scene.media().len() as u32).try_for_each(|medium| {
        let extent = scene.medium_extent(MediumId(medium));
        let is_extent = extent.is_finite() && extent > 0.0;
        require(is_extent, "the extent of a medium is positive and finite", (medium, extent))
    })
}

/// Lights that are asked for hidden places.
const LIGHTS: usize = 64;

/// Checks that no light and no part of the lens is seen from where a scene says that it is hidden.
fn check_hidden(scene: &impl Scene, bounds: &BoundingSphere, random: &mut Random) -> Check {
    let (width, height) = scene.camera().resolution();
    let size = Vec2::new(width as f32, height as f32);
    for _ in 0..256 {
        let place = bounds.centre + random.direction() * (bounds.radius * random.next());
        let body = scene.stack_at(place).top().map(|top| top.body);
        for (index, emitter) in scene.emitters().iter().enumerate().take(LIGHTS) {
            let ends = [PathEnd::Lights, PathEnd::Light(EmitterId(index as u32))];
            let Some(end) = ends.into_iter().find(|end| scene.hides(body, *end)) else { continue };
            let Some(incident) = emitter.sample_incident(bounds, place, random.pair()) else { continue };
            let is_seen = is_seen(scene, place, incident.towards_light, incident.distance);
            require(!is_seen, "what is hidden is not seen", (place, body, end, incident))?;
        }
        if scene.hides(body, PathEnd::Lens)
            && let Some(seen) = scene.camera().ray(Vec2::from(random.pair()) * size, random.pair())
            && let Some(direction) = (seen.origin - place).try_normalize()
        {
            let is_seen = is_seen(scene, place, direction, place.distance(seen.origin));
            require(!is_seen, "what is hidden is not seen", (place, body, PathEnd::Lens, seen.origin))?;
        }
    }
    Ok(())
}

/// Whether no surface that scatters is on a line, whatever body counts there, but for one within roundings of
/// its end.
fn is_seen(scene: &impl Scene, origin: Vec3, direction: Vec3, distance: f32) -> bool {
    let roundings = 32.0 * f32::EPSILON * (1.0 + origin.length() / distance);
    let ray = Ray { origin, direction, t_min: 0.0, t_max: distance * (1.0 - roundings) };
    let mut crossings = Vec::new();
    scene.is_clear(&ray, &mut crossings) && !crossings.iter().any(|crossing| crossing.scatters)
}

/// Rays through each place where there is little else.
const RAYS_AT_RARE: usize = 32;

/// A ray from outside of everything, through `target` and beyond everything.
fn ray_through(bounds: &BoundingSphere, target: Vec3, random: &mut Random) -> Option<Ray> {
    let origin = bounds.centre + random.direction() * (1.2 * bounds.radius);
    let direction = (target - origin).try_normalize()?;
    Some(Ray { origin, direction, t_min: 0.0, t_max: 4.0 * bounds.radius })
}

fn look_through(scene: &impl Scene, target: Vec3, random: &mut Random, normals: &mut Normals) -> Check {
    match ray_through(&scene.bounds(), target, random) {
        Some(ray) => normals.look(scene, &ray),
        None => Ok(()),
    }
}

/// Checks that a scene says so if the surface that a ray meets has a Dirac lobe.
fn check_lobes(scene: &impl Scene, ray: &Ray, random: &mut Random) -> Check {
    let Some(hit) = scene.intersect(ray) else { return Ok(()) };
    let Some(bsdf) = hit.boundary.bsdf() else { return Ok(()) };
    let below = hit.boundary.interior().map_or(1.0, |interior| interior.ior);
    let (from, interface) = (Vec3::new(0.6, 0.0, 0.8), Interface { above: 1.0, below });
    let sample = bsdf.sample(from, Walk::Camera, interface, random.next(), random.pair());
    let told = scene.has_specular_surfaces() || !sample.is_some_and(|sample| sample.delta);
    require(told, "a scene without specular surfaces has none", (ray, hit.t, sample))
}

fn check_ray(scene: &impl Scene, ray: &Ray, random: &mut Random) -> Check {
    let short = short_distance(&scene.bounds());
    if let Some(hit) = scene.intersect(ray) {
        let case = (ray, hit.t, hit.geometric_normal, hit.shading_normal);
        require(hit.t > ray.t_min && hit.t < ray.t_max, "a hit is within the ray", case)?;
        let near = hit.position.distance(ray.origin + ray.direction * hit.t) < short;
        require(near, "a hit's position is on the ray", case)?;
        let units = is_unit(hit.geometric_normal) && is_unit(hit.shading_normal);
        require(units, "normals are unit vectors", case)?;
        let connectible = hit.boundary.bsdf().is_some_and(Bsdf::is_connectible);
        let told = scene.has_connectible_surfaces() || !connectible;
        require(told, "a scene without connectible surfaces has none", case)?;
        let sides = hit.geometric_normal.dot(hit.shading_normal) >= 0.0;
        require(sides, "the shading normal is on the side of the geometric one", case)?;
    }
    let mut crossings = Vec::new();
    let hit = scene.trace(ray, &mut crossings);
    let interiors =
        crossings.iter().map(|c| c.interior).chain(hit.as_ref().and_then(|hit| hit.boundary.interior()));
    let dull = interiors.clone().find(|interior| !(interior.ior > 0.0 && interior.ior.is_finite()));
    require(dull.is_none(), "a body has a positive finite index of refraction", (ray, dull))?;
    let unknown =
        interiors.filter_map(|interior| interior.medium).find(|m| m.0 as usize >= scene.media().len());
    require(unknown.is_none(), "the medium of a body exists", (ray, unknown))?;
    let emitter = hit.as_ref().and_then(|hit| hit.emitter);
    let exists = emitter.is_none_or(|emitter| (emitter.0 as usize) < scene.emitters().len());
    require(exists, "the light of a surface exists", (ray, emitter))?;
    let end = hit.as_ref().map_or(ray.t_max, |hit| hit.t);
    require(
        is_ordered(&crossings, ray, end),
        "crossings are sorted and before the hit",
        (ray, &crossings, end),
    )?;
    let passes = crossings.iter().all(|c| !c.scatters || c.t == end);
    require(passes, "trace only crosses null boundaries before the hit", (ray, &crossings))?;

    // Short of the hit nothing blocks; beyond an opaque one something does.
    let mut passed = Vec::new();
    let before = Ray { t_max: end - 10.0 * short, ..*ray };
    let clear = before.t_max <= before.t_min || scene.is_clear(&before, &mut passed);
    require(clear, "nothing blocks before the nearest hit", (ray, end))?;
    if hit.is_some_and(|hit| matches!(hit.boundary, Boundary::Opaque(_))) {
        let beyond = Ray { t_max: end + 10.0 * short, ..*ray };
        require(!scene.is_clear(&beyond, &mut Vec::new()), "an opaque hit blocks", (ray, end))?;
    }

    // The bodies around a point of the first stretch: those at the start, and the boundaries since.
    let t = end * random.next();
    let near_boundary = crossings.iter().any(|crossing| (crossing.t - t).abs() < 10.0 * short);
    if near_boundary {
        return Ok(());
    }
    let mut stack = scene.stack_at(ray.origin);
    cross_all(&mut stack, &crossings[..crossings.partition_point(|crossing| crossing.t < t)]);
    let there = scene.stack_at(ray.origin + ray.direction * t);
    require(stack == there, "the bodies around a point follow from the boundaries", (ray, t, stack, there))
}

fn is_ordered(crossings: &[Crossing], ray: &Ray, end: f32) -> bool {
    crossings.is_sorted_by(|a, b| a.t <= b.t) && crossings.iter().all(|c| c.t > ray.t_min && c.t <= end)
}
