//! The scene's own traversals against the defaults of the trait, which only know the nearest surface.

use upbp_estimators::check::check_scene;
use upbp_estimators::scene::{Camera as _, Emitter as _};
use upbp_media::{BodyId, Medium as _};

use super::*;

/// Forwards what is required, so that the rest is the trait's.
struct Plain<'a>(&'a ReadyScene);

impl Scene for Plain<'_> {
    type Bsdf = Material;
    type Emitter = Light;
    type Medium = Homogeneous;
    type Camera = PerspectiveCamera;

    fn intersect(&self, ray: &Ray) -> Option<Hit<Material>> {
        self.0.intersect(ray)
    }
    fn bounds(&self) -> BoundingSphere {
        self.0.bounds()
    }
    fn emitters(&self) -> &[Light] {
        self.0.emitters()
    }
    fn media(&self) -> &[Homogeneous] {
        self.0.media()
    }
    fn camera(&self) -> &PerspectiveCamera {
        self.0.camera()
    }
    fn outside(&self) -> Option<MediumId> {
        self.0.outside()
    }
}

fn shipped() -> Vec<(String, ReadyScene)> {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/scenes");
    let reference =
        ["absorb_only", "fog_two_spheres", "forward_hg_box", "glass_env", "mirror_fog", "point_bubble_fog"];
    ["cornell_media.ron".to_owned(), "glass_and_null.ron".to_owned()]
        .into_iter()
        .chain(reference.map(|name| format!("reference/{name}.ron")))
        .map(|name| {
            let scene = ReadyScene::load(root.join(&name)).unwrap_or_else(|error| panic!("{error}"));
            (name, scene)
        })
        .collect()
}

/// Points in and around the bounds.
fn points(scene: &ReadyScene) -> impl Iterator<Item = Vec3> {
    let BoundingSphere { centre, radius } = scene.bounds();
    let fraction = |i: u32, alpha: f64| (f64::from(i) * alpha).fract() as f32 * 2.0 - 1.0;
    (1..).map(move |i| {
        let offset =
            Vec3::new(fraction(i, 0.819_172_513), fraction(i, 0.671_043_607), fraction(i, 0.549_700_478));
        centre + 1.1 * radius * offset
    })
}

fn rays(scene: &ReadyScene) -> impl Iterator<Item = Ray> {
    points(scene)
        .zip(points(scene).skip(17))
        .filter_map(|(origin, target)| Some(Ray::new(origin, (target - origin).try_normalize()?)))
}

/// Equal but for the roundings of a ray that is cut behind every boundary.
fn equal(a: &[Crossing], b: &[Crossing]) -> bool {
    a.len() == b.len()
        && a.iter().zip(b).all(|(a, b)| {
            (a.t - b.t).abs() <= 1e-5 * a.t
                && (a.interior, a.entering, a.scatters) == (b.interior, b.entering, b.scatters)
        })
}

#[test]
fn trace_agrees_with_the_default() {
    for (name, scene) in shipped() {
        for ray in rays(&scene).take(5000) {
            let (mut own, mut default) = (Vec::new(), Vec::new());
            let (a, b) = (scene.trace(&ray, &mut own), Plain(&scene).trace(&ray, &mut default));
            assert_eq!(a, b, "{name} {ray:?}");
            assert!(equal(&own, &default), "{name} {ray:?}\n{own:?}\n{default:?}");
        }
    }
}

#[test]
fn is_clear_agrees_with_the_default() {
    for (name, scene) in shipped() {
        for ray in rays(&scene).take(5000) {
            let ray = ray.with_range(0.0, scene.bounds().radius);
            let (mut own, mut default) = (Vec::new(), Vec::new());
            let clear = scene.is_clear(&ray, &mut own);
            assert_eq!(clear, Plain(&scene).is_clear(&ray, &mut default), "{name} {ray:?}");
            assert!(!clear || equal(&own, &default), "{name} {ray:?}\n{own:?}\n{default:?}");
        }
    }
}

