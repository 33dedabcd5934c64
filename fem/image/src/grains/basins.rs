//! Watershed segmentation of touching grains. The distance of each grain voxel from the grain surface is interpreted as
//! the height of a landscape; a grain is the basin around a seed, which is a high top of the landscape.
//!
//! No decision depends on the position of a voxel: voxels are processed in the order of their heights, and voxels of
//! equal height are assigned to basins simultaneously. A rotated or mirrored image therefore results in the same
//! partition; only the numbers of the basins depend on the order of the voxels.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::volume::disjoint_sets::DisjointSets;
use crate::volume::filter::highest;
use crate::volume::neighbour_steps;

/// A landscape: heights of the voxels of an image. A rim of height 0 around the image gives every voxel of the image 26
/// neighbours.
#[derive(Debug)]
pub(crate) struct Landscape {
    shape: [usize; 3],
    /// Heights of the voxels, including the rim. The height 0 marks voxels that are not land, i.e. not in the set.
    heights: Vec<u16>,
    /// Index offsets to the 26 neighbours: first the neighbours over faces, then over edges, then over corners.
    steps: [isize; 26],
}

/// Inverse distances of neighbours over a face, an edge and a corner (1/voxel), multiplied by 10 000.
const SLOPES: [i64; 3] = [10_000, 7_071, 5_774];
/// Label of a voxel that is queued but not yet assigned to a basin.
const QUEUED: u32 = u32::MAX;
/// Placeholder for the summit (see [`summits`](Landscape::summits)) of a voxel that is not land.
const NO_LAND: u32 = u32::MAX;
/// Number of voxels in a wave (voxels that are assigned simultaneously) above which several threads process the wave.
const WIDE: usize = 1024;

/// Height of the highest pass between each pair of summits. A pass is the lowest point of a path between two summits.
type Passes = HashMap<[u32; 2], u16>;

impl Landscape {
    /// Creates a landscape from the heights of the voxels in a set; voxels outside the set are not land.
    pub(crate) fn new(shape: [usize; 3], heights: &[u16], set: &[u8]) -> Self {
        let padded = shape.map(|side| side + 2);
        let mut steps: Vec<[isize; 3]> = neighbour_steps().collect();
        steps.sort_by_key(|step| step.iter().filter(|&&s| s != 0).count());
        let [px, py] = [padded[0] as isize, padded[1] as isize];
        let offsets: Vec<isize> = steps.iter().map(|[i, j, k]| i + px * (j + py * k)).collect();
        let mut landscape = Landscape {
            shape,
            heights: vec![0; padded.iter().product()],
            steps: std::array::from_fn(|n| offsets[n]),
        };
        let [nx, ny, nz] = shape;
        for row in 0..ny * nz {
            let here = nx * row..nx * (row + 1);
            let at = landscape.row(row);
            let land = heights[here.clone()].iter().zip(&set[here]);
            for (to, (&height, &is_land)) in landscape.heights[at..at + nx].iter_mut().zip(land) {
                // the height of a voxel of the set is at least 1, because 0 marks voxels that are not land
                *to = if is_land != 0 { height.max(1) } else { 0 };
            }
        }
        landscape
    }

    /// Returns the index of the first voxel of a row in `heights`, which includes the rim.
    fn row(&self, row: usize) -> usize {
        let [nx, ny, _] = self.shape;
        let (y, z) = (row % ny, row / ny);
        1 + (nx + 2) * (y + 1 + (ny + 2) * (z + 1))
    }

