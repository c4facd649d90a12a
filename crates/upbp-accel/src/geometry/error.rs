//! The error of geometry that is handed in.

/// The reason for which a shape or a scene is refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GeometryError {
    /// A parameter is NaN or infinite.
    #[error("{what} is not finite")]
    NonFinite {
        /// The parameter.
        what: &'static str,
    },
    /// An element of a list is NaN or infinite.
    #[error("{what} {index} is not finite")]
    NonFiniteElement {
        /// The kind of element.
        what: &'static str,
        /// Its place in the list.
        index: usize,
    },
    /// A shape encloses no volume or has no area.
    #[error("{what} has no extent")]
    Degenerate {
        /// The kind of shape.
        what: &'static str,
    },
    /// A triangle refers to a vertex that does not exist.
    #[error("triangle {triangle} refers to vertex {vertex}, but there are {vertices}")]
    IndexOutOfRange {
        /// The triangle's place in the index list.
        triangle: usize,
        /// The offending index.
        vertex: u32,
        /// The number of positions.
        vertices: usize,
    },
    /// A mesh has normals, but not one per position.
    #[error("a mesh of {positions} positions has {normals} normals")]
    NormalCount {
        /// The number of positions.
        positions: usize,
        /// The number of normals.
        normals: usize,
    },
    /// A scene or a mesh has more than 2²⁶ primitives, or a mesh 2³² positions or more.
    #[error("{count} primitives are more than can be indexed")]
    TooManyPrimitives {
        /// The number of primitives.
        count: usize,
    },
}

/// Accepts a vector whose components are all finite.
pub(super) fn finite(value: glam::Vec3, what: &'static str) -> Result<glam::Vec3, GeometryError> {
    if value.is_finite() { Ok(value) } else { Err(GeometryError::NonFinite { what }) }
}
