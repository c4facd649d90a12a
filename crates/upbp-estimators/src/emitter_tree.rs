//! A binary tree over all emitters, by which a receiver chooses one: near and strong ones that shine its way
//! (`docs/theory.md`, section 6.6).
//!
//! Source: Conty Estevez and Kulla, "Importance sampling of many lights with adaptive tree splitting", 2018.

use std::ops::Range;

use glam::Vec3;

use crate::emitter_selection::Selection;
use crate::scene::{BoundingSphere, Emitter, EmitterBounds, EmitterId};

/// The least part of its intensity that a node is taken to send anywhere: bounds are the host's word.
const LEAST_INTENSITY: f64 = 0.02;
/// Most clusters of emitters that are told apart where shares are learnt.
const MOST_CLUSTERS: usize = 64;
/// No side of a split has less than one of this many emitters, so that the depth is logarithmic.
const BALANCE: usize = 8;
/// Smallest squared distance, square scene units.
const LEAST_DISTANCE2: f64 = 1e-60;

const NONE: u32 = u32::MAX;

/// A binary tree over the emitters that can be chosen.
#[derive(Clone, Debug)]
pub(crate) struct EmitterTree {
    /// The root first, parents before children.
    nodes: Vec<Node>,
    /// The leaf of each emitter; [`NONE`] for those that are never chosen.
    leaves: Vec<u32>,
    /// Disjoint subtrees that hold all emitters.
    clusters: Vec<u32>,
}

#[derive(Clone, Debug)]
struct Node {
    parent: u32,
    content: Content,
    /// Emitters below.
    count: u32,
    /// The cluster whose root this is.
    cluster: Option<u16>,
    /// Probability of the emitters below, whoever receives.
    share: f64,
    power: f64,
    /// `None`, if that of any emitter below is unknown, or infinite.
    cone: Option<Cone>,
}

#[derive(Clone, Copy, Debug)]
enum Content {
    Emitter(EmitterId),
    Nodes([u32; 2]),
}

/// Bounds as the intensity at a receiver asks for them.
#[derive(Clone, Copy, Debug)]
struct Cone {
    centre: Vec3,
    /// Square of the radius around the centre.
    radius2: f64,
    axis: Vec3,
    /// Cosine and sine of the angle of normals around the axis; `None` if they point everywhere.
    normals: Option<[f64; 2]>,
    cos_emission: f64,
}

impl Cone {
    fn new(bounds: &EmitterBounds) -> Self {
        let cos = f64::from(bounds.cos_normals);
        Self {
            centre: 0.5 * (bounds.min + bounds.max),
            radius2: 0.25 * (bounds.max - bounds.min).as_dvec3().length_squared(),
            axis: bounds.axis,
            normals: (cos > -1.0).then(|| [cos, (1.0 - cos * cos).max(0.0).sqrt()]),
            cos_emission: f64::from(bounds.cos_emission),
        }
    }

    /// An estimate of the irradiance that a power of one brings to `receiver`, up to a factor; continuous, so
    /// that receivers that are merged agree.
    fn intensity(&self, receiver: Vec3) -> f64 {
        let away = (receiver - self.centre).as_dvec3();
        let distance2 = away.length_squared();
        // The mean over a ball, in its centre and far away.
        let spread = 1.0 / (distance2 + self.radius2 / 3.0).max(LEAST_DISTANCE2);
        let Some([cos_normals, sin_normals]) = self.normals else { return spread };
        if distance2 <= 0.0 {
            return spread;
        }
        // The angle between the axis and the way to the receiver, without that of the bounds as seen from
        // there and without that of the normals.
        let cos = (away.dot(self.axis.as_dvec3()) / distance2.sqrt()).clamp(-1.0, 1.0);
        let seen = self.radius2 / distance2;
        let cos_bounds = if seen < 1.0 { (1.0 - seen).sqrt() } else { 1.0 / seen - 1.0 };
        let sin_bounds = (1.0 - cos_bounds * cos_bounds).max(0.0).sqrt();
        let angle = [cos, (1.0 - cos * cos).max(0.0).sqrt()];
        let [cos, _] = less(less(angle, [cos_bounds, sin_bounds]), [cos_normals, sin_normals]);
        let towards = ((cos - self.cos_emission) / (1.0 - self.cos_emission)).max(0.0);
        spread * (LEAST_INTENSITY + (1.0 - LEAST_INTENSITY) * towards)
    }
}

/// Cosine and sine of `max(0, a − b)`.
fn less([cos_a, sin_a]: [f64; 2], [cos_b, sin_b]: [f64; 2]) -> [f64; 2] {
    if cos_a > cos_b { [1.0, 0.0] } else { [cos_a * cos_b + sin_a * sin_b, sin_a * cos_b - cos_a * sin_b] }
}

/// An emitter on the way into the tree.
struct Item {
    emitter: EmitterId,
    power: f64,
    bounds: Option<EmitterBounds>,
}

