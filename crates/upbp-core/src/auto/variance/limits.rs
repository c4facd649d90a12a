//! The radiance that errors are relative to, and the largest part of a sample in the whole.

use glam::DVec3;

use crate::film::Image;

/// The largest part that a sample may have in the whole, where 67 or more have any ([`largest`]).
const LARGEST_PART: f64 = 0.03;
/// Part of the squared mean of the picture that is added to the squared radiance which errors are relative
/// to: for a picture of mean 0.5 the 0.01 of relMSE.
pub(super) const DARKNESS: f64 = 0.04;

/// Makes means of cells smaller that have more than a [part](largest) of the picture's light: one pixel of a
/// lamp is not what errors of all others are relative to.
pub(super) fn limit_means(cells: &mut [DVec3]) {
    let lengths: Vec<f64> = cells.iter().map(|mean| mean.length()).collect();
    let most = largest(lengths.clone());
    for (mean, length) in cells.iter_mut().zip(lengths) {
        if length > most {
            *mean *= most / length;
        }
    }
}

/// Means over squares of five by five cells, without the one in the middle, unless there is no other.
pub(super) fn surroundings(cells: &[DVec3], columns: usize) -> Vec<DVec3> {
    let rows = cells.len() / columns;
    let around = |i: usize, count: usize| i.saturating_sub(2)..(i + 3).min(count);
    let mean = |(cell, own): (usize, &DVec3)| {
        let (near_rows, near_columns) = (around(cell / columns, rows), around(cell % columns, columns));
        let others = near_rows.len() * near_columns.len() - 1;
        if others == 0 {
            return *own;
        }
        let row =
            |row: usize| near_columns.clone().map(|column| cells[row * columns + column]).sum::<DVec3>();
        (near_rows.map(row).sum::<DVec3>() - own).max(DVec3::ZERO) / others as f64
    };
    cells.iter().enumerate().map(mean).collect()
}

/// The radiance that errors are relative to.
pub(super) struct Brightness {
    /// Of each cell: what is around, or half of what is steady if that is more. Half, since noise of an even
    /// picture is not brightness.
    cells: Vec<DVec3>,
    /// Added to their squares, so that errors of black cells count.
    dark: f64,
}

impl Brightness {
    pub(super) fn of(around: &[DVec3], steady: &[DVec3]) -> Self {
        let overall = around.iter().map(|mean| mean.element_sum()).sum::<f64>() / (3 * around.len()) as f64;
        Self {
            cells: around.iter().zip(steady).map(|(around, steady)| around.max(0.5 * *steady)).collect(),
            dark: (DARKNESS * overall * overall).max(f64::MIN_POSITIVE),
        }
    }

    /// Factors that make radiance relative, such that squares are means over channels.
    pub(super) fn factors(&self) -> Vec<DVec3> {
        let squares = self.cells.iter().map(|cell| 3.0 * (cell * cell + self.dark));
        squares.map(|square| square.map(|channel| channel.sqrt().recip())).collect()
    }

    /// The relMSE of a picture whose mean square of relative errors is one, everywhere alike.
    pub(super) fn relative_mse(&self) -> f64 {
        let of_cell =
            |cell: &DVec3| ((cell * cell + self.dark) / (cell * cell + Image::DARK)).element_sum() / 3.0;
        self.cells.iter().map(of_cell).sum::<f64>() / self.cells.len() as f64
    }
}

/// Factors of values, by the parts that their squares have: none is to be above the [limit](largest).
pub(super) fn limiting_factors(parts: &[f64]) -> Vec<f32> {
    let most = largest(parts.to_vec());
    parts.iter().map(|part| if *part > most { (most / part).sqrt() as f32 } else { 1.0 }).collect()
}

