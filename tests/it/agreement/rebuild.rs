//! A whole path from its vertices alone: every density of both walks, computed anew in double precision.

use std::f64::consts::FRAC_1_PI;

use glam::{DVec3, Vec2, Vec3};
use upbp_estimators::mis::oracle::{Path, PathEdge, PathVertex, VertexKind};
use upbp_estimators::observer::LightEnd;
use upbp_estimators::scene::Camera;
use upbp_estimators::{Interior, IterationPlan, MediumId, PreparedScene, Roulette};

use upbp_testing::closed_form::fog::Fog;
use upbp_testing::closed_form::light::Source;
use upbp_testing::closed_form::material::Material;
use upbp_testing::closed_form::scene::ClosedForm;

/// Closer to a boundary or an end than this, double precision does not say on which side single precision
/// was.
const TINY: f64 = 3e-6;

/// An interior vertex as it was observed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex {
    /// Place by the light sub-path.
    pub(crate) light: DVec3,
    /// Place by the camera sub-path; differs from `light` at a merge.
    pub(crate) camera: DVec3,
    pub(crate) in_medium: bool,
    /// Whether it scattered by a Dirac lobe.
    pub(crate) delta: bool,
}

impl Vertex {
    /// Whether rounding decides on which side of a boundary without a surface the vertex is.
    fn is_at_boundary(&self, scene: &ClosedForm) -> bool {
        let boundaries = scene.objects.iter().filter(|object| object.boundary.is_null());
        boundaries
            .flat_map(|object| [self.light, self.camera].map(|p| object.shape.distance(p)))
            .any(|d| d < TINY)
    }
}

/// A path as it was observed, from the light to the camera.
#[derive(Clone, Debug)]
pub(crate) struct Trace {
    pub(crate) light: LightEnd,
    pub(crate) interior: Vec<Vertex>,
    pub(crate) lens: Vec3,
    /// Place on the film, in pixels.
    pub(crate) film: Vec2,
}

/// A reason why a path cannot be rebuilt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Doubt {
    /// A vertex is within rounding of a boundary of media.
    Boundary,
    /// Two vertices are within rounding of each other.
    Coincident,
}

/// Density of a walk's distances: probability to pass, and to stop at either end.
struct Passed {
    pass_probability: [f64; 3],
    stop_at_end: [f64; 3],
    stop_at_start: [f64; 3],
    first: Option<MediumId>,
    last: Option<MediumId>,
}

/// A stretch by lane: probability to pass and density to stop. Without lanes they are those of the mixture of
/// the channels.
fn stretch(medium: &Fog, length: f64, in_lanes: bool) -> ([f64; 3], [f64; 3]) {
    if medium.sigma_s == [0.0; 3] {
        return ([1.0; 3], [0.0; 3]);
    }
    if in_lanes {
        let sigma = medium.extinction();
        return (sigma.map(|s| (-s * length).exp()), sigma.map(|s| s * (-s * length).exp()));
    }
    let mean = |f: &dyn Fn(f64) -> f64| -> f64 {
        medium.extinction().into_iter().zip(Fog::ALPHA).map(|(sigma, alpha)| alpha * f(sigma)).sum()
    };
    ([mean(&|s| (-s * length).exp()); 3], [mean(&|s| s * (-s * length).exp()); 3])
}

/// Density of passing from one point to another: the media by containment at the middle of each stretch.
fn pass(scene: &ClosedForm, from: DVec3, to: DVec3, in_lanes: bool) -> Result<Passed, Doubt> {
    let length = (to - from).length();
    if length < TINY {
        return Err(Doubt::Coincident);
    }
    let direction = (to - from) / length;
    let mut borders = vec![0.0, length];
    for object in scene.objects.iter().filter(|object| object.boundary.interior().is_some()) {
        let roots = object.shape.roots(from, direction).into_iter().flatten();
        borders.extend(roots.filter(|&t| t > TINY && t < length - TINY));
    }
    borders.sort_by(f64::total_cmp);
    // Adjoining stretches of one medium are one: a boundary that changes nothing is none.
    let mut stretches: Vec<(Option<MediumId>, f64)> = Vec::new();
    for pair in borders.windows(2) {
        let middle = from + direction * (0.5 * (pair[0] + pair[1]));
        let medium = scene.body_at(middle).and_then(|body| body.medium);
        match stretches.last_mut() {
            Some((last, length)) if *last == medium => *length += pair[1] - pair[0],
            _ => stretches.push((medium, pair[1] - pair[0])),
        }
    }
    let of = |(medium, length): &(Option<MediumId>, f64)| {
        medium.map_or(([1.0; 3], [0.0; 3]), |id| stretch(&scene.media[id.0 as usize], *length, in_lanes))
    };
    let times = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|lane| a[lane] * b[lane]);
    let pass_probability = |stretches: &[_]| stretches.iter().map(|s| of(s).0).fold([1.0; 3], times);
    let (first, last) = (stretches[0], stretches[stretches.len() - 1]);
    Ok(Passed {
        pass_probability: pass_probability(&stretches),
        stop_at_end: times(pass_probability(&stretches[..stretches.len() - 1]), of(&last).1),
        stop_at_start: times(of(&first).1, pass_probability(&stretches[1..])),
        first: first.0,
        last: last.0,
    })
}

