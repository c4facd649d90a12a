//! Notes about parts of a scene that can be rendered, but may not be meant.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec3, Vec3};
use upbp_accel::{Shape, ShapeId, TriangleMesh, offset_origin};

use super::builder::Builder;
use super::lights;
use super::rooms::Places;
use super::surfaces::{BoundaryDraft, SurfaceDraft};
use crate::description::{Camera, Geometry, Light, Medium, Positive};
use crate::error::Shortened;
use crate::light::EnvironmentImage;
use crate::scene::{COINCIDENT, ROUNDING};

/// Largest coordinate over the extent of a mesh from which on it is far away.
const FAR: f32 = 10.0;

impl Builder<'_> {
    /// Notes something about a part of the scene.
    pub(super) fn note(&mut self, item: impl Into<String>, message: impl Into<String>) {
        self.notes.add(item.into(), message.into());
    }

    /// Notes something that may have been noted before.
    pub(super) fn note_once(&mut self, item: impl Into<String>, message: impl Into<String>) {
        let (item, message) = (item.into(), message.into());
        if self.noted.insert((item.clone(), message.clone())) {
            self.note(item, message);
        }
    }

    /// Notes what is said of the scene and changes nothing in it.
    pub(super) fn note_without_effect(&mut self, drafts: &[SurfaceDraft]) {
        let description = self.description;
        let Camera::Perspective { lens_radius, focus_distance, .. } = &description.camera;
        if focus_distance.is_some() && lens_radius.get() == 0.0 {
            self.note("camera", "has a `focus_distance`, which has no effect without a `lens_radius`");
        }
        let used: BTreeSet<&str> = description.shapes.iter().map(|shape| shape.material.as_str()).collect();
        for name in description.materials.names().filter(|name| !used.contains(name)) {
            self.note(format!("material `{}`", Shortened(name)), "is nowhere: no shape has it");
        }
        let is_opaque = |index: usize| matches!(drafts[index].boundary, BoundaryDraft::Opaque(_));
        let shapes = description.shapes.iter().enumerate();
        let mut ranked = shapes.filter(|(index, shape)| shape.priority != 0 && is_opaque(*index));
        if let Some((index, shape)) = ranked.next() {
            self.note(
                self.shape_item(index),
                format!(
                    "has a `priority`, which has no effect: its material `{}` is opaque{}",
                    Shortened(&shape.material),
                    and_others(ranked.count(), ["has", "have"])
                ),
            );
        }
    }

    /// Notes bodies both of whose faces are met as one, so that light passes as if there was nothing.
    /// `origin` is the point that has become the origin.
    pub(super) fn note_thin_bodies(&mut self, places: Places<'_>, origin: Vec3) {
        let mut known = BTreeMap::new();
        let is_thin = |index: usize| {
            if !matches!(places.drafts[index].boundary, BoundaryDraft::Refracting(..)) {
                return None;
            }
            let shape = places.shape(index);
            let (min, max) = shape.aabb();
            let largest = min.abs().max(max.abs()).max_element();
            let thickness = || 2.0 * shape.volume() / shape.area();
            let thickness = match &self.description.shapes[index].geometry {
                // Copies are alike but for their scale, and need no look at each triangle.
                Geometry::Mesh { file: Some(file), part, scale, .. } => {
                    let scale = scale.map_or(1.0, Positive::get);
                    scale * *known.entry((file, part)).or_insert_with(|| thickness() / scale)
                }
                _ => thickness(),
            };
            let rounded = match shape {
                // Across its wide faces: the largest triangle is in one of these.
                Shape::Mesh(mesh) if thickness < ROUNDING * mesh.most_rounded().length() => {
                    let largest = mesh.pieces().next();
                    largest.map_or(0.0, |(_, normal)| mesh.most_rounded().dot(normal.abs()))
                }
                _ => 0.0,
            };
            let across = (COINCIDENT * largest).max(ROUNDING * rounded);
            (thickness < across).then_some((index, [thickness, across, largest]))
        };
        let thin: Vec<_> = (0..places.drafts.len()).filter_map(is_thin).collect();
        if let [(index, sizes), others @ ..] = &thin[..] {
            let message = too_thin(*sizes, origin) + &and_others(others.len(), ["is", "are"]);
            self.note(self.shape_item(*index), message);
        }
    }

    /// Notes light from infinitely far away that comes from below. What is upright in the image tells whether
    /// that is -y or +y, unless it is nearer to another axis, as in a view from above.
    pub(super) fn note_light_from_below(&mut self) {
        let description = self.description;
        let Camera::Perspective { up, .. } = &description.camera;
        let up = up.get();
        if description.shapes.is_empty() || up.y.abs() < up.abs().max_element() {
            return;
        }
        for (index, light) in description.lights.iter().enumerate() {
            if let Light::Sun { direction, .. } | Light::Directional { direction, .. } = light
                && direction.get().y * up.y > 0.0
            {
                self.note(
                    lights::item(index, light),
                    "comes from below: `direction` is that in which its light travels, not that towards it",
                );
            }
        }
    }

    /// Notes a mesh file far from its origin many of whose triangles have no area: rounding may have taken
    /// it. Near the origin triangles without area are those at the poles of turned meshes.
    pub(super) fn note_dropped_triangles(&mut self, item: &str, mesh: &TriangleMesh) {
        let dropped = mesh.dropped_triangles();
        let count = dropped + mesh.triangle_count() as usize;
        let (min, max) = mesh.aabb();
        let largest = min.abs().max(max.abs()).max_element();
        if 100 * dropped > count && largest > FAR * (max - min).max_element() {
            let message = format!(
                "{dropped} of {count} triangles have no area at coordinates up to {largest}: move the mesh near \
                 its origin before it is written"
            );
            self.note_once(item, message);
        }
    }

    /// Notes meshes many of whose triangles have lost their area by rounding where they have been placed.
    pub(super) fn note_flattened_triangles(&mut self, places: Places<'_>) {
        /// Triangles of a mesh that are looked at, evenly spaced: there may be very many copies.
        const MOST: u32 = 256;
        let flattened = |index: usize| {
            let Shape::Mesh(mesh) = places.shape(index) else { return None };
            let (min, max) = mesh.aabb();
            let largest = mesh.most_rounded().max_element();
            if largest <= FAR * (max - min).max_element() {
                return None;
            }
            let step = mesh.triangle_count().div_ceil(MOST);
            let triangles = (0..mesh.triangle_count()).step_by(step as usize);
            let is_flat = |triangle: &u32| {
                let [a, b, c] = mesh.corners(*triangle).map(Vec3::as_dvec3);
                (b - a).cross(c - a) == DVec3::ZERO
            };
            let (count, flat) = (triangles.len(), triangles.filter(is_flat).count());
            (100 * flat > count).then_some((index, 100 * flat / count, largest))
        };
        let flattened: Vec<_> = (0..places.drafts.len()).filter_map(flattened).collect();
        if let [(index, percent, largest), others @ ..] = &flattened[..] {
            let message = format!(
                "about {percent} % of its triangles have no area at coordinates up to {largest}: move the \
                 scene near its origin{}",
                and_others(others.len(), ["does", "do"])
            );
            self.note(self.shape_item(*index), message);
        }
    }

    /// Notes media that nothing is filled with, and one around everything in which light never ends.
    pub(super) fn note_media(&mut self) {
        let (media, used) = (&self.description.media, self.description.used_media());
        for name in media.names().filter(|name| !used.contains(name)) {
            self.note(
                format!("medium `{}`", Shortened(name)),
                "is nowhere: no shape has it as `interior`, nor is it `outside`",
            );
        }
        let outside = self.description.outside.as_deref();
        if let Some((name, Medium::Homogeneous { sigma_a, sigma_s, .. })) =
            outside.and_then(|name| Some((name, media.get(name)?)))
            && (0..3).any(|channel| sigma_s.get()[channel] > 0.0 && sigma_a.get()[channel] == 0.0)
        {
            self.note(
                format!("medium `{}`", Shortened(name)),
                "scatters around everything without absorbing: iterations are long, and with a little `sigma_a` \
                 in each channel much shorter",
            );
        }
    }

    /// Notes an image that may not be meant for all directions, and what in it is not as bright as it was.
    pub(super) fn note_image(&mut self, file: &str, image: &EnvironmentImage) {
        let (width, height) = image.size();
        if width != 2 * height {
            self.note(
                format!("image `{}`", Shortened(file)),
                format!(
                    "has {width} x {height} pixels and is stretched over all directions: latitude-longitude images \
                     are twice as wide as high"
                ),
            );
        }
        if image.infinite_pixels() > 0 {
            let count = image.infinite_pixels();
            let (pixels, are) = if count == 1 { ("pixel", "is") } else { ("pixels", "are") };
            self.note(
                format!("image `{}`", Shortened(file)),
                format!(
                    "{count} {pixels} {are} infinite, as bright ones are in half precision, and count as the largest \
                     finite value of each channel"
                ),
            );
        }
    }

    /// Notes bodies of several pieces of which one has its inside in front of it: nothing that is met there
    /// agrees with what is inside of what. `origin` is the point that has become the origin.
    pub(super) fn note_pieces(&mut self, places: Places<'_>, origin: Vec3) {
        /// Pieces of a mesh that are looked at, evenly spaced: each takes up to two rays through it.
        const MOST: usize = 1000;
        let mut known = BTreeSet::new();
        for (index, draft) in places.drafts.iter().enumerate() {
            let (Shape::Mesh(mesh), Some(_)) = (places.shape(index), draft.boundary.inside()) else {
                continue;
            };
            // Of copies one is enough.
            let is_copy = is_known_mesh(&self.description.shapes[index].geometry, &mut known);
            if is_copy || mesh.pieces().len() < 2 {
                continue;
            }
            let has_inside_in_front = |&(point, normal): &(Vec3, Vec3)| {
                let front = offset_origin(point, normal, normal);
                places.geometry.contains(ShapeId(index as u32), front) == Some(true)
            };
            let step = mesh.pieces().len().div_ceil(MOST);
            if let Some((point, _)) = mesh.pieces().step_by(step).find(has_inside_in_front) {
                self.note(
                    self.shape_item(index),
                    format!(
                        "the piece of the mesh at {} is wound the wrong way round or overlaps another piece: give \
                         each body a shape of its own, and let normals point out of it, into the hollows of it too",
                        point + origin
                    ),
                );
            }
        }
    }
}

/// Whether a geometry is the same part of the same file as one in `known`, to which it belongs from then on.
fn is_known_mesh<'a>(geometry: &'a Geometry, known: &mut BTreeSet<(&'a str, Option<&'a str>)>) -> bool {
    match geometry {
        Geometry::Mesh { file: Some(file), part, .. } => !known.insert((file, part.as_deref())),
        _ => false,
    }
}

/// The note about what is too thin: its thickness, the distance up to which surfaces are met as one, and the
/// largest coordinate there, from the point that has become the origin.
pub(super) fn too_thin([thickness, across, largest]: [f32; 3], origin: Vec3) -> String {
    let from = if origin == Vec3::ZERO { String::new() } else { format!(" from {origin}") };
    format!(
        "is {thickness} thick, and is not seen at coordinates up to {largest}{from}: surfaces nearer to each \
         other than {across} are met as one there"
    )
}

/// The end of a note that holds for more shapes than it names, with its verb for one and for several.
pub(super) fn and_others(count: usize, [one, several]: [&str; 2]) -> String {
    match count {
        0 => String::new(),
        1 => format!(" (and so {one} 1 other)"),
        count => format!(" (and so {several} {count} others)"),
    }
}
