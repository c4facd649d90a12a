//! Guided emission: light sub-paths that start where the picture needs them (`docs/theory.md`, section 6.11).
//!
//! An emitter maps four uniform random numbers to a place and a direction. A guide warps these numbers by a
//! density that is constant within the cells of a binary tree over the unit hypercube, so that it serves
//! every kind of emitter and stays exact.

use serde::{Deserialize, Serialize};

use crate::random::ONE_MINUS_EPSILON;

/// Random numbers of a start: two for the place, two for the direction.
pub(crate) const AXES: usize = 4;
/// Part of the starts that stays with the emitter's own distribution: but for the rounding of shares, no
/// contribution has more than twice the weight that it has without a guide.
const DEFENSIVE: f64 = 0.5;
/// Samples that a cell needs to be split.
const SPLIT_SAMPLES: usize = 16;
/// Part of all light that a cell needs to be split.
const SPLIT_LIGHT: f64 = 1.0 / 2048.0;
/// Most splits along one axis: random numbers have 24 bits, and positions of a scene hardly more.
const MOST_SPLITS: u8 = 20;
/// Places of random numbers.
const STEPS: f64 = 16_777_216.0;
/// Shares are stored in units of 1/4096.
const SHARES: u16 = 4096;
/// The least share of a half.
const LEAST_SHARE: u16 = 4;
/// Bins per axis by which a cell is judged along one axis.
const BINS: usize = 8;
/// Bins per axis by which a cell is judged over both axes of a pair.
const COARSE_BINS: usize = 4;
/// Concentration of the light in the bins of a cell, 1 if it is even, from which on the cell is split.
const UNEVEN: f64 = 1.15;
/// Part of the light of a sample that is spread around it, and the number of places that get it.
const SPREAD: f64 = 0.5;
const SPREAD_PLACES: usize = 3;
/// Steps of a sequence that fills the unit hypercube evenly (Roberts 2018): powers of one over the root of
/// `x⁵ = x + 1`.
const EVEN_STEPS: [f64; AXES] =
    [0.856_674_883_854_503, 0.733_891_856_627_126, 0.628_706_721_037_809, 0.538_597_257_223_610];

/// The random numbers of a start in a sequence of which each first part fills the unit hypercube evenly.
pub(crate) fn even_numbers(index: usize) -> [f32; 4] {
    EVEN_STEPS.map(|step| (0.5 + index as f64 * step).fract() as f32).map(|u| u.min(ONE_MINUS_EPSILON))
}

/// A start of a light sub-path with the light that it brought to the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmissionSample {
    /// The random numbers that it was made with: two for the place, two for the direction.
    pub at: [f32; 4],
    /// Light of the start, not negative: contributions that already count for their density, in any unit.
    pub light: f64,
}

/// A distribution over the random numbers with which light sub-paths start at an emitter.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Node>", into = "Vec<Node>")]
pub struct EmissionGuide {
    /// A [valid](Self::is_valid) binary tree in preorder: the lower half follows its node.
    nodes: Vec<Node>,
}

/// Axis, index of the upper half, and share of the lower half; the upper half of a leaf is 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Node(u8, u32, u16);

const LEAF: Node = Node(0, 0, 0);

impl Node {
    fn lower_share(self) -> f64 {
        f64::from(self.2) / f64::from(SHARES)
    }

    const fn is_leaf(self) -> bool {
        self.1 == 0
    }
}

impl TryFrom<Vec<Node>> for EmissionGuide {
    type Error = &'static str;

    fn try_from(nodes: Vec<Node>) -> Result<Self, Self::Error> {
        let guide = Self { nodes };
        guide.is_valid([true; AXES]).then_some(guide).ok_or("expected the tree of a guide")
    }
}

impl From<EmissionGuide> for Vec<Node> {
    fn from(guide: EmissionGuide) -> Self {
        guide.nodes
    }
}

