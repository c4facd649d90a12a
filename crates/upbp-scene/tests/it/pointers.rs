//! Lights and cameras behind pointers answer as they do by themselves.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use upbp_estimators::scene::{BoundingSphere, Camera, Emitter, EmitterPoint, Scene as _};
use upbp_scene::ReadyScene;

/// A light of each kind, and a camera with a lens that renders a part of its film.
fn scene() -> ReadyScene {
    ReadyScene::from_ron_str(
        "(version: 1, film: (width: 8, height: 6, crop: (x: 1, y: 2, width: 3, height: 4)),
        camera: Perspective(origin: (0, 1, 4), target: (0, 0, 0), fov_degrees: 40,
            lens_radius: 0.1, focus_distance: 3),
        media: { \"flame\": Homogeneous(glow: 1) }, materials: { \"black\": Lambert(0), \"null\": Null },
        shapes: [
            (geometry: Sphere(centre: (0, 1, 0), radius: 0.5), material: \"black\", emission: 1),
            (geometry: Sphere(centre: (0, -0.5, 0), radius: 0.3), material: \"null\", interior: \"flame\"),
        ],
        lights: [Constant(1), Directional(direction: (0, -1, 0), irradiance: 1),
            Point(position: (0, 0.5, 0), intensity: 1)])",
        "",
    )
    .unwrap()
}

/// All that an emitter answers to one set of questions.
fn light<E: Emitter>(emitter: &E) -> String {
    let (sphere, receiver) = (BoundingSphere { centre: Vec3::ZERO, radius: 5.0 }, Vec3::new(1.0, 2.0, 0.3));
    let emission = emitter.sample_emission(&sphere, [0.3, 0.6], [0.2, 0.4]);
    let incident = emitter.sample_incident(&sphere, receiver, [0.1, 0.7]);
    let point =
        incident.map_or(EmitterPoint { position: Vec3::X, normal: Vec3::Y }, |incident| incident.point);
    let direction = (receiver - point.position).normalize();
    format!(
        "{:?}",
        (
            (emitter.kind(), emitter.power(&sphere), emitter.bounds(&sphere), emission, incident),
            (emitter.hit(&sphere, &point, direction, receiver), emitter.pdf_passage(&point)),
            emitter.emission_coordinates(&sphere, &point, direction, receiver),
            emitter.pdf_incident(&sphere, &point, direction, receiver, 0.123),
        )
    )
}

/// All that a camera answers to one set of questions.
fn camera<C: Camera>(camera: &C) -> String {
    let (film, u_lens, point) = (Vec2::new(2.5, 3.25), [0.3, 0.8], Vec3::new(0.1, 0.2, 0.0));
    format!(
        "{:?}",
        (
            (camera.resolution(), camera.crop(), camera.ray(film, u_lens), camera.connect(point, u_lens)),
            (camera.connect_at(point, Vec2::new(4.0, 3.0)), camera.is_pinhole()),
        )
    )
}

#[test]
fn lights_and_cameras_behind_pointers_answer_as_they_do_by_themselves() {
    let scene = scene();
    for emitter in scene.emitters() {
        let expected = light(emitter);
        let boxed: Box<dyn Emitter> = Box::new(emitter.clone());
        let shared: Arc<dyn Emitter> = Arc::new(emitter.clone());
        assert_eq!(light(&boxed), expected);
        assert_eq!(light(&shared), expected);
        assert_eq!(light(&&boxed), expected);
    }
    let expected = camera(scene.camera());
    let boxed: Box<dyn Camera> = Box::new(*scene.camera());
    let shared: Arc<dyn Camera> = Arc::new(*scene.camera());
    assert_eq!(camera(&boxed), expected);
    assert_eq!(camera(&shared), expected);
    assert_eq!(camera(&&boxed), expected);
}
