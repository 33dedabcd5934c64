//! Tests that compare seeds and basins with their definitions.

use std::collections::{BTreeMap, BTreeSet};

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use crate::volume::filter::binomial;
use crate::volume::voxel_at;

fn near(shape: [usize; 3], at: usize) -> Vec<usize> {
    let voxel = voxel_at(shape, at);
    let step = |[i, j, k]: [isize; 3]| {
        let x = voxel[0].checked_add_signed(i).filter(|&x| x < shape[0])?;
        let y = voxel[1].checked_add_signed(j).filter(|&y| y < shape[1])?;
        let z = voxel[2].checked_add_signed(k).filter(|&z| z < shape[2])?;
        Some(x + shape[0] * (y + shape[1] * z))
    };
    neighbour_steps().filter_map(step).collect()
}

/// Returns random heights that are smoothed to form hills, and a random set of voxels that are land.
fn hills(shape: [usize; 3], most: u16, seed: u64) -> (Vec<u16>, Vec<u8>) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let count = shape.iter().product();
    let heights: Vec<u16> = (0..count).map(|_| rng.random_range(1..=most)).collect();
    let set = (0..count).map(|_| u8::from(rng.random_bool(0.8))).collect();
    (binomial(shape, &heights), set)
}

/// Returns the regional maxima of the reconstruction of (f − h) under f, by repeated dilation.
fn by_reconstruction(shape: [usize; 3], f: &[u16], h: u16) -> BTreeSet<BTreeSet<usize>> {
    let mut r: Vec<u16> = f.iter().map(|f| f.saturating_sub(h)).collect();
    loop {
        let raised: Vec<u16> = (0..f.len())
            .map(|at| {
                near(shape, at).iter().map(|&n| r[n]).chain([r[at]]).max().unwrap().min(f[at])
            })
            .collect();
        if raised == r {
            break;
        }
        r = raised;
    }
    let mut maxima = BTreeSet::new();
    for start in (0..f.len()).filter(|&at| r[at] > 0) {
        let mut flat = BTreeSet::from([start]);
        let mut stack = vec![start];
        let mut highest = true;
        while let Some(at) = stack.pop() {
            for n in near(shape, at) {
                highest &= r[n] <= r[at];
                if r[n] == r[at] && flat.insert(n) {
                    stack.push(n);
                }
            }
        }
        if highest {
            maxima.insert(flat);
        }
    }
    maxima
}

fn parts(labels: &[u32]) -> BTreeSet<BTreeSet<usize>> {
    let mut parts: BTreeMap<u32, BTreeSet<usize>> = BTreeMap::new();
    for (at, &label) in labels.iter().enumerate().filter(|&(_, &label)| label != 0) {
        parts.entry(label).or_default().insert(at);
    }
    parts.into_values().collect()
}

#[test]
fn h_maxima_agree_with_the_reconstruction() {
    for (shape, most, seed) in
        [([9, 8, 7], 40, 1), ([9, 8, 7], 400, 2), ([14, 5, 6], 12, 3), ([1, 20, 15], 200, 4)]
    {
        let (heights, set) = hills(shape, most, seed);
        let land: Vec<u16> = heights.iter().zip(&set).map(|(&f, &s)| f * u16::from(s)).collect();
        let landscape = Landscape::new(shape, &heights, &set);
        for h in [0, 1, most / 20, most / 5] {
            let seeds = landscape.h_maxima(h);
            let found = parts(&landscape.without_rim(&seeds.labels));
            assert_eq!(found, by_reconstruction(shape, &land, h), "{shape:?}, h = {h}");
        }
    }
}

/// Returns, for each voxel, the highest level at which the voxel is connected to the voxel `from` by land of at least
/// this level.
fn pass(shape: [usize; 3], f: &[u16], from: usize) -> Vec<u16> {
    let mut best = vec![0; f.len()];
    best[from] = f[from];
    let mut stack = BTreeSet::from([(f[from], from)]);
    while let Some((level, at)) = stack.pop_last() {
        for n in near(shape, at) {
            let through = level.min(f[n]);
            if through > best[n] {
                best[n] = through;
                stack.insert((through, n));
            }
        }
    }
    best
}

#[test]
fn every_voxel_belongs_to_a_seed_with_the_highest_pass() {
    let shape = [11, 9, 8];
    let (heights, set) = hills(shape, 300, 5);
    let land: Vec<u16> = heights.iter().zip(&set).map(|(&f, &s)| f * u16::from(s)).collect();
    let landscape = Landscape::new(shape, &heights, &set);
    let seeds = landscape.h_maxima(6);
    let starts = landscape.without_rim(&seeds.labels);
    let labels = landscape.flood(seeds, &vec![0; heights.len()]);
    let passes: BTreeMap<u32, Vec<u16>> = (0..starts.len())
        .filter(|&at| starts[at] != 0)
        .map(|at| (starts[at], pass(shape, &land, at)))
        .collect();
    for at in 0..labels.len() {
        if land[at] == 0 {
            assert_eq!(labels[at], 0);
            continue;
        }
        if starts[at] != 0 {
            assert_eq!(labels[at], starts[at]);
        }
        let highest = passes.values().map(|pass| pass[at]).max().unwrap();
        if highest == 0 {
            // only land in a separate part that is too low for a seed has no label
            assert_eq!(labels[at], 0);
            continue;
        }
        assert_eq!(passes[&labels[at]][at], highest, "voxel {at}");
    }
    // each basin must be connected
    for part in parts(&labels) {
        let mut seen = BTreeSet::from([*part.first().unwrap()]);
        let mut stack: Vec<usize> = seen.iter().copied().collect();
        while let Some(at) = stack.pop() {
            stack.extend(
                near(shape, at).into_iter().filter(|n| part.contains(n) && seen.insert(*n)),
            );
        }
        assert_eq!(seen, part);
    }
}

