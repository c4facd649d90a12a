use glam::Vec3;
use proptest::prelude::*;

use super::*;
use crate::emitters_by_receiver::ClusterSample;
use crate::scene::{
    BoundingSphere, Emission, Emitter, EmitterBounds, EmitterKind, EmitterPoint, HitDensities, Incident,
};

/// An emitter of which the choice knows all that it asks for.
#[derive(Clone, Copy, Debug)]
struct Lamp {
    power: f32,
    bounds: Option<EmitterBounds>,
}

impl Emitter for Lamp {
    fn kind(&self) -> EmitterKind {
        EmitterKind::Point
    }

    fn power(&self, _: &BoundingSphere) -> f32 {
        self.power
    }

    fn bounds(&self, _: &BoundingSphere) -> Option<EmitterBounds> {
        self.bounds
    }

    fn sample_emission(&self, _: &BoundingSphere, _: [f32; 2], _: [f32; 2]) -> Option<Emission> {
        None
    }

    fn sample_incident(&self, _: &BoundingSphere, _: Vec3, _: [f32; 2]) -> Option<Incident> {
        None
    }

    fn hit(&self, _: &BoundingSphere, _: &EmitterPoint, _: Vec3, _: Vec3) -> Option<HitDensities> {
        None
    }
}

fn place() -> impl Strategy<Value = Vec3> {
    prop_oneof![
        prop::array::uniform3(-1.0_f32..1.0).prop_map(Vec3::from),
        // Lamps and receivers in the same place.
        prop::array::uniform3(-2_i8..=2).prop_map(|v| Vec3::from(v.map(f32::from)) * 0.5),
    ]
}

fn lamp() -> impl Strategy<Value = Lamp> {
    let direction = prop::array::uniform3(-1.0_f32..1.0).prop_map(|v| Vec3::from(v).normalize_or(Vec3::X));
    let angles = (prop_oneof![Just(-1.0_f32), Just(1.0), -1.0_f32..1.0], -1.0_f32..0.999);
    let size = prop_oneof![Just(0.0_f32), 0.0_f32..0.5];
    let bounds =
        (place(), size, direction, angles).prop_map(|(min, size, axis, (cos_normals, cos_emission))| {
            EmitterBounds { min, max: min + size, axis, cos_normals, cos_emission }
        });
    let power = prop_oneof![1 => Just(0.0_f32), 8 => (-12.0_f32..12.0).prop_map(|x| 10.0_f32.powf(x))];
    (power, prop::option::weighted(0.9, bounds)).prop_map(|(power, bounds)| Lamp { power, bounds })
}

type Seen = Vec<(Vec3, u16, f64, f64)>;

fn seen() -> impl Strategy<Value = Seen> {
    prop::collection::vec((place(), 0_u16..64, 0.0..10.0_f64, prop_oneof![Just(0.0), 0.0..10.0_f64]), 0..2000)
}

const SCENE: BoundingSphere = BoundingSphere { centre: Vec3::ZERO, radius: 3.0 };

/// The choice among lamps after such samples, and the tree that it is made with.
fn choice(lamps: &[Lamp], seen: &Seen) -> Option<(EmitterChoice, EmitterTree)> {
    let powers: Vec<f64> = lamps.iter().map(|lamp| f64::from(lamp.power)).collect();
    let mut tree = EmitterTree::new(lamps, &powers, &SCENE)?;
    let next_event = Selection::new(&powers);
    tree.set_shares(&next_event);
    let clusters = tree.clusters() as u16;
    let sample = |&(receiver, cluster, light, others): &(Vec3, u16, f64, f64)| ClusterSample {
        receiver,
        cluster: cluster % clusters,
        light,
        others,
    };
    let receivers = Some(ReceiverShares::fit(&seen.iter().map(sample).collect::<Vec<_>>(), &SCENE));
    Some((EmitterChoice { next_event, receivers, ..EmitterChoice::default() }, tree))
}

fn probabilities(choice: &EmitterChoice, tree: &EmitterTree, lamps: &[Lamp], receiver: Vec3) -> Vec<f64> {
    let of = |i| choice.next_event_probability(Some(tree), receiver, EmitterId(i as u32));
    (0..lamps.len()).map(of).map(f64::from).collect()
}