/// The limit of parts such that none is more than [`LARGEST_PART`], or than twice an even share if that is
/// more, of the sum of all that are so limited. Parts of nothing, as black pixels have, do not count.
pub(super) fn largest(mut parts: Vec<f64>) -> f64 {
    /// No more parts are above the limit.
    const ABOVE: usize = (1.0 / LARGEST_PART) as usize + 1;
    parts.retain(|part| *part > 0.0);
    let largest_part = LARGEST_PART.max(2.0 / parts.len() as f64);
    let mut rest: f64 = parts.iter().sum();
    let descending = |a: &f64, b: &f64| b.total_cmp(a);
    if parts.len() > ABOVE {
        parts.select_nth_unstable_by(ABOVE, descending);
        parts.truncate(ABOVE);
    }
    parts.sort_unstable_by(descending);
    for (above, part) in parts.iter().enumerate() {
        // With `above` parts limited to `most`: most = largest_part (above most + rest).
        let most = largest_part * rest / (1.0 - largest_part * above as f64);
        if *part <= most || largest_part * (above as f64 + 1.0) >= 1.0 {
            return most.max(*part);
        }
        rest -= part;
    }
    f64::INFINITY
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn the_only_cell_is_relative_to_itself() {
        let [own, others] = [DVec3::new(0.5, 0.25, 0.125), DVec3::splat(0.75)];
        assert_eq!(surroundings(&[own], 1), [own]);
        let brightness = Brightness::of(&surroundings(&[own], 1), &[DVec3::ZERO]);
        assert!(brightness.factors()[0].max_element() < 10.0);
        assert_eq!(surroundings(&[own, others], 2), [others, own]);
    }

    /// A picture with errors of a tenth, relative as here, has the relMSE that is said.
    #[test]
    fn relative_errors_become_relative_mean_squared_errors() {
        for mean in [1e-3, 0.1, 0.5, 20.0] {
            let cells: Vec<DVec3> =
                (0..100).map(|i| DVec3::splat(mean * (0.5 + 0.01 * f64::from(i)))).collect();
            let brightness = Brightness::of(&cells, &[DVec3::ZERO; 100]);
            let (mut relative, mut expected) = (0.0, 0.0);
            for (cell, factor) in cells.iter().zip(brightness.factors()) {
                let error = 0.1 / (3.0_f64.sqrt() * factor.x);
                relative += 3.0 * (error * factor.x).powi(2) / 100.0;
                expected += error.powi(2) / (cell.x * cell.x + Image::DARK) / 100.0;
            }
            let found = relative * brightness.relative_mse();
            assert!((found / expected - 1.0).abs() < 1e-9, "{mean}: {found}, expected {expected}");
        }
    }

    #[test]
    fn what_both_passes_see_is_steady() {
        let mut pilot = super::super::tests::pilot();
        for sample in &mut pilot.samples {
            sample.value = Vec3::ZERO;
        }
        let lamp = pilot.range(3, 0).start..pilot.range(3, 1).end;
        pilot.samples[lamp].iter_mut().for_each(|sample| sample.value = Vec3::splat(8.0));
        let rare = pilot.range(5, 1).start;
        pilot.samples[rare].value = Vec3::splat(100.0);
        let means = pilot.steady_means();
        // Two samples each.
        assert_eq!([means[3], means[4], means[5]], [16.0, 0.0, 0.0].map(DVec3::splat));
    }

    #[test]
    fn no_part_is_more_than_the_largest() {
        let mut parts = vec![1.0; 1000];
        parts.extend([1e6, 1e3]);
        let most = largest(parts.clone());
        let sum: f64 = parts.iter().map(|part: &f64| part.min(most)).sum();
        assert!((most / sum - LARGEST_PART).abs() < 1e-9, "{most} of {sum}");
        // Nothing to limit, in a picture that is mostly black, too.
        assert!(largest(vec![1.0; 1000]) >= 1.0);
        for lit in [1, 2, 10, 33, 34, 100] {
            let mut parts = vec![0.0; 4096];
            parts[..lit].fill(1.0);
            assert!(largest(parts) >= 1.0, "{lit}");
        }
        // Few are limited against each other.
        let most = largest(vec![1e9, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]);
        assert!(most > 1.0 && most < 10.0, "{most}");
    }

    #[test]
    fn one_lamp_is_not_what_all_errors_are_relative_to() {
        let mut cells = vec![DVec3::splat(0.005); 2048];
        cells[..205].fill(DVec3::splat(0.05));
        cells[1000] = DVec3::splat(40.0);
        limit_means(&mut cells);
        assert!(cells[1000].x < 1.0 && cells[0].x == 0.05 && cells[2047].x == 0.005);
        let mut steady = cells.clone();
        steady[1000] = DVec3::splat(40.0);
        let factors = Brightness::of(&surroundings(&cells, 64), &steady).factors();
        let [lamp, sky] = [(1000, 40.0), (2047, 0.005)]
            .map(|(cell, radiance): (usize, f64)| factors[cell].x * radiance * 3.0_f64.sqrt());
        assert!(sky > 0.9 && (lamp - 2.0).abs() < 1e-3, "{sky} {lamp}");
        let mut even = vec![DVec3::ONE; 25];
        limit_means(&mut even);
        assert!(even.iter().all(|mean| *mean == DVec3::ONE));
    }
}
