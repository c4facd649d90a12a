//! Weights by the recursion, for abstract paths.

use upbp_estimators::Technique;
use upbp_estimators::mis::oracle::{Path, PathEdge, PathVertex, Strategy as Way, VertexKind};
use upbp_estimators::mis::{
    Densities, DistanceDensity, Edge, EdgeMis, EdgeStart, MergeKind, MisPlan, VertexMis, VolumeMerges, Weight,
};
use upbp_estimators::scene::Walk;
use upbp_media::Lanes;

/// Weights by the recursion, with exactly the calls that the walks make.
pub(crate) struct Recursion<'a, D: Densities, L: Lanes = f64> {
    plan: &'a MisPlan,
    path: &'a Path<L>,
    /// By vertex; those that a walk does not arrive at stay empty.
    pub(crate) light: Vec<VertexMis<D, L>>,
    pub(crate) camera: Vec<VertexMis<D, L>>,
    /// On arrival of the camera walk at the light, with next events as connections.
    pub(crate) at_light: VertexMis<D, L>,
}

pub(crate) fn is_ok<L>(vertex: &PathVertex<L>) -> bool {
    matches!(vertex.kind, VertexKind::Surface | VertexKind::Medium(_))
}

fn in_medium<L>(vertex: &PathVertex<L>) -> bool {
    matches!(vertex.kind, VertexKind::Medium(_))
}

fn start<L>(vertex: &PathVertex<L>) -> EdgeStart {
    match vertex.kind {
        VertexKind::Medium(_) => EdgeStart::Medium,
        VertexKind::Volume => EdgeStart::Volume,
        VertexKind::End | VertexKind::Surface | VertexKind::Delta => EdgeStart::Surface,
    }
}

fn kind<L>(vertex: &PathVertex<L>) -> MergeKind {
    match vertex.kind {
        VertexKind::Surface => MergeKind::Surface { scale: vertex.scale },
        VertexKind::Medium(medium) => {
            MergeKind::Medium { medium, sin_theta: vertex.sin_theta, scale: vertex.scale }
        }
        VertexKind::End | VertexKind::Volume | VertexKind::Delta => MergeKind::None,
    }
}

fn distance_squared<L>(edge: &PathEdge<L>) -> f64 {
    if edge.distance.is_finite() { edge.distance * edge.distance } else { 1.0 }
}

/// The values that a vertex passes on after it has scattered.
fn scatter<D: Densities, L: Lanes>(
    plan: &MisPlan,
    vertex: &PathVertex<L>,
    vertex_mis: &VertexMis<D, L>,
    rho_own: L,
    rho_opposite: L,
    cos_out: f64,
) -> EdgeMis<D, L> {
    let (rho, shares) = rho_own.step(&vertex_mis.shares);
    let vertex_mis = if is_ok(vertex) { *vertex_mis } else { VertexMis { connect: D::ZERO, ..*vertex_mis } };
    EdgeMis {
        before: vertex_mis.before_each(plan, rho_opposite),
        rho,
        cos_out,
        kind: kind(vertex),
        distance_factor: vertex_mis.distance_factor,
        shares,
        connectible: is_ok(vertex),
        start: start(vertex),
    }
}

impl<'a, D: Densities, L: Lanes> Recursion<'a, D, L> {
    pub(crate) fn new(plan: &'a MisPlan, path: &'a Path<L>) -> Self {
        let (k, v) = (path.length(), &path.vertices);
        let nowhere = VertexMis::<D, L> {
            connect: D::ZERO,
            below: L::each(|_| D::ZERO),
            distance_factor: 0.0,
            shares: L::prior(&plan.lanes),
        };
        let mut light = vec![nowhere; k + 1];
        let hit = match v[0].kind {
            VertexKind::Volume => path.edges[0].t_camera.mean(&L::prior(&plan.lanes)),
            _ => f64::from(u8::from(path.hittable)),
        };
        let pdf_direction = v[0].rho_light.get(0);
        let mut edge_mis =
            EdgeMis::at_light(plan, start(&v[0]), hit, v[0].cos_camera, path.pdf_position, pdf_direction);
        for i in 1..k {
            let e = &path.edges[i - 1];
            let edge = Edge {
                distance_squared: distance_squared(e),
                cos_in: v[i].cos_light,
                forward: e.t_light,
                backward: if edge_mis.start == EdgeStart::Volume { L::ONE } else { e.t_camera },
                pass_probability: e.pass_probability,
                ends_in_medium: in_medium(&v[i]),
            };
            let connections = if !is_ok(&v[i]) {
                D::ZERO
            } else if i == 1 {
                D::of(Technique::Nee, plan.pow(plan.nee * path.pdf_incident / path.pdf_position))
            } else {
                plan.connections()
            };
            light[i] = edge_mis.arrive(plan, Walk::Light, &edge, connections);
            edge_mis = scatter(plan, &v[i], &light[i], v[i].rho_light, v[i].rho_camera, v[i].cos_camera);
        }
        let mut camera = vec![nowhere; k + 1];
        let mut at_light = nowhere;
        let mut edge_mis = EdgeMis::at_camera(plan, v[k].rho_camera.get(0));
        for i in (0..k).rev() {
            let e = &path.edges[i];
            let edge = Edge {
                distance_squared: distance_squared(e),
                cos_in: v[i].cos_camera,
                forward: e.t_camera,
                backward: e.t_light,
                pass_probability: e.pass_probability,
                ends_in_medium: in_medium(&v[i]),
            };
            if i == 0 {
                let next_events = D::of(Technique::Nee, plan.pow(plan.nee));
                at_light = edge_mis.arrive(plan, Walk::Camera, &edge, next_events);
                break;
            }
            let connections = if !is_ok(&v[i]) {
                D::ZERO
            } else if i + 1 == k {
                D::of(Technique::LightTracing, plan.pow(plan.light_tracing))
            } else {
                plan.connections()
            };
            camera[i] = edge_mis.arrive(plan, Walk::Camera, &edge, connections);
            edge_mis = scatter(plan, &v[i], &camera[i], v[i].rho_camera, v[i].rho_light, v[i].cos_light);
        }
        Self { plan, path, light, camera, at_light }
    }

