//! Emitters of every kind, whose points are chosen for the receiver.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::{DVec3, Vec3};
use upbp_estimators::scene::{
    BoundingSphere, Emission, EmissionCoordinates, Emitter, EmitterBounds, EmitterKind, EmitterPoint,
    HitDensities, Incident,
};
use upbp_estimators::{BodyId, Spectrum};
use upbp_media::orthonormal_basis;

use super::material::cosine_hemisphere;
use super::shape::Shape;

/// A light, with its share of the choice.
#[derive(Clone, Copy, Debug)]
pub struct Light {
    /// Kind and geometry.
    pub source: Source,
    /// Weight in the choice among the lights.
    pub power: f32,
}

#[derive(Clone, Copy, Debug)]
/// Kinds of lights.
pub enum Source {
    /// One side of a rectangle.
    Area(Shape),
    /// A point that shines in all directions.
    Point(DVec3),
    /// The direction that the light goes.
    Directional(DVec3),
    /// Light from all directions at infinity.
    Environment,
    /// The inside of a sphere, which is the body of that number.
    Volume(Shape, u32),
}

fn uniform_sphere(u: [f32; 2]) -> DVec3 {
    let z = 1.0 - 2.0 * f64::from(u[0]);
    let (sin, cos) = (TAU * f64::from(u[1])).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(r * cos, r * sin, z)
}

impl Source {
    /// Radiance per length of all volumes.
    pub const GLOW: Spectrum = Spectrum::new(1.5, 0.8, 0.4);

    /// Density per length with which a passing camera sub-path counts as ending at a point of a volume.
    pub fn pdf_passage(point: DVec3) -> f64 {
        1.5 + (3.0 * point.x).sin()
    }

    /// `p_nee` of a volume at its middle and beyond: uniform in the distance from there.
    fn pdf_in_sphere(centre: DVec3, radius: f64, point: DVec3) -> f64 {
        0.25 * FRAC_1_PI / (point.distance_squared(centre) * radius)
    }

    /// Preference of the next events of a receiver for one end of a rectangle, in `[0.2, 0.8]`.
    fn slant(receiver: DVec3) -> f64 {
        0.5 + 0.3 * (3.0 * receiver.x).sin()
    }

    fn radiance(&self, direction: DVec3) -> Spectrum {
        match self {
            Self::Area(_) => Spectrum::new(6.0, 5.0, 4.0),
            Self::Point(_) => Spectrum::new(0.6, 0.7, 0.8),
            Self::Directional(_) => Spectrum::splat(0.4),
            Self::Volume(..) => Self::GLOW,
            Self::Environment => Spectrum::new(0.3, 0.4, 0.6) * (1.0 - 0.5 * direction.y) as f32,
        }
    }

    /// `L_0` and `ρL_0`.
    pub fn pdf_emission(&self, bounds: &BoundingSphere, cos: f64) -> [f64; 2] {
        let disc = FRAC_1_PI / f64::from(bounds.radius).powi(2);
        match self {
            Self::Area(shape) => [1.0 / shape.area(), cos * FRAC_1_PI],
            Self::Point(_) => [1.0, 0.25 * FRAC_1_PI],
            Self::Directional(_) => [1.0, disc],
            Self::Environment => [0.25 * FRAC_1_PI, disc],
            Self::Volume(shape, _) => {
                let Shape::Sphere { radius, .. } = shape else { unreachable!("volumes are spheres") };
                [0.75 * FRAC_1_PI / radius.powi(3), 0.25 * FRAC_1_PI]
            }
        }
    }

    /// The random numbers of a start, by pairs; `None` beside the disc of an infinite light.
    pub fn coordinates(
        &self,
        bounds: &BoundingSphere,
        point: DVec3,
        direction: DVec3,
        on_ray: DVec3,
    ) -> Option<[Option<[f64; 2]>; 2]> {
        let turn = |x: f64, y: f64| (y.atan2(x) / TAU).rem_euclid(1.0);
        let frame = |axis: DVec3| {
            let (s, t) = orthonormal_basis(axis.as_vec3());
            (s.as_dvec3(), t.as_dvec3())
        };
        let disc = || {
            let (s, t) = frame(direction);
            let from_centre = (on_ray - bounds.centre.as_dvec3()) / f64::from(bounds.radius);
            let (x, y) = (from_centre.dot(s), from_centre.dot(t));
            (x * x + y * y <= 1.0).then(|| [x * x + y * y, turn(x, y)])
        };
        let sphere = [0.5 * (1.0 - direction.z), turn(direction.x, direction.y)];
        Some(match self {
            Self::Area(Shape::Rectangle { corner, edges }) => {
                let (s, t) = frame(edges[0].cross(edges[1]).normalize());
                let (x, y) = (direction.dot(s), direction.dot(t));
                [Some(Shape::coordinates(*corner, edges, point)), Some([x * x + y * y, turn(x, y)])]
            }
            Self::Area(Shape::Sphere { .. }) => return None,
            Self::Point(_) | Self::Volume(..) => [None, Some(sphere)],
            Self::Directional(_) => [Some(disc()?), None],
            Self::Environment => [Some(disc()?), Some(sphere)],
        })
    }

