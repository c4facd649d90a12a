//! Bodies that share faces: what a ray meets, against the body that counts at each point, found by asking all
//! bodies.
//!
//! Bodies are boxes on a small grid, so that faces coincide all the time: with equal coordinates, or, as
//! meshes that were turned and moved, to rounding.

use glam::{DAffine3, DQuat, DVec3, Vec3};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::subsequence;
use upbp_core::scene::Scene as _;
use upbp_estimators::path::{EdgeTrace, Extent, Target, WalkState, clear_edge};
use upbp_estimators::scene::Walk;
use upbp_estimators::{MediumStack, Ray, Roulette, Stream, StreamKind, Survival, offset_origin};
use upbp_scene::ReadyScene;
use upbp_scene::material::Material;

const SIDE: i32 = 4;

/// A box on the grid. All ranks of a scene differ.
#[derive(Clone, Debug)]
struct Body {
    min: [i32; 3],
    max: [i32; 3],
    rank: i32,
    refracts: bool,
    /// The diagonals of the faces, if it is a mesh.
    diagonals: u8,
}

impl Body {
    fn corner(&self, i: usize) -> DVec3 {
        let axis = |axis: usize| f64::from(if i >> axis & 1 == 1 { self.max[axis] } else { self.min[axis] });
        DVec3::new(axis(0), axis(1), axis(2))
    }

    fn contains(&self, point: DVec3) -> bool {
        (0..3).all(|axis| f64::from(self.min[axis]) < point[axis] && point[axis] < f64::from(self.max[axis]))
    }

    /// Distances at which a line goes into the box, made larger by `margin`, and out.
    fn roots(&self, origin: DVec3, direction: DVec3, margin: f64) -> Option<[f64; 2]> {
        let a = (self.corner(0) - margin - origin) / direction;
        let b = (self.corner(7) + margin - origin) / direction;
        let (near, far) = (a.min(b).max_element(), a.max(b).min_element());
        (near < far).then_some([near, far])
    }

    fn shape(&self, placed: &DAffine3, is_mesh: bool, medium: Option<&str>) -> String {
        let at = |i: usize| format!("{:?}", placed.transform_point3(self.corner(i)).as_vec3());
        let geometry = if is_mesh {
            // The corners of each face, counter-clockwise from outside.
            let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
            let triangles = (0..6).map(|i| {
                let mut corners = faces[i];
                corners.rotate_left(usize::from(self.diagonals >> i & 1));
                let [a, b, c, d] = corners;
                format!("({a}, {b}, {c}), ({a}, {c}, {d}), ")
            });
            let positions = (0..8).map(|i| at(i) + ", ").collect::<String>();
            format!("Mesh(positions: [{positions}], indices: [{}])", triangles.collect::<String>())
        } else {
            format!("Box(min: {}, max: {})", at(0), at(7))
        };
        let material = if self.refracts { format!("g{}", self.rank) } else { "null".to_owned() };
        let interior = medium.map(|name| format!("interior: \"{name}\", ")).unwrap_or_default();
        format!("(geometry: {geometry}, material: \"{material}\", {interior}priority: {}),", self.rank)
            .replace("Vec3", "")
    }
}

fn body() -> impl Strategy<Value = Body> {
    let range = || subsequence((0..=SIDE).collect::<Vec<_>>(), 2);
    ([range(), range(), range()], prop::bool::weighted(0.75), any::<u8>()).prop_map(
        |(ranges, refracts, diagonals)| Body {
            min: [0, 1, 2].map(|axis| ranges[axis][0]),
            max: [0, 1, 2].map(|axis| ranges[axis][1]),
            rank: 0,
            refracts,
            diagonals,
        },
    )
}

