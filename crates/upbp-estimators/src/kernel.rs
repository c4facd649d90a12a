//! Smoothing kernels and the volumes with which they enter the weights (`docs/theory.md`, section 2).

use std::f64::consts::PI;

use crate::technique::Technique;

/// A radial kernel in one, two or three dimensions, normalised to integrate to one.
///
/// Points use constant kernels for the three-dimensional and the surface estimate, parabolic (Epanechnikov)
/// ones where a beam takes part: there the kernel is evaluated along a line and its edge would show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kernel {
    shape: Shape,
    radius: f32,
    /// Value at the centre.
    peak: f32,
    /// The value at distance `d` is `peak (1 − falloff d²)`. Not the product of the two: it is beyond single
    /// precision for radii below 10⁻⁹.
    falloff: f32,
    /// `1 / ∫K²`, the volume that stands for the kernel in a weight.
    effective_volume: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    Disc,
    Ball,
    ParabolicDisc,
    ParabolicLine,
}

impl Kernel {
    /// A kernel that nothing is within reach of: radius 0, of no effect in weights.
    pub const NONE: Self =
        Self { shape: Shape::Disc, radius: 0.0, peak: 0.0, falloff: 0.0, effective_volume: 0.0 };

    /// [`NONE`](Self::NONE) where single precision does not hold the values: of too wide a kernel they would
    /// be zero, of too narrow a one infinite, and weights would count on it all the same.
    fn new(shape: Shape, radius: f32) -> Self {
        let r = f64::from(radius);
        let (peak, falloff, effective_volume) = match shape {
            Shape::Disc => (1.0 / (PI * r * r), 0.0, PI * r * r),
            Shape::Ball => (0.75 / (PI * r.powi(3)), 0.0, 4.0 / 3.0 * PI * r.powi(3)),
            Shape::ParabolicDisc => (2.0 / (PI * r * r), 1.0 / (r * r), 0.75 * PI * r * r),
            Shape::ParabolicLine => (0.75 / r, 1.0 / (r * r), 5.0 / 3.0 * r),
        };
        let (peak, falloff) = (peak as f32, falloff as f32);
        if !(peak.is_normal() && falloff.is_finite()) {
            return Self::NONE;
        }
        Self { shape, radius, peak, falloff, effective_volume }
    }

    /// The kernel of a technique; [`NONE`](Self::NONE) of one that does not merge.
    #[must_use]
    pub fn of(technique: Technique, radius: f32) -> Self {
        match technique {
            Technique::Surf => Self::disc(radius),
            Technique::Pp3d => Self::ball(radius),
            Technique::Pb2d | Technique::Bp2d => Self::parabolic_disc(radius),
            Technique::Bb1d => Self::parabolic_line(radius),
            Technique::Hit | Technique::Nee | Technique::Connect | Technique::LightTracing => Self::NONE,
        }
    }

    /// Constant on a disc: surface merging.
    #[must_use]
    pub fn disc(radius: f32) -> Self {
        Self::new(Shape::Disc, radius)
    }

    /// Constant in a ball: PP3D.
    #[must_use]
    pub fn ball(radius: f32) -> Self {
        Self::new(Shape::Ball, radius)
    }

    /// `2/(πr²) (1 − u²/r²)`: PB2D and BP2D.
    #[must_use]
    pub fn parabolic_disc(radius: f32) -> Self {
        Self::new(Shape::ParabolicDisc, radius)
    }

    /// `3/(4r) (1 − u²/r²)`: BB1D.
    #[must_use]
    pub fn parabolic_line(radius: f32) -> Self {
        Self::new(Shape::ParabolicLine, radius)
    }

    /// The kernel with `factor` times the radius; [`NONE`](Self::NONE) with none of it.
    #[inline]
    #[must_use]
    pub fn scaled(&self, factor: f32) -> Self {
        if factor == 1.0 || self.radius == 0.0 {
            *self
        } else if factor > 0.0 {
            Self::new(self.shape, factor * self.radius)
        } else {
            Self::NONE
        }
    }

    /// The kernel's radius, scene units.
    #[must_use]
    pub const fn radius(&self) -> f32 {
        self.radius
    }

    /// `V_K = 1/∫K²`, scene units to the power of the dimension.
    #[must_use]
    pub const fn effective_volume(&self) -> f64 {
        self.effective_volume
    }

    /// Value at a squared distance below `radius²`.
    #[must_use]
    pub fn value(&self, distance_squared: f32) -> f32 {
        self.peak * (1.0 - self.falloff * distance_squared).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫ K^power over `dimension` dimensions by the midpoint rule.
    fn integral(kernel: &Kernel, dimension: i32, power: i32) -> f64 {
        let shell = [2.0, 2.0 * PI, 4.0 * PI][dimension as usize - 1];
        let steps = 20_000;
        let dr = f64::from(kernel.radius) / f64::from(steps);
        (0..steps)
            .map(|i| {
                let r = (f64::from(i) + 0.5) * dr;
                shell * r.powi(dimension - 1) * f64::from(kernel.value((r * r) as f32)).powi(power) * dr
            })
            .sum()
    }

    #[test]
    fn there_is_no_kernel_that_single_precision_does_not_hold() {
        for none in [
            Kernel::ball(1e-14),
            Kernel::ball(1e16),
            Kernel::disc(1e-20),
            Kernel::parabolic_disc(1e20),
            Kernel::parabolic_line(1e-20),
            Kernel::ball(1e-3).scaled(1e-11),
            Kernel::disc(f32::NAN),
        ] {
            assert_eq!(none, Kernel::NONE);
        }
        assert_ne!(Kernel::parabolic_line(1e-15), Kernel::NONE);
    }

    #[test]
    fn kernels_integrate_to_one_and_their_squares_to_the_inverse_volume() {
        // Scenes of a millionth of a unit have kernels of 10⁻¹².
        for radius in [1e-12_f32, 1e-3, 0.7, 30.0, 1e9] {
            for (kernel, dimension) in [
                (Kernel::disc(radius), 2),
                (Kernel::ball(radius), 3),
                (Kernel::parabolic_disc(radius), 2),
                (Kernel::parabolic_line(radius), 1),
            ] {
                assert!((integral(&kernel, dimension, 1) - 1.0).abs() < 1e-5, "{kernel:?}");
                let volume = 1.0 / integral(&kernel, dimension, 2);
                assert!((volume / kernel.effective_volume() - 1.0).abs() < 1e-5, "{kernel:?}: {volume}");
            }
        }
    }
}
