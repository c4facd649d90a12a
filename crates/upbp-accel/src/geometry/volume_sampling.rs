//! The inside of a closed shape, made ready to draw points from it by volume.
//!
//! Spheres and boxes are drawn from exactly. A mesh is covered by the cells of a grid that it has a part in,
//! and points are uniform over these cells: some lie outside of the mesh, and the density is exact.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DVec3, UVec3, Vec3};

use super::axis_box::AxisBox;
use super::hit::ShapeId;
use super::mesh::TriangleMesh;
use super::placement::Placement;
use super::scene::SceneGeometry;
use super::shape::Shape;
use super::sphere::Sphere;

/// Cells of the grid of a mesh along its longest axis.
const CELLS: u32 = 32;

/// Part of a cell by which triangles are taken to be larger than they are, so that no rounding loses a cell:
/// that of a copy neither, as far away as some hundred times its size.
const MARGIN: f64 = 1e-2;

/// Regions of the grid of a mesh from which on a hierarchy tells whether they are inside: it takes as long to
/// build as some passes over all triangles.
const MOST_WITHOUT_HIERARCHY: u32 = 32;

/// The inside of a closed shape.
#[derive(Clone, Debug)]
pub struct ShapeVolume {
    cover: Cover,
    volume: f64,
    pdf: f64,
}

#[derive(Clone, Debug)]
enum Cover {
    Sphere(Sphere),
    Box(AxisBox),
    /// Cells of the mesh, with the place of a copy.
    Cells(Arc<Cells>, Option<Placement>),
}

impl ShapeVolume {
    /// The inside of `shape`; `None` if it is not closed, or encloses nothing.
    #[must_use]
    pub fn new(shape: &Shape) -> Option<Self> {
        let (cover, volume, covered) = match shape {
            Shape::Sphere(sphere) => {
                let volume = f64::from(sphere.radius()).powi(3) * (TAU * 2.0 / 3.0);
                (Cover::Sphere(*sphere), volume, volume)
            }
            Shape::Box(axis_box) => {
                let volume = (axis_box.max().as_dvec3() - axis_box.min().as_dvec3()).element_product();
                (Cover::Box(*axis_box), volume, volume)
            }
            Shape::Mesh(mesh) if mesh.is_closed() => {
                let (cells, placement) = mesh.cells();
                let covered = cells.volume() * placement.map_or(1.0, |placement| placement.volume_ratio());
                (Cover::Cells(cells, placement), f64::from(mesh.signed_volume()).abs().min(covered), covered)
            }
            Shape::Mesh(_) | Shape::Quad(_) => return None,
        };
        (volume > 0.0 && covered.is_finite()).then(|| Self { cover, volume, pdf: 1.0 / covered })
    }

    /// The enclosed volume, cubic scene units.
    #[must_use]
    pub const fn volume(&self) -> f64 {
        self.volume
    }

    /// The density of [`sample`](Self::sample), per cubic scene unit, at every point inside.
    #[must_use]
    pub const fn pdf(&self) -> f64 {
        self.pdf
    }

    /// The sphere, if it is one.
    #[must_use]
    pub const fn as_sphere(&self) -> Option<&Sphere> {
        match &self.cover {
            Cover::Sphere(sphere) => Some(sphere),
            Cover::Box(_) | Cover::Cells(..) => None,
        }
    }

    /// Draws a point, inside of a sphere or a box, inside or near a mesh; `u` is uniform in `[0, 1)³`.
    #[must_use]
    pub fn sample(&self, u: [f64; 3]) -> Vec3 {
        match &self.cover {
            Cover::Sphere(sphere) => {
                let y = 1.0 - 2.0 * u[1];
                let ring = (4.0 * u[1] * (1.0 - u[1])).max(0.0).sqrt();
                let (sin, cos) = (TAU * u[2]).sin_cos();
                let offset = DVec3::new(ring * cos, y, ring * sin) * u[0].cbrt();
                (sphere.centre().as_dvec3() + offset * f64::from(sphere.radius())).as_vec3()
            }
            Cover::Box(axis_box) => {
                let min = axis_box.min().as_dvec3();
                (min + (axis_box.max().as_dvec3() - min) * DVec3::from(u)).as_vec3()
            }
            Cover::Cells(cells, placement) => {
                let point = cells.sample(u);
                placement.map_or(point, |placement| placement.point_in_scene(point)).as_vec3()
            }
        }
    }
}

