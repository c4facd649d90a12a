//! Phase functions that differ between the channels.

use super::*;

fn coloured() -> [PhaseFunction; 3] {
    [henyey_greenstein(0.95), haze(), henyey_greenstein(-0.5)]
}

#[test]
fn each_channel_is_its_own_function_and_the_density_is_their_mean() {
    let mut random = Random(31);
    let phase = PhaseFunction::per_channel(coloured());
    for _ in 0..1000 {
        let (before, after) = (random.direction(), random.direction());
        let found = phase.eval(before, after);
        let channels = coloured().map(|phase| phase.eval(before, after).pdf);
        assert_eq!(found.value, Spectrum::from_array(channels));
        assert!((found.pdf / (channels.iter().sum::<f32>() / 3.0) - 1.0).abs() < 1e-6);
        assert_eq!(found, phase.eval(after, before));
    }
    assert_eq!(phase.mean_cosine(), coloured().map(|phase| phase.mean_cosine().r()).into());
}

#[test]
fn weights_are_bounded_and_average_to_one() {
    let mut random = Random(32);
    let blend =
        PhaseFunction::blend(vec![(1.0, PhaseFunction::per_channel(coloured())), (2.0, haze())]).unwrap();
    for phase in [PhaseFunction::per_channel(coloured()), blend] {
        const SAMPLES: usize = 200_000;
        let (mut sum, mut squares) = (Spectrum::ZERO, Spectrum::ZERO);
        for _ in 0..SAMPLES {
            let before = random.direction();
            let sample = phase.sample::<f64>(before, (), &(), [random.uniform(), random.uniform()]);
            assert!(sample.weight.is_non_negative() && sample.weight.max_component() <= 3.000_001);
            assert!((sample.weight.mean() - 1.0).abs() < 1e-5);
            sum += sample.weight;
            squares += sample.weight * sample.weight;
        }
        let n = SAMPLES as f32;
        for channel in 0..3 {
            let mean = sum[channel] / n;
            let error = ((squares[channel] / n - mean * mean) / n).sqrt();
            assert!((mean - 1.0).abs() < 4.0 * error + 1e-4, "channel {channel}: {mean} ± {error}");
        }
    }
    let grey = haze().sample::<f64>(Vec3::X, (), &(), [0.3, 0.7]);
    assert_eq!(grey.weight, Spectrum::ONE);
}

#[test]
fn nested_channels_are_taken_apart() {
    let coloured = PhaseFunction::per_channel(coloured());
    let blend = PhaseFunction::blend(vec![(1.0, coloured.clone()), (1.0, PhaseFunction::Isotropic)]).unwrap();
    let nested = PhaseFunction::per_channel([blend.clone(), blend.clone(), blend.clone()]);
    assert_eq!(PhaseFunction::per_channel([coloured.clone(), coloured.clone(), coloured.clone()]), coloured);
    assert_eq!(PhaseFunction::per_channel([haze(), haze(), haze()]), haze());
    let mut random = Random(33);
    for _ in 0..100 {
        let (before, after) = (random.direction(), random.direction());
        assert_eq!(nested.eval(before, after).value, blend.eval(before, after).value);
    }
}