impl EmissionGuide {
    /// The guide to the light that was seen, which splits only the `axes` that matter. `None` if the light
    /// says nothing, or is even.
    #[must_use]
    pub fn fit(samples: &[EmissionSample], axes: [bool; 4]) -> Option<Self> {
        let mut samples: Vec<_> =
            samples.iter().filter(|sample| sample.light > 0.0 && sample.light.is_finite()).copied().collect();
        let cells = Self::grow(&mut samples, axes)?;
        // Light beside the cells of the few samples that there are would be bright and rare.
        Self::grow(&mut cells.spread(&samples, axes), axes)
    }

    /// The guide to just these samples.
    fn grow(samples: &mut [EmissionSample], axes: [bool; 4]) -> Option<Self> {
        let total: f64 = samples.iter().map(|sample| sample.light).sum();
        let mut fit = Fit { nodes: Vec::new(), axes, total };
        let cell = Cell { low: [0.0; AXES], splits: [0; AXES] };
        (total > 0.0 && total.is_finite()).then(|| fit.grow(cell, samples));
        (fit.nodes.len() > 1).then_some(Self { nodes: fit.nodes })
    }

    /// The samples with a part of their light spread around them, as far as the cell of each is wide.
    fn spread(&self, samples: &[EmissionSample], axes: [bool; 4]) -> Vec<EmissionSample> {
        let own =
            samples.iter().map(|sample| EmissionSample { light: (1.0 - SPREAD) * sample.light, ..*sample });
        let around = samples.iter().enumerate().flat_map(|(index, sample)| {
            let widths = self.cell_at(sample.at).widths();
            let light = SPREAD / SPREAD_PLACES as f64 * sample.light;
            (0..SPREAD_PLACES).map(move |place| {
                let number = (index * SPREAD_PLACES + place) as f64;
                let at = std::array::from_fn(|axis| {
                    if !axes[axis] {
                        return sample.at[axis];
                    }
                    let offset = 2.0 * (number * EVEN_STEPS[axis]).fract() - 1.0;
                    mirrored(f64::from(sample.at[axis]) + offset * f64::from(widths[axis]))
                });
                EmissionSample { at, light }
            })
        });
        own.chain(around).collect()
    }

    /// The cell at random numbers.
    fn cell_at(&self, at: [f32; 4]) -> Cell {
        let mut cell = Cell { low: [0.0; AXES], splits: [0; AXES] };
        let mut index = 0;
        while !self.nodes[index].is_leaf() {
            let node = self.nodes[index];
            let [lower, upper] = cell.halves(node.0 as usize);
            let is_lower = at[node.0 as usize] < upper.low[node.0 as usize];
            (cell, index) = if is_lower { (lower, index + 1) } else { (upper, node.1 as usize) };
        }
        cell
    }

    /// Maps uniform random numbers to guided ones; returns the guided density there, relative to uniform.
    #[must_use]
    pub(crate) fn warp(&self, uniform: [f32; 4]) -> ([f32; 4], f32) {
        let mut within = uniform.map(f64::from);
        let (mut low, mut width) = ([0.0; AXES], [1.0; AXES]);
        let (mut index, mut density) = (0, 1.0);
        while !self.nodes[index].is_leaf() {
            let node = self.nodes[index];
            let (axis, share) = (node.0 as usize, node.lower_share());
            width[axis] *= 0.5;
            if within[axis] < share {
                within[axis] /= share;
                density *= 2.0 * share;
                index += 1;
            } else {
                within[axis] = (within[axis] - share) / (1.0 - share);
                low[axis] += width[axis];
                density *= 2.0 * (1.0 - share);
                index = node.1 as usize;
            }
        }
        // Down to the multiples that random numbers are: digits beyond them, which emitters add, stay in the
        // cell, whose ends are such multiples.
        let at = std::array::from_fn(|axis| {
            let place = ((low[axis] + width[axis] * within[axis]) * STEPS).floor();
            (place.min((low[axis] + width[axis]) * STEPS - 1.0) / STEPS) as f32
        });
        (at, density as f32)
    }

