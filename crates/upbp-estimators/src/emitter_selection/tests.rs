use super::*;

#[test]
fn emitters_are_chosen_in_proportion_and_dark_ones_never() {
    let selection = Selection::new(&[0.0, 1.0, 0.0, 3.0, 0.0]);
    assert_eq!(selection.choose(0.0), Some((EmitterId(1), 0.25)));
    assert_eq!(selection.choose(0.249), Some((EmitterId(1), 0.25)));
    assert_eq!(selection.choose(0.25), Some((EmitterId(3), 0.75)));
    assert_eq!(selection.choose(1.0 - f64::EPSILON / 2.0), Some((EmitterId(3), 0.75)));
    assert_eq!(Selection::new(&[]).choose(0.5), None);
    assert_eq!(Selection::new(&[0.0]).choose(0.5), None);
    assert_eq!(selection.probability(EmitterId(9)), 0.0);
}

#[test]
fn shares_move_the_choice_and_a_spread_keeps_a_floor() {
    let power = Selection::new(&[0.0, 1.0, 0.0, 3.0]);
    let seen = |light: &[f64], samples| EmitterShares { light: light.to_vec(), samples };
    let probabilities = |shares| {
        let blend = power.blend(&shares);
        [0, 1, 2, 3].map(|i| blend.probability(EmitterId(i)))
    };
    // All the light comes from the weaker one, and there is no doubt about it. What is dark stays out.
    let [dark, weak, _, strong] = probabilities(seen(&[5.0, 2.0, 0.0, 0.0], 1e9));
    assert_eq!(dark, 0.0);
    assert!((weak - 0.9375).abs() < 1e-6 && (strong - 0.0625).abs() < 1e-6, "{weak}, {strong}");
    // Nothing seen, or nothing that is a number: power decides.
    for shares in [seen(&[], 1e9), seen(&[0.0; 4], 1e9), seen(&[0.0, f64::NAN, 0.0, f64::INFINITY], 1.0)] {
        assert_eq!(probabilities(shares), [0.0, 0.25, 0.0, 0.75]);
    }
    // A single sample says little: for two that shine its part is 0.9 / (1 + 2 * 2).
    let [_, weak, ..] = probabilities(seen(&[0.0, 1.0], 1.0));
    assert!((weak - (0.18 + 0.82 * 0.375)).abs() < 1e-6, "{weak}");
}

#[test]
fn probabilities_are_exact_whatever_the_ratio_of_powers() {
    let many = vec![1e-3; 100_000];
    for powers in [&[1.0, 1e-12][..], &[1e-12, 1.0], &[1e-30, 0.0, 1e30, 1e-30], &[5.0, 1e12, 3.0], &many] {
        let selection = Selection::new(powers);
        let mut counts = vec![0_u32; powers.len()];
        for step in 0..STEPS {
            let (emitter, _) = selection.choose(f64::from(step) / f64::from(STEPS)).unwrap();
            counts[emitter.0 as usize] += 1;
        }
        for (i, (&power, &count)) in powers.iter().zip(&counts).enumerate() {
            assert_eq!(power > 0.0, count > 0, "{i}");
            let probability = selection.probability(EmitterId(i as u32));
            assert_eq!(probability, count as f32 / STEPS as f32, "{i}");
        }
    }
    // The strong one gets what its power is worth, and the weak one the hundredth of an even share that some
    // corner may need.
    let [strong, weak] = [0, 1].map(|i| Selection::new(&[1.0, 1e-12]).probability(EmitterId(i)));
    assert!(strong > 0.99 && (weak / 0.005 - 1.0).abs() < 0.01, "{strong}, {weak}");
}

#[test]
fn a_choice_of_other_emitters_does_not_fit() {
    let power = Selection::new(&[0.0, 1.0, 3.0]);
    let given = |ends: &[u32]| Selection { cumulative: ends.to_vec() }.fits(&power);
    assert!(given(&[0, 1, STEPS]));
    assert!(!given(&[0, STEPS]), "fewer");
    assert!(!given(&[1, 2, STEPS]), "a dark one");
    assert!(!given(&[0, 0, STEPS]), "one left out");
    assert!(!given(&[0, 9, 5]), "not ascending");
    assert!(!given(&[0, 1, 2]), "not a whole");
}

/// Samples of two emitters that were chosen equally often.
fn shares(samples: &[(u32, f64, f64)]) -> Vec<f64> {
    let sample = |&(emitter, light, weight): &(u32, f64, f64)| {
        let others = 0.5 * (1.0 - weight) / weight;
        EmitterSample { emitter: EmitterId(emitter), light, others }
    };
    let samples: Vec<_> = samples.iter().map(sample).collect();
    let light = EmitterShares::of(vec![0.5; 2], &samples).light;
    let sum: f64 = light.iter().sum();
    light.iter().map(|l| l / sum).collect()
}

#[test]
fn emitters_that_nothing_else_finds_are_chosen_in_proportion_to_their_light() {
    let [one, other] = shares(&[(0, 1.0, 1.0), (0, 2.0, 1.0), (1, 9.0, 1.0)])[..] else { unreachable!() };
    assert!((one - 0.25).abs() < 1e-12 && (other - 0.75).abs() < 1e-12, "{one}, {other}");
}

#[test]
fn an_emitter_that_others_find_anyway_fades() {
    // Equal light; the first is found by another technique four times out of five.
    let [one, other] = shares(&[(0, 1.0, 0.2), (1, 1.0, 1.0)])[..] else { unreachable!() };
    assert!(one < 0.01, "{one}, {other}");
    // Found elsewhere once in a while it keeps most of its share.
    let [one, other] = shares(&[(0, 1.0, 0.95), (1, 1.0, 1.0)])[..] else { unreachable!() };
    assert!((0.4..0.5).contains(&one), "{one}, {other}");
}

#[test]
fn a_few_large_samples_say_as_little_as_few_samples() {
    assert_eq!(effective_samples([2.0; 7]), 7.0);
    let one_of_many = (0..1000).map(|i| if i == 300 { 1e4 } else { 1.0 });
    assert!((1.0..1.3).contains(&effective_samples(one_of_many)));
    for nothing in [&[][..], &[0.0; 3], &[f64::NAN, 1.0], &[f64::INFINITY]] {
        assert_eq!(effective_samples(nothing.iter().copied()), 0.0);
    }
    // Many small ones do not make up for two large ones: power and an even choice have the last word.
    let of = |emitter, light| EmitterSample { emitter: EmitterId(emitter), light, others: 0.0 };
    let mut samples = vec![of(0, 1e6), of(0, 1e6)];
    samples.extend((0..500).map(|i| of(i % 3, 1.0)));
    let blend = Selection::new(&[1.0; 3]).blend(&EmitterShares::of(vec![1.0 / 3.0; 3], &samples));
    let unlucky = blend.probability(EmitterId(1));
    assert!(unlucky > 0.2, "{unlucky}");
}

#[test]
fn without_samples_nothing_is_said() {
    let nothing = EmitterShares { light: vec![0.0; 2], samples: 0.0 };
    assert_eq!(EmitterShares::of(vec![0.5; 2], &[]), nothing);
}
