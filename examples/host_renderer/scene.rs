//! A scene that shares nothing with the ready-made one: a room of six planes full of haze, a ball of milk, a
//! lamp.
//!
//! Everything is in closed form; there is no mesh, no acceleration structure, no scene file. It shows how
//! little a host renderer has to say.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use upbp_core::glam::{Vec2, Vec3};
use upbp_core::media::{Homogeneous, MediaError, PhaseFunction, orthonormal_basis};
use upbp_core::scene::{
    Boundary, BoundingSphere, Bsdf, BsdfSample, Camera, CameraConnection, CameraRay, Emission, Emitter,
    EmitterBounds, EmitterId, EmitterKind, EmitterPoint, Hit, HitDensities, Incident, Interface, Scene, Walk,
};
use upbp_core::{BodyId, Interior, MediumId, Ray, Spectrum};

/// A matt surface.
#[derive(Clone, Copy)]
pub(crate) struct Matt(pub Spectrum);

impl Bsdf for Matt {
    fn eval(&self, towards_light: Vec3, towards_camera: Vec3, _: Interface) -> Spectrum {
        if towards_light.z * towards_camera.z > 0.0 { self.0 * FRAC_1_PI } else { Spectrum::ZERO }
    }

    fn pdf(&self, from: Vec3, to: Vec3, _: Interface) -> f32 {
        if from.z * to.z > 0.0 { to.z.abs() * FRAC_1_PI } else { 0.0 }
    }

    fn sample(&self, from: Vec3, _: Walk, _: Interface, _: f32, u: [f32; 2]) -> Option<BsdfSample> {
        let to = cosine_direction(u) * Vec3::new(1.0, 1.0, from.z.signum());
        let pdf = |v: Vec3| v.z.abs() * FRAC_1_PI;
        Some(BsdfSample { to, weight: self.0, pdf: pdf(to), pdf_reverse: pdf(from), delta: false })
    }

    fn is_connectible(&self) -> bool {
        !self.0.is_black()
    }

    fn continuation(&self, _: Vec3) -> f32 {
        self.0.max_component().clamp(0.05, 1.0)
    }
}

/// A glowing ball.
pub(crate) struct Lamp {
    /// Centre of the ball.
    pub centre: Vec3,
    /// Radius of the ball.
    pub radius: f32,
    /// Radiance of the surface, alike in all directions.
    pub radiance: Spectrum,
}

impl Lamp {
    fn area(&self) -> f32 {
        4.0 * PI * self.radius * self.radius
    }

    fn point(&self, u: [f32; 2]) -> EmitterPoint {
        let z = 1.0 - 2.0 * u[0];
        let (sin, cos) = (TAU * u[1]).sin_cos();
        let normal = Vec3::new(cos, sin, 0.0) * (1.0 - z * z).max(0.0).sqrt() + Vec3::Z * z;
        EmitterPoint { position: self.centre + self.radius * normal, normal }
    }
}

impl Emitter for Lamp {
    fn kind(&self) -> EmitterKind {
        EmitterKind::Area
    }

    fn power(&self, _: &BoundingSphere) -> f32 {
        PI * self.area() * self.radiance.luminance()
    }

    fn bounds(&self, _: &BoundingSphere) -> Option<EmitterBounds> {
        Some(EmitterBounds::all_around(self.centre - self.radius, self.centre + self.radius))
    }

    fn sample_emission(&self, _: &BoundingSphere, place: [f32; 2], u: [f32; 2]) -> Option<Emission> {
        let point = self.point(place);
        let local = cosine_direction(u);
        let (s, t) = orthonormal_basis(point.normal);
        Some(Emission {
            point,
            direction: local.x * s + local.y * t + local.z * point.normal,
            radiance: self.radiance,
            pdf_position: 1.0 / self.area(),
            pdf_direction: local.z * FRAC_1_PI,
        })
    }

    fn sample_incident(&self, _: &BoundingSphere, receiver: Vec3, u: [f32; 2]) -> Option<Incident> {
        let point = self.point(u);
        let between = point.position - receiver;
        let distance = between.length();
        let towards_light = between / distance;
        let cos = -point.normal.dot(towards_light);
        (cos > 0.0).then(|| Incident {
            point,
            towards_light,
            distance,
            radiance: self.radiance,
            pdf: 1.0 / self.area(),
            pdf_position: 1.0 / self.area(),
            pdf_direction: cos * FRAC_1_PI,
        })
    }

    fn hit(
        &self,
        _: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        _: Vec3,
    ) -> Option<HitDensities> {
        let cos = point.normal.dot(direction);
        (cos > 0.0).then(|| HitDensities {
            radiance: self.radiance,
            pdf_incident: 1.0 / self.area(),
            pdf_position: 1.0 / self.area(),
            pdf_direction: cos * FRAC_1_PI,
        })
    }
}

/// A pinhole that looks along −z.
pub(crate) struct Pinhole {
    /// Place of the pinhole, in scene units.
    pub position: Vec3,
    /// Pixels per side of the square film.
    pub size: u32,
    /// Half the width of the field of view at distance 1.
    pub half_width: f32,
}

impl Pinhole {
    fn pdf(&self, direction: Vec3) -> f32 {
        // A film on which a pixel has unit area stands at this distance.
        let distance = 0.5 * self.size as f32 / self.half_width;
        let cos = -direction.z;
        (distance / cos).powi(2) / cos
    }
}

impl Camera for Pinhole {
    fn resolution(&self) -> (u32, u32) {
        (self.size, self.size)
    }

