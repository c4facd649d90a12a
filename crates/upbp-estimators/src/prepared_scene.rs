//! A scene made ready for the walks: emitters with their probabilities, bounds, the bodies around the camera.

use std::sync::Arc;

use glam::Vec2;
use upbp_media::{BodyId, Lanes, Medium, MediumId, MediumStack, RaySegment, SegmentDensity};

use crate::emission_guide::{EmissionGuide, even_numbers};
use crate::emitter_choice::{EmitterChoice, EmitterChoiceError};
use crate::emitter_selection::{EmitterSample, EmitterShares, Selection};
use crate::emitter_tree::EmitterTree;
use crate::emitters_by_receiver::{ClusterSample, ReceiverShares};
use crate::lens_emitters::LensEmitters;
use crate::random::{Decision, ONE_MINUS_EPSILON};
use crate::roulette::Surroundings;
use crate::scene::{
    BoundingSphere, Camera, CameraRay, Emission, Emitter, EmitterId, EmitterKind, EmitterPoint,
    LensConnection, PixelRect, Scene,
};

/// A [`Scene`] with all that is derived from it once.
#[derive(Debug)]
pub struct PreparedScene<'a, S: Scene> {
    /// The scene.
    pub scene: &'a S,
    /// Bounding sphere of the scene.
    pub bounds: BoundingSphere,
    /// Choice of emitters by power.
    power: Selection,
    /// Choice of emitters by place and power; `None` where that tells nothing.
    tree: Option<EmitterTree>,
    choice: Arc<EmitterChoice>,
    /// Bounds of the scene, wide enough for the camera.
    bounds_with_camera: BoundingSphere,
    surroundings: Option<Surroundings>,
    /// Bounds of light sub-paths' starts, by [`EmitterChoice::emission_bounds`].
    emission_bounds: BoundingSphere,
    environments: Vec<EmitterId>,
    /// Bodies whose volume emits and where sub-paths begin, in order.
    volumes: Vec<(BodyId, EmitterId)>,
    camera_stack: Option<MediumStack>,
    /// Emitters that the lens shows out of focus.
    lens_emitters: Option<LensEmitters>,
    emitting_media: bool,
    /// Media that are [dense](Self::is_dense).
    dense_media: Box<[bool]>,
}

/// The emitters of a scene, some volumes left out.
struct Remaining {
    volumes: Vec<(BodyId, EmitterId)>,
    power: Selection,
    tree: Option<EmitterTree>,
}

impl<'a, S: Scene> PreparedScene<'a, S> {
    /// Looks at the scene once: emitters' powers, bounds, the camera's surroundings.
    ///
    /// # Errors
    /// Bounds that are not positive and finite, a power that is negative or not finite, a crop outside of the
    /// film, a medium that does not exist around the scene.
    pub fn new(scene: &'a S) -> Result<Self, PrepareError> {
        let bounds = scene.bounds();
        if !(bounds.radius > 0.0 && bounds.radius.is_finite() && bounds.centre.is_finite()) {
            return Err(PrepareError::Bounds { centre: bounds.centre.to_array(), radius: bounds.radius });
        }
        if let Some(outside) = scene.outside()
            && outside.0 as usize >= scene.media().len()
        {
            return Err(PrepareError::Outside { medium: outside.0, media: scene.media().len() });
        }
        let camera = scene.camera();
        let (width, height) = camera.resolution();
        let crop = camera.crop();
        if !crop.is_part_of((width, height)) {
            return Err(PrepareError::Crop { width, height, crop });
        }
        let from_infinity = from_infinity::<S, f64>(scene, &bounds);
        // No light from infinity gets through: such emitters are never chosen.
        let closed = from_infinity.transmittance.is_black();
        let mut powers = Vec::with_capacity(scene.emitters().len());
        let (mut environments, mut volumes) = (Vec::new(), Vec::new());
        for (index, emitter) in scene.emitters().iter().enumerate() {
            let power = emitter.power(&bounds);
            if !(power.is_finite() && power >= 0.0) {
                return Err(PrepareError::Power { emitter: index, power });
            }
            let reaches = !(closed && emitter.kind().is_infinite());
            powers.push(if reaches { f64::from(power) } else { 0.0 });
            if reaches && emitter.kind() == EmitterKind::Environment {
                environments.push(EmitterId(index as u32));
            }
            if power > 0.0
                && let EmitterKind::Volume(body) = emitter.kind()
            {
                volumes.push((body, EmitterId(index as u32)));
            }
        }
        volumes.sort_unstable();
        let camera_stack = camera.is_pinhole().then(|| stack_of_pinhole(scene)).flatten();
        let emitting_media = scene.media().iter().any(Medium::emits);
        let is_dense = |(medium, id): (&S::Medium, u32)| {
            medium.scatters() && !(medium.mean_free_path() > DENSE * scene.medium_extent(MediumId(id)))
        };
        let dense_media = scene.media().iter().zip(0..).map(is_dense).collect();
        let bounds_with_camera = bounds_with_camera(scene, bounds);
        let power = Selection::new(&powers);
        let choice = Arc::new(EmitterChoice {
            emission: power.clone(),
            next_event: power.clone(),
            ..EmitterChoice::default()
        });
        let mut tree = tree_of(scene, &power, &bounds);
        if let Some(tree) = &mut tree {
            tree.set_shares(&power);
        }
        Ok(Self {
            scene,
            bounds,
            power,
            tree,
            choice,
            bounds_with_camera,
            surroundings: surroundings(scene, bounds_with_camera),
            emission_bounds: bounds,
            environments,
            volumes,
            camera_stack,
            lens_emitters: LensEmitters::new(scene, &bounds, &powers),
            emitting_media,
            dense_media,
        })
    }

