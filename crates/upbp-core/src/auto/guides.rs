//! Guides to the starts of light sub-paths that the picture needs (`docs/theory.md`, section 6.11).
//!
//! Where a glass ball is a millionth of what the sun shines on, no light sub-path of a small run meets it. So
//! the first guides lead to where camera sub-paths have been: to points of specular surfaces, behind which
//! there may be a caustic, and to points that next events found lit. What the light sub-paths that follow
//! these guides bring to the picture makes the next ones. A guide stays if one that half of the starts make
//! leads to those of the other half.

use glam::Vec3;
use upbp_estimators::observer::LightEnd;
use upbp_estimators::scene::{Emitter, EmitterId, EmitterKind, Scene};
use upbp_estimators::{
    EmissionGuide, EmissionSample, IterationPlan, PreparedScene, StreamKind, TechniqueSet,
};

use super::photon_distances::median;

/// Part of the first guide that leads to specular surfaces; the rest leads to lit points.
const SPECULAR: f64 = 0.6;
/// Part of all further guides that leads where the first one leads: the few starts that have brought light do
/// not outline what they met, and what lies beside their cells is bright and rare.
const PART_OF_FIRST: f64 = 0.3;
/// Points of specular surfaces that are enough.
const MOST_POINTS: usize = 4096;
/// Factor by which a guide has to multiply the starts that lead to the light, a geometric mean over this
/// light. Half of the starts stay where they are, so that other light loses up to a factor of two, of which a
/// small run may see nothing; but most of a lamp's light may be direct, where a guide changes little, and the
/// caustic beside it is what light sub-paths are for.
const LEAST_GAIN: f64 = 1.25;
/// Starts that brought light from which on they tell whether a guide is worth it. Fewer say that there was no
/// time to find out.
const LEAST_STARTS: usize = 8;
/// The most that one start may count of the light of all, as it is before any counts less: one that is bright
/// because it is rare would draw most of the guided starts to its own cell.
const BRIGHTEST: f64 = 0.03;

/// Starts of light sub-paths that a run has found useful, and points that others may lead to.
#[derive(Default)]
pub(super) struct Evidence {
    /// Starts of light sub-paths, with the weighted light that they brought to the picture.
    pub(super) starts: Vec<(LightEnd, f64)>,
    /// Points on lights, with receivers that see them.
    pub(super) lit: Vec<(LightEnd, Vec3)>,
    /// Points of specular surfaces that camera sub-paths have met.
    pub(super) specular: Vec<Vec3>,
}

/// Starts at one emitter.
#[derive(Clone, Default)]
pub(super) struct Starts(Vec<EmissionSample>);

impl Starts {
    fn push(&mut self, at: [f32; 4], light: f64) {
        self.0.push(EmissionSample { at, light });
    }

    /// The guide to these starts, which splits only the `axes` that matter.
    fn fit(&self, axes: [bool; 4]) -> Option<EmissionGuide> {
        EmissionGuide::fit(&self.0, axes)
    }

    fn light(&self) -> f64 {
        self.0.iter().map(|sample| sample.light).sum()
    }

    /// Two halves, of every other start.
    fn halves(&self) -> [Self; 2] {
        [0, 1].map(|first| Self(self.0.iter().copied().skip(first).step_by(2).collect()))
    }

    /// The factor by which a guide multiplies the starts that lead to this light, a geometric mean over the
    /// light; 1 without light.
    fn gain(&self, guide: &EmissionGuide) -> f64 {
        let logarithms: f64 =
            self.0.iter().map(|sample| sample.light * f64::from(guide.density(sample.at)).ln()).sum();
        (logarithms / self.light().max(f64::MIN_POSITIVE)).exp()
    }

    /// Lets no start count for more than a part of the light of all as it was.
    fn clip(&mut self, part: f64) {
        let most = part * self.light();
        self.0.iter_mut().for_each(|sample| sample.light = sample.light.min(most));
    }

    /// Adds other starts, if there are any, as a part of all light.
    fn add(&mut self, other: &Self, part: f64) {
        let others = other.light();
        if others == 0.0 {
            return;
        }
        let scale = part / (1.0 - part) * self.light() / others;
        let scaled = |sample: &EmissionSample| EmissionSample { light: scale * sample.light, ..*sample };
        self.0.extend(other.0.iter().map(scaled));
    }
}

/// Whether techniques start light sub-paths, at an emitter that tells its random numbers.
pub(super) fn can_guide<S: Scene>(scene: &PreparedScene<'_, S>, techniques: TechniqueSet) -> bool {
    let mut emitters = (0..scene.scene.emitters().len() as u32).map(EmitterId);
    techniques.intersects(TechniqueSet::LIGHT_PATHS)
        && emitters.any(|emitter| scene.emission_axes(emitter).is_some())
}

