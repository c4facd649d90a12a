//! A scene that is ready to render.
//!
//! The geometry lies behind one hierarchy, with a record of material, body and light for each shape.
//! Boundaries of bodies are gathered in one traversal together with the surface that ends the ray, so that
//! boundaries that coincide are all found ([`place`]).

use std::path::PathBuf;

use glam::Vec3;
use upbp_accel::{BoxTree, Candidate, Ray, SceneGeometry, ShapeId, Visit};
use upbp_estimators::scene::{Boundary, BoundingSphere, Bsdf, Crossing, EmitterId, Hit, PathEnd, Scene};
use upbp_media::{BodyId, Homogeneous, Interior, MediumId, MediumStack};

pub(crate) use self::enclosures::{Enclosures, Ends};
use self::place::largest_width_of_plane;
pub(crate) use self::place::{COINCIDENT, IN_PLANE, ROUNDING};
use crate::camera::PerspectiveCamera;
use crate::error::Problem;
use crate::light::Light;
use crate::material::Material;

/// The record of a shape: everything but its geometry.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface {
    pub(crate) boundary: Boundary<Material>,
    /// The light that it carries.
    pub(crate) emitter: Option<EmitterId>,
}

/// A body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Body {
    pub(crate) shape: ShapeId,
    pub(crate) interior: Interior,
}

/// A scene that is ready to render: read it with [`load`](Self::load) or
/// [`from_ron_str`](Self::from_ron_str), or [`build`](Self::build) it from a description.
#[derive(Clone, Debug)]
pub struct ReadyScene {
    pub(crate) geometry: SceneGeometry,
    /// By [`ShapeId`].
    pub(crate) surfaces: Vec<Surface>,
    pub(crate) bodies: Vec<Body>,
    pub(crate) enclosures: Enclosures,
    /// By the number of the body.
    pub(crate) body_boxes: BoxTree,
    pub(crate) lights: Vec<Light>,
    pub(crate) media: Vec<Homogeneous>,
    /// [`Scene::medium_extent`], by [`MediumId`].
    pub(crate) extents: Vec<f32>,
    /// Whether any surface may scatter light into single directions.
    pub(crate) is_specular: bool,
    pub(crate) camera: PerspectiveCamera,
    pub(crate) outside: Option<MediumId>,
    /// The most that is [rounded](upbp_accel::TriangleMesh::rounded) for corners of meshes that refract.
    pub(crate) most_rounded: f32,
    pub(crate) bounds: BoundingSphere,
    pub(crate) origin: Vec3,
    pub(crate) hash: u64,
    pub(crate) files: Vec<PathBuf>,
    pub(crate) notes: Vec<Problem>,
}

impl ReadyScene {
    /// The point of the description that has become the origin. A scene that is much farther from its origin
    /// than it is large is moved, exactly; all other positions that a ready scene takes or returns are
    /// relative to this one.
    #[must_use]
    pub const fn origin(&self) -> Vec3 {
        self.origin
    }

    /// The shapes behind their hierarchy, in the order of the description.
    #[must_use]
    pub const fn geometry(&self) -> &SceneGeometry {
        &self.geometry
    }

    /// A fingerprint, equal for equal scenes: the [hash of the description](crate::SceneDescription::hash),
    /// mixed with the contents of the files that it refers to.
    #[must_use]
    pub const fn hash(&self) -> u64 {
        self.hash
    }

    /// The files of meshes, images and tables that were read, in the order of reading, without the scene file
    /// itself. A program that writes files must not overwrite them.
    #[must_use]
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// Notes about parts of the scene that can be rendered, but may not be meant: a medium that is nowhere, a
    /// priority of an opaque shape, a mesh whose pieces overlap, an image that is not twice as wide as high.
    /// Beyond a thousand the last one says how many more there are.
    #[must_use]
    pub fn notes(&self) -> &[Problem] {
        &self.notes
    }

    fn record(&self, candidate: &Candidate) -> &Surface {
        &self.surfaces[candidate.shape.0 as usize]
    }