/// Bodies in order of rank, without those that lie inside of a higher one, which scenes do not accept.
fn bodies() -> impl Strategy<Value = Vec<Body>> {
    vec(body(), 1..8).prop_map(|all| {
        let lies_in = |body: &Body, other: &Body| {
            (0..3).all(|axis| other.min[axis] <= body.min[axis] && body.max[axis] <= other.max[axis])
        };
        let is_seen = |i: &usize| all[i + 1..].iter().all(|higher| !lies_in(&all[*i], higher));
        let seen = (0..all.len()).filter(is_seen).map(|i| all[i].clone());
        seen.zip(0..).map(|(body, rank)| Body { rank, ..body }).collect()
    })
}

/// The place of the grid, and whether its boxes are meshes: they must be where they are turned.
fn placement() -> impl Strategy<Value = (DAffine3, bool)> {
    let unit = || -1.0..1.0_f64;
    let offset = (unit(), unit(), unit()).prop_map(|(x, y, z)| 3.0 * DVec3::new(x, y, z));
    let turn = (unit(), unit(), unit(), unit()).prop_filter_map("an axis", |(x, y, z, w)| {
        let quaternion = DQuat::from_xyzw(x, y, z, w);
        (quaternion.length() > 0.1).then(|| quaternion.normalize())
    });
    (offset, turn, -3..4_i32, 0..3).prop_map(|(offset, turn, scale, kind)| {
        let turn = if kind == 2 { turn } else { DQuat::IDENTITY };
        let scale = DVec3::splat(1.7_f64.powi(scale));
        (DAffine3::from_scale_rotation_translation(scale, turn, offset * scale), kind > 0)
    })
}

