//! Predictions of what can be computed otherwise.

use glam::Vec3;
use proptest::prelude::*;
use upbp_estimators::scene::PixelRect;
use upbp_estimators::{MergePeriods, Technique};

use super::limits::DARKNESS;
use super::*;
use crate::auto::pilot_render::grid::Grid;
use crate::auto::pilot_render::recorder::mis_weights;
use crate::auto::pilot_render::{PASSES, Work};
use crate::auto::roulette::{self, COUNT, OF_PILOT, PILOT, relative_pass_probability};
use crate::plan::tests::plan;

const SIDE: u32 = 128;

/// Uniform numbers that fill the unit interval evenly enough, and independently in two sequences.
fn uniform(i: usize, sequence: u32) -> f64 {
    let mut x = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (u64::from(sequence) << 32);
    for _ in 0..3 {
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x ^= x >> 27;
    }
    (x >> 11) as f64 / (1_u64 << 53) as f64
}

/// `∫ 3x² dx = 1` over the unit interval, by one sample of density 1, as if it was an emission hit, and one
/// of density `2x` by another technique.
fn pilot_of(other: Technique) -> PilotRender {
    let cells = (SIDE * SIDE) as usize;
    let passes = PASSES as usize;
    let mut samples = Vec::new();
    let mut ends = Vec::new();
    for i in 0..cells * passes {
        for (technique, x) in [(Technique::Hit, uniform(i, 0)), (other, uniform(i, 1).sqrt())] {
            let sum = 1.0 + 2.0 * x;
            let mut weights = [0.0; Technique::COUNT];
            weights[Technique::Hit as usize] = (1.0 / sum) as f32;
            weights[other as usize] = (2.0 * x / sum) as f32;
            let value = Vec3::splat((3.0 * x * x / sum) as f32);
            samples.push(Sample { technique, light_path: None, albedos: 1.0, value, weights });
        }
        ends.push(samples.len() as u32);
    }
    PilotRender {
        plan: planned(1),
        pixels: cells as f64,
        cells,
        columns: SIDE as usize,
        passes,
        samples,
        ends,
        pairs: Vec::new(),
        splats: Vec::new(),
        thinning: [1.0; 2],
        work: Work::default(),
        room_taken: 0.0,
        more_light_paths: 1.0,
        iterations: 1.0,
    }
}

/// Samples of some techniques, and light sub-paths, relative to those of the plan.
pub(in crate::auto) fn planned(paths: u32) -> Plan {
    Plan {
        techniques: TechniqueSet::ALL,
        light_paths: paths,
        beam_paths: paths,
        camera_factor: 1.0,
        roulette: OF_PILOT,
        periods: MergePeriods::ONE,
        ..plan()
    }
}

fn counts<const N: usize>(relative: [(Technique, f64); N], paths: f64) -> Counts {
    let mut counts = Counts {
        relative: [0.0; Technique::COUNT],
        paths: [paths; 2],
        active: [1.0; Technique::COUNT],
        camera_factor: 1.0,
        roulette: PILOT,
        light_paths: 1.0,
    };
    for (technique, number) in relative {
        counts.relative[technique as usize] = number;
    }
    counts
}

/// Weights on a path that only one technique finds.
fn only(technique: Technique) -> PerTechnique<f32> {
    let mut weights = [0.0; Technique::COUNT];
    weights[technique as usize] = 1.0;
    weights
}

pub(in crate::auto) fn pilot() -> PilotRender {
    pilot_of(Technique::Connect)
}

fn quadrature(f: impl Fn(f64) -> f64) -> f64 {
    let n = 100_000;
    (0..n).map(|i| f((f64::from(i) + 0.5) / f64::from(n))).sum::<f64>() / f64::from(n)
}

