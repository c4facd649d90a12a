//! From a description to a scene: names are looked up, geometry is checked, bodies are put in order.
//!
//! Every step goes on after a problem, so that all of them are reported together.

mod bodies;
mod camera;
mod lights;
mod surfaces;

use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::{Path, PathBuf};

use glam::Vec3;
use upbp_accel::SceneGeometry;
use upbp_estimators::scene::{BoundingSphere, EmitterId};
use upbp_media::{Homogeneous, MediaError, Medium as _, MediumId, PhaseFunction};

use self::bodies::BodyDraft;
use self::surfaces::ShapeDraft;
use crate::description::Fnv1a;
use crate::description::{Medium, Phase, SceneDescription};
use crate::error::{Problem, SceneError};
use crate::light::{AreaLight, Light};
use crate::scene::{ReadyScene, Surface};

/// What is collected on the way.
struct Builder<'a> {
    description: &'a SceneDescription,
    base_dir: &'a Path,
    problems: Vec<Problem>,
    /// Of the description and of the files that were read.
    hash: Fnv1a,
    /// The files that were read.
    files: Vec<PathBuf>,
}

impl ReadyScene {
    /// Reads a scene file: a regular file of at most 256 MiB. A byte order mark at its start is left out.
    ///
    /// # Errors
    ///
    /// If the file cannot be read, is not a scene, or describes one that cannot be rendered; in the last case
    /// with all problems together.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, SceneError> {
        Self::load_with(path, |_| ())
    }

    /// Reads a scene file and changes what it says, such as the size of the film, before the scene is built.
    ///
    /// # Errors
    ///
    /// As [`load`](Self::load).
    pub fn load_with(
        path: impl AsRef<Path>,
        change: impl FnOnce(&mut SceneDescription),
    ) -> Result<Self, SceneError> {
        let path = path.as_ref();
        let text = upbp_core::read_text(path)
            .map_err(|source| SceneError::Read { path: path.to_owned(), source })?;
        let base_dir = path.parent().unwrap_or(Path::new(""));
        let build = || {
            let mut description = SceneDescription::from_ron(&text)?;
            change(&mut description);
            Self::build(&description, base_dir)
        };
        build().map_err(|error| error.in_file(path))
    }

    /// Reads the text of a scene file; paths in it are relative to `base_dir`.
    ///
    /// # Errors
    ///
    /// As [`load`](Self::load).
    pub fn from_ron_str(text: &str, base_dir: impl AsRef<Path>) -> Result<Self, SceneError> {
        Self::build(&SceneDescription::from_ron(text)?, base_dir)
    }

    /// Builds the scene of a description; paths in it are relative to `base_dir`.
    ///
    /// # Errors
    ///
    /// [`SceneError::Invalid`] with all problems.
    pub fn build(description: &SceneDescription, base_dir: impl AsRef<Path>) -> Result<Self, SceneError> {
        let mut builder = Builder {
            description,
            base_dir: base_dir.as_ref(),
            problems: Vec::new(),
            hash: Fnv1a(description.hash()),
            files: Vec::new(),
        };
        let scene = builder.build();
        match scene {
            Some(scene) if builder.problems.is_empty() => Ok(scene),
            _ => Err(SceneError::Invalid { path: None, problems: builder.problems }),
        }
    }
}

