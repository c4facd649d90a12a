//! Materials that have whatever weights depend on.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::{DVec3, Vec3};
use upbp_estimators::Spectrum;
use upbp_estimators::scene::{Bsdf, BsdfSample, Interface, Walk};

/// A material. All formulas depend on the cosines with the shading normal only, signed.
#[derive(Clone, Copy, Debug)]
pub enum Material {
    /// Diffuse reflection on both sides.
    Diffuse,
    /// Diffuse reflection beside a mirror, chosen by angle.
    Coated,
    /// Diffuse reflection and transmission.
    Paper,
    /// Smooth reflection.
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

    /// Whether there is a lobe with a density.
    pub fn is_smooth(self) -> bool {
        matches!(self, Self::Diffuse | Self::Coated | Self::Paper)
    }

    /// Density of the smooth lobes per solid angle.
    pub fn pdf(self, from: f64, to: f64) -> f64 {
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
    pub fn dirac(self, from: f64, reflects: bool, eta_from: f64, eta_other: f64) -> f64 {
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

    /// Probability to go on after arriving at this cosine.
    pub fn continuation(self, from: f64) -> f64 {
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

/// A direction with a density proportional to its cosine with z.
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
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
