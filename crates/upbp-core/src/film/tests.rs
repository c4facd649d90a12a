use super::*;

const RECT: PixelRect = PixelRect { x: 3, y: 5, width: 2, height: 1 };

fn pixel(bpt: f32, bb1d: f32) -> Pixel {
    let mut pixel = Pixel::BLACK;
    pixel.layers[Layer::Bpt as usize] = Spectrum::splat(bpt);
    pixel.layers[Layer::Bb1d as usize] = Spectrum::splat(bb1d);
    pixel
}

/// Errors that all pixels have in common grow with the pixels of blocks, independent ones do not.
#[test]
fn shared_errors_count_by_the_pixels_that_share_them() {
    let (width, height) = (320, 203);
    let image = |value: &dyn Fn(u32) -> f32| {
        let pixels = (0..width * height).map(|i| [value(i); 3]).collect();
        Image { width, height, pixels }
    };
    let flat = image(&|_| 1.0);
    let of = |image: &Image| image.relative_mse_over_scales(&flat) / image.relative_mse(&flat);
    let mixed = |i: u32| {
        let x = (i ^ (i >> 16)).wrapping_mul(0x7feb_352d);
        (x ^ (x >> 15)).wrapping_mul(0x846c_a68b)
    };
    let independent = of(&image(&|i| if mixed(i) >> 31 == 0 { 1.1 } else { 0.9 }));
    assert!((independent - 1.0).abs() < 0.1, "{independent}");
    let shared = of(&image(&|_| 1.1));
    let expected = [1.0, 4.0, 8.0, 16.0_f64].map(|side| {
        let (full, rest) = ((203.0 / side).floor() * side, 203.0 % side);
        side * (full * side + rest * rest) / 203.0
    });
    let expected = expected.iter().sum::<f64>() / 4.0;
    assert!((shared / expected - 1.0).abs() < 1e-6, "{shared}, expected {expected}");
    assert_eq!(flat.relative_mse_over_scales(&flat), 0.0);
    // The halves of a film differ in the same ways.
    let rect = PixelRect { x: 0, y: 0, width: 32, height: 32 };
    let ratio = |value: &dyn Fn(u32) -> f32| {
        let mut film = Film::new(rect, TechniqueSet::BPT, false);
        let flat: Vec<Pixel> = (0..32 * 32).map(|_| pixel(1.0, 0.0)).collect();
        film.add(0, &flat);
        let noisy: Vec<Pixel> = (0..32 * 32).map(|i| pixel(value(i), 0.0)).collect();
        film.add(1, &noisy);
        film.shared_error()
    };
    assert!((ratio(&|_| 1.1).unwrap() - (1.0 + 16.0 + 64.0 + 256.0) / 4.0).abs() < 1e-3);
    assert!(ratio(&|i| if mixed(i) >> 31 == 0 { 1.1 } else { 0.9 }).unwrap() < 2.0);
    assert_eq!(ratio(&|_| 1.0), None);
}

#[test]
fn means_and_halves_are_those_of_the_iterations() {
    let mut film = Film::new(RECT, TechniqueSet::STANDARD, false);
    assert!(film.is_empty() && film.estimated_error().relative_mse.is_infinite());
    for (i, value) in [(0, 1.0), (7, 2.0), (3, 6.0)] {
        assert_eq!(film.add(i, &[pixel(value, 1.0), pixel(0.0, 0.0)]), 0);
    }
    assert_eq!(film.iteration_set().to_string(), "0..1, 3..4, 7..8");
    assert_eq!(film.image().pixels[0], [4.0; 3]);
    assert_eq!(film.layer(Layer::Bpt).unwrap().pixels[0], [3.0; 3]);
    assert_eq!(film.layer(Layer::Bp2d), None);
    let [even, odd] = film.halves().unwrap();
    assert_eq!([even.pixels[0], odd.pixels[0]], [[2.0; 3], [5.0; 3]]);
    // Sample variance of {2, 3, 7} is 7; of their mean, a third of it.
    assert!((film.variance().pixels[0][0] - 7.0 / 3.0).abs() < 1e-6);
    assert_eq!(film.variance().pixels[1], [0.0; 3]);
    let shares = film.shares();
    assert_eq!(shares.iter().map(|(l, _)| *l).collect::<Vec<_>>(), film.layers().collect::<Vec<_>>());
    assert!((shares[0].1 - 0.75).abs() < 1e-12);
}

/// Sums of layers and of the whole are cut off at different digits: that is no light.
#[test]
fn a_half_has_no_light_that_the_other_alone_has_seen() {
    let mut film = Film::new(RECT, TechniqueSet::STANDARD, false);
    film.add(0, &[pixel(5.0, 5e-5), pixel(5.0, 5e-5)]);
    film.add(1, &[Pixel::BLACK, pixel(0.0, 1e-6)]);
    let [even, odd] = film.halves().unwrap();
    assert!(even.pixels[0].iter().all(|v| *v > 5.0));
    assert_eq!(odd.pixels[0], [0.0; 3]);
    // A little light is some.
    assert!(odd.pixels[1].iter().all(|v| (v / 1e-6 - 1.0).abs() < 1e-3), "{:?}", odd.pixels[1]);
}

