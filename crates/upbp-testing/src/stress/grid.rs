//! The combinations, and what must hold for each.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Mutex;

use super::case::{Axes, Chromatic, Layout, Light, View};
use super::execute::{Render, differs, render};
use super::photon::photons;
use super::walk;
use crate::analytic;
use crate::statistics::Estimate;

/// A check of a case, besides those that are made always.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Check {
    /// Only that all numbers are sane.
    Sane,
    /// Radiance 1, less what the limit of the length cuts.
    Furnace,
    /// The radiance of [`walk::furnace`].
    Oracle,
    /// The mean of another case.
    Like(Axes),
    /// Red is the first of these, green the second.
    Exactly([f64; 2]),
    /// The checks that are made always, with the camera on this photon of the first iteration, modulo their
    /// number.
    OnPhoton(usize),
}

/// A case of the matrix.
#[derive(Clone, Debug)]
pub struct Case {
    /// Group of the grid, a name in the tables.
    pub group: &'static str,
    axes: Axes,
    check: Check,
    /// Bias of kernels that is allowed, relative to the mean.
    slack: f64,
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.group, self.axes)
    }
}

/// Iterations of the first attempt; each further one has four times as many.
const ITERATIONS: u64 = 16;

/// Iterations where no mean is compared.
const SANE_ITERATIONS: u64 = 4;

/// A difference counts when it shows this many times in a row, with other random numbers each time.
const ATTEMPTS: u32 = 3;

impl Case {
    fn new(group: &'static str, axes: Axes, check: Check) -> Self {
        // Kernels that stick out of the medium lose light; the part falls with the radius.
        let merges = axes.technique != "bpt" && axes.technique != "pt" && axes.technique != "hit";
        Self { group, axes, check, slack: if merges { 0.02 } else { 0.0 } }
    }

    /// Renders and judges; the seconds that it took, or what is wrong.
    pub fn judge(&self) -> Result<f64, String> {
        if let Check::OnPhoton(index) = self.check {
            return self.on_photon(index);
        }
        let mut seconds = 0.0;
        let mut wrong = String::new();
        for attempt in 0..ATTEMPTS {
            let first = if self.check == Check::Sane { SANE_ITERATIONS } else { ITERATIONS };
            let iterations = first << (2 * attempt);
            let render = render_axes(&self.axes, iterations, 2 * attempt + 1)?;
            seconds += render.seconds;
            let found = match &self.check {
                Check::Sane | Check::OnPhoton(_) => None,
                Check::Exactly(expected) => self.exactly(&render, expected),
                Check::Furnace => self.furnace(&render),
                Check::Oracle => self.oracle(&render, attempt),
                Check::Like(other) => {
                    let other = render_axes(other, iterations, 2 * attempt + 2)?;
                    seconds += other.seconds;
                    (0..3).find_map(|c| differs(&render.means[c], &other.means[c], self.slack))
                }
            };
            match found {
                None => return Ok(seconds),
                Some(text) => wrong = text,
            }
        }
        Err(wrong)
    }

    /// Nothing absorbs: what is missing was cut. Emission hits see all the rest.
    fn furnace(&self, render: &Render) -> Option<String> {
        let glass = self.axes.layout == Layout::GlassBall && self.axes.view == View::Inside;
        let compression = if glass { 1.5 * 1.5 } else { 1.0 };
        let expected = Estimate { mean: compression * (1.0 - render.cut()), error: 0.0 };
        (0..3).find_map(|c| differs(&render.means[c], &expected, self.slack))
    }

    fn exactly(&self, render: &Render, expected: &[f64; 2]) -> Option<String> {
        // Of a part this small a few thousand walks may see nothing.
        const SEEN: f64 = 1e-3;
        expected.iter().zip(&render.means).find_map(|(&mean, found)| {
            if mean > SEEN {
                differs(found, &Estimate { mean, error: 0.0 }, self.slack)
            } else {
                (found.mean > 10.0 * SEEN).then(|| format!("{:e} against {mean:e}", found.mean))
            }
        })
    }

    /// Looks up where the photons are, puts the camera on one, and sees that it is there.
    fn on_photon(&self, index: usize) -> Result<f64, String> {
        let seed = 1;
        let watch = |axes: &Axes, plan| photons(&axes.scene(), &with_seed(axes, seed), plan);
        let (places, plan) = watch(&self.axes, None)?;
        let place = *places.get(index % places.len().max(1)).ok_or("no photons")?;
        let view = View::OnPhoton(place.to_array().map(f64::from));
        let axes = Axes { view, ..self.axes.clone() };
        let (places, plan) = watch(&axes, Some(plan))?;
        if !places.contains(&place) {
            return Err(format!("no photon at {place} any more"));
        }
        let render = render(&axes.scene(), &with_seed(&axes, seed), Some(plan), ITERATIONS);
        render.map(|render| render.seconds)
    }