/// A material for each rank, of an index of its own.
fn scene(bodies: &[Body], placed: &DAffine3, is_mesh: bool) -> ReadyScene {
    let shapes: String = bodies.iter().map(|body| body.shape(placed, is_mesh, None)).collect();
    let material = |rank: u32| format!("\"g{rank}\": Dielectric({:?}), ", 1.1 + 0.1 * f64::from(rank));
    let materials = (0..8).map(material).collect::<Vec<_>>().concat();
    let text = format!(
        "(version: 1, camera: Perspective(origin: (90, 0, 0), target: (0, 0, 0), fov_degrees: 40),
          materials: {{ {materials} \"null\": Null }}, shapes: [{shapes}], lights: [Constant(1)])"
    );
    ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Media that light of some colours passes and others do not; walks draw from a mixture.
const MEDIA: [&str; 3] = ["haze", "smoke", "vacuum"];

/// Index-matched bodies of the media with these numbers, in the first one.
fn scene_of_media(bodies: &[Body], media: &[usize]) -> ReadyScene {
    let medium = |body: &Body| Some(MEDIA[media[body.rank as usize]]).filter(|name| *name != "vacuum");
    let shapes: String =
        bodies.iter().map(|body| body.shape(&DAffine3::IDENTITY, false, medium(body))).collect();
    let text = format!(
        "(version: 1, camera: Perspective(origin: (90, 0, 0), target: (0, 0, 0), fov_degrees: 40),
          outside: \"haze\", media: {{ \"haze\": Homogeneous(sigma_a: (0.3, 0.6, 0.9), sigma_s: (0.1, 0.2, 0.3)),
          \"smoke\": Homogeneous(sigma_a: (1, 0.1, 0.1), sigma_s: (0.1, 0.1, 0.4)) }},
          materials: {{ \"null\": Null }}, shapes: [{shapes}], lights: [Point(position: (80, 0, 0), intensity: 1)])"
    );
    ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// A line through the boxes, in the coordinates of the grid and in those of the scene.
struct Line {
    origin: DVec3,
    direction: DVec3,
    placed: DAffine3,
}

impl Line {
    fn at(&self, t: f64) -> Vec3 {
        self.placed.transform_point3(self.origin + self.direction * t).as_vec3()
    }
}

/// A stretch of a line between boundaries: where it ends, and the bodies around it.
#[derive(Debug)]
struct Stretch {
    end: f64,
    stack: MediumStack,
}

/// The stretches of a line from its origin on; `None` if it passes an edge too closely.
fn stretches(scene: &ReadyScene, bodies: &[Body], line: &Line) -> Option<Vec<Stretch>> {
    let roots = |body: &Body, margin| body.roots(line.origin, line.direction, margin);
    if bodies.iter().any(|body| roots(body, 0.01).is_some() != roots(body, -0.01).is_some()) {
        return None;
    }
    let roots = bodies.iter().filter_map(|body| roots(body, 0.0)).flatten();
    let mut ends: Vec<f64> = roots.filter(|&t| t > 0.0).chain([f64::INFINITY]).collect();
    ends.sort_by(f64::total_cmp);
    ends.dedup_by(|a, b| *a - *b < 1e-12);
    let mut start = 0.0;
    let mut stretches = Vec::new();
    for end in ends {
        if end - start < 0.02 {
            return None;
        }
        let middle = 0.5 * (start + end.min(start + 1.0));
        let point = line.origin + line.direction * middle;
        let mut ranks: Vec<i32> =
            bodies.iter().filter(|body| body.contains(point)).map(|body| body.rank).collect();
        ranks.sort_unstable();
        // The rank is the priority, and that the place in the list of bodies.
        let stack = scene.stack_at(line.at(middle));
        assert_eq!(stack.bodies().map(|body| body.priority).collect::<Vec<_>>(), ranks);
        stretches.push(Stretch { end, stack });
        start = end;
    }
    Some(stretches)
}

/// Whether a refracting body has its surface between two stretches.
fn is_surface(bodies: &[Body], before: &MediumStack, behind: &MediumStack) -> bool {
    let goes = |a: &MediumStack, b: &MediumStack| -> Vec<i32> {
        a.bodies().filter(|body| !b.contains(body.body)).map(|body| body.priority).collect()
    };
    let refracts = |rank: &i32| bodies.iter().any(|body| body.rank == *rank && body.refracts);
    let highest = [goes(before, behind), goes(behind, before)].concat().into_iter().filter(refracts).max();
    let Some(highest) = highest else { return false };
    let [here, there] = [before, behind].map(|stack| stack.top().map_or(i32::MIN, |body| body.priority));
    here != there && (here == highest || there == highest || before.ior() != behind.ior())
}

/// A line that nearly runs along a face every second time.
fn line() -> impl Strategy<Value = (DVec3, DVec3)> {
    let point = || {
        let number = || -1.0..f64::from(SIDE + 1);
        (number(), number(), number()).prop_map(|(x, y, z)| DVec3::new(x, y, z))
    };
    (point(), point(), 0..3_usize, prop::sample::select(vec![1.0, 0.05])).prop_filter_map(
        "a direction",
        |(origin, towards, axis, steepness)| {
            let mut direction = towards - origin;
            direction[axis] *= steepness;
            (direction.length() > 0.1 && direction.abs().min_element() > 1e-3)
                .then(|| (origin, direction.normalize()))
        },
    )
}

/// A walk that starts, for edges by themselves.
fn camera_walk() -> WalkState {
    WalkState {
        walk: Walk::Camera,
        stream: Stream::new(1, 0, StreamKind::Camera, 0),
        survival: Survival::of_camera(Roulette::Off, None),
        hero: (),
        stops: 0,
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn surfaces_are_where_the_body_that_counts_changes(
        bodies in bodies(),
        (placed, is_mesh) in placement(),
        lines in vec(line(), 12),
    ) {
        let scene = scene(&bodies, &placed, is_mesh);
        for (origin, direction) in lines {
            let line = Line { origin, direction, placed };
            let Some(stretches) = stretches(&scene, &bodies, &line) else { continue };
            let (mut edge_trace, mut state) = (EdgeTrace::<Material>::default(), camera_walk());
            let mut start = line.at(0.0);
            let direction = (line.at(1.0).as_dvec3() - start.as_dvec3()).normalize().as_vec3();
            let mut stack = stretches[0].stack.clone();
            let unit = line.at(1.0).distance(start);
            let mut surfaces = 0;
            for pair in stretches.windows(2) {
                let [before, behind] = [&pair[0].stack, &pair[1].stack];
                if !is_surface(&bodies, before, behind) {
                    continue;
                }
                surfaces += 1;
                edge_trace.trace(&scene, &Ray::new(start, direction), &stack, Extent::ToSurface, &mut state);
                prop_assert_eq!(edge_trace.take_conflicts(), 0, "at {}", start);
                let sides = edge_trace.sides();
                prop_assert_eq!((sides.near.top(), sides.far.top()), (before.top(), behind.top()));
                prop_assert_eq!((sides.near.len(), sides.far.len()), (before.len(), behind.len()));
                let hit = edge_trace.hit.expect("a surface");
                let expected = line.at(pair[0].end);
                prop_assert!(hit.position.distance(expected) < 1e-3 * unit, "{} {}", hit.position, expected);
                stack = sides.far.clone();
                start = offset_origin(hit.position, hit.geometric_normal, direction);
            }
            edge_trace.trace(&scene, &Ray::new(start, direction), &stack, Extent::ToSurface, &mut state);
            prop_assert!(edge_trace.hit.is_none() && edge_trace.sides().near.is_empty());

            // A connection gets through if nothing bends it.
            let start = line.at(0.0);
            let target = Target::Infinity(direction);
            let clear = clear_edge::<_, f64>(&scene, &stretches[0].stack, start, &target, &mut Vec::new());
            prop_assert_eq!(clear.is_some(), surfaces == 0);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, ..ProptestConfig::default() })]

    /// With media whose densities depend on where an edge is cut: a walk along it, one back, and a connection
    /// have to agree. Faces of index-matched boxes coincide to the bit.
    #[test]
    fn walks_and_connections_cut_edges_at_the_same_places(
        bodies in bodies(),
        media in vec(0..MEDIA.len(), 8),
        lines in vec(line(), 12),
    ) {
        let bodies: Vec<_> = bodies.into_iter().map(|body| Body { refracts: false, ..body }).collect();
        let scene = scene_of_media(&bodies, &media);
        for (origin, direction) in lines {
            let line = Line { origin, direction, placed: DAffine3::IDENTITY };
            let Some(stretches) = stretches(&scene, &bodies, &line) else { continue };
            // The end of the edge, too, is off all boundaries.
            if stretches.iter().any(|stretch| (stretch.end - f64::from(SIDE)).abs() < 0.02) {
                continue;
            }
            let mut state = camera_walk();
            let ends = [line.at(0.0), line.at(f64::from(SIDE))];
            let stacks = ends.map(|end| scene.stack_at(end));
            let target = Target::Medium(ends[1]);
            let connected = clear_edge::<_, f64>(&scene, &stacks[0], ends[0], &target, &mut Vec::new());
            let connected = connected.expect("nothing refracts");
            let mut walk = |from: usize| {
                let between = ends[1 - from] - ends[from];
                let ray = Ray::new(ends[from], between.normalize());
                let mut edge_trace = EdgeTrace::<Material>::default();
                edge_trace.trace(&scene, &ray, &stacks[from], Extent::ToSurface, &mut state);
                let t = between.length();
                let span = edge_trace.spans.iter().rfind(|span| span.start <= t).expect("the first one");
                edge_trace.density_to(&scene, span, t)
            };
            let [forward, backward] = [walk(0), walk(1)];
            for (walked, expected) in [
                (forward.pass_probability, connected.pass_probability),
                (forward.stop_at_end, connected.stop_at_end),
                (forward.stop_at_start, connected.stop_at_start),
                (backward.pass_probability, connected.pass_probability),
                (backward.stop_at_end, connected.stop_at_start),
                (backward.stop_at_start, connected.stop_at_end),
            ] {
                let close = (walked - expected).abs() <= 1e-3 * expected;
                prop_assert!(close, "{forward:?} {backward:?} {connected:?} {stretches:?}");
            }
        }
    }
}
