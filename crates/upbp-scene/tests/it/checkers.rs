//! The contract checkers find what they are there to find: each fault would bias an image.

mod media;

use glam::{Vec2, Vec3};
use upbp_accel::Quad;
use upbp_estimators::check::{check_bsdf, check_camera, check_emitter, check_scene};
use upbp_estimators::scene::{
    Boundary, BoundingSphere, Bsdf, BsdfEvaluation, BsdfSample, Camera, CameraConnection, CameraRay,
    Emission, EmissionCoordinates, Emitter, EmitterId, EmitterKind, EmitterPoint, Hit, HitDensities,
    Incident, Interface, LensConnection, PathEnd, PixelRect, Scene, Walk,
};
use upbp_estimators::{PreparedScene, Ray};
use upbp_media::{BodyId, Homogeneous, Interior, MediumId, Spectrum};
use upbp_scene::light::{AreaLight, ConstantEnvironment, Light};
use upbp_scene::material::{Dielectric, Lambert, Material, Phong};
use upbp_scene::{PerspectiveCamera, PerspectiveView, ReadyScene};

#[derive(Clone, Copy, PartialEq)]
enum Fault {
    None,
    PdfScaled,
    ReverseSwapped,
    WeightScaled,
    NotReciprocal,
    WrongLobe,
    Roulette,
    OtherAtOnce,
}

#[derive(Clone, Copy)]
struct Faulty(Phong, Fault);

impl Bsdf for Faulty {
    fn eval(&self, towards_light: Vec3, towards_camera: Vec3, interface: Interface) -> Spectrum {
        let value = self.0.eval(towards_light, towards_camera, interface);
        if self.1 == Fault::NotReciprocal { value * towards_light.z.abs() } else { value }
    }

    fn pdf(&self, from: Vec3, to: Vec3, interface: Interface) -> f32 {
        let lobe = Phong { exponent: 12.0, ..self.0 };
        match self.1 {
            Fault::PdfScaled => 0.9 * self.0.pdf(from, to, interface),
            Fault::WrongLobe => lobe.pdf(from, to, interface),
            _ => self.0.pdf(from, to, interface),
        }
    }

    fn sample(
        &self,
        from: Vec3,
        walk: Walk,
        interface: Interface,
        u_lobe: f32,
        u: [f32; 2],
    ) -> Option<BsdfSample> {
        let mut sample = self.0.sample(from, walk, interface, u_lobe, u)?;
        sample.pdf = self.pdf(from, sample.to, interface);
        sample.pdf_reverse = self.pdf(sample.to, from, interface);
        let (light, camera) = if walk == Walk::Light { (from, sample.to) } else { (sample.to, from) };
        sample.weight = self.eval(light, camera, interface) * (sample.to.z.abs() / sample.pdf);
        if self.1 == Fault::ReverseSwapped {
            sample.pdf_reverse = sample.pdf;
        }
        if self.1 == Fault::WeightScaled {
            sample.weight *= 1.01;
        }
        Some(sample)
    }

    fn evaluate(&self, from: Vec3, to: Vec3, walk: Walk, interface: Interface) -> Option<BsdfEvaluation> {
        let Self(phong, fault) = *self;
        let evaluation = phong.evaluate(from, to, walk, interface)?;
        let pdf = self.pdf(from, to, interface);
        let pdf_reverse = if fault == Fault::OtherAtOnce { pdf } else { self.pdf(to, from, interface) };
        Some(BsdfEvaluation {
            value: if walk == Walk::Light {
                self.eval(from, to, interface)
            } else {
                self.eval(to, from, interface)
            },
            pdf,
            pdf_reverse,
            ..evaluation
        })
    }

    fn is_connectible(&self) -> bool {
        true
    }

    fn continuation(&self, from: Vec3) -> f32 {
        if self.1 == Fault::Roulette { 0.0 } else { self.0.continuation(from) }
    }
}

#[test]
fn faults_of_a_surface_are_found() {
    let phong = Phong { diffuse: Spectrum::splat(0.4), specular: Spectrum::splat(0.5), exponent: 8.0 };
    let cases = [
        (Fault::PdfScaled, "frequencies follow the density"),
        (Fault::ReverseSwapped, "pdf_reverse is pdf of the reversed event"),
        (Fault::WeightScaled, "weight is eval · |cos| / pdf"),
        (Fault::NotReciprocal, "eval is reciprocal up to the squared index"),
        (Fault::WrongLobe, "frequencies follow the density"),
        (Fault::Roulette, "continuation is in (0, 1]"),
        (Fault::OtherAtOnce, "evaluate says what eval, pdf and continuation say"),
    ];
    check_bsdf(&Faulty(phong, Fault::None), Interface::MATCHED).unwrap();
    for (fault, expected) in cases {
        assert_eq!(check_bsdf(&Faulty(phong, fault), Interface::MATCHED).unwrap_err().what, expected);
    }
}

