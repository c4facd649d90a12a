//! Surfaces and bodies.

use serde::{Deserialize, Serialize};

use super::value::{Colour, Degrees, Positive, SmoothingAngle, Vector, is_default};

/// A surface, or a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shape {
    /// Name of the shape in messages.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Position and form.
    pub geometry: Geometry,
    /// Name of the material.
    pub material: String,
    /// Name of the medium inside of a body; vacuum if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interior: Option<String>,
    /// Rank where bodies overlap: the one with the higher priority counts, among equals the one with the
    /// smaller volume.
    #[serde(default, skip_serializing_if = "is_default")]
    pub priority: i32,
    /// Radiance emitted on the side that the normal points to, W m⁻² sr⁻¹.
    #[serde(default, skip_serializing_if = "is_default")]
    pub emission: Colour,
}

/// The geometry of a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Geometry {
    /// A sphere.
    Sphere {
        /// Centre.
        centre: Vector,
        /// Radius.
        radius: Positive,
    },
    /// The parallelogram `origin + a edge_u + b edge_v`, a and b in `[0, 1]`, with the normal `edge_u ×
    /// edge_v`.
    Quad {
        /// A corner.
        origin: Vector,
        /// The first edge from that corner.
        edge_u: Vector,
        /// The second edge from that corner.
        edge_v: Vector,
    },
    /// A box along the axes, unless it is rotated.
    Box {
        /// The corner with the least coordinates.
        min: Vector,
        /// The corner with the greatest coordinates.
        max: Vector,
        /// Rotations about the centre of the box, one after the other.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        rotate: Vec<Rotation>,
    },
    /// Triangles from a file, or given here: either `file`, or `positions` and `indices`.
    Mesh {
        /// Path of a Wavefront OBJ file, relative to the scene file.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        file: Option<String>,
        /// Of the file those triangles only that belong to an object, a group or a material of this name, or
        /// to that of a statement of the file, such as `usemtl glass`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        part: Option<String>,
        /// Corners.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        positions: Vec<Vector>,
        /// Triangles as numbers of corners, from 0, counter-clockwise as seen from outside.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        indices: Vec<[u32; 3]>,
        /// Shading normals, none or one per corner.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        normals: Vec<Vector>,
        /// Where there are no normals, those of triangles around a corner whose planes differ by at most this
        /// angle become one; 0 for flat triangles.
        #[serde(default, skip_serializing_if = "is_default")]
        smooth_degrees: SmoothingAngle,
        /// Factor for all coordinates, applied first.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        scale: Option<Positive>,
        /// Rotations about the origin, applied second, one after the other.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        rotate: Vec<Rotation>,
        /// Translation of all corners, applied last.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        translate: Option<Vector>,
    },
}

/// A rotation, counter-clockwise as seen from the tip of its axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rotation {
    /// The axis, a vector of any length.
    pub axis: Vector,
    /// The angle.
    pub degrees: Degrees,
}
