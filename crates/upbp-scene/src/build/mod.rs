//! The build of a scene from its description: names are looked up, geometry is checked, bodies are put in
//! order.
//!
//! Every step goes on after a problem, so that all problems are reported together; what is asked of the scene
//! as a whole waits until all its parts are good.

mod bodies;
mod builder;
mod camera;
mod enclosures;
mod extent;
mod lights;
mod media;
mod notes;
mod rooms;
mod surfaces;
mod unseen;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use upbp_accel::{BoxTree, SceneGeometry, Shape};
use upbp_estimators::scene::{Boundary, Emitter, EmitterId};
use upbp_media::Homogeneous;

use self::builder::{Builder, Problems};
use self::rooms::Places;
use self::surfaces::{BoundaryDraft, MeshFiles};
use crate::description::{Fnv1a, SceneDescription};
use crate::error::SceneError;
use crate::light::{AreaLight, Light, VolumeLight};
use crate::material::Material;
use crate::scene::{Body, ReadyScene, Surface};

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
    /// [`SceneError::Invalid`] with all problems together.
    pub fn build(description: &SceneDescription, base_dir: impl AsRef<Path>) -> Result<Self, SceneError> {
        let mut builder = Builder {
            description,
            base_dir: base_dir.as_ref(),
            problems: Problems::default(),
            notes: Problems::default(),
            noted: BTreeSet::new(),
            hash: Fnv1a(description.hash()),
            files: Vec::new(),
            meshes: MeshFiles::of(description),
            images: BTreeMap::new(),
            tables: BTreeMap::new(),
        };
        let scene = builder.build();
        match scene {
            Some(scene) if builder.problems.is_empty() => Ok(scene),
            _ => Err(SceneError::Invalid { path: None, problems: builder.problems.list("problems") }),
        }
    }
}

impl Builder<'_> {
    /// `None` only if there are problems.
    fn build(&mut self) -> Option<ReadyScene> {
        let description = self.description;
        let medium_ids = media::number(description);
        let media = self.media(&medium_ids);
        let outside =
            description.outside.as_deref().and_then(|name| self.medium("scene, outside", name, &medium_ids));
        let camera = self.camera();
        let drafts = self.surfaces(&medium_ids);
        let mut lights = self.lights();
        if let Some(media) = &media {
            self.check_shines(media, &medium_ids);
        }
        if !self.problems.is_empty() {
            return None;
        }
        let (media, mut camera) = (media?, camera?);
        let (mut shapes, drafts): (Vec<_>, Vec<_>) = drafts.into_iter().collect::<Option<_>>()?;
        let origin = extent::move_near_origin(&mut shapes, &mut lights, &mut camera);
        let bounds = extent::bounds(&shapes, &lights, &camera);
        if lights.iter().any(|light| light.kind().is_infinite()) && !bounds.has_density_on_disc() {
            let message = format!(
                "has a radius of {:e}, too small or too large for light from infinity",
                bounds.radius
            );
            self.problem("scene", message);
        }
        let geometry = SceneGeometry::build(shapes).map_err(|error| self.problem("shapes", error)).ok()?;
        let boxes = BoxTree::new(geometry.shapes().iter().map(Shape::aabb));
        let boxes = boxes.map_err(|error| self.problem("shapes", error)).ok()?;
        let places = Places { drafts: &drafts, geometry: &geometry, boxes: &boxes };
        let rooms = places.rooms_around(camera.origin());
        let outside_medium = outside.and_then(|id| media.get(id.0 as usize));
        self.check_camera_is_lit(&rooms, places, &lights, &media, outside_medium);
        self.check_lights_are_free(&rooms, places, &lights);
        self.check_bodies_count(&rooms, places).map_err(|error| self.problem("shapes", error)).ok()?;
        self.check_lamps_are_free(&rooms, places);
        self.note_media();
        self.note_without_effect(&drafts);
        self.note_light_from_below();
        self.note_pieces(places, origin);
        self.note_flattened_triangles(places);
        self.note_thin_bodies(places, origin);
        self.note_quads_in_planes(places);
        let bodies = bodies::rank(&drafts, &geometry).map_err(|error| self.problem("shapes", error)).ok()?;
        let body_boxes = BoxTree::new(bodies.iter().map(|body| geometry.shape(body.shape).aabb()));
        let body_boxes = body_boxes.map_err(|error| self.problem("shapes", error)).ok()?;
        self.note_nested_bodies(places, &bodies, &body_boxes, origin);
        self.note_fog_in_water(places, &bodies);
        let most_rounded = extent::most_rounded(geometry.shapes(), &drafts);
        let surfaces = self.records(places, &bodies, &mut lights);
        lights.extend(volume_lights(&geometry, &bodies, &media, bounds.radius));
        let is_specular =
            surfaces.iter().filter_map(|surface| surface.boundary.bsdf()).any(Material::is_specular)
                || bodies::may_match(&bodies, &surfaces, &geometry);
        let enclosures = enclosures::find(&bodies, &surfaces, &geometry, &lights, &camera);
        let of_scene = bounds.largest_coordinate();
        let extents = enclosures::extents(&bodies, &enclosures, &geometry, media.len(), outside, of_scene);
        let (hash, files) = (self.hash.0, std::mem::take(&mut self.files));
        let notes = std::mem::take(&mut self.notes).list("notes");
        Some(ReadyScene {
            geometry,
            surfaces,
            bodies,
            enclosures,
            body_boxes,
            lights,
            media,
            extents,
            is_specular,
            camera,
            outside,
            most_rounded,
            bounds,
            origin,
            hash,
            files,
            notes,
        })
    }

    /// One record per shape; the shapes that shine are added to the lights.
    fn records(&mut self, places: Places<'_>, bodies: &[Body], lights: &mut Vec<Light>) -> Vec<Surface> {
        let interiors: BTreeMap<usize, _> =
            bodies.iter().map(|body| (body.shape.0 as usize, body.interior)).collect();
        let mut surfaces = Vec::with_capacity(places.drafts.len());
        for (index, draft) in places.drafts.iter().enumerate() {
            let emitter = if draft.emission.is_black() {
                None
            } else if let Some(light) = AreaLight::new(places.shape(index).clone(), draft.emission) {
                lights.push(Light::Area(light));
                Some(EmitterId(lights.len() as u32 - 1))
            } else {
                self.problem(self.shape_item(index), "its area is too small or too large for a light");
                None
            };
            let boundary = match draft.boundary {
                BoundaryDraft::Opaque(material) => Boundary::Opaque(material),
                BoundaryDraft::Refracting(material, _) => Boundary::Refracting(material, interiors[&index]),
                BoundaryDraft::Null(_) => Boundary::Null(interiors[&index]),
            };
            surfaces.push(Surface { boundary, emitter });
        }
        surfaces
    }
}

/// The bodies whose medium emits, as far as light sub-paths can start there.
fn volume_lights(
    geometry: &SceneGeometry,
    bodies: &[Body],
    media: &[Homogeneous],
    scene_radius: f32,
) -> impl Iterator<Item = Light> {
    let media: Vec<_> = media.iter().cloned().map(Arc::new).collect();
    bodies.iter().filter_map(move |Body { shape, interior, .. }| {
        let medium = media.get(interior.medium?.0 as usize)?.clone();
        Some(Light::Volume(VolumeLight::new(interior.body, geometry.shape(*shape), medium, scene_radius)?))
    })
}
