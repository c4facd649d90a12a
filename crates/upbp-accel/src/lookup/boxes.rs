//! Groups of eight boxes, in full precision or in a cache line.

use glam::Vec3;

use crate::simd::{TO_WHOLE, Task, WIDTH, Wide, run};

/// The box around some items: least and greatest corner.
pub(super) type Bounds = (Vec3, Vec3);

/// The box around two boxes.
pub(super) fn union(a: Bounds, b: Bounds) -> Bounds {
    (a.0.min(b.0), a.1.max(b.1))
}

/// Eight boxes, tested at once. The box of an unused lane ends before it begins.
pub(super) trait Boxes: Copy + Send {
    /// Packs up to eight boxes.
    fn around(boxes: &[Bounds]) -> Self;
    /// The least coordinate of each box along an axis.
    fn min<W: Wide>(&self, wide: W, axis: usize) -> W::F;
    /// The greatest coordinate of each box along an axis.
    fn max<W: Wide>(&self, wide: W, axis: usize) -> W::F;
}

/// Eight boxes in full precision.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Exact {
    min: [[f32; WIDTH]; 3],
    max: [[f32; WIDTH]; 3],
}

impl Boxes for Exact {
    fn around(boxes: &[Bounds]) -> Self {
        let mut exact = Self { min: [[f32::INFINITY; WIDTH]; 3], max: [[f32::NEG_INFINITY; WIDTH]; 3] };
        for (lane, (min, max)) in boxes.iter().enumerate() {
            for axis in 0..3 {
                exact.min[axis][lane] = min[axis];
                exact.max[axis][lane] = max[axis];
            }
        }
        exact
    }

    #[inline(always)]
    fn min<W: Wide>(&self, wide: W, axis: usize) -> W::F {
        wide.load(&self.min[axis])
    }

    #[inline(always)]
    fn max<W: Wide>(&self, wide: W, axis: usize) -> W::F {
        wide.load(&self.max[axis])
    }
}

/// Eight boxes rounded outwards to a grid of 256 places with the same step along all axes. For boxes of like
/// size only: small ones among large ones would grow many times.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Rounded {
    min: [[u8; WIDTH]; 3],
    max: [[u8; WIDTH]; 3],
    origin: [f32; 3],
    step: f32,
}

impl Rounded {
    /// The coordinate of a place of the grid, computed as the tests compute it.
    fn at(&self, axis: usize, place: u8) -> f32 {
        self.origin[axis] + f32::from(place) * self.step
    }

    #[inline(always)]
    fn places<W: Wide>(&self, wide: W, axis: usize, places: [u8; WIDTH]) -> W::F {
        wide.add(wide.splat(self.origin[axis]), wide.mul(wide.load_bytes(places), wide.splat(self.step)))
    }
}

impl Boxes for Rounded {
    fn around(boxes: &[Bounds]) -> Self {
        let mut rounded =
            Self { min: [[u8::MAX; WIDTH]; 3], max: [[0; WIDTH]; 3], origin: [0.0; 3], step: 0.0 };
        let Some((low, high)) = boxes.iter().copied().reduce(union) else { return rounded };
        rounded.origin = low.to_array();
        // Divided first: the difference may be more than the greatest number.
        let least = (high / 255.0 - low / 255.0).max_element().abs();
        // Far from the origin the last place is rounded by many of the step's last bits, so that their number
        // doubles until the last place is far enough.
        let steps = (0..32).map(|power| least.to_bits() + ((1 << power) - 1));
        for step in steps.map(|bits| f32::from_bits(bits.min(f32::INFINITY.to_bits()))) {
            rounded.step = step;
            if (0..3).all(|axis| rounded.at(axis, u8::MAX) >= high[axis]) {
                break;
            }
        }
        run(Round { rounded: &mut rounded, boxes });
        rounded
    }

    #[inline(always)]
    fn min<W: Wide>(&self, wide: W, axis: usize) -> W::F {
        self.places(wide, axis, self.min[axis])
    }

