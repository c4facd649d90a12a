//! A host of the estimators that owes nothing to the other crates: spheres and rectangles in closed form.
//!
//! It holds what weights can go wrong on: refraction, bodies that overlap and nest without a surface, media
//! of all kinds, mirrors, mixtures of smooth and Dirac lobes, transmission at a diffuse surface, shading
//! normals, roulette that depends on the side, emitters of every kind whose points are chosen for the
//! receiver.

use std::f64::consts::{FRAC_1_PI, PI, TAU};

use glam::{DVec3, Vec2, Vec3};
use upbp_estimators::scene::{
    BoundingSphere, Bsdf, BsdfSample, Camera, CameraConnection, CameraRay, Emission, Emitter, EmitterId,
    EmitterKind, EmitterPoint, Hit, HitDensities, Incident, Interface, Scene, Walk,
};
use upbp_estimators::{BodyId, Interior, MediumId, Ray, Spectrum};
use upbp_media::{Medium, PhaseFunction, RaySegment, SegmentDensity, orthonormal_basis};

/// Cosine of the shading normal's largest tilt is well above zero: it never leaves the hemisphere.
const BUMP: f64 = 0.25;

/// A surface without thickness.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape {
    Sphere {
        centre: DVec3,
        radius: f64,
    },
    /// `corner + u·edges[0] + v·edges[1]`, the edges perpendicular; the normal is their cross product.
    Rectangle {
        corner: DVec3,
        edges: [DVec3; 2],
    },
}

impl Shape {
    fn rectangle(corner: [f64; 3], u: [f64; 3], v: [f64; 3]) -> Self {
        Self::Rectangle { corner: corner.into(), edges: [u.into(), v.into()] }
    }

    fn sphere(centre: [f64; 3], radius: f64) -> Self {
        Self::Sphere { centre: centre.into(), radius }
    }

    pub(crate) fn normal(&self, point: DVec3) -> DVec3 {
        match self {
            Self::Sphere { centre, .. } => (point - centre).normalize(),
            Self::Rectangle { edges: [u, v], .. } => u.cross(*v).normalize(),
        }
    }

    /// Distances at which the line meets the surface.
    pub(crate) fn roots(&self, origin: DVec3, direction: DVec3) -> [Option<f64>; 2] {
        match self {
            Self::Sphere { centre, radius } => {
                let between = origin - centre;
                let half = between.dot(direction);
                // The discriminant from the distance to the line: nothing cancels for a far origin.
                let across = between - half * direction;
                let discriminant = radius * radius - across.length_squared();
                if discriminant < 0.0 {
                    return [None; 2];
                }
                let root = discriminant.sqrt();
                [Some(-half - root), Some(-half + root)]
            }
            Self::Rectangle { corner, edges } => {
                let normal = self.normal(*corner);
                let t = (corner - origin).dot(normal) / direction.dot(normal);
                let [u, v] = Self::coordinates(*corner, edges, origin + t * direction);
                let inside = t.is_finite() && (0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v);
                [inside.then_some(t), None]
            }
        }
    }

    fn coordinates(corner: DVec3, edges: &[DVec3; 2], point: DVec3) -> [f64; 2] {
        edges.map(|edge| (point - corner).dot(edge) / edge.length_squared())
    }

    /// The nearest point of the surface's sphere or plane.
    fn snap(&self, point: DVec3) -> DVec3 {
        match self {
            Self::Sphere { centre, radius } => centre + (point - centre).normalize() * *radius,
            Self::Rectangle { corner, .. } => {
                let normal = self.normal(point);
                point - (point - corner).dot(normal) * normal
            }
        }
    }

    /// How far a point is from the surface.
    pub(crate) fn distance(&self, point: DVec3) -> f64 {
        match self {
            Self::Sphere { .. } => (point - self.snap(point)).length(),
            Self::Rectangle { corner, edges } => {
                let [u, v] = Self::coordinates(*corner, edges, point).map(|x| x.clamp(0.0, 1.0));
                (point - (corner + u * edges[0] + v * edges[1])).length()
            }
        }
    }

    fn contains(&self, point: DVec3) -> bool {
        matches!(self, Self::Sphere { centre, radius } if (point - centre).length() < *radius)
    }

    fn area(&self) -> f64 {
        match self {
            Self::Sphere { radius, .. } => 4.0 * PI * radius * radius,
            Self::Rectangle { edges: [u, v], .. } => u.cross(*v).length(),
        }
    }
}

