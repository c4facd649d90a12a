//! Triangles of polygons, convex or not.
//!
//! Polygons whose diagonals from the first corner lie inside become fans; from others ears are clipped
//! (Meisters, "Polygons Have Ears", 1975): corners whose triangle with both neighbours holds no other corner.

use glam::{DVec2, DVec3, Vec3};

/// The most corners of a polygon that is no fan: each ear takes a look at all of them.
pub(super) const MAX_CORNERS: usize = 1 << 12;

/// The work of dividing all such polygons of a file, which is the square of the number of corners for each.
const MAX_WORK: u64 = 1 << 32;

/// The rest of the work that polygons of a file may take.
#[derive(Clone, Debug)]
pub(super) struct Budget(u64);

impl Default for Budget {
    fn default() -> Self {
        Self(MAX_WORK)
    }
}

impl Budget {
    fn spend(&mut self, corners: usize) -> Result<(), String> {
        let work = (corners as u64).saturating_mul(corners as u64);
        self.0 = self.0.checked_sub(work).ok_or(
            "the polygons of the file that are not convex have too many corners together: triangulate them",
        )?;
        Ok(())
    }
}

/// Distance between a corner and a line that it is meant to lie on, relative to the largest coordinate.
const ROUNDING: f64 = 4.0 * f32::EPSILON as f64;

/// Triangles that make up a polygon of at least three corners, wound like it, by the places of their corners
/// in the list.
pub(super) fn triangles(corners: &[Vec3], budget: &mut Budget) -> Result<Vec<[usize; 3]>, String> {
    let (points, rounding) = in_plane(corners);
    let is_forward = |[a, b, c]: [usize; 3]| {
        let sides = [points[b] - points[a], points[c] - points[b], points[a] - points[c]];
        let longest = sides.map(DVec2::length).into_iter().fold(0.0, f64::max);
        turn(points[a], points[b], points[c]) >= -rounding * longest
    };
    let fan: Vec<_> = (2..corners.len()).map(|next| [0, next - 1, next]).collect();
    if fan.iter().copied().all(is_forward) {
        return Ok(fan);
    }
    if corners.len() > MAX_CORNERS {
        return Err(format!(
            "a polygon that is not convex has at most {MAX_CORNERS} corners, found {}: triangulate it",
            corners.len()
        ));
    }
    budget.spend(corners.len())?;
    let ears = clip_ears(&points).filter(|ears| ears.iter().copied().all(is_forward));
    ears.ok_or_else(|| "the polygon crosses itself: triangulate it".into())
}

/// The corners as seen along an axis, from where they are counter-clockwise, and the distance by which they
/// may be off through rounding.
fn in_plane(corners: &[Vec3]) -> (Vec<DVec2>, f64) {
    let first = corners[0].as_dvec3();
    // Newell's normal, and the axis along which the most of the polygon is seen even if it crosses itself and
    // has none.
    let (mut normal, mut seen) = (DVec3::ZERO, DVec3::ZERO);
    for pair in corners[1..].windows(2) {
        let across = (pair[0].as_dvec3() - first).cross(pair[1].as_dvec3() - first);
        normal += across;
        seen += across.abs();
    }
    let axis = seen.max_position();
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let side = 1_f64.copysign(normal[axis]);
    let point = |corner: &Vec3| DVec2::new(f64::from(corner[u]), side * f64::from(corner[v]));
    let largest = corners.iter().fold(0.0, |largest: f32, corner| largest.max(corner.abs().max_element()));
    (corners.iter().map(point).collect(), ROUNDING * f64::from(largest))
}

