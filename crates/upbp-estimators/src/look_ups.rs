//! Which camera sub-paths look photons up.
//!
//! A look-up that brings little need not be made by every camera sub-path: with probability `p` it is made, its contributions
//! count `1/p` times, and in weights its number of samples is `p n`. So the weights of a path sum to one for any `p`, and a
//! technique that hardly pays but may be the only one for some paths stays, at a part of its cost.

use crate::random::Stream;
use crate::technique::Technique;

/// The probability of each look-up, in `(0, 1]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LookUps {
    /// Surface merging.
    pub surf: f32,
    /// PP3D.
    pub pp3d: f32,
    /// PB2D.
    pub pb2d: f32,
    /// BP2D.
    pub bp2d: f32,
    /// BB1D.
    pub bb1d: f32,
}

impl LookUps {
    /// Every camera sub-path makes all of them.
    pub const ALL: Self = Self { surf: 1.0, pp3d: 1.0, pb2d: 1.0, bp2d: 1.0, bb1d: 1.0 };

    /// The probability of a technique's look-up; 1 for what looks nothing up.
    #[must_use]
    pub const fn probability(&self, technique: Technique) -> f32 {
        match technique {
            Technique::Surf => self.surf,
            Technique::Pp3d => self.pp3d,
            Technique::Pb2d => self.pb2d,
            Technique::Bp2d => self.bp2d,
            Technique::Bb1d => self.bb1d,
            Technique::Hit | Technique::Nee | Technique::Connect | Technique::LightTracing => 1.0,
        }
    }

    /// Decides for one camera sub-path: the inverse probability of what it looks up, 0 for what it does not.
    #[inline]
    pub(crate) fn draw(&self, stream: &mut Stream) -> Self {
        // Not a random number where there is nothing to decide.
        let mut decide = |p: f32| match p {
            1.0 => 1.0,
            p if stream.uniform() < p => p.recip(),
            _ => 0.0,
        };
        Self {
            surf: decide(self.surf),
            pp3d: decide(self.pp3d),
            pb2d: decide(self.pb2d),
            bp2d: decide(self.bp2d),
            bb1d: decide(self.bb1d),
        }
    }
}