#[test]
fn parts_add_up_to_the_whole() {
    let rect = PixelRect { x: 1, y: 2, width: 19, height: 17 };
    let iteration = |i: u32| -> Vec<Pixel> { (0..19 * 17).map(|p| pixel((p * i) as f32, 0.5)).collect() };
    let mut whole = Film::new(rect, TechniqueSet::STANDARD, false);
    let mut parted = whole.clone();
    for i in [4, 7] {
        whole.add(i.into(), &iteration(i));
    }
    parted.add_part(4, 0..1, &iteration(4), &[]);
    // Everything is there, coarsely.
    let coarse = parted.image();
    assert_eq!(coarse.pixels[15], [0.5; 3]);
    assert_eq!(coarse.pixels[18], [4.0 * 16.0 + 0.5; 3]);
    assert_eq!((parted.is_empty(), parted.iterations(), parted.missing(4)), (false, 0, 1..SETS));
    parted.add_part(7, 0..9, &iteration(7), &[]);
    let mut other = Film::new(rect, TechniqueSet::BPT, false);
    other.add_part(7, 0..2, &iteration(7), &[]);
    assert_eq!(parted.overlap(&other), Some(7..8));
    parted.add_part(4, 1..200, &iteration(4), &[]);
    assert!(parted.halves().is_none());
    parted.add_part(4, 200..SETS, &iteration(4), &[]);
    // Pixels with both iterations, and with one.
    assert_eq!(parted.image().pixels[16], [16.0 * 5.5 + 0.5; 3]);
    assert_eq!(parted.image().pixels[17], [17.0 * 4.0 + 0.5; 3]);
    parted.add_part(7, 9..SETS, &iteration(7), &[]);
    assert_eq!(parted, whole);
    assert_eq!(parted.overlap(&whole), Some(4..5));
}

/// A part of an iteration stays one in a merged film, and belongs to the iteration's half.
#[test]
fn parts_are_merged_into_their_halves() {
    let rect = PixelRect { x: 0, y: 0, width: 16, height: 16 };
    let iteration = |value: f32| vec![pixel(value, 0.0); 256];
    let mut film = Film::new(rect, TechniqueSet::BPT, false);
    // Two of four are in the odd half; a part of a fifth is, too.
    for (index, value) in [(1, 2.0), (3, 4.0), (5, 9.0), (6, 1.0)] {
        film.add(index, &iteration(value));
    }
    let mut part = Film::new(rect, TechniqueSet::BPT, false);
    part.add_part(9, 0..64, &iteration(25.0), &[]);
    film.merge(&part);
    assert_eq!(film.parts().iter().collect::<Vec<_>>(), [(&9, &NonZeroU8::new(64).unwrap())]);
    assert_eq!((film.iterations(), film.missing(9)), (4, 64..SETS));
    let [even, odd] = film.halves().unwrap();
    let (x, y) = (0..256).map(|i| (i % 16, i / 16)).find(|(x, y)| set_of(*x, *y) == 64).unwrap();
    // A pixel of the part, and one that the part has not reached.
    assert_eq!([even.pixels[0], odd.pixels[0]], [[1.0; 3], [10.0; 3]]);
    assert_eq!([even.pixels[16 * y + x], odd.pixels[16 * y + x]], [[1.0; 3], [5.0; 3]]);
    assert_eq!(film.sample_counts()[16 * y + x], 4.0);
    assert_eq!(film.sample_counts()[0], 5.0);
    film.add_part(9, 64..SETS, &iteration(25.0), &[]);
    assert_eq!(film.halves().unwrap()[1].pixels, vec![[10.0; 3]; 256]);
}

#[test]
fn small_additions_do_not_stall() {
    let mut film = Film::new(PixelRect { x: 0, y: 0, width: 1, height: 1 }, TechniqueSet::BPT, false);
    for i in 0..200_000 {
        film.add(i, &[pixel(0.1, 0.0)]);
    }
    assert_eq!(film.image().pixels[0][0], 0.1);
}

/// A plain sum in single precision is off by 2 %.
#[test]
fn millions_of_splats_in_one_pixel_lose_nothing() {
    let (count, value) = (4_000_000, 2.3e-7_f32);
    let mut pixel = Pixel::BLACK;
    for _ in 0..count {
        pixel.add_splat(Spectrum::splat(value));
    }
    let sum = f64::from(pixel.layers[Layer::Bpt as usize][0]);
    let expected = f64::from(count) * f64::from(value);
    assert!((sum / expected - 1.0).abs() < 1e-6, "{sum}, {expected}");
    let plain = (0..count).fold(0.0_f32, |sum, _| sum + value);
    assert!((f64::from(plain) / expected - 1.0).abs() > 0.01, "{plain}");
}

#[test]
fn what_is_no_radiance_is_left_out_and_counted() {
    let mut film = Film::new(RECT, TechniqueSet::STANDARD, false);
    assert_eq!(film.add(0, &[pixel(f32::INFINITY, 1.0), pixel(f32::NAN, -1.0)]), 9);
    assert_eq!(film.image().pixels, [[1.0; 3], [0.0; 3]]);
}

#[test]
fn a_perfect_image_has_no_error() {
    let image = Image { width: 1, height: 1, pixels: vec![[0.3, 0.0, 1.0]] };
    assert_eq!(image.relative_mse(&image), 0.0);
    let brighter = Image { pixels: vec![[0.4, 0.0, 1.0]], ..image.clone() };
    assert!((brighter.rmse(&image) - (0.01_f64 / 3.0).sqrt()).abs() < 1e-6);
}