/// Twice the area of a triangle, negative if it is wound clockwise.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// All triangles but the last are ears, or without area where there is none; `None` if there is neither.
fn clip_ears(points: &[DVec2]) -> Option<Vec<[usize; 3]>> {
    let mut left: Vec<usize> = (0..points.len()).collect();
    let around = |left: &[usize], place: usize| {
        let count = left.len();
        [left[(place + count - 1) % count], left[place], left[(place + 1) % count]]
    };
    let turn_at = |corners: [usize; 3]| {
        let [a, b, c] = corners.map(|corner| points[corner]);
        turn(a, b, c)
    };
    let is_ear = |left: &[usize], place: usize| {
        let ear = around(left, place);
        let [a, b, c] = ear.map(|corner| points[corner]);
        let blocks = |other: usize| {
            let p = points[left[other]];
            // Corners that coincide, as at the two sides of a cut to a hole, do not lie in each other's way.
            turn(a, b, p) >= 0.0
                && turn(b, c, p) >= 0.0
                && turn(c, a, p) >= 0.0
                && ![a, b, c].contains(&p)
                && turn_at(around(left, other)) <= 0.0
        };
        turn_at(ear) > 0.0 && !(0..left.len()).any(blocks)
    };
    let mut ears: Vec<bool> = (0..left.len()).map(|place| is_ear(&left, place)).collect();
    let mut triangles = Vec::with_capacity(points.len() - 2);
    while left.len() > 3 {
        let flat = || (0..left.len()).find(|&place| turn_at(around(&left, place)) == 0.0);
        let place = ears.iter().position(|&is_ear| is_ear).or_else(flat)?;
        triangles.push(around(&left, place));
        left.remove(place);
        ears.remove(place);
        // Only its neighbours may have become ears, or be none any more.
        let count = left.len();
        for neighbour in [(place + count - 1) % count, place % count] {
            ears[neighbour] = is_ear(&left, neighbour);
        }
    }
    triangles.push([left[0], left[1], left[2]]);
    Some(triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The area of a polygon in the plane y = 0, by its triangles, each of which has its own.
    fn areas(corners: &[[f32; 2]]) -> Result<Vec<f32>, String> {
        let corners: Vec<Vec3> = corners.iter().map(|[x, z]| Vec3::new(*x, 0.0, *z)).collect();
        let area = |[a, b, c]: [usize; 3]| 0.5 * (corners[b] - corners[a]).cross(corners[c] - corners[a]).y;
        Ok(triangles(&corners, &mut Budget::default())?.into_iter().map(area).collect())
    }

    /// From each corner, and both ways round.
    fn is_covered_once(corners: &[[f32; 2]], area: f32) {
        let mut corners = corners.to_vec();
        for _ in 0..2 {
            corners.reverse();
            for _ in 0..corners.len() {
                corners.rotate_left(1);
                let areas = areas(&corners).unwrap();
                assert_eq!(areas.len(), corners.len() - 2);
                // Wound like the polygon.
                let next = corners.iter().cycle().skip(1);
                let twice: f32 = corners.iter().zip(next).map(|(a, b)| a[1] * b[0] - a[0] * b[1]).sum();
                assert!(areas.iter().all(|area| twice * area >= 0.0), "{corners:?} {areas:?}");
                assert_eq!((areas.iter().sum(), twice.abs()), (0.5 * twice, 2.0 * area), "{corners:?}");
            }
        }
    }

    #[test]
    fn convex_polygons_become_fans() {
        for count in [3_usize, 4, 5, 100] {
            let angle = |i: usize| (i as f32 / count as f32 * std::f32::consts::TAU).sin_cos();
            let corners = (0..count).map(|i| Vec3::new(angle(i).0, 2.0 * angle(i).1, 3.0 * angle(i).0));
            let fan: Vec<_> = (2..count).map(|next| [0, next - 1, next]).collect();
            assert_eq!(triangles(&corners.collect::<Vec<_>>(), &mut Budget::default()).unwrap(), fan);
        }
    }

    #[test]
    fn polygons_with_reflex_corners_are_covered_once() {
        // An L, a comb, and a frame with a cut to its hole.
        is_covered_once(&[[2., 0.], [2., -1.], [1., -1.], [1., -2.], [0., -2.], [0., 0.]], 3.0);
        let comb = [[0., 0.], [5., 0.], [5., 3.], [4., 1.], [3., 3.], [2., 1.], [1., 3.], [0., 1.]];
        is_covered_once(&comb, 10.0);
        let outer = [[0., 0.], [4., 0.], [4., 4.], [0., 4.], [0., 0.]];
        let hole = [[1., 1.], [1., 3.], [3., 3.], [3., 1.], [1., 1.]];
        is_covered_once(&[outer, hole].concat(), 12.0);
        // Corners in the midst of sides.
        let t = [[0., 0.], [1., 0.], [2., 0.], [2., -1.], [3., -1.], [3., 1.], [1., 1.], [0., 1.]];
        is_covered_once(&t, 4.0);
    }

    #[test]
    fn polygons_without_area_are_fans() {
        let slanted: Vec<Vec3> = (0..9).map(|i| Vec3::new(0.1, 0.3, 0.7) * (i * i % 7) as f32).collect();
        assert_eq!(triangles(&slanted, &mut Budget::default()).unwrap().len(), 7);
        assert_eq!(triangles(&[Vec3::ONE; 4], &mut Budget::default()).unwrap(), [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn polygons_that_cross_themselves_are_refused() {
        let message = "the polygon crosses itself: triangulate it";
        for corner in [[0., 1.], [0., 1.5], [0., 0.25]] {
            assert_eq!(areas(&[[0., 0.], [1., 1.], [1., 0.], corner]).unwrap_err(), message);
        }
    }

    #[test]
    fn many_polygons_of_a_file_do_not_take_for_ever() {
        let l = [[2., 0.], [2., -1.], [1., -1.], [1., -2.], [0., -2.], [0., 0.]];
        let corners = l.map(|[x, z]| Vec3::new(x, 0.0, z));
        let mut budget = Budget(2 * 36);
        // Fans cost nothing.
        triangles(&corners[..3], &mut budget).unwrap();
        triangles(&corners, &mut budget).unwrap();
        triangles(&corners, &mut budget).unwrap();
        let error = triangles(&corners, &mut budget).unwrap_err();
        assert!(error.ends_with("too many corners together: triangulate them"), "{error}");
    }

    /// As long as a line may have, and the most that are clipped.
    #[test]
    fn many_corners_do_not_take_for_ever() {
        let saw = |teeth: usize| -> Vec<[f32; 2]> {
            let top = (0..2 * teeth).map(|i| [-(i as f32), 1.0 + (i % 2) as f32]);
            [[-(2.0 * teeth as f32), 0.0], [0.0, 0.0]].into_iter().chain(top).collect()
        };
        let areas = areas(&saw(MAX_CORNERS / 2 - 1)).unwrap();
        assert!(areas.iter().all(|area| *area <= 0.0) || areas.iter().all(|area| *area >= 0.0));
        let error = self::areas(&saw(1 << 17)).unwrap_err();
        let expected = "a polygon that is not convex has at most 4096 corners, found 262146: triangulate it";
        assert_eq!(error, expected);
    }
}