    /// The end of the light sub-path at vertex `i`, with the edge that the camera's side would arrive by,
    /// from where its lanes have `shares`.
    fn light_end(&self, i: usize, shares: &L::Shares) -> D {
        let (vertex, edge) = (&self.path.vertices[i], &self.path.edges[i]);
        let (rho, shares) = self.path.vertices[i + 1].rho_camera.step(shares);
        let other = self.plan.other_walk(
            Walk::Camera,
            in_medium(vertex),
            edge.pass_probability,
            edge.t_camera,
            &shares,
        );
        let density = rho * vertex.cos_camera / distance_squared(edge);
        self.light[i].end(self.plan, Walk::Light, kind(vertex), &other, vertex.rho_camera, density)
    }

    /// The end of the camera sub-path at vertex `i`, with the edge that the light's side would arrive by,
    /// from where its lanes have `shares`; its density times `factor`.
    fn camera_end(&self, i: usize, shares: &L::Shares, factor: f64) -> D {
        let (vertex, edge) = (&self.path.vertices[i], &self.path.edges[i - 1]);
        let (rho, shares) = self.path.vertices[i - 1].rho_light.step(shares);
        let other = self.plan.other_walk(
            Walk::Light,
            in_medium(vertex),
            edge.pass_probability,
            edge.t_light,
            &shares,
        );
        let density = factor * rho * vertex.cos_light / distance_squared(edge);
        self.camera[i].end(self.plan, Walk::Camera, kind(vertex), &other, vertex.rho_light, density)
    }

    /// `C_0`, given that vertex 1 scatters towards it.
    fn hit_density(&self) -> f64 {
        let (edge, v) = (&self.path.edges[0], &self.path.vertices);
        let at_camera = L::prior(&self.plan.lanes);
        let before = if self.path.length() == 1 { &at_camera } else { &self.camera[1].shares };
        let (rho, shares) = v[1].rho_camera.step(before);
        let t = edge.t_camera.mean(&shares);
        rho * v[0].cos_camera / distance_squared(edge) * t
    }

    fn merge(&self, i: usize, factor: impl Fn(&VolumeMerges) -> f64) -> Weight<D> {
        let vertex = &self.path.vertices[i];
        let (light, camera) = (&self.light[i], &self.camera[i]);
        let (factor, merges) = if let VertexKind::Medium(medium) = vertex.kind {
            let [light, camera] =
                [light.distance_factor, camera.distance_factor].map(DistanceDensity::at_stop);
            let factors = self.plan.volume_factors(medium, light, camera, vertex.sin_theta, vertex.scale);
            (factor(&factors), factors.sum())
        } else {
            let factor = self.plan.surface_factor(vertex.scale);
            (factor, D::of(Technique::Surf, factor))
        };
        let before_light = light.before(self.plan, vertex.rho_camera, &camera.shares);
        let before_camera = camera.before(self.plan, vertex.rho_light, &light.shares);
        Weight::of_merge(factor, merges, before_light, before_camera)
    }

    pub(crate) fn weight(&self, way: Way) -> Weight<D> {
        let Self { plan, path, .. } = *self;
        let k = path.length();
        let rho_light = path.vertices[0].rho_light.get(0);
        let start = L::prior(&plan.lanes);
        match way {
            Way::Hit if k == 1 => plan.direct_hit_weight(path.pdf_incident, self.hit_density()),
            Way::Nee if k == 1 => {
                let hit_density = if path.hittable { self.hit_density() } else { 0.0 };
                plan.nee_weight(path.pdf_incident, hit_density, D::ZERO)
            }
            Way::Hit => plan.hit_weight(&self.at_light, path.pdf_incident, path.pdf_position, rho_light),
            Way::Nee => plan.nee_weight(
                path.pdf_incident,
                if path.hittable { self.hit_density() } else { 0.0 },
                self.camera_end(1, &start, path.pdf_position / path.pdf_incident),
            ),
            Way::Connect(s) => plan.connect_weight(
                self.light_end(s - 1, &self.camera[s].shares),
                self.camera_end(s, &self.light[s - 1].shares, 1.0),
            ),
            Way::LightTracing => plan.light_tracing_weight(self.light_end(k - 1, &start)),
            Way::Surf(i) => self.merge(i, |_| 0.0),
            Way::Pp3d(i) => self.merge(i, |v| v.pp3d),
            Way::Pb2d(i) => self.merge(i, |v| v.pb2d),
            Way::Bp2d(i) => self.merge(i, |v| v.bp2d),
            Way::Bb1d(i) => self.merge(i, |v| v.bb1d),
        }
    }
}

impl<D: Densities> Recursion<'_, D> {
    /// `L_i`, given that vertex `i − 1` scatters towards it.
    pub(crate) fn light_density(&self, i: usize) -> f64 {
        let (edge, v) = (&self.path.edges[i - 1], &self.path.vertices);
        v[i - 1].rho_light * v[i].cos_light / distance_squared(edge) * edge.t_light
    }

    /// `C_i`, given that vertex `i + 1` scatters towards it.
    pub(crate) fn camera_density(&self, i: usize) -> f64 {
        let (edge, v) = (&self.path.edges[i], &self.path.vertices);
        v[i + 1].rho_camera * v[i].cos_camera / distance_squared(edge) * edge.t_camera
    }
}