    /// `p_nee`.
    pub fn pdf_incident(&self, point: DVec3, direction: DVec3, receiver: DVec3) -> f64 {
        match self {
            Self::Area(Shape::Rectangle { corner, edges }) => {
                let u = Shape::coordinates(*corner, edges, point)[0].clamp(0.0, 1.0);
                let slant = Self::slant(receiver);
                (1.0 + slant * (2.0 * u - 1.0)) / (edges[0].length() * edges[1].length())
            }
            Self::Environment => (1.0 - 0.5 * direction.y) * 0.25 * FRAC_1_PI,
            Self::Volume(Shape::Sphere { centre, radius }, _) => Self::pdf_in_sphere(*centre, *radius, point),
            _ => 1.0,
        }
    }
}

impl Emitter for Light {
    fn kind(&self) -> EmitterKind {
        match self.source {
            Source::Area(_) => EmitterKind::Area,
            Source::Point(_) => EmitterKind::Point,
            Source::Directional(_) => EmitterKind::Directional,
            Source::Environment => EmitterKind::Environment,
            Source::Volume(_, body) => EmitterKind::Volume(BodyId(body)),
        }
    }

    fn power(&self, _: &BoundingSphere) -> f32 {
        self.power
    }

    fn bounds(&self, _: &BoundingSphere) -> Option<EmitterBounds> {
        match self.source {
            Source::Area(Shape::Rectangle { corner, edges: [u, v] }) => {
                let corners = [corner, corner + u, corner + v, corner + u + v].map(DVec3::as_vec3);
                let [min, max] = [Vec3::min, Vec3::max].map(|f| corners.into_iter().fold(corners[0], f));
                let axis = u.cross(v).normalize().as_vec3();
                Some(EmitterBounds { axis, cos_normals: 1.0, ..EmitterBounds::all_around(min, max) })
            }
            Source::Point(point) => Some(EmitterBounds::all_around(point.as_vec3(), point.as_vec3())),
            Source::Volume(Shape::Sphere { centre, radius }, _) => {
                let [min, max] = [-radius, radius].map(|r| (centre + DVec3::splat(r)).as_vec3());
                Some(EmitterBounds::all_around(min, max))
            }
            Source::Area(Shape::Sphere { .. })
            | Source::Volume(Shape::Rectangle { .. }, _)
            | Source::Directional(_)
            | Source::Environment => None,
        }
    }

    fn sample_emission(&self, bounds: &BoundingSphere, u: [f32; 2], v: [f32; 2]) -> Option<Emission> {
        let disc = |direction: Vec3| {
            let (s, t) = orthonormal_basis(direction);
            let (sin, cos) = (TAU as f32 * u[1]).sin_cos();
            let r = u[0].sqrt();
            bounds.centre + (s * (r * cos) + t * (r * sin) - direction) * bounds.radius
        };
        let (position, normal, direction) = match self.source {
            Source::Area(Shape::Rectangle { corner, edges }) => {
                let point = corner + f64::from(u[0]) * edges[0] + f64::from(u[1]) * edges[1];
                let normal = edges[0].cross(edges[1]).normalize().as_vec3();
                let (s, t) = orthonormal_basis(normal);
                let local = cosine_hemisphere(v);
                (point.as_vec3(), normal, (s * local.x + t * local.y + normal * local.z).normalize())
            }
            Source::Area(Shape::Sphere { .. }) | Source::Volume(Shape::Rectangle { .. }, _) => return None,
            Source::Volume(Shape::Sphere { centre, radius }, _) => {
                // The third number is what the first one leaves of its digits.
                let digits = 4096.0 * f64::from(u[0]);
                let ball = uniform_sphere([digits.fract() as f32, u[1]]);
                let distance = radius * ((digits.floor() + 0.5) / 4096.0).cbrt();
                ((centre + distance * ball).as_vec3(), Vec3::Z, uniform_sphere(v).as_vec3())
            }
            Source::Point(position) => (position.as_vec3(), Vec3::Z, uniform_sphere(v).as_vec3()),
            Source::Directional(direction) => (disc(direction.as_vec3()), Vec3::Z, direction.as_vec3()),
            Source::Environment => {
                let direction = uniform_sphere(v).as_vec3();
                (disc(direction), direction, direction)
            }
        };
        let cos = f64::from(normal.dot(direction));
        let [pdf_position, pdf_direction] = self.source.pdf_emission(bounds, cos);
        Some(Emission {
            point: EmitterPoint { position, normal },
            direction,
            radiance: self.source.radiance(direction.as_dvec3()),
            pdf_position: pdf_position as f32,
            pdf_direction: pdf_direction as f32,
        })
    }