impl EmitterTree {
    /// The tree over emitters of these powers, of which those without power are left out. `None` where it
    /// would tell no more than power: unless at least two emitters say where they are.
    pub(crate) fn new<E: Emitter>(emitters: &[E], powers: &[f64], scene: &BoundingSphere) -> Option<Self> {
        let mut items: Vec<Item> = (0..emitters.len())
            .filter(|&i| powers[i] > 0.0)
            .map(|i| Item {
                emitter: EmitterId(i as u32),
                power: powers[i],
                bounds: emitters[i].bounds(scene).filter(EmitterBounds::is_valid),
            })
            .collect();
        items.sort_by_key(|item| item.bounds.is_some());
        let unknown = items.partition_point(|item| item.bounds.is_none());
        if items.len() < unknown + 2 {
            return None;
        }
        let mut tree = Self { nodes: Vec::new(), leaves: vec![NONE; emitters.len()], clusters: Vec::new() };
        tree.grow(NONE, &mut items);
        tree.cut();
        Some(tree)
    }

    /// Adds the subtree of `items`; returns its root. Those of unknown bounds come first.
    fn grow(&mut self, parent: u32, items: &mut [Item]) -> u32 {
        let index = self.nodes.len() as u32;
        let bounds = items.iter().map(|item| item.bounds).reduce(|a, b| Some(a?.around(&b?))).flatten();
        self.nodes.push(Node {
            parent,
            content: Content::Emitter(items[0].emitter),
            count: items.len() as u32,
            cluster: None,
            share: 0.0,
            power: items.iter().map(|item| item.power).sum(),
            cone: bounds.as_ref().map(Cone::new),
        });
        if let [item] = items {
            self.leaves[item.emitter.0 as usize] = index;
        } else {
            let middle = split(items);
            let (lower, upper) = items.split_at_mut(middle);
            let children = [self.grow(index, lower), self.grow(index, upper)];
            self.nodes[index as usize].content = Content::Nodes(children);
        }
        index
    }

    /// Cuts the tree into clusters: the one with most emitters is divided, as long as there may be more.
    fn cut(&mut self) {
        let mut clusters = vec![0_u32];
        while clusters.len() < MOST_CLUSTERS {
            let (place, &largest) = clusters
                .iter()
                .enumerate()
                .max_by_key(|&(place, &node)| (self.node(node).count, std::cmp::Reverse(place)))
                .unwrap_or((0, &0));
            let Content::Nodes([lower, upper]) = self.node(largest).content else { break };
            clusters[place] = lower;
            clusters.push(upper);
        }
        for (cluster, &node) in clusters.iter().enumerate() {
            self.nodes[node as usize].cluster = Some(cluster as u16);
        }
        self.clusters = clusters;
    }

    /// Takes the probabilities of emitters by which those of unknown bounds are chosen.
    pub(crate) fn set_shares(&mut self, selection: &Selection) {
        for index in (0..self.nodes.len()).rev() {
            self.nodes[index].share = match self.nodes[index].content {
                Content::Emitter(emitter) => f64::from(selection.probability(emitter)),
                Content::Nodes(children) => children.map(|child| self.node(child).share).iter().sum(),
            };
        }
    }

    pub(crate) const fn clusters(&self) -> usize {
        self.clusters.len()
    }

    fn node(&self, index: u32) -> &Node {
        &self.nodes[index as usize]
    }

    /// Probability of the lower of two nodes.
    fn lower_part(&self, children: [u32; 2], receiver: Vec3) -> f64 {
        let [lower, upper] = children.map(|child| self.node(child));
        let (lower, upper) = match (&lower.cone, &upper.cone) {
            (Some(a), Some(b)) => (lower.power * a.intensity(receiver), upper.power * b.intensity(receiver)),
            _ => (lower.share, upper.share),
        };
        lower / (lower + upper)
    }

    /// Chooses an emitter of a cluster, or of all, for `receiver` by a number in `[0, 1)`.
    pub(crate) fn choose(&self, cluster: Option<u16>, receiver: Vec3, mut u: f64) -> EmitterId {
        let mut index = cluster.map_or(0, |cluster| self.clusters[cluster as usize]);
        loop {
            match self.node(index).content {
                Content::Emitter(emitter) => return emitter,
                Content::Nodes(children) => {
                    let part = self.lower_part(children, receiver);
                    if u < part {
                        u /= part;
                        index = children[0];
                    } else {
                        u = (u - part) / (1.0 - part);
                        index = children[1];
                    }
                }
            }
        }
    }

    /// The cluster of an emitter, and the probabilities that [`choose`](Self::choose) takes the cluster among
    /// all and the emitter within it. `None` if it is never chosen.
    pub(crate) fn probability(&self, emitter: EmitterId, receiver: Vec3) -> Option<(u16, [f64; 2])> {
        let mut index = *self.leaves.get(emitter.0 as usize)?;
        let (mut found, mut parts) = (None, [1.0; 2]);
        while let Some(node) = self.nodes.get(index as usize) {
            found = found.or(node.cluster);
            if let Some(Content::Nodes(children)) = self.nodes.get(node.parent as usize).map(|n| n.content) {
                let lower = self.lower_part(children, receiver);
                let part = if index == children[0] { lower } else { 1.0 - lower };
                parts[usize::from(found.is_none())] *= part;
            }
            index = node.parent;
        }
        Some((found?, parts))
    }
}

