//! Intersections of rays with surfaces.

use std::ops::ControlFlow;

use glam::Vec3;

/// Index of a shape in the list that a [`SceneGeometry`](super::SceneGeometry) was built from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ShapeId(pub u32);

/// An intersection of a ray with a surface, as the traversal finds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Distance along the ray, scene units.
    pub t: f32,
    /// The shape that is met.
    pub shape: ShapeId,
    /// Part of the shape: the triangle of a mesh, the face of a box (`2·axis`, plus one on the upper side), 0
    /// where a line enters a sphere and 1 where it leaves, 0 for a quad.
    pub primitive: u32,
    /// Coordinates on a quad, in `[0, 1]²`, or the weights of the second and third corner of a triangle. Zero
    /// for spheres and boxes: see [`SceneGeometry::uv`](super::SceneGeometry::uv).
    pub uv: [f32; 2],
}

/// The answer of a visitor to an intersection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Visit {
    /// Go on with all further intersections.
    Continue,
    /// Go on with intersections nearer than this distance, in scene units. Cannot undo an earlier, smaller
    /// limit.
    ShrinkTo(f32),
    /// End the traversal.
    Stop,
}

impl Visit {
    /// Shortens a ray, or breaks off.
    #[inline(always)]
    pub(super) fn apply(self, t_max: &mut f32) -> ControlFlow<()> {
        match self {
            Self::Continue => {}
            Self::ShrinkTo(t) => *t_max = t_max.min(t),
            Self::Stop => return ControlFlow::Break(()),
        }
        ControlFlow::Continue(())
    }
}

/// Position and normals of the surface at an intersection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The point, recomputed on the surface and rounded once, so that it is as exact after a long ray as
    /// after a short one.
    pub position: Vec3,
    /// Unit normal of the surface: outwards for closed shapes, by the winding for quads and triangles.
    pub geometric_normal: Vec3,
    /// Interpolated unit normal, in the hemisphere of the geometric one.
    pub shading_normal: Vec3,
}