impl Builder<'_> {
    /// `None` only if there are problems.
    fn build(&mut self) -> Option<ReadyScene> {
        let description = self.description;
        let media = self.media();
        let medium_ids: BTreeMap<&str, MediumId> = description
            .media
            .names()
            .enumerate()
            .map(|(index, name)| (name, MediumId(index as u32)))
            .collect();
        let outside =
            description.outside.as_deref().and_then(|name| self.medium("scene, outside", name, &medium_ids));
        let mut camera = self.camera();
        let drafts = self.surfaces(&medium_ids);
        let mut lights = self.lights();
        self.check_shines(&media, &medium_ids);

        if let Some(camera) = &camera {
            self.check_camera_is_free(camera.origin(), &drafts);
        }
        if !self.problems.is_empty() || media.len() != description.media.len() {
            return None;
        }
        let mut drafts: Vec<_> = drafts.into_iter().collect::<Option<_>>()?;
        self.check_bodies_count(&drafts);
        let far = bounds(drafts.iter().map(|draft| &draft.shape), &lights, camera.as_ref()?.origin());
        let origin = origin_near(&far);
        if origin != Vec3::ZERO {
            for draft in &mut drafts {
                draft.shape = draft.shape.clone().translated(-origin);
            }
            for light in &mut lights {
                light.translate(-origin);
            }
            camera = camera.map(|camera| camera.translated(-origin));
        }
        let bounds = bounds(drafts.iter().map(|draft| &draft.shape), &lights, camera.as_ref()?.origin());
        let bodies = bodies::rank(drafts.iter().enumerate().filter_map(|(index, draft)| {
            let body = draft.body.as_ref()?;
            Some(BodyDraft {
                index,
                shape: &draft.shape,
                medium: body.medium,
                ior: body.ior,
                priority: body.priority,
            })
        }));
        let interiors: BTreeMap<usize, _> =
            bodies.iter().map(|body| (body.shape.0 as usize, body.interior)).collect();
        let mut surfaces: Vec<Surface> = Vec::with_capacity(drafts.len());
        for (index, draft) in drafts.iter().enumerate() {
            let emitter = if draft.emission.is_black() {
                None
            } else if let Some(light) = AreaLight::new(draft.shape.clone(), draft.emission) {
                lights.push(Light::Area(light));
                Some(EmitterId(lights.len() as u32 - 1))
            } else {
                self.problem(self.shape_item(index), "its area is too small or too large for a light");
                None
            };
            let interior = interiors.get(&index).copied();
            surfaces.push(Surface { bsdf: draft.bsdf, interior, emitter });
        }
        let shapes = drafts.into_iter().map(|draft| draft.shape).collect();
        let geometry = match SceneGeometry::build(shapes) {
            Ok(geometry) => geometry,
            Err(error) => {
                self.problem("shapes", error);
                return None;
            }
        };
        let hash = self.hash.0;
        let files = std::mem::take(&mut self.files);
        let camera = camera?;
        Some(ReadyScene {
            geometry,
            surfaces,
            bodies,
            lights,
            media,
            camera,
            outside,
            bounds,
            origin,
            hash,
            files,
        })
    }

    /// A body that is all inside of one with a higher priority would be nowhere.
    fn check_bodies_count(&mut self, drafts: &[ShapeDraft]) {
        let mut bodies: Vec<_> = drafts
            .iter()
            .enumerate()
            .filter_map(|(index, draft)| Some((draft.body?.priority, index, &draft.shape)))
            .collect();
        bodies.sort_by_key(|(priority, ..)| *priority);
        for (place, (priority, index, shape)) in bodies.iter().enumerate() {
            let higher = bodies[place..].iter().filter(|(other, ..)| other > priority);
            if let Some((other, outer, _)) =
                higher.clone().find(|(.., other)| bodies::is_inside(shape, other))
            {
                let message = format!(
                    "lies inside of {}, whose priority {other} is higher than its own {priority}: it would be nowhere",
                    self.shape_item(*outer)
                );
                self.problem(self.shape_item(*index), message);
            }
        }
    }

    fn problem(&mut self, item: impl Into<String>, message: impl Display) {
        self.problems.push(Problem { item: item.into(), message: message.to_string() });
    }

    /// How messages call a shape: by its name, or by its place from 1.
    fn shape_item(&self, index: usize) -> String {
        match self.description.shapes.get(index).and_then(|shape| shape.name.as_deref()) {
            Some(name) => format!("shape `{name}`"),
            None => format!("shape {}", index + 1),
        }
    }

    /// The path of a file to read.
    fn path(&mut self, file: &str) -> PathBuf {
        let path = self.base_dir.join(file);
        self.files.push(path.clone());
        path
    }

    fn medium(&mut self, item: &str, name: &str, ids: &BTreeMap<&str, MediumId>) -> Option<MediumId> {
        let id = ids.get(name).copied();
        if id.is_none() {
            self.problem(item, unknown("medium", name, self.description.media.names()));
        }
        id
    }

    fn media(&mut self) -> Vec<Homogeneous> {
        let mut media = Vec::new();
        for (name, medium) in self.description.media.iter() {
            match homogeneous(medium) {
                Ok(medium) => media.push(medium),
                Err(error) => self.problem(format!("medium `{name}`"), error),
            }
        }
        media
    }

    /// A scene without any light is a mistake, and so is a light that cannot reach anything.
    fn check_shines(&mut self, media: &[Homogeneous], ids: &BTreeMap<&str, MediumId>) {
        let description = self.description;
        let medium_of = |name: &String| ids.get(name.as_str()).and_then(|id| media.get(id.0 as usize));
        if let Some(outside) = &description.outside
            && medium_of(outside).is_some_and(is_closed)
        {
            for (index, light) in description.lights.iter().enumerate() {
                if lights::is_infinite(light) {
                    let message = format!(
                        "comes from infinitely far away and does not reach into the medium `{outside}` around everything"
                    );
                    self.problem(lights::item(index, light), message);
                }
            }
        }
        let emits = |name: &String| medium_of(name).is_some_and(Homogeneous::emits);
        let named =
            description.outside.iter().chain(description.shapes.iter().flat_map(|shape| &shape.interior));
        let shines = description.lights.iter().any(lights::shines)
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

/// A name that nobody defines, with those that somebody does.
fn unknown<'n>(what: &str, name: &str, known: impl Iterator<Item = &'n str>) -> String {
    let known: Vec<String> = known.map(|name| format!("`{name}`")).collect();
    if known.is_empty() {
        format!("unknown {what} `{name}`; there are none")
    } else {
        format!("unknown {what} `{name}`, known: {}", known.join(", "))
    }
}