    #[inline(always)]
    fn max<W: Wide>(&self, wide: W, axis: usize) -> W::F {
        self.places(wide, axis, self.max[axis])
    }
}

/// Rounds boxes outwards to a grid whose origin and step are known.
struct Round<'a> {
    rounded: &'a mut Rounded,
    boxes: &'a [Bounds],
}

impl Task for Round<'_> {
    #[inline(always)]
    fn run(self, wide: impl Wide) {
        let Self { rounded, boxes } = self;
        let (step, inverse) = (rounded.step, rounded.step.recip());
        for axis in 0..3 {
            let origin = rounded.origin[axis];
            let (mut min, mut max) = ([origin; WIDTH], [origin; WIDTH]);
            for (lane, bounds) in boxes.iter().enumerate() {
                (min[lane], max[lane]) = (bounds.0[axis], bounds.1[axis]);
            }
            let at = |place: f32| origin + place * step;
            let nearest = |x: f32| {
                let place = (x - origin) * inverse;
                // Written so that NaN becomes a place too.
                let place = if place < 255.0 { place } else { 255.0 };
                place + TO_WHOLE - TO_WHOLE
            };
            let (mut least, mut greatest) = (min.map(nearest), max.map(nearest));
            for lane in 0..WIDTH {
                least[lane] -= if at(least[lane]) > min[lane] { 1.0 } else { 0.0 };
                greatest[lane] += if at(greatest[lane]) < max[lane] { 1.0 } else { 0.0 };
            }
            let byte = |place: f32| (place + TO_WHOLE).to_bits() as u8;
            (rounded.min[axis], rounded.max[axis]) = (least.map(byte), greatest.map(byte));
            let held = wide.less_equal(wide.load(&least.map(at)), wide.load(&min))
                & wide.less_equal(wide.load(&max), wide.load(&greatest.map(at)));
            // Where rounding was off by more than one place.
            if held != 0xff {
                for lane in 0..WIDTH {
                    while rounded.at(axis, rounded.min[axis][lane]) > min[lane] {
                        rounded.min[axis][lane] -= 1;
                    }
                    while rounded.at(axis, rounded.max[axis][lane]) < max[lane] {
                        rounded.max[axis][lane] += 1;
                    }
                }
            }
            // No box ends before it begins.
            rounded.min[axis][boxes.len()..].fill(u8::MAX);
            rounded.max[axis][boxes.len()..].fill(0);
        }
    }
}

#[cfg(test)]
mod tests {
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::{Rng as _, SeedableRng as _};

    use super::*;

    #[test]
    fn rounded_boxes_hold_the_boxes_at_any_scale_and_place() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut cube =
            || Vec3::from([0; 3].map(|_| (random.next_u64() >> 40) as f32 / (1_u64 << 23) as f32 - 1.0));
        for (scale, offset) in [
            (1.0, 0.0),
            (0.0, 0.0),
            (1e-44, 0.0),
            (1e-38, 0.0),
            (1e-3, 1e5),
            (1e-9, 1.0),
            (6e-5, 2.0),
            (6e-5, 1e3),
            (1e30, 1.0),
            (f32::MAX, 0.0),
        ] {
            for count in 1..=WIDTH {
                let place = cube() * offset;
                let boxes: Vec<Bounds> = (0..count)
                    .map(|_| {
                        let (a, b) = (place + cube() * scale, place + cube() * scale);
                        (a.min(b), a.max(b))
                    })
                    .collect();
                let rounded = Rounded::around(&boxes);
                for (lane, (min, max)) in boxes.iter().enumerate() {
                    for axis in 0..3 {
                        assert!(
                            rounded.at(axis, rounded.min[axis][lane]) <= min[axis],
                            "{rounded:?} {boxes:?}"
                        );
                        assert!(
                            rounded.at(axis, rounded.max[axis][lane]) >= max[axis],
                            "{rounded:?} {boxes:?}"
                        );
                    }
                }
            }
        }
    }
}