    fn oracle(&self, render: &Render, attempt: u32) -> Option<String> {
        let Axes { albedo, g, max_length, .. } = self.axes;
        (0..3).find_map(|c| {
            let expected = oracle(self.axes.taus()[c], albedo, g, max_length, 20_000 << (2 * attempt));
            differs(&render.means[c], &expected, self.slack)
        })
    }
}

fn render_axes(axes: &Axes, iterations: u64, seed: u32) -> Result<Render, String> {
    render(&axes.scene(), &with_seed(axes, seed), None, iterations)
}

fn with_seed(axes: &Axes, seed: u32) -> upbp_core::Settings {
    upbp_core::Settings { seed: seed.into(), ..axes.settings() }
}

fn oracle(tau: f64, albedo: f64, g: f64, max_length: u32, walks: u32) -> Estimate {
    type Key = ([u64; 3], u32, u32);
    static KNOWN: Mutex<BTreeMap<Key, Estimate>> = Mutex::new(BTreeMap::new());
    let key = ([tau, albedo, g].map(f64::to_bits), max_length, walks);
    if let Some(known) = KNOWN.lock().ok().and_then(|known| known.get(&key).copied()) {
        return known;
    }
    let found = walk::furnace(tau, albedo, g, max_length, walks);
    if let Ok(mut known) = KNOWN.lock() {
        known.insert(key, found);
    }
    found
}

const TAUS: [f64; 7] = [0.0, 1e-6, 1e-2, 1.0, 1e2, 1e4, 1e6];
const ALBEDOS: [f64; 5] = [0.0, 0.1, 0.9, 0.999, 1.0];
const ASYMMETRIES: [f64; 6] = [-0.99999, -0.9, 0.0, 1e-6, 0.9, 0.99999];
const CHROMATICS: [Chromatic; 4] =
    [Chromatic::Grey, Chromatic::Ratio(10.0), Chromatic::Ratio(1e4), Chromatic::Clear];
const SCALES: [f64; 5] = [1e-6, 1e-3, 1.0, 1e3, 1e6];
const OFFSETS: [f64; 3] = [0.0, 1e3, 1e6];
const RADII: [f64; 5] = [1e-7, 1e-5, 1e-3, 0.1, 1.0];
const LAYOUTS: [Layout; 14] = [
    Layout::Ball,
    Layout::GlassBall,
    Layout::Nested,
    Layout::Cube,
    Layout::Split,
    Layout::Twice,
    Layout::MeshCube,
    Layout::Halves,
    Layout::Touching,
    Layout::Overlap,
    Layout::GlassOverlap,
    Layout::Floor,
    Layout::Room,
    Layout::Everywhere,
];
const LIGHTS: [Light; 11] = [
    Light::Environment,
    Light::Point,
    Light::PointInside,
    Light::PointOnAxis,
    Light::Laser,
    Light::LaserAcross,
    Light::Sun,
    Light::SunAcross,
    Light::Area,
    Light::Globe,
    Light::Uneven(1e12),
];
const VIEWS: [View; 8] = [
    View::Outside,
    View::Narrow,
    View::Lens,
    View::Inside,
    View::Boundary,
    View::Centre,
    View::OnPoint,
    View::OnWall,
];

/// All cases.
pub fn all() -> Vec<Case> {
    let mut cases = Vec::new();
    media(&mut cases);
    furnaces(&mut cases);
    transforms(&mut cases);
    splits(&mut cases);
    layouts(&mut cases);
    views(&mut cases);
    kernels(&mut cases);
    lengths(&mut cases);
    boundaries(&mut cases);
    slabs(&mut cases);
    on_photons(&mut cases);
    cases
}

/// The full product of what a medium is, against walks in double precision.
fn media(cases: &mut Vec<Case>) {
    for tau in TAUS {
        for albedo in ALBEDOS {
            for g in ASYMMETRIES {
                for chromatic in CHROMATICS {
                    for technique in ["bpt", "all"] {
                        let axes = Axes { tau, albedo, g, chromatic, technique, ..Axes::default() };
                        cases.push(Case::new("media", axes, Check::Oracle));
                    }
                }
            }
        }
    }
}

