//! Figures of the Markov chains: traces and ranks.

use kuva::prelude::*;

use super::draw::{line, round_range};
use crate::report::results::CalibratedParameter;
use crate::report::style::{PRIOR, SERIES, framed, panel, single};

/// Number of bins of the rank histograms.
const BINS: usize = 20;

/// Draws in the order of sampling, one colour per chain; one panel per parameter.
pub(in crate::report) fn traces(parameters: &[CalibratedParameter]) -> Vec<String> {
    let one = |p: &CalibratedParameter| {
        let plots = p.chains.iter().zip(SERIES.iter().cycle()).map(|(chain, color)| -> Plot {
            let every = (chain.len() / 500).max(1);
            let draws = chain.iter().enumerate().step_by(every);
            line(draws.map(|(i, &v)| (i as f64, v)), color, 0.7).into()
        });
        let plots: Vec<Plot> = plots.collect();
        let length = p.chains.iter().map(Vec::len).max().unwrap_or(1);
        let range = round_range(p.draws());
        let layout = framed(panel(&plots, "draw", &p.label), (0.0, length as f64), range);
        single(plots, layout.with_ticks(3), 470.0, 150.0)
    };
    parameters.iter().map(one).collect()
}

/// Histograms of the ranks of each chain's draws among all draws, relative to a uniform distribution; one panel per
/// parameter.
///
/// # Reference
/// Vehtari et al. (2021), section 5, doi:10.1214/20-BA1221.
pub(in crate::report) fn ranks(parameters: &[CalibratedParameter]) -> Vec<String> {
    let one = |p: &CalibratedParameter| {
        let spread = rank_histograms(&p.chains, BINS);
        let most = spread.iter().flatten().copied().fold(1.5, f64::max);
        let mut plots: Vec<Plot> =
            vec![line([(0.0, 1.0), (1.0, 1.0)], PRIOR, 1.4).with_dashed().into()];
        for (heights, colour) in spread.iter().zip(SERIES.iter().cycle()) {
            let steps = heights.iter().enumerate().flat_map(|(i, &height)| {
                [i, i + 1].map(|edge| (edge as f64 / BINS as f64, height))
            });
            plots.push(line(steps, colour, 1.3).into());
        }
        let label = format!("rank of {}", p.label);
        let layout = framed(panel(&plots, &label, "of even"), (0.0, 1.0), (0.0, 1.05 * most));
        single(plots, layout.with_ticks(4), 330.0, 230.0)
    };
    parameters.iter().map(one).collect()
}

/// Fraction of each chain's draws in every bin of their ranks over all chains, times the number of bins: 1 if chains
/// have the same distribution. Equal draws, as after rejected steps, share their mean rank.
fn rank_histograms(chains: &[Vec<f64>], bins: usize) -> Vec<Vec<f64>> {
    let mut all: Vec<(f64, usize)> = Vec::new();
    for (chain, draws) in chains.iter().enumerate() {
        all.extend(draws.iter().map(|&draw| (draw, chain)));
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total = all.len() as f64;
    let mut spread = vec![vec![0.0; bins]; chains.len()];
    let mut before = 0.0;
    for equal in all.chunk_by(|a, b| a.0 == b.0) {
        let count = equal.len() as f64;
        let rank = (before + 0.5 * count) / total;
        let bin = ((rank * bins as f64) as usize).min(bins - 1);
        for &(_, chain) in equal {
            spread[chain][bin] += 1.0;
        }
        before += count;
    }
    for (spread, draws) in spread.iter_mut().zip(chains) {
        let even = draws.len() as f64 / bins as f64;
        spread.iter_mut().for_each(|count| *count /= even);
    }
    spread
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chains_that_are_alike_have_even_ranks_and_one_that_lags_has_not() {
        // first two chains with interleaved values, then two chains: all values of one chain are smaller than the values
        // of the other chain
        let even: Vec<f64> = (0..40).map(|i| f64::from(2 * i)).collect();
        let odd: Vec<f64> = even.iter().map(|x| x + 1.0).collect();
        assert_eq!(rank_histograms(&[even.clone(), odd], 4), [[1.0; 4]; 2]);
        let above: Vec<f64> = even.iter().map(|x| x + 100.0).collect();
        let spread = rank_histograms(&[even, above], 4);
        assert_eq!(spread, [[2.0, 2.0, 0.0, 0.0], [0.0, 0.0, 2.0, 2.0]]);
    }

    #[test]
    fn equal_draws_share_their_mean_rank() {
        assert_eq!(rank_histograms(&[vec![5.0; 8]], 3), [[0.0, 3.0, 0.0]]);
    }

    #[test]
    fn each_parameter_has_its_panels() {
        let chains = vec![vec![1.0, 3.0, 2.0], vec![2.5, 1.5, 0.5]];
        let p = CalibratedParameter { label: "E (MPa)".into(), chains, ..Default::default() };
        let p = std::slice::from_ref(&p);
        for figure in [traces(p), ranks(p)] {
            assert!(figure.len() == 1 && figure[0].contains("E (MPa)"));
        }
    }
}
