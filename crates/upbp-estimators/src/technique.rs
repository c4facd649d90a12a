//! Techniques and their sets, with one spelling everywhere.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// One way to sample a path (`docs/theory.md`, section 2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Technique {
    /// A camera sub-path hits an emitter, escapes to an environment, or passes through an emitting medium.
    Hit,
    /// Next event estimation: a camera sub-path's vertex is connected to a point on an emitter.
    Nee,
    /// A camera sub-path's vertex is connected to a light sub-path's vertex.
    Connect,
    /// A light sub-path's vertex is connected to the camera.
    LightTracing,
    /// Surface photons around a camera sub-path's surface vertex (vertex merging).
    Surf,
    /// Photon points around a query point, three-dimensional kernel.
    Pp3d,
    /// Photon points around a query beam, two-dimensional kernel.
    Pb2d,
    /// Photon beams around a query point, two-dimensional kernel.
    Bp2d,
    /// Photon beams around a query beam, one-dimensional kernel.
    Bb1d,
}

impl Technique {
    /// Number of techniques.
    pub const COUNT: usize = 9;

    /// All techniques, in the order of their bits and layers.
    pub const ALL: [Self; Self::COUNT] = [
        Self::Hit,
        Self::Nee,
        Self::Connect,
        Self::LightTracing,
        Self::Surf,
        Self::Pp3d,
        Self::Pb2d,
        Self::Bp2d,
        Self::Bb1d,
    ];

    /// The techniques that [merge](Self::merges), in the same order.
    pub const MERGES: [Self; 5] = [Self::Surf, Self::Pp3d, Self::Pb2d, Self::Bp2d, Self::Bb1d];

    /// Whether a camera vertex makes its samples, however many light sub-paths there are.
    #[must_use]
    pub const fn is_per_camera_vertex(self) -> bool {
        matches!(self, Self::Hit | Self::Nee | Self::Connect)
    }

    /// Whether it merges light sub-paths with camera sub-paths within a kernel.
    #[must_use]
    pub const fn merges(self) -> bool {
        match self {
            Self::Hit | Self::Nee | Self::Connect | Self::LightTracing => false,
            Self::Surf | Self::Pp3d | Self::Pb2d | Self::Bp2d | Self::Bb1d => true,
        }
    }

    /// Whether it merges photon beams.
    #[must_use]
    pub const fn uses_beams(self) -> bool {
        matches!(self, Self::Bp2d | Self::Bb1d)
    }

    /// The name in settings and reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hit => "hit",
            Self::Nee => "nee",
            Self::Connect => "connect",
            Self::LightTracing => "lt",
            Self::Surf => "surf",
            Self::Pp3d => "pp3d",
            Self::Pb2d => "pb2d",
            Self::Bp2d => "bp2d",
            Self::Bb1d => "bb1d",
        }
    }

    /// The image layer that its contributions go to.
    #[must_use]
    pub const fn layer(self) -> Layer {
        match self {
            Self::Hit | Self::Nee | Self::Connect | Self::LightTracing => Layer::Bpt,
            Self::Surf => Layer::Surf,
            Self::Pp3d => Layer::Pp3d,
            Self::Pb2d => Layer::Pb2d,
            Self::Bp2d => Layer::Bp2d,
            Self::Bb1d => Layer::Bb1d,
        }
    }
}

/// One value for each technique, in the order of [`Technique::ALL`].
pub type PerTechnique<T> = [T; Technique::COUNT];

/// One value for each technique that merges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PerMerge<T> {
    /// Surface merging.
    pub surf: T,
    /// Photon points around query points.
    pub pp3d: T,
    /// Photon points around query beams.
    pub pb2d: T,
    /// Photon beams around query points.
    pub bp2d: T,
    /// Photon beams around query beams.
    pub bb1d: T,
}

impl<T> PerMerge<T> {
    /// The values of a function of the technique.
    #[must_use]
    pub fn from_fn(mut value: impl FnMut(Technique) -> T) -> Self {
        Self {
            surf: value(Technique::Surf),
            pp3d: value(Technique::Pp3d),
            pb2d: value(Technique::Pb2d),
            bp2d: value(Technique::Bp2d),
            bb1d: value(Technique::Bb1d),
        }
    }

    /// Applies a function to each value.
    #[must_use]
    pub fn map<U>(self, mut function: impl FnMut(T) -> U) -> PerMerge<U> {
        PerMerge {
            surf: function(self.surf),
            pp3d: function(self.pp3d),
            pb2d: function(self.pb2d),
            bp2d: function(self.bp2d),
            bb1d: function(self.bb1d),
        }
    }

    /// The value of a technique; `None` if it merges nothing.
    #[inline]
    #[must_use]
    pub const fn get(&self, technique: Technique) -> Option<&T> {
        match technique {
            Technique::Surf => Some(&self.surf),
            Technique::Pp3d => Some(&self.pp3d),
            Technique::Pb2d => Some(&self.pb2d),
            Technique::Bp2d => Some(&self.bp2d),
            Technique::Bb1d => Some(&self.bb1d),
            Technique::Hit | Technique::Nee | Technique::Connect | Technique::LightTracing => None,
        }
    }
}

/// A layer of the image: the weighted contributions of a technique, all of bidirectional path tracing in one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Layer {
    /// Emission hits, next events, connections and light tracing.
    Bpt,
    /// Surface merging.
    Surf,
    /// Photon points around points.
    Pp3d,
    /// Photon points around query beams.
    Pb2d,
    /// Photon beams around points.
    Bp2d,
    /// Photon beams around query beams.
    Bb1d,
}