fn henyey_greenstein(g: f64, cos: f64) -> f64 {
    0.25 * FRAC_1_PI * (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cos).powf(1.5)
}

/// Densities of scattering from one direction to another and back, as the oracle wants them, for a walk that
/// comes from the light's side.
struct Scattering {
    kind: VertexKind,
    rho_light: [f64; 3],
    rho_camera: [f64; 3],
    cos_light: f64,
    cos_camera: f64,
    sin_theta: f64,
}

/// Index of refraction next to a surface, on the side of a direction.
fn index_beside(scene: &ClosedForm, point: DVec3, normal: DVec3, direction: DVec3) -> f64 {
    let beside = point + normal * (1e-4 * direction.dot(normal).signum());
    scene.body_at(beside).map_or(1.0, |body: Interior| f64::from(body.ior))
}

fn at_surface(
    scene: &ClosedForm,
    roulette: Roulette,
    vertex: &Vertex,
    to_light: DVec3,
    to_camera: DVec3,
) -> Scattering {
    let (object, distance) = scene.surface_at(vertex.camera);
    assert!(distance < 2e-6, "{vertex:?} is {distance} off its surface");
    let material = *object.boundary.bsdf().expect("a surface");
    let normal = object.shape.normal(vertex.camera);
    let shading = object.shading_normal(vertex.camera);
    let (light, camera) = (to_light.dot(shading), to_camera.dot(shading));
    let survival = |cos| if roulette.is_on() { Material::continuation(material, cos) } else { 1.0 };
    let (rho_light, rho_camera) = if vertex.delta {
        let reflects = light * camera > 0.0;
        let index = |direction| index_beside(scene, vertex.camera, normal, direction);
        let (eta_light, eta_camera) = (index(to_light), index(to_camera));
        let (beyond_light, beyond_camera) =
            if reflects { (index(-to_light), index(-to_camera)) } else { (eta_camera, eta_light) };
        let from_light = material.dirac(light, reflects, eta_light, beyond_light);
        let from_camera = material.dirac(camera, reflects, eta_camera, beyond_camera);
        // (4.6), with the light walk's own probability as it is.
        let widening = eta_light.powi(2) * light.abs() / (eta_camera.powi(2) * camera.abs());
        (from_light, from_camera * if reflects { 1.0 } else { widening })
    } else {
        (Material::pdf(material, light, camera), Material::pdf(material, camera, light))
    };
    // The light walk arrives at its own end of a merge.
    let (light_object, _) = scene.surface_at(vertex.light);
    let arrival = light_object.shape.normal(vertex.light);
    Scattering {
        kind: if vertex.delta { VertexKind::Delta } else { VertexKind::Surface },
        rho_light: [rho_light * survival(light); 3],
        rho_camera: [rho_camera * survival(camera); 3],
        cos_light: to_light.dot(arrival).abs(),
        cos_camera: to_camera.dot(normal).abs(),
        sin_theta: 0.0,
    }
}

fn in_medium(
    scene: &ClosedForm,
    roulette: Roulette,
    medium: MediumId,
    to_light: DVec3,
    to_camera: DVec3,
    in_lanes: bool,
) -> Scattering {
    let fog = &scene.media[medium.0 as usize];
    let survival = if roulette.is_on() { Fog::CONTINUATION } else { 1.0 };
    let lobes = fog.g.map(|g| henyey_greenstein(f64::from(g), -to_light.dot(to_camera)) * survival);
    let rho = if in_lanes { lobes } else { [lobes.iter().sum::<f64>() / 3.0; 3] };
    Scattering {
        kind: VertexKind::Medium(medium),
        rho_light: rho,
        rho_camera: rho,
        cos_light: 1.0,
        cos_camera: 1.0,
        sin_theta: to_light.cross(to_camera).length(),
    }
}