    /// A sphere around the bounds of the scene and the camera.
    #[must_use]
    pub const fn bounds_with_camera(&self) -> BoundingSphere {
        self.bounds_with_camera
    }

    /// The medium around the scene in which walks get lost. `None` without such a medium, or if it emits:
    /// then what is far away is no less bright.
    #[must_use]
    pub const fn surroundings(&self) -> Option<Surroundings> {
        self.surroundings
    }

    /// Chooses emitters by what they bring instead of by power: `emission` where light sub-paths start,
    /// `next_event` where camera vertices look for light. Either way the choice must not depend on samples
    /// that it serves.
    ///
    /// Power keeps a share, so that no emitter is lost that was not seen.
    pub fn choose_emitters_by(&mut self, emission: &EmitterShares, next_event: &EmitterShares) {
        let [emission, next_event] = [emission, next_event].map(|shares| self.power.blend(shares));
        self.change(|choice| (choice.emission, choice.next_event) = (emission, next_event));
    }

    /// Chooses emitters by power and evenly, half each, to measure what they bring.
    pub fn choose_emitters_to_measure(&mut self) {
        let spread = self.power.spread();
        self.change(|choice| (choice.emission, choice.next_event) = (spread.clone(), spread));
    }

    /// Whether the choice of emitters for next events can depend on the receiver: at least two emitters say
    /// where they are.
    #[must_use]
    pub const fn can_choose_by_receiver(&self) -> bool {
        self.tree.is_some()
    }

    /// Chooses emitters for next events by the place of the receiver: by their [bounds](Emitter::bounds), and
    /// by the light that next events have brought to receivers in its neighbourhood. Samples must have been
    /// made by the choice at hand, and this one must not depend on samples that it serves. Without bounds it
    /// changes nothing.
    pub fn choose_by_receiver(&mut self, samples: &[(glam::Vec3, EmitterSample)]) {
        let Some(tree) = &self.tree else { return };
        let of_cluster = |&(receiver, sample): &(glam::Vec3, EmitterSample)| {
            let (cluster, [_, within]) = tree.probability(sample.emitter, receiver)?;
            let EmitterSample { light, others, .. } = sample;
            Some(ClusterSample { receiver, cluster, light, others: others / within })
        };
        let samples: Vec<_> = samples.iter().filter_map(of_cluster).collect();
        let receivers = Some(ReceiverShares::fit(&samples, &self.bounds_with_camera));
        self.change(|choice| choice.receivers = receivers);
    }

    /// Chooses emitters for next events alike for all receivers.
    pub fn choose_alike(&mut self) {
        self.change(|choice| choice.receivers = None);
    }

    fn change(&mut self, change: impl FnOnce(&mut EmitterChoice)) {
        let mut choice = EmitterChoice::clone(&self.choice);
        change(&mut choice);
        self.set(Arc::new(choice));
    }

    fn set(&mut self, choice: Arc<EmitterChoice>) {
        if let Some(tree) = &mut self.tree {
            tree.set_shares(&choice.next_event);
        }
        self.emission_bounds = choice.emission_bounds(&self.bounds);
        self.choice = choice;
    }