impl Layer {
    /// Number of layers.
    pub const COUNT: usize = 6;

    /// All layers, in order.
    pub const ALL: [Self; Self::COUNT] =
        [Self::Bpt, Self::Surf, Self::Pp3d, Self::Pb2d, Self::Bp2d, Self::Bb1d];

    /// The name in images and reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bpt => "bpt",
            Self::Surf => "surf",
            Self::Pp3d => "pp3d",
            Self::Pb2d => "pb2d",
            Self::Bp2d => "bp2d",
            Self::Bb1d => "bb1d",
        }
    }
}

/// A set of techniques, written as in `"bpt+surf+pp3d+pb2d+bb1d"` ([`STANDARD`](Self::STANDARD)).
///
/// `bpt` stands for `hit+nee+connect+lt`, `pt` for `hit+nee`, `all` for everything.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct TechniqueSet(u16);

impl TechniqueSet {
    /// No technique: a black image.
    pub const EMPTY: Self = Self(0);
    /// Bidirectional path tracing.
    pub const BPT: Self = Self(0b0_0000_1111);
    /// Path tracing.
    pub const PT: Self = Self(0b0_0000_0011);
    /// Bidirectional path tracing with all merges but BP2D.
    pub const STANDARD: Self = Self(0b1_0111_1111);
    /// Every technique.
    pub const ALL: Self = Self(0b1_1111_1111);
    /// The techniques with photons in media.
    pub const VOLUME_MERGES: Self = Self(0b1_1110_0000);
    /// The techniques with photon beams.
    pub const BEAMS: Self = Self(0b1_1000_0000);
    /// The techniques with light sub-paths.
    pub const LIGHT_PATHS: Self = Self(0b1_1111_1100);

    /// The set of one technique.
    #[must_use]
    pub const fn only(technique: Technique) -> Self {
        Self(1 << technique as u8)
    }

    /// Whether `technique` is in the set.
    #[must_use]
    pub const fn has(self, technique: Technique) -> bool {
        self.0 & (1 << technique as u8) != 0
    }

    /// The set with `technique`.
    #[must_use]
    pub const fn with(self, technique: Technique) -> Self {
        Self(self.0 | 1 << technique as u8)
    }

    /// The set without the techniques of `other`.
    #[must_use]
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// The techniques in either set.
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The techniques in both sets.
    #[must_use]
    pub const fn intersection(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// Whether any of `other` is in the set.
    #[must_use]
    pub const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// Whether the set is empty.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The techniques of the set, in order.
    pub fn iter(self) -> impl Iterator<Item = Technique> {
        Technique::ALL.into_iter().filter(move |t| self.has(*t))
    }
}

impl FromIterator<Technique> for TechniqueSet {
    fn from_iter<I: IntoIterator<Item = Technique>>(techniques: I) -> Self {
        techniques.into_iter().fold(Self::EMPTY, Self::with)
    }
}

impl fmt::Display for TechniqueSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut rest = *self;
        let mut names = Vec::new();
        if rest.0 & Self::BPT.0 == Self::BPT.0 {
            names.push("bpt");
            rest = rest.without(Self::BPT);
        }
        names.extend(rest.iter().map(Technique::name));
        f.write_str(&names.join("+"))
    }
}

/// A technique name that does not exist.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "unknown technique `{name}`, expected names joined by `+`: bpt, pt, hit, nee, connect, lt, surf, pp3d, pb2d, \
     bp2d, bb1d, all"
)]
pub struct UnknownTechnique {
    /// The name that was given.
    pub name: String,
}

impl FromStr for TechniqueSet {
    type Err = UnknownTechnique;

    fn from_str(text: &str) -> Result<Self, UnknownTechnique> {
        let mut set = Self::EMPTY;
        for part in text.split('+') {
            let name = part.trim().to_ascii_lowercase();
            set = match name.as_str() {
                "bpt" => set.union(Self::BPT),
                "pt" => set.union(Self::PT),
                "all" => Self::ALL,
                other => match Technique::ALL.into_iter().find(|t| t.name() == other) {
                    Some(technique) => set.with(technique),
                    None => return Err(UnknownTechnique { name: part.trim().to_owned() }),
                },
            };
        }
        Ok(set)
    }
}

impl TryFrom<String> for TechniqueSet {
    type Error = UnknownTechnique;

    fn try_from(text: String) -> Result<Self, UnknownTechnique> {
        text.parse()
    }
}

impl From<TechniqueSet> for String {
    fn from(set: TechniqueSet) -> Self {
        set.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_set_survives_its_spelling() {
        for bits in 1..=TechniqueSet::ALL.0 {
            let set = TechniqueSet(bits);
            assert_eq!(set.to_string().parse(), Ok(set));
        }
        assert_eq!(TechniqueSet::STANDARD.to_string(), "bpt+surf+pp3d+pb2d+bb1d");
        assert_eq!(" BPT + pp3d".parse::<TechniqueSet>(), Ok(TechniqueSet::BPT.with(Technique::Pp3d)));
    }

    #[test]
    fn an_unknown_name_is_named() {
        let error = "bpt+beams".parse::<TechniqueSet>().unwrap_err();
        assert_eq!(error.name, "beams");
        assert!("".parse::<TechniqueSet>().is_err());
    }
}
