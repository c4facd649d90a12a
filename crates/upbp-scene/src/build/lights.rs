//! Lights that are no surfaces.

use std::collections::BTreeMap;
use std::f32::consts::PI;
use std::sync::Arc;

use glam::Vec3;
use upbp_media::{Homogeneous, Medium as _, MediumId};

use super::builder::Builder;
use super::surfaces::rotation;
use crate::description::Light as Description;
use crate::error::Shortened;
use crate::light::{
    ConstantEnvironment, DirectionalLight, EnvironmentImage, ImageEnvironment, Light, PointLight, SpotCone,
    SpotLight, SunLight,
};

/// The name of a light in messages: its place from 1 and its kind.
pub(super) fn item(index: usize, light: &Description) -> String {
    let kind = match light {
        Description::Point { .. } => "Point",
        Description::Spot { .. } => "Spot",
        Description::Directional { .. } => "Directional",
        Description::Sun { .. } => "Sun",
        Description::Constant(_) => "Constant",
        Description::Image { .. } => "Image",
    };
    format!("light {} ({kind})", index + 1)
}

/// Whether a light is infinitely far away.
fn is_infinite(light: &Description) -> bool {
    matches!(
        light,
        Description::Directional { .. }
            | Description::Sun { .. }
            | Description::Constant(_)
            | Description::Image { .. }
    )
}

/// Whether a light is not black.
pub(super) fn shines(light: &Description) -> bool {
    match light {
        Description::Point { intensity, .. } | Description::Spot { intensity, .. } => {
            !intensity.get().is_black()
        }
        Description::Directional { irradiance, .. } | Description::Sun { irradiance, .. } => {
            !irradiance.get().is_black()
        }
        Description::Constant(radiance) => !radiance.get().is_black(),
        Description::Image { .. } => true,
    }
}

