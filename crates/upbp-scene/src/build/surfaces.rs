//! Shapes with their materials.

use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;

use glam::{Affine3A, DMat3, DVec3, Mat3, Vec3};
use upbp_accel::{AxisBox, Border, GeometryError, Quad, Shape, Sphere, TriangleMesh};
use upbp_media::{MediumId, Spectrum};

use super::builder::{Builder, unknown};
use crate::description::{self, Geometry, SmoothingAngle, Vector};
use crate::error::Shortened;
use crate::material::{
    Conductor, Dielectric, Lambert, Material, MetalFresnel, Mirror, Phong, RoughDielectric, TrowbridgeReitz,
};
use crate::obj::{ObjFile, ObjMesh, PartError};

/// The largest mesh file that is read, in bytes.
const MAX_FILE: u64 = 1 << 30;

/// Triangles from which shapes with the same mesh file share them. For fewer, memory is of no matter, and
/// rays find triangles of their own somewhat faster.
const COPIED_FROM: u32 = 4096;

/// Triangles of all copies of a mesh together beyond which shapes share them however few it has.
const MOST_OF_COPIES: usize = 1 << 20;

/// Boundary and emission of a shape, checked by themselves, but not yet against other shapes.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceDraft {
    pub(super) boundary: BoundaryDraft,
    pub(super) emission: Spectrum,
}

/// The boundary that a shape is, before its body has a rank among the others.
#[derive(Clone, Copy, Debug)]
pub(super) enum BoundaryDraft {
    Opaque(Material),
    Refracting(Material, Inside),
    Null(Inside),
}

impl BoundaryDraft {
    /// The inside, unless light does not get there.
    pub(super) const fn inside(&self) -> Option<Inside> {
        match self {
            Self::Opaque(_) => None,
            Self::Refracting(_, inside) | Self::Null(inside) => Some(*inside),
        }
    }
}

/// The inside of a body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Inside {
    pub(super) medium: Option<MediumId>,
    /// Index of refraction; `None` for that of the surroundings.
    pub(super) ior: Option<f32>,
    pub(super) priority: i32,
}

/// A material, and whether light passes it.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Opaque(Material),
    Refracting(Material, f32),
    Null,
}

