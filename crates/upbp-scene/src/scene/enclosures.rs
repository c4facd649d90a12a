//! Straight lines between places and ends of paths that surfaces all around bodies cut off.

use upbp_estimators::scene::{EmitterId, PathEnd};
use upbp_media::BodyId;

/// Knowledge of bodies that no line goes into or out of without meeting a surface: enclosed ones.
#[derive(Clone, Debug, Default)]
pub(crate) struct Enclosures {
    /// By the number of the body: the ends that may be where it counts, if it is enclosed.
    within: Vec<Option<Ends>>,
    /// By the number of the light: the enclosed body that counts all over it.
    lights: Vec<Option<BodyId>>,
    /// The enclosed body that counts all over the lens.
    lens: Option<BodyId>,
    /// By the number of the body: whether every light is hidden from where it counts.
    is_dark: Vec<bool>,
    /// Whether every light is hidden from where no body counts.
    is_dark_outside: bool,
}

/// Ends of paths.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Ends {
    /// Lights, the lowest first.
    pub(crate) lights: Vec<EmitterId>,
    pub(crate) lens: bool,
}

impl Enclosures {
    /// By the numbers of bodies, `within`, and of lights, `lights`.
    pub(crate) fn new(within: Vec<Option<Ends>>, lights: Vec<Option<BodyId>>, lens: Option<BodyId>) -> Self {
        let mut new = Self { within, lights, lens, is_dark: Vec::new(), is_dark_outside: false };
        new.is_dark_outside = new.lights.iter().all(Option::is_some);
        let is_dark = |body: u32| match new.ends(BodyId(body)) {
            Some(ends) => ends.lights.iter().all(|&light| new.is_elsewhere(Some(BodyId(body)), light)),
            None => new.is_dark_outside,
        };
        new.is_dark = (0..new.within.len() as u32).map(is_dark).collect();
        new
    }

    /// Whether a body is enclosed.
    pub(crate) fn contains(&self, body: BodyId) -> bool {
        self.ends(body).is_some()
    }

    /// [`Scene::hides`](upbp_estimators::scene::Scene::hides).
    #[inline]
    pub(crate) fn hides(&self, body: Option<BodyId>, end: PathEnd) -> bool {
        let ends = || body.and_then(|body| self.ends(body));
        match end {
            PathEnd::Lights => match body {
                Some(body) => self.is_dark.get(body.0 as usize).copied().unwrap_or(false),
                None => self.is_dark_outside,
            },
            PathEnd::Light(light) => {
                self.is_elsewhere(body, light)
                    || ends().is_some_and(|ends| ends.lights.binary_search(&light).is_err())
            }
            PathEnd::Lens => {
                self.lens.is_some_and(|lens| body != Some(lens)) || ends().is_some_and(|ends| !ends.lens)
            }
        }
    }

    #[inline]
    fn ends(&self, body: BodyId) -> Option<&Ends> {
        self.within.get(body.0 as usize)?.as_ref()
    }

    /// Whether a light is all within an enclosed body that is not `body`.
    #[inline]
    fn is_elsewhere(&self, body: Option<BodyId>, light: EmitterId) -> bool {
        let home = self.lights.get(light.0 as usize).copied().flatten();
        home.is_some_and(|home| body != Some(home))
    }
}
