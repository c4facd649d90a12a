//! A number for each lane, and means over the lanes of a walk.

use std::fmt::Debug;
use std::ops::{Add, Mul};

mod sealed {
    /// The sets of lanes that there are.
    #[expect(unnameable_types, reason = "no other crate is to implement it")]
    pub trait Sealed {}

    impl Sealed for f64 {}
    impl Sealed for [f64; 3] {}
}

/// A density for each lane: `f64` for one lane, `[f64; 3]` for a lane per channel, and no other.
pub trait LaneValues: sealed::Sealed + Copy + Debug + PartialEq + Send + Sync + 'static {
    /// A value for each lane.
    type Each<T: Copy + Debug + Send + Sync>: Copy + Debug + Send + Sync;
    /// The probability of each lane to be the hero of a walk, given what the walk has done; nothing if there
    /// is one lane.
    type Shares: Copy + Debug + PartialEq + Send + Sync;
    /// The lane that a walk draws its distances and directions from.
    type Hero: Copy + Debug + Send + Sync;

    /// The number of lanes.
    const COUNT: usize;
    /// Zero in all lanes.
    const ZERO: Self;
    /// One in all lanes.
    const ONE: Self;

    /// One value in all lanes.
    #[must_use]
    fn splat(value: f64) -> Self;

    /// The product, lane by lane.
    #[must_use]
    fn times(self, other: Self) -> Self;

    /// Whether the value of any lane is positive.
    #[must_use]
    fn is_positive(self) -> bool;

    /// The value of a lane.
    #[must_use]
    fn get(self, lane: usize) -> f64;

    /// The value of the hero's lane.
    #[must_use]
    fn of_hero(self, hero: Self::Hero) -> f64;

    /// Computes a value for each lane, from the index of the lane.
    fn each<T: Copy + Debug + Send + Sync>(value: impl FnMut(usize) -> T) -> Self::Each<T>;

    /// The value of a lane.
    fn pick<T: Copy + Debug + Send + Sync>(each: &Self::Each<T>, lane: usize) -> T;

    /// The mean of values with shares. Lanes without a share do not count, whatever their value.
    fn blend<T>(zero: T, each: &Self::Each<T>, shares: &Self::Shares) -> T
    where
        T: Copy + Debug + Send + Sync + Add<Output = T> + Mul<f64, Output = T>;

    /// The mean over the lanes.
    #[must_use]
    fn mean(self, shares: &Self::Shares) -> f64;

    /// The shares after a step that has the density `self` in each lane, and `mean` in the
    /// [mean](Self::mean), which is positive (Bayes).
    #[must_use]
    fn given(self, shares: &Self::Shares, mean: f64) -> Self::Shares;

    /// The [mean](Self::mean) of the density of a step, and the shares [after](Self::given) it; where no lane
    /// can take it, as before.
    #[inline]
    #[must_use]
    fn step(self, shares: &Self::Shares) -> (f64, Self::Shares) {
        let mean = self.mean(shares);
        (mean, if mean > 0.0 { self.given(shares, mean) } else { *shares })
    }

    /// The shares of a walk that starts, from the probabilities of the lanes.
    #[must_use]
    fn prior(probabilities: &[f64; 3]) -> Self::Shares;

    /// Draws the hero of a walk with these probabilities, which sum to one; asks for a uniform number in
    /// `[0, 1)` if there is a choice.
    fn draw(probabilities: &[f64; 3], uniform: impl FnOnce() -> f32) -> Self::Hero;
}

impl LaneValues for f64 {
    type Each<T: Copy + Debug + Send + Sync> = T;
    type Shares = ();
    type Hero = ();

    const COUNT: usize = 1;
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;

    #[inline]
    fn splat(value: f64) -> Self {
        value
    }

    #[inline]
    fn times(self, other: Self) -> Self {
        self * other
    }

    #[inline]
    fn is_positive(self) -> bool {
        self > 0.0
    }

    #[inline]
    fn get(self, _: usize) -> f64 {
        self
    }

    #[inline]
    fn of_hero(self, (): ()) -> f64 {
        self
    }

    #[inline]
    fn each<T: Copy + Debug + Send + Sync>(mut value: impl FnMut(usize) -> T) -> T {
        value(0)
    }

    #[inline]
    fn pick<T: Copy + Debug + Send + Sync>(each: &T, _: usize) -> T {
        *each
    }

    #[inline]
    fn blend<T>(_: T, each: &T, (): &()) -> T
    where
        T: Copy + Debug + Send + Sync + Add<Output = T> + Mul<f64, Output = T>,
    {
        *each
    }

    #[inline]
    fn mean(self, (): &()) -> f64 {
        self
    }

    #[inline]
    fn given(self, (): &(), _: f64) {}

    #[inline]
    fn prior(_: &[f64; 3]) {}

    #[inline]
    fn draw(_: &[f64; 3], _: impl FnOnce() -> f32) {}
}

impl LaneValues for [f64; 3] {
    type Each<T: Copy + Debug + Send + Sync> = [T; 3];
    type Shares = [f64; 3];
    type Hero = usize;

    const COUNT: usize = 3;
    const ZERO: Self = [0.0; 3];
    const ONE: Self = [1.0; 3];

    #[inline]
    fn splat(value: f64) -> Self {
        [value; 3]
    }

    #[inline]
    fn times(self, other: Self) -> Self {
        std::array::from_fn(|lane| self[lane] * other[lane])
    }

    #[inline]
    fn is_positive(self) -> bool {
        self.iter().any(|value| *value > 0.0)
    }

    #[inline]
    fn get(self, lane: usize) -> f64 {
        self[lane]
    }

    #[inline]
    fn of_hero(self, hero: usize) -> f64 {
        self[hero]
    }

    #[inline]
    fn each<T: Copy + Debug + Send + Sync>(value: impl FnMut(usize) -> T) -> [T; 3] {
        std::array::from_fn(value)
    }

    #[inline]
    fn pick<T: Copy + Debug + Send + Sync>(each: &[T; 3], lane: usize) -> T {
        each[lane]
    }

    #[inline]
    fn blend<T>(zero: T, each: &[T; 3], shares: &[f64; 3]) -> T
    where
        T: Copy + Debug + Send + Sync + Add<Output = T> + Mul<f64, Output = T>,
    {
        let with_share = each.iter().zip(shares).filter(|(_, share)| **share > 0.0);
        with_share.fold(zero, |sum, (value, share)| sum + *value * *share)
    }

    #[inline]
    fn mean(self, shares: &[f64; 3]) -> f64 {
        self[0] * shares[0] + self[1] * shares[1] + self[2] * shares[2]
    }

    #[inline]
    fn given(self, shares: &[f64; 3], mean: f64) -> [f64; 3] {
        std::array::from_fn(|lane| shares[lane] * self[lane] / mean)
    }

    #[inline]
    fn prior(probabilities: &[f64; 3]) -> [f64; 3] {
        *probabilities
    }

    #[inline]
    fn draw(probabilities: &[f64; 3], uniform: impl FnOnce() -> f32) -> usize {
        let mut rest = f64::from(uniform());
        for (lane, probability) in probabilities.iter().enumerate() {
            if rest < *probability {
                return lane;
            }
            rest -= probability;
        }
        // Rounding: the last lane that can be drawn.
        probabilities.iter().rposition(|probability| *probability > 0.0).unwrap_or(0)
    }
}