impl Builder<'_> {
    /// The shapes, each with its draft; `None` where there is a problem.
    pub(super) fn surfaces(
        &mut self,
        media: &BTreeMap<&str, MediumId>,
    ) -> Vec<Option<(Shape, SurfaceDraft)>> {
        let mut materials = BTreeMap::new();
        for (name, material) in self.description.materials.iter() {
            match kind(material) {
                Ok(kind) => {
                    materials.insert(name, Some(kind));
                }
                Err(message) => {
                    self.problem(format!("material `{}`", Shortened(name)), message);
                    materials.insert(name, None);
                }
            }
        }
        let shapes = self.description.shapes.iter().enumerate();
        let surfaces = shapes.map(|(index, shape)| self.surface(index, shape, &materials, media)).collect();
        // What shapes need of it they have.
        self.meshes = MeshFiles::default();
        surfaces
    }

    fn surface(
        &mut self,
        index: usize,
        shape: &description::Shape,
        materials: &BTreeMap<&str, Option<Kind>>,
        media: &BTreeMap<&str, MediumId>,
    ) -> Option<(Shape, SurfaceDraft)> {
        let item = self.shape_item(index);
        let geometry = self.geometry(&shape.geometry);
        if let Err(message) = &geometry {
            self.problem(&item, message);
        }
        let medium = shape.interior.as_deref().map(|name| self.medium(&item, name, media));
        let name = shape.material.as_str();
        let Some(kind) = materials.get(name) else {
            let materials = &self.description.materials;
            self.problem(&item, unknown("material", name, materials.len(), materials.names()));
            return None;
        };
        let kind = (*kind)?;
        let name = Shortened(name);
        let emission = shape.emission.get();
        if let Kind::Opaque(material) = kind {
            if let Some(interior) = shape.interior.as_deref().map(Shortened) {
                let message =
                    format!("the material `{name}` is opaque, so that there is no interior for `{interior}`");
                self.problem(&item, message);
            }
            let (shape, boundary) = (geometry.ok()?, BoundaryDraft::Opaque(material));
            if !emission.is_black() {
                self.check_winding_of_lamp(&item, &shape);
            }
            return Some((shape, SurfaceDraft { boundary, emission }));
        }
        if !emission.is_black() {
            let message =
                format!("has an emission, but light passes its material `{name}`; use an opaque one");
            self.problem(&item, message);
        }
        let geometry = geometry.ok()?;
        if !geometry.is_closed() {
            let wrong = match &geometry {
                Shape::Mesh(mesh) => mesh.border().to_string(),
                _ => "a quad is not closed: a pane is a `Box` as thick as it is".into(),
            };
            self.problem(&item, format!("the material `{name}` bounds a body, but {wrong}"));
            return None;
        }
        if let Shape::Mesh(mesh) = &geometry
            && mesh.signed_volume() < 0.0
        {
            self.problem(
                &item,
                "the triangles are wound the wrong way round: normals must point out of the body",
            );
        }
        let inside = |ior| Inside { medium: medium.flatten(), ior, priority: shape.priority };
        let boundary = match kind {
            Kind::Opaque(material) => BoundaryDraft::Opaque(material),
            Kind::Refracting(material, ior) => BoundaryDraft::Refracting(material, inside(Some(ior))),
            Kind::Null => BoundaryDraft::Null(inside(None)),
        };
        Some((geometry, SurfaceDraft { boundary, emission }))
    }

    /// Reports a lamp that shines into itself, unless that is where the camera is.
    fn check_winding_of_lamp(&mut self, item: &str, lamp: &Shape) {
        let Shape::Mesh(mesh) = lamp else { return };
        let description::Camera::Perspective { origin, .. } = &self.description.camera;
        if let border @ Border::BetweenWindings(_) = mesh.border() {
            self.problem(item, format!("has an emission, but {border}"));
        } else if mesh.is_closed() && mesh.signed_volume() < 0.0 && mesh.contains(origin.get()) != Some(true)
        {
            self.problem(
                item,
                "the triangles are wound the wrong way round: it shines on the side of its normals, which must point out of it",
            );
        }
    }

    fn geometry(&mut self, geometry: &Geometry) -> Result<Shape, String> {
        let shape = match geometry {
            Geometry::Sphere { centre, radius } => Sphere::new(centre.get(), radius.get()).map(Shape::from),
            Geometry::Quad { origin, edge_u, edge_v } => {
                Quad::new(origin.get(), edge_u.get(), edge_v.get()).map(Shape::from)
            }
            Geometry::Box { min, max, rotate } => {
                if !min.get().cmplt(max.get()).all() {
                    return Err(format!(
                        "`min` {} is not below `max` {} on every axis",
                        min.get(),
                        max.get()
                    ));
                }
                match rotation(rotate)? {
                    Some(rotation) => rotated_box([min.get(), max.get()], rotation).map(Shape::from),
                    None => AxisBox::new(min.get(), max.get()).map(Shape::from),
                }
            }
            Geometry::Mesh {
                file,
                part,
                positions,
                indices,
                normals,
                smooth_degrees,
                scale,
                rotate,
                translate,
            } => {
                let given_here = !(positions.is_empty() && indices.is_empty() && normals.is_empty());
                let mesh = match file {
                    Some(_) if given_here => {
                        return Err("has a `file` as well as triangles of its own".into());
                    }
                    Some(file) => self.obj_mesh(file, part.as_deref(), *smooth_degrees)?,
                    None if part.is_some() => return Err("has a `part`, but no `file`".into()),
                    None if positions.is_empty() || indices.is_empty() => {
                        return Err("needs a `file`, or `positions` and `indices`".into());
                    }
                    None => {
                        let vectors =
                            |list: &[Vector]| list.iter().map(|vector| vector.get()).collect::<Vec<_>>();
                        check_triangles(&vectors(positions), indices)?;
                        let normals = (!normals.is_empty()).then(|| vectors(normals));
                        let (positions, indices) = (vectors(positions), indices.clone());
                        triangles(ObjMesh { positions, indices, normals }, *smooth_degrees)?
                    }
                };
                let rotation = rotation(rotate)?;
                let in_place = scale.is_none() && rotation.is_none() && translate.is_none();
                let scale = scale.map_or(1.0, description::Positive::get);
                let translate = translate.map_or(Vec3::ZERO, Vector::get);
                let linear = rotation.unwrap_or(Mat3::IDENTITY) * scale;
                let to_scene = Affine3A::from_mat3_translation(linear, translate);
                let copies = file
                    .as_deref()
                    .map_or(1, |file| self.meshes.copies(&file_part(file, part.as_deref(), *smooth_degrees)));
                let count = mesh.triangle_count();
                let of_copies = copies.saturating_mul(count as usize);
                let is_copy = copies > 1 && (count >= COPIED_FROM || of_copies > MOST_OF_COPIES);
                let mesh = match (is_copy, in_place) {
                    (true, _) => mesh.placed(&to_scene),
                    (false, true) => Ok(mesh),
                    (false, false) => mesh.transformed(&to_scene),
                };
                let mesh = mesh.map_err(|error| error.to_string())?;
                let (min, max) = mesh.aabb();
                if Vector::new(min).is_err() || Vector::new(max).is_err() {
                    for triangle in 0..mesh.triangle_count() {
                        for corner in mesh.corners(triangle) {
                            Vector::new(corner).map_err(|error| format!("triangle {triangle}: {error}"))?;
                        }
                    }
                }
                Ok(mesh.into())
            }
        };
        shape.map_err(|error| error.to_string())
    }

    /// The mesh in a file, or a part of it; the file is read once.
    fn obj_mesh(
        &mut self,
        file: &str,
        part: Option<&str>,
        smooth: SmoothingAngle,
    ) -> Result<TriangleMesh, String> {
        let key = file_part(file, part, smooth);
        if let Some(known) = self.meshes.known.get(&key) {
            return known.clone();
        }
        let item = format!("mesh `{}`", Shortened(file));
        let mesh = self.obj_file(file).and_then(|read| {
            let materials = if part.is_none() { read.material_count() } else { 0 };
            if materials > 1 {
                let message = format!("has {materials} materials, and all of it is one shape: with `part` a shape takes the triangles of one of them");
                self.note_once(&item, message);
            }
            if read.lacks_normals() && smooth == SmoothingAngle::ZERO {
                self.note_once(
                    &item,
                    "has smoothing groups but no normals: it is rendered with flat facets, unless \
                     `smooth_degrees` is given",
                );
            }
            let mesh = match part {
                Some(part) => read.part(part).map_err(|error| match error {
                    PartError::Unknown => unknown("part", part, read.parts().len(), read.parts()),
                    error @ PartError::SeveralKinds(_) => error.to_string(),
                }),
                None => Ok(read.mesh()),
            };
            drop(read);
            let describe = |error: &dyn std::fmt::Display| format!("{item}: {error}");
            mesh.and_then(|mesh| triangles(mesh, smooth)).map_err(|error| describe(&error))
        });
        if let Ok(mesh) = &mesh {
            self.note_dropped_triangles(&item, mesh);
        }
        self.meshes.known.insert(key, mesh.clone());
        mesh
    }

    /// A file, which is kept if another part of it will be asked for.
    fn obj_file(&mut self, file: &str) -> Result<Rc<ObjFile>, String> {
        if let Some(read) = self.meshes.files.get(file) {
            return read.clone();
        }
        let path = self.path(file);
        let shown = self.shown_path(file);
        let describe = |error: &dyn std::fmt::Display| match other_format(file) {
            Some(format) => format!(
                "mesh `{shown}`: meshes are Wavefront OBJ files, not {format}: export it as OBJ, with normals"
            ),
            None => format!("mesh `{shown}`: {error}"),
        };
        let read = match self.open(&path, MAX_FILE) {
            Ok(bytes) => ObjFile::read(bytes).map(Rc::new).map_err(|error| describe(&error)),
            Err(error) => Err(describe(&error)),
        };
        if self.meshes.parts_of(file) > 1 {
            self.meshes.files.insert(file.to_owned(), read.clone());
        }
        read
    }
}