    /// The sphere that emitters' methods are given; light from infinity starts on a disc in front of it.
    #[must_use]
    pub const fn emission_bounds(&self) -> &BoundingSphere {
        &self.emission_bounds
    }

    /// Starts light from infinity on discs around a point, which guides lead to: finite, and the same for all
    /// that guides learn from and are used with.
    pub fn focus_emission(&mut self, focus: glam::Vec3) {
        self.change(|choice| choice.focus = Some(focus));
    }

    /// Chooses emitters by power, and starts no light sub-path by a guide, as in the beginning.
    pub fn choose_emitters_by_power(&mut self) {
        let power = || self.power.clone();
        let by_power = EmitterChoice { emission: power(), next_event: power(), ..EmitterChoice::default() };
        self.set(Arc::new(by_power));
    }

    /// Starts the light sub-paths of some emitters by guides; those that are left out go by themselves. The
    /// guides must not depend on samples that they serve. Without guides there is no
    /// [focus](Self::focus_emission) either.
    ///
    /// # Panics
    /// If there are more guides than emitters.
    pub fn guide_emission(&mut self, guides: Vec<Option<EmissionGuide>>) {
        assert!(guides.len() <= self.scene.emitters().len(), "a guide per emitter");
        let guides = if guides.iter().all(Option::is_none) { Vec::new() } else { guides };
        self.change(|choice| {
            choice.focus = choice.focus.filter(|_| !guides.is_empty());
            choice.guides = guides;
        });
    }

    /// The choice of emitters, for a plan.
    #[must_use]
    pub const fn emitter_choice(&self) -> &Arc<EmitterChoice> {
        &self.choice
    }

    /// Chooses emitters as a plan says; volumes that it never chooses are
    /// [left out](Self::leave_out_volumes).
    ///
    /// # Errors
    /// If the choice is among other emitters than those of the scene, or leaves out one that shines; if it
    /// has a guide that an emitter cannot follow; if light from infinity cannot start on discs around its
    /// focus; if it is by receivers that choose among other clusters. The scene is unchanged then.
    pub fn set_emitter_choice(&mut self, choice: &Arc<EmitterChoice>) -> Result<(), EmitterChoiceError> {
        let rest = self.without_volumes(|emitter| choice.emission.probability(emitter) == 0.0);
        let (power, tree) = rest.as_ref().map_or((&self.power, &self.tree), |rest| (&rest.power, &rest.tree));
        let clusters = tree.as_ref().map(EmitterTree::clusters);
        let axes = |emitter| self.emission_axes(emitter).unwrap_or_default();
        choice.check(power, clusters, &self.bounds, axes)?;
        if let Some(rest) = rest {
            self.keep(rest);
        }
        self.set(choice.clone());
        Ok(())
    }

    /// Chooses the emitter of a light sub-path; returns its probability. `None` without light.
    #[must_use]
    pub(crate) fn choose_emission(&self, u: f32) -> Option<(EmitterId, f32)> {
        self.choice.emission.choose(f64::from(u))
    }

    /// The probability that a light sub-path starts at an emitter; 0 if the emitter does not exist.
    #[must_use]
    pub fn emission_probability(&self, emitter: EmitterId) -> f32 {
        self.choice.emission.probability(emitter)
    }

    /// Starts a light sub-path at an emitter, guided if there is a guide; densities are of the guided start.
    /// `None` if the start brings no light, or the emitter does not exist.
    #[must_use]
    pub fn sample_emission(
        &self,
        emitter: EmitterId,
        [u_position, u_direction]: [[f32; 2]; 2],
    ) -> Option<Emission> {
        let light = self.scene.emitters().get(emitter.0 as usize)?;
        let Some(guide) = self.choice.guide(emitter) else {
            return light.sample_emission(&self.emission_bounds, u_position, u_direction);
        };
        let ([a, b, c, d], factor) =
            guide.warp([u_position[0], u_position[1], u_direction[0], u_direction[1]]);
        let emission = light.sample_emission(&self.emission_bounds, [a, b], [c, d])?;
        Some(Emission { pdf_direction: emission.pdf_direction * factor, ..emission })
    }

