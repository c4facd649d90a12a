//! Random abstract paths and plans: hard cases first, shared by the tests of this crate.

use proptest::collection::vec;
use proptest::prelude::*;
use upbp_estimators::MediumId;
use upbp_estimators::mis::oracle::{Path, PathEdge, PathVertex, VertexKind};
use upbp_estimators::mis::{BeamExtent, Heuristic, MisPlan, PARALLEL_SIN2, VolumeMerge, VolumeMerges};

/// The number of techniques, in the order hit, nee, connect, light tracing, surf, pp3d, pb2d, bp2d, bb1d.
pub(crate) const TECHNIQUES: u32 = 9;

/// The number of media of a plan.
pub(crate) const MEDIA: u32 = 3;

/// A number between `e^{-spread}` and `e^{spread}`.
fn around_one(spread: f64) -> impl Strategy<Value = f64> {
    (-spread..spread).prop_map(f64::exp)
}

/// A density of which nothing is known; now and then the walk cannot go that way at all.
fn density(spread: f64) -> impl Strategy<Value = f64> {
    prop_oneof![19 => around_one(spread), 1 => Just(0.0)]
}

fn cosine() -> impl Strategy<Value = f64> {
    prop_oneof![4 => 1e-3..1.0, 1 => Just(1e-6)]
}

fn sine() -> impl Strategy<Value = f64> {
    let threshold = PARALLEL_SIN2.sqrt();
    prop_oneof![8 => 1e-3..1.0, 1 => Just(0.5 * threshold), 1 => Just(2.0 * threshold), 1 => Just(0.0)]
}

fn vertex(spread: f64) -> impl Strategy<Value = PathVertex> {
    let kind = prop_oneof![
        2 => Just(VertexKind::Surface),
        3 => (0..MEDIA).prop_map(|medium| VertexKind::Medium(MediumId(medium))),
        1 => Just(VertexKind::Delta),
    ];
    let scale = prop_oneof![1 => Just(1.0), 3 => around_one(3.0)];
    (kind, density(spread), density(spread), cosine(), cosine(), sine(), scale).prop_map(
        |(kind, rho_light, rho_camera, cos_light, cos_camera, sin_theta, scale)| {
            let in_medium = matches!(kind, VertexKind::Medium(_));
            PathVertex {
                kind,
                rho_light,
                rho_camera,
                cos_light: if in_medium { 1.0 } else { cos_light },
                cos_camera: if in_medium { 1.0 } else { cos_camera },
                sin_theta: if in_medium { sin_theta } else { 0.0 },
                scale,
            }
        },
    )
}

/// Distance, probability to pass, and the densities of stopping at either end, should it be in a medium.
fn edge(spread: f64) -> impl Strategy<Value = [f64; 4]> {
    let pass_probability = prop_oneof![3 => 1e-6..1.0, 1 => Just(1.0)];
    (around_one(spread), pass_probability, around_one(spread), around_one(spread))
        .prop_map(|(d, r, a, b)| [d, r, a, b])
}

/// The kind of light that a path starts on.
#[derive(Clone, Copy, Debug)]
enum Light {
    Area,
    Point,
    Directional,
    Environment,
    Volume,
}

/// A path of 1 to `longest` edges whose densities lie between `e^{-spread}` and `e^{spread}`, independent in
/// the two directions.
pub(crate) fn path(longest: usize, spread: f64) -> impl Strategy<Value = Path> {
    let light = prop_oneof![
        Just(Light::Area),
        Just(Light::Point),
        Just(Light::Directional),
        Just(Light::Environment),
        Just(Light::Volume),
    ];
    let ends =
        (light, around_one(spread), around_one(spread), around_one(spread), around_one(spread), cosine());
    (vec((vertex(spread), edge(spread)), 0..longest), edge(spread), ends).prop_map(|(steps, last, ends)| {
        let (light, rho_light, rho_camera, pdf_position, pdf_incident, cos) = ends;
        let end = PathVertex {
            kind: VertexKind::End,
            rho_light,
            rho_camera,
            cos_light: 1.0,
            cos_camera: 1.0,
            sin_theta: 0.0,
            scale: 1.0,
        };
        let cos_camera = if matches!(light, Light::Area) { cos } else { 1.0 };
        let kind = if matches!(light, Light::Volume) { VertexKind::Volume } else { VertexKind::End };
        let mut vertices = vec![PathVertex { kind, cos_camera, ..end }];
        vertices.extend(steps.iter().map(|step| step.0));
        vertices.push(end);
        let mut edges: Vec<PathEdge> = Vec::new();
        for (i, [distance, pass_probability, at_camera_side, at_light_side]) in
            steps.iter().map(|step| step.1).chain([last]).enumerate()
        {
            let t = |vertex: &PathVertex, stop| match vertex.kind {
                VertexKind::Medium(_) | VertexKind::Volume => stop,
                _ => pass_probability,
            };
            edges.push(PathEdge {
                distance,
                t_light: t(&vertices[i + 1], at_camera_side),
                t_camera: t(&vertices[i], at_light_side),
                pass_probability,
            });
        }
        if matches!(light, Light::Directional | Light::Environment) {
            edges[0].distance = f64::INFINITY;
        }
        let dirac = matches!(light, Light::Point | Light::Directional);
        Path {
            vertices,
            edges,
            pdf_position: if dirac { 1.0 } else { pdf_position },
            pdf_incident: if dirac { 1.0 } else { pdf_incident },
            hittable: !dirac,
        }
    })
}

