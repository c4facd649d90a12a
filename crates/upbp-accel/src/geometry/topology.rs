//! How the triangles of a mesh hang together: where it ends, and its parts.

use std::fmt;

use glam::Vec3;

use super::placement::Placement;
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
    /// How many they are.
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

/// How triangles hang together; equal positions count as one.
#[derive(Clone, Debug)]
pub(super) struct Topology {
    pub(super) border: Border,
    /// A point of each part that shares no corner with the others, and the unit normal there: within the
    /// largest triangle of the part.
    pub(super) parts: Vec<(Vec3, Vec3)>,
}

impl Topology {
    /// That of all triangles before any is left out: one without area may still join its neighbours.
    pub(super) fn of(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        // Adding zero turns −0 into +0, which is the same place.
        let key = |vertex: u32| positions[vertex as usize].to_array().map(|x| (x + 0.0).to_bits());
        let mut order: Vec<u32> = (0..positions.len() as u32).collect();
        order.sort_unstable_by_key(|&vertex| key(vertex));
        // For each vertex, the first of those at its place.
        let mut first = vec![0; positions.len()];
        for same in order.chunk_by(|a, b| key(*a) == key(*b)) {
            for &vertex in same {
                first[vertex as usize] = same[0];
            }
        }
        drop(order);
        let places = || triangles.iter().map(|triangle| triangle.map(|vertex| first[vertex as usize]));
        Self { border: border(positions, places()), parts: parts(positions, places()) }
    }

    pub(super) fn placed(&self, placement: &Placement) -> Self {
        let parts = self.parts.iter();
        let parts = parts.map(|(point, normal)| (placement.point(*point), placement.normal(*normal)));
        Self { border: self.border, parts: parts.collect() }
    }

    pub(super) fn translate(&mut self, by: Vec3) {
        self.parts.iter_mut().for_each(|(point, _)| *point += by);
    }
}

fn border(positions: &[Vec3], triangles: impl ExactSizeIterator<Item = [u32; 3]>) -> Border {
    let mut edges: Vec<(u32, u32, bool)> = Vec::with_capacity(3 * triangles.len());
    for [a, b, c] in triangles {
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
    let open = open.map(Border::Open).or(crowded.map(Border::Crowded));
    open.or(unlike.map(Border::BetweenWindings)).unwrap_or(Border::Nowhere)
}

fn parts(positions: &[Vec3], triangles: impl Iterator<Item = [u32; 3]> + Clone) -> Vec<(Vec3, Vec3)> {
    // Trees of vertices, each with a root of its own number.
    let mut parents: Vec<u32> = (0..positions.len() as u32).collect();
    let root = |parents: &mut [u32], mut vertex: u32| {
        while parents[vertex as usize] != vertex {
            let above = parents[parents[vertex as usize] as usize];
            parents[vertex as usize] = above;
            vertex = above;
        }
        vertex
    };
    for [a, b, c] in triangles.clone() {
        for other in [b, c] {
            let [x, y] = [a, other].map(|vertex| root(&mut parents, vertex));
            parents[x.max(y) as usize] = x.min(y);
        }
    }
    let mut largest = std::collections::BTreeMap::new();
    for triangle in triangles {
        let corners = triangle.map(|vertex| positions[vertex as usize]);
        let normal = cross(corners);
        let area = normal.length();
        let (most, part) = largest.entry(root(&mut parents, triangle[0])).or_insert((0.0, None));
        if area > *most {
            (*most, *part) = (area, Some((corners, (normal / area).as_vec3())));
        }
    }
    let parts = largest.into_values().filter_map(|(_, part)| part);
    parts.map(|([a, b, c], normal)| (a / 3.0 + b / 3.0 + c / 3.0, normal)).collect()
}