/// How a surface scatters. All formulas depend on the cosines with the shading normal only, signed.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Material {
    /// Diffuse reflection on both sides.
    Diffuse,
    /// Diffuse reflection beside a mirror, chosen by angle.
    Coated,
    /// Diffuse reflection and transmission.
    Paper,
    Mirror,
    /// Smooth refraction, lobes chosen with different probabilities on the two sides.
    Glass,
}

fn coat(cos: f64) -> f64 {
    0.2 + 0.6 * (1.0 - cos.abs())
}

/// Fresnel reflectance of unpolarised light.
fn fresnel(cos: f64, eta_from: f64, eta_to: f64) -> f64 {
    let sin2 = (eta_from / eta_to).powi(2) * (1.0 - cos * cos);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let (ci, ct) = (cos.abs(), (1.0 - sin2).sqrt());
    let s = (eta_from * ci - eta_to * ct) / (eta_from * ci + eta_to * ct);
    let p = (eta_to * ci - eta_from * ct) / (eta_to * ci + eta_from * ct);
    0.5 * (s * s + p * p)
}

impl Material {
    const ALBEDO: f64 = 0.7;

    pub(crate) fn is_smooth(self) -> bool {
        matches!(self, Self::Diffuse | Self::Coated | Self::Paper)
    }

    /// Density of the smooth lobes per solid angle.
    pub(crate) fn pdf(self, from: f64, to: f64) -> f64 {
        let same_side = from * to > 0.0;
        match self {
            Self::Diffuse if same_side => to.abs() * FRAC_1_PI,
            Self::Coated if same_side => (1.0 - coat(from)) * to.abs() * FRAC_1_PI,
            Self::Paper => {
                let share = if same_side { 0.6 } else { 0.4 };
                share * to.abs() * FRAC_1_PI
            }
            _ => 0.0,
        }
    }

    /// Probability of the Dirac lobe that reflects, or that refracts; indices on the two sides of the event.
    pub(crate) fn dirac(self, from: f64, reflects: bool, eta_from: f64, eta_other: f64) -> f64 {
        match self {
            Self::Coated if reflects => coat(from),
            Self::Mirror if reflects => 1.0,
            Self::Glass => {
                let reflectance = fresnel(from, eta_from, eta_other);
                let reflection = if reflectance >= 1.0 {
                    1.0
                } else if from > 0.0 {
                    0.25 + 0.5 * reflectance
                } else {
                    0.1 + 0.8 * reflectance
                };
                if reflects { reflection } else { 1.0 - reflection }
            }
            _ => 0.0,
        }
    }

    pub(crate) fn continuation(self, from: f64) -> f64 {
        match self {
            Self::Diffuse | Self::Coated => 0.6 + 0.3 * from.abs(),
            Self::Paper => {
                if from > 0.0 {
                    0.95
                } else {
                    0.7
                }
            }
            Self::Mirror | Self::Glass => 0.95,
        }
    }

    fn value(self, from: f64, to: f64) -> f64 {
        let same_side = from * to > 0.0;
        match self {
            Self::Diffuse | Self::Coated if same_side => Self::ALBEDO * FRAC_1_PI,
            Self::Paper => 0.5 * Self::ALBEDO * FRAC_1_PI,
            _ => 0.0,
        }
    }
}

fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let (sin, cos) = (TAU * f64::from(u[1])).sin_cos();
    let r = f64::from(u[0]).sqrt();
    DVec3::new(r * cos, r * sin, (1.0 - f64::from(u[0])).sqrt()).as_vec3()
}

/// Indices on the side of a direction and on the other.
fn indices(z: f32, interface: Interface) -> (f64, f64) {
    let (above, below) = (f64::from(interface.above), f64::from(interface.below));
    if z > 0.0 { (above, below) } else { (below, above) }
}

impl Bsdf for Material {
    fn eval(&self, towards_light: Vec3, towards_camera: Vec3, _: Interface) -> Spectrum {
        Spectrum::splat(self.value(f64::from(towards_light.z), f64::from(towards_camera.z)) as f32)
    }

    fn pdf(&self, from: Vec3, to: Vec3, _: Interface) -> f32 {
        Material::pdf(*self, f64::from(from.z), f64::from(to.z)) as f32
    }