/// The mesh files of a scene.
#[derive(Default)]
pub(super) struct MeshFiles {
    /// Files of which there are several parts in the scene, or why they could not be read.
    files: BTreeMap<String, Result<Rc<ObjFile>, String>>,
    /// Meshes, or why there are none, by file, part and smoothing.
    known: BTreeMap<FilePart, Result<TriangleMesh, String>>,
    /// Number of shapes that refer to each.
    uses: BTreeMap<FilePart, usize>,
}

/// A file, the part of it if not all, and the bits of the angle by which it is smoothed.
type FilePart = (String, Option<String>, u32);

fn file_part(file: &str, part: Option<&str>, smooth: SmoothingAngle) -> FilePart {
    (file.to_owned(), part.map(str::to_owned), smooth.get().to_bits())
}

/// A mesh whose normals, if it has none, are those by an angle above 0.
fn triangles(mesh: ObjMesh, smooth: SmoothingAngle) -> Result<TriangleMesh, String> {
    let mesh = if smooth == SmoothingAngle::ZERO { mesh } else { mesh.smoothed(smooth.get())? };
    let ObjMesh { positions, indices, normals } = mesh;
    TriangleMesh::new(positions, indices, normals).map_err(|error| error.to_string())
}

impl MeshFiles {
    pub(super) fn of(description: &description::SceneDescription) -> Self {
        let mut files = Self::default();
        for shape in &description.shapes {
            if let Geometry::Mesh { file: Some(file), part, smooth_degrees, .. } = &shape.geometry {
                *files.uses.entry(file_part(file, part.as_deref(), *smooth_degrees)).or_default() += 1;
            }
        }
        files
    }

    fn copies(&self, key: &FilePart) -> usize {
        self.uses.get(key).copied().unwrap_or(1)
    }

    fn parts_of(&self, file: &str) -> usize {
        let from = self.uses.range((file.to_owned(), None, 0)..);
        from.take_while(|((other, ..), _)| other == file).count()
    }
}

