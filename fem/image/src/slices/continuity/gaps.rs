//! Missing slices, and slices in reversed order.
//!
//! Slices differ the more, the larger their distance. Where slices are missing, two neighbouring slices differ as much as
//! slices that are two or more slices apart elsewhere. Where another body or many grains begin, two slices also differ,
//! but there most grey values change in the same direction. Where slices are missing, grains begin and end.

use super::foreign::Foreign;
use super::pairs::{LAGS, Pair, median, neighbours};
use super::samples::Samples;
use crate::listing::listed;

/// Slices may be missing between two slices if their mean squared difference exceeds this multiple of four other mean
/// squared differences: the usual and the second largest difference of neighbouring slices nearby, and the differences
/// of the previous and of the next pair of slices.
const MISSING: f64 = 1.4;
/// Smallest excess of a mean squared difference over its usual value, as a multiple of the usual deviation of the
/// differences nearby from this value. With few grains, the differences of neighbouring slices fluctuate.
const UNUSUAL: f64 = 5.0;
/// Smallest ratio of the mean squared difference at a gap to the usual mean squared difference of slices that are two
/// slices apart. With few grains, neighbouring slices may differ as much as slices that are two slices apart.
const FARTHER: f64 = 1.1;
/// Smallest ratio of two usual mean squared differences: of slices that are two slices apart, to neighbouring slices.
/// Below this ratio, noise hides the grains.
const VISIBLE: f64 = 1.2;
/// Largest share of a difference that has the same sign.
const ONE_SIGN: f64 = 0.6;
/// Largest change of the mean grey value at a gap, in standard deviations of the grey values of a slice. A larger
/// change shows that another body begins.
const SAME_BODY: f64 = 0.1;
/// Number of pairs of slices before and after a gap from which the usual differences are computed.
const NEARBY: usize = 6;
/// Number of pairs of slices before and after a gap that must show the same content.
const AROUND: usize = 2;
/// Largest ratio of the mean squared differences with and without a reversal of the slices between two gaps. Below this
/// ratio, the slices are in reversed order.
const FITS: f64 = 0.7;

/// A place at which slices are missing or in the wrong order.
#[derive(Clone, Copy, Debug)]
struct Gap {
    /// The last slice before the gap, counted from 0.
    slice: usize,
    /// Number of slices by which two slices are apart that differ as much elsewhere in the image; `None` if it exceeds
    /// [`LAGS`].
    distance: Option<usize>,
}

/// Returns a warning about places at which slices may be missing or in the wrong order.
pub(super) fn interrupted(
    samples: &Samples,
    pairs: &[Pair],
    strangers: &Foreign,
) -> Option<String> {
    // the usual differences beside a foreign slice are unknown
    let is_strange = |k: usize| [k - 1, k, k + 1].iter().any(|&k| strangers.is_in_pair(k));
    let gaps: Vec<Gap> = (1..pairs.len().saturating_sub(1))
        .filter(|&k| !is_strange(k))
        .filter_map(|k| gap(pairs, k))
        .collect();
    let mut texts = Vec::new();
    let mut at = 0;
    while let Some(gap) = gaps.get(at) {
        let i = gap.slice;
        // the difference at the other end of a reversed block may be too small to count as a gap
        let fits = |j: usize| {
            let jumps = pairs[i].squares[0].zip(pairs[j].squares[0]);
            let limit = FITS * jumps.map_or(0.0, |(a, b)| a.min(b));
            samples.mean_square(i, j) < limit && samples.mean_square(i + 1, j + 1) < limit
        };
        let later = gaps[at + 1..].iter().position(|other| fits(other.slice));
        let other_end = later.map(|n| gaps[at + 1 + n].slice);
        match other_end.or_else(|| (0..pairs.len()).find(|&j| j != i && fits(j))) {
            Some(j) => {
                texts.push(format!(
                    "slices {} to {} are in reversed order",
                    i.min(j) + 2,
                    i.max(j) + 1
                ));
                at += later.map_or(1, |n| n + 2);
            }
            None => {
                let distance = match gap.distance {
                    Some(distance) => format!("{distance}"),
                    None => format!("more than {LAGS}"),
                };
                texts.push(format!(
                    "slices {} and {} differ as slices elsewhere that are {distance} slices apart",
                    i + 1,
                    i + 2
                ));
                at += 1;
            }
        }
    }
    (!texts.is_empty()).then(|| {
        format!(
            "Grains and heights are wrong if slices are missing or in the wrong order: {}.",
            listed(&texts, "; ")
        )
    })
}

/// Returns the gap between slices `k` and `k` + 1, if there is one.
fn gap(pairs: &[Pair], k: usize) -> Option<Gap> {
    let pair = &pairs[k];
    let square = pair.squares[0]?;
    if pair.level.abs() > SAME_BODY * pair.deviation
        || !neighbours(pairs, k, AROUND).iter().all(|other| other.is_alike())
    {
        return None;
    }
    let near = |lag: usize| {
        // pairs of slices on one side of the gap
        let from = k.saturating_sub(NEARBY);
        let before = from..(k + 1).saturating_sub(lag + 1).max(from);
        let after = k + 1..(k + 1 + NEARBY).min(pairs.len());
        let near = before.chain(after).filter(|&other| pairs[other].is_alike());
        near.filter_map(move |other| pairs[other].squares[lag])
    };
    let usual = |lag: usize| median(near(lag));
    let [one, two] = [usual(0)?, usual(1)?];
    let deviation = median(near(0).map(|other| (other - one).abs()))?;
    let largest =
        neighbours(pairs, k, 1).iter().filter_map(|other| other.squares[0]).fold(one, f64::max);
    // the second largest difference nearby: the largest may belong to another gap
    let mut differences: Vec<f64> = near(0).collect();
    differences.sort_by(f64::total_cmp);
    let second = differences[differences.len().saturating_sub(2)];
    let is_gap = square > MISSING * largest.max(second)
        && square - one > UNUSUAL * deviation
        && two > VISIBLE * one
        && square > FARTHER * two
        && pair.signed.abs() < ONE_SIGN * (square - one);
    let distance =
        (3..=LAGS).find(|lag| usual(lag - 1).is_some_and(|other| square < FARTHER * other));
    is_gap.then_some(Gap { slice: k, distance })
}