    fn ray(&self, film: Vec2, _: [f32; 2]) -> Option<CameraRay> {
        let place = (film * (2.0 / self.size as f32) - Vec2::ONE) * self.half_width;
        let direction = Vec3::new(place.x, -place.y, -1.0).normalize();
        Some(CameraRay { origin: self.position, direction, pdf: self.pdf(direction) })
    }

    fn connect(&self, point: Vec3, _: [f32; 2]) -> Option<CameraConnection> {
        let between = point - self.position;
        let place = Vec2::new(between.x, -between.y) / -between.z;
        let film = (place / self.half_width + Vec2::ONE) * (0.5 * self.size as f32);
        let size = self.size as f32;
        let seen = between.z < 0.0 && film.x >= 0.0 && film.y >= 0.0 && film.x < size && film.y < size;
        seen.then(|| CameraConnection { lens: self.position, film, pdf: self.pdf(between.normalize()) })
    }

    fn is_pinhole(&self) -> bool {
        true
    }
}

/// The room: walls at ±1, haze everywhere, a ball of milk, a lamp.
pub(crate) struct Room {
    walls: [Matt; 6],
    milk: (Vec3, f32),
    lamp: [Lamp; 1],
    media: [Homogeneous; 2],
    camera: Pinhole,
}

impl Room {
    /// The room on a film of `size` by `size` pixels.
    pub(crate) fn new(size: u32) -> Result<Self, MediaError> {
        let white = Matt(Spectrum::splat(0.7));
        let red = Matt(Spectrum::new(0.6, 0.1, 0.1));
        let green = Matt(Spectrum::new(0.1, 0.5, 0.1));
        let haze = Homogeneous::new(
            Spectrum::splat(0.05),
            Spectrum::splat(0.25),
            PhaseFunction::henyey_greenstein(0.3)?,
        )?;
        let milk = Homogeneous::new(
            Spectrum::new(0.05, 0.1, 0.2),
            Spectrum::splat(8.0),
            PhaseFunction::henyey_greenstein(0.5)?,
        )?;
        Ok(Self {
            walls: [red, green, white, white, white, white],
            milk: (Vec3::new(-0.35, -0.5, -0.2), 0.4),
            lamp: [Lamp {
                centre: Vec3::new(0.45, 0.5, -0.3),
                radius: 0.12,
                radiance: Spectrum::new(14.0, 12.0, 9.0),
            }],
            media: [haze, milk],
            camera: Pinhole { position: Vec3::new(0.0, 0.0, 0.95), size, half_width: 0.8 },
        })
    }
}

impl Scene for Room {
    type Bsdf = Matt;
    type Emitter = Lamp;
    type Medium = Homogeneous;
    type Camera = Pinhole;

    fn intersect(&self, ray: &Ray) -> Option<Hit<Matt>> {
        let mut nearest: Option<Hit<Matt>> = None;
        let mut keep = |t: f32, make: &dyn Fn(Vec3) -> Hit<Matt>| {
            let before = nearest.as_ref().map_or(ray.t_max, |hit| hit.t);
            if t > ray.t_min && t < before {
                nearest = Some(make(ray.origin + t * ray.direction));
            }
        };
        for axis in 0..3 {
            // The walls are met from inside: towards +1 or towards −1.
            let side = ray.direction[axis].signum();
            let t = (side - ray.origin[axis]) / ray.direction[axis];
            let wall = self.walls[2 * axis + usize::from(side > 0.0)];
            keep(t, &|mut position| {
                position[axis] = side;
                let mut normal = Vec3::ZERO;
                normal[axis] = -side;
                hit(t, position, normal, Boundary::Opaque(wall), None)
            });
        }
        let (centre, radius) = self.milk;
        for t in ball(ray, centre, radius) {
            let interior = Interior { body: BodyId(0), medium: Some(MediumId(1)), priority: 0, ior: 1.0 };
            keep(t, &|p| hit(t, p, (p - centre) / radius, Boundary::Null(interior), None));
        }
        let lamp = &self.lamp[0];
        for t in ball(ray, lamp.centre, lamp.radius) {
            let black = Boundary::Opaque(Matt(Spectrum::ZERO));
            keep(t, &|p| hit(t, p, (p - lamp.centre) / lamp.radius, black, Some(EmitterId(0))));
        }
        nearest
    }

    fn bounds(&self) -> BoundingSphere {
        BoundingSphere { centre: Vec3::ZERO, radius: 3_f32.sqrt() }
    }

    fn emitters(&self) -> &[Lamp] {
        &self.lamp
    }

    fn media(&self) -> &[Homogeneous] {
        &self.media
    }

    fn camera(&self) -> &Pinhole {
        &self.camera
    }

    fn outside(&self) -> Option<MediumId> {
        Some(MediumId(0))
    }
}

fn hit(
    t: f32,
    position: Vec3,
    normal: Vec3,
    boundary: Boundary<Matt>,
    emitter: Option<EmitterId>,
) -> Hit<Matt> {
    Hit { t, position, geometric_normal: normal, shading_normal: normal, boundary, emitter }
}

/// Both intersections of a ray with a ball, in order; NaN if there are none.
fn ball(ray: &Ray, centre: Vec3, radius: f32) -> [f32; 2] {
    let offset = ray.origin - centre;
    let b = offset.dot(ray.direction);
    let root = (radius * radius - (offset - b * ray.direction).length_squared()).sqrt();
    [-b - root, -b + root]
}

fn cosine_direction(u: [f32; 2]) -> Vec3 {
    let (sin, cos) = (TAU * u[1]).sin_cos();
    let radius = u[0].sqrt();
    Vec3::new(radius * cos, radius * sin, (1.0 - u[0]).sqrt())
}