/// Index at which to split items: those of unknown bounds from others, else by place, where the product of
/// power, area and solid angle is least. Sorts them.
fn split(items: &mut [Item]) -> usize {
    let unknown = items.iter().take_while(|item| item.bounds.is_none()).count();
    let all: Vec<_> = items.iter().filter_map(|item| item.bounds).collect();
    if unknown == items.len() {
        return items.len() / 2;
    } else if unknown > 0 {
        return unknown;
    }
    let centre = |item: &Item| item.bounds.map_or(Vec3::ZERO, |bounds| 0.5 * (bounds.min + bounds.max));
    let (low, high) = all.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), bounds| {
        let centre = 0.5 * (bounds.min + bounds.max);
        (low.min(centre), high.max(centre))
    });
    let axis = (high - low).max_position();
    items.sort_by(|a, b| centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.emitter.0.cmp(&b.emitter.0)));
    let lower = costs(items.iter());
    let upper = costs(items.iter().rev());
    let count = items.len();
    let least = count.div_ceil(BALANCE).max(1);
    let cost = |at: usize| lower[at - 1] + upper[count - at - 1];
    let range: Range<usize> = least..count - least + 1;
    range.min_by(|&a, &b| cost(a).total_cmp(&cost(b))).unwrap_or(count / 2)
}

/// Costs of the first items, by their number less one.
fn costs<'a>(items: impl Iterator<Item = &'a Item>) -> Vec<f64> {
    let mut sum: Option<(f64, EmitterBounds)> = None;
    items
        .filter_map(|item| Some((item.power, item.bounds?)))
        .map(|(power, bounds)| {
            let (power, bounds) = match &sum {
                Some((before, around)) => (before + power, around.around(&bounds)),
                None => (power, bounds),
            };
            sum = Some((power, bounds));
            let size = (bounds.max - bounds.min).as_dvec3();
            let area = size.x * size.y + size.y * size.z + size.z * size.x + size.length_squared();
            // Of the directions that light goes: 2 − 2 cos is the solid angle over π.
            power * area * (2.0 - f64::from(bounds.cos_normals) - 0.5 * f64::from(bounds.cos_emission))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean of `cos / d²` over points all over a box, as these bounds have them shine.
    fn irradiance(bounds: &EmitterBounds, receiver: Vec3) -> f64 {
        const STEPS: u32 = 24;
        let points = (0..STEPS.pow(3)).map(|i| {
            let cell = [i % STEPS, i / STEPS % STEPS, i / STEPS / STEPS];
            let place = Vec3::from(cell.map(|k| (k as f32 + 0.5) / STEPS as f32));
            bounds.min + (bounds.max - bounds.min) * place
        });
        let brings = |point: Vec3| {
            let away = (receiver - point).as_dvec3();
            let cos = away.normalize().dot(bounds.axis.as_dvec3()).max(0.0);
            (if bounds.cos_normals > 0.0 { cos } else { 1.0 }) / away.length_squared()
        };
        points.map(brings).sum::<f64>() / f64::from(STEPS.pow(3))
    }

    /// Far away the estimate is exact. Near, beside and inside it is right up to a small factor wherever any
    /// light comes to.
    #[test]
    fn the_intensity_is_the_irradiance_up_to_a_small_factor() {
        let down = EmitterBounds {
            axis: Vec3::NEG_Y,
            cos_normals: 1.0,
            ..EmitterBounds::all_around(Vec3::NEG_ONE, Vec3::ONE)
        };
        let panel = EmitterBounds { min: Vec3::new(-1.0, 0.0, -1.0), max: Vec3::new(1.0, 0.0, 1.0), ..down };
        let near =
            [(0.03, 0.02, 0.01), (0.0, 0.3, 0.0), (0.0, -0.3, 0.0), (0.9, -0.2, 0.9), (2.0, -0.5, 1.0)]
                .map(Vec3::from);
        for bounds in [down, panel, EmitterBounds::all_around(down.min, down.max)] {
            let cone = Cone::new(&bounds);
            let ratio = |receiver| cone.intensity(receiver) / irradiance(&bounds, receiver);
            // Above the panel there is no light.
            for receiver in near.into_iter().filter(|&receiver| irradiance(&bounds, receiver) > 0.0) {
                let ratio = ratio(receiver);
                assert!((0.3..4.0).contains(&ratio), "{bounds:?}, {receiver}: {ratio}");
            }
            for receiver in [Vec3::Y * -20.0, Vec3::new(15.0, -15.0, 3.0)] {
                assert!((ratio(receiver) - 1.0).abs() < 0.1, "{bounds:?}, {receiver}: {}", ratio(receiver));
            }
        }
    }
}
