use upbp_estimators::{Stream, StreamKind};

use super::*;

const SIDE: usize = 64;
const SEEDS: u64 = 20;

/// Random numbers, uniform in (0, 1].
struct Uniform(Stream);

impl Uniform {
    fn new(seed: u64) -> Self {
        Self(Stream::new(seed, 0, StreamKind::MergePeriods, 0))
    }

    fn next(&mut self) -> f64 {
        1.0 - f64::from(self.0.uniform())
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * self.next().ln()).sqrt() * (std::f64::consts::TAU * self.next()).cos()
    }
}

/// The converged value of a pixel: a ramp, an edge, and a dark part.
fn scene(x: usize, y: usize) -> f64 {
    match (x, y) {
        (0..20, _) => 0.05,
        (_, 0..30) => 0.2 + 0.01 * x as f64,
        _ => 2.0,
    }
}

/// Two halves of 16 iterations, each the mean of `sample(random, converged)`.
fn render(seed: u64, mut sample: impl FnMut(&mut Uniform, f64) -> f64) -> [Vec<[f32; 3]>; 2] {
    let mut random = Uniform::new(seed);
    [0, 1].map(|_| {
        let pixels = (0..SIDE * SIDE).map(|i| scene(i % SIDE, i / SIDE));
        pixels
            .map(|r| {
                std::array::from_fn(|_| {
                    ((0..16).map(|_| sample(&mut random, r)).sum::<f64>() / 16.0).max(0.0) as f32
                })
            })
            .collect()
    })
}

/// A half that sees no light directly.
fn half(image: &[[f32; 3]], iterations: u64) -> HalfImage<'_> {
    static BLACK: [[f32; 3]; 1 << 16] = [[0.0; 3]; 1 << 16];
    HalfImage { image, seen: &BLACK[..image.len()], iterations }
}

fn halves(images: &[Vec<[f32; 3]>; 2]) -> [HalfImage<'_>; 2] {
    images.each_ref().map(|image| half(image, 16))
}

fn truth(images: &[Vec<[f32; 3]>; 2]) -> f64 {
    let error = |i: usize| {
        let r = scene(i % SIDE, i / SIDE);
        let term = |c: usize| {
            let x = 0.5 * (f64::from(images[0][i][c]) + f64::from(images[1][i][c]));
            (x - r).powi(2) / (r * r + 0.01)
        };
        term(0) + term(1) + term(2)
    };
    (0..SIDE * SIDE).map(error).sum::<f64>() / (3 * SIDE * SIDE) as f64
}

/// Estimates with the true errors, in the order of the ratio.
fn estimates(sample: impl Fn(&mut Uniform, f64) -> f64) -> Vec<(ErrorEstimate, f64)> {
    let estimate = |seed| {
        let images = render(seed, &sample);
        (ErrorMap::new(SIDE, halves(&images)).estimate(), truth(&images))
    };
    let mut estimates: Vec<_> = (0..SEEDS).map(estimate).collect();
    estimates.sort_by(|a, b| ratio(a).total_cmp(&ratio(b)));
    estimates
}

fn ratio((found, truth): &(ErrorEstimate, f64)) -> f64 {
    found.relative_mse / truth
}

#[test]
fn normal_noise_is_estimated_well() {
    for relative in [0.1, 1.0] {
        let estimates = estimates(|random, r| r * (1.0 + relative * random.normal()));
        assert!(ratio(&estimates[0]) > 0.9 && ratio(&estimates[19]) < 1.1, "{estimates:?}");
        assert!(estimates.iter().all(|(found, truth)| (found.low..=found.high).contains(truth)));
    }
}

#[test]
fn rare_bright_samples_do_not_excuse_themselves() {
    // One sample in three hundred carries all light of the dark and of the middle, so that most
    // pixels of a half are black.
    let rare = |random: &mut Uniform, r: f64| {
        if r > 1.0 {
            r
        } else if random.next() < 1.0 / 300.0 {
            300.0 * r
        } else {
            0.0
        }
    };
    let estimates = estimates(rare);
    assert!((0.8..1.25).contains(&ratio(&estimates[10])), "{estimates:?}");
    assert!(ratio(&estimates[0]) > 0.5 && ratio(&estimates[19]) < 2.0, "{estimates:?}");
    assert!(estimates.iter().all(|(found, truth)| *truth <= found.high), "{estimates:?}");
}