    fn sample(
        &self,
        from: Vec3,
        walk: Walk,
        interface: Interface,
        u_lobe: f32,
        u: [f32; 2],
    ) -> Option<BsdfSample> {
        let z = f64::from(from.z);
        let (eta_from, eta_other) = indices(from.z, interface);
        let mirrored = Vec3::new(-from.x, -from.y, from.z);
        let u_lobe = f64::from(u_lobe);
        let reflection = self.dirac(z, true, eta_from, eta_other);
        let dirac = |to: Vec3, energy: f64| {
            let reflects = to.z * from.z > 0.0;
            let (eta_to, eta_back) = indices(to.z, interface);
            let pdf = self.dirac(z, reflects, eta_from, eta_other);
            Some(BsdfSample {
                to,
                weight: Spectrum::splat((energy / pdf) as f32),
                pdf: pdf as f32,
                pdf_reverse: self.dirac(f64::from(to.z), reflects, eta_to, eta_back) as f32,
                delta: true,
            })
        };
        if u_lobe < reflection {
            let energy = match self {
                Self::Glass => fresnel(z, eta_from, eta_other),
                Self::Mirror => 0.9,
                _ => 0.25,
            };
            return dirac(mirrored, energy);
        }
        if matches!(self, Self::Glass) {
            let ratio = eta_from / eta_other;
            let sin = -from.truncate().as_dvec2() * ratio;
            let cos = (1.0 - sin.length_squared()).sqrt();
            let to = sin.extend(cos.copysign(-z)).as_vec3();
            let compression = if walk == Walk::Camera { ratio * ratio } else { 1.0 };
            return dirac(to, (1.0 - fresnel(z, eta_from, eta_other)) * compression);
        }
        let mut to = cosine_hemisphere(u);
        let same_side = !matches!(self, Self::Paper) || u_lobe < 0.6;
        if (from.z > 0.0) != same_side {
            to.z = -to.z;
        }
        let pdf = Material::pdf(*self, z, f64::from(to.z));
        (pdf > 0.0).then(|| BsdfSample {
            to,
            weight: Spectrum::splat((self.value(z, f64::from(to.z)) * f64::from(to.z).abs() / pdf) as f32),
            pdf: pdf as f32,
            pdf_reverse: Material::pdf(*self, f64::from(to.z), z) as f32,
            delta: false,
        })
    }

    fn is_connectible(&self) -> bool {
        self.is_smooth()
    }

    fn continuation(&self, from: Vec3) -> f32 {
        Material::continuation(*self, f64::from(from.z)) as f32
    }
}

/// Something that a ray can meet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Object {
    pub(crate) shape: Shape,
    /// `None`: an index-matched boundary.
    pub(crate) material: Option<Material>,
    pub(crate) interior: Option<Interior>,
    pub(crate) emitter: Option<EmitterId>,
    bumpy: bool,
}

impl Object {
    fn new(shape: Shape, material: Option<Material>) -> Self {
        Self { shape, material, interior: None, emitter: None, bumpy: false }
    }

    fn filled(self, body: u32, medium: u32, priority: i32, ior: f32) -> Self {
        let interior = Interior { body: BodyId(body), medium: Some(MediumId(medium)), priority, ior };
        Self { interior: Some(interior), ..self }
    }

    pub(crate) fn shading_normal(&self, point: DVec3) -> DVec3 {
        let normal = self.shape.normal(point);
        if !self.bumpy {
            return normal;
        }
        let (s, t) = normal.any_orthonormal_pair();
        (normal + BUMP * (5.0 * point.x).sin() * s + BUMP * (7.0 * point.z).cos() * t).normalize()
    }
}

/// A light, with its share of the choice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Light {
    pub(crate) source: Source,
    pub(crate) power: f32,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum Source {
    /// One side of a rectangle.
    Area(Shape),
    Point(DVec3),
    /// The direction that the light goes.
    Directional(DVec3),
    Environment,
}

fn uniform_sphere(u: [f32; 2]) -> DVec3 {
    let z = 1.0 - 2.0 * f64::from(u[0]);
    let (sin, cos) = (TAU * f64::from(u[1])).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(r * cos, r * sin, z)
}

impl Source {
    /// How strongly next events of a receiver prefer one end of a rectangle.
    fn slant(receiver: DVec3) -> f64 {
        0.5 + 0.3 * (3.0 * receiver.x).sin()
    }

    fn radiance(&self, direction: DVec3) -> Spectrum {
        match self {
            Self::Area(_) => Spectrum::new(6.0, 5.0, 4.0),
            Self::Point(_) => Spectrum::new(0.6, 0.7, 0.8),
            Self::Directional(_) => Spectrum::splat(0.4),
            Self::Environment => Spectrum::new(0.3, 0.4, 0.6) * (1.0 - 0.5 * direction.y) as f32,
        }
    }

