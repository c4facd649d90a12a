//! The scene.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use upbp_estimators::scene::{Boundary, BoundingSphere, EmitterId, Hit, Scene};
use upbp_estimators::{BodyId, EmissionGuide, EmitterChoice, Interior, MediumId, Ray};

use super::camera::ThinLens;
use super::fog::Fog;
use super::light::{Light, Source};
use super::material::Material;
use super::shape::Shape;

/// Cosine of the shading normal's largest tilt is well above zero: it never leaves the hemisphere.
const BUMP: f64 = 0.25;

/// Something that a ray can meet.
#[derive(Clone, Copy, Debug)]
pub struct Object {
    /// Geometry.
    pub shape: Shape,
    /// Material, and the body that the shape encloses.
    pub boundary: Boundary<Material>,
    /// Light that the shape is.
    pub emitter: Option<EmitterId>,
    bumpy: bool,
}

impl Object {
    fn new(shape: Shape, boundary: Boundary<Material>) -> Self {
        Self { shape, boundary, emitter: None, bumpy: false }
    }

    /// Shading normal at a point of the surface, of unit length.
    pub fn shading_normal(&self, point: DVec3) -> DVec3 {
        let normal = self.shape.normal(point);
        if !self.bumpy {
            return normal;
        }
        let (s, t) = normal.any_orthonormal_pair();
        (normal + BUMP * (5.0 * point.x).sin() * s + BUMP * (7.0 * point.z).cos() * t).normalize()
    }
}

/// The scene in closed form.
#[derive(Debug)]
pub struct ClosedForm {
    /// Surfaces and boundaries.
    pub objects: Vec<Object>,
    /// Lights, at the positions of their [`EmitterId`].
    pub lights: Vec<Light>,
    /// Media, at the positions of their [`MediumId`].
    pub media: Vec<Fog>,
    /// Camera.
    pub camera: ThinLens,
    /// Guides of light sub-paths, at the positions of their [`EmitterId`], for oracles; none at first.
    pub guides: Vec<Option<EmissionGuide>>,
    /// Point that light from infinity starts on discs around, for oracles of guided starts; none at first.
    pub focus: Option<Vec3>,
    /// The choice of emitters, for oracles, without guides; by power at first.
    pub choice: Option<Arc<EmitterChoice>>,
}

impl ClosedForm {
    /// The scene, with a film of `size` pixels a side, a pinhole at `centre`.
    pub fn new(centre: Vec3, size: u32) -> Self {
        let media = vec![
            // Chromatic and forward.
            Fog::new([0.05, 0.02, 0.1], [0.4, 0.6, 0.9], 0.6),
            // Dense, grey, backward.
            Fog::new([0.2; 3], [1.8; 3], -0.3),
            // Absorbs only.
            Fog::new([0.5, 1.0, 2.0], [0.0; 3], 0.0),
            // In the glass.
            Fog::new([0.3, 0.1, 0.1], [0.2, 0.8, 0.5], 0.3),
            // In the paper lantern.
            Fog::new([0.1; 3], [1.2; 3], 0.0),
        ];
        let lamp = Shape::rectangle([-0.4, 1.9, -0.4], [0.8, 0.0, 0.0], [0.0, 0.0, 0.8]);
        let lamp_in_fog = Shape::rectangle([0.3, 0.95, -0.2], [0.3, 0.0, 0.0], [0.0, 0.0, 0.3]);
        // Both shine downwards: u × v = −y.
        let shining = |shape, emitter| Object {
            emitter: Some(EmitterId(emitter)),
            ..Object::new(shape, Boundary::Opaque(Material::Diffuse))
        };
        // Each body has a medium of its own.
        let body = |number, priority, ior| Interior {
            body: BodyId(number),
            medium: Some(MediumId(number)),
            priority,
            ior,
        };
        let objects = vec![
            Object {
                bumpy: true,
                ..Object::new(
                    Shape::rectangle([-2.0, -1.0, -2.0], [0.0, 0.0, 4.0], [4.0, 0.0, 0.0]),
                    Boundary::Opaque(Material::Diffuse),
                )
            },
            Object::new(
                Shape::rectangle([-2.0, -1.0, -2.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]),
                Boundary::Opaque(Material::Coated),
            ),
            // Fog, open to the floor; a dense cloud in it, and a dark one in that.
            Object::new(Shape::sphere([0.0, 0.1, 0.0], 1.3), Boundary::Null(body(0, 0, 1.0))),
            Object::new(Shape::sphere([0.55, -0.1, 0.1], 0.45), Boundary::Null(body(1, 1, 1.0))),
            Object::new(Shape::sphere([0.55, -0.1, 0.25], 0.2), Boundary::Null(body(2, 2, 1.0))),
            // Half in the fog, whose boundary is hidden inside.
            Object::new(
                Shape::sphere([-0.8, -0.4, 0.4], 0.45),
                Boundary::Refracting(Material::Glass, body(3, 10, 1.5)),
            ),
            Object::new(Shape::sphere([0.2, -0.7, 0.8], 0.25), Boundary::Opaque(Material::Mirror)),
            Object::new(
                Shape::sphere([-0.1, 0.6, -0.3], 0.3),
                Boundary::Refracting(Material::Paper, body(4, 5, 1.0)),
            ),
            shining(lamp, 0),
            shining(lamp_in_fog, 1),
        ];
        let light = |source, power| Light { source, power };
        let lights = vec![
            light(Source::Area(lamp), 3.0),
            light(Source::Area(lamp_in_fog), 1.5),
            light(Source::Point(DVec3::new(-0.5, 0.3, 0.6)), 2.0),
            light(Source::Directional(DVec3::new(0.3, -1.0, -0.4).normalize()), 1.0),
            light(Source::Environment, 2.0),
        ];
        let camera = ThinLens { centre, size, film_distance: size as f32, radius: 0.0, focus: 1.0 };
        Self { objects, lights, media, camera, guides: Vec::new(), focus: None, choice: None }
    }