#[test]
fn tails_without_a_mean_of_errors_are_told_from_others() {
    // Pareto samples with mean r and tail index 1/α: errors are their squares.
    let pareto = |alpha: f64| {
        move |random: &mut Uniform, r: f64| r * (alpha - 1.0) / alpha * random.next().powf(-1.0 / alpha)
    };
    for (alpha, heavy) in [(1.3, true), (4.0, false)] {
        for seed in 0..SEEDS {
            let images = render(seed, pareto(alpha));
            let found = ErrorMap::new(SIDE, halves(&images)).estimate();
            assert_eq!(found.doubt, heavy.then_some(Doubt::HeavyTail), "{alpha} {found:?}");
            assert_eq!(found.high.is_infinite(), heavy);
            assert!(!found.reached(1e3) || !heavy);
        }
    }
}

#[test]
fn the_size_of_what_is_in_the_picture_says_nothing_about_the_tail() {
    const WIDTH: usize = 200;
    let estimate = |seed, part: f64, fireflies: usize| {
        let mut random = Uniform::new(seed);
        let radius = part.sqrt() * 0.5 * WIDTH as f64 / std::f64::consts::FRAC_PI_4.sqrt();
        let mut images = [0, 1].map(|_| vec![[0.0; 3]; WIDTH * WIDTH]);
        for image in &mut images {
            for (i, pixel) in image.iter_mut().enumerate() {
                let place = [i % WIDTH, i / WIDTH].map(|k| k as f64 - 0.5 * WIDTH as f64);
                if place[0].hypot(place[1]) < radius {
                    *pixel = [(1.0 + 0.01 * random.normal()) as f32; 3];
                }
            }
        }
        for n in 0..fireflies {
            let place = (random.next() * (WIDTH * WIDTH - 1) as f64) as usize;
            images[n % 2][place] = [3.0; 3];
        }
        ErrorMap::new(WIDTH, halves(&images)).estimate()
    };
    for seed in 0..SEEDS {
        for part in [0.001, 0.005, 0.01, 0.02, 0.5] {
            let alone = estimate(seed, part, 0);
            assert!(alone.doubt.is_none() && alone.high < 2.0 * alone.relative_mse, "{part}: {alone:?}");
        }
        for part in [0.0, 0.01] {
            let rare = estimate(seed, part, 20);
            assert_eq!(rare.doubt, Some(Doubt::HeavyTail), "{part}: {rare:?}");
        }
    }
}

#[test]
fn hill_finds_the_index() {
    for index in [0.25, 0.5, 1.0, 2.0_f64] {
        let mut random = Uniform::new(3);
        let mut errors: Vec<f32> = (0..100_000).map(|_| random.next().powf(-index) as f32).collect();
        // A thousand values in the tail: a standard error of 3 %.
        assert!((tail_index(&mut errors) / index - 1.0).abs() < 0.1, "{index}");
    }
    assert_eq!(tail_index(&mut [0.0; 100]), 0.0);
    let mut lone = vec![0.0; 1000];
    lone[500] = 1.0;
    assert!(tail_index(&mut lone).is_infinite());
}

#[test]
fn a_light_that_is_seen_is_no_outlier() {
    // A light much smaller than a pixel, met by one of the 32 iterations.
    let mut images = render(1, |random, r| r * (1.0 + random.normal()));
    let seen: [Vec<[f32; 3]>; 2] = [0.0, 50.0].map(|value: f32| {
        let mut seen = vec![[0.0; 3]; SIDE * SIDE];
        seen[10 * SIDE + 10] = [value; 3];
        seen
    });
    let without = ErrorMap::new(SIDE, halves(&images)).estimate().relative_mse;
    for (image, seen) in images.iter_mut().zip(&seen) {
        image[10 * SIDE + 10][0] += seen[10 * SIDE + 10][0];
    }
    let told = [0, 1].map(|h| HalfImage { image: &images[h], seen: &seen[h], iterations: 16 });
    let [known, unknown] = [told, halves(&images)].map(|h| ErrorMap::new(SIDE, h).estimate().relative_mse);
    assert!(known < without + 1.5 / (3 * SIDE * SIDE) as f64 && known > without, "{known} {without}");
    assert!(unknown > 10.0 * without);
    // One half only has seen it: that it was luck is not excluded.
    let high = ErrorMap::new(SIDE, told).estimate().high;
    assert!(high > unknown, "{high} {unknown}");
}