    /// The guided density at random numbers, relative to uniform.
    #[must_use]
    pub fn density(&self, at: [f32; 4]) -> f32 {
        let mut within = at;
        let (mut index, mut density) = (0, 1.0);
        while !self.nodes[index].is_leaf() {
            let node = self.nodes[index];
            let (axis, share) = (node.0 as usize, node.lower_share());
            // Exact: a multiplication by two and a difference of neighbours.
            within[axis] *= 2.0;
            if within[axis] < 1.0 {
                density *= 2.0 * share;
                index += 1;
            } else {
                within[axis] -= 1.0;
                density *= 2.0 * (1.0 - share);
                index = node.1 as usize;
            }
        }
        density as f32
    }

    /// Whether this is a tree that splits only the `axes` that matter.
    pub(crate) fn is_valid(&self, axes: [bool; 4]) -> bool {
        // The subtree at an index, whose end it returns, below some splits along each axis.
        fn end(nodes: &[Node], index: usize, axes: [bool; AXES], mut splits: [u8; AXES]) -> Option<usize> {
            let &Node(axis, upper, share) = nodes.get(index)?;
            if nodes[index].is_leaf() {
                return Some(index + 1);
            }
            let splits_of_axis = splits.get_mut(axis as usize)?;
            let is_node = axes[axis as usize]
                && *splits_of_axis < MOST_SPLITS
                && (LEAST_SHARE..=SHARES - LEAST_SHARE).contains(&share);
            *splits_of_axis += 1;
            let middle = is_node.then(|| end(nodes, index + 1, axes, splits)).flatten()?;
            (middle == upper as usize).then(|| end(nodes, middle, axes, splits)).flatten()
        }
        end(&self.nodes, 0, axes, [0; AXES]) == Some(self.nodes.len())
    }
}

/// A cell of the hypercube.
#[derive(Clone, Copy)]
struct Cell {
    low: [f32; AXES],
    splits: [u8; AXES],
}

impl Cell {
    fn width(&self, axis: usize) -> f32 {
        0.5_f32.powi(i32::from(self.splits[axis]))
    }

    fn widths(&self) -> [f32; AXES] {
        std::array::from_fn(|axis| self.width(axis))
    }

    fn volume(&self) -> f64 {
        self.widths().iter().map(|width| f64::from(*width)).product()
    }

    /// The lower and the upper half along an axis.
    fn halves(&self, axis: usize) -> [Self; 2] {
        let mut lower = *self;
        lower.splits[axis] += 1;
        let mut upper = lower;
        upper.low[axis] += lower.width(axis);
        [lower, upper]
    }
}

/// A tree that grows.
struct Fit {
    nodes: Vec<Node>,
    axes: [bool; AXES],
    total: f64,
}

impl Fit {
    /// Appends the tree of a cell; returns the probability of the cell.
    fn grow(&mut self, cell: Cell, samples: &mut [EmissionSample]) -> f64 {
        let index = self.nodes.len();
        self.nodes.push(LEAF);
        let light: f64 = samples.iter().map(|sample| sample.light).sum();
        let Some(axis) = self.axis_to_split(&cell, samples, light) else {
            return DEFENSIVE * cell.volume() + (1.0 - DEFENSIVE) * light / self.total;
        };
        let [lower, upper] = cell.halves(axis);
        samples.sort_unstable_by_key(|sample| sample.at[axis] >= upper.low[axis]);
        let below = samples.partition_point(|sample| sample.at[axis] < upper.low[axis]);
        let (below, above) = samples.split_at_mut(below);
        let lower = self.grow(lower, below);
        let start = self.nodes.len() as u32;
        let upper = self.grow(upper, above);
        let share = (lower / (lower + upper) * f64::from(SHARES)).round() as u16;
        self.nodes[index] = Node(axis as u8, start, share.clamp(LEAST_SHARE, SHARES - LEAST_SHARE));
        lower + upper
    }