proptest! {
    #[test]
    fn probabilities_sum_to_one_for_every_receiver_and_leave_out_nothing_that_shines(
        lamps in prop::collection::vec(lamp(), 2..200),
        seen in seen(),
        receivers in prop::collection::vec(place(), 20),
    ) {
        let Some((choice, tree)) = choice(&lamps, &seen) else { return Ok(()) };
        prop_assert!(choice.receivers.as_ref().is_some_and(|receivers| receivers.fits(tree.clusters())));
        for receiver in receivers {
            let probabilities = probabilities(&choice, &tree, &lamps, receiver);
            let sum: f64 = probabilities.iter().sum();
            prop_assert!((sum - 1.0).abs() < 1e-5, "{sum}");
            for (lamp, p) in lamps.iter().zip(probabilities) {
                prop_assert_eq!(p > 0.0, lamp.power > 0.0, "{:?}: {}", lamp, p);
            }
        }
    }

    #[test]
    fn emitters_are_chosen_with_the_probability_that_is_told(
        lamps in prop::collection::vec(lamp(), 2..100),
        seen in seen(),
        receiver in place(),
        seed in 0_u64..1000,
    ) {
        let Some((choice, tree)) = choice(&lamps, &seen) else { return Ok(()) };
        let probabilities = probabilities(&choice, &tree, &lamps, receiver);
        let mut stream = crate::Stream::new(seed, 0, crate::StreamKind::MergePeriods, 0);
        let mut counts = vec![0_u32; lamps.len()];
        let draws = 20_000;
        for _ in 0..draws {
            let (emitter, probability) = choice.next_event(Some(&tree), receiver, stream.decide()).unwrap();
            prop_assert_eq!(f64::from(probability), probabilities[emitter.0 as usize]);
            counts[emitter.0 as usize] += 1;
        }
        for (count, p) in counts.into_iter().zip(probabilities) {
            let expected = p * f64::from(draws);
            let difference = (f64::from(count) - expected).abs();
            prop_assert!(difference < 6.0 * expected.sqrt() + 6.0, "{count}, expected {expected}");
        }
    }

    /// Photons and query points that are merged are not in the same place.
    #[test]
    fn probabilities_are_continuous_in_the_receiver(
        lamps in prop::collection::vec(lamp(), 2..50),
        seen in seen(),
        from in place(),
        to in place(),
    ) {
        let Some((choice, tree)) = choice(&lamps, &seen) else { return Ok(()) };
        let at = |t: f32| probabilities(&choice, &tree, &lamps, from.lerp(to, t));
        // Bisection for a jump, of which the half with the larger difference has a part of at least one half.
        let (mut low, mut high) = (0.0_f32, 1.0_f32);
        let difference = |a: f32, b: f32| {
            at(a).iter().zip(at(b)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        for _ in 0..20 {
            let middle = 0.5 * (low + high);
            if difference(low, middle) > difference(middle, high) { high = middle } else { low = middle }
        }
        // Only right at a lamp, where the intensity has no bound, is there much to see on so short a way.
        let place = from.lerp(to, low);
        let is_at_a_lamp = lamps.iter().filter_map(|lamp| lamp.bounds).any(|bounds| {
            place.distance(place.clamp(bounds.min, bounds.max)) < 1e-3
        });
        prop_assert!(is_at_a_lamp || difference(low, high) < 0.01, "{} at {place}", difference(low, high));
    }
}

#[test]
fn receivers_choose_what_is_near_and_shines_their_way() {
    let point =
        |x: f32| Lamp { power: 1.0, bounds: Some(EmitterBounds::all_around(Vec3::X * x, Vec3::X * x)) };
    let down = |x: f32| {
        let bounds = point(x).bounds.map(|b| EmitterBounds { axis: Vec3::NEG_Y, cos_normals: 1.0, ..b });
        Lamp { power: 1.0, bounds }
    };
    let sky = Lamp { power: 1.0, bounds: None };
    let lamps = [point(-1.0), point(1.0), sky, down(-1.0)];
    let (choice, tree) = choice(&lamps, &Seen::new()).unwrap();
    let at = |receiver| probabilities(&choice, &tree, &lamps, receiver);
    let below = at(Vec3::new(-1.0, -0.5, 0.0));
    assert!(below[0] > 5.0 * below[1] && below[3] > 5.0 * below[1], "{below:?}");
    let above = at(Vec3::new(-1.0, 0.5, 0.0));
    assert!(above[0] > 5.0 * above[3], "{above:?}");
    assert!((above[2] - 0.25).abs() < 1e-6, "what is everywhere keeps its share: {above:?}");
    // Also if that is not its power.
    let next_event = Selection::new(&[1.0, 1.0, 5.0, 1.0]);
    let mut tree = tree.clone();
    tree.set_shares(&next_event);
    let learnt = EmitterChoice { next_event, ..choice.clone() };
    let above = probabilities(&learnt, &tree, &lamps, Vec3::new(-1.0, 0.5, 0.0));
    assert!((above[2] - 0.625).abs() < 1e-6, "{above:?}");
}

#[test]
fn what_is_behind_a_wall_is_learnt() {
    // A wall at 0 between rooms with a lamp each, near the wall: by distance both are alike.
    let point =
        |x: f32| Lamp { power: 1.0, bounds: Some(EmitterBounds::all_around(Vec3::X * x, Vec3::X * x)) };
    let lamps = [point(-0.1), point(0.1)];
    let tree = choice(&lamps, &Seen::new()).unwrap().1;
    let clusters = [0, 1].map(|i| tree.probability(EmitterId(i), Vec3::Y).unwrap().0);
    let receivers = (0..1000).map(|i| Vec3::new(i as f32 / 500.0 - 1.0, -1.0, (i % 7) as f32 / 7.0));
    let seen = receivers.map(|at| (at, clusters[usize::from(at.x > 0.0)], 1.0, 0.0)).collect();
    let (choice, tree) = choice(&lamps, &seen).unwrap();
    for x in [-0.5_f32, 0.5] {
        let p = probabilities(&choice, &tree, &lamps, Vec3::new(x, -1.0, 0.3));
        assert!(p[usize::from(x > 0.0)] > 0.8, "{p:?}");
    }
}