    /// The density of light sub-paths that leave `point` of an emitter in `direction` and pass `on_ray`,
    /// relative to the density of the emitter's own distribution: 1 without a [guide](EmissionGuide).
    #[must_use]
    pub fn emission_factor(
        &self,
        emitter: EmitterId,
        point: &EmitterPoint,
        direction: glam::Vec3,
        on_ray: glam::Vec3,
    ) -> f32 {
        let Some(guide) = self.choice.guide(emitter) else { return 1.0 };
        // What cannot be started at all is only compared with itself: any factor will do.
        self.emission_coordinates(emitter, point, direction, on_ray).map_or(1.0, |at| guide.density(at))
    }

    /// Random numbers of a start that the emitter tells, thus those that a guide may split. `None` if it
    /// tells none, or if none of a few starts bring light.
    #[must_use]
    pub fn emission_axes(&self, emitter: EmitterId) -> Option<[bool; 4]> {
        /// Starts that are tried.
        const STARTS: usize = 16;
        let light = self.scene.emitters().get(emitter.0 as usize)?;
        let bounds = &self.emission_bounds;
        (0..STARTS).find_map(|index| {
            let [a, b, c, d] = even_numbers(index);
            let start = light.sample_emission(bounds, [a, b], [c, d])?;
            let position = start.point.position;
            let found = light.emission_coordinates(bounds, &start.point, start.direction, position)?;
            let [position, direction] = [found.position.is_some(), found.direction.is_some()];
            Some([position, position, direction, direction])
        })
    }

    /// The random numbers of a start ([`Emitter::emission_coordinates`]); those that are not known are one
    /// half.
    #[must_use]
    pub fn emission_coordinates(
        &self,
        emitter: EmitterId,
        point: &EmitterPoint,
        direction: glam::Vec3,
        on_ray: glam::Vec3,
    ) -> Option<[f32; 4]> {
        let light = self.scene.emitters().get(emitter.0 as usize)?;
        let found = light.emission_coordinates(&self.emission_bounds, point, direction, on_ray)?;
        let [a, b] = found.position.unwrap_or([0.5; 2]);
        let [c, d] = found.direction.unwrap_or([0.5; 2]);
        let at = [a, b, c, d].map(|x| x.clamp(0.0, ONE_MINUS_EPSILON));
        (!at.iter().any(|x| x.is_nan())).then_some(at)
    }

    /// Chooses the emitter of a next event at `receiver`; returns its probability. `None` without light.
    #[must_use]
    pub fn choose_next_event(&self, receiver: glam::Vec3, decision: Decision) -> Option<(EmitterId, f32)> {
        self.choice.next_event(self.tree.as_ref(), receiver, decision)
    }

    /// The probability of [`choose_next_event`](Self::choose_next_event); 0 if the emitter does not exist.
    #[must_use]
    pub fn next_event_probability(&self, receiver: glam::Vec3, emitter: EmitterId) -> f32 {
        self.choice.next_event_probability(self.tree.as_ref(), receiver, emitter)
    }

    /// Leaves volumes that emit to the rays that pass through them: no sub-path begins there any more. Other
    /// kinds of emitters stay; all are chosen by power.
    pub fn leave_out_volumes(&mut self, is_left_out: impl Fn(EmitterId) -> bool) {
        if let Some(rest) = self.without_volumes(is_left_out) {
            self.keep(rest);
            self.choose_emitters_by_power();
        }
    }

    /// The emitters without some volumes; `None` if all of them stay.
    fn without_volumes(&self, is_left_out: impl Fn(EmitterId) -> bool) -> Option<Remaining> {
        let (out, volumes): (Vec<_>, Vec<_>) =
            self.volumes.iter().copied().partition(|&(_, emitter)| is_left_out(emitter));
        if out.is_empty() {
            return None;
        }
        let power = self.power.without(|id| out.iter().any(|&(_, other)| other == id));
        // What is left to hits must not be found by next events: they would not be weighed beside each other.
        let tree = tree_of(self.scene, &power, &self.bounds);
        Some(Remaining { volumes, power, tree })
    }

    /// Forgets the emitters that do not remain; emitters have yet to be chosen anew.
    fn keep(&mut self, Remaining { volumes, power, tree }: Remaining) {
        (self.volumes, self.power, self.tree) = (volumes, power, tree);
    }

    /// The emitter that is the volume of a body, if sub-paths begin there.
    #[must_use]
    pub(crate) fn volume_emitter(&self, body: BodyId) -> Option<EmitterId> {
        let place = self.volumes.binary_search_by_key(&body, |&(body, _)| body).ok()?;
        Some(self.volumes[place].1)
    }