/// Distance of the starts of rays from their surfaces: 32 roundings of coordinates up to 2.
const OFFSET: f64 = 8e-6;

impl Trace {
    /// Number of edges.
    pub(crate) fn length(&self) -> usize {
        self.interior.len() + 1
    }

    /// By how much rounding may change a weight, relative: tried out, with every vertex moved along every
    /// axis by what rays start off their surfaces by. Steep are refraction and cosines at grazing angles,
    /// short edges, beams that are almost parallel, chords through bodies that are only just touched.
    pub(crate) fn sensitivity(
        &self,
        scene: &ClosedForm,
        plan: &IterationPlan,
        in_lanes: bool,
        weight: impl Fn(&Path<[f64; 3]>) -> f64,
        expected: f64,
    ) -> f64 {
        // Vertices may be off their surfaces by no more than rounding, so the step is smaller and the result
        // scaled.
        const STEP: f64 = 1e-6;
        let mut sum = 0.0;
        for i in 0..self.interior.len() {
            for axis in DVec3::AXES {
                let mut moved = self.clone();
                moved.interior[i].light += STEP * axis;
                moved.interior[i].camera += STEP * axis;
                if let Ok(path) = moved.rebuild(scene, plan, in_lanes) {
                    sum += (weight(&path) / expected - 1.0).abs();
                }
            }
        }
        sum * OFFSET / STEP
    }

    /// The ends of the edges: edge i runs from the camera's side of vertex i to the light's side of vertex i
    /// + 1.
    fn ends(&self, scene: &ClosedForm) -> Vec<(DVec3, DVec3)> {
        let lens = self.lens.as_dvec3();
        let light = &scene.lights[self.light.emitter.0 as usize];
        let infinite = matches!(light.source, Source::Directional(_) | Source::Environment);
        let receiver = self.interior.first().map_or(lens, |vertex| vertex.light);
        let outwards = self.light.direction.as_dvec3();
        let start = if infinite { receiver - 20.0 * outwards } else { self.light.point.position.as_dvec3() };
        let starts = [start].into_iter().chain(self.interior.iter().map(|v| v.camera));
        starts.zip(self.interior.iter().map(|v| v.light).chain([lens])).collect()
    }

    /// The density of the start by the guide of its light, relative to the light's own.
    fn guided(&self, scene: &ClosedForm, start: DVec3, outwards: DVec3, receiver: DVec3) -> f64 {
        let light = self.light.emitter.0 as usize;
        let Some(Some(guide)) = scene.guides.get(light) else { return 1.0 };
        let pairs =
            scene.lights[light].source.coordinates(&scene.emission_bounds(), start, outwards, receiver);
        pairs.map_or(1.0, |pairs| {
            let [[a, b], [c, d]] = pairs.map(|pair| pair.unwrap_or([0.5; 2]));
            f64::from(guide.density([a, b, c, d].map(|u| (u as f32).clamp(0.0, 1.0 - f32::EPSILON / 2.0))))
        })
    }

    /// The density of the path of one edge by next events at the lens, relative to that of lens points.
    fn pdf_through_lens(&self, scene: &ClosedForm, start: DVec3, outwards: DVec3) -> f64 {
        let world = PreparedScene::new(scene).expect("the scene is in order");
        let emitter = self.light.emitter;
        let choices = world.lens_emitters(self.film).iter();
        let probability: f32 = choices.filter(|choice| choice.0 == emitter).map(|choice| choice.1).sum();
        let middle = Vec2::splat(0.5 * scene.camera.size as f32);
        let viewpoint = scene.camera.ray(middle, [0.5; 2]).expect("a ray").origin.as_dvec3();
        let point = scene.lights[emitter.0 as usize].source.pdf_incident(start, outwards, viewpoint);
        let image_area = scene.camera.image_area((viewpoint.z - start.z) as f32);
        f64::from(probability) * point * f64::from(image_area)
    }

    /// The probability that next events at a receiver choose the light, if it depends on the receiver.
    fn next_event_probability(&self, scene: &ClosedForm, receiver: DVec3) -> Option<f64> {
        let choice = scene.choice.as_ref()?;
        let mut world = PreparedScene::new(scene).expect("the scene is in order");
        world.set_emitter_choice(choice).expect("a choice of this scene");
        Some(f64::from(world.next_event_probability(receiver.as_vec3(), self.light.emitter)))
    }