#[test]
fn photons_that_neighbours_share_do_not_excuse_themselves() {
    // Blotches of 7 × 7 pixels, as wide as a kernel, that the other half does not have.
    let images = [0, 1].map(|half| {
        let mut random = Uniform::new(half + 10);
        let mut image = vec![[0.0_f64; 3]; SIDE * SIDE];
        for _ in 0..100 {
            let [x, y] = [0, 1].map(|_| (random.next() * (SIDE - 7) as f64) as usize);
            for i in 0..49 {
                image[(y + i / 7) * SIDE + x + i % 7].iter_mut().for_each(|v| *v += 1.0);
            }
        }
        image.into_iter().map(|pixel| pixel.map(|v| v as f32)).collect::<Vec<_>>()
    });
    // Away from the borders the mean is that of a Poisson process.
    let mean = 100.0 * 49.0 / ((SIDE - 6) * (SIDE - 6)) as f64;
    let map = ErrorMap::new(SIDE, halves(&images));
    let (mut found, mut truth) = (0.0, 0.0);
    for y in 8..SIDE - 8 {
        for x in 8..SIDE - 8 {
            let i = y * SIDE + x;
            let value = 0.5 * f64::from(images[0][i][0] + images[1][i][0]);
            found += f64::from(map.relative[i][0]);
            truth += (value - mean).powi(2) / (mean * mean + 0.01);
        }
    }
    assert!((0.67..1.5).contains(&(found / truth)), "{}", found / truth);
}

/// Two halves of unit light with normal noise, of which each pixel sums a square of `reach` × `reach`
/// numbers, and the true error of their mean.
fn blotches(seed: u64, reach: usize) -> ([Vec<[f32; 3]>; 2], f64) {
    let mut random = Uniform::new(seed);
    let wide = SIDE + reach - 1;
    let half = |random: &mut Uniform| -> Vec<[f32; 3]> {
        let numbers: Vec<f64> = (0..wide * wide).map(|_| random.normal()).collect();
        let sum_at = |i: usize| -> f64 {
            let rows = i / SIDE..i / SIDE + reach;
            rows.flat_map(|y| &numbers[y * wide + i % SIDE..][..reach]).sum()
        };
        (0..SIDE * SIDE).map(|i| [(1.0 + 0.1 * sum_at(i) / reach as f64) as f32; 3]).collect()
    };
    let halves = [half(&mut random), half(&mut random)];
    let error = |(a, b): (&[f32; 3], &[f32; 3])| (0.5 * f64::from(a[0] + b[0]) - 1.0).powi(2) / 1.01;
    let truth = halves[0].iter().zip(&halves[1]).map(error).sum::<f64>() / (SIDE * SIDE) as f64;
    (halves, truth)
}

/// An estimate from normal errors that squares of k × k of n pixels share has the relative variance
/// `2 Σ c² / n ≈ 2 (2k/3)² / n`, with correlations c, and so has the true error, which is independent of it.
/// An interval of `2 √(3 ρ / n)`, `ρ ≤ Σ c = k²`, is 2.6 standard deviations of their ratio to each side.
/// By S alone, with ρ = 1 and 0.1 for the converged values, it would be 1.05 for k = 7 and 0.7 for k = 11.
#[test]
fn what_neighbours_share_makes_the_interval_wider() {
    for reach in [1, 3, 7, 11] {
        let outside = (0..SEEDS)
            .filter(|seed| {
                let (images, truth) = blotches(*seed, reach);
                let found = ErrorMap::new(SIDE, halves(&images)).estimate();
                assert_eq!(found.doubt, None);
                !(found.low..=found.high).contains(&truth)
            })
            .count();
        assert!(outside <= 1, "{outside} of {SEEDS} intervals are wrong with blotches of {reach} pixels");
    }
}