fn homogeneous(medium: &Medium) -> Result<Homogeneous, MediaError> {
    let Medium::Homogeneous { sigma_a, sigma_s, phase, emission } = medium;
    Homogeneous::new(sigma_a.get(), sigma_s.get(), phase_function(phase)?)?.with_emission(emission.get())
}

fn phase_function(phase: &Phase) -> Result<PhaseFunction, MediaError> {
    match phase {
        Phase::Isotropic => Ok(PhaseFunction::Isotropic),
        Phase::Rayleigh => Ok(PhaseFunction::Rayleigh),
        Phase::HenyeyGreenstein(g) => PhaseFunction::henyey_greenstein(g.get()),
        Phase::Blend(parts) => {
            let parts = parts.iter().map(|(weight, part)| Ok((weight.get(), phase_function(part)?)));
            PhaseFunction::blend(parts.collect::<Result<_, _>>()?)
        }
    }
}

/// The point to which a scene is moved nearer, so that positions have all their digits where the scene is
/// (`docs/theory.md`, section 7); zero if the scene is near enough to the origin.
///
/// A multiple of a power of two that is greater than any rounding in the file: moving is exact.
fn origin_near(bounds: &BoundingSphere) -> Vec3 {
    let step = f64::from(16.0 * bounds.radius).log2().ceil().exp2();
    let near = (bounds.centre.as_dvec3() / step).round() * step;
    // A scene as small as the rounding of its coordinates has no digits to save.
    if near.is_finite() { near.as_vec3() } else { Vec3::ZERO }
}

/// A sphere around all shapes and finite lights: around the centre of their box, as small as their own
/// boxes allow.
fn bounds<'s>(
    shapes: impl Iterator<Item = &'s upbp_accel::Shape> + Clone,
    lights: &[Light],
    camera: Vec3,
) -> BoundingSphere {
    use upbp_accel::Shape;
    let positions = lights.iter().filter_map(|light| match light {
        Light::Point(light) => Some(light.position),
        Light::Spot(light) => Some(light.position),
        _ => None,
    });
    let boxes = shapes.clone().map(Shape::aabb).chain(positions.clone().map(|position| (position, position)));
    // Without anything finite only the camera is somewhere.
    let (min, max) = boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or((camera, camera));
    let centre = 0.5 * min + 0.5 * max;
    let farthest_of_shapes = shapes.map(|shape| match shape {
        Shape::Sphere(sphere) => sphere.centre().distance(centre) + sphere.radius(),
        shape => {
            let (min, max) = shape.aabb();
            (min - centre).abs().max((max - centre).abs()).length()
        }
    });
    let radius =
        farthest_of_shapes.chain(positions.map(|position| position.distance(centre))).fold(0.0, f32::max);
    // The roundings of the sum above; and a sphere must have an extent even around a single point.
    let radius = radius * (1.0 + 1e-5) + 1e-6 * centre.abs().max_element();
    BoundingSphere { centre, radius: if radius > 0.0 { radius } else { 1.0 } }
}
