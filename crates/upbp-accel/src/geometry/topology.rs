//! Edges at which a mesh is not closed, and pieces of it that do not hang together.

use std::collections::BTreeMap;
use std::fmt;

use glam::Vec3;

use super::surface::cross;

/// The edges that keep a mesh from being closed: see [`TriangleMesh::border`](super::TriangleMesh::border).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Border {
    /// Every edge joins exactly two triangles that are wound alike: the mesh is closed.
    Nowhere,
    /// Edges of one triangle: the mesh has holes, or seams whose corners differ by a rounding.
    Open(Edges),
    /// Edges of more than two triangles, and none of one.
    Crowded(Edges),
    /// Every edge joins exactly two triangles; at these they are not wound alike.
    BetweenWindings(Edges),
}

/// Some edges of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Edges {
    /// Number of these edges.
    pub count: usize,
    /// Ends of one of them, in the mesh's own coordinates: before it is placed or transformed.
    pub one: [Vec3; 2],
}

impl fmt::Display for Border {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nowhere => f.write_str("the mesh is closed"),
            Self::Open(edges) => write!(f, "the mesh is not closed: only one triangle is {edges}"),
            Self::Crowded(edges) => write!(f, "the mesh is not closed: more than two triangles are {edges}"),
            Self::BetweenWindings(edges) => {
                write!(f, "some triangles are wound the other way round than those next to them, {edges}")
            }
        }
    }
}

impl fmt::Display for Edges {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { count, one: [from, to] } = self;
        match count {
            1 => write!(f, "at the edge from {from} to {to}"),
            _ => write!(f, "at {count} edges, one of them from {from} to {to}"),
        }
    }
}

/// The number of the first vertex at the place of each.
fn places(positions: &[Vec3]) -> Vec<u32> {
    // Adding zero turns −0 into +0, which is the same place.
    let key = |vertex: u32| positions[vertex as usize].to_array().map(|x| (x + 0.0).to_bits());
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_unstable_by_key(|&vertex| key(vertex));
    let mut first = vec![0; positions.len()];
    for same in order.chunk_by(|a, b| key(*a) == key(*b)) {
        for &vertex in same {
            first[vertex as usize] = same[0];
        }
    }
    first
}

impl Border {
    /// The border of these triangles; equal positions count as one.
    pub(super) fn of(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let places = places(positions);
        let mut edges: Vec<(u32, u32, bool)> = Vec::with_capacity(3 * triangles.len());
        for triangle in triangles {
            let [a, b, c] = triangle.map(|vertex| places[vertex as usize]);
            if a == b || b == c || c == a {
                continue;
            }
            edges.extend([(a, b), (b, c), (c, a)].map(|(from, to)| (from.min(to), from.max(to), from < to)));
        }
        edges.sort_unstable();
        let [mut open, mut crowded, mut unlike] = [None::<Edges>; 3];
        for edge in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let found = match edge {
                [_] => &mut open,
                [a, b] if a.2 != b.2 => continue,
                [_, _] => &mut unlike,
                _ => &mut crowded,
            };
            let one = [edge[0].0, edge[0].1].map(|vertex| positions[vertex as usize]);
            found.get_or_insert(Edges { count: 0, one }).count += 1;
        }
        let open = open.map(Self::Open).or(crowded.map(Self::Crowded));
        open.or(unlike.map(Self::BetweenWindings)).unwrap_or(Self::Nowhere)
    }
}

/// The largest triangle of each piece: pieces have no corner in common, equal positions counting as one.
pub(super) fn pieces(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<u32> {
    // Trees of vertices: above each is one at the same place or in the same piece, above a root itself.
    let mut above = places(positions);
    for &[a, b, c] in triangles {
        for other in [b, c] {
            let [x, y] = [a, other].map(|vertex| root(&mut above, vertex));
            above[x.max(y) as usize] = x.min(y);
        }
    }
    let mut largest = BTreeMap::new();
    for (number, triangle) in triangles.iter().enumerate() {
        let area = cross(triangle.map(|vertex| positions[vertex as usize])).length();
        let (most, piece) = largest.entry(root(&mut above, triangle[0])).or_insert((0.0, 0));
        if area > *most {
            (*most, *piece) = (area, number as u32);
        }
    }
    largest.into_values().map(|(_, piece)| piece).collect()
}

/// The root of a vertex, which comes nearer to it.
fn root(above: &mut [u32], mut vertex: u32) -> u32 {
    while above[vertex as usize] != vertex {
        above[vertex as usize] = above[above[vertex as usize] as usize];
        vertex = above[vertex as usize];
    }
    vertex
}