/// Nothing absorbs, in every layout.
fn furnaces(cases: &mut Vec<Case>) {
    for layout in LAYOUTS {
        // Floors and rooms absorb; nothing comes from infinity through a medium that is everywhere.
        if matches!(layout, Layout::Floor | Layout::Room | Layout::Everywhere) {
            continue;
        }
        for tau in TAUS {
            for view in [View::Outside, View::Inside, View::Boundary] {
                // Which side of the glass?
                if layout == Layout::GlassBall && view == View::Boundary {
                    continue;
                }
                let axes = Axes { tau, albedo: 1.0, layout, view, technique: "hit", ..Axes::default() };
                cases.push(Case::new("furnace", axes, Check::Furnace));
            }
        }
    }
}

/// Scenes at other scales and in other places.
fn transforms(cases: &mut Vec<Case>) {
    for scale in SCALES {
        for offset in OFFSETS {
            // Far away only eighths of a power of two have a place.
            let scale = if offset > 0.0 { scale.log2().round().exp2() } else { scale };
            for (layout, light) in [
                (Layout::Ball, Light::Environment),
                (Layout::Cube, Light::Point),
                (Layout::Floor, Light::Area),
                (Layout::GlassBall, Light::Sun),
                (Layout::MeshCube, Light::Globe),
                (Layout::Halves, Light::Point),
            ] {
                for (tau, g) in [(1e-2, 0.0), (1.0, 0.9), (1e2, 0.0)] {
                    for technique in ["bpt", "all"] {
                        let here = Axes { tau, g, layout, light, technique, ..Axes::default() };
                        let there = Axes { scale, offset, ..here.clone() };
                        // A file may not say more than 1e12.
                        if here != there && scale * offset < 9e11 {
                            cases.push(Case::new("transform", there, Check::Like(here)));
                        }
                    }
                }
            }
        }
    }
}

/// Boundaries that change nothing.
fn splits(cases: &mut Vec<Case>) {
    for (one, other) in [
        (Layout::Split, Layout::Cube),
        (Layout::Twice, Layout::Cube),
        (Layout::MeshCube, Layout::Cube),
        (Layout::Nested, Layout::Ball),
    ] {
        for light in [Light::Environment, Light::Point, Light::PointInside, Light::Area, Light::Globe] {
            for tau in [1e-2, 1.0, 1e2] {
                for g in [0.0, 0.9] {
                    for technique in ["bpt", "all"] {
                        let axes = Axes { tau, g, light, technique, ..Axes::default() };
                        let check = Check::Like(Axes { layout: other, ..axes.clone() });
                        cases.push(Case::new("split", Axes { layout: one, ..axes }, check));
                    }
                }
            }
        }
    }
}

/// Every layout under every light: all techniques together agree with those that have no bias.
fn layouts(cases: &mut Vec<Case>) {
    for layout in LAYOUTS {
        for light in LIGHTS {
            if !can_shine(layout, light) {
                continue;
            }
            for tau in [0.0, 1e-2, 1.0, 1e2, 1e6] {
                let bpt = Axes { tau, layout, light, technique: "bpt", ..Axes::default() };
                cases.push(Case::new("layout", bpt.clone(), Check::Sane));
                // In thick media and on specular chains few samples bring nearly all light: their spread is
                // unknown.
                let known = tau <= 1.0
                    && !matches!(layout, Layout::GlassBall | Layout::GlassOverlap)
                    && !matches!(light, Light::Laser | Light::LaserAcross | Light::Uneven(_));
                let check = if known { Check::Like(bpt.clone()) } else { Check::Sane };
                let all = Axes { technique: "all", ..bpt.clone() };
                cases.push(Case::new("layout", all, check.clone()));
                cases.push(Case::new("layout", Axes { technique: "auto", ..bpt }, check));
            }
        }
    }
}

/// Light from infinity is refused where a medium is everywhere.
fn can_shine(layout: Layout, light: Light) -> bool {
    let infinite = matches!(light, Light::Environment | Light::Sun | Light::SunAcross);
    !(layout == Layout::Everywhere && infinite)
}

/// Every view under every light.
fn views(cases: &mut Vec<Case>) {
    for view in VIEWS {
        for light in LIGHTS {
            // A camera in something opaque is refused.
            if view != View::Centre || light != Light::Globe {
                view_cases(cases, view, light);
            }
        }
    }
    for light in [Light::PointOnAxis, Light::Laser, Light::LaserAcross, Light::Area, Light::Globe] {
        view_cases(cases, View::OnLight, light);
    }
}