    fn neighbours(&self, at: u32) -> impl Iterator<Item = usize> + '_ {
        self.steps.iter().map(move |step| (at as isize + step) as usize)
    }

    /// Returns the indices (with rim) of all voxels of land, the highest voxels first.
    fn descending(&self) -> Vec<u32> {
        let mut starts = vec![0_u32; 65537];
        for &height in &self.heights {
            starts[65535 - height as usize + 1] += 1;
        }
        for n in 0..65536 {
            starts[n + 1] += starts[n];
        }
        let land = starts[65535] as usize;
        let mut order = vec![0; land];
        for (at, &height) in self.heights.iter().enumerate().filter(|&(_, &height)| height > 0) {
            let next = &mut starts[65535 - height as usize];
            order[*next as usize] = at as u32;
            *next += 1;
        }
        order
    }

    /// Finds the tops from which every path to a higher top descends by more than `h`. These tops are the regional
    /// maxima of the morphological reconstruction of (heights − h) under the heights. The seed of a top consists of all
    /// land that is connected to the top by land at most `h` below the top. Seeds are numbered from 1.
    ///
    /// First, every voxel is assigned to a summit, the end of the steepest ascent from the voxel; a hill is the set of
    /// voxels of one summit. Then hills are joined over the passes between them, the highest pass first. Where two
    /// hills are joined, the lower top is a seed if it is more than `h` above the pass. A path of steepest ascent never
    /// descends; therefore the highest passes between hills are also the highest passes between their voxels.
    ///
    /// # References
    /// P. Soille, Morphological Image Analysis, 2nd ed., Springer 2003, section 6.3.4.
    pub(crate) fn h_maxima(&self, h: u16) -> Seeds {
        let summit_of = self.summits();
        let summits: Vec<u32> = summit_of
            .par_iter()
            .enumerate()
            .filter(|&(at, &summit)| at == summit as usize)
            .map(|(at, _)| at as u32)
            .collect();
        let passes = self.passes(&summit_of);
        drop(summit_of);
        let height = |hill: u32| self.heights[summits[hill as usize] as usize];
        let mut hills = DisjointSets::new(summits.len());
        let mut tops = Vec::new();
        for (level, ends) in passes {
            let [a, b] = ends
                .map(|end| summits.partition_point(|&summit| summit < end) as u32)
                .map(|hill| hills.root(hill));
            if a == b {
                continue;
            }
            let (low, high) = if height(a) < height(b) { (a, b) } else { (b, a) };
            if height(low) - level > h {
                tops.push(summits[low as usize]);
            }
            hills.attach(low, high);
        }
        let islands = (0..summits.len() as u32).filter(|&n| hills.root(n) == n);
        tops.extend(islands.filter(|&n| height(n) > h).map(|n| summits[n as usize]));
        tops.sort_unstable();
        self.seeds_around(&tops, Some(h))
    }

    /// Returns the summit of each voxel of land: the end of the path from the voxel that always goes to the highest
    /// neighbour. Among equally high neighbours, the path goes to the neighbour with the lowest index.
    fn summits(&self) -> Vec<u32> {
        let rank = |at: usize| (self.heights[at], std::cmp::Reverse(at));
        let climb = |at: usize| match self.heights[at] {
            0 => NO_LAND,
            _ => self.neighbours(at as u32).chain([at]).max_by_key(|&at| rank(at)).unwrap_or(at)
                as u32,
        };
        let up: Vec<u32> = (0..self.heights.len()).into_par_iter().map(climb).collect();
        let follow = |&first: &u32| {
            let mut at = first;
            while at != NO_LAND && up[at as usize] != at {
                at = up[at as usize];
            }
            at
        };
        up.par_iter().map(follow).collect()
    }

    /// Returns the highest pass between each pair of adjacent hills, with the indices of their summits, sorted from the
    /// highest pass to the lowest.
    fn passes(&self, summit_of: &[u32]) -> Vec<(u16, [u32; 2])> {
        let area = (self.shape[0] + 2) * (self.shape[1] + 2);
        let forth: Vec<usize> =
            self.steps.iter().filter_map(|&s| usize::try_from(s).ok()).collect();
        let add = |mut passes: Passes, (z, slice): (usize, &[u32])| {
            // cache the last pair: consecutive voxels often border the same pair of hills
            let mut last = ([NO_LAND; 2], 0);
            for (n, &summit) in slice.iter().enumerate().filter(|&(_, &summit)| summit != NO_LAND) {
                let at = area * z + n;
                for near in forth.iter().map(|step| at + step) {
                    let other = summit_of[near];
                    if other == summit || other == NO_LAND {
                        continue;
                    }
                    let ends = [summit.min(other), summit.max(other)];
                    let level = self.heights[at].min(self.heights[near]);
                    if ends != last.0 || level > last.1 {
                        let highest = passes.entry(ends).or_insert(level);
                        *highest = level.max(*highest);
                        last = (ends, *highest);
                    }
                }
            }
            passes
        };
        let join = |mut a: Passes, b: Passes| {
            for (ends, level) in b {
                let highest = a.entry(ends).or_insert(level);
                *highest = level.max(*highest);
            }
            a
        };
        let slices = summit_of.par_chunks(area).enumerate();
        let passes = slices.fold(Passes::new, add).reduce(Passes::new, join);
        let mut passes: Vec<(u16, [u32; 2])> =
            passes.into_iter().map(|(ends, level)| (level, ends)).collect();
        passes.sort_unstable_by(|a, b| b.cmp(a));
        passes
    }

    /// Creates a seed around each top. A seed consists of all connected land at most `depth` below the top, or of the
    /// top alone if `depth` is `None`.
    fn seeds_around(&self, tops: &[u32], depth: Option<u16>) -> Seeds {
        let mut labels = vec![0; self.heights.len()];
        let mut voxels = Vec::new();
        for (number, &top) in tops.iter().enumerate() {
            let least = depth.map_or(u16::MAX, |depth| self.heights[top as usize] - depth);
            let start = voxels.len();
            labels[top as usize] = number as u32 + 1;
            voxels.push(top);
            let mut next = start;
            while let Some(&at) = voxels.get(next) {
                for near in self.neighbours(at) {
                    if depth.is_some() && labels[near] == 0 && self.heights[near] >= least {
                        labels[near] = number as u32 + 1;
                        voxels.push(near as u32);
                    }
                }
                next += 1;
            }
        }
        Seeds { labels, voxels }
    }

    /// Finds seeds by a minimum distance, like `peak_local_max` of scikit-image: no voxel within `spacing` voxels along
    /// each axis is higher than a selected top, and selected tops are more than `spacing` voxels apart along at least
    /// one axis. The first of several equal tops (in the order of the voxels) is selected.
    pub(crate) fn spaced_maxima(&self, spacing: usize) -> Seeds {
        let [nx, ny, nz] = self.shape;
        let side = spacing + 1;
        let padded = [nx + 2, ny + 2, nz + 2];
        let mut around = self.heights.clone();
        for _ in 0..spacing {
            around = highest(padded, &around);
        }
        let cells = [nx, ny, nz].map(|n| n.div_ceil(side) + 2);
        let mut selected: Vec<Vec<[usize; 3]>> = vec![Vec::new(); cells.iter().product()];
        let mut tops = Vec::new();
        for at in self.descending() {
            let n = at as usize;
            if around[n] > self.heights[n] {
                continue;
            }
            let voxel = [n % (nx + 2), n / (nx + 2) % (ny + 2), n / ((nx + 2) * (ny + 2))];
            let cell = voxel.map(|c| (c - 1) / side + 1);
            let index = |[i, j, k]: [usize; 3]| i + cells[0] * (j + cells[1] * k);
            let near = (0..27).map(|m| {
                let [i, j, k] = [m % 3, m / 3 % 3, m / 9];
                index([cell[0] + i - 1, cell[1] + j - 1, cell[2] + k - 1])
            });
            let close = |other: &[usize; 3]| (0..3).all(|a| other[a].abs_diff(voxel[a]) <= spacing);
            if near.into_iter().any(|cell| selected[cell].iter().any(close)) {
                continue;
            }
            selected[index(cell)].push(voxel);
            tops.push(at);
        }
        tops.sort_unstable();
        self.seeds_around(&tops, None)
    }

    /// Floods the land from the seeds, the highest voxels first. Each voxel joins the basin of the labelled neighbour
    /// to which the slope is the steepest.
    ///
    /// Voxels of equal height that are reached in the same step (a wave) are assigned simultaneously. If two basins are
    /// equally steep, the following criteria decide, in this order: more neighbours over faces, the larger sum of
    /// slopes, the larger sum of the neighbours' grey values, the lower number of the basin. `grey` contains the grey
    /// values without the rim. Returns the labels without the rim.
    pub(crate) fn flood(&self, seeds: Seeds, grey: &[u16]) -> Vec<u32> {
        let Seeds { mut labels, voxels } = seeds;
        let mut waiting: Vec<Vec<u32>> = vec![Vec::new(); 65536];
        let push = |labels: &mut [u32],
                    at: u32,
                    wave: &mut Vec<u32>,
                    level: usize,
                    waiting: &mut Vec<Vec<u32>>| {
            for near in self.neighbours(at) {
                if labels[near] != 0 {
                    continue;
                }
                let height = usize::from(self.heights[near]);
                if height > 0 {
                    labels[near] = QUEUED;
                    if height >= level {
                        wave.push(near as u32)
                    } else {
                        waiting[height].push(near as u32)
                    }
                }
            }
        };
        for &at in &voxels {
            push(&mut labels, at, &mut Vec::new(), usize::MAX, &mut waiting);
        }
        let mut decided = Vec::new();
        for level in (1..waiting.len()).rev() {
            let mut wave = std::mem::take(&mut waiting[level]);
            while !wave.is_empty() {
                let decide = |&at: &u32| self.decide(&labels, at, grey);
                if wave.len() > WIDE {
                    wave.par_iter().map(decide).collect_into_vec(&mut decided);
                } else {
                    decided.clear();
                    decided.extend(wave.iter().map(decide));
                }
                for (&at, &label) in wave.iter().zip(&decided) {
                    labels[at as usize] = label;
                }
                let mut next = Vec::new();
                for &at in &wave {
                    push(&mut labels, at, &mut next, level, &mut waiting);
                }
                wave = next;
            }
        }
        self.without_rim(&labels)
    }

    /// Returns the label of the basin that a queued voxel joins.
    fn decide(&self, labels: &[u32], at: u32, grey: &[u16]) -> u32 {
        let label_of =
            |near: usize| (labels[near] != 0 && labels[near] != QUEUED).then(|| labels[near]);
        let mut near = self.neighbours(at).filter_map(label_of);
        let first = near.next().expect("a queued voxel has a neighbour with a label");
        if near.all(|label| label == first) {
            return first;
        }
        // for each adjacent basin: label, steepest slope, number of common faces, sum of slopes, sum of grey values
        let mut votes: Vec<(u32, i64, u32, i64, u64)> = Vec::new();
        let height = i64::from(self.heights[at as usize]);
        for (n, near) in self.neighbours(at).enumerate() {
            let Some(label) = label_of(near) else { continue };
            let kind = if n < 6 {
                0
            } else if n < 18 {
                1
            } else {
                2
            };
            let slope = (i64::from(self.heights[near]) - height) * SLOPES[kind];
            let bright = u64::from(grey[self.without_rim_at(near)]);
            let face = u32::from(kind == 0);
            match votes.iter_mut().find(|vote| vote.0 == label) {
                Some(vote) => {
                    *vote =
                        (label, vote.1.max(slope), vote.2 + face, vote.3 + slope, vote.4 + bright);
                }
                None => votes.push((label, slope, face, slope, bright)),
            }
        }
        let rank = |vote: &(u32, i64, u32, i64, u64)| (vote.1, vote.2, vote.3, vote.4, !vote.0);
        votes.iter().max_by_key(|vote| rank(vote)).map_or(first, |vote| vote.0)
    }

    /// Converts the index of a voxel in the landscape with rim to its index in the image.
    fn without_rim_at(&self, at: usize) -> usize {
        let [nx, ny, _] = self.shape;
        let [px, py] = [nx + 2, ny + 2];
        at % px - 1 + nx * (at / px % py - 1 + ny * (at / (px * py) - 1))
    }

    /// Returns the labels without the rim.
    fn without_rim(&self, labels: &[u32]) -> Vec<u32> {
        let [nx, ny, nz] = self.shape;
        let mut result = Vec::with_capacity(nx * ny * nz);
        for row in 0..ny * nz {
            let at = self.row(row);
            // land that is not connected to a seed gets the label 0
            let bare = |&label: &u32| if label == QUEUED { 0 } else { label };
            result.extend(labels[at..at + nx].iter().map(bare));
        }
        result
    }
}

/// Starting points of the basins: labels including the rim, and the indices of the labelled voxels.
#[derive(Debug)]
pub(crate) struct Seeds {
    labels: Vec<u32>,
    voxels: Vec<u32>,
}

#[cfg(test)]
mod tests;