/// A connection through a hundred mean free paths has no value worth mentioning, and no other technique has a
/// part in its weight that could be told from none: plans without connections are as good as before.
#[test]
fn light_that_is_hardly_there_excludes_no_plan() {
    let (mut faint, mut unique) = (pilot(), pilot());
    let connection = |of_hits| {
        let mut densities = upbp_estimators::mis::ByTechnique { of: [0.0; Technique::COUNT] };
        densities.of[Technique::Connect as usize] = 1.0;
        densities.of[Technique::Hit as usize] = of_hits;
        let (technique, value) = (Technique::Connect, Vec3::splat(1e-41));
        Sample { technique, light_path: None, albedos: 1.0, value, weights: mis_weights(&densities) }
    };
    for (pilot, of_hits) in [(&mut faint, 1e-41), (&mut unique, 0.0)] {
        pilot.samples.push(connection(of_hits));
        *pilot.ends.last_mut().unwrap() += 1;
        pilot.splats = vec![(0, Sample { technique: Technique::LightTracing, ..connection(of_hits) })];
    }
    let hits = counts([(Technique::Hit, 1.0)], 1.0);
    let variance = |pilot| Variance::of(pilot).with(&hits).iter().sum::<f64>();
    let (found, expected) = (variance(faint), variance(pilot()));
    assert!((found / expected - 1.0).abs() < 1e-6, "{found}, expected {expected}");
    assert!(variance(unique).is_infinite());
}

/// A number for each place of the unit interval.
type Function<'a> = &'a dyn Fn(f64) -> f64;

#[test]
fn variances_are_those_of_the_estimators() {
    let f = |x: f64| 3.0 * x * x;
    // The picture is 1 everywhere.
    let relative = 1.0 / (1.0 + DARKNESS);
    for other in [Technique::Connect, Technique::Surf] {
        let prediction = Variance::of(pilot_of(other));
        for [hits, others, camera_factor] in
            [[1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, 1.0, 4.0], [1.0, 0.0, 4.0]]
        {
            let counts = Counts { camera_factor, ..counts([(Technique::Hit, hits), (other, others)], 1.0) };
            let factor = if other == Technique::Surf { 1.0 } else { camera_factor };
            // n samples of a technique have the variance ∫ (w f)² / (n p) − (∫ w f)² / n, where w is the part
            // of c n p in a sum, c the factor of the technique.
            let part = |n: f64, c: f64, p: Function<'_>, sum: Function<'_>| {
                if n == 0.0 {
                    return 0.0;
                }
                let contribution = |x: f64| c * f(x) / sum(x);
                let mean = quadrature(|x| n * p(x) * contribution(x));
                quadrature(|x| n * p(x) * contribution(x).powi(2)) - mean * mean / n
            };
            let sum = |x: f64| camera_factor * hits + factor * others * 2.0 * x;
            let expected = relative
                * (part(hits, camera_factor, &|_| 1.0, &sum) + part(others, factor, &|x| 2.0 * x, &sum));
            let found: f64 = prediction.with(&counts).iter().sum();
            assert!(
                (found / expected - 1.0).abs() < 0.1,
                "{other:?}, {hits}, {others}, {camera_factor}: {found}, expected {expected}"
            );
        }
    }
}

/// Photons of one light sub-path that are merged together share its error; those of different ones do not.
#[test]
fn variances_know_which_photons_are_of_one_light_sub_path() {
    const PLANNED: f64 = 16_000.0;
    const TRACED: usize = 8000;
    const PHOTONS: usize = 3;
    /// Light sub-paths for each one that comes by.
    const RARE: f64 = 400.0;
    let cells = (SIDE * SIDE) as usize;
    let weights = only(Technique::Pb2d);
    let value = Vec3::splat((RARE / (TRACED * PHOTONS) as f64) as f32);
    let (mut samples, mut ends, mut drawn) = (Vec::new(), Vec::new(), 0);
    for _ in 0..cells * PASSES as usize {
        let mut path = 0.0;
        loop {
            path += 1.0 + (uniform(drawn, 2).ln() / (1.0 - 1.0 / RARE).ln()).floor();
            drawn += 1;
            if path > TRACED as f64 {
                break;
            }
            let light_path = Some(path as u32);
            samples.extend(
                [Sample { technique: Technique::Pb2d, light_path, albedos: 1.0, value, weights }; PHOTONS],
            );
        }
        ends.push(samples.len() as u32);
    }
    let pilot = PilotRender {
        samples,
        ends,
        thinning: [TRACED as f64 / PLANNED; 2],
        plan: planned(PLANNED as u32),
        ..pilot()
    };
    let prediction = Variance::of(pilot);
    for paths in [0.25, 1.0, 4.0] {
        let found: f64 = prediction
            .with(&Counts { light_paths: paths * PLANNED, ..counts([(Technique::Pb2d, paths)], paths) })
            .iter()
            .sum();
        let expected = (RARE - 1.0) / (paths * PLANNED) / (1.0 + DARKNESS);
        assert!((found / expected - 1.0).abs() < 0.1, "{paths}: {found}, expected {expected}");
    }
}

