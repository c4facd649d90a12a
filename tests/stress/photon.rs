//! Where photons are stored: a scene whose camera writes down which points ask to be connected to it. With a single light their
//! places depend on seed, iteration and index alone, so a camera can be put exactly on one of them.

use std::sync::Mutex;

use glam::{Vec2, Vec3};
use upbp_core::media::{Homogeneous, MediumId, MediumStack};
use upbp_core::scene::{
    BoundingSphere, Camera, CameraConnection, CameraRay, Crossing, Hit, PixelRect, Scene,
};
use upbp_core::{Ray, Renderer, Settings};
use upbp_scene::{Light, Material, PerspectiveCamera, ReadyScene};

struct Watched {
    scene: ReadyScene,
    camera: WatchingCamera,
}

struct WatchingCamera {
    camera: PerspectiveCamera,
    seen: Mutex<Vec<Vec3>>,
}

/// Vertices of the light sub-paths of the first iteration, in the order in which they are connected to the camera.
pub(crate) fn photons(scene: &str, settings: &Settings) -> Result<Vec<Vec3>, String> {
    let scene = ReadyScene::from_ron_str(scene, "").map_err(|error| format!("refused: {error}"))?;
    let camera = WatchingCamera { camera: *scene.camera(), seen: Mutex::default() };
    let watched = Watched { scene, camera };
    let settings = settings.clone().validate().map_err(|error| format!("refused: {error}"))?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(|error| error.to_string())?;
    pool.install(|| {
        let mut renderer = Renderer::new(&watched, settings).map_err(|error| format!("refused: {error}"))?;
        // Not those of the pilot.
        watched.camera.seen().clear();
        renderer.iterate();
        Ok(std::mem::take(&mut *watched.camera.seen()))
    })
}

impl WatchingCamera {
    fn seen(&self) -> std::sync::MutexGuard<'_, Vec<Vec3>> {
        self.seen.lock().expect("nobody panics with the list in hand")
    }
}

impl Camera for WatchingCamera {
    fn resolution(&self) -> (u32, u32) {
        self.camera.resolution()
    }

    fn crop(&self) -> PixelRect {
        self.camera.crop()
    }

    fn ray(&self, film: Vec2, u_lens: [f32; 2]) -> Option<CameraRay> {
        self.camera.ray(film, u_lens)
    }

    fn connect(&self, point: Vec3, u_lens: [f32; 2]) -> Option<CameraConnection> {
        self.seen().push(point);
        self.camera.connect(point, u_lens)
    }

    fn is_pinhole(&self) -> bool {
        self.camera.is_pinhole()
    }
}

impl Scene for Watched {
    type Bsdf = Material;
    type Emitter = Light;
    type Medium = Homogeneous;
    type Camera = WatchingCamera;

    fn intersect(&self, ray: &Ray) -> Option<Hit<Material>> {
        self.scene.intersect(ray)
    }

    fn bounds(&self) -> BoundingSphere {
        self.scene.bounds()
    }

    fn emitters(&self) -> &[Light] {
        self.scene.emitters()
    }

    fn media(&self) -> &[Homogeneous] {
        self.scene.media()
    }

    fn camera(&self) -> &WatchingCamera {
        &self.camera
    }

    fn outside(&self) -> Option<MediumId> {
        self.scene.outside()
    }

    fn trace(&self, ray: &Ray, crossings: &mut Vec<Crossing>) -> Option<Hit<Material>> {
        self.scene.trace(ray, crossings)
    }

    fn is_clear(&self, ray: &Ray, crossings: &mut Vec<Crossing>) -> bool {
        self.scene.is_clear(ray, crossings)
    }

    fn stack_at(&self, point: Vec3) -> MediumStack {
        self.scene.stack_at(point)
    }
}