    /// Adds an intersection with an opaque surface.
    #[inline]
    fn add(&self, ray: &Ray, opaque: &mut Opaque, candidate: &Candidate) {
        keep_nearer(&mut opaque.nearest, candidate);
        if self.record(candidate).emitter.is_some() && self.geometry.is_entering(ray, candidate) {
            keep_nearer(&mut opaque.lamp, candidate);
        }
    }

    fn hit(&self, ray: &Ray, candidate: &Candidate) -> Hit<Material> {
        let point = self.geometry.surface(ray, candidate);
        let record = self.record(candidate);
        Hit {
            t: candidate.t,
            position: point.position,
            geometric_normal: point.geometric_normal,
            shading_normal: point.shading_normal,
            boundary: record.boundary,
            emitter: record.emitter,
        }
    }

    fn crossing(&self, ray: &Ray, candidate: &Candidate, interior: Interior, scatters: bool) -> Crossing {
        Crossing { t: candidate.t, interior, entering: self.geometry.is_entering(ray, candidate), scatters }
    }
}

/// Opaque surfaces along a ray.
#[derive(Default)]
struct Opaque {
    nearest: Option<Candidate>,
    /// The nearest that shines towards the start of the ray, if it may be in the plane of the nearest.
    lamp: Option<Candidate>,
}

/// Keeps the nearer of two candidates; at equal distance that of the earlier shape: the order of the
/// traversal does not matter. Returns the distance of the other.
fn keep_nearer(nearest: &mut Option<Candidate>, candidate: &Candidate) -> f32 {
    let is_before = |a: &Candidate, b: &Candidate| {
        let key = |c: &Candidate| (c.shape, c.primitive);
        a.t < b.t || a.t == b.t && key(a) <= key(b)
    };
    if nearest.as_ref().is_some_and(|nearest| is_before(nearest, candidate)) {
        return candidate.t;
    }
    nearest.replace(*candidate).map_or(f32::INFINITY, |farther| farther.t)
}

/// Sorts crossings by distance; at the same distance into a body before out of one, so that a body that is
/// only touched is left again.
fn sort(crossings: &mut [Crossing]) {
    crossings.sort_unstable_by(|a, b| {
        let by_body = || a.interior.body.cmp(&b.interior.body);
        a.t.total_cmp(&b.t).then(b.entering.cmp(&a.entering)).then_with(by_body)
    });
}

impl Scene for ReadyScene {
    type Bsdf = Material;
    type Emitter = Light;
    type Medium = Homogeneous;
    type Camera = PerspectiveCamera;

    fn intersect(&self, ray: &Ray) -> Option<Hit<Material>> {
        let (mut nearest, mut opaque) = (None, Opaque::default());
        self.geometry.for_each_hit(*ray, |candidate| {
            keep_nearer(&mut nearest, candidate);
            if matches!(self.record(candidate).boundary, Boundary::Opaque(_)) {
                self.add(ray, &mut opaque, candidate);
            }
            Visit::ShrinkTo(candidate.t + largest_width_of_plane(ray, candidate.t))
        });
        let nearest = nearest?;
        let lamp = opaque.nearest.filter(|opaque| *opaque == nearest).and(opaque.lamp);
        lamp.and_then(|lamp| self.lamp_in_plane(ray, &nearest, &lamp)).or(Some(self.hit(ray, &nearest)))
    }

    fn bounds(&self) -> BoundingSphere {
        self.bounds
    }

    fn emitters(&self) -> &[Light] {
        &self.lights
    }

    fn media(&self) -> &[Homogeneous] {
        &self.media
    }

    fn camera(&self) -> &PerspectiveCamera {
        &self.camera
    }

    fn outside(&self) -> Option<MediumId> {
        self.outside
    }

    fn medium_extent(&self, medium: MediumId) -> f32 {
        self.extents.get(medium.0 as usize).copied().unwrap_or_else(|| self.bounds.largest_coordinate())
    }