/// Cells of a regular grid.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    min: DVec3,
    /// Size of a cell.
    size: DVec3,
    /// Number of cells of the grid along each axis.
    counts: UVec3,
    /// The cells that count, as places in the grid: x first.
    indices: Box<[u32]>,
}

impl Cells {
    /// All cells with a part inside of a closed mesh.
    pub(super) fn cover(mesh: &TriangleMesh) -> Self {
        let (min, max) = mesh.aabb();
        let (min, max) = (min.as_dvec3(), max.as_dvec3());
        let extent = max - min;
        let counts = (extent / extent.max_element() * f64::from(CELLS))
            .ceil()
            .clamp(DVec3::ONE, DVec3::splat(f64::from(CELLS)));
        let size = extent / counts;
        let mut cells = Self { min, size, counts: counts.as_uvec3(), indices: Box::default() };
        let mut state = vec![State::Unknown; cells.counts.element_product() as usize];
        for triangle in 0..mesh.triangle_count() {
            cells.mark(mesh.corners(triangle).map(|corner| corner.as_dvec3() - min), &mut state);
        }
        // Regions of cells that no triangle touches are all inside or all outside.
        let (mut regions, mut geometry) = (0, None);
        for start in 0..state.len() as u32 {
            if state[start as usize] != State::Unknown {
                continue;
            }
            regions += 1;
            if regions == MOST_WITHOUT_HIERARCHY {
                geometry = SceneGeometry::build(vec![mesh.clone().into()]).ok();
            }
            let centre = (min + cells.corner(start) + 0.5 * size).as_vec3();
            let is_inside = match &geometry {
                Some(geometry) => geometry.contains(ShapeId(0), centre),
                None => mesh.contains(centre),
            };
            let to = if is_inside == Some(true) { State::Covered } else { State::Outside };
            cells.fill(start, to, &mut state);
        }
        cells.indices =
            (0..state.len() as u32).filter(|&index| state[index as usize] == State::Covered).collect();
        cells
    }

    /// Whether corners of the mesh may be off by a vector and no point inside lies in another cell.
    pub(super) fn allow(&self, error: DVec3) -> bool {
        error.cmple(MARGIN * self.size).all()
    }

    fn volume(&self) -> f64 {
        self.size.element_product() * self.indices.len() as f64
    }

    fn place(&self, index: u32) -> UVec3 {
        let UVec3 { x, y, .. } = self.counts;
        UVec3::new(index % x, index / x % y, index / x / y)
    }

    fn index(&self, place: UVec3) -> u32 {
        (place.z * self.counts.y + place.y) * self.counts.x + place.x
    }

    /// The lower corner of a cell, from that of the grid.
    fn corner(&self, index: u32) -> DVec3 {
        self.place(index).as_dvec3() * self.size
    }