    /// `L_0` and `ρL_0`.
    pub(crate) fn pdf_emission(&self, bounds: &BoundingSphere, cos: f64) -> [f64; 2] {
        let disc = FRAC_1_PI / f64::from(bounds.radius).powi(2);
        match self {
            Self::Area(shape) => [1.0 / shape.area(), cos * FRAC_1_PI],
            Self::Point(_) => [1.0, 0.25 * FRAC_1_PI],
            Self::Directional(_) => [1.0, disc],
            Self::Environment => [0.25 * FRAC_1_PI, disc],
        }
    }

    /// `p_nee`.
    pub(crate) fn pdf_incident(&self, point: DVec3, direction: DVec3, receiver: DVec3) -> f64 {
        match self {
            Self::Area(Shape::Rectangle { corner, edges }) => {
                let u = Shape::coordinates(*corner, edges, point)[0].clamp(0.0, 1.0);
                let slant = Self::slant(receiver);
                (1.0 + slant * (2.0 * u - 1.0)) / (edges[0].length() * edges[1].length())
            }
            Self::Environment => (1.0 - 0.5 * direction.y) * 0.25 * FRAC_1_PI,
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
        }
    }

    fn power(&self, _: &BoundingSphere) -> f32 {
        self.power
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
            Source::Area(Shape::Sphere { .. }) => return None,
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
            Source::Area(Shape::Sphere { .. }) => return None,
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
            Source::Environment => true,
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

/// A pinhole that looks along −z.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pinhole {
    pub(crate) centre: Vec3,
    size: u32,
    /// Distance of the film in pixels.
    pub(crate) film_distance: f32,
}

impl Pinhole {
    fn pdf(&self, direction: Vec3) -> f32 {
        (self.film_distance / direction.z).powi(2) / -direction.z
    }
}

impl Camera for Pinhole {
    fn resolution(&self) -> (u32, u32) {
        (self.size, self.size)
    }

    fn ray(&self, film: Vec2, _: [f32; 2]) -> Option<CameraRay> {
        let half = 0.5 * self.size as f32;
        let direction = Vec3::new(film.x - half, half - film.y, -self.film_distance).normalize();
        Some(CameraRay { origin: self.centre, direction, pdf: self.pdf(direction) })
    }

    fn connect(&self, point: Vec3, _: [f32; 2]) -> Option<CameraConnection> {
        let between = point - self.centre;
        let half = 0.5 * self.size as f32;
        let scale = self.film_distance / -between.z;
        let film = Vec2::new(half + between.x * scale, half - between.y * scale);
        let range = 0.0..self.size as f32;
        (between.z < 0.0 && range.contains(&film.x) && range.contains(&film.y)).then(|| CameraConnection {
            lens: self.centre,
            film,
            pdf: self.pdf(between.normalize()),
        })
    }

    fn is_pinhole(&self) -> bool {
        true
    }
}

/// A homogeneous medium that chooses among its channels with probabilities of its own.
#[derive(Clone, Debug)]
pub(crate) struct Fog {
    pub(crate) sigma_a: [f32; 3],
    pub(crate) sigma_s: [f32; 3],
    pub(crate) g: f32,
    phase: PhaseFunction,
}

impl Fog {
    /// How often distances follow each channel.
    pub(crate) const ALPHA: [f64; 3] = [0.5, 0.2, 0.3];

    /// Probability to go on after a collision.
    pub(crate) const CONTINUATION: f64 = 0.9;

    fn new(sigma_a: [f32; 3], sigma_s: [f32; 3], g: f32) -> Self {
        let phase = PhaseFunction::henyey_greenstein(g).expect("in range");
        Self { sigma_a, sigma_s, g, phase }
    }

    pub(crate) fn extinction(&self) -> [f64; 3] {
        [0, 1, 2].map(|channel| f64::from(self.sigma_a[channel] + self.sigma_s[channel]))
    }
}

impl Medium for Fog {
    fn scatters(&self) -> bool {
        self.sigma_s != [0.0; 3]
    }