    /// The sphere that light from infinity starts in front of.
    pub fn emission_bounds(&self) -> BoundingSphere {
        let BoundingSphere { centre, radius } = self.bounds();
        self.focus.map_or(BoundingSphere { centre, radius }, |focus| BoundingSphere {
            centre: focus,
            radius: radius + (focus - centre).length(),
        })
    }

    /// The scene with bodies that emit: the cloud, in part hidden by the dark body, the glass and the
    /// lantern. Their volumes are the last lights.
    pub fn glowing(centre: Vec3, size: u32) -> Self {
        let mut scene = Self::new(centre, size);
        for object in &scene.objects {
            let Some(Interior { body, medium: Some(medium), .. }) = object.boundary.interior() else {
                continue;
            };
            if [1, 3, 4].contains(&body.0) {
                scene.media[medium.0 as usize].glow = Source::GLOW;
                scene.lights.push(Light { source: Source::Volume(object.shape, body.0), power: 1.0 });
            }
        }
        scene
    }

    /// The body that counts at a point, by asking every body.
    pub fn body_at(&self, point: DVec3) -> Option<Interior> {
        let around = self.objects.iter().filter(|object| object.shape.contains(point));
        around.filter_map(|object| object.boundary.interior()).max_by_key(|interior| interior.priority)
    }

    /// The surface with a material that is nearest to a point, and how far it is.
    pub fn surface_at(&self, point: DVec3) -> (&Object, f64) {
        self.objects
            .iter()
            .filter(|object| !object.boundary.is_null())
            .map(|object| (object, object.shape.distance(point)))
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .expect("there are surfaces")
    }
}

impl Scene for ClosedForm {
    type Bsdf = Material;
    type Emitter = Light;
    type Medium = Fog;
    type Camera = ThinLens;

    fn intersect(&self, ray: &Ray) -> Option<Hit<Material>> {
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let range = f64::from(ray.t_min)..f64::from(ray.t_max);
        let mut nearest: Option<(f64, &Object)> = None;
        for object in &self.objects {
            for t in object.shape.roots(origin, direction).into_iter().flatten() {
                let inside = t > range.start && t < range.end && nearest.is_none_or(|(other, _)| t < other);
                // Rounded to a boundary of the range it would not be in it.
                if inside && t as f32 > ray.t_min {
                    nearest = Some((t, object));
                }
            }
        }
        let (t, object) = nearest?;
        let position = object.shape.snap(origin + t * direction);
        let rounded = position.as_vec3();
        Some(Hit {
            t: t as f32,
            position: rounded,
            geometric_normal: object.shape.normal(position).as_vec3(),
            shading_normal: object.shading_normal(rounded.as_dvec3()).as_vec3(),
            boundary: object.boundary,
            emitter: object.emitter,
        })
    }

    fn bounds(&self) -> BoundingSphere {
        BoundingSphere { centre: Vec3::ZERO, radius: 3.6 }
    }

    fn emitters(&self) -> &[Light] {
        &self.lights
    }

    fn media(&self) -> &[Fog] {
        &self.media
    }

    fn camera(&self) -> &ThinLens {
        &self.camera
    }
}