    /// The axis along which the light of a cell is least even; `None` if it is even, or too little is known.
    fn axis_to_split(&self, cell: &Cell, samples: &[EmissionSample], light: f64) -> Option<usize> {
        if samples.len() < SPLIT_SAMPLES || light < SPLIT_LIGHT * self.total {
            return None;
        }
        let squares: f64 = samples.iter().map(|sample| sample.light * sample.light).sum();
        let effective = light * light / squares;
        // Even light in few samples has a concentration of its own.
        let least = |bins: usize| UNEVEN + 2.0 * (bins - 1) as f64 / effective;
        let splits = |pair: usize| {
            let axes = [2 * pair, 2 * pair + 1];
            let shares = shares(cell, samples, axes, light);
            let along = [
                shares.map(|row| row.iter().sum()),
                std::array::from_fn(|column| shares.iter().map(|row| row[column]).sum::<f64>()),
            ];
            // Light on a slope may be even along both axes.
            let is_uneven = axes.iter().all(|axis| self.axes[*axis])
                && concentration(&coarse(&shares)) > least(COARSE_BINS * COARSE_BINS);
            let along = along.map(|shares| concentration(&shares));
            std::iter::zip(axes, along)
                .filter(|(axis, _)| self.axes[*axis] && cell.splits[*axis] < MOST_SPLITS)
                .filter(move |(_, concentration)| is_uneven || *concentration > least(BINS))
        };
        let pairs = (0..AXES / 2).filter(|pair| self.axes[2 * pair] || self.axes[2 * pair + 1]);
        pairs.flat_map(splits).max_by(|a, b| a.1.total_cmp(&b.1)).map(|(axis, _)| axis)
    }
}

/// Shares of the light of a cell in bins over two axes.
fn shares(cell: &Cell, samples: &[EmissionSample], axes: [usize; 2], light: f64) -> [[f64; BINS]; BINS] {
    let mut shares = [[0.0; BINS]; BINS];
    for sample in samples {
        let [row, column] = axes.map(|axis| {
            let place = (sample.at[axis] - cell.low[axis]) / cell.width(axis) * BINS as f32;
            (place as usize).min(BINS - 1)
        });
        shares[row][column] += sample.light / light;
    }
    shares
}

/// Shares summed into larger bins.
fn coarse(shares: &[[f64; BINS]; BINS]) -> [f64; COARSE_BINS * COARSE_BINS] {
    const SIDE: usize = BINS / COARSE_BINS;
    let mut sums = [0.0; COARSE_BINS * COARSE_BINS];
    for (row, shares) in shares.iter().enumerate() {
        for (column, share) in shares.iter().enumerate() {
            sums[row / SIDE * COARSE_BINS + column / SIDE] += share;
        }
    }
    sums
}

/// Concentration of a whole in some of its shares: 1 if all are alike, their number if one has it all.
fn concentration(shares: &[f64]) -> f64 {
    shares.len() as f64 * shares.iter().map(|share| share * share).sum::<f64>()
}