    /// The emitters that are volumes of bodies, and that sub-paths begin at.
    pub fn volume_emitters(&self) -> impl Iterator<Item = EmitterId> + '_ {
        self.volumes.iter().map(|&(_, emitter)| emitter)
    }

    /// Whether sub-paths begin in the volume of any body.
    #[must_use]
    pub const fn has_volume_emitters(&self) -> bool {
        !self.volumes.is_empty()
    }

    /// The emitters that every escaping ray hits.
    #[must_use]
    pub fn environments(&self) -> &[EmitterId] {
        &self.environments
    }

    /// Whether any emitter can be chosen.
    #[must_use]
    pub fn has_emitters(&self) -> bool {
        !self.power.is_empty()
    }

    /// The probability that a walk passes an infinite length of the medium around everything.
    #[must_use]
    pub(crate) fn passes_from_infinity<L: Lanes>(&self) -> L {
        from_infinity(self.scene, &self.bounds).pass_probability
    }

    /// Whether any medium emits light.
    #[must_use]
    pub const fn has_emitting_media(&self) -> bool {
        self.emitting_media
    }

    /// Whether a medium is so dense that rounding often puts a vertex in it on the other side of its
    /// boundary. A ray that is followed from there to the next surface or to infinity finds out; one that is
    /// followed to the next collision does not.
    #[must_use]
    pub fn is_dense(&self, medium: MediumId) -> bool {
        self.dense_media.get(medium.0 as usize).is_some_and(|dense| *dense)
    }

    /// The emitters that may be seen out of focus at a place of the film, with the probabilities of
    /// [`choose_through_lens`](Self::choose_through_lens).
    #[must_use]
    pub fn lens_emitters(&self, film: Vec2) -> &[(EmitterId, f32)] {
        self.lens_emitters.as_ref().map_or(&[], |emitters| emitters.at(film))
    }

    /// Whether any place of the film may see an emitter out of focus.
    #[must_use]
    pub const fn has_lens_emitters(&self) -> bool {
        self.lens_emitters.is_some()
    }

    /// Chooses a point of an emitter that may be seen at a place of the film through some point of the lens.
    #[must_use]
    pub fn choose_through_lens(
        &self,
        film: Vec2,
        u: f32,
        u_point: [f32; 2],
    ) -> Option<(EmitterId, EmitterPoint)> {
        let emitters = self.lens_emitters.as_ref()?;
        let (emitter, _) = emitters.choose(film, u)?;
        let light = &self.scene.emitters()[emitter.0 as usize];
        let incident = light.sample_incident(&self.emission_bounds, emitters.viewpoint, u_point)?;
        Some((emitter, incident.point))
    }

    /// The connection of a point that [`choose_through_lens`](Self::choose_through_lens) may choose at a
    /// place of the film, and the density of the path of one edge, relative to the density of lens points:
    /// the probability of the emitter, times the density of the point per area, times the
    /// [area of its image](LensConnection::image_area). `None` if the point is not chosen there.
    #[must_use]
    pub(crate) fn connect_through_lens(
        &self,
        emitter: EmitterId,
        point: &EmitterPoint,
        film: Vec2,
    ) -> Option<(LensConnection, f64)> {
        let emitters = self.lens_emitters.as_ref()?;
        let (_, probability) = emitters.at(film).iter().find(|(other, _)| *other == emitter)?;
        let connection = self.scene.camera().connect_at(point.position, film)?;
        let direction = (emitters.viewpoint - point.position).try_normalize()?;
        let light = &self.scene.emitters()[emitter.0 as usize];
        let seen = light.hit(&self.emission_bounds, point, direction, emitters.viewpoint)?;
        let pdf_point = f64::from(*probability) * f64::from(seen.pdf_incident);
        Some((connection, pdf_point * f64::from(connection.image_area)))
    }

    /// The bodies around a point of the lens.
    #[must_use]
    pub(crate) fn stack_at_camera(&self, lens: glam::Vec3) -> MediumStack {
        self.camera_stack.clone().unwrap_or_else(|| self.scene.stack_at(lens))
    }
}

/// The smallest sphere around the bounds of a scene and its camera.
fn bounds_with_camera<S: Scene>(scene: &S, bounds: BoundingSphere) -> BoundingSphere {
    let Some(eye) = ray_through_centre(scene).map(|ray| ray.origin) else { return bounds };
    let beyond = eye.distance(bounds.centre) - bounds.radius;
    if !(beyond > 0.0 && beyond.is_finite()) {
        return bounds;
    }
    let towards_eye = (eye - bounds.centre).normalize();
    BoundingSphere {
        centre: bounds.centre + 0.5 * beyond * towards_eye,
        radius: bounds.radius + 0.5 * beyond,
    }
}

