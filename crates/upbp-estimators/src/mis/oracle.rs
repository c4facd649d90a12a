//! The weights by enumeration: slow, obvious, the oracle of the recursion (`docs/theory.md`, sections 1.2,
//! 2.1 and 3.3).
//!
//! A path is described whole, every density of both walks at every vertex and edge; the effective density of
//! each technique is a product over the path, taken in logarithms. With [lanes](Lanes) it is the sum over all
//! pairs of heroes, of the light and of the camera sub-path, of their probabilities times these products
//! (section 6.13). Nothing is shared with the recursion but the constants of the [`MisPlan`].

use upbp_media::{Lanes, MediumId};

use super::counts::{BeamExtent, Heuristic, MisPlan, PARALLEL_SIN2, VolumeMerge};

/// The kind of a vertex of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum VertexKind {
    /// The light end or the camera end.
    End,
    /// The light end in an emitting volume: `tC_0` of its edge is the density with which weights take camera
    /// sub-paths that pass there to stop.
    Volume,
    /// A surface vertex that can be connected and merged.
    Surface,
    /// A medium vertex.
    Medium(MediumId),
    /// A surface vertex where a Dirac lobe scatters.
    Delta,
}

/// A vertex of a path; index 0 is on the light. Densities of directions are those of each of the lanes `L`;
/// at the ends all lanes have the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathVertex<L = f64> {
    /// Kind of the vertex.
    pub kind: VertexKind,
    /// `ρL_i`: solid-angle density (Dirac: probability) of the light walk towards the camera's side, roulette
    /// included.
    pub rho_light: L,
    /// `ρC_i`: the same of the camera walk towards the light's side.
    pub rho_camera: L,
    /// `χ_i` towards the light's side; 1 in media.
    pub cos_light: f64,
    /// `χ_i` towards the camera's side; 1 in media.
    pub cos_camera: f64,
    /// Sine of the angle between the two lines at a medium vertex.
    pub sin_theta: f64,
    /// Kernel radii there, relative to those of the plan.
    pub scale: f64,
}

impl PathVertex {
    /// The vertex with the densities of directions that `light` and `camera` make of those of the two walks.
    #[must_use]
    pub fn with_lanes<L>(self, light: impl FnOnce(f64) -> L, camera: impl FnOnce(f64) -> L) -> PathVertex<L> {
        let Self { kind, rho_light, rho_camera, cos_light, cos_camera, sin_theta, scale } = self;
        let (rho_light, rho_camera) = (light(rho_light), camera(rho_camera));
        PathVertex { kind, rho_light, rho_camera, cos_light, cos_camera, sin_theta, scale }
    }
}

/// The edge between vertices `i` and `i + 1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathEdge<L = f64> {
    /// Distance in scene units, infinite for an infinite emitter.
    pub distance: f64,
    /// `tL_{i+1}`: density of the light walk stopping at the camera-side vertex.
    pub t_light: L,
    /// `tC_i`: density of the camera walk stopping at the light-side vertex.
    pub t_camera: L,
    /// Probability to pass the edge.
    pub pass_probability: L,
}

/// A whole path with `edges.len() + 1` vertices, of walks in the lanes `L`.
#[derive(Clone, Debug, PartialEq)]
pub struct Path<L = f64> {
    /// Vertices from the light to the camera.
    pub vertices: Vec<PathVertex<L>>,
    /// Edges from the light to the camera.
    pub edges: Vec<PathEdge<L>>,
    /// `L_0`, with the choice of the emitter.
    pub pdf_position: f64,
    /// `p_nee(x_0 | x_1)`, with the choice of the emitter; with one edge, at the lens, times the area of the
    /// image of `x_0`.
    pub pdf_incident: f64,
    /// Whether the emitter can be hit.
    pub hittable: bool,
}

