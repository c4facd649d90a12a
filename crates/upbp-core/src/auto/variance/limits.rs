//! The radiance that errors are relative to, and the largest part of a sample in the whole.

use glam::DVec3;

/// The largest part that a sample may have in the whole, where 67 or more have any ([`largest`]).
pub(super) const LARGEST_PART: f64 = 0.03;
/// Part of the squared mean of the picture that is added to the squared radiance which errors are relative
/// to: for a picture of mean 0.5 the 0.01 of relMSE.
pub(super) const DARKNESS: f64 = 0.04;

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

/// Factors that make radiance relative to what is around, such that squares are means over channels.
pub(super) fn relative_to(means: &[DVec3]) -> Vec<DVec3> {
    let overall = means.iter().map(|mean| mean.element_sum()).sum::<f64>() / (3 * means.len()) as f64;
    let dark = (DARKNESS * overall * overall).max(f64::MIN_POSITIVE);
    means.iter().map(|mean| (3.0 * (mean * mean + dark)).map(|square| square.sqrt().recip())).collect()
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
