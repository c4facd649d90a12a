//! Shapes with their materials.

use std::collections::BTreeMap;

use glam::Vec3;
use upbp_accel::{AxisBox, Quad, Shape, Sphere, TriangleMesh};
use upbp_media::{MediumId, Spectrum};

use super::builder::{Builder, unknown};
use crate::description::{self, Geometry, Vector};
use crate::material::{
    Conductor, Dielectric, Lambert, Material, MetalFresnel, Mirror, Phong, RoughDielectric, TrowbridgeReitz,
};
use crate::obj::ObjMesh;

/// The largest mesh file that is read, in bytes.
const MAX_FILE: u64 = 1 << 30;

/// A shape that is checked by itself, but not yet against others.
#[derive(Clone, Debug)]
pub(super) struct ShapeDraft {
    pub(super) shape: Shape,
    /// `None`: an index-matched boundary.
    pub(super) bsdf: Option<Material>,
    /// The inside, of refracting and index-matched materials.
    pub(super) body: Option<Inside>,
    pub(super) emission: Spectrum,
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

impl Kind {
    fn bsdf(self) -> Option<Material> {
        match self {
            Self::Opaque(material) | Self::Refracting(material, _) => Some(material),
            Self::Null => None,
        }
    }
}

impl Builder<'_> {
    /// One draft per shape; `None` where there is a problem.
    pub(super) fn surfaces(&mut self, media: &BTreeMap<&str, MediumId>) -> Vec<Option<ShapeDraft>> {
        let mut materials = BTreeMap::new();
        for (name, material) in self.description.materials.iter() {
            match kind(material) {
                Ok(kind) => {
                    materials.insert(name, Some(kind));
                }
                Err(message) => {
                    self.problem(format!("material `{name}`"), message);
                    materials.insert(name, None);
                }
            }
        }
        let shapes = self.description.shapes.iter().enumerate();
        shapes.map(|(index, shape)| self.surface(index, shape, &materials, media)).collect()
    }

    fn surface(
        &mut self,
        index: usize,
        shape: &description::Shape,
        materials: &BTreeMap<&str, Option<Kind>>,
        media: &BTreeMap<&str, MediumId>,
    ) -> Option<ShapeDraft> {
        let item = self.shape_item(index);
        let geometry = self.geometry(&shape.geometry);
        if let Err(message) = &geometry {
            self.problem(&item, message);
        }
        let medium = shape.interior.as_deref().map(|name| self.medium(&item, name, media));
        let name = shape.material.as_str();
        let Some(kind) = materials.get(name) else {
            let message = unknown("material", name, self.description.materials.names());
            self.problem(&item, message);
            return None;
        };
        let kind = (*kind)?;
        let emission = shape.emission.get();
        if let Kind::Opaque(_) = kind {
            if let Some(interior) = &shape.interior {
                let message =
                    format!("the material `{name}` is opaque, so that there is no interior for `{interior}`");
                self.problem(&item, message);
            }
            let draft = ShapeDraft { shape: geometry.ok()?, bsdf: kind.bsdf(), body: None, emission };
            return Some(draft);
        }
        if !emission.is_black() {
            let message =
                format!("has an emission, but light passes its material `{name}`; use an opaque one");
            self.problem(&item, message);
        }
        let geometry = geometry.ok()?;
        if !geometry.is_closed() {
            let message = format!("the material `{name}` bounds a body, but the shape is not closed");
            self.problem(&item, message);
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
        let ior = if let Kind::Refracting(_, ior) = kind { Some(ior) } else { None };
        let inside = Inside { medium: medium.flatten(), ior, priority: shape.priority };
        Some(ShapeDraft { shape: geometry, bsdf: kind.bsdf(), body: Some(inside), emission })
    }

    fn geometry(&mut self, geometry: &Geometry) -> Result<Shape, String> {
        let shape = match geometry {
            Geometry::Sphere { centre, radius } => Sphere::new(centre.get(), radius.get()).map(Shape::from),
            Geometry::Quad { origin, edge_u, edge_v } => {
                Quad::new(origin.get(), edge_u.get(), edge_v.get()).map(Shape::from)
            }
            Geometry::Box { min, max } => {
                if !min.get().cmplt(max.get()).all() {
                    return Err(format!(
                        "`min` {} is not below `max` {} on every axis",
                        min.get(),
                        max.get()
                    ));
                }
                AxisBox::new(min.get(), max.get()).map(Shape::from)
            }
            Geometry::Mesh { file, positions, indices, normals, scale, translate } => {
                let given_here = !(positions.is_empty() && indices.is_empty() && normals.is_empty());
                let mesh = match file {
                    Some(_) if given_here => {
                        return Err("has a `file` as well as triangles of its own".into());
                    }
                    Some(file) => self.obj_mesh(file)?,
                    None if positions.is_empty() || indices.is_empty() => {
                        return Err("needs a `file`, or `positions` and `indices`".into());
                    }
                    None => {
                        let vectors =
                            |list: &[Vector]| list.iter().map(|vector| vector.get()).collect::<Vec<_>>();
                        check_triangles(&vectors(positions), indices)?;
                        let normals = (!normals.is_empty()).then(|| vectors(normals));
                        ObjMesh { positions: vectors(positions), indices: indices.clone(), normals }
                    }
                };
                let scale = scale.map_or(1.0, description::Positive::get);
                let translate = translate.map_or(Vec3::ZERO, Vector::get);
                let mut positions = mesh.positions;
                for (number, position) in positions.iter_mut().enumerate() {
                    *position = *position * scale + translate;
                    Vector::new(*position).map_err(|error| format!("position {number}: {error}"))?;
                }
                TriangleMesh::new(positions, mesh.indices, mesh.normals).map(Shape::from)
            }
        };
        shape.map_err(|error| error.to_string())
    }

    fn obj_mesh(&mut self, file: &str) -> Result<ObjMesh, String> {
        let path = self.path(file);
        let describe = |error: &dyn std::fmt::Display| format!("mesh `{}`: {error}", path.display());
        let bytes = self.open(&path, MAX_FILE).map_err(|error| describe(&error))?;
        ObjMesh::read(bytes).map_err(|error| describe(&error))
    }
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
