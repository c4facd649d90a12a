//! Emitters that a lens shows as wide discs: by place of the film, for connections through the lens.
//!
//! Of the rays of a pixel few meet a small lamp out of focus. If a point of the lamp is given first, it
//! leaves one point of the lens to each place of its disc ([`Camera::connect_at`]). Which lamps a place of
//! the film can see that way is looked up in cells.

use glam::{UVec2, Vec2, Vec3};

use crate::scene::{BoundingSphere, Camera, Emitter, EmitterId, EmitterKind, Incident, Scene};

/// Least side of a cell, pixels.
const CELL: u32 = 16;

/// Most cells along a side of the film.
const MOST_CELLS: u32 = 128;

/// Most emitters that are looked at; of more, those of most power.
const MOST_EMITTERS: usize = 4096;

/// Most emitters of a cell, so that their choice takes a known time.
const MOST_IN_CELL: usize = 32;

/// Points that stand for an emitter.
const POINTS: u32 = 4;

/// Values of each number of `u_lens` that stand for the lens, from its middle to its rim.
const LENS_POINTS: u32 = 5;

/// Least area of the image of a point, relative to the sharp image of the emitter: with a smaller one lens
/// points that meet the emitter are not rare, and connections would not pay.
const LEAST_BLUR: f32 = 0.25;

/// Even share of the choice within a cell: what is bright may be hidden.
const EVEN: f32 = 0.5;

/// Emitters that are out of focus, by place of the film.
#[derive(Clone, Debug)]
pub(crate) struct LensEmitters {
    /// The point for which points on emitters are chosen, whatever lens point they are then seen from.
    pub(crate) viewpoint: Vec3,
    /// Side of a cell, pixels.
    cell: u32,
    /// Cells in a row.
    columns: u32,
    /// Emitters of each cell and their probabilities.
    cells: Vec<Vec<(EmitterId, f32)>>,
}

/// The disc that the lens makes of a point of an emitter.
struct Disc {
    emitter: EmitterId,
    /// Corners of the pixels around the discs of all of its points.
    corners: [Vec2; 2],
    /// Contribution of a connection to a pixel, but for what is in between.
    brightness: f32,
}

impl Disc {
    fn of<S: Scene>(scene: &S, bounds: &BoundingSphere, viewpoint: Vec3, id: usize) -> Option<Self> {
        let (camera, light) = (scene.camera(), &scene.emitters()[id]);
        if light.kind() != EmitterKind::Area {
            return None;
        }
        let mut corners = [Vec2::INFINITY, Vec2::NEG_INFINITY];
        let (mut blur, mut brightness, mut seen) = (0.0, 0.0, 0.0);
        for i in 0..POINTS {
            let u = [(i as f32 + 0.5) / POINTS as f32, (0.5 + i as f32 * 0.618_034).fract()];
            let Some(incident) = light.sample_incident(bounds, viewpoint, u) else { continue };
            let Incident { point, towards_light, distance, radiance, pdf, .. } = incident;
            for j in 0..LENS_POINTS * LENS_POINTS {
                // Below one.
                let at =
                    [j % LENS_POINTS, j / LENS_POINTS].map(|k| 0.999 * k as f32 / (LENS_POINTS - 1) as f32);
                let Some(view) = camera.connect(point.position, at) else { continue };
                let Some(connection) = camera.connect_at(point.position, view.film) else { continue };
                corners = [corners[0].min(view.film), corners[1].max(view.film)];
                let seen_along_ray = -point.normal.dot(towards_light) / (distance * distance);
                let ratio = pdf * connection.image_area / (connection.pdf * seen_along_ray);
                if ratio > 0.0 && ratio.is_finite() {
                    (blur, brightness) = (blur + ratio, brightness + radiance.mean() / ratio);
                    seen += 1.0;
                }
            }
        }
        // Where all points that were tried are black, nothing tells when to choose it.
        let is_lit = brightness > 0.0 && brightness.is_finite();
        let is_out_of_focus = is_lit && blur >= LEAST_BLUR * seen;
        is_out_of_focus.then(|| Self {
            emitter: EmitterId(id as u32),
            corners,
            brightness: brightness / seen,
        })
    }
}

impl LensEmitters {
    /// The emitters of a scene that are out of focus; `None` if there are none. `powers` are theirs.
    pub(crate) fn new<S: Scene>(scene: &S, bounds: &BoundingSphere, powers: &[f64]) -> Option<Self> {
        let camera = scene.camera();
        if camera.is_pinhole() {
            return None;
        }
        let size = UVec2::from(camera.resolution());
        let viewpoint = camera.ray(0.5 * size.as_vec2(), [0.5; 2])?.origin;
        let mut emitters: Vec<_> = (0..scene.emitters().len()).collect();
        // Stable, so that equal emitters stay in order.
        emitters.sort_by(|a, b| powers[*b].total_cmp(&powers[*a]));
        emitters.retain(|id| powers[*id] > 0.0);
        emitters.truncate(MOST_EMITTERS);
        let discs = emitters.into_iter().filter_map(|id| Disc::of(scene, bounds, viewpoint, id));
        let mut discs: Vec<_> = discs.collect();
        discs.sort_by(|a, b| b.brightness.total_cmp(&a.brightness));

        let cell = CELL.max(size.max_element().div_ceil(MOST_CELLS));
        let [columns, rows] = [size.x, size.y].map(|side| side.div_ceil(cell));
        let mut cells = vec![Vec::new(); columns as usize * rows as usize];
        for disc in &discs {
            // Points between those that were tried may lie a little further out.
            let margin = 0.1 * (disc.corners[1] - disc.corners[0]) + Vec2::ONE;
            let [first, last] = [disc.corners[0] - margin, disc.corners[1] + margin]
                .map(|corner| (corner.max(Vec2::ZERO).as_uvec2() / cell).min(UVec2::new(columns, rows) - 1));
            for row in first.y..=last.y {
                for column in first.x..=last.x {
                    let place: &mut Vec<_> = &mut cells[(row * columns + column) as usize];
                    if place.len() < MOST_IN_CELL {
                        place.push((disc.emitter, disc.brightness));
                    }
                }
            }
        }
        for place in &mut cells {
            let sum: f64 = place.iter().map(|&(_, brightness)| f64::from(brightness)).sum();
            let even = EVEN / place.len() as f32;
            for (_, share) in place {
                *share = even + (1.0 - EVEN) * (f64::from(*share) / sum) as f32;
            }
        }
        (!discs.is_empty()).then_some(Self { viewpoint, cell, columns, cells })
    }

    /// The emitters that may be seen out of focus at a place of the film, with their probabilities.
    pub(crate) fn at(&self, film: Vec2) -> &[(EmitterId, f32)] {
        let [column, row] = [film.x, film.y].map(|place| place as usize / self.cell as usize);
        let columns = self.columns as usize;
        let cell = (column < columns).then(|| row.checked_mul(columns)).flatten();
        cell.and_then(|first| self.cells.get(first.checked_add(column)?)).map_or(&[], Vec::as_slice)
    }

    /// Chooses one of them; returns its probability.
    pub(crate) fn choose(&self, film: Vec2, u: f32) -> Option<(EmitterId, f32)> {
        let choices = self.at(film);
        let mut rest = u;
        let chosen = choices.iter().find(|(_, probability)| {
            rest -= probability;
            rest < 0.0
        });
        chosen.or(choices.last()).copied()
    }
}