impl Builder<'_> {
    pub(super) fn lights(&mut self) -> Vec<Light> {
        let mut lights = Vec::new();
        for (index, light) in self.description.lights.iter().enumerate() {
            match self.light(light) {
                Ok(light) => lights.push(light),
                Err(message) => self.problem(item(index, light), message),
            }
        }
        lights
    }

    fn light(&mut self, light: &Description) -> Result<Light, String> {
        Ok(match light {
            Description::Point { position, intensity } => {
                Light::Point(PointLight { position: position.get(), intensity: intensity.get() })
            }
            Description::Spot { position, target, direction, intensity, beam_degrees, cutoff_degrees } => {
                let axis = match (target, direction) {
                    (Some(target), None) => unit(target.get() - position.get())
                        .ok_or("`position` and `target` are the same point")?,
                    (None, Some(direction)) => unit(direction.get()).ok_or("`direction` is zero")?,
                    (Some(_), Some(_)) => {
                        return Err("has both `target` and `direction`: expected one".into());
                    }
                    (None, None) => return Err("needs either `target` or `direction`".into()),
                };
                let cutoff = cutoff_degrees.get();
                let beam = beam_degrees.map_or(cutoff, crate::description::BeamAngle::get);
                if beam > cutoff {
                    return Err(format!("`beam_degrees` {beam} is more than `cutoff_degrees` {cutoff}"));
                }
                let cone = SpotCone { axis, beam: beam.to_radians(), cutoff: cutoff.to_radians().min(PI) };
                Light::Spot(SpotLight { position: position.get(), intensity: intensity.get(), cone })
            }
            Description::Directional { direction, irradiance } => {
                let direction = unit(direction.get()).ok_or("`direction` is zero")?;
                Light::Directional(DirectionalLight { direction, irradiance: irradiance.get() })
            }
            Description::Sun { direction, irradiance, diameter_degrees } => {
                let direction = unit(direction.get()).ok_or("`direction` is zero")?;
                let diameter = diameter_degrees.get().to_radians();
                Light::Sun(SunLight::new(direction, irradiance.get(), diameter))
            }
            Description::Constant(radiance) => {
                Light::Constant(ConstantEnvironment { radiance: radiance.get() })
            }
            Description::Image { file, scale, rotation_degrees, rotate } => {
                let image = self.environment_image(file)?;
                let about_y = rotation_degrees.get().to_radians();
                let light = ImageEnvironment::new(image, scale.get(), about_y);
                Light::Image(match rotation(rotate)? {
                    Some(rotation) => light.turned(rotation),
                    None => light,
                })
            }
        })
    }

    /// The image in a file; the file is read once.
    fn environment_image(&mut self, file: &str) -> Result<Arc<EnvironmentImage>, String> {
        if let Some(known) = self.images.get(file) {
            return known.clone();
        }
        let image = self.read_image(file).map(Arc::new);
        if let Ok(image) = &image {
            self.note_image(file, image);
        }
        self.images.insert(file.to_owned(), image.clone());
        image
    }

    fn read_image(&mut self, file: &str) -> Result<EnvironmentImage, String> {
        let path = self.path(file);
        let shown = self.shown_path(file);
        let describe = |error: crate::light::EnvironmentImageError| {
            // The reason is part of the message: a list of problems has no sources.
            let reason =
                std::error::Error::source(&error).map_or_else(String::new, |reason| format!(": {reason}"));
            format!("image `{shown}` {error}{reason}")
        };
        let image = EnvironmentImage::load(&path).map_err(describe)?;
        self.hash.write(&image.fingerprint().to_le_bytes());
        Ok(image)
    }

    /// Reports a scene without any light, and lights that cannot reach anything.
    pub(super) fn check_shines(&mut self, media: &[Homogeneous], ids: &BTreeMap<&str, MediumId>) {
        let description = self.description;
        let medium_of = |name: &String| ids.get(name.as_str()).and_then(|id| media.get(id.0 as usize));
        let outside = description.outside.as_ref().and_then(|name| Some((name, medium_of(name)?)));
        if let Some((outside, medium)) = outside {
            let outside = Shortened(outside);
            let lights = description.lights.iter().enumerate();
            for (index, light) in lights.filter(|(_, light)| is_closed(medium) && is_infinite(light)) {
                let message = format!(
                    "comes from infinitely far away and does not reach into the medium `{outside}` around everything; instead of `outside`, let it be the interior of a body with a `Null` material, with `priority: -1` if that reaches into others"
                );
                self.problem(item(index, light), message);
            }
            if is_infinitely_bright(medium) {
                self.problem(
                    "scene, outside",
                    format!("the medium `{outside}` glows in a channel whose absorption is nothing beside its scattering: without an end it is infinitely bright"),
                );
            }
        }
        let emits = |name: &String| medium_of(name).is_some_and(Homogeneous::emits);
        let named =
            description.outside.iter().chain(description.shapes.iter().flat_map(|shape| &shape.interior));
        let shines = description.lights.iter().any(shines)
            || description.shapes.iter().any(|shape| !shape.emission.get().is_black())
            || named.into_iter().any(emits);
        if !shines {
            self.problem(
                "scene",
                "nothing in it shines: no light, no shape with an emission, no medium that emits",
            );
        }
    }
}

/// Whether no light gets through an infinite length of a medium.
fn is_closed(medium: &Homogeneous) -> bool {
    medium.extinction().to_array().iter().all(|sigma| *sigma > 0.0)
}

/// Whether a medium without an end shows infinite radiance: what it emits is never absorbed, as far as single
/// precision tells.
fn is_infinitely_bright(medium: &Homogeneous) -> bool {
    let (source, sigma_s) = (medium.source(Vec3::ZERO), medium.sigma_s(Vec3::ZERO));
    let sigma_t = medium.extinction();
    (0..3).any(|channel| source[channel] > 0.0 && sigma_t[channel] <= sigma_s[channel])
}

/// The unit vector along a vector of any length, by way of double precision.
fn unit(v: Vec3) -> Option<Vec3> {
    v.as_dvec3().try_normalize().map(glam::DVec3::as_vec3)
}