/// The sharing of independent errors is one, however few pixels make them. That of normal errors of squares
/// of k × k pixels is `Σ c = (k − (k² − 1)/48)²` within blocks, less twice the `√(2 / blocks)` by chance.
#[test]
fn sharing_is_the_number_of_pixels_that_share_an_error() {
    let sharing = |images: &[Vec<[f32; 3]>; 2]| ErrorMap::new(SIDE, halves(images)).sharing;
    let rare = |random: &mut Uniform, r| if random.next() < 0.01 { 100.0 * r } else { 0.0 };
    for seed in 0..SEEDS {
        let independent = sharing(&render(seed, |random, r| r * (1.0 + random.normal())));
        assert_eq!([independent, sharing(&render(seed, rare))], [1.0; 2]);
    }
    let blocks = (SIDE / SHARING).pow(2) as f64;
    let chance = (2.0 / blocks).sqrt();
    for reach in [3, 7] {
        let mean = (0..SEEDS).map(|seed| sharing(&blotches(seed, reach).0)).sum::<f64>() / SEEDS as f64;
        let within = (reach as f64 - (reach * reach - 1) as f64 / 48.0).powi(2);
        // Each block tells a square of a normal number: three standard errors.
        let error = 3.0 * within * chance / (SEEDS as f64).sqrt();
        assert!((mean - within + SIGMAS * chance).abs() < error, "{mean}, expected {within} ± {error}");
    }
}

#[test]
fn what_cannot_be_told_is_not_told() {
    let image = vec![[1.0_f32, 0.5, 0.0]; 12];
    let other = vec![[0.5_f32; 3]; 12];
    let black = vec![[0.0_f32; 3]; 12];
    let estimate = |a: &[[f32; 3]], b: &[[f32; 3]], iterations: [u64; 2]| {
        ErrorMap::new(4, [half(a, iterations[0]), half(b, iterations[1])]).estimate()
    };
    assert_eq!(estimate(&image, &other, [3, 3]).doubt, Some(Doubt::FewIterations));
    assert_eq!(estimate(&black, &black, [90, 90]).doubt, Some(Doubt::Black));
    for damage in [f32::NAN, f32::INFINITY] {
        let damaged: Vec<_> =
            image.iter().enumerate().map(|(i, p)| if i == 5 { [damage; 3] } else { *p }).collect();
        let halves = [&image, &damaged].map(|image| half(image, 9));
        let doubt = ErrorMap::new(4, halves).estimate().doubt;
        assert_eq!(doubt, Some(Doubt::NotANumber), "{damage}");
    }
    let same = estimate(&image, &image, [4, 4]);
    assert_eq!((same.low, same.relative_mse, same.high, same.doubt), (0.0, 0.0, 0.0, None));
    assert!(ErrorMap::new(0, [half(&[], 9); 2]).estimate().high.is_infinite());
}

#[test]
fn unequal_halves_count_by_their_iterations() {
    // Variance of the mean of n and m iterations: σ² / (n + m), of which (a − b)² n m / (n + m)² is
    // the mean.
    let mut random = Uniform::new(5);
    let (mut sum, count) = (0.0, 20_000);
    for _ in 0..count {
        let [a, b] = [12.0, 4.0].map(|n: f64| [(100.0 + random.normal() / n.sqrt()) as f32; 3]);
        sum += Pair::new(1, [half(&[a], 12), half(&[b], 4)]).noise(0)[0];
    }
    assert!((sum / f64::from(count) * 16.0 - 1.0).abs() < 0.05);
}

#[test]
fn rules_ask_seldom() {
    let due: Vec<u64> = (0..70).filter(|n| ErrorEstimate::is_due(*n)).collect();
    assert_eq!(due, [8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 56, 64]);
    assert!(ErrorEstimate::is_due(7 << 40) && !ErrorEstimate::is_due((7 << 40) + 1));
}

proptest::proptest! {
    #[test]
    fn any_image_has_an_estimate(
        pixels in proptest::collection::vec(proptest::array::uniform6(0.0..f32::MAX), 0..400),
        exponent in 0..38_i32,
        width in 1..30_usize,
    ) {
        let rows = pixels.len() / width;
        let scale = 10_f32.powi(-exponent);
        let image = |from: usize| -> Vec<[f32; 3]> {
            pixels[..rows * width].iter().map(|p| [0, 1, 2].map(|c| p[from + c] * scale)).collect()
        };
        let images = [image(0), image(3)];
        let map = ErrorMap::new(width, halves(&images));
        proptest::prop_assert!(map.relative.iter().flatten().all(|t| *t >= 0.0));
        let found = map.estimate();
        proptest::prop_assert!(found.low <= found.relative_mse && found.relative_mse <= found.high, "{:?}", found);
        // The same on one thread, to the last bit.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        proptest::prop_assert_eq!(pool.install(|| ErrorMap::new(width, halves(&images))), map);
    }
}
