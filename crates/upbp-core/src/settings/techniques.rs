//! Techniques as a setting: chosen by the render, or by the user.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use upbp_estimators::{TechniqueSet, UnknownTechnique};

/// The techniques that run, written as `"auto"` or as a set such as `"bpt+surf"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Techniques {
    /// The techniques that pay in the scene, with the numbers of samples that pay most ([`crate::Plan`]).
    #[default]
    Auto,
    /// A given set, as far as the scene can use it.
    Set(TechniqueSet),
}

impl Techniques {
    /// The techniques that may run.
    #[must_use]
    pub fn candidates(self) -> TechniqueSet {
        match self {
            Self::Auto => TechniqueSet::STANDARD,
            Self::Set(set) => set,
        }
    }
}

impl From<TechniqueSet> for Techniques {
    fn from(set: TechniqueSet) -> Self {
        Self::Set(set)
    }
}

impl fmt::Display for Techniques {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Set(set) => set.fmt(f),
        }
    }
}

impl FromStr for Techniques {
    type Err = UnknownTechniques;

    fn from_str(text: &str) -> Result<Self, UnknownTechniques> {
        if text.trim().eq_ignore_ascii_case("auto") {
            Ok(Self::Auto)
        } else {
            text.parse().map(Self::Set).map_err(UnknownTechniques)
        }
    }
}

/// Neither `auto` nor a set of techniques.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}; or auto")]
pub struct UnknownTechniques(UnknownTechnique);

impl TryFrom<String> for Techniques {
    type Error = UnknownTechniques;

    fn try_from(text: String) -> Result<Self, UnknownTechniques> {
        text.parse()
    }
}

impl From<Techniques> for String {
    fn from(techniques: Techniques) -> Self {
        techniques.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spelling() {
        for text in ["auto", "bpt+surf", "hit"] {
            assert_eq!(text.parse::<Techniques>().unwrap().to_string(), text);
        }
        assert_eq!(" Auto".parse(), Ok(Techniques::Auto));
        let error = "bpt+auto".parse::<Techniques>().unwrap_err().to_string();
        assert!(error.contains("`auto`") && error.ends_with("or auto"), "{error}");
    }
}
