//! Tests of warnings about faulty sequences of slices, and of valid scans without warnings.

use super::doubts;
use crate::Volume;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Returns a noisy image of a cylinder with a ball, in air; the cylinder extends over slices 5 to 33 (from 0) of
/// 40.
fn scan(seed: u64) -> Volume<f32> {
    let (side, depth) = (48, 40);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut values = Vec::new();
    for n in 0..side * side * depth {
        let [x, y, z] = [n % side, n / side % side, n / (side * side)].map(|c| c as f64);
        let distance = (x - 23.5).hypot(y - 23.5);
        let inside = distance < 20.0 && (5.0..34.0).contains(&z);
        let ball = distance.hypot(z - 20.0) < 9.0;
        let grey = if ball {
            40_000.0
        } else if inside {
            20_000.0
        } else {
            2000.0
        };
        values.push((grey + rng.random_range(-2000.0..2000.0)) as f32);
    }
    Volume::new([side, side, depth], 0.02, values).unwrap()
}

fn slice(volume: &mut Volume<f32>, k: usize) -> &mut [f32] {
    let area = volume.shape[0] * volume.shape[1];
    &mut volume.values[k * area..(k + 1) * area]
}

/// Returns the image of `scan` without its ball and with many small balls.
fn grains(seed: u64) -> Volume<f32> {
    let mut volume = scan(seed);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed + 100);
    let [side, _, depth] = volume.shape;
    let voxel = |n: usize| [n % side, n / side % side, n / (side * side)].map(|c| c as f64);
    for n in 0..side * side * depth {
        let [x, y, z] = voxel(n);
        if (x - 23.5).hypot(y - 23.5).hypot(z - 20.0) < 9.0 {
            volume.values[n] -= 20_000.0;
        }
    }
    let mut grain = vec![false; volume.values.len()];
    for _ in 0..300 {
        let centre =
            [rng.random_range(6.0..41.0), rng.random_range(6.0..41.0), rng.random_range(7.0..32.0)];
        for (n, grain) in grain.iter_mut().enumerate() {
            let at = voxel(n);
            *grain |= (0..3).map(|k| (at[k] - centre[k]).powi(2)).sum::<f64>() < 6.25;
        }
    }
    for n in (0..grain.len()).filter(|&n| grain[n]) {
        let [x, y, _] = voxel(n);
        if (x - 23.5).hypot(y - 23.5) < 20.0 {
            volume.values[n] += 20_000.0;
        }
    }
    volume
}

#[test]
fn a_valid_scan_causes_no_warning() {
    for seed in 0..5 {
        assert_eq!(doubts(&scan(seed)), Vec::<String>::new(), "{seed}");
        assert_eq!(doubts(&grains(seed)), Vec::<String>::new(), "{seed}");
    }
    // in a scan without noise, most neighbouring slices are identical
    let flat = scan(0);
    let round = |value: &f32| (value / 10_000.0).round();
    let values = flat.values.iter().map(round).collect();
    assert_eq!(doubts(&Volume::new(flat.shape, 0.02, values).unwrap()), Vec::<String>::new());
}

#[test]
fn foreign_repeated_and_rescaled_slices_cause_warnings() {
    let mut blank = scan(1);
    slice(&mut blank, 16).fill(0.0);
    let mut other = scan(1);
    let stranger = slice(&mut scan(2), 2).to_vec();
    slice(&mut other, 24).copy_from_slice(&stranger);
    let mut copy = scan(1);
    let first = slice(&mut copy, 6).to_vec();
    slice(&mut copy, 7).copy_from_slice(&first);
    let mut brighter = scan(1);
    (20..40).for_each(|k| slice(&mut brighter, k).iter_mut().for_each(|value| *value *= 1.15));
    let mut shifted = scan(1);
    (13..40).for_each(|k| slice(&mut shifted, k).iter_mut().for_each(|value| *value += 3000.0));
    let area = shifted.shape[0] * shifted.shape[1];
    let stack = |volume: &Volume<f32>, order: &[usize]| {
        let values: Vec<f32> =
            order.iter().flat_map(|k| &volume.values[k * area..(k + 1) * area]).copied().collect();
        Volume::new([48, 48, order.len()], 0.02, values).unwrap()
    };
    let twice: Vec<usize> = (0..80).map(|k| k / 2).collect();
    let gap: Vec<usize> = (0..15).chain(22..40).collect();
    let reversed: Vec<usize> = (0..11).chain((11..18).rev()).chain(18..40).collect();
    let [twice, gap, reversed] = [twice, gap, reversed].map(|order| stack(&grains(1), &order));
    for (volume, parts) in [
        (twice, ["every slice is stored 2 times", "2 times too large"]),
        (gap, ["slices 15 and 16 differ", "missing or in the wrong order"]),
        (reversed, ["slices 12 to 18 are in reversed order", "in the wrong order"]),
        (blank, ["slice 17 differs", "both neighbours"]),
        (other, ["slice 25 differs", "both neighbours"]),
        (copy, ["slice 7 is identical", "next slice"]),
        (brighter, ["after slice 20 grey", "by 1.1"]),
        (shifted, ["after slice 13 grey", "moves by 3"]),
    ] {
        let warnings = doubts(&volume);
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(parts.iter().all(|part| warnings[0].contains(part)), "{warnings:?}");
    }
}
