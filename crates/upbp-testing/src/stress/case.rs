//! A scene and its settings as data: one point of the matrix.

use std::fmt;

use upbp_core::{LightPaths, Radii, Radius, Settings};

/// Differences between the extinctions of the channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Chromatic {
    /// All the same.
    Grey,
    /// From channel to channel by the root of this ratio.
    Ratio(f64),
    /// Blue has none.
    Clear,
}

/// The bodies of a scene. Coordinates are eighths: they survive a translation by 10⁶.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Layout {
    /// The unit sphere, full of the medium.
    Ball,
    /// The unit sphere with a boundary that refracts.
    GlassBall,
    /// A smaller ball of the same medium in it.
    Nested,
    /// The cube of side 2.
    Cube,
    /// The cube from two halves, of the same medium.
    Split,
    /// The cube twice, one in the other's place.
    Twice,
    /// The cube as triangles.
    MeshCube,
    /// Two halves, of which one scatters ten times less.
    Halves,
    /// Two balls of the medium that touch in a point.
    Touching,
    /// A ball with another medium that reaches out of the cube.
    Overlap,
    /// A ball of glass that reaches out of the cube.
    GlassOverlap,
    /// The cube on a floor that holds its lower face.
    Floor,
    /// The cube fills a room: all faces are walls.
    Room,
    /// Everything is the medium; a small black ball stands in it.
    Everywhere,
    /// A slab of thickness 2 across the z axis, a thousand times as wide.
    Slab,
}

/// The light of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Light {
    /// Radiance 1 from everywhere.
    Environment,
    /// A point beside the bodies.
    Point,
    /// A point in the origin.
    PointInside,
    /// A point between the camera and the bodies.
    PointOnAxis,
    /// A ray of light along the view.
    Laser,
    /// A ray of light across the view.
    LaserAcross,
    /// Parallel light along the view.
    Sun,
    /// Parallel light across the view.
    SunAcross,
    /// A rectangle above.
    Area,
    /// A shining ball in the origin.
    Globe,
    /// A point beside the bodies, and one with this many times its power far behind the camera.
    Uneven(f64),
    /// A red plane right above a slab, a green one right below: the colours of a camera ray are its part
    /// that is reflected and its part that gets through.
    Sides,
}

/// Places of the camera, which looks along -z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum View {
    /// Before the bodies.
    Outside,
    /// Before the bodies, with one direction for all pixels: the axis.
    Narrow,
    /// With a lens.
    Lens,
    /// Inside.
    Inside,
    /// On the boundary of the medium.
    Boundary,
    /// A little outside of it.
    BeforeBoundary,
    /// A little inside of it.
    BehindBoundary,
    /// In the origin.
    Centre,
    /// At the place of [`Light::Point`].
    OnPoint,
    /// Exactly on the light, whichever it is.
    OnLight,
    /// On the floor, looking along it.
    OnWall,
    /// Between a slab and the plane above it; rays fall on the slab with this cosine.
    OnSlab(f64),
    /// A camera on a photon, at this position.
    OnPhoton([f64; 3]),
}

/// One point of the matrix.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Axes {
    /// Optical thickness along the diameter 2, of the first channel.
    pub tau: f64,
    pub albedo: f64,
    pub g: f64,
    pub chromatic: Chromatic,
    /// Scene units per unit.
    pub scale: f64,
    /// Units from the origin, along all axes.
    pub offset: f64,
    pub layout: Layout,
    pub light: Light,
    pub view: View,
    pub technique: &'static str,
    pub max_length: u32,
    /// Radius of all kernels, relative to the scene's bounding sphere.
    pub radius: Option<f64>,
    pub long_photon_beams: bool,
}

impl Default for Axes {
    fn default() -> Self {
        Self {
            tau: 1.0,
            albedo: 0.9,
            g: 0.0,
            chromatic: Chromatic::Grey,
            scale: 1.0,
            offset: 0.0,
            layout: Layout::Ball,
            light: Light::Environment,
            view: View::Outside,
            technique: "all",
            max_length: 200,
            radius: None,
            long_photon_beams: false,
        }
    }
}

impl fmt::Display for Axes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "tau={:?} albedo={:?} g={:?}", self.tau, self.albedo, self.g)?;
        write!(f, " {:?} {:?} {:?} {:?}", self.chromatic, self.layout, self.light, self.view)?;
        write!(f, " scale={:?} offset={:?} length={}", self.scale, self.offset, self.max_length)?;
        if let Some(radius) = self.radius {
            write!(f, " radius={radius:?}")?;
        }
        let long = if self.long_photon_beams { " long beams" } else { "" };
        write!(f, "{long} {}", self.technique)
    }
}