    /// Marks the cells that a triangle touches, or almost.
    fn mark(&self, corners: [DVec3; 3], state: &mut [State]) {
        let [a, b, c] = corners;
        let half = 0.5 * self.size * (1.0 + 2.0 * MARGIN);
        let last = (self.counts - 1).as_dvec3();
        let place =
            |p: DVec3, margin: f64| (p / self.size + margin).floor().clamp(DVec3::ZERO, last).as_uvec3();
        let (low, high) = (place(a.min(b).min(c), -MARGIN), place(a.max(b).max(c), MARGIN));
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    let at = UVec3::new(x, y, z);
                    let state = &mut state[self.index(at) as usize];
                    let centre = (at.as_dvec3() + 0.5) * self.size;
                    if *state != State::Covered && touches(corners.map(|corner| corner - centre), half) {
                        *state = State::Covered;
                    }
                }
            }
        }
    }

    /// Gives all unknown cells that hang together with `start` the state `to`.
    fn fill(&self, start: u32, to: State, state: &mut [State]) {
        let mut waiting = vec![start];
        state[start as usize] = to;
        while let Some(index) = waiting.pop() {
            let place = self.place(index);
            for step in [UVec3::X, UVec3::Y, UVec3::Z] {
                let below = place.cmpge(step).all().then(|| place - step);
                let above = (place + step).cmplt(self.counts).all().then(|| place + step);
                for next in [below, above].into_iter().flatten().map(|next| self.index(next)) {
                    if state[next as usize] == State::Unknown {
                        state[next as usize] = to;
                        waiting.push(next);
                    }
                }
            }
        }
    }

    fn sample(&self, u: [f64; 3]) -> DVec3 {
        let count = self.indices.len() as f64;
        // The rest of the random number inside the cell is uniform again.
        let cell = (u[0] * count).floor().min(count - 1.0);
        let inside = DVec3::new(u[0] * count - cell, u[1], u[2]).clamp(DVec3::ZERO, DVec3::ONE);
        self.min + self.corner(self.indices[cell as usize]) + inside * self.size
    }
}

/// Whether a triangle touches the box of the given half size around the origin, if their own boxes do: no
/// plane across its normal, or across an edge of both, lies between them (Akenine-Möller 2001).
fn touches(corners: [DVec3; 3], half: DVec3) -> bool {
    let [a, b, c] = corners;
    let edges = [b - a, c - b, a - c];
    let is_between = |across: DVec3| {
        let [p, q, r] = corners.map(|corner| across.dot(corner));
        let reach = across.abs().dot(half);
        p.min(q).min(r) > reach || p.max(q).max(r) < -reach
    };
    let mut across = edges.iter().flat_map(|edge| DVec3::AXES.map(|axis| edge.cross(axis)));
    !is_between(edges[0].cross(edges[1])) && !across.any(is_between)
}

/// State of a cell during the division.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Unknown,
    Covered,
    Outside,
}

#[cfg(test)]
mod tests {
    use glam::{Affine3A, Mat3};

    use super::*;

    /// Points of a sequence that fills the cube evenly.
    fn points(count: u32) -> impl Iterator<Item = [f64; 3]> {
        let step = [0.819_172_513_396_164, 0.671_043_606_703_789, 0.549_700_477_901_970];
        (0..count).map(move |i| step.map(|step| (0.5 + step * f64::from(i)).fract()))
    }