/// Flooding by its definition: each wave is found by a search through all voxels. Returns the labels.
fn slow_flood(shape: [usize; 3], land: &[u16], grey: &[u16], mut labels: Vec<u32>) -> Vec<u32> {
    let slope = |at: usize, to: usize| {
        let [a, b] = [at, to].map(|n| voxel_at(shape, n));
        let axes = (0..3).filter(|&k| a[k] != b[k]).count();
        let way = [10_000, 7_071, 5_774][axes - 1];
        ((i64::from(land[to]) - i64::from(land[at])) * way, axes == 1)
    };
    let decide = |labels: &[u32], at: usize| {
        let mut votes: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for to in near(shape, at).into_iter().filter(|&to| labels[to] != 0) {
            votes.entry(labels[to]).or_default().push(to);
        }
        let rank = |(label, voxels): (u32, Vec<usize>)| {
            let slopes: Vec<(i64, bool)> = voxels.iter().map(|&to| slope(at, to)).collect();
            let steepest = slopes.iter().map(|(slope, _)| *slope).max();
            let faces = slopes.iter().filter(|(_, face)| *face).count();
            let sum: i64 = slopes.iter().map(|(slope, _)| slope).sum();
            let brightness: u64 = voxels.iter().map(|&to| u64::from(grey[to])).sum();
            (steepest, faces, sum, brightness, std::cmp::Reverse(label))
        };
        votes.into_iter().map(rank).max().map(|(.., label)| label.0)
    };
    for level in (1..=land.iter().copied().max().unwrap()).rev() {
        loop {
            let wave: Vec<(usize, u32)> = (0..land.len())
                .filter(|&at| land[at] >= level && labels[at] == 0)
                .filter_map(|at| Some((at, decide(&labels, at)?)))
                .collect();
            if wave.is_empty() {
                break;
            }
            wave.iter().for_each(|&(at, label)| labels[at] = label);
        }
    }
    labels
}

/// Many voxels have equal heights and equal grey values, so that each criterion of the flood decides for some voxels.
/// In the largest landscape, a step of the flood has so many voxels that several threads process it.
#[test]
fn basins_are_those_of_a_slow_flood() {
    for (shape, most, greys, h, seed) in [
        ([11, 9, 8], 300, 1000, 6, 11),
        ([17, 14, 12], 12, 2, 0, 12),
        ([15, 15, 15], 40, 3, 0, 13),
        ([64, 60, 1], 12, 4, 0, 14),
        ([40, 40, 40], 12, 3, 0, 15),
    ] {
        let (heights, set) = hills(shape, most, seed);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let grey: Vec<u16> = heights.iter().map(|_| rng.random_range(0..greys)).collect();
        let land: Vec<u16> =
            heights.iter().zip(&set).map(|(&f, &s)| f.max(1) * u16::from(s)).collect();
        let landscape = Landscape::new(shape, &heights, &set);
        let seeds = landscape.h_maxima(h);
        let expected = slow_flood(shape, &land, &grey, landscape.without_rim(&seeds.labels));
        let labels = landscape.flood(seeds, &grey);
        assert!(labels == expected, "{shape:?}, {most} heights");
        assert!(parts(&labels).len() > 1, "{shape:?}: one basin");
    }
}

#[test]
fn a_rotated_landscape_has_the_same_basins() {
    let shape = [13, 11, 12];
    let (heights, set) = hills(shape, 60, 6);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let grey: Vec<u16> = heights.iter().map(|_| rng.random()).collect();
    let basins = |shape, heights: &[u16], set: &[u8], grey: &[u16]| {
        let landscape = Landscape::new(shape, heights, set);
        landscape.flood(landscape.h_maxima(3), grey)
    };
    let straight = parts(&basins(shape, &heights, &set, &grey));
    // (x, y, z) becomes (z, −x, y): a rotation combined with a reflection
    let turned_shape = [12, 13, 11];
    let from: Vec<usize> = (0..heights.len())
        .map(|at| voxel_at(turned_shape, at))
        .map(|[i, j, k]| (12 - j) + 13 * (k + 11 * i))
        .collect();
    let heights: Vec<u16> = from.iter().map(|&n| heights[n]).collect();
    let set: Vec<u8> = from.iter().map(|&n| set[n]).collect();
    let grey: Vec<u16> = from.iter().map(|&n| grey[n]).collect();
    let turned = parts(&basins(turned_shape, &heights, &set, &grey));
    let back: BTreeSet<BTreeSet<usize>> =
        turned.iter().map(|part| part.iter().map(|&n| from[n]).collect()).collect();
    assert_eq!(back, straight);
}

#[test]
fn spaced_seeds_keep_their_distance() {
    let shape = [30, 12, 9];
    let (heights, set) = hills(shape, 9, 8);
    let seeds = Landscape::new(shape, &heights, &set).spaced_maxima(4);
    assert_eq!(seeds.labels.iter().max(), Some(&(seeds.voxels.len() as u32)));
    assert!(seeds.voxels.len() > 5);
    let voxel = |at: u32| {
        let at = at as usize;
        [at % 32, at / 32 % 14, at / (32 * 14)]
    };
    for (n, &a) in seeds.voxels.iter().enumerate() {
        for &b in &seeds.voxels[..n] {
            let (a, b) = (voxel(a), voxel(b));
            assert!((0..3).any(|axis| a[axis].abs_diff(b[axis]) > 4), "{a:?} {b:?}");
        }
    }
}