fn view_cases(cases: &mut Vec<Case>, view: View, light: Light) {
    for layout in [Layout::Ball, Layout::Cube, Layout::Floor] {
        for (tau, g) in [(1.0, 0.0), (1.0, 0.99999), (1e2, 0.0), (1e2, -0.9)] {
            for technique in ["bpt", "all", "auto"] {
                let axes = Axes { tau, g, layout, light, view, technique, ..Axes::default() };
                cases.push(Case::new("view", axes, Check::Sane));
            }
        }
    }
}

/// Kernels from nothing to everything, with short and long beams.
fn kernels(cases: &mut Vec<Case>) {
    for radius in RADII {
        for light in [Light::Point, Light::Laser, Light::LaserAcross, Light::SunAcross, Light::Globe] {
            for scale in [1e-6, 1.0, 1e6] {
                for (tau, long) in [(1e-2, false), (1.0, false), (1.0, true), (1e2, false), (1e4, true)] {
                    let axes = Axes {
                        tau,
                        light,
                        scale,
                        layout: Layout::Floor,
                        radius: Some(radius),
                        long_photon_beams: long,
                        ..Axes::default()
                    };
                    cases.push(Case::new("kernel", axes, Check::Sane));
                }
            }
        }
    }
}

/// On a boundary the camera sees what it sees next to it.
fn boundaries(cases: &mut Vec<Case>) {
    for light in [Light::Environment, Light::Point, Light::PointInside, Light::SunAcross, Light::Globe] {
        for layout in [Layout::Ball, Layout::Cube, Layout::Split, Layout::Floor, Layout::MeshCube] {
            // On a face that two bodies share, and nothing that rays meet behind it tells of which.
            if layout == Layout::Split && light == Light::Globe {
                continue;
            }
            for (tau, g) in [(1.0, 0.0), (1.0, 0.9)] {
                let on =
                    Axes { tau, g, layout, light, view: View::Boundary, technique: "bpt", ..Axes::default() };
                for view in [View::BeforeBoundary, View::BehindBoundary] {
                    let check = Check::Like(Axes { view, ..on.clone() });
                    cases.push(Case { slack: 0.01, ..Case::new("boundary", on.clone(), check) });
                }
            }
        }
    }
}

/// Limits of the path length.
fn lengths(cases: &mut Vec<Case>) {
    for max_length in [1, 2, 200] {
        for tau in TAUS {
            for technique in ["bpt", "all"] {
                let axes = Axes { tau, max_length, technique, albedo: 1.0, ..Axes::default() };
                cases.push(Case::new("length", axes.clone(), Check::Oracle));
                let axes = Axes { layout: Layout::Floor, light: Light::Area, ..axes };
                cases.push(Case::new("length", axes, Check::Sane));
            }
        }
    }
}

/// Reflectance and transmittance of slabs, of any size, against exact values.
fn slabs(cases: &mut Vec<Case>) {
    for (index, slab) in analytic::cases("slab_RT").iter().enumerate() {
        for cosine in slab.inputs("mu0") {
            let expected = |name| slab.expected(&[&format!("mu0_{cosine}"), name]);
            let check = Check::Exactly([expected("R_total"), expected("T_total")]);
            for technique in ["hit", "bpt"] {
                // A thousand vertices with a thousand others.
                if technique == "bpt" && slab.input("tau") > 10.0 {
                    continue;
                }
                let axes = Axes {
                    tau: slab.input("tau"),
                    albedo: slab.input("albedo"),
                    g: slab.input("g"),
                    scale: SCALES[index % SCALES.len()],
                    layout: Layout::Slab,
                    light: Light::Sides,
                    view: View::OnSlab(cosine),
                    technique,
                    // Thick slabs that hardly absorb have long paths.
                    max_length: 1_000_000,
                    ..Axes::default()
                };
                cases.push(Case::new("slab", axes, check.clone()));
            }
        }
    }
}

/// A camera exactly on a photon of its first iteration, with kernels from nothing to everything.
fn on_photons(cases: &mut Vec<Case>) {
    for light in LIGHTS {
        for layout in [Layout::Ball, Layout::Floor, Layout::Room] {
            for (tau, radius) in
                [(1.0, None), (1.0, Some(1e-7)), (1.0, Some(1.0)), (1e2, None), (1e2, Some(1e-7))]
            {
                // Too little of the near lamp is seen there: the far one keeps the light sub-paths, and
                // hardly any arrives.
                if matches!(light, Light::Uneven(_)) && layout == Layout::Room {
                    continue;
                }
                for (index, technique) in [(0, "bpt"), (0, "all"), (101, "all")] {
                    let axes = Axes { tau, layout, light, technique, radius, ..Axes::default() };
                    cases.push(Case::new("photon", axes, Check::OnPhoton(index)));
                }
            }
        }
    }
}