    #[inline]
    fn hides(&self, body: Option<BodyId>, end: PathEnd) -> bool {
        self.enclosures.hides(body, end)
    }

    fn has_connectible_surfaces(&self) -> bool {
        self.surfaces.iter().filter_map(|surface| surface.boundary.bsdf()).any(Material::is_connectible)
    }

    fn has_specular_surfaces(&self) -> bool {
        self.is_specular
    }

    fn trace(&self, ray: &Ray, crossings: &mut Vec<Crossing>) -> Option<Hit<Material>> {
        let (mut opaque, mut refracting) = (Opaque::default(), None);
        let mut second = f32::INFINITY;
        self.geometry.for_each_hit(*ray, |candidate| {
            match self.record(candidate).boundary {
                Boundary::Null(interior) => {
                    crossings.push(self.crossing(ray, candidate, interior, false));
                    Visit::Continue
                }
                Boundary::Opaque(_) => {
                    self.add(ray, &mut opaque, candidate);
                    // As far as a lamp may be in its plane.
                    Visit::ShrinkTo(candidate.t + largest_width_of_plane(ray, candidate.t))
                }
                Boundary::Refracting(..) => {
                    second = second.min(keep_nearer(&mut refracting, candidate));
                    // As far as something may coincide.
                    Visit::ShrinkTo(candidate.t + self.largest_width(ray, candidate.t))
                }
            }
        });
        let Opaque { nearest: opaque, lamp } = opaque;
        let nearest = refracting.filter(|refracting| opaque.is_none_or(|opaque| refracting.t < opaque.t));
        let Some(nearest) = nearest.or(opaque) else {
            sort(crossings);
            return None;
        };
        let may_coincide = |lamp: &Candidate| lamp.t < nearest.t + largest_width_of_plane(ray, nearest.t);
        let lamp = lamp.filter(|lamp| Some(nearest) == opaque && *lamp != nearest && may_coincide(lamp));
        let lamp = lamp.and_then(|lamp| self.lamp_in_plane(ray, &nearest, &lamp));
        let mut hit = lamp.unwrap_or_else(|| self.hit(ray, &nearest));
        if hit.boundary.interior().is_none() && crossings.is_empty() {
            return Some(hit);
        }
        let plane = self.plane(ray, &nearest, hit.position, hit.geometric_normal);
        let width = plane.width(ray);
        let (before, behind) = (nearest.t - width, nearest.t + width);
        let is_near = |crossing: &Crossing| before < crossing.t && crossing.t < behind;
        let may_coincide = crossings.iter().any(is_near)
            || hit.boundary.interior().is_some()
                && (second < behind || ray.t_max < behind || opaque.is_some_and(|opaque| opaque.t < behind));
        if may_coincide {
            hit = self.surface_at(ray, &plane, crossings).unwrap_or(hit);
        } else {
            crossings.retain(|crossing| crossing.t <= before);
        }
        sort(crossings);
        Some(hit)
    }

    fn is_clear(&self, ray: &Ray, crossings: &mut Vec<Crossing>) -> bool {
        let clear = !self.geometry.any_where(*ray, |candidate| {
            let boundary = &self.record(candidate).boundary;
            let Some(interior) = boundary.interior() else { return true };
            crossings.push(self.crossing(ray, candidate, interior, !boundary.is_null()));
            false
        });
        if clear {
            sort(crossings);
            self.join(ray, crossings);
        }
        clear
    }

    fn stack_at(&self, point: Vec3) -> MediumStack {
        let mut stack = MediumStack::new(self.outside);
        self.body_boxes.for_each_around(point, |index| {
            let body = &self.bodies[index];
            if self.geometry.contains(body.shape, point) == Some(true) {
                // A body that is entered twice is a contradiction, which the walks count.
                let _ = stack.enter(body.interior);
            }
        });
        stack
    }
}

mod enclosures;
mod place;
#[cfg(test)]
mod tests;