fn surroundings<S: Scene>(scene: &S, within: BoundingSphere) -> Option<Surroundings> {
    let medium = &scene.media()[scene.outside()?.0 as usize];
    let forward = medium.phase().mean_cosine().max_component().max(0.0);
    let free_path = medium.mean_free_path().max(0.0) / (1.0 - forward);
    (medium.scatters() && !medium.emits() && free_path.is_finite())
        .then_some(Surroundings { within, free_path })
}

/// An infinite length of the medium around everything.
fn from_infinity<S: Scene, L: Lanes>(scene: &S, bounds: &BoundingSphere) -> SegmentDensity<L> {
    let everything =
        RaySegment { origin: bounds.centre, direction: glam::Vec3::Z, start: 0.0, end: f32::INFINITY };
    let medium = scene.outside().map(|medium| &scene.media()[medium.0 as usize]);
    medium.map_or(SegmentDensity::VACUUM, |medium| L::segment(medium, &everything))
}

/// Whether light from infinity gets through the medium around everything in some channels and not in others.
pub(crate) fn arrives_in_part<S: Scene>(scene: &S) -> bool {
    let passes = from_infinity::<S, f64>(scene, &scene.bounds()).pass_probability;
    0.0 < passes && passes < 1.0 && scene.emitters().iter().any(|emitter| emitter.kind().is_infinite())
}

/// The bodies in which a pinhole camera is, if its ray through the middle of the film can be had.
fn stack_of_pinhole<S: Scene>(scene: &S) -> Option<MediumStack> {
    let ray = ray_through_centre(scene)?;
    // Ahead of the pinhole, which may stand on a boundary.
    Some(scene.stack_at(upbp_accel::offset_origin(ray.origin, ray.direction, ray.direction)))
}

/// The camera's ray through the middle of what it renders, if it can be had.
fn ray_through_centre<S: Scene>(scene: &S) -> Option<CameraRay> {
    let crop = scene.camera().crop();
    let centre = Vec2::new(crop.x as f32 + 0.5 * crop.width as f32, crop.y as f32 + 0.5 * crop.height as f32);
    scene.camera().ray(centre, [0.5; 2])
}

/// The tree over the emitters that can be chosen by `power`.
fn tree_of<S: Scene>(scene: &S, power: &Selection, bounds: &BoundingSphere) -> Option<EmitterTree> {
    let emitters = scene.emitters();
    let is_chosen = |i: usize| power.probability(EmitterId(i as u32)) > 0.0;
    let powers: Vec<_> = (0..emitters.len())
        .map(|i| if is_chosen(i) { f64::from(emitters[i].power(bounds)) } else { 0.0 })
        .collect();
    EmitterTree::new(emitters, &powers, bounds)
}

/// Media whose mean free path is a smaller part of their [extent](Scene::medium_extent) are dense: of their
/// vertices next to a boundary, one in ten thousand is within rounding of it.
const DENSE: f32 = 1e-3;

/// A fault of a scene as a whole.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PrepareError {
    /// Bounds without a finite centre or a positive radius.
    #[error(
        "bounds of the scene: expected a finite centre and a positive finite radius, found {centre:?} and {radius}"
    )]
    Bounds {
        /// Centre that was given.
        centre: [f32; 3],
        /// Radius that was given.
        radius: f32,
    },
    /// Power of an emitter.
    #[error("emitter {emitter}: expected a finite power >= 0, found {power}")]
    Power {
        /// Index of the emitter.
        emitter: usize,
        /// Power that it claims.
        power: f32,
    },
    /// A crop that is not a part of the film, or an empty one.
    #[error(
        "crop: expected a non-empty part of the film of {width} x {height} pixels, found {} x {} at ({}, {})",
        crop.width, crop.height, crop.x, crop.y
    )]
    Crop {
        /// Width of the film.
        width: u32,
        /// Height of the film.
        height: u32,
        /// Crop of the camera.
        crop: PixelRect,
    },
    /// The medium around everything.
    #[error("medium around the scene: index {medium}, but there are {media} media")]
    Outside {
        /// The index.
        medium: u32,
        /// The number of media.
        media: usize,
    },
}
