//! The shapes that a scene is made of, validated once when they are made.

use glam::Vec3;

use super::axis_box::AxisBox;
use super::mesh::TriangleMesh;
use super::quad::Quad;
use super::sphere::Sphere;

/// One surface of a scene.
#[derive(Clone, Debug)]
pub enum Shape {
    /// A sphere.
    Sphere(Sphere),
    /// A parallelogram.
    Quad(Quad),
    /// A box along the axes.
    Box(AxisBox),
    /// Triangles.
    Mesh(TriangleMesh),
}

impl Shape {
    /// Surface area, square scene units.
    #[must_use]
    pub fn area(&self) -> f32 {
        match self {
            Self::Sphere(sphere) => sphere.area(),
            Self::Quad(quad) => quad.area(),
            Self::Box(axis_box) => axis_box.area(),
            Self::Mesh(mesh) => mesh.area(),
        }
    }

    /// Draws a point uniformly over the surface; returns it with the geometric normal.
    ///
    /// `u` is uniform in `[0, 1)²`; the density is `1 / area()` per square scene unit.
    #[inline]
    #[must_use]
    pub fn sample_area(&self, u: [f32; 2]) -> (Vec3, Vec3) {
        match self {
            Self::Sphere(sphere) => sphere.sample_area(u),
            Self::Quad(quad) => quad.sample_area(u),
            Self::Box(axis_box) => axis_box.sample_area(u),
            Self::Mesh(mesh) => mesh.sample_area(u),
        }
    }

    /// The random numbers with which [`sample_area`](Self::sample_area) draws a point of the surface; `None`
    /// for boxes and meshes, where a search would have to find its face.
    #[must_use]
    pub fn area_coordinates(&self, point: Vec3) -> Option<[f32; 2]> {
        match self {
            Self::Sphere(sphere) => Some(sphere.area_coordinates(point)),
            Self::Quad(quad) => Some(quad.area_coordinates(point)),
            Self::Box(_) | Self::Mesh(_) => None,
        }
    }

    /// Whether the surface separates an inside from an outside.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        match self {
            Self::Sphere(_) | Self::Box(_) => true,
            Self::Quad(_) => false,
            Self::Mesh(mesh) => mesh.is_closed(),
        }
    }

    /// Whether `point` lies strictly inside; `None` for a shape that is not closed.
    ///
    /// Costs up to two tests per triangle for a mesh, if `point` lies in its box.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> Option<bool> {
        match self {
            Self::Sphere(sphere) => Some(sphere.contains(point)),
            Self::Quad(_) => None,
            Self::Box(axis_box) => Some(axis_box.contains(point)),
            Self::Mesh(mesh) => mesh.contains(point),
        }
    }

    /// The least and the greatest coordinates of the surface, scene units.
    #[must_use]
    pub fn aabb(&self) -> (Vec3, Vec3) {
        match self {
            Self::Sphere(sphere) => sphere.aabb(),
            Self::Quad(quad) => quad.aabb(),
            Self::Box(axis_box) => axis_box.aabb(),
            Self::Mesh(mesh) => mesh.aabb(),
        }
    }

    /// The shape, moved by a vector in scene units.
    #[must_use]
    pub fn translated(self, by: Vec3) -> Self {
        match self {
            Self::Sphere(sphere) => Self::Sphere(sphere.translated(by)),
            Self::Quad(quad) => Self::Quad(quad.translated(by)),
            Self::Box(axis_box) => Self::Box(axis_box.translated(by)),
            Self::Mesh(mesh) => Self::Mesh(mesh.translated(by)),
        }
    }

    /// The enclosed volume, cubic scene units; zero for a shape that is not closed.
    #[must_use]
    pub fn volume(&self) -> f32 {
        match self {
            Self::Sphere(sphere) => sphere.volume(),
            Self::Box(axis_box) => axis_box.volume(),
            Self::Mesh(mesh) if mesh.is_closed() => mesh.signed_volume().abs(),
            Self::Quad(_) | Self::Mesh(_) => 0.0,
        }
    }
}

impl From<Sphere> for Shape {
    fn from(sphere: Sphere) -> Self {
        Self::Sphere(sphere)
    }
}

impl From<Quad> for Shape {
    fn from(quad: Quad) -> Self {
        Self::Quad(quad)
    }
}

impl From<AxisBox> for Shape {
    fn from(axis_box: AxisBox) -> Self {
        Self::Box(axis_box)
    }
}

impl From<TriangleMesh> for Shape {
    fn from(mesh: TriangleMesh) -> Self {
        Self::Mesh(mesh)
    }
}