/// A number beyond the ends of the unit interval, mirrored there; it is less than one away from them.
fn mirrored(number: f64) -> f32 {
    let number = number.abs();
    let within = if number < 1.0 { number } else { 2.0 - number };
    (within as f32).min(ONE_MINUS_EPSILON)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng as _;

    use super::*;

    fn uniform(random: &mut Xoshiro256PlusPlus) -> [f32; 4] {
        [0; 4].map(|_| (random.next_u64() >> 40) as f32 / (1_u32 << 24) as f32)
    }

    /// Light in a small box, and a little everywhere.
    fn spot(seed: u64, centre: [f32; 4], width: f32, axes: [bool; 4]) -> Vec<EmissionSample> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let inside = |at: [f32; 4], random: &mut Xoshiro256PlusPlus| {
            let u = uniform(random);
            std::array::from_fn(|i| {
                if axes[i] { (centre[i] + width * (u[i] - 0.5)).clamp(0.0, 0.999_999_9) } else { at[i] }
            })
        };
        (0..4096)
            .map(|i| {
                let at = uniform(&mut random);
                if i % 16 == 0 {
                    EmissionSample { at, light: 1e-3 }
                } else {
                    EmissionSample { at: inside(at, &mut random), light: 1.0 }
                }
            })
            .collect()
    }

    proptest! {
        #[test]
        fn what_is_warped_has_the_density_that_it_is_said_to_have(
            seed in 0_u64..1000,
            centre in prop::array::uniform4(0.0_f32..1.0),
            width in 1e-4_f32..0.5,
            axes in prop::array::uniform4(any::<bool>()),
        ) {
            let Some(guide) = EmissionGuide::fit(&spot(seed, centre, width, axes), axes) else { return Ok(()) };
            prop_assert!(guide.is_valid(axes));
            let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
            // The mean of 1 / density over guided numbers is the volume: one.
            let (mut volume, mut squares, n) = (0.0, 0.0, 20_000);
            for _ in 0..n {
                let (at, density) = guide.warp(uniform(&mut random));
                prop_assert!(at.iter().all(|x| (0.0..1.0).contains(x)), "{at:?}");
                prop_assert!(at.iter().all(|x| (f64::from(*x) * STEPS).fract() == 0.0), "{at:?}");
                prop_assert_eq!(guide.density(at), density);
                prop_assert!(density > 0.2 * DEFENSIVE as f32, "{}", density);
                volume += 1.0 / f64::from(density);
                squares += f64::from(density).powi(-2);
            }
            let mean = volume / f64::from(n);
            let error = ((squares / f64::from(n) - mean * mean) / f64::from(n)).sqrt();
            prop_assert!((mean - 1.0).abs() < 5.0 * error + 1e-3, "{} +- {}", mean, error);
        }
    }

    /// Emitters add digits to the numbers: so every place of a cell stands for a strip as wide as any other.
    #[test]
    fn places_of_a_narrow_cell_are_taken_alike() {
        let axes = [true, false, false, false];
        let at = [0.8, 0.5, 0.5, 0.5];
        let guide =
            EmissionGuide::fit(&vec![EmissionSample { at, light: 1.0 }; 4096], axes).expect("uneven light");
        let narrow = guide.density(at);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
        let (mut counts, draws) = (std::collections::BTreeMap::<u32, u32>::new(), 200_000);
        for _ in 0..draws {
            let (at, density) = guide.warp(uniform(&mut random));
            if density == narrow {
                *counts.entry((f64::from(at[0]) * STEPS) as u32).or_default() += 1;
            }
        }
        let places = 1 << (24 - MOST_SPLITS);
        assert_eq!(counts.len(), places, "{counts:?}");
        let expected = counts.values().sum::<u32>() / places as u32;
        assert!(expected > draws / 100, "{counts:?}");
        for count in counts.values() {
            assert!(count.abs_diff(expected) < expected / 10, "{counts:?}");
        }
    }

    #[test]
    fn light_in_a_millionth_of_the_cube_gets_most_starts() {
        for centre in [[0.5; 4], [0.3, 0.7, 0.5, 0.5]] {
            let axes = [true, true, false, false];
            let guide = EmissionGuide::fit(&spot(3, centre, 1e-3, axes), axes).expect("uneven light");
            let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
            let hits = (0..1000)
                .map(|_| guide.warp(uniform(&mut random)).0)
                .filter(|at| (0..2).all(|axis| (at[axis] - centre[axis]).abs() < 1e-3))
                .count();
            assert!(hits > 400, "{hits} of 1000");
            assert!(guide.nodes.len() < 500, "{}", guide.nodes.len());
        }
    }

    /// Along a diagonal every part of an axis has as much light as any other.
    #[test]
    fn light_on_a_slope_is_found() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
        let axes = [true, true, false, false];
        let on_slope = |random: &mut Xoshiro256PlusPlus| {
            let [along, across, ..] = uniform(random);
            [along, (along + 0.04 * across).fract(), 0.5, 0.5]
        };
        let samples: Vec<_> =
            (0..1000).map(|_| EmissionSample { at: on_slope(&mut random), light: 1.0 }).collect();
        let guide = EmissionGuide::fit(&samples, axes).expect("uneven light");
        let logarithms: f32 = (0..1000).map(|_| guide.density(on_slope(&mut random)).ln()).sum();
        // 13 with cells as narrow as the light.
        let gain = (logarithms / 1000.0).exp();
        assert!(gain > 4.0, "{gain}");
    }

    /// A slanted window of which few starts are known: what these have missed is bright and rare.
    #[test]
    fn no_part_of_what_was_met_is_left_out() {
        let axes = [true, true, false, false];
        for seed in 0..20 {
            let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
            let in_window = |random: &mut Xoshiro256PlusPlus| {
                let [u, v, ..] = uniform(random);
                [0.31 + 0.06 * u + 0.03 * v, 0.57 + 0.1 * v - 0.02 * u, 0.5, 0.5]
            };
            let samples: Vec<_> =
                (0..200).map(|_| EmissionSample { at: in_window(&mut random), light: 1.0 }).collect();
            let guide = EmissionGuide::fit(&samples, axes).expect("uneven light");
            let mut densities: Vec<_> = (0..2000).map(|_| guide.density(in_window(&mut random))).collect();
            densities.sort_unstable_by(f32::total_cmp);
            let [rarest, usual] = [0, 1000].map(|index| f64::from(densities[index]));
            // The second moment of light that is even in the window, 1 if all of it had the usual density.
            // Guides to nothing but the samples have 1.6 to 4.2 and a hundredth of the usual density.
            let moment = usual * densities.iter().map(|q| f64::from(*q).recip()).sum::<f64>() / 2000.0;
            assert!(
                usual > 20.0 && rarest > 0.05 * usual && moment < 1.5,
                "{seed}: {rarest}, {usual}, {moment}"
            );
        }
    }

    #[test]
    fn even_light_and_none_need_no_guide() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
        let even: Vec<_> =
            (0..4096).map(|_| EmissionSample { at: uniform(&mut random), light: 1.0 }).collect();
        assert_eq!(EmissionGuide::fit(&even, [true; 4]), None);
        assert_eq!(EmissionGuide::fit(&[], [true; 4]), None);
        let dark = EmissionSample { at: [0.1; 4], light: f64::NAN };
        assert_eq!(EmissionGuide::fit(&[dark; 100], [true; 4]), None);
        // What is infinite tells nothing, and leaves the rest as it is.
        let mut uneven = spot(3, [0.5; 4], 1e-3, [true; 4]);
        let guide = EmissionGuide::fit(&uneven, [true; 4]);
        uneven.push(EmissionSample { at: [0.1; 4], light: f64::INFINITY });
        assert!(guide.is_some() && EmissionGuide::fit(&uneven, [true; 4]) == guide);
    }

    #[test]
    fn what_is_no_tree_is_refused() {
        let is_valid = |nodes: &[Node]| EmissionGuide { nodes: nodes.to_vec() }.is_valid([true; AXES]);
        assert!(is_valid(&[LEAF]));
        assert!(is_valid(&[Node(1, 2, 2000), LEAF, LEAF]));
        assert!(!is_valid(&[]));
        assert!(!is_valid(&[Node(1, 2, 2000), LEAF]), "cut off");
        assert!(!is_valid(&[Node(1, 1, 2000), LEAF, LEAF]), "overlap");
        assert!(!is_valid(&[Node(4, 2, 2000), LEAF, LEAF]), "no axis");
        assert!(!is_valid(&[Node(0, 2, 0), LEAF, LEAF]), "an impossible half");
        assert!(!is_valid(&[LEAF, LEAF]), "more than a tree");
        let first = EmissionGuide { nodes: vec![Node(0, 2, 2000), LEAF, LEAF] };
        assert!(first.is_valid([true, false, false, false]) && !first.is_valid([false, true, true, true]));
        // Each node splits the lower half of the one before it.
        let splits = |axis: fn(u32) -> u8, nodes: u32| {
            let node = |i| Node(axis(i), 2 * nodes - i, 2000);
            (0..nodes).map(node).chain(vec![LEAF; nodes as usize + 1]).collect::<Vec<_>>()
        };
        let most = u32::from(MOST_SPLITS);
        assert!(is_valid(&splits(|_| 0, most)) && is_valid(&splits(|i| (i % 4) as u8, 4 * most)));
        assert!(!is_valid(&splits(|_| 0, most + 1)), "narrower than random numbers");
        let deep: Vec<_> = (0..1000).map(|i| Node(0, 2000 - i, 2000)).chain([LEAF; 1001]).collect();
        assert!(!is_valid(&deep));
    }
}