#[test]
fn a_density_above_one_is_found() {
    /// Reflects to both sides by a cosine, each with the density of one.
    #[derive(Clone, Copy)]
    struct Doubled(Lambert);
    impl Bsdf for Doubled {
        fn eval(&self, l: Vec3, c: Vec3, interface: Interface) -> Spectrum {
            self.0.eval(l, c, interface)
        }
        fn pdf(&self, _: Vec3, to: Vec3, _: Interface) -> f32 {
            to.z.abs() * std::f32::consts::FRAC_1_PI
        }
        fn sample(
            &self,
            from: Vec3,
            walk: Walk,
            interface: Interface,
            lobe: f32,
            u: [f32; 2],
        ) -> Option<BsdfSample> {
            self.0.sample(from, walk, interface, lobe, u)
        }
        fn is_connectible(&self) -> bool {
            true
        }
    }
    let doubled = Doubled(Lambert { reflectance: Spectrum::splat(0.5) });
    let violation = check_bsdf(&doubled, Interface::MATCHED).unwrap_err();
    assert_eq!(violation.what, "pdf integrates to at most one");
}

/// A light that errs in what `.1` says.
struct WrongLight(Light, &'static str);

impl WrongLight {
    /// Random numbers that are not even, where they are what is wrong.
    fn warped(&self, what: &str, [u, v]: [f32; 2]) -> [f32; 2] {
        if self.1 == what { [u * u, v] } else { [u, v] }
    }
}

impl Emitter for WrongLight {
    fn kind(&self) -> EmitterKind {
        self.0.kind()
    }
    fn power(&self, bounds: &BoundingSphere) -> f32 {
        if self.1 == "power" { 0.0 } else { self.0.power(bounds) }
    }
    fn sample_emission(&self, bounds: &BoundingSphere, a: [f32; 2], b: [f32; 2]) -> Option<Emission> {
        let (a, b) = (self.warped("places", a), self.warped("directions", b));
        let emission = self.0.sample_emission(bounds, a, b)?;
        let factor = if self.1 == "density of a Dirac" { 2.0 } else { 1.0 };
        Some(Emission { pdf_position: emission.pdf_position * factor, ..emission })
    }
    fn sample_incident(&self, bounds: &BoundingSphere, receiver: Vec3, u: [f32; 2]) -> Option<Incident> {
        let incident = self.0.sample_incident(bounds, receiver, self.warped("next events", u))?;
        let sign = if self.1 == "backwards" { -1.0 } else { 1.0 };
        Some(Incident { towards_light: sign * incident.towards_light, ..incident })
    }
    fn pdf_passage(&self, point: &EmitterPoint) -> f32 {
        self.0.pdf_passage(point)
    }
    fn pdf_incident(
        &self,
        bounds: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        receiver: Vec3,
        pdf_position: f32,
    ) -> f32 {
        self.0.pdf_incident(bounds, point, direction, receiver, pdf_position)
    }
    fn emission_coordinates(
        &self,
        bounds: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        on_ray: Vec3,
    ) -> Option<EmissionCoordinates> {
        if !["nothing", "coordinates", "digits"].contains(&self.1) {
            return None;
        }
        let found = self.0.emission_coordinates(bounds, point, direction, on_ray)?;
        let is_unknown = self.1 == "coordinates" && direction.x > 0.0;
        let rough = |u: f32| if self.1 == "digits" { (3e3 * u).round() / 3e3 } else { u };
        let position = found.position.filter(|_| !is_unknown).map(|pair| pair.map(rough));
        Some(EmissionCoordinates { position, ..found })
    }
    fn hit(
        &self,
        bounds: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        to: Vec3,
    ) -> Option<HitDensities> {
        let point =
            &EmitterPoint { normal: if self.1 == "turned" { -point.normal } else { point.normal }, ..*point };
        let hit = self.0.hit(bounds, point, direction, to)?;
        let factor = if self.1 == "density of a hit" { 2.0 } else { 1.0 };
        Some(HitDensities { pdf_position: hit.pdf_position * factor, ..hit })
    }
}

#[test]
fn a_light_with_a_wrong_density_is_found() {
    let bounds = BoundingSphere { centre: Vec3::ZERO, radius: 2.0 };
    let sky = Light::Constant(ConstantEnvironment { radiance: Spectrum::ONE });
    let light = WrongLight(sky, "density of a hit");
    let violation = check_emitter(&light, &bounds, &[Vec3::ZERO]).unwrap_err();
    assert_eq!(violation.what, "hit agrees with sample_emission");
}

#[test]
fn draws_that_do_not_follow_their_densities_are_found() {
    let bounds = BoundingSphere { centre: Vec3::ZERO, radius: 2.0 };
    let scene = ReadyScene::from_ron_str(
        "(version: 1, camera: Perspective(origin: (0, 1, 4), target: (0, 0, 0), fov_degrees: 40),
        media: { \"flame\": Homogeneous(glow: 1) }, materials: { \"black\": Lambert(0), \"null\": Null },
        shapes: [
            (geometry: Quad(origin: (0, 1, 0), edge_u: (0, 0, 1), edge_v: (1, 0, 0)), material: \"black\", emission: 1),
            (geometry: Sphere(centre: (0, -0.5, 0), radius: 0.3), material: \"null\", interior: \"flame\"),
        ],
        lights: [Constant(1), Sun(direction: (1, -1, 0), irradiance: 1), Directional(direction: (0, -1, 0), irradiance: 1),
            Point(position: (0, 0.5, 0), intensity: 1),
            Spot(position: (0, 0.5, 0), target: (1, 0, 0), intensity: 1, cutoff_degrees: 20)])",
        "",
    )
    .unwrap();
    let even = "follows the density of directions";
    let [alike, disc] = ["both ways to choose points give the same", "the disc is sampled uniformly"];
    let found = |light: &Light, fault| {
        let light = WrongLight(light.clone(), fault);
        check_emitter(&light, &bounds, &[Vec3::new(0.3, -1.2, 0.2), Vec3::new(0.4, 1.9, 0.6)])
            .map_err(|violation| violation.what)
    };
    let mut guided = 0;
    for light in scene.emitters() {
        found(light, "nothing").unwrap();
        let expected: &[_] = match light.kind() {
            EmitterKind::Area | EmitterKind::Volume(_) => {
                &[("directions", even), ("places", alike), ("next events", alike)]
            }
            EmitterKind::Environment => &[("directions", even), ("places", disc), ("next events", even)],
            EmitterKind::Directional => &[("places", disc), ("backwards", "seen where it comes from")],
            EmitterKind::Point => &[("directions", even), ("density of a Dirac", "a Dirac is one")],
        };
        for &(fault, what) in expected {
            let Err(violation) = found(light, fault) else { panic!("{fault} of {light:?} is not found") };
            assert!(violation.contains(what), "{fault} of {light:?}: {violation}");
        }
        let point = EmitterPoint { position: Vec3::ZERO, normal: Vec3::Z };
        let coordinates = light.emission_coordinates(&bounds, &point, Vec3::Z, Vec3::ZERO);
        if light.kind() == EmitterKind::Environment
            && coordinates.is_some_and(|found| found.position.is_some())
        {
            guided += 1;
            assert!(found(light, "coordinates").unwrap_err().contains("does not depend on the ray"));
            assert!(found(light, "digits").unwrap_err().contains("most starts"));
        }
    }
    assert_eq!(guided, 1, "the sky");
}

/// Receivers on the dark side alone: light that is chosen is never compared with light that is emitted.
#[test]
fn a_light_that_reaches_no_receiver_is_not_checked() {
    let bounds = BoundingSphere { centre: Vec3::ZERO, radius: 2.0 };
    let quad = Quad::new(Vec3::ZERO, Vec3::X, Vec3::Z).unwrap();
    let lamp = |radiance| WrongLight(Light::Area(AreaLight::new(quad.into(), radiance).unwrap()), "nothing");
    let check = |radiance, receivers: &[Vec3]| check_emitter(&lamp(radiance), &bounds, receivers);
    let [above, below] = [Vec3::new(0.3, 1.0, 0.4), Vec3::new(0.3, -1.0, 0.4)];
    check(Spectrum::ONE, &[above, below]).unwrap();
    check(Spectrum::ZERO, &[]).unwrap();
    let one_side = [above, below].map(|receiver| check(Spectrum::ONE, &[receiver]));
    let violation = one_side.into_iter().find_map(Result::err).unwrap();
    assert_eq!(violation.what, "a light that shines reaches some receiver");
    assert_eq!(check(Spectrum::ONE, &[]).unwrap_err().what, violation.what);
}

/// Mirrors and glass that err in what `.1` says.
#[derive(Clone, Copy)]
struct WrongGlass(Material, &'static str);

impl Bsdf for WrongGlass {
    fn eval(&self, _: Vec3, _: Vec3, _: Interface) -> Spectrum {
        Spectrum::ZERO
    }
    fn pdf(&self, _: Vec3, _: Vec3, _: Interface) -> f32 {
        0.0
    }
    fn sample(
        &self,
        from: Vec3,
        walk: Walk,
        interface: Interface,
        u_lobe: f32,
        u: [f32; 2],
    ) -> Option<BsdfSample> {
        let mut sample = self.0.sample(from, walk, interface, u_lobe, u)?;
        if self.1 == "no reverse" {
            sample.pdf_reverse = 0.0;
        }
        if self.1 == "index" && from.z * sample.to.z < 0.0 {
            // That of light, whichever the walk.
            sample.weight = Spectrum::ONE;
        }
        Some(sample)
    }
    fn is_connectible(&self) -> bool {
        false
    }
}

#[test]
fn faults_of_a_dirac_lobe_are_found() {
    let glass = Material::Dielectric(Dielectric);
    for interface in [Interface { above: 1.0, below: 1.5 }, Interface { above: 1.33, below: 1.1 }] {
        check_bsdf(&WrongGlass(glass, "nothing"), interface).unwrap();
        for (fault, expected) in [
            ("no reverse", "a Dirac lobe leads back as probably as it says"),
            ("index", "a Dirac lobe is reciprocal up to the squared index"),
        ] {
            assert_eq!(check_bsdf(&WrongGlass(glass, fault), interface).unwrap_err().what, expected);
        }
    }
}

/// A camera whose densities are off by factors, an infinite one for no rays, or whose connections are by a
/// shift.
struct WrongCamera {
    camera: PerspectiveCamera,
    pdf: f32,
    image_area: f32,
    shift: Vec2,
}

impl Camera for WrongCamera {
    fn resolution(&self) -> (u32, u32) {
        self.camera.resolution()
    }
    fn ray(&self, film: Vec2, u_lens: [f32; 2]) -> Option<CameraRay> {
        let ray = self.camera.ray(film, u_lens).filter(|_| self.pdf.is_finite())?;
        Some(CameraRay { pdf: ray.pdf * self.pdf, ..ray })
    }
    fn connect(&self, point: Vec3, u_lens: [f32; 2]) -> Option<CameraConnection> {
        let seen = self.camera.connect(point, u_lens)?;
        Some(CameraConnection { film: seen.film + self.shift, pdf: seen.pdf * self.pdf, ..seen })
    }
    fn connect_at(&self, point: Vec3, film: Vec2) -> Option<LensConnection> {
        let seen = self.camera.connect_at(point, film)?;
        Some(LensConnection { image_area: seen.image_area * self.image_area, ..seen })
    }
    fn is_pinhole(&self) -> bool {
        self.camera.is_pinhole()
    }
}

#[test]
fn faults_of_a_camera_are_found() {
    let view = PerspectiveView {
        origin: Vec3::Z,
        target: Vec3::ZERO,
        up: Vec3::Y,
        horizontal_fov: 1.0,
        lens_radius: 0.3,
        focus_distance: 1.0,
    };
    let camera =
        PerspectiveCamera::new(&view, 32, 32, PixelRect { x: 0, y: 0, width: 32, height: 32 }).unwrap();
    let check = |pdf, image_area, shift| check_camera(&WrongCamera { camera, pdf, image_area, shift });
    check(1.0, 1.0, Vec2::ZERO).unwrap();
    let fault = |pdf, image_area, shift| check(pdf, image_area, shift).unwrap_err().what;
    // Coordinates of hundreds, as the usual Cornell box has.
    let far = PerspectiveView {
        origin: Vec3::new(278.0, 273.0, -800.0),
        target: Vec3::new(278.0, 273.0, 0.0),
        lens_radius: 0.0,
        ..view
    };
    let crop = PixelRect { x: 0, y: 0, width: 1920, height: 1080 };
    check_camera(&PerspectiveCamera::new(&far, 1920, 1080, crop).unwrap()).unwrap();
    assert_eq!(fault(1.02, 1.0, Vec2::ZERO), "a pixel's density is one over its solid angle");
    assert_eq!(fault(1.0, 1.0, Vec2::splat(0.5)), "connect inverts ray");
    assert_eq!(fault(1.0, 1.1, Vec2::ZERO), "images of a point have the density of connect_at");
    assert_eq!(fault(f32::INFINITY, 1.0, Vec2::ZERO), "some place of the film has a ray");
}

/// A scene with a fault.
struct WrongScene {
    scene: ReadyScene,
    lights: Vec<WrongLight>,
    fault: &'static str,
}

impl WrongScene {
    /// A lamp in a small body of milk, and a large one, under a sky.
    fn new(fault: &'static str) -> Self {
        let scene = ReadyScene::from_ron_str(
            "(version: 1, camera: Perspective(origin: (0, 1, 4), target: (0, 0, 0), fov_degrees: 40),
            film: (width: 8, height: 8), media: { \"milk\": Homogeneous(sigma_s: 4) },
            materials: { \"black\": Lambert(0), \"glass\": Dielectric(1.5), \"null\": Null },
            shapes: [
                (geometry: Sphere(centre: (0, 1, 0), radius: 0.05), material: \"black\", emission: 300),
                (geometry: Sphere(centre: (0, 1, 0), radius: 0.1), material: \"null\", interior: \"milk\", priority: 1),
                (geometry: Sphere(centre: (0, -0.5, 0), radius: 0.8), material: \"glass\", interior: \"milk\"),
            ],
            lights: [Constant(1)])",
            "",
        )
        .unwrap();
        let lights = scene.emitters().iter().map(|light| WrongLight(light.clone(), fault)).collect();
        Self { scene, lights, fault }
    }
}

impl Scene for WrongScene {
    type Bsdf = Material;
    type Emitter = WrongLight;
    type Medium = Homogeneous;
    type Camera = PerspectiveCamera;

    fn intersect(&self, ray: &Ray) -> Option<Hit<Material>> {
        let mut hit = self.scene.intersect(ray)?;
        if self.fault == "lamp" && hit.emitter.is_some() {
            let interior = Interior { body: BodyId(7), medium: None, priority: 7, ior: 1.0 };
            hit.boundary = Boundary::Null(interior);
        }
        let priority = if self.fault == "lamp of glass" { 2 } else { 0 };
        if ["lamp of glass", "hidden lamp"].contains(&self.fault) && hit.emitter.is_some() {
            let interior = Interior { body: BodyId(7), medium: None, priority, ior: 1.5 };
            hit.boundary = Boundary::Refracting(Material::Dielectric(Dielectric), interior);
        }
        Some(hit)
    }
    fn bounds(&self) -> BoundingSphere {
        self.scene.bounds()
    }
    fn emitters(&self) -> &[WrongLight] {
        &self.lights
    }
    fn media(&self) -> &[Homogeneous] {
        self.scene.media()
    }
    fn camera(&self) -> &PerspectiveCamera {
        self.scene.camera()
    }
    fn medium_extent(&self, medium: MediumId) -> f32 {
        if self.fault == "extent" { f32::NAN } else { self.scene.medium_extent(medium) }
    }
    fn hides(&self, body: Option<BodyId>, end: PathEnd) -> bool {
        match (self.fault, end) {
            ("lights", PathEnd::Lights)
            | ("light", PathEnd::Light(EmitterId(0)))
            | ("lens", PathEnd::Lens) => body.is_none(),
            _ => self.scene.hides(body, end),
        }
    }
}

#[test]
fn faults_of_a_scene_are_found() {
    check_scene(&WrongScene::new("nothing")).unwrap();
    check_scene(&WrongScene::new("lamp of glass")).unwrap();
    for (fault, expected) in [
        ("lamp", "no surface that light passes straight is a light"),
        ("hidden lamp", "no light is on a surface that another body hides"),
        ("extent", "the extent of a medium is positive and finite"),
        ("lights", "what is hidden is not seen"),
        ("light", "what is hidden is not seen"),
        ("lens", "what is hidden is not seen"),
        ("turned", "a light shines on the side of its surface that it starts from"),
    ] {
        assert_eq!(check_scene(&WrongScene::new(fault)).unwrap_err().what, expected, "{fault}");
    }
}

/// It is never chosen, but seen by who hits it.
#[test]
fn a_sky_without_power_is_there() {
    for fault in ["nothing", "power"] {
        let scene = WrongScene::new(fault);
        let sky = scene.lights.iter().position(|light| light.kind() == EmitterKind::Environment);
        let sky = EmitterId(sky.unwrap() as u32);
        assert_eq!(PreparedScene::new(&scene).unwrap().environments(), [sky], "{fault}");
    }
}