/// The format that the ending of a file tells, if meshes in it are not read.
fn other_format(file: &str) -> Option<&'static str> {
    const OTHERS: [&str; 10] = ["PLY", "STL", "glTF", "GLB", "FBX", "DAE", "3DS", "USD", "ABC", "BLEND"];
    let ending = Path::new(file).extension()?.to_str()?;
    OTHERS.into_iter().find(|format| format.eq_ignore_ascii_case(ending))
}

/// All rotations of a list together; `None` if there are none.
pub(super) fn rotation(list: &[description::Rotation]) -> Result<Option<Mat3>, String> {
    let mut all = DMat3::IDENTITY;
    for (number, description::Rotation { axis, degrees }) in list.iter().enumerate() {
        let Some(axis) = axis.get().as_dvec3().try_normalize() else {
            return Err(format!("rotation {}: its axis has no direction", number + 1));
        };
        all = DMat3::from_axis_angle(axis, f64::from(degrees.get()).to_radians()) * all;
    }
    // What is left of zeros by rounding: quarter turns are exact.
    let digits = |v: DVec3| (v * 2_f64.powi(40)).round() * 2_f64.powi(-40);
    let DMat3 { x_axis, y_axis, z_axis } = all;
    let exact = DMat3::from_cols(digits(x_axis), digits(y_axis), digits(z_axis));
    Ok((exact != DMat3::IDENTITY).then(|| exact.as_mat3()))
}

/// A box that is rotated about its centre.
fn rotated_box([min, max]: [Vec3; 2], rotation: Mat3) -> Result<TriangleMesh, GeometryError> {
    /// Corners of each face, counter-clockwise from outside; bits of a number tell of an axis each.
    const FACES: [[u32; 4]; 6] =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let (centre, half) = (0.5 * min + 0.5 * max, 0.5 * max - 0.5 * min);
    let corner = |number: u32| {
        let side = |axis: u32| if number >> axis & 1 == 0 { -1.0 } else { 1.0 };
        centre + rotation * (half * Vec3::new(side(0), side(1), side(2)))
    };
    let triangles = FACES.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    TriangleMesh::new((0..8).map(corner).collect(), triangles, None)
}

/// Reports the first triangle without area. Those in mesh files are left out; one that is written by hand is
/// a mistake.
fn check_triangles(positions: &[Vec3], indices: &[[u32; 3]]) -> Result<(), String> {
    for (number, triangle) in indices.iter().enumerate() {
        let [Some(a), Some(b), Some(c)] = triangle.map(|corner| positions.get(corner as usize)) else {
            let count = positions.len();
            return Err(format!(
                "triangle {number} has corners {triangle:?}, but there are {count} positions"
            ));
        };
        let [a, b, c] = [a, b, c].map(|corner| corner.as_dvec3());
        if (b - a).cross(c - a).length_squared() == 0.0 {
            return Err(format!("triangle {number} has no area"));
        }
    }
    Ok(())
}

fn kind(material: &description::Material) -> Result<Kind, String> {
    use description::Material as M;
    let normals = |alpha: &description::Roughness| TrowbridgeReitz { alpha: alpha.get() };
    Ok(match material {
        M::Lambert(reflectance) => {
            Kind::Opaque(Material::Lambert(Lambert { reflectance: reflectance.get() }))
        }
        M::Phong { diffuse, specular, exponent } => {
            let (diffuse, specular) = (diffuse.get(), specular.get());
            let most = (diffuse + specular).max_component();
            // Sums of decimal fractions may exceed 1 by a rounding.
            if most > 1.0 + 1e-6 {
                return Err(format!(
                    "`diffuse` and `specular` reflect {most} in one channel, expected at most 1"
                ));
            }
            Kind::Opaque(Material::Phong(Phong { diffuse, specular, exponent: exponent.get() }))
        }
        M::Mirror(reflectance) => Kind::Opaque(Material::Mirror(Mirror { reflectance: reflectance.get() })),
        M::Conductor { alpha, eta, k } => {
            let fresnel = MetalFresnel::Indices { eta: eta.get(), k: k.get() };
            Kind::Opaque(Material::Conductor(Conductor { normals: normals(alpha), fresnel }))
        }
        M::Metal { alpha, reflectance } => {
            let fresnel = MetalFresnel::Schlick(reflectance.get());
            Kind::Opaque(Material::Conductor(Conductor { normals: normals(alpha), fresnel }))
        }
        M::Dielectric { ior } => Kind::Refracting(Material::Dielectric(Dielectric), ior.get()),
        M::RoughDielectric { alpha, ior } => Kind::Refracting(
            Material::RoughDielectric(RoughDielectric { normals: normals(alpha) }),
            ior.get(),
        ),
        M::Null => Kind::Null,
    })
}
