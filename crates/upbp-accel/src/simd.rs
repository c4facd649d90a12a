//! Arithmetic on eight numbers at once.
//!
//! The compiler does not find the vector instructions by itself: it takes loops over eight lanes apart in
//! order to build the mask of the result. So the operations are named. Each rounds as the scalar one does and
//! none is fused, so that results do not depend on the instruction set.

#![expect(clippy::inline_always, reason = "only what is inlined is compiled for the instruction set at hand")]

use pulp::Arch;

/// Numbers in a vector, thus items in a block and children of a node.
pub(crate) const WIDTH: usize = 8;

/// Adding this to a number from 0 to itself rounds to a whole one, which the last bits of the sum hold: from
/// here to twice as much, neighbouring numbers have a distance of one.
pub(crate) const TO_WHOLE: f32 = (1 << 23) as f32;

/// The lanes whose bit is set, in ascending order.
#[inline(always)]
pub(crate) fn set_lanes(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = (bits != 0).then(|| bits.trailing_zeros() as usize)?;
        bits &= bits - 1;
        Some(lane)
    })
}

/// The operations on eight numbers. Masks have one bit per lane.
pub(crate) trait Wide: Copy {
    /// Eight numbers.
    type F: Copy;

    fn load(self, lanes: &[f32; WIDTH]) -> Self::F;
    fn load_bytes(self, lanes: [u8; WIDTH]) -> Self::F;
    fn store(self, lanes: Self::F) -> [f32; WIDTH];
    fn splat(self, x: f32) -> Self::F;
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    #[cfg_attr(not(feature = "geometry"), expect(dead_code, reason = "only geometry needs it"))]
    fn abs(self, a: Self::F) -> Self::F;
    fn sqrt(self, a: Self::F) -> Self::F;
    /// `a`, negated where the sign bit of `by` is set.
    #[cfg_attr(not(feature = "geometry"), expect(dead_code, reason = "only geometry needs it"))]
    fn flip_sign(self, a: Self::F, by: Self::F) -> Self::F;
    /// `a > b ? a : b`, thus `b` if either is NaN.
    fn greater_of(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a < b ? a : b`, thus `b` if either is NaN.
    fn less_of(self, a: Self::F, b: Self::F) -> Self::F;
    fn less(self, a: Self::F, b: Self::F) -> u32;
    fn less_equal(self, a: Self::F, b: Self::F) -> u32;

    #[inline(always)]
    fn splat3(self, v: [f32; 3]) -> [Self::F; 3] {
        [self.splat(v[0]), self.splat(v[1]), self.splat(v[2])]
    }

    #[inline(always)]
    fn load3(self, v: &[[f32; WIDTH]; 3]) -> [Self::F; 3] {
        [self.load(&v[0]), self.load(&v[1]), self.load(&v[2])]
    }

    #[cfg(feature = "geometry")]
    #[inline(always)]
    fn add3(self, a: [Self::F; 3], b: [Self::F; 3]) -> [Self::F; 3] {
        [self.add(a[0], b[0]), self.add(a[1], b[1]), self.add(a[2], b[2])]
    }

    #[inline(always)]
    fn sub3(self, a: [Self::F; 3], b: [Self::F; 3]) -> [Self::F; 3] {
        [self.sub(a[0], b[0]), self.sub(a[1], b[1]), self.sub(a[2], b[2])]
    }

    #[inline(always)]
    fn scale3(self, a: [Self::F; 3], b: Self::F) -> [Self::F; 3] {
        [self.mul(a[0], b), self.mul(a[1], b), self.mul(a[2], b)]
    }

    /// Dot product, in the order of the scalar code.
    #[inline(always)]
    fn dot(self, a: [Self::F; 3], b: [Self::F; 3]) -> Self::F {
        self.add(self.add(self.mul(a[0], b[0]), self.mul(a[1], b[1])), self.mul(a[2], b[2]))
    }

    #[inline(always)]
    fn cross(self, a: [Self::F; 3], b: [Self::F; 3]) -> [Self::F; 3] {
        [
            self.sub(self.mul(a[1], b[2]), self.mul(a[2], b[1])),
            self.sub(self.mul(a[2], b[0]), self.mul(a[0], b[2])),
            self.sub(self.mul(a[0], b[1]), self.mul(a[1], b[0])),
        ]
    }

    /// Distance `t` along a unit `direction` to the foot of the perpendicular from `offset`, both seen from
    /// the start of the line, and the squared distance from the foot.
    #[inline(always)]
    fn perpendicular(self, offset: [Self::F; 3], direction: [Self::F; 3]) -> [Self::F; 2] {
        let t = self.dot(offset, direction);
        let across = self.sub3(offset, self.scale3(direction, t));
        [t, self.dot(across, across)]
    }
}

/// Work that any kind of [`Wide`] can do.
pub(crate) trait Task {
    fn run(self, wide: impl Wide);
}

/// Runs a task with the best instructions that this processor has.
#[inline]
pub(crate) fn run(task: impl Task) {
    run_or(task, |task| task.run(Plain));
}

/// Runs a task with the best instructions that this processor has. Where that would be a second form of the
/// task, on x86 without AVX2, calls `otherwise` instead, which has to do the same.
///
/// A task with closures is compiled for each of them: this saves compiling it twice, for instructions that
/// few processors lack.
#[inline]
pub(crate) fn run_or<T: Task>(task: T, otherwise: impl FnOnce(T)) {
    match Arch::new() {
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        Arch::V3(simd) => simd.vectorize(avx2::Vectorised { task, simd }),
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        _ => otherwise(task),
        #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
        _ => {
            drop(otherwise);
            task.run(Plain);
        }
    }
}

/// Instructions that tasks run with.
#[cfg(feature = "geometry")]
pub(crate) trait Instructions: Copy {
    fn run(self, task: impl Task);
}

#[cfg(feature = "geometry")]
impl Instructions for Plain {
    fn run(self, task: impl Task) {
        task.run(self);
    }
}

#[cfg(all(feature = "geometry", any(target_arch = "x86", target_arch = "x86_64")))]
impl Instructions for pulp::x86::V3 {
    fn run(self, task: impl Task) {
        self.vectorize(avx2::Vectorised { task, simd: self });
    }
}

/// The best instructions for which code is compiled.
#[cfg(all(feature = "geometry", any(target_arch = "x86", target_arch = "x86_64")))]
pub(crate) type Best = pulp::x86::V3;
#[cfg(all(feature = "geometry", not(any(target_arch = "x86", target_arch = "x86_64"))))]
pub(crate) type Best = Plain;

/// Those instructions, if this processor has them.
#[cfg(feature = "geometry")]
pub(crate) fn best() -> Option<Best> {
    match Arch::new() {
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        Arch::V3(simd) => Some(simd),
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        _ => None,
        #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
        _ => Some(Plain),
    }
}

/// Loops; on most processors the compiler vectorises them more or less.
#[derive(Clone, Copy)]
pub(crate) struct Plain;

#[inline(always)]
fn each<T: Copy + Default>(f: impl Fn(usize) -> T) -> [T; WIDTH] {
    let mut lanes = [T::default(); WIDTH];
    for (lane, x) in lanes.iter_mut().enumerate() {
        *x = f(lane);
    }
    lanes
}

#[inline(always)]
fn bits(f: impl Fn(usize) -> bool) -> u32 {
    each(f).iter().enumerate().fold(0, |bits, (lane, &set)| bits | u32::from(set) << lane)
}

impl Wide for Plain {
    type F = [f32; WIDTH];

    #[inline(always)]
    fn load(self, lanes: &[f32; WIDTH]) -> Self::F {
        *lanes
    }

    #[inline(always)]
    fn load_bytes(self, lanes: [u8; WIDTH]) -> Self::F {
        lanes.map(f32::from)
    }

    #[inline(always)]
    fn store(self, lanes: Self::F) -> [f32; WIDTH] {
        lanes
    }

    #[inline(always)]
    fn splat(self, x: f32) -> Self::F {
        [x; WIDTH]
    }

    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        each(|i| a[i] + b[i])
    }

    #[inline(always)]
    fn sub(self, a: Self::F, b: Self::F) -> Self::F {
        each(|i| a[i] - b[i])
    }

    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        each(|i| a[i] * b[i])
    }

    #[inline(always)]
    fn div(self, a: Self::F, b: Self::F) -> Self::F {
        each(|i| a[i] / b[i])
    }

    #[inline(always)]
    fn abs(self, a: Self::F) -> Self::F {
        each(|i| a[i].abs())
    }

    #[inline(always)]
    fn sqrt(self, a: Self::F) -> Self::F {
        each(|i| a[i].sqrt())
    }

    #[inline(always)]
    fn flip_sign(self, a: Self::F, by: Self::F) -> Self::F {
        each(|i| if by[i].is_sign_negative() { -a[i] } else { a[i] })
    }

    #[inline(always)]
    fn greater_of(self, a: Self::F, b: Self::F) -> Self::F {
        each(|i| if a[i] > b[i] { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn less_of(self, a: Self::F, b: Self::F) -> Self::F {
        each(|i| if a[i] < b[i] { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn less(self, a: Self::F, b: Self::F) -> u32 {
        bits(|i| a[i] < b[i])
    }

    #[inline(always)]
    fn less_equal(self, a: Self::F, b: Self::F) -> u32 {
        bits(|i| a[i] <= b[i])
    }
}

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
mod avx2 {
    use pulp::x86::V3;
    use pulp::{NullaryFnOnce, cast, f32x8};

    use super::{Task, WIDTH, Wide};

    /// A task for AVX2.
    pub(crate) struct Vectorised<T> {
        pub(crate) task: T,
        pub(crate) simd: V3,
    }

    impl<T: Task> NullaryFnOnce for Vectorised<T> {
        type Output = ();

        #[inline(always)]
        fn call(self) {
            self.task.run(self.simd);
        }
    }

    impl Wide for V3 {
        type F = f32x8;

        #[inline(always)]
        fn load(self, lanes: &[f32; WIDTH]) -> f32x8 {
            cast(*lanes)
        }

        #[inline(always)]
        fn load_bytes(self, lanes: [u8; WIDTH]) -> f32x8 {
            let low = [u64::from_ne_bytes(lanes), 0];
            self.convert_i32x8_to_f32x8(self.convert_u8x16_to_i32x8(cast(low)))
        }

        #[inline(always)]
        fn store(self, lanes: f32x8) -> [f32; WIDTH] {
            cast(lanes)
        }

        #[inline(always)]
        fn splat(self, x: f32) -> f32x8 {
            self.splat_f32x8(x)
        }

        #[inline(always)]
        fn add(self, a: f32x8, b: f32x8) -> f32x8 {
            self.add_f32x8(a, b)
        }

        #[inline(always)]
        fn sub(self, a: f32x8, b: f32x8) -> f32x8 {
            self.sub_f32x8(a, b)
        }

        #[inline(always)]
        fn mul(self, a: f32x8, b: f32x8) -> f32x8 {
            self.mul_f32x8(a, b)
        }

        #[inline(always)]
        fn div(self, a: f32x8, b: f32x8) -> f32x8 {
            self.div_f32x8(a, b)
        }

        #[inline(always)]
        fn abs(self, a: f32x8) -> f32x8 {
            self.abs_f32x8(a)
        }

        #[inline(always)]
        fn sqrt(self, a: f32x8) -> f32x8 {
            self.sqrt_f32x8(a)
        }

        #[inline(always)]
        fn flip_sign(self, a: f32x8, by: f32x8) -> f32x8 {
            let sign = self.avx._mm256_and_ps(cast(by), cast(self.splat_f32x8(-0.0)));
            cast(self.avx._mm256_xor_ps(cast(a), sign))
        }

        #[inline(always)]
        fn greater_of(self, a: f32x8, b: f32x8) -> f32x8 {
            self.max_f32x8(a, b)
        }

        #[inline(always)]
        fn less_of(self, a: f32x8, b: f32x8) -> f32x8 {
            self.min_f32x8(a, b)
        }

        #[inline(always)]
        fn less(self, a: f32x8, b: f32x8) -> u32 {
            self.avx._mm256_movemask_ps(cast(self.cmp_lt_f32x8(a, b))) as u32
        }

        #[inline(always)]
        fn less_equal(self, a: f32x8, b: f32x8) -> u32 {
            self.avx._mm256_movemask_ps(cast(self.cmp_le_f32x8(a, b))) as u32
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bits of every operation on numbers that include all special ones.
    struct Everything<'a>(&'a mut Vec<u32>);

    impl Task for Everything<'_> {
        fn run(self, wide: impl Wide) {
            let special = [0.0, -0.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 1e-42, f32::MAX, -1.5];
            for turn in 0..WIDTH {
                let mut other = special.map(|x| x * 1.1 + 0.3);
                if turn % 2 == 0 {
                    other = special;
                }
                other.rotate_left(turn);
                let (a, b) = (wide.load(&special), wide.load(&other));
                let triple = ([a, b, wide.splat(0.7)], [b, a, wide.splat(-0.1)]);
                let results = [
                    wide.add(a, b),
                    wide.sub(a, b),
                    wide.mul(a, b),
                    wide.div(a, b),
                    wide.abs(a),
                    wide.sqrt(a),
                    wide.flip_sign(a, b),
                    wide.greater_of(a, b),
                    wide.less_of(a, b),
                ]
                .into_iter()
                .chain([wide.dot(triple.0, triple.1), wide.load_bytes([0, 1, 2, 127, 128, 200, 254, 255])])
                .chain(wide.cross(triple.0, triple.1));
                for lanes in results {
                    // Which NaN is not said.
                    self.0.extend(wide.store(lanes).map(|x| if x.is_nan() { 1 } else { x.to_bits() }));
                }
                self.0.extend([wide.less(a, b), wide.less_equal(a, b)]);
            }
        }
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let (mut best, mut plain) = (Vec::new(), Vec::new());
        run(Everything(&mut best));
        Everything(&mut plain).run(Plain);
        assert_eq!(best, plain);
    }
}
