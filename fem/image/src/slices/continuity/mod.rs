//! Detection of faulty sequences of slices: foreign slices, copies, changes of the grey scale, missing slices and slices
//! in reversed order.
//!
//! In the order of their layers: `samples` (grey values of all slices at some positions), `pairs` (comparison of
//! neighbouring slices), and one check per file: `foreign`, `copies`, `scale`, `gaps`.

mod copies;
mod foreign;
mod gaps;
mod pairs;
mod samples;
mod scale;
#[cfg(test)]
mod tests;

use crate::Volume;
use crate::slices::continuity::copies::{Copies, copied};
use crate::slices::continuity::foreign::{alternating, foreign};
use crate::slices::continuity::gaps::interrupted;
use crate::slices::continuity::pairs::compared;
use crate::slices::continuity::samples::Samples;
use crate::slices::continuity::scale::rescaled;

/// Smallest number of slices from which the usual difference of neighbouring slices is computed.
const LEAST_SLICES: usize = 8;

/// Returns warnings about unusual sequences of slices, one sentence each.
pub(crate) fn doubts(volume: &Volume<f32>) -> Vec<String> {
    if volume.shape[2] < LEAST_SLICES {
        return Vec::new();
    }
    let Some(samples) = Samples::of(volume) else { return Vec::new() };
    let pairs = compared(&samples);
    let copies = copied(volume, &samples);
    let mut warnings: Vec<String> = copies.iter().map(Copies::in_words).collect();
    if let Some(Copies::Each(_)) = copies {
        return warnings;
    }
    if let Some(warning) = alternating(&pairs) {
        warnings.push(warning);
        return warnings;
    }
    let strangers = foreign(&pairs);
    warnings.extend(strangers.in_words());
    warnings.extend(rescaled(&pairs, &strangers));
    warnings.extend(interrupted(&samples, &pairs, &strangers));
    warnings
}