/// Side of the film.
pub(crate) const SIDE: u32 = 12;
/// Full angle of [`View::Outside`], degrees.
pub(crate) const FIELD_OF_VIEW: f64 = 40.0;
/// Distance of [`View::Outside`] from the origin.
pub(crate) const EYE: f64 = 3.0;
/// Half the width of a slab. What leaves at its sides is far below what a few thousand walks resolve.
const SLAB: f64 = 1e3;
/// Between a slab and the planes beside it.
const GAP: f64 = 1.0 / 64.0;

impl Axes {
    /// Optical thickness of each channel.
    pub(crate) fn taus(&self) -> [f64; 3] {
        match self.chromatic {
            Chromatic::Grey => [self.tau; 3],
            Chromatic::Ratio(ratio) => [self.tau, self.tau / ratio.sqrt(), self.tau / ratio],
            Chromatic::Clear => [self.tau, self.tau, 0.0],
        }
    }

    pub(crate) fn settings(&self) -> Settings {
        let radius = self.radius.map_or(Radius::Auto, |radius| Radius::Scene(radius as f32));
        Settings {
            techniques: self.technique.parse().expect("technique names"),
            deterministic: true,
            light_paths: LightPaths::Count(512),
            beams: Some(64),
            max_length: self.max_length,
            radii: Radii::all(radius),
            progressive: self.radius.is_none(),
            photon_beams: if self.long_photon_beams {
                upbp_core::BeamExtent::Long
            } else {
                upbp_core::BeamExtent::Short
            },
            ..Settings::default()
        }
    }