    fn segment(&self, segment: &RaySegment) -> SegmentDensity {
        let sigma = self.extinction();
        let passing = sigma.map(|sigma| (-sigma * segment.length_f64().min(f64::MAX)).exp());
        let transmittance = Spectrum::from_array(passing.map(|t| t as f32));
        if !self.scatters() {
            return SegmentDensity::passing(transmittance);
        }
        let mean = |f: [f64; 3]| f.iter().zip(Self::ALPHA).map(|(f, alpha)| f * alpha).sum::<f64>();
        let stop = mean([0, 1, 2].map(|channel| sigma[channel] * passing[channel]));
        SegmentDensity { transmittance, reach: mean(passing), stop_at_end: stop, stop_at_start: stop }
    }

    fn sample_distance(&self, segment: &RaySegment, u_channel: f32, u_distance: f32) -> Option<f32> {
        let [first, second, _] = Self::ALPHA;
        let u = f64::from(u_channel);
        let sigma = self.extinction()[usize::from(u >= first) + usize::from(u >= first + second)];
        let t = f64::from(segment.start) - f64::ln_1p(-f64::from(u_distance)) / sigma;
        (self.scatters() && t < f64::from(segment.end)).then(|| (t as f32).min(segment.end.next_down()))
    }

    fn sigma_s(&self, _: Vec3) -> Spectrum {
        self.sigma_s.into()
    }

    fn sigma_t(&self, _: Vec3) -> Spectrum {
        Spectrum::from_array(self.extinction().map(|sigma| sigma as f32))
    }

    fn phase(&self) -> &PhaseFunction {
        &self.phase
    }

    fn continuation(&self, _: Vec3) -> f32 {
        Self::CONTINUATION as f32
    }

    fn mean_free_path(&self) -> f32 {
        1.0 / self.sigma_t(Vec3::ZERO).mean()
    }
}

/// All of it.
pub(crate) struct ClosedForm {
    pub(crate) objects: Vec<Object>,
    pub(crate) lights: Vec<Light>,
    pub(crate) media: Vec<Fog>,
    pub(crate) camera: Pinhole,
}

impl ClosedForm {
    /// The scene, with a film of `size` pixels a side, the camera at `centre`.
    pub(crate) fn new(centre: Vec3, size: u32) -> Self {
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
            ..Object::new(shape, Some(Material::Diffuse))
        };
        let objects = vec![
            Object {
                bumpy: true,
                ..Object::new(
                    Shape::rectangle([-2.0, -1.0, -2.0], [0.0, 0.0, 4.0], [4.0, 0.0, 0.0]),
                    Some(Material::Diffuse),
                )
            },
            Object::new(
                Shape::rectangle([-2.0, -1.0, -2.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]),
                Some(Material::Coated),
            ),
            // Fog, open to the floor; a dense cloud in it, and a dark one in that.
            Object::new(Shape::sphere([0.0, 0.1, 0.0], 1.3), None).filled(0, 0, 0, 1.0),
            Object::new(Shape::sphere([0.55, -0.1, 0.1], 0.45), None).filled(1, 1, 1, 1.0),
            Object::new(Shape::sphere([0.55, -0.1, 0.25], 0.2), None).filled(2, 2, 2, 1.0),
            // Half in the fog, whose boundary is hidden inside.
            Object::new(Shape::sphere([-0.8, -0.4, 0.4], 0.45), Some(Material::Glass)).filled(3, 3, 10, 1.5),
            Object::new(Shape::sphere([0.2, -0.7, 0.8], 0.25), Some(Material::Mirror)),
            Object::new(Shape::sphere([-0.1, 0.6, -0.3], 0.3), Some(Material::Paper)).filled(4, 4, 5, 1.0),
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
        let camera = Pinhole { centre, size, film_distance: size as f32 };
        Self { objects, lights, media, camera }
    }

    /// The body that counts at a point, by asking all of them.
    pub(crate) fn body_at(&self, point: DVec3) -> Option<Interior> {
        let around = self.objects.iter().filter(|object| object.shape.contains(point));
        around.filter_map(|object| object.interior).max_by_key(|interior| interior.priority)
    }

    /// The surface with a material that is nearest to a point, and how far it is.
    pub(crate) fn surface_at(&self, point: DVec3) -> (&Object, f64) {
        self.objects
            .iter()
            .filter(|object| object.material.is_some())
            .map(|object| (object, object.shape.distance(point)))
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .expect("there are surfaces")
    }
}

impl Scene for ClosedForm {
    type Bsdf = Material;
    type Emitter = Light;
    type Medium = Fog;
    type Camera = Pinhole;

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
            bsdf: object.material,
            interior: object.interior,
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

    fn camera(&self) -> &Pinhole {
        &self.camera
    }
}
