//! Detection of chains that stayed in a region of far lower density than the other chains, or that hardly moved.

use crate::diagnostics::{mean, mean_and_variance, quantile};
use crate::judgement::warnings::list::{WarningKind, Warnings};
use crate::quantity::format::{cell, list};
use crate::sampler::{Chain, Chains};

/// Difference of log weights of two regions above which the region of lower weight is negligible: its weight is below
/// e⁻²⁰ of the weight of the other region, so that no run would contain a draw from it.
const NO_WEIGHT: f64 = 20.0;
/// Additional difference of median log densities that is required, in units of the width of the 90 % interval of the
/// log density of the better chain.
const APART: f64 = 3.0;
/// Smallest fraction of transitions that change the position, for a chain that is not stuck.
const MOVES: f64 = 0.02;
/// Smallest number of draws from which a chain is judged.
const FEWEST: usize = 20;

/// Region that a chain samples, described by its log densities and widths.
struct Stay {
    chain: usize,
    transitions: usize,
    moves: usize,
    acceptance: f64,
    /// The 5 %, 50 % and 95 % quantiles of the log density.
    log_density: [f64; 3],
    /// Standard deviation of every coordinate.
    sds: Vec<f64>,
}

impl Stay {
    fn new(index: usize, chain: &Chain, dim: usize) -> Option<Self> {
        let stats = &chain.stats;
        let log_density: Vec<f64> = stats.iter().map(|s| s.log_density).collect();
        if stats.len() < FEWEST || dim == 0 || log_density.iter().any(|x| x.is_nan()) {
            return None;
        }
        let coordinate = |k: usize| chain.draws.iter().skip(k).step_by(dim).copied();
        let draws = || chain.draws.chunks_exact(dim);
        Some(Self {
            chain: index,
            transitions: stats.len() - 1,
            moves: draws().zip(draws().skip(1)).filter(|(a, b)| a != b).count(),
            acceptance: mean(stats.iter().map(|s| s.acceptance)),
            log_density: [0.05, 0.5, 0.95].map(|p| quantile(&log_density, p)),
            sds: (0..dim).map(|k| mean_and_variance(coordinate(k)).1.sqrt()).collect(),
        })
    }

    fn moves(&self) -> bool {
        self.moves as f64 >= MOVES * self.transitions as f64
    }

    /// Whether the draws of this chain have negligible weight compared with the draws of `other`. The widths of the
    /// regions are taken into account: a wide region has more weight than its density suggests, and a narrow region,
    /// such as the neck of a funnel, has less.
    fn is_far_below(&self, other: &Self) -> bool {
        let ([_, centre, best], [least, other_centre, most]) =
            (self.log_density, other.log_density);
        let ratios = self.sds.iter().zip(&other.sds).filter(|(_, other)| **other > 0.0);
        let wider: f64 = ratios.map(|(sd, other_sd)| (sd / other_sd).ln()).sum();
        best < least && other_centre - centre > NO_WEIGHT + wider.max(0.0) + APART * (most - least)
    }
}

/// Descriptions of the chains with far lower log density than the best chain, and of the chains that hardly moved.
struct Stuck {
    below: Vec<String>,
    still: Vec<String>,
}

impl Stuck {
    fn find(chains: &Chains) -> Self {
        let stays = chains.chains.iter().enumerate();
        let stays: Vec<Stay> =
            stays.filter_map(|(index, chain)| Stay::new(index, chain, chains.dim)).collect();
        let (moving, still): (Vec<_>, Vec<_>) = stays.iter().partition(|stay| stay.moves());
        let still = still.iter().map(|Stay { chain, moves, transitions, acceptance, .. }| {
            format!(
                "chain {chain} in {moves} of {transitions} transitions (mean acceptance \
                 {acceptance:.2})"
            )
        });
        let centre = |stay: &Stay| stay.log_density[1];
        let best = moving.iter().max_by(|a, b| centre(a).total_cmp(&centre(b)));
        let below = moving.iter().filter_map(|stay| {
            let best = best.filter(|best| stay.is_far_below(best))?;
            let ([stuck, best_value], Stay { chain, .. }) =
                ([stay, best].map(|s| cell(centre(s))), stay);
            Some(format!("chain {chain} near {stuck}, but chain {} near {best_value}", best.chain))
        });
        Self { below: below.collect(), still: still.collect() }
    }
}

/// Whether a chain is stuck. If so, results from all draws do not describe the posterior.
pub(crate) fn is_any(chains: &Chains) -> bool {
    let Stuck { below, still } = Stuck::find(chains);
    !(below.is_empty() && still.is_empty())
}

pub(super) fn find(chains: &Chains, warnings: &mut Warnings) {
    let Stuck { below, still } = Stuck::find(chains);
    warnings.add(
        WarningKind::StuckChain,
        "Chains have log densities far below those of other chains: ",
        &list(below),
        "The draws of these chains do not follow the posterior, and warnings that use all draws \
         are omitted: start near the mode (`Map`, then `init_points`), and make the scales of the \
         unknowns near 1, with standardised inputs and with priors that exclude impossible values",
    );
    warnings.add(
        WarningKind::StuckChain,
        "Chains hardly moved: ",
        &list(still),
        "Warnings that use all draws are omitted. The steps of the sampler do not suit the region \
         of such a chain, for example the neck of a funnel or the foot of a cliff: reparametrise \
         (non-centred), start near the mode (`Map`, then `init_points`), and make the scales of \
         the unknowns near 1",
    );
}
