//! Changes of the grey scale between two slices.
//!
//! At the ends of a specimen, and where another body begins, grey values also change, but the air beside the specimen
//! keeps its grey value. At a change of the grey scale, the darker and the brighter material change at once. In images
//! whose air has the grey value 0, a factor does not change air and is not reported.

use super::foreign::Foreign;
use super::pairs::{Pair, median, neighbours};
use crate::listing::listed;

/// Smallest change of the grey scale that is reported: relative change of the contrast, or change of the mean in
/// standard deviations of the grey values of a slice.
const CHANGE: f64 = 0.05;
/// Smallest change of the darker material that counts as a change, as a share of the contrast.
const DARK_CHANGE: f64 = 0.005;
/// Smallest change of the grey scale that is reported, as a multiple of the usual change between neighbouring slices.
const UNUSUAL: f64 = 4.0;
/// A change between two slices counts as a jump only if the changes at the neighbouring pairs of slices are below this
/// share of the change.
const ALONE: f64 = 0.4;
/// Smallest change of the darker material that counts as a change, as a share of the change of the brighter material.
/// Beside a wall, blur changes the darker material by about a hundredth of this change.
const DARK_SHARE: f64 = 0.04;
/// Smallest share of the mean squared difference of two slices that the linear regression explains.
const REGRESSION: f64 = 0.25;
/// Number of pairs of slices before and after a change that must show the same content.
const AROUND: usize = 2;
/// A change of the grey scale leaves a residual of the linear regression of at most this multiple of the residuals at
/// the neighbouring pairs of slices.
const EXPLAINED: f64 = 1.25;

/// Returns a warning about the slices after which the grey scale changes.
pub(super) fn rescaled(pairs: &[Pair], strangers: &Foreign) -> Option<String> {
    // use only slices with correlated content: slices of air do not show a change of the grey scale
    let alike: Vec<&Pair> = pairs.iter().filter(|pair| pair.is_alike()).collect();
    let usual_of = |value: &dyn Fn(&Pair) -> f64| median(alike.iter().map(|pair| value(pair)));
    let usual_gain = usual_of(&|pair| pair.gain)?;
    let usual_bright = usual_of(&|pair| pair.classes[1])?;
    let usual_residual = usual_of(&|pair| pair.residual)?;
    let is_rescaled = |k: &usize| {
        let pair = &pairs[*k];
        let around = neighbours(pairs, *k, AROUND);
        if !pair.is_alike() || !around.iter().all(|other| other.is_alike()) {
            return false;
        }
        // where grains or the specimen begin, the difference of two slices is not a change of the grey scale, and the
        // residual of the regression is large
        let beside = neighbours(pairs, *k, 1);
        let residual = beside.iter().map(|other| other.residual).fold(usual_residual, f64::max);
        let is_linear = pair.squares[0]
            .is_some_and(|square| pair.residual.powi(2) < (1.0 - REGRESSION) * square);
        let is_explained = is_linear && pair.residual <= EXPLAINED * residual * pair.gain.max(1.0);
        // a jump is a change without similar changes next to it; where a grain begins, several consecutive slices
        // change
        let jumps = |change_of: &dyn Fn(&Pair) -> f64, least: f64| {
            let change = change_of(pair);
            let is_alone = around.iter().all(|other| change_of(other) < ALONE * change);
            is_alone
                && change > least
                && usual_of(change_of).is_some_and(|usual| change > UNUSUAL * usual)
        };
        let least_dark = DARK_CHANGE.max(DARK_SHARE * pair.classes[1].abs());
        let dark_jumps = jumps(&|pair| pair.classes[0].abs(), least_dark);
        let bright_jumps = jumps(&|pair| (pair.classes[1] - usual_bright).abs(), CHANGE);
        let gain_jumps = jumps(&|pair| (pair.gain - usual_gain).abs(), CHANGE);
        is_explained && (bright_jumps || gain_jumps) && dark_jumps
    };
    let candidates = (0..pairs.len()).filter(|&k| !strangers.is_in_pair(k));
    let slices: Vec<usize> = candidates.filter(is_rescaled).collect();
    let jump = |k: &usize| {
        let Pair { gain, level, .. } = pairs[*k];
        format!(
            "after slice {} grey values are multiplied by {:.3} and the mean moves by {level:.4}",
            k + 1,
            gain / usual_gain
        )
    };
    let jumps: Vec<String> = slices.iter().map(jump).collect();
    (!jumps.is_empty()).then(|| {
        format!(
            "Thresholds are wrong on one side if the grey scale changes: {}.",
            listed(&jumps, "; ")
        )
    })
}