/// A plan with all techniques and different merges in each medium.
pub(crate) fn plan() -> impl Strategy<Value = MisPlan> {
    let merge = || {
        // Some of the scales at vertices are greater.
        let greatest_scale = prop_oneof![Just(f32::INFINITY), 0.1_f32..3.0];
        let merge = |(count, width, greatest_scale)| VolumeMerge { count, width, greatest_scale };
        (0.0..1e3, 0.0..3.0, greatest_scale).prop_map(merge)
    };
    let medium = [(); 4].map(|()| merge());
    let medium = medium.prop_map(|[pp3d, pb2d, bp2d, bb1d]| VolumeMerges { pp3d, pb2d, bp2d, bb1d });
    (1.0..4.0, 1e-3..10.0, 1.0..1e5, 1e-3..1e3, vec(medium, MEDIA as usize)).prop_map(
        |(nee, connect, light_tracing, surf, volume)| MisPlan {
            heuristic: Heuristic::Balance,
            hit: 1.0,
            nee,
            connect,
            light_tracing,
            surf,
            volume,
            photon_beams: BeamExtent::Short,
            query_beams: BeamExtent::Long,
            lanes: [0.0; 3],
        },
    )
}

/// The plan with only the techniques whose bits are set.
pub(crate) fn masked(plan: &MisPlan, mask: u32) -> MisPlan {
    let on = |bit: u32, value: f64| if mask >> bit & 1 == 1 { value } else { 0.0 };
    let merge = |bit, merge: VolumeMerge| VolumeMerge { count: on(bit, merge.count), ..merge };
    let in_medium = |v: &VolumeMerges<VolumeMerge>| VolumeMerges {
        pp3d: merge(5, v.pp3d),
        pb2d: merge(6, v.pb2d),
        bp2d: merge(7, v.bp2d),
        bb1d: merge(8, v.bb1d),
    };
    MisPlan {
        hit: on(0, plan.hit),
        nee: on(1, plan.nee),
        connect: on(2, plan.connect),
        light_tracing: on(3, plan.light_tracing),
        surf: on(4, plan.surf),
        volume: plan.volume.iter().map(in_medium).collect(),
        ..plan.clone()
    }
}

/// All heuristics and beam extents.
pub(crate) fn modes() -> impl Iterator<Item = (Heuristic, BeamExtent, BeamExtent)> {
    let extents = [BeamExtent::Short, BeamExtent::Long];
    [Heuristic::Balance, Heuristic::Power].into_iter().flat_map(move |heuristic| {
        extents
            .into_iter()
            .flat_map(move |photon| extents.into_iter().map(move |query| (heuristic, photon, query)))
    })
}

/// Densities of the lanes of a path with one lane: each edge and each vertex in a medium has factors of its
/// own in every lane, now and then of a lane that never stops, always passes or never scatters that way.
/// Walks of the last lane can make the whole path: else no channel had any light.
pub(crate) fn in_lanes(path: Path, spread: f64) -> impl Strategy<Value = Path<[f64; 3]>> {
    let lane = move || (0.0..1.0_f64, density(spread), density(spread), [density(spread), density(spread)]);
    let last =
        (0.0..1.0_f64, around_one(spread), around_one(spread), [around_one(spread), around_one(spread)]);
    vec((lane(), lane(), last), path.length()).prop_map(move |factors| {
        let edges = path.edges.iter().zip(&factors).enumerate().map(|(i, (edge, &(first, second, last)))| {
            let lanes = [first, second, last];
            let passes = lanes.map(|(pass, ..)| if pass < 0.1 { 1.0 } else { pass * edge.pass_probability });
            let t = |vertex: &PathVertex, t: f64, factors: [f64; 3]| match vertex.kind {
                VertexKind::Medium(_) => factors.map(|factor| t * factor),
                VertexKind::Volume => [t; 3],
                _ => passes,
            };
            PathEdge {
                distance: edge.distance,
                t_light: t(&path.vertices[i + 1], edge.t_light, lanes.map(|lane| lane.1)),
                t_camera: t(&path.vertices[i], edge.t_camera, lanes.map(|lane| lane.2)),
                pass_probability: passes,
            }
        });
        let vertices = path.vertices.iter().enumerate().map(|(i, vertex)| {
            let turn = |side: usize, rho: f64| match (vertex.kind, factors.get(i)) {
                (VertexKind::Medium(_), Some(&(first, second, last))) => {
                    [first, second, last].map(|lane| rho * lane.3[side])
                }
                _ => [rho; 3],
            };
            vertex.with_lanes(|rho| turn(0, rho), |rho| turn(1, rho))
        });
        Path {
            edges: edges.collect(),
            vertices: vertices.collect(),
            pdf_position: path.pdf_position,
            pdf_incident: path.pdf_incident,
            hittable: path.hittable,
        }
    })
}

/// Probabilities of three lanes, of which one may never be drawn.
pub(crate) fn lane_probabilities() -> impl Strategy<Value = [f64; 3]> {
    let odds = || prop_oneof![4 => 0.05..1.0_f64, 1 => Just(0.0)];
    (odds(), odds(), 0.05..1.0_f64).prop_map(|(a, b, c)| {
        let odds = [a, b, c];
        let sum: f64 = odds.iter().sum();
        odds.map(|o| o / sum)
    })
}
