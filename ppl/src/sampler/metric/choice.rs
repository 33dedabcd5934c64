//! Which map fits a window best.

use super::{Dense, Diagonal, LowRank, Metric, sample::Sample};
use crate::sampler::report::MapKind;

/// The map for a window of the warmup, and how those compared fared.
pub(in crate::sampler) struct Choice {
    /// `None`: the map so far is better than every new one.
    pub(in crate::sampler) metric: Option<Metric>,
    /// Fisher divergence per coordinate on draws not fitted to; empty without a comparison.
    pub(in crate::sampler) divergences: Vec<(MapKind, f64)>,
}

/// Up to this dimension the map with correlations is dense, above it of low rank.
const MOST_DENSE: usize = 50;
/// A diagonal map this good per coordinate is exact but for rounding.
const EXACT: f64 = 1e-9;
/// Windows shorter than this have a diagonal map: too few draws to judge by.
const SHORTEST_COMPARED: usize = 9;

/// Fits maps to the first two thirds of `sample`, judges them by the Fisher divergence on the last
/// third, and fits the best kind to the whole. If `sample` is new to `current`, as `unseen` says,
/// that one competes too.
pub(in crate::sampler) fn choose(sample: &Sample, current: &Metric, unseen: bool) -> Choice {
    let diagonal = |stretch: &super::Centred| {
        Diagonal::renewed(current.variances(), |i| stretch.fisher_variance(i))
    };
    let correlated = |stretch: &super::Centred, diagonal: &Diagonal| {
        if stretch.dim() <= MOST_DENSE {
            Dense::fitted(stretch, diagonal).map(Metric::Dense)
        } else {
            LowRank::fitted(stretch, diagonal).map(Metric::LowRank)
        }
    };
    let whole = sample.all();
    let n = sample.len();
    if n < SHORTEST_COMPARED || whole.dim() < 2 {
        let metric = Some(Metric::Diagonal(diagonal(&whole)));
        return Choice { metric, divergences: Vec::new() };
    }

    let split = n - n / 3;
    let (first, last) = (sample.centred(0..split), sample.centred(split..n));
    let plain = diagonal(&first);
    let rival = correlated(&first, &plain);
    let tried = [Some(Metric::Diagonal(plain)), rival];
    let scores = tried.map(|m| m.map(|m| (m.kind(), m.divergence(&last))));
    let own = unseen.then(|| current.divergence(&last));
    let score = |entry: &Option<(MapKind, f64)>| entry.map_or(f64::INFINITY, |(_, score)| score);
    let (plain, rival) = (score(&scores[0]), score(&scores[1]));

    let metric = if own.is_some_and(|own| own <= plain.min(rival)) {
        None
    } else {
        let diagonal = diagonal(&whole);
        let rival =
            if rival < plain && plain > EXACT { correlated(&whole, &diagonal) } else { None };
        Some(rival.unwrap_or(Metric::Diagonal(diagonal)))
    };
    Choice { metric, divergences: scores.into_iter().flatten().collect() }
}
