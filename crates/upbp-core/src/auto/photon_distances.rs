//! Distances of photons and beams from queries.

use rayon::prelude::*;

/// The neighbour whose distance is measured, counted from the nearest.
const RANK: usize = 8;
/// The first radius that is tried, relative to the scene. The result does not depend on it.
const FIRST_RADIUS: f32 = 1e-3;
/// Larger than any scene; its square is finite.
const ANYWHERE: f32 = 1e18;

/// Distance of photons or beams from a typical query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Neighbours {
    /// Median over queries of the distance to the `rank`-th nearest, scene units.
    distance: f64,
    rank: f64,
    /// Sub-paths that the photons came from.
    paths: f64,
    dimension: f64,
}

impl Neighbours {
    /// The number of sub-paths with which a query of some radius finds `count` photons on average.
    pub(crate) fn paths(&self, count: f64, radius: f64) -> f64 {
        count / self.rank * self.paths * (self.distance / radius).powf(self.dimension)
    }

    /// The radius within which a query finds `count` photons on average, if `paths` sub-paths are traced.
    pub(crate) fn radius(&self, count: f64, paths: f64) -> f32 {
        (self.distance * (count / self.rank * self.paths / paths).powf(1.0 / self.dimension)) as f32
    }
}

/// Visits the distances of elements within a radius of a query.
type Around<'a, Q> = &'a (dyn Fn(&Q, f32, &mut dyn FnMut(f32)) + Sync);

/// Looks for neighbours.
#[derive(Clone, Copy)]
pub(crate) struct Nearest {
    /// Sub-paths that the elements came from.
    pub(crate) paths: f64,
    /// Size of the scene.
    pub(crate) scale: f32,
}

impl Nearest {
    /// Median over the queries of the distance within which there are a few of `count` elements; `around`
    /// tells the distances of all within a radius.
    pub(crate) fn of<Q: Sync>(
        &self,
        queries: &[Q],
        count: usize,
        dimension: f64,
        around: Around<'_, Q>,
    ) -> Option<Neighbours> {
        // Enough elements that the rank-th is still near.
        let rank = RANK.min(count / 4).max(1);
        if count == 0 {
            return None;
        }
        let radii = || std::iter::successors(Some(FIRST_RADIUS), |r| (*r < 1.0).then_some(2.0 * r));
        let distance_of = |query: &Q| {
            let mut found = Vec::new();
            for radius in radii().map(|r| r * self.scale).chain([ANYWHERE]) {
                found.clear();
                // What is beyond may be found or not.
                around(query, radius, &mut |distance| {
                    if distance < radius {
                        found.push(distance);
                    }
                });
                if found.len() >= rank {
                    return Some(*found.select_nth_unstable_by(rank - 1, f32::total_cmp).1);
                }
            }
            None
        };
        let mut nearest: Vec<f32> =
            queries.par_iter().filter_map(distance_of).filter(|distance| *distance > 0.0).collect();
        let distance = f64::from(median(&mut nearest)?);
        Some(Neighbours { distance, rank: rank as f64, paths: self.paths, dimension })
    }
}

/// The median, the upper one of an even number.
pub(crate) fn median(values: &mut [f32]) -> Option<f32> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f32::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The distances of elements on a line, in no order.
    fn found(queries: &[f32], elements: &[f32]) -> Option<Neighbours> {
        Nearest { paths: 10.0, scale: 0.1 }.of(queries, elements.len(), 1.0, &|query, radius, visit| {
            elements.iter().map(|x| (x - query).abs()).filter(|d| *d < radius).for_each(visit);
        })
    }

    #[test]
    fn the_rank_th_of_all_is_found_at_any_distance() {
        for scale in [1e-6, 1e-3, 1.0, 1e6, 1e12] {
            let elements: Vec<f32> = (0..400).map(|i| scale * ((i * 241 % 400) as f32).powi(2)).collect();
            let queries: Vec<f32> = (0..51).map(|i| scale * (i * i * 30) as f32 + 0.3 * scale).collect();
            let mut expected: Vec<f32> = queries
                .iter()
                .map(|query| {
                    let mut all: Vec<f32> = elements.iter().map(|x| (x - query).abs()).collect();
                    all.sort_by(f32::total_cmp);
                    all[RANK - 1]
                })
                .collect();
            expected.sort_by(f32::total_cmp);
            let expected = Neighbours {
                distance: f64::from(expected[25]),
                rank: RANK as f64,
                paths: 10.0,
                dimension: 1.0,
            };
            assert_eq!(found(&queries, &elements), Some(expected), "{scale}");
        }
    }

    #[test]
    fn few_elements_have_a_nearest_one_and_none_have_none() {
        assert_eq!(found(&[0.0], &[3.0, -2.0, 5.0]).map(|n| (n.distance, n.rank)), Some((2.0, 1.0)));
        assert_eq!(found(&[], &[1.0]), None);
        assert_eq!(found(&[1.0], &[]), None);
    }
}