#[test]
fn stack_at_agrees_with_the_default() {
    for (name, scene) in shipped() {
        for point in points(&scene).take(5000) {
            assert_eq!(scene.stack_at(point), Plain(&scene).stack_at(point), "{name} {point}");
        }
    }
}

fn scene(media: &str, shapes: &str) -> ReadyScene {
    let text = format!(
        "(version: 1, camera: Perspective(origin: (0, 0, 9), target: (0, 0, 0), fov_degrees: 40),
          media: {{ {media} }},
          materials: {{ \"null\": Null, \"glass\": Dielectric(ior: 1.5), \"water\": Dielectric(ior: 1.33), \"wall\": Lambert(0.5) }},
          shapes: [ {shapes} ],
          lights: [ Point(position: (0, 8, 0), intensity: 1) ])"
    );
    ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{error}"))
}

fn medium_at(scene: &ReadyScene, x: f32) -> Option<MediumId> {
    scene.stack_at(Vec3::new(x, 0.0, 0.0)).medium()
}

const MEDIA: &str = "\"a\": Homogeneous(sigma_s: 1), \"b\": Homogeneous(sigma_s: 2)";
const ALONG_X: Ray =
    Ray { origin: Vec3::new(-5.0, 0.1, 0.2), direction: Vec3::X, t_min: 0.0, t_max: f32::INFINITY };

#[test]
fn nested_bodies_need_no_priority() {
    // The cavity comes first in the file, and still counts inside of the cloud.
    let scene = scene(
        MEDIA,
        "(geometry: Sphere(centre: (0, 0, 0), radius: 0.5), material: \"null\"),
         (geometry: Sphere(centre: (0, 0, 0), radius: 2), material: \"null\", interior: \"a\"),
         (geometry: Sphere(centre: (0, 0, 0), radius: 1), material: \"null\", interior: \"b\")",
    );
    assert_eq!(medium_at(&scene, 0.0), None);
    assert_eq!(medium_at(&scene, 0.7), Some(MediumId(1)));
    assert_eq!(medium_at(&scene, 1.5), Some(MediumId(0)));
    assert_eq!(medium_at(&scene, 3.0), None);
    assert_eq!(scene.stack_at(Vec3::ZERO).len(), 3);
    check_scene(&scene).unwrap();
}

#[test]
fn a_priority_goes_before_the_size() {
    let scene = scene(
        MEDIA,
        "(geometry: Sphere(centre: (0, 0, 0), radius: 2), material: \"null\", interior: \"a\", priority: 1),
         (geometry: Sphere(centre: (1.5, 0, 0), radius: 1), material: \"null\", interior: \"b\")",
    );
    assert_eq!(medium_at(&scene, 1.5), Some(MediumId(0)));
    assert_eq!(medium_at(&scene, 2.2), Some(MediumId(1)));
}

#[test]
fn among_equal_bodies_the_later_counts() {
    let scene = scene(
        MEDIA,
        "(geometry: Sphere(centre: (0, 0, 0), radius: 1), material: \"null\", interior: \"b\"),
         (geometry: Sphere(centre: (1, 0, 0), radius: 1), material: \"null\", interior: \"a\")",
    );
    assert_eq!(medium_at(&scene, 0.5), Some(MediumId(0)));
    assert_eq!(medium_at(&scene, -0.5), Some(MediumId(1)));
}

#[test]
fn coincident_boundaries_are_all_found() {
    // Two boxes with a common face, and a third with the same faces as the first.
    let scene = scene(
        MEDIA,
        "(geometry: Box(min: (-1, -1, -1), max: (0, 1, 1)), material: \"null\", interior: \"a\"),
         (geometry: Box(min: (0, -1, -1), max: (1, 1, 1)), material: \"null\", interior: \"b\"),
         (geometry: Box(min: (-1, -1, -1), max: (0, 1, 1)), material: \"null\", interior: \"b\")",
    );
    let mut crossings = Vec::new();
    assert!(scene.trace(&ALONG_X, &mut crossings).is_none());
    let found: Vec<(f32, bool)> = crossings.iter().map(|crossing| (crossing.t, crossing.entering)).collect();
    let expected = [(4.0, true), (4.0, true), (5.0, true), (5.0, false), (5.0, false), (6.0, false)];
    assert_eq!(found, expected);
    let mut connection = Vec::new();
    assert!(scene.is_clear(&ALONG_X, &mut connection));
    assert_eq!(connection, crossings);
    let mut stack = scene.stack_at(ALONG_X.origin);
    for crossing in crossings {
        assert_eq!(stack.cross(crossing.interior, crossing.entering), upbp_media::Crossed::Done);
    }
    assert!(stack.is_empty());
}

#[test]
fn a_body_on_a_wall_is_not_left_through_the_wall() {
    let scene = scene(
        MEDIA,
        "(geometry: Box(min: (-1, -1, -1), max: (1, 1, 1)), material: \"null\", interior: \"a\"),
         (geometry: Quad(origin: (1, -3, -3), edge_u: (0, 0, 6), edge_v: (0, 6, 0)), material: \"wall\")",
    );
    let mut crossings = Vec::new();
    let hit = scene.trace(&ALONG_X, &mut crossings).unwrap();
    assert_eq!((hit.t, hit.boundary.interior()), (6.0, None));
    assert_eq!(crossings.len(), 1);
    assert!(crossings[0].entering);
}

#[test]
fn light_in_a_glass_on_a_table_does_not_get_below() {
    for order in [0, 1] {
        let mut shapes = [
            "(geometry: Box(min: (-1, -1, -1), max: (1, 1, 1)), material: \"glass\"),",
            "(geometry: Quad(origin: (1, -3, -3), edge_u: (0, 0, 6), edge_v: (0, 6, 0)), material: \"wall\"),",
        ];
        shapes.rotate_left(order);
        let scene = scene(MEDIA, &shapes.concat());
        let inside = Ray { origin: Vec3::new(0.0, 0.1, 0.2), ..ALONG_X };
        let hit = scene.trace(&inside, &mut Vec::new()).unwrap();
        assert!(matches!(hit.boundary, Boundary::Opaque(Material::Lambert(_))));
    }
}

#[test]
fn a_boundary_inside_glass_has_the_index_of_the_glass() {
    let scene = scene(
        MEDIA,
        "(geometry: Sphere(centre: (0, 0, 0), radius: 2), material: \"glass\"),
         (geometry: Sphere(centre: (0, 0, 0), radius: 1), material: \"null\", interior: \"a\"),
         (geometry: Sphere(centre: (0, 0, 0), radius: 0.5), material: \"water\"),
         (geometry: Sphere(centre: (2, 0, 0), radius: 0.6), material: \"null\", interior: \"b\")",
    );
    let ior = |x: f32| scene.stack_at(Vec3::new(x, 0.0, 0.0)).ior();
    assert_eq!((ior(0.0), ior(0.7), ior(1.2)), (1.33, 1.5, 1.5));
    // Reaches out of the glass: index-matched to what is outside.
    assert_eq!(ior(2.3), 1.0);
}

#[test]
fn a_null_body_that_fills_glass_has_its_index() {
    let glass_and_fog = |geometry: &str| {
        format!(
            "(geometry: {geometry}, material: \"glass\"), (geometry: {geometry}, material: \"null\", interior: \"a\")"
        )
    };
    for geometry in ["Sphere(centre: (0.1, 0.2, 0.3), radius: 0.7)", "Box(min: (-1, -1, -1), max: (1, 1, 1))"]
    {
        let scene = scene(MEDIA, &glass_and_fog(geometry));
        let inside = scene.stack_at(Vec3::new(0.1, 0.0, 0.2));
        assert_eq!((inside.medium(), inside.ior()), (Some(MediumId(0)), 1.5));
        // And its surface.
        let mut crossings = Vec::new();
        let hit = scene.trace(&ALONG_X, &mut crossings).unwrap();
        assert_eq!((hit.boundary.interior().unwrap().body, crossings.len()), (BodyId(0), 1));
        assert_eq!((crossings[0].interior.body, crossings[0].t), (BodyId(1), hit.t));
    }
}

#[test]
fn refracting_surfaces_that_coincide_are_one_hit() {
    // A box of glass below a larger one of water, which has the higher number, and a sphere that touches both
    // boxes from the side.
    let scene = scene(
        MEDIA,
        "(geometry: Box(min: (-1, -1, -1), max: (0, 1, 1)), material: \"glass\"),
         (geometry: Box(min: (0, -2, -2), max: (1, 2, 2)), material: \"water\", priority: 1),
         (geometry: Sphere(centre: (0, 2, 0.2), radius: 1), material: \"null\", interior: \"a\")",
    );
    for (origin, direction) in [(-0.5, Vec3::X), (0.5, -Vec3::X)] {
        let ray = Ray { origin: Vec3::new(origin, 0.1, 0.2), direction, ..ALONG_X };
        let mut crossings = Vec::new();
        let hit = scene.trace(&ray, &mut crossings).unwrap();
        let [other] = crossings[..] else { panic!("{crossings:?}") };
        assert_eq!((hit.t, other.t), (0.5, 0.5));
        assert_eq!(
            (hit.boundary.interior().unwrap().ior, other.interior.ior, other.scatters),
            (1.33, 1.5, true)
        );
        assert_eq!(other.entering, origin > 0.0);
        let mut stack = scene.stack_at(ray.origin);
        let mut connection = Vec::new();
        assert!(scene.is_clear(&ray.with_range(0.0, 0.6), &mut connection));
        assert_eq!(connection.iter().map(|crossing| crossing.t).collect::<Vec<_>>(), [0.5, 0.5]);
        for crossing in connection {
            assert_eq!(stack.cross(crossing.interior, crossing.entering), upbp_media::Crossed::Done);
        }
        assert_eq!(stack, scene.stack_at(ray.at(0.6)));
    }
    check_scene(&scene).unwrap();
}

#[test]
fn what_is_nearer_than_a_ray_starts_from_a_surface_coincides() {
    // A gap of some roundings between two bodies, near the origin and far from it: either they are met as
    // one, or a ray that leaves the one meets the other.
    for x in [1e-3_f32, 1.0, 700.0] {
        for roundings in 0..80 {
            let start = x + roundings as f32 * f32::EPSILON * x;
            let text = format!(
                "(geometry: Box(min: ({:?}, -1e-4, -1e-4), max: ({x:?}, 1e-4, 1e-4)), material: \"glass\"),
                 (geometry: Box(min: ({start:?}, -1e-4, -1e-4), max: ({:?}, 1e-4, 1e-4)), material: \"water\"),
                 (geometry: Sphere(centre: (0, 0, 0), radius: 1e-6), material: \"null\")",
                0.5 * x,
                2.0 * x,
            );
            let scene = scene(MEDIA, &text);
            let origin = scene.origin();
            let ray = Ray { origin: Vec3::new(0.75 * x, 0.0, 0.0) - origin, ..ALONG_X };
            let mut crossings = Vec::new();
            let hit = scene.trace(&ray, &mut crossings).unwrap();
            if crossings.is_empty() {
                let start = upbp_accel::offset_origin(hit.position, hit.geometric_normal, ray.direction);
                let next = scene.trace(&Ray { origin: start, ..ray }, &mut crossings).unwrap();
                // Beyond the second face there is its other side.
                assert!(next.position.x < 1.5 * x - origin.x, "{x} {roundings}");
            }
        }
    }
}

#[test]
fn the_rim_of_a_small_body_far_away_is_met() {
    // A ball a thousand times as far from the origin as it is wide; something at the origin keeps it there.
    let scene = scene(
        MEDIA,
        "(geometry: Sphere(centre: (500, 0, 0), radius: 0.5), material: \"glass\"),
         (geometry: Sphere(centre: (-500, 0, 0), radius: 0.1), material: \"null\")",
    );
    let centre = Vec3::X * 500.0 - scene.origin();
    for part in [0.9, 0.99, 0.995, 0.998, 0.9995] {
        let ray = Ray { origin: centre + Vec3::new(-2.0, 0.5 * part, 0.0), ..ALONG_X };
        let mut crossings = Vec::new();
        let hit = scene.trace(&ray, &mut crossings).unwrap();
        assert!(crossings.is_empty() && hit.t < 2.0, "{part}: {} {crossings:?}", hit.t);
        assert!(scene.is_clear(&ray, &mut crossings));
        let [enter, leave] = crossings[..] else { panic!("{crossings:?}") };
        assert!(enter.t == hit.t && leave.t > 2.0, "{part}: {crossings:?}");
    }
}

#[test]
fn what_is_above_a_wide_mesh_is_not_in_its_plane() {
    // Fog ends two centimetres above a ground of triangles 200 km wide, and a pane lies as far above it; the
    // ground may have been turned there.
    let ground = [
        ("[(-1e5, 0, -1e5), (-1e5, 0, 1e5), (1e5, 0, 1e5), (1e5, 0, -1e5)]", ""),
        (
            "[(-1e5, 1e5, 0), (-1e5, -1e5, 0), (1e5, -1e5, 0), (1e5, 1e5, 0)]",
            "rotate: [(axis: (1, 0, 0), degrees: -90)]",
        ),
    ];
    for (positions, rotate) in ground {
        let scene = scene(
            MEDIA,
            &format!(
                "(geometry: Mesh(positions: {positions}, indices: [(0, 1, 2), (0, 2, 3)], {rotate}), material: \"wall\"),
                 (geometry: Box(min: (-1, 0.02, -1), max: (1, 1, 1)), material: \"null\", interior: \"a\"),
                 (geometry: Box(min: (2, 0.02, -1), max: (3, 0.03, 1)), material: \"glass\")"
            ),
        );
        let down = |x: f32| Ray { origin: Vec3::new(x, 2.0, 0.1), direction: -Vec3::Y, ..ALONG_X };
        let mut crossings = Vec::new();
        let hit = scene.trace(&down(0.0), &mut crossings).unwrap();
        assert!((hit.t - 2.0).abs() < 1e-5 && crossings.len() == 2, "{rotate} {} {crossings:?}", hit.t);
        let inside = Ray { origin: Vec3::new(2.5, 0.025, 0.1), ..down(2.5) };
        let hit = scene.trace(&inside, &mut Vec::new()).unwrap();
        assert!(hit.boundary.interior().is_some(), "{rotate}");
    }
}

#[test]
fn refracting_bodies_do_not_block_a_segment_but_are_reported() {
    let scene = scene(MEDIA, "(geometry: Sphere(centre: (0, 0, 0), radius: 1), material: \"glass\")");
    let mut crossings = Vec::new();
    assert!(scene.is_clear(&ALONG_X, &mut crossings));
    assert_eq!(crossings.len(), 2);
    assert!(crossings.iter().all(|crossing| crossing.scatters && crossing.interior.body == BodyId(0)));
    let hit = scene.trace(&ALONG_X, &mut Vec::new()).unwrap();
    assert_eq!(hit.boundary.interior(), Some(crossings[0].interior));
}

#[test]
fn bounds_hold_everything_finite() {
    let scene = scene(MEDIA, "(geometry: Sphere(centre: (3, 0, 0), radius: 1), material: \"glass\")");
    let BoundingSphere { centre, radius } = scene.bounds();
    assert!(centre.distance(Vec3::new(0.0, 8.0, 0.0)) <= radius);
    assert!(centre.distance(Vec3::new(4.0, 0.0, 0.0)) <= radius);
    // A point alone has some extent around it.
    let empty = self::scene(MEDIA, "");
    assert!(empty.bounds().radius > 0.0);
}

#[test]
fn a_mesh_in_a_sphere_counts_whatever_its_box() {
    // A cube that is turned: its box is larger than the sphere around it.
    let scene = scene(
        MEDIA,
        "(geometry: Sphere(centre: (0, 0, 0), radius: 1), material: \"glass\"),
         (geometry: Box(min: (-0.5, -0.5, -0.5), max: (0.5, 0.5, 0.5),
                        rotate: [(axis: (1, 1, 1), degrees: 60)]),
          material: \"water\")",
    );
    let (min, max) = scene.geometry().shape(ShapeId(1)).aabb();
    assert!((max - min).element_product() > 4.2, "{min} {max}");
    assert_eq!(scene.stack_at(Vec3::ZERO).ior(), 1.33);
}

#[test]
fn a_lamp_in_the_plane_of_a_ceiling_shines() {
    for order in [0, 1] {
        let mut shapes = [
            "(geometry: Quad(origin: (1, -3, -3), edge_u: (0, 0, 6), edge_v: (0, 6, 0)), material: \"wall\"),",
            "(geometry: Quad(origin: (1, -1, -1), edge_u: (0, 0, 2), edge_v: (0, 2, 0)), material: \"wall\",
              emission: 1),",
        ];
        shapes.rotate_left(order);
        let scene = scene(MEDIA, &shapes.concat());
        assert!(scene.trace(&ALONG_X, &mut Vec::new()).unwrap().emitter.is_some());
        let beside = Ray { origin: Vec3::new(-5.0, 2.0, 0.2), ..ALONG_X };
        assert!(scene.trace(&beside, &mut Vec::new()).unwrap().emitter.is_none());
    }
}

/// Its corners are rounded, so that it lies behind the ceiling in places.
#[test]
fn a_lamp_in_the_plane_of_a_sloped_ceiling_shines_all_over() {
    for order in [0, 1] {
        let mut shapes = [
            "(geometry: Quad(origin: (-2, 2.5, -2), edge_u: (4, 0, 0), edge_v: (0, 2, 3.464102)), material: \"wall\"),",
            "(geometry: Quad(origin: (-0.2, 3, -1.133975), edge_u: (0.4, 0, 0), edge_v: (0, 0.2, 0.34641)),
              material: \"wall\", emission: 1),",
        ];
        shapes.rotate_left(order);
        let scene = scene(MEDIA, &shapes.concat());
        let lamp = scene.emitters().last().unwrap();
        let fraction = |i: u32, alpha: f64| (f64::from(i) * alpha).fract() as f32;
        for i in 1..2000 {
            let u = [fraction(i, 0.819_172_513), fraction(i, 0.671_043_607)];
            let on_floor = Vec3::new(4.0 * fraction(i, 0.549_700_478) - 2.0, 0.0, 1.0 - 3.0 * u[0]);
            let seen = lamp.sample_incident(&scene.bounds(), on_floor, u).unwrap();
            let ray = Ray::new(on_floor, seen.towards_light);
            let hit = scene.trace(&ray, &mut Vec::new()).unwrap();
            assert!(hit.emitter.is_some(), "{ray:?} {hit:?}");
            assert_eq!(scene.intersect(&ray).unwrap().emitter, hit.emitter);
            let back = upbp_accel::offset_origin(hit.position, hit.geometric_normal, -ray.direction);
            let back = Ray { origin: back, direction: -ray.direction, ..ray };
            assert!(scene.is_clear(&back, &mut Vec::new()), "{back:?}");
            assert!(scene.trace(&back, &mut Vec::new()).is_none(), "{back:?}");
        }
    }
}

#[test]
fn a_lamp_that_is_seen_gets_its_light_out() {
    for x in [1e-3_f32, 1.0, 700.0] {
        for roundings in -10..80 {
            let behind = x + roundings as f32 * f32::EPSILON * x;
            let wide = 0.25 * x;
            let wall = |x: f32, emission: f32| {
                format!(
                    "(geometry: Quad(origin: ({x:?}, {:?}, {:?}), edge_u: (0, 0, {:?}), edge_v: (0, {:?}, 0)),
                      material: \"wall\", emission: {emission:?}),",
                    -wide, -wide, 2.0 * wide, 2.0 * wide
                )
            };
            let scene = scene(MEDIA, &(wall(x, 0.0) + &wall(behind, 1.0)));
            let origin = Vec3::new(-0.5 * x, 0.01 * x, 0.02 * x) - scene.origin();
            for direction in [Vec3::X, Vec3::new(1.0, 0.05, -0.02).normalize()] {
                let hit = scene.trace(&Ray::new(origin, direction), &mut Vec::new()).unwrap();
                // So near that it is meant to be in the plane.
                assert!(hit.emitter.is_some() || roundings > 16, "{x} {roundings}");
                if hit.emitter.is_some() {
                    let out = upbp_accel::offset_origin(hit.position, hit.geometric_normal, -direction);
                    let back = Ray::new(out, -direction);
                    assert!(scene.is_clear(&back, &mut Vec::new()), "{x} {roundings}");
                }
            }
        }
    }
}

/// A sheet that shines on both sides.
#[test]
fn two_lamps_back_to_back_shine_both() {
    let scene = scene(
        MEDIA,
        "(geometry: Quad(origin: (1, -1, -1), edge_u: (0, 0, 2), edge_v: (0, 2, 0)), material: \"wall\", emission: 1),
         (geometry: Quad(origin: (1, -1, -1), edge_u: (0, 2, 0), edge_v: (0, 0, 2)), material: \"wall\", emission: 2)",
    );
    for (origin, direction) in [(-5.0, Vec3::X), (5.0, -Vec3::X)] {
        let ray = Ray { origin: Vec3::new(origin, 0.1, 0.2), direction, ..ALONG_X };
        let hit = scene.trace(&ray, &mut Vec::new()).unwrap();
        assert!(hit.geometric_normal.dot(direction) < 0.0, "{hit:?}");
    }
}

#[test]
fn a_small_flame_on_a_wide_ground_is_an_emitter() {
    let flame = |x: f32| {
        let scene = scene(
            "\"flame\": Homogeneous(glow: 1)",
            &format!(
                "(geometry: Quad(origin: (-1000, 0, -1000), edge_u: (0, 0, 2000), edge_v: (2000, 0, 0)), material: \"wall\"),
                 (geometry: Sphere(centre: ({x:?}, 1, 0), radius: 0.02), material: \"null\", interior: \"flame\")"
            ),
        );
        scene.emitters().last().unwrap().power(&scene.bounds())
    };
    assert!(flame(0.3) > 0.0);
    // Where coordinates have fewer digits.
    assert_eq!(flame(990.0), 0.0);
}

#[test]
fn rough_glass_of_a_matched_index_counts_as_specular() {
    let rough = |ior: f32, rest: &str| {
        let text = format!(
            "(version: 1, camera: Perspective(origin: (0, 0, 9), target: (0, 0, 0), fov_degrees: 40),
              materials: {{ \"rough\": RoughDielectric(alpha: 0.2, ior: {ior:?}), \"water\": Dielectric(ior: 1.33), \"null\": Null }},
              shapes: [ (geometry: Sphere(centre: (0, 0, 0), radius: 1), material: \"rough\"), {rest} ],
              lights: [ Point(position: (0, 8, 0), intensity: 1) ])"
        );
        let scene = ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{error}"));
        if rest.is_empty() {
            check_scene(&scene).unwrap();
        }
        scene.has_specular_surfaces()
    };
    assert!(rough(1.0, "") && rough(1.0005, "") && !rough(1.33, ""));
    let rough_at =
        |x: f32| format!("(geometry: Sphere(centre: ({x:?}, 0, 0), radius: 0.8), material: \"rough\")");
    assert!(rough(1.5, &rough_at(1.7)) && !rough(1.5, &rough_at(3.0)));
    let null = "(geometry: Sphere(centre: (0, 0, 0), radius: 0.8), material: \"null\")";
    assert!(!rough(1.5, null));
}

#[test]
fn a_lamp_alone_in_fog_is_as_far_as_the_camera_sees_it() {
    let text = "(version: 1, outside: \"fog\", media: {\"fog\": Homogeneous(sigma_s: 1)},
        camera: Perspective(origin: (0, 1, 4), target: (0, 1, 0), fov_degrees: 40),
        lights: [Point(position: (0.3, 1.7, 2), intensity: 1)])";
    let bounds = ReadyScene::from_ron_str(text, "").unwrap().bounds();
    assert!(bounds.radius > 1.05 && bounds.radius < 2.0, "{bounds:?}");
    // At the camera itself there is nothing to go by, but some extent.
    let bounds = ReadyScene::from_ron_str(&text.replace("0.3, 1.7, 2", "0, 1, 4"), "").unwrap().bounds();
    assert!(bounds.radius > 0.5, "{bounds:?}");
}

#[test]
fn lights_move_with_a_scene_that_is_far_away() {
    let text = "(version: 1, camera: Perspective(origin: (3e5, 0, 9), target: (3e5, 0, 0), fov_degrees: 40),
        lights: [Point(position: (300000.5, 8, 0), intensity: 1),
            Spot(position: (299999.5, 7, 1), direction: (0, -1, 0), intensity: 1, cutoff_degrees: 30)])";
    let scene = ReadyScene::from_ron_str(text, "").unwrap();
    let positions = scene.emitters().iter().map(|light| match light {
        Light::Point(light) => light.position,
        Light::Spot(light) => light.position,
        light => panic!("{light:?}"),
    });
    let expected = [Vec3::new(300_000.5, 8.0, 0.0), Vec3::new(299_999.5, 7.0, 1.0)];
    assert_ne!(scene.origin(), Vec3::ZERO);
    assert_eq!(positions.collect::<Vec<_>>(), expected.map(|position| position - scene.origin()));
}

#[test]
fn a_lens_is_focused_on_the_target_unless_told_otherwise() {
    let text = "(version: 1, film: (width: 8, height: 8), lights: [Constant(1)],
        camera: Perspective(origin: (0, 0, 9), target: (0, 3, 5), fov_degrees: 40, lens_radius: 0.5))";
    let scene = ReadyScene::from_ron_str(text, "").unwrap();
    for u in [[0.1, 0.9], [0.7, 0.2], [0.9, 0.6]] {
        let ray = scene.camera().ray(glam::Vec2::splat(4.0), u).unwrap();
        let to_target = Vec3::new(0.0, 3.0, 5.0) - ray.origin;
        assert!(ray.direction.cross(to_target).length() < 1e-5, "{ray:?}");
    }
}

#[test]
fn media_that_nothing_is_filled_with_are_left_out() {
    let scene =
        scene(MEDIA, "(geometry: Sphere(centre: (0, 0, 0), radius: 1), material: \"null\", interior: \"b\")");
    assert_eq!(scene.media().len(), 1);
    assert_eq!(medium_at(&scene, 0.5), Some(MediumId(0)));
    assert_eq!(scene.media()[0].sigma_s(Vec3::ZERO), upbp_media::Spectrum::splat(2.0));
}
