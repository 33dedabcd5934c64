//! Choice of the inverse mass matrix that fits a warmup window best.

use crate::sampler::draws::report::MapKind;
use crate::sampler::hamiltonian::metric::sample::Sample;
use crate::sampler::hamiltonian::metric::{Dense, Diagonal, LowRank, Metric};

/// Result of the comparison of inverse mass matrices in one warmup window.
pub(crate) struct Choice {
    /// The chosen matrix; `None` if the current matrix is better than every new matrix.
    pub(crate) metric: Option<Metric>,
    /// Fisher divergence per coordinate of each new matrix, estimated on draws that were not used for its fit. Empty
    /// if no matrices were compared.
    pub(crate) divergences: Vec<(MapKind, f64)>,
}

/// Largest number of coordinates for which the matrix with correlations is dense. For more coordinates, it is a
/// diagonal matrix with a low-rank correction.
const MOST_DENSE: usize = 50;
/// Fisher divergence per coordinate below which a diagonal matrix is exact up to rounding.
const EXACT: f64 = 1e-9;
/// Smallest number of draws for a comparison; in a shorter window, a diagonal matrix is fitted.
const SHORTEST_COMPARED: usize = 9;

/// Fits candidate matrices to the first two thirds of `sample`, compares their Fisher divergences on the last third,
/// and refits the best kind of matrix to the whole sample. If `is_new_sample` is true, `current` was not fitted to this
/// sample and is compared too.
pub(crate) fn choose(sample: &Sample, current: &Metric, is_new_sample: bool) -> Choice {
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
    let current_score = is_new_sample.then(|| current.divergence(&last));
    let score = |entry: &Option<(MapKind, f64)>| entry.map_or(f64::INFINITY, |(_, score)| score);
    let (plain, rival) = (score(&scores[0]), score(&scores[1]));

    let metric = if current_score.is_some_and(|score| score <= plain.min(rival)) {
        None
    } else {
        let diagonal = diagonal(&whole);
        let rival =
            if rival < plain && plain > EXACT { correlated(&whole, &diagonal) } else { None };
        Some(rival.unwrap_or(Metric::Diagonal(diagonal)))
    };
    Choice { metric, divergences: scores.into_iter().flatten().collect() }
}