    fn sample_incident(&self, bounds: &BoundingSphere, receiver: Vec3, u: [f32; 2]) -> Option<Incident> {
        let from = receiver.as_dvec3();
        let (point, normal, towards) = match self.source {
            Source::Area(Shape::Rectangle { corner, edges }) => {
                // The inverse of ∫ 1 + w (2x − 1) dx = x + w (x² − x).
                let w = Source::slant(from);
                let x = ((1.0 - w).powi(2) + 4.0 * w * f64::from(u[0])).sqrt();
                let point = corner + (x - (1.0 - w)) / (2.0 * w) * edges[0] + f64::from(u[1]) * edges[1];
                (point, edges[0].cross(edges[1]).normalize(), None)
            }
            Source::Area(Shape::Sphere { .. }) | Source::Volume(Shape::Rectangle { .. }, _) => return None,
            Source::Volume(Shape::Sphere { centre, radius }, _) => {
                let digits = 4096.0 * f64::from(u[0]);
                let ball = uniform_sphere([digits.fract() as f32, u[1]]);
                (centre + radius * ((digits.floor() + 0.5) / 4096.0) * ball, DVec3::Z, None)
            }
            Source::Point(position) => (position, DVec3::Z, None),
            Source::Directional(direction) => (from - direction, direction, Some(-direction)),
            Source::Environment => {
                // The inverse of ∫ (1 + x/2)/2 dx from −1.
                let y = 2.0 * (0.25 + 2.0 * f64::from(u[0])).sqrt() - 2.0;
                let (sin, cos) = (TAU * f64::from(u[1])).sin_cos();
                let r = (1.0 - y * y).max(0.0).sqrt();
                let towards = DVec3::new(r * cos, y, r * sin);
                (from + towards, -towards, Some(towards))
            }
        };
        let point = EmitterPoint { position: point.as_vec3(), normal: normal.as_vec3() };
        let between = point.position.as_dvec3() - from;
        let direction = towards.unwrap_or_else(|| between.normalize());
        let cos = -point.normal.as_dvec3().dot(direction);
        let [pdf_position, pdf_direction] = self.source.pdf_emission(bounds, cos.max(0.0));
        Some(Incident {
            point,
            towards_light: direction.as_vec3(),
            distance: if towards.is_some() { f32::INFINITY } else { between.length() as f32 },
            radiance: self.source.radiance(-direction),
            pdf: self.source.pdf_incident(point.position.as_dvec3(), -direction, from) as f32,
            pdf_position: pdf_position as f32,
            pdf_direction: pdf_direction as f32,
        })
    }

    fn hit(
        &self,
        bounds: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        receiver: Vec3,
    ) -> Option<HitDensities> {
        let cos = f64::from(point.normal.dot(direction));
        let shines = match self.source {
            Source::Area(_) => cos > 0.0,
            Source::Environment | Source::Volume(..) => true,
            _ => false,
        };
        let [pdf_position, pdf_direction] = self.source.pdf_emission(bounds, cos);
        let pdf_incident =
            self.source.pdf_incident(point.position.as_dvec3(), direction.as_dvec3(), receiver.as_dvec3());
        shines.then(|| HitDensities {
            radiance: self.source.radiance(direction.as_dvec3()),
            pdf_incident: pdf_incident as f32,
            pdf_position: pdf_position as f32,
            pdf_direction: pdf_direction as f32,
        })
    }

    fn pdf_passage(&self, point: &EmitterPoint) -> f32 {
        Source::pdf_passage(point.position.as_dvec3()) as f32
    }

    fn emission_coordinates(
        &self,
        bounds: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        on_ray: Vec3,
    ) -> Option<EmissionCoordinates> {
        let [point, direction, on_ray] = [point.position, direction, on_ray].map(Vec3::as_dvec3);
        let pairs = self.source.coordinates(bounds, point, direction, on_ray)?;
        let [position, direction] = pairs.map(|pair| pair.map(|pair| pair.map(|u| u as f32)));
        Some(EmissionCoordinates { position, direction })
    }

    fn pdf_incident(
        &self,
        _: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        receiver: Vec3,
        _: f32,
    ) -> f32 {
        let receiver = receiver.as_dvec3();
        self.source.pdf_incident(point.position.as_dvec3(), direction.as_dvec3(), receiver) as f32
    }
}
