//! Check of surfaces from both sides: normals, and the body inside.

use std::collections::BTreeMap;

use glam::Vec3;
use upbp_media::BodyId;

use super::{Check, require, short_distance};
use crate::Ray;
use crate::scene::{Boundary, Bsdf, EmitterId, Hit, Interface, MAX_CROSSINGS, Scene, Walk};

/// Fewest sightings of a normal that tell about its surface.
const TELLING: u32 = 8;

/// Surfaces that are looked at: those that are met first.
const SURFACES: usize = 1024;

/// Surfaces that are told apart: those of a body, those that carry a light, all others.
type Surface = (Option<BodyId>, Option<EmitterId>);

/// Normals of each surface, as rays have seen them.
///
/// Where boundaries coincide, `intersect` tells of one of them, so that a body may be met first where a ray
/// leaves it; but as many rays then come the other way, and enter there. Surfaces that coincide may have
/// opposite normals.
#[derive(Default)]
pub(super) struct Normals(BTreeMap<Surface, Seen>);

#[derive(Default)]
struct Seen {
    /// Somewhere on the surface.
    place: Vec3,
    /// Rays from outside that met the body first from outside, and from inside, by its normal.
    outwards: u32,
    inwards: u32,
    /// Points whose normal was the same for a ray from the other side, and the opposite.
    fixed: u32,
    turned: u32,
}

impl Normals {
    /// Follows a ray that starts outside of everything through all that it meets, and looks at each surface
    /// from the other side, too. What has an inside that matters must tell of it.
    pub(super) fn look<S: Scene>(&mut self, scene: &S, ray: &Ray) -> Check {
        // Nearer than anything else.
        let beyond = short_distance(&scene.bounds());
        let mut rest = *ray;
        let mut met: Vec<BodyId> = Vec::new();
        for _ in 0..MAX_CROSSINGS {
            let Some(hit) = scene.intersect(&rest).filter(|hit| hit.is_sound(rest.t_min)) else { break };
            check_enclosure(&hit)?;
            rest.t_min = hit.t + beyond;
            let surface = surface_of(&hit);
            if self.0.len() >= SURFACES && !self.0.contains_key(&surface) {
                continue;
            }
            let seen = self.0.entry(surface).or_insert(Seen { place: hit.position, ..Seen::default() });
            if let Some(body) = surface.0
                && !met.contains(&body)
            {
                met.push(body);
                let inwards = hit.geometric_normal.dot(ray.direction) > 0.0;
                *if inwards { &mut seen.inwards } else { &mut seen.outwards } += 1;
            }
            let back = Ray {
                origin: hit.position + ray.direction * beyond,
                direction: -ray.direction,
                t_min: 0.0,
                t_max: 2.0 * beyond,
            };
            let is_same = |other: &Hit<_>| {
                surface_of(other) == surface && other.position.distance(hit.position) < 0.2 * beyond
            };
            if let Some(other) = scene.intersect(&back).filter(is_same) {
                let turned = other.geometric_normal.dot(hit.geometric_normal) < 0.0;
                *if turned { &mut seen.turned } else { &mut seen.fixed } += 1;
            }
        }
        Ok(())
    }

    /// Places on surfaces that few rays have met.
    pub(super) fn rare(&self) -> Vec<Vec3> {
        let rare = self.0.values().filter(|seen| seen.outwards + seen.inwards < 4 * TELLING);
        rare.map(|seen| seen.place).collect()
    }

    /// Judges what was seen.
    pub(super) fn check(&self) -> Check {
        for ((body, light), seen) in &self.0 {
            let case = |wrong, right| (body, light, seen.place, format!("{wrong} of {}", wrong + right));
            require(
                seen.turned < TELLING || seen.turned <= seen.fixed,
                "a geometric normal belongs to its surface and does not turn towards the ray",
                case(seen.turned, seen.fixed),
            )?;
            require(
                seen.inwards < TELLING || seen.inwards <= 9 * seen.outwards,
                "geometric normals point out of a body",
                case(seen.inwards, seen.outwards),
            )?;
        }
        Ok(())
    }
}

fn surface_of<B>(hit: &Hit<B>) -> Surface {
    (hit.boundary.interior().map(|interior| interior.body), hit.emitter)
}

/// Checks that what has an inside that matters tells of it.
fn check_enclosure<B: Bsdf>(hit: &Hit<B>) -> Check {
    match &hit.boundary {
        Boundary::Opaque(bsdf) => require(
            !refracts(bsdf),
            "a surface that refracts encloses a body: its boundary is not opaque",
            hit.position,
        ),
        Boundary::Refracting(..) | Boundary::Null(_) => Ok(()),
    }
}

/// Whether light that goes through is bent, or goes elsewhere for other indices.
fn refracts<B: Bsdf>(bsdf: &B) -> bool {
    const STEPS: u16 = 8;
    let glass = |below| Interface { above: 1.0, below };
    [Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.6, 0.0, -0.8)].into_iter().any(|from| {
        let bent = |step: u16| {
            let u = (f32::from(step) + 0.5) / f32::from(STEPS);
            let sample = bsdf.sample(from, Walk::Camera, glass(1.5), u, [u, 0.5])?;
            let passes = sample.to.z * from.z < 0.0;
            let bends = if sample.delta {
                (sample.to + from).length() > 1e-2
            } else {
                let [one, other] = [1.5, 1.25].map(|below| bsdf.pdf(from, sample.to, glass(below)));
                (one - other).abs() > 1e-2 * one.max(other)
            };
            Some(passes && bends)
        };
        (0..STEPS).any(|step| bent(step) == Some(true))
    })
}