/// One technique applied to one place of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Strategy {
    /// The camera sub-path makes all vertices.
    Hit,
    /// Next event at vertex 1, which may be the lens.
    Nee,
    /// A connection of vertices `s − 1` and `s`.
    Connect(usize),
    /// The light sub-path makes all vertices but the camera.
    LightTracing,
    /// Surface merging at a vertex.
    Surf(usize),
    /// PP3D at a vertex.
    Pp3d(usize),
    /// PB2D at a vertex.
    Pb2d(usize),
    /// BP2D at a vertex.
    Bp2d(usize),
    /// BB1D at a vertex.
    Bb1d(usize),
}

/// The logarithm of a density; −∞ of zero.
fn log(x: f64) -> f64 {
    if x > 0.0 { x.ln() } else { f64::NEG_INFINITY }
}

impl<L: Lanes> Path<L> {
    /// Number of edges.
    #[must_use]
    pub fn length(&self) -> usize {
        self.edges.len()
    }

    /// `L_i`, i ≥ 1, but for the distance: density of vertex `i` as the light walk of a hero makes it.
    fn light_density(&self, i: usize, hero: usize) -> f64 {
        let edge = &self.edges[i - 1];
        let d2 = if edge.distance.is_finite() { edge.distance * edge.distance } else { 1.0 };
        self.vertices[i - 1].rho_light.get(hero) * self.vertices[i].cos_light / d2
    }

    /// `C_i`, i ≤ k − 1, but for the distance: density of vertex `i` as the camera walk of a hero makes it.
    fn camera_density(&self, i: usize, hero: usize) -> f64 {
        let edge = &self.edges[i];
        let d2 = if edge.distance.is_finite() { edge.distance * edge.distance } else { 1.0 };
        self.vertices[i + 1].rho_camera.get(hero) * self.vertices[i].cos_camera / d2
    }

    /// The logarithms of the effective densities, counts included, of all strategies, if the light sub-path
    /// has the lane `hero_light` and the camera sub-path `hero_camera`.
    fn densities(&self, plan: &MisPlan, hero_light: usize, hero_camera: usize) -> Vec<(Strategy, f64)> {
        let k = self.length();
        let ok = |i: usize| matches!(self.vertices[i].kind, VertexKind::Surface | VertexKind::Medium(_));
        let light_density = |i: usize| self.light_density(i, hero_light);
        let camera_density = |i: usize| self.camera_density(i, hero_camera);
        let t_light = |i: usize| self.edges[i - 1].t_light.get(hero_light);
        let t_camera = |i: usize| self.edges[i].t_camera.get(hero_camera);

        // A[s] = Σ_{i<s} ln L_i,  B[s] = Σ_{i≥s} ln C_i; the camera end has density 1.
        let mut light = vec![0.0; k + 1];
        light[1] = log(self.pdf_position);
        for s in 2..=k {
            light[s] = light[s - 1] + log(light_density(s - 1)) + log(t_light(s - 1));
        }
        let mut camera = vec![0.0; k + 1];
        for s in (0..k).rev() {
            camera[s] = camera[s + 1] + log(camera_density(s)) + log(t_camera(s));
        }

        let mut densities = Vec::new();
        let mut push = |strategy, count: f64, log_density: f64| {
            if count > 0.0 && log_density > f64::NEG_INFINITY {
                densities.push((strategy, count.ln() + log_density));
            }
        };
        if self.hittable {
            push(Strategy::Hit, plan.hit, camera[0]);
        }
        if k == 1 || ok(1) {
            push(Strategy::Nee, plan.nee, log(self.pdf_incident) + camera[1]);
        }
        if k >= 2 {
            for s in 2..k {
                if ok(s - 1) && ok(s) {
                    push(Strategy::Connect(s), plan.connect, light[s] + camera[s]);
                }
            }
            if ok(k - 1) {
                push(Strategy::LightTracing, plan.light_tracing, light[k] + camera[k]);
            }
        }
        for i in 1..k {
            let both = light[i] + log(light_density(i)) + log(camera_density(i)) + camera[i + 1];
            match self.vertices[i].kind {
                VertexKind::Surface => {
                    let both = both + log(t_light(i)) + log(t_camera(i));
                    push(Strategy::Surf(i), plan.surf * self.vertices[i].scale.powi(2), both);
                }
                VertexKind::Medium(medium) => {
                    let v = plan.merges_in(medium);
                    let beam = |extent, passes: f64| match extent {
                        BeamExtent::Short => log(passes),
                        BeamExtent::Long => 0.0,
                    };
                    // In another medium neither walk stops here, whatever its lane, and no beam counts.
                    let stops =
                        self.edges[i - 1].t_light.is_positive() && self.edges[i].t_camera.is_positive();
                    let both = if stops { both } else { f64::NEG_INFINITY };
                    let point = [log(t_light(i)), log(t_camera(i))];
                    let beam = [
                        beam(plan.photon_beams, self.edges[i - 1].pass_probability.get(hero_light)),
                        beam(plan.query_beams, self.edges[i].pass_probability.get(hero_camera)),
                    ];
                    let sin = self.vertices[i].sin_theta;
                    let sin = if sin * sin < PARALLEL_SIN2 { 0.0 } else { sin };
                    // Effective volume by its dimension, and 6.5 with the radius here.
                    let here = |merge: VolumeMerge, dimension| {
                        let VolumeMerge { count, width, greatest_scale } = merge;
                        let scale = self.vertices[i].scale.min(f64::from(greatest_scale));
                        count * (1.0 + width) * scale.powi(dimension) / (1.0 + width * scale.powi(4))
                    };
                    push(Strategy::Pp3d(i), here(v.pp3d, 3), both + point[0] + point[1]);
                    push(Strategy::Pb2d(i), here(v.pb2d, 2), both + point[0] + beam[1]);
                    push(Strategy::Bp2d(i), here(v.bp2d, 2), both + beam[0] + point[1]);
                    push(Strategy::Bb1d(i), here(v.bb1d, 1), both + beam[0] + beam[1] + log(sin));
                }
                VertexKind::End | VertexKind::Volume | VertexKind::Delta => {}
            }
        }
        densities
    }