/// Point that guided starts should pass: amid the specular surfaces that camera sub-paths have met. `None`
/// without light from infinity that comes from many directions: for any other the place on a disc does not
/// depend on the direction.
pub(super) fn focus<S: Scene>(scene: &PreparedScene<'_, S>, seen: &Evidence) -> Option<Vec3> {
    if !scene.scene.emitters().iter().any(|light| light.kind() == EmitterKind::Environment) {
        return None;
    }
    let along = |axis: usize| median(&mut seen.specular.iter().map(|p| p[axis]).collect::<Vec<_>>());
    Some(Vec3::new(along(0)?, along(1)?, along(2)?)).filter(|focus| focus.is_finite())
}

/// Starts, by emitter, that lead to where camera sub-paths have been; none without specular surfaces, since
/// next events find what is lit there.
pub(super) fn first<S: Scene>(
    scene: &PreparedScene<'_, S>,
    plan: &IterationPlan,
    seen: &Evidence,
) -> Vec<Starts> {
    let mut starts = vec![Starts::default(); scene.scene.emitters().len()];
    if seen.specular.is_empty() {
        return starts;
    }
    let mut add = |end: &LightEnd, on_ray: Vec3, light: f64| {
        let at = scene.emission_coordinates(end.emitter, &end.point, end.direction, on_ray);
        if let (Some(at), Some(starts)) = (at, starts.get_mut(end.emitter.0 as usize)) {
            starts.push(at, light);
        }
    };
    for (end, receiver) in &seen.lit {
        add(end, *receiver, (1.0 - SPECULAR) / seen.lit.len() as f64);
    }
    let step = seen.specular.len().div_ceil(MOST_POINTS).max(1);
    let points = seen.specular.len().div_ceil(step);
    for (index, &point) in seen.specular.iter().step_by(step).enumerate() {
        let mut stream = plan.stream(StreamKind::PilotLight, index as u64);
        let Some((emitter, _)) = scene.choose_next_event(point, stream.decide()) else { continue };
        let light = &scene.scene.emitters()[emitter.0 as usize];
        if let Some(incident) = light.sample_incident(scene.emission_bounds(), point, stream.pair()) {
            let end = LightEnd { emitter, point: incident.point, direction: -incident.towards_light };
            add(&end, point, SPECULAR / points as f64);
        }
    }
    starts
}

/// Guides to all of these starts.
pub(super) fn to_all<S: Scene>(
    scene: &PreparedScene<'_, S>,
    starts: &[Starts],
) -> Vec<Option<EmissionGuide>> {
    let guide = |(emitter, starts): (u32, &Starts)| starts.fit(scene.emission_axes(EmitterId(emitter))?);
    (0..).zip(starts).map(guide).collect()
}

/// Guides to the starts that brought light to the picture, at emitters where they are worth it: where a guide
/// that was made of one half of these starts leads to the other half. Logarithms are compared, for second
/// moments of so few starts are those of the brightest. Where hardly any have brought light, the scene keeps
/// the guide that it has, unless they lie elsewhere.
pub(super) fn next<S: Scene>(
    scene: &PreparedScene<'_, S>,
    seen: &Evidence,
    first: &[Starts],
) -> Vec<Option<EmissionGuide>> {
    let mut starts = vec![Starts::default(); scene.scene.emitters().len()];
    for (end, light) in &seen.starts {
        let at = scene.emission_coordinates(end.emitter, &end.point, end.direction, end.point.position);
        if let Some(at) = at {
            starts[end.emitter.0 as usize].push(at, *light);
        }
    }
    let guide = |(emitter, (starts, first)): (u32, (Starts, &Starts))| {
        let emitter = EmitterId(emitter);
        if starts.0.iter().filter(|start| start.light > 0.0).count() < LEAST_STARTS {
            let guide = scene.emitter_choice().guide(emitter);
            return guide.filter(|guide| starts.light() == 0.0 || starts.gain(guide) > LEAST_GAIN).cloned();
        }
        let axes = scene.emission_axes(emitter)?;
        let with_first = |mut starts: Starts| {
            starts.clip(BRIGHTEST);
            starts.add(first, PART_OF_FIRST);
            starts.fit(axes)
        };
        let [some, others] = starts.halves();
        let is_worth = with_first(some).is_some_and(|guide| others.gain(&guide) > LEAST_GAIN);
        if is_worth { with_first(starts) } else { None }
    };
    (0..).zip(starts.into_iter().zip(first)).map(guide).collect()
}