    /// The description of the scene.
    pub(crate) fn scene(&self) -> String {
        let outside = if self.layout == Layout::Everywhere { "outside: \"m\"," } else { "" };
        format!(
            "(version: 1, {} film: (width: {SIDE}, height: {SIDE}), {outside}
            media: {{\"m\": {}, \"thin\": {}}},
            materials: {{\"null\": Null, \"glass\": Dielectric(ior: 1.5), \"black\": Lambert(0.0), \"grey\": Lambert(0.5)}},
            shapes: [{}{}], lights: [{}])",
            self.camera(),
            self.medium(1.0),
            self.medium(0.1),
            self.shapes(),
            self.shining_shapes(),
            self.lights(),
        )
    }

    fn medium(&self, factor: f64) -> String {
        let channels = |share: f64| vector(self.taus().map(|tau| factor * share * tau / (2.0 * self.scale)));
        let (scattering, absorption) = (channels(self.albedo), channels(1.0 - self.albedo));
        let phase =
            if self.g == 0.0 { "Isotropic".to_owned() } else { format!("HenyeyGreenstein({:?})", self.g) };
        format!("Homogeneous(sigma_a: {absorption}, sigma_s: {scattering}, phase: {phase})")
    }

    fn point(&self, p: [f64; 3]) -> String {
        vector(p.map(|x| (x + self.offset) * self.scale))
    }

    fn length(&self, length: f64) -> String {
        format!("{:?}", length * self.scale)
    }

    fn edge(&self, v: [f64; 3]) -> String {
        vector(v.map(|x| x * self.scale))
    }

    fn camera(&self) -> String {
        let (origin, field_of_view, lens) = match self.view {
            View::Outside => ([0.0, 0.0, EYE], FIELD_OF_VIEW, 0.0),
            View::Narrow => ([0.0, 0.0, EYE], 0.001, 0.0),
            View::Lens => ([0.0, 0.0, EYE], FIELD_OF_VIEW, 0.25),
            View::Inside => ([0.0, 0.0, 0.5], FIELD_OF_VIEW, 0.0),
            View::Boundary => ([0.0, 0.0, 1.0], FIELD_OF_VIEW, 0.0),
            View::BeforeBoundary => ([0.0, 0.0, 1.0 + 1e-3], FIELD_OF_VIEW, 0.0),
            View::BehindBoundary => ([0.0, 0.0, 1.0 - 1e-3], FIELD_OF_VIEW, 0.0),
            View::Centre => ([0.0; 3], FIELD_OF_VIEW, 0.0),
            View::OnPoint => ([2.0; 3], FIELD_OF_VIEW, 0.0),
            View::OnLight => (self.light_place(), FIELD_OF_VIEW, 0.0),
            View::OnWall => ([0.0, -1.0, 3.0], FIELD_OF_VIEW, 0.0),
            View::OnSlab(cosine) => {
                let tangent = (1.0 - cosine * cosine).sqrt() / cosine;
                ([0.5 * GAP * tangent, 0.0, 1.0 + 0.5 * GAP], 0.02, 0.0)
            }
            View::OnPhoton(place) => (place, FIELD_OF_VIEW, 0.0),
        };
        let target = match self.view {
            View::OnPoint => [0.0; 3],
            View::Centre => [0.0, 0.0, -1.0],
            View::OnWall => [0.0, -1.0, 0.0],
            View::OnSlab(_) => [0.0, 0.0, 1.0],
            View::OnPhoton([x, y, z]) => [x, y, z - 3.0],
            _ => [0.0, 0.0, origin[2] - 3.0],
        };
        format!(
            "camera: Perspective(origin: {}, target: {}, fov_degrees: {field_of_view:?}, lens_radius: {}),",
            self.point(origin),
            self.point(target),
            self.length(lens)
        )
    }

    fn shapes(&self) -> String {
        let ball = |centre: [f64; 3], radius: f64, material: &str, interior: &str| {
            let geometry = format!("Sphere(centre: {}, radius: {})", self.point(centre), self.length(radius));
            format!("(geometry: {geometry}, material: \"{material}\", {interior}),")
        };
        let cube = |min: [f64; 3], max: [f64; 3], medium: &str| {
            let geometry = format!("Box(min: {}, max: {})", self.point(min), self.point(max));
            format!("(geometry: {geometry}, material: \"null\", interior: \"{medium}\"),")
        };
        let inside = "interior: \"m\"";
        let whole = || cube([-1.0; 3], [1.0; 3], "m");
        match self.layout {
            Layout::Ball => ball([0.0; 3], 1.0, "null", inside),
            Layout::GlassBall => ball([0.0; 3], 1.0, "glass", inside),
            Layout::Nested => ball([0.0; 3], 1.0, "null", inside) + &ball([0.0; 3], 0.5, "null", inside),
            Layout::Cube => whole(),
            Layout::Split => cube([-1.0; 3], [0.0, 1.0, 1.0], "m") + &cube([0.0, -1.0, -1.0], [1.0; 3], "m"),
            Layout::Twice => whole() + &whole(),
            Layout::MeshCube => self.mesh_cube(),
            Layout::Halves => {
                cube([-1.0; 3], [0.0, 1.0, 1.0], "m") + &cube([0.0, -1.0, -1.0], [1.0; 3], "thin")
            }
            Layout::Touching => {
                ball([-0.5, 0.0, 0.0], 0.5, "null", inside) + &ball([0.5, 0.0, 0.0], 0.5, "null", inside)
            }
            Layout::Overlap => whole() + &ball([1.0, 0.0, 0.0], 0.5, "null", "interior: \"thin\""),
            Layout::GlassOverlap => whole() + &ball([1.0, 0.0, 0.0], 0.5, "glass", ""),
            Layout::Floor => {
                whole() + &self.quad([-4.0, -1.0, -4.0], [0.0, 0.0, 8.0], [8.0, 0.0, 0.0], "grey")
            }
            Layout::Room => whole() + &self.room(),
            Layout::Everywhere => ball([0.0, 0.0, -1.0], 0.25, "black", ""),
            Layout::Slab => cube([-SLAB, -SLAB, -1.0], [SLAB, SLAB, 1.0], "m"),
        }
    }

    fn quad(&self, origin: [f64; 3], u: [f64; 3], v: [f64; 3], material: &str) -> String {
        format!(
            "(geometry: Quad(origin: {}, edge_u: {}, edge_v: {}), material: \"{material}\"),",
            self.point(origin),
            self.edge(u),
            self.edge(v)
        )
    }

    fn room(&self) -> String {
        let axis = |axis: usize| std::array::from_fn(|i| if i == axis { 2.0 } else { 0.0 });
        let walls = |side: usize| {
            let (u, v) = ((side + 1) % 3, (side + 2) % 3);
            let far = std::array::from_fn(|i| if i == side { 1.0 } else { -1.0 });
            self.quad([-1.0; 3], axis(u), axis(v), "grey") + &self.quad(far, axis(v), axis(u), "grey")
        };
        (0..3).map(walls).collect()
    }

    fn mesh_cube(&self) -> String {
        let corners: Vec<_> = (0..8_u8)
            .map(|i| self.point([0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1.0 } else { -1.0 })))
            .collect();
        format!(
            "(geometry: Mesh(positions: [{}], indices: [(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), \
            (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)]), material: \"null\", interior: \"m\"),",
            corners.join(", ")
        )
    }

    fn shining_shapes(&self) -> String {
        match self.light {
            Light::Area => format!(
                "(geometry: Quad(origin: {}, edge_u: {}, edge_v: {}), material: \"black\", emission: 1.0),",
                self.point([-0.5, if self.layout == Layout::Room { 1.0 } else { 2.0 }, -0.5]),
                self.edge([1.0, 0.0, 0.0]),
                self.edge([0.0, 0.0, 1.0])
            ),
            Light::Globe => format!(
                "(geometry: Sphere(centre: {}, radius: {}), material: \"black\", emission: 1.0),",
                self.point([0.0; 3]),
                self.length(0.125)
            ),
            Light::Sides => {
                let plane = |z: f64, u: [f64; 3], v: [f64; 3], colour: [f64; 3]| {
                    format!(
                        "(geometry: Quad(origin: {}, edge_u: {}, edge_v: {}), material: \"black\", emission: {}),",
                        self.point([-SLAB, -SLAB, z]),
                        self.edge(u),
                        self.edge(v),
                        vector(colour)
                    )
                };
                let (x, y) = ([2.0 * SLAB, 0.0, 0.0], [0.0, 2.0 * SLAB, 0.0]);
                plane(1.0 + GAP, y, x, [1.0, 0.0, 0.0]) + &plane(-1.0 - GAP, x, y, [0.0, 1.0, 0.0])
            }
            _ => String::new(),
        }
    }

    /// A point of the light that is nowhere else.
    fn light_place(&self) -> [f64; 3] {
        match self.light {
            Light::Point | Light::Uneven(_) => [2.0; 3],
            Light::PointOnAxis | Light::Laser => [0.0, 0.0, 2.0],
            Light::LaserAcross => [2.0, 0.0, 0.0],
            Light::Area => [0.0, if self.layout == Layout::Room { 1.0 } else { 2.0 }, 0.0],
            Light::Globe => [0.0, 0.0, 0.125],
            Light::Sides => [0.0, 0.0, 1.0 + GAP],
            Light::PointInside | Light::Environment | Light::Sun | Light::SunAcross => [0.0; 3],
        }
    }

    fn lights(&self) -> String {
        // Irradiance is the same at any scale; so small because a file may not say more than 1e12.
        let intensity = |factor: f64| format!("{:?}", 1e-6 * factor * self.scale * self.scale);
        let point = |position: [f64; 3], factor: f64| {
            format!("Point(position: {}, intensity: {}),", self.point(position), intensity(factor))
        };
        let laser = |position: [f64; 3], direction: [f64; 3]| {
            format!(
                "Spot(position: {}, direction: {}, intensity: {}, cutoff_degrees: 0.01),",
                self.point(position),
                vector(direction),
                intensity(1e6)
            )
        };
        let sun =
            |direction: [f64; 3]| format!("Directional(direction: {}, irradiance: 1.0),", vector(direction));
        match self.light {
            Light::Environment => "Constant(1.0),".into(),
            Light::Point => point([2.0; 3], 10.0),
            Light::PointInside => point([0.0; 3], 1.0),
            Light::PointOnAxis => point([0.0, 0.0, 2.0], 1.0),
            Light::Laser => laser([0.0, 0.0, 2.0], [0.0, 0.0, -1.0]),
            Light::LaserAcross => laser([2.0, 0.0, 0.0], [-1.0, 0.0, 0.0]),
            Light::Sun => sun([0.0, 0.0, -1.0]),
            Light::SunAcross => sun([-1.0, 0.0, 0.0]),
            Light::Area | Light::Globe | Light::Sides => String::new(),
            Light::Uneven(ratio) => point([2.0; 3], 10.0) + &point([0.0, 0.0, 4.0 * ratio.sqrt()], ratio),
        }
    }
}

fn vector([x, y, z]: [f64; 3]) -> String {
    format!("({x:?}, {y:?}, {z:?})")
}
