//! Copies of slices: every slice stored several times, single copies, and groups of slices that are repeated later.

use std::collections::HashMap;

use rayon::prelude::*;

use super::pairs::median;
use super::samples::Samples;
use crate::Volume;
use crate::listing::listed;

/// Share of positions with different grey values in neighbouring slices above which an image has noise, so that equal
/// slices are copies. Without noise, slices without the beginning or the end of a grain are equal.
const NOISY: f64 = 0.3;
/// Smallest number of groups of equal slices from which the number of copies of each slice is computed.
const LEAST_GROUPS: usize = 4;

/// Slices that are identical to other slices.
pub(super) enum Copies {
    /// Every slice is stored this number of times.
    Each(usize),
    /// Relations of all slices to the slices before them.
    Some(Vec<Original>),
}

/// Finds identical slices in an image with noise; returns `None` for an image without noise or without copies.
pub(super) fn copied(volume: &Volume<f32>, samples: &Samples) -> Option<Copies> {
    let differing = samples.changed.iter().copied().filter(|&share| share > 0.0);
    if median(differing).is_none_or(|share| share < NOISY) {
        return None;
    }
    let originals = originals(volume);
    if let Some(copies) = copies_of_each(&originals) {
        return Some(Copies::Each(copies));
    }
    let is_copy = |original: &Original| matches!(original, Original::At(_));
    originals.iter().any(is_copy).then_some(Copies::Some(originals))
}

impl Copies {
    /// Returns a warning about the copies.
    pub(super) fn in_words(&self) -> String {
        match self {
            Copies::Each(copies) => format!(
                "Heights are {copies} times too large and grains are elongated if slices are copies: every slice is stored \
                 {copies} times; write each slice once."
            ),
            Copies::Some(originals) => format!(
                "Heights and grains are wrong if slices are copies: {}.",
                in_words(originals)
            ),
        }
    }
}

/// Lists the copies, with the numbers of the slices counted from 1.
fn in_words(originals: &[Original]) -> String {
    let mut next = Vec::new();
    let mut later: Vec<[usize; 3]> = Vec::new();
    for (k, original) in originals.iter().enumerate() {
        let Original::At(original) = *original else { continue };
        if original + 1 == k || originals[k - 1] == Original::At(original) {
            next.push(k.to_string());
        } else if let Some([from, last, first]) = later.last_mut()
            && *last + 1 == k
            && original == *first + (k - *from)
        {
            *last = k;
        } else {
            later.push([k, k, original]);
        }
    }
    let later: Vec<String> = later
        .iter()
        .map(|[from, to, original]| match from == to {
            true => format!("slice {} is identical to slice {}", from + 1, original + 1),
            false => format!(
                "slices {} to {} are identical to slices {} to {}",
                from + 1,
                to + 1,
                original + 1,
                original + 1 + to - from
            ),
        })
        .collect();
    let mut parts = Vec::new();
    if !next.is_empty() {
        parts.push(format!("slice {} is identical to the next slice", listed(&next, ", ")));
    }
    if !later.is_empty() {
        parts.push(listed(&later, ", "));
    }
    parts.join(", and ")
}

/// Relation of a slice to the slices before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Original {
    /// The slice has one grey value.
    Uniform,
    /// The slice differs from all earlier slices.
    New,
    /// The slice is identical to this earlier slice, counted from 0.
    At(usize),
}

/// Returns the relation of each slice to the slices before it.
fn originals(volume: &Volume<f32>) -> Vec<Original> {
    let area = volume.shape[0] * volume.shape[1];
    let slice = |k: usize| &volume.values[k * area..(k + 1) * area];
    let hash = |slice: &[f32]| {
        let is_uniform = slice.iter().all(|value| *value == slice[0]);
        let mix = |hash: u64, value: &f32| {
            (hash ^ u64::from(value.to_bits())).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29)
        };
        (!is_uniform).then(|| slice.iter().fold(0, mix))
    };
    let hashes: Vec<Option<u64>> = volume.values.par_chunks_exact(area).map(hash).collect();
    let mut first: HashMap<u64, usize> = HashMap::new();
    let relation = |(k, hash): (usize, &Option<u64>)| {
        let Some(hash) = *hash else { return Original::Uniform };
        let original = *first.entry(hash).or_insert(k);
        match original < k && slice(original) == slice(k) {
            true => Original::At(original),
            false => Original::New,
        }
    };
    hashes.iter().enumerate().map(relation).collect()
}

/// Returns how often each slice is stored if all slices are stored equally often and more than once.
fn copies_of_each(originals: &[Original]) -> Option<usize> {
    // sizes of the groups of identical neighbouring slices; slices with a single grey value are not counted
    let mut groups: Vec<usize> = Vec::new();
    for (k, original) in originals.iter().enumerate() {
        match (original, groups.last_mut()) {
            (Original::Uniform, _) => {}
            (Original::At(original), Some(size)) if original + *size == k => *size += 1,
            _ => groups.push(1),
        }
    }
    if groups.len() < LEAST_GROUPS {
        return None;
    }
    // the first and the last group may be incomplete
    let whole = &groups[1..groups.len() - 1];
    (whole[0] > 1 && whole.iter().all(|&size| size == whole[0])).then_some(whole[0])
}