    /// All densities of the path, in lanes that may be all the same.
    pub(crate) fn rebuild(
        &self,
        scene: &ClosedForm,
        plan: &IterationPlan,
        in_lanes: bool,
    ) -> Result<Path<[f64; 3]>, Doubt> {
        let roulette = plan.roulette;
        let k = self.length();
        let lens = self.lens.as_dvec3();
        if self.interior.iter().any(|vertex| vertex.is_at_boundary(scene)) {
            return Err(Doubt::Boundary);
        }
        let light = &scene.lights[self.light.emitter.0 as usize];
        let infinite = matches!(light.source, Source::Directional(_) | Source::Environment);
        let receiver = self.interior.first().map_or(lens, |vertex| vertex.light);
        let outwards = self.light.direction.as_dvec3();
        let (starts, ends): (Vec<DVec3>, Vec<DVec3>) = self.ends(scene).into_iter().unzip();
        let start = starts[0];
        let mut passed = Vec::with_capacity(k);
        for (a, b) in starts.iter().zip(&ends) {
            passed.push(pass(scene, *a, *b, in_lanes)?);
        }
        let direction = |i: usize| (ends[i] - starts[i]).normalize();

        let shares: f64 = scene.lights.iter().map(|light| f64::from(light.power)).sum();
        let probability = f64::from(light.power) / shares;
        let cos = match light.source {
            Source::Area(shape) => direction(0).dot(shape.normal(start)),
            _ => 1.0,
        };
        let [pdf_position, pdf_direction] = light.source.pdf_emission(&scene.emission_bounds(), cos);
        let pdf_direction = pdf_direction * self.guided(scene, start, outwards, receiver);
        let is_volume = matches!(light.source, Source::Volume(..));
        let end = PathVertex {
            kind: if is_volume { VertexKind::Volume } else { VertexKind::End },
            rho_light: [pdf_direction; 3],
            rho_camera: [0.0; 3],
            cos_light: 1.0,
            cos_camera: cos,
            sin_theta: 0.0,
            scale: 1.0,
        };
        let mut vertices = vec![end];
        for (i, vertex) in self.interior.iter().enumerate() {
            let (to_light, to_camera) = (-direction(i), direction(i + 1));
            let scattering = if vertex.in_medium {
                let (here, there) = (passed[i].last, passed[i + 1].first);
                let Some(medium) = here.filter(|_| here == there) else { return Err(Doubt::Boundary) };
                in_medium(scene, roulette, medium, to_light, to_camera, in_lanes)
            } else {
                at_surface(scene, roulette, vertex, to_light, to_camera)
            };
            let Scattering { kind, rho_light, rho_camera, cos_light, cos_camera, sin_theta } = scattering;
            // A merge takes place where the camera sub-path is.
            let scale = f64::from(plan.radius_field.at(vertex.camera.as_vec3()));
            vertices.push(PathVertex {
                kind,
                rho_light,
                rho_camera,
                cos_light,
                cos_camera,
                sin_theta,
                scale,
            });
        }
        let cos = -direction(k - 1).dot(DVec3::NEG_Z);
        let film = f64::from(scene.camera.film_distance);
        vertices.push(PathVertex {
            rho_light: [0.0; 3],
            rho_camera: [(film / cos).powi(2) / cos; 3],
            cos_camera: 1.0,
            kind: VertexKind::End,
            ..end
        });
        let stops = |i: usize| i >= 1 && i < k && self.interior[i - 1].in_medium;
        let edges = passed.iter().enumerate().map(|(i, passed)| PathEdge {
            distance: if infinite && i == 0 { f64::INFINITY } else { (ends[i] - starts[i]).length() },
            t_light: if stops(i + 1) { passed.stop_at_end } else { passed.pass_probability },
            t_camera: match i {
                0 if is_volume => [Source::pdf_passage(start); 3],
                _ if stops(i) => passed.stop_at_start,
                _ => passed.pass_probability,
            },
            pass_probability: passed.pass_probability,
        });
        let pdf_incident = if k == 1 {
            self.pdf_through_lens(scene, start, outwards)
        } else {
            self.next_event_probability(scene, receiver).unwrap_or(probability)
                * light.source.pdf_incident(start, outwards, receiver)
        };
        Ok(Path {
            edges: edges.collect(),
            vertices,
            pdf_position: probability * pdf_position,
            pdf_incident,
            hittable: matches!(light.source, Source::Area(_) | Source::Environment | Source::Volume(..)),
        })
    }
}