/// Where a pilot render has few photons, groups of cells vary by more than what they are to tell, also below
/// nothing. What is too little is so in the sum.
#[test]
fn the_variance_of_noisy_groups_is_that_of_their_sum() {
    let of_groups = |mean_pairs: f64| {
        let moments = |i: usize| {
            let noise = if i.is_multiple_of(2) { 0.5 } else { -0.5 };
            let pairs = mean_pairs + noise;
            Moments { single: 0.2, light: 0.2, pairs, mean_square: 0.1 }
        };
        variances(&std::array::from_fn(moments), 2.0)
    };
    let sum = |mean_pairs| of_groups(mean_pairs).iter().sum::<f64>() / GROUPS as f64;
    // More than the least, 0.2 − 0.1/2.
    assert!((sum(0.3) - 0.4).abs() < 1e-12);
    assert!((sum(0.06) - 0.16).abs() < 1e-12);
    for too_little in [0.04, -0.2] {
        assert!((sum(too_little) - 0.15).abs() < 1e-12);
        let [a, b, ..] = of_groups(too_little);
        assert!((a - b - 1.0).abs() < 1e-12, "the noise stays to be seen");
    }
}

/// All cells of a pilot render meet the same light sub-paths, so that cells do not tell how much what they
/// find depends on these.
#[test]
fn the_spread_of_groups_knows_that_cells_share_light_sub_paths() {
    const PATHS: u32 = 256;
    const PILOTS: u32 = 200;
    const CELLS: u32 = 50;
    let weights = only(Technique::Bb1d);
    let (mut sums, mut errors) = (Vec::new(), 0.0);
    for number in 0..PILOTS {
        let mut pilot = PilotRender { plan: planned(1000), ..pilot() };
        for path in 0..PATHS {
            // Some are brighter than others.
            let value = Vec3::splat((-uniform(path as usize, number).ln()).sqrt() as f32);
            let sample =
                Sample { technique: Technique::Bb1d, light_path: Some(path), albedos: 1.0, value, weights };
            pilot.pairs.extend((0..CELLS).map(|cell| PixelPair {
                cell: 300 * cell + path,
                path,
                weight: 1.0,
                samples: [vec![sample], vec![sample]],
            }));
        }
        let plan = Plan { techniques: TechniqueSet::VOLUME_MERGES, ..planned(1000) };
        let prediction = Variance::of(pilot);
        let [pixels, all] = [prediction.relative(&plan), prediction.over_scales(&plan)];
        let of_pairs: [f64; GROUPS] = std::array::from_fn(|group| all[group] - pixels[group]);
        let n = GROUPS as f64;
        let sum: f64 = of_pairs.iter().sum();
        errors += n / (n - 1.0) * of_pairs.iter().map(|part| (part - sum / n).powi(2)).sum::<f64>();
        sums.push(sum);
    }
    let n = f64::from(PILOTS);
    let mean = sums.iter().sum::<f64>() / n;
    let variance = sums.iter().map(|sum| (sum - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let ratio = errors / n / variance;
    println!("{mean} +- {}, variances told over true ones {ratio}", variance.sqrt());
    assert!((0.7..1.4).contains(&ratio), "variances told over true ones: {ratio}");
}

/// A pilot render that has few photons, and by chance of as much from pass to pass as if they did not vary,
/// does not make them vary less than independent ones.
#[test]
fn photons_vary_at_least_as_independent_ones_do() {
    const PLANNED: f64 = 1000.0;
    const TRACED: f64 = 10.0;
    let weights = only(Technique::Bb1d);
    let photon =
        Sample { technique: Technique::Bb1d, light_path: Some(0), albedos: 1.0, value: Vec3::ONE, weights };
    let camera_paths = (SIDE * SIDE * PASSES) as usize;
    let pilot = PilotRender {
        samples: vec![photon; camera_paths],
        ends: (1..=camera_paths as u32).collect(),
        thinning: [TRACED / PLANNED; 2],
        plan: planned(PLANNED as u32),
        ..pilot()
    };
    let prediction = Variance::of(pilot);
    for paths in [0.25, 1.0] {
        let found: f64 = prediction
            .with(&Counts { light_paths: paths * PLANNED, ..counts([(Technique::Bb1d, paths)], paths) })
            .iter()
            .sum();
        // So many light sub-paths, each of which comes by with probability 1 / TRACED.
        let expected = (TRACED - 1.0) / (paths * PLANNED) / (1.0 + DARKNESS);
        assert!((found / expected - 1.0).abs() < 1e-3, "{paths}: {found}, expected {expected}");
    }
}

/// A vertex that always finds 1, and past an albedo of 0.3 another that finds as much.
#[test]
fn variances_know_where_walks_end() {
    const ALBEDO: f32 = 0.3;
    let reached = OF_PILOT.survival(ALBEDO);
    let weights = only(Technique::Hit);
    let (mut samples, mut ends) = (Vec::new(), Vec::new());
    for i in 0..(SIDE * SIDE * PASSES) as usize {
        let mut find = |albedos, value| {
            let value = Vec3::splat(value);
            samples.push(Sample { technique: Technique::Hit, light_path: None, albedos, value, weights });
        };
        find(1.0, 1.0);
        if uniform(i, 4) < f64::from(reached) {
            find(ALBEDO, 1.0 / reached);
        }
        ends.push(samples.len() as u32);
    }
    let prediction = Variance::of(PilotRender { samples, ends, ..pilot() });
    for roulette in 0..COUNT {
        let counts = Counts { roulette, ..counts([(Technique::Hit, 1.0)], 1.0) };
        let found: f64 = prediction.with(&counts).iter().sum();
        let reach = f64::from(roulette::all()[roulette].survival(ALBEDO));
        let squares = 1.0 + 1.0 / reach;
        let expected = (1.0 / reach - 1.0).max(LEAST_PART * squares) / (4.0 * (1.0 + DARKNESS));
        assert!((found / expected - 1.0).abs() < 0.1, "{roulette}: {found}, expected {expected}");
    }
}

#[test]
fn a_plan_that_cannot_find_what_was_seen_is_out_of_the_question() {
    let mut pilot = pilot();
    for sample in &mut pilot.samples {
        if sample.technique == Technique::Connect {
            sample.weights = only(Technique::Connect);
        }
    }
    let prediction = Variance::of(pilot);
    let counts = counts([(Technique::Hit, 1.0)], 1.0);
    assert!(prediction.with(&counts).iter().sum::<f64>().is_infinite());
}

/// Variances by light tracing with some numbers of light sub-paths, from a splat in each cell. Of `rare` ones
/// one of ten is light tracing's own, the others are of techniques that the plan does not have.
fn by_splats(rare: u32, together: bool) -> impl Fn(u32) -> f64 {
    let mut pilot = PilotRender { samples: Vec::new(), ends: vec![0; 2 * (SIDE * SIDE) as usize], ..pilot() };
    let splat = |cell| {
        let own = if cell < rare { 0.1 } else { 1.0 };
        let mut weights = [0.0; Technique::COUNT];
        weights[Technique::LightTracing as usize] = own;
        weights[Technique::Bb1d as usize] = 1.0 - own;
        Sample {
            technique: Technique::LightTracing,
            light_path: Some(if together && cell < rare { 0 } else { cell }),
            albedos: 1.0,
            value: Vec3::ONE,
            weights,
        }
    };
    pilot.splats = (0..SIDE * SIDE).map(|cell| (cell, splat(cell))).collect();
    pilot.plan = planned(16);
    let variance = Variance::of(pilot);
    move |light_paths| {
        let techniques = TechniqueSet::only(Technique::LightTracing);
        variance.over_scales(&Plan { techniques, light_paths, ..planned(16) }).iter().sum::<f64>()
    }
}

#[test]
fn rare_samples_are_charged_more_unless_the_plan_would_have_met_some() {
    for (rare, together, met_by_16, met_by_4) in [
        (8, false, 1.0, 1.0),
        (400, false, 40.0, 10.0),
        (SIDE * SIDE, false, 1638.4, 409.6),
        // Of one light sub-path they are one sample.
        (400, true, 1.0, 1.0),
    ] {
        let of = by_splats(rare, together);
        assert!((of(64) / of(16) - 0.25).abs() < 1e-2, "{rare}: {} {}", of(64), of(16));
        let sum = |relative: f64, met: f64| {
            let rarity = 10.0 / relative;
            let charge = ((rarity / f64::from(TRUSTED)).sqrt() - 1.0) / met;
            f64::from(SIDE * SIDE - rare) / relative + f64::from(rare) * rarity * (1.0 + charge)
        };
        let expected = sum(0.25, met_by_4) / sum(1.0, met_by_16);
        assert!((of(4) / of(16) / expected - 1.0).abs() < 1e-3, "{rare}: {} {}", of(4), of(16));
    }
}

/// A few photons of a thinned pilot render stand for hundreds of the plan: it is these whose part is limited.
#[test]
fn photons_that_are_rare_in_a_thinned_render_are_not_limited() {
    const THINNING: f64 = 0.018;
    const PHOTON: f32 = 50.0;
    const CELLS: usize = 2048;
    let sample = |technique, light_path, value| Sample {
        technique,
        light_path,
        albedos: 1.0,
        value: Vec3::splat(value),
        weights: only(technique),
    };
    let (mut samples, mut ends) = (Vec::new(), Vec::new());
    for path in 0..2 * CELLS as u32 {
        samples.push(sample(Technique::Hit, None, 1.0));
        if path % 200 == 100 {
            samples.push(sample(Technique::Pb2d, Some(path), PHOTON));
        }
        ends.push(samples.len() as u32);
    }
    let photons = (samples.len() - ends.len()) as f64 / ends.len() as f64;
    let pilot = PilotRender { samples, ends, cells: CELLS, columns: 64, thinning: [THINNING; 2], ..pilot() };
    let all = counts([(Technique::Hit, 1.0), (Technique::Pb2d, 1.0)], 1.0);
    let found = Variance::of(pilot).with(&all).iter().sum::<f64>();
    // Hits are all alike, so that photons alone vary.
    let mean = 1.0 + photons * f64::from(PHOTON);
    let expected = photons * THINNING * f64::from(PHOTON).powi(2) / (1.0 + DARKNESS * mean * mean);
    assert!((found / expected - 1.0).abs() < 0.02, "{found}, expected {expected}");
}

/// A sample under a plan.
fn weighted(sample: &Sample, counts: &Counts) -> DVec3 {
    let in_weights = |technique: Technique| {
        let of_camera = [Technique::Hit, Technique::Nee, Technique::Connect].contains(&technique);
        counts.relative[technique as usize] * if of_camera { counts.camera_factor } else { 1.0 }
    };
    let sum: f64 =
        Technique::ALL.iter().map(|t| f64::from(sample.weights[*t as usize]) * in_weights(*t)).sum();
    sample.value.as_dvec3() * in_weights(sample.technique) / sum
}

/// Pairs of merges with one light sub-path under a plan, over those of the pilot render.
fn of_one_light_path(a: &Sample, b: &Sample, thinning: [f64; 2], counts: &Counts) -> f64 {
    let beams = |sample: &Sample| matches!(sample.technique, Technique::Bp2d | Technique::Bb1d);
    let class = usize::from(beams(a) && beams(b));
    thinning[class] / counts.paths[class]
}

/// Products of all pairs, one by one.
fn products(samples: &[Sample], thinning: [f64; 2], counts: &Counts) -> f64 {
    let mut sum = 0.0;
    for (i, a) in samples.iter().enumerate() {
        for b in samples[..i].iter().chain(&samples[i + 1..]) {
            // Walks get to both as often as to the deeper one, and each weighs as if it was alone.
            let reach =
                |sample: &Sample| f64::from(relative_pass_probability(counts.roulette, sample.albedos));
            let deeper = if a.albedos < b.albedos { a } else { b };
            let mut factor = reach(deeper) / (reach(a) * reach(b));
            if a.technique == b.technique {
                factor /= counts.active[a.technique as usize];
            }
            if a.light_path.is_some() && a.light_path == b.light_path {
                factor *= of_one_light_path(a, b, thinning, counts);
            }
            sum += factor * weighted(a, counts).dot(weighted(b, counts));
        }
    }
    sum
}

fn sample() -> impl Strategy<Value = Sample> {
    let technique = proptest::sample::select(Technique::ALL.to_vec());
    let albedos = proptest::sample::select(vec![1.0_f32, 0.9, 0.6, 0.4, 0.2, 0.01]);
    (technique, 0..4_u32, albedos, prop::array::uniform3(0.0_f32..2.0), prop::array::uniform(0.01_f32..1.0))
        .prop_map(|(technique, path, albedos, value, densities): (_, _, _, _, PerTechnique<f32>)| {
            let sum: f32 = densities.iter().sum();
            Sample {
                technique,
                light_path: technique.merges().then_some(path),
                albedos,
                value: value.into(),
                weights: densities.map(|density| density / sum),
            }
        })
}

/// The mean of a block varies as its pixels do where all of them see each light sub-path that comes by.
#[test]
fn variances_of_blocks_contain_what_pixels_share() {
    const PLANNED: f64 = 16_000.0;
    const TRACED: f64 = 8000.0;
    /// Light sub-paths for each one that comes by.
    const RARE: f64 = 400.0;
    let cells = SIDE * SIDE;
    let weights = only(Technique::Bb1d);
    let value = Vec3::splat((RARE / TRACED) as f32);
    let mut pilot = PilotRender { thinning: [TRACED / PLANNED; 2], plan: planned(PLANNED as u32), ..pilot() };
    (pilot.samples, pilot.ends) = (Vec::new(), Vec::new());
    let grid = Grid::new(PixelRect { x: 0, y: 0, width: 4 * SIDE, height: 4 * SIDE }, cells);
    for camera_path in 0..cells * PASSES {
        // As many as come by on average.
        let found = (TRACED / RARE) as u32;
        let seen = (0..found).map(|path| {
            let light_path = Some(camera_path * found + path);
            Sample { technique: Technique::Bb1d, light_path, albedos: 1.0, value, weights }
        });
        pilot.samples.extend(seen.clone());
        pilot.ends.push(pilot.samples.len() as u32);
        if camera_path.is_multiple_of(PASSES)
            && let Some((_, weight)) = grid.partner(camera_path / PASSES)
        {
            let pair = |sample: Sample| PixelPair {
                cell: camera_path / PASSES,
                path: sample.light_path.unwrap_or(0),
                weight,
                samples: [vec![sample], vec![sample]],
            };
            pilot.pairs.extend(seen.map(pair));
        }
    }
    let prediction = Variance::of(pilot);
    for paths in [1, 4] {
        let plan = Plan { techniques: TechniqueSet::VOLUME_MERGES, ..planned(paths * PLANNED as u32) };
        let [pixels, all] = [prediction.relative(&plan), prediction.over_scales(&plan)];
        let found = all.iter().sum::<f64>() - pixels.iter().sum::<f64>();
        // Other pixels of a block than the own one, mean over blocks of 1, 4, 8 and 16 pixels a side.
        let expected =
            (0.0 + 15.0 + 63.0 + 255.0) / 4.0 * RARE / (f64::from(paths) * PLANNED) / (1.0 + DARKNESS);
        assert!((found / expected - 1.0).abs() < 0.02, "{paths}: {found}, expected {expected}");
    }
}

proptest! {
    #[test]
    fn what_pixels_share_is_what_it_is_one_by_one(
        own in prop::collection::vec(sample(), 0..8),
        other in prop::collection::vec(sample(), 0..8),
        paths in prop::array::uniform2(0.25_f64..4.0),
        periodic in prop::array::uniform(proptest::bool::ANY),
        thinning in prop::array::uniform2(0.1_f64..1.0),
        camera_factor in 0.5_f64..16.0,
        weight in 0.1_f64..100.0,
    ) {
        let periodic: PerTechnique<bool> = periodic;
        let active: PerTechnique<f64> = std::array::from_fn(|i| if periodic[i] { 0.25 } else { 1.0 });
        let counts =
            Counts { relative: active.map(|p| 0.5 + p), paths, active, camera_factor, ..counts([], 1.0) };
        let mut expected = 0.0;
        for a in &own {
            for b in &other {
                let factor = of_one_light_path(a, b, thinning, &counts);
                expected += weight * factor * weighted(a, &counts).dot(weighted(b, &counts));
            }
        }
        let pilot = PilotRender { thinning, samples: Vec::new(), ends: Vec::new(), cells: 0, ..pilot() };
        let ready = ReadySamples::new(&pilot);
        let pair = PixelPair { cell: 0, path: 0, weight, samples: [own, other] };
        let found = Reweighted::new(&pilot, &ready, &counts).pair_product(&pair);
        prop_assert!((found - expected).abs() <= 1e-4 * expected.abs().max(1e-3), "{found}, expected {expected}");
    }

    #[test]
    fn moments_together_are_those_of_single_samples_and_of_pairs(
        mut samples in prop::collection::vec(sample(), 0..24),
        thinning in prop::array::uniform2(0.01_f64..1.0),
    ) {
        samples.retain(|sample| sample.technique != Technique::LightTracing);
        for sample in &mut samples {
            sample.albedos = 1.0;
        }
        samples.sort_by_key(|sample| sample.light_path);
        // The plan of the pilot render.
        let counts = Counts { relative: [1.0; Technique::COUNT], ..counts([], 1.0) };
        let pairs = products(&samples, thinning, &counts);
        let pilot = PilotRender { cells: 1, passes: 1, ends: vec![samples.len() as u32], samples, thinning, ..pilot() };
        let single: f64 = pilot.samples.iter().map(|sample| pilot.second_moment(sample)).sum();
        let (found, expected) = (pilot.second_moment_together(0, 0), single + pairs);
        prop_assert!((found - expected).abs() <= 1e-6 * expected.max(1e-3), "{found}, expected {expected}");
    }

    #[test]
    fn pairs_are_what_they_are_one_by_one(
        mut samples in prop::collection::vec(sample(), 0..24),
        roulette in 0..COUNT,
        paths in prop::array::uniform2(0.25_f64..4.0),
        periodic in prop::array::uniform(proptest::bool::ANY),
        thinning in prop::array::uniform2(0.1_f64..1.0),
        camera_factor in 0.5_f64..16.0,
    ) {
        let periodic: PerTechnique<bool> = periodic;
        samples.sort_by_key(|sample| sample.light_path);
        let active: PerTechnique<f64> = std::array::from_fn(|i| {
            if periodic[i] && Technique::ALL[i].merges() { 0.25 } else { 1.0 }
        });
        let relative = active.map(|p| 0.5 + p);
        let counts = Counts { relative, paths, active, camera_factor, roulette, ..counts([], 1.0) };
        let expected = products(&samples, thinning, &counts);
        let pilot = PilotRender { cells: 1, passes: 1, ends: vec![samples.len() as u32], samples, thinning, ..pilot() };
        let ready = ReadySamples::new(&pilot);
        let found = Reweighted::new(&pilot, &ready, &counts).moments(0).products;
        prop_assert!((found - expected).abs() <= 1e-4 * expected.abs().max(1e-3), "{found}, expected {expected}");
    }
}