    /// A torus-like ring of square cross-section, closed, with a hole: neither convex nor star-shaped.
    fn ring(segments: u32) -> TriangleMesh {
        let mut positions = Vec::new();
        for i in 0..segments {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(segments)).sin_cos();
            for [radius, height] in [[1.0, -0.2], [2.0, -0.2], [2.0, 0.3], [1.0, 0.3]] {
                positions.push(DVec3::new(radius * cos, height, radius * sin).as_vec3());
            }
        }
        let mut triangles = Vec::new();
        for i in 0..segments {
            let (here, next) = (4 * i, 4 * ((i + 1) % segments));
            for side in 0..4 {
                let other = (side + 1) % 4;
                let corners = [here + side, here + other, next + other, next + side];
                triangles
                    .extend([[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]]);
            }
        }
        TriangleMesh::new(positions, triangles, None).unwrap()
    }

    /// The part of the points inside a shape tells its volume, and their mean its centre.
    fn check(shape: &Shape) {
        let inside = ShapeVolume::new(shape).unwrap();
        let count = 40_000;
        let (mut hits, mut sum) = (0.0, DVec3::ZERO);
        for u in points(count) {
            let point = inside.sample(u);
            if shape.contains(point) == Some(true) {
                hits += 1.0;
                sum += point.as_dvec3();
            }
        }
        let found = hits / f64::from(count) / inside.pdf();
        assert!((found / inside.volume() - 1.0).abs() < 0.01, "{shape:?}: {found}, {}", inside.volume());
        let (min, max) = shape.aabb();
        let off = (sum / hits - (0.5 * min + 0.5 * max).as_dvec3()).length();
        assert!(off < 0.01 * f64::from((max - min).length()), "{shape:?}: {off}");
        assert!(found * inside.pdf() > 0.6, "{shape:?}: {} lost", 1.0 - found * inside.pdf());
    }

    #[test]
    fn points_fill_the_inside_evenly() {
        check(&Sphere::new(Vec3::new(1.0, -2.0, 5.0), 0.3).unwrap().into());
        check(&AxisBox::new(Vec3::new(-1.0, 2.0, 0.0), Vec3::new(1.0, 2.5, 7.0)).unwrap().into());
        for segments in [4, 12, 400] {
            check(&ring(segments).into());
        }
    }

    #[test]
    fn copies_share_their_cells_where_corners_keep_their_digits() {
        let mesh = ring(12);
        let linear = Mat3::from_rotation_z(0.7) * Mat3::from_diagonal(Vec3::new(-0.4, 3.0, 1.0));
        for (distance, is_shared) in [(1.0, true), (100.0, true), (1e4, false)] {
            let to_scene = Affine3A::from_mat3_translation(linear, distance * Vec3::new(1.0, -0.7, 0.3));
            let copy = mesh.placed(&to_scene).unwrap();
            assert_eq!(Arc::ptr_eq(&copy.cells().0, &mesh.cells().0), is_shared, "{distance}");
            check(&copy.into());
        }
    }

    /// One random number chooses the cell and the place along its first axis.
    #[test]
    fn the_place_within_a_cell_does_not_depend_on_the_cell() {
        let cells = Cells::cover(&ring(12));
        let mut sums = [[0.0; 2]; 4];
        for u in points(40_000) {
            let place = (cells.sample(u) - cells.min) / cells.size;
            let quarter = &mut sums[(4.0 * u[0]) as usize];
            *quarter = [quarter[0] + place.x.fract(), quarter[1] + 1.0];
        }
        for [sum, count] in sums {
            assert!((sum / count - 0.5).abs() < 0.01, "{}", sum / count);
        }
    }

    /// Sixty-four octahedra apart from each other, with a region inside of each.
    fn octahedra() -> TriangleMesh {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for place in (0..64).map(|i| UVec3::new(i % 4, i / 4 % 4, i / 16).as_vec3()) {
            let first = positions.len() as u32;
            positions
                .extend(Vec3::AXES.into_iter().flat_map(|axis| [place + 0.45 * axis, place - 0.45 * axis]));
            triangles.extend((0..8).map(|sides: u32| {
                let [x, y, z] = [0, 1, 2].map(|axis| first + 2 * axis + (sides >> axis & 1));
                if sides.count_ones().is_multiple_of(2) { [x, y, z] } else { [x, z, y] }
            }));
        }
        TriangleMesh::new(positions, triangles, None).unwrap()
    }

    #[test]
    fn cells_cover_every_point_of_a_mesh() {
        for mesh in [ring(3), ring(7), ring(400), octahedra()] {
            let cells = Cells::cover(&mesh);
            let (min, max) = mesh.aabb();
            for u in points(20_000) {
                let point = min + (max - min) * DVec3::from(u).as_vec3();
                if mesh.contains(point) == Some(true) {
                    let place = ((point.as_dvec3() - cells.min) / cells.size).floor().as_uvec3();
                    let index = cells.index(place.min(cells.counts - 1));
                    assert!(cells.indices.binary_search(&index).is_ok(), "{point}");
                }
            }
        }
    }

    #[test]
    fn what_encloses_nothing_has_no_volume() {
        let quad = super::super::Quad::new(Vec3::ZERO, Vec3::X, Vec3::Y).unwrap();
        assert!(ShapeVolume::new(&quad.into()).is_none());
        let triangle = TriangleMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]], None).unwrap();
        assert!(ShapeVolume::new(&triangle.into()).is_none());
    }
}