    /// Densities for any heroes: the sum over all pairs, each with its probability.
    fn densities_of_all_heroes(&self, plan: &MisPlan) -> Vec<(Strategy, f64)> {
        let probability = |lane: usize| if L::COUNT == 1 { 1.0 } else { plan.lanes[lane] };
        let mut sums: Vec<(Strategy, f64)> = Vec::new();
        for light in 0..L::COUNT {
            for camera in 0..L::COUNT {
                let pair = log(probability(light)) + log(probability(camera));
                if pair == f64::NEG_INFINITY {
                    continue;
                }
                for (strategy, density) in self.densities(plan, light, camera) {
                    let density = pair + density;
                    match sums.iter_mut().find(|(other, _)| *other == strategy) {
                        Some((_, sum)) => {
                            let (small, large) = (sum.min(density), sum.max(density));
                            *sum = large + (small - large).exp().ln_1p();
                        }
                        None => sums.push((strategy, density)),
                    }
                }
            }
        }
        sums
    }

    /// The weights of all strategies that the plan runs and that can make this path; they sum to one.
    #[must_use]
    pub fn weights(&self, plan: &MisPlan) -> Vec<(Strategy, f64)> {
        let densities = self.densities_of_all_heroes(plan);
        let exponent = match plan.heuristic {
            Heuristic::Balance => 1.0,
            Heuristic::Power => 2.0,
        };
        let largest = densities.iter().map(|d| d.1).fold(f64::NEG_INFINITY, f64::max);
        let total: f64 = densities.iter().map(|d| (exponent * (d.1 - largest)).exp()).sum();
        densities.into_iter().map(|(s, q)| (s, (exponent * (q - largest)).exp() / total)).collect()
    }

    /// The weight of one strategy, 0 if it cannot make the path.
    #[must_use]
    pub fn weight(&self, plan: &MisPlan, strategy: Strategy) -> f64 {
        self.weights(plan).into_iter().find(|(s, _)| *s == strategy).map_or(0.0, |(_, w)| w)
    }
}
