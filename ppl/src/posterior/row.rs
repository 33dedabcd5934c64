//! The rows of a summary: moments, quantiles and diagnostics of each number.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::Serialize;

use super::Posterior;
use crate::diagnostics::{Digest, Identifiability, Scores};

/// One number of the posterior, in the unit of the quantity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SummaryRow {
    /// Name with indices, as `sd[0]`, or with labels where the dimensions have them, as `sd[north]`.
    #[serde(skip)]
    pub name: String,
    /// Name with indices, whatever the labels: what files have, for programs to rely on.
    #[serde(rename = "parameter")]
    pub place: String,
    /// Posterior mean.
    pub mean: f64,
    /// Posterior standard deviation.
    pub sd: f64,
    /// 5 % quantile.
    pub q05: f64,
    /// Median.
    pub q50: f64,
    /// 95 % quantile.
    pub q95: f64,
    /// Rank-normalised split R̂.
    pub rhat: f64,
    /// Bulk effective sample size.
    pub ess_bulk: f64,
    /// Tail effective sample size.
    pub ess_tail: f64,
    /// 1 − var(posterior)/var(prior), for parameters.
    pub contraction: Option<f64>,
    /// Monte Carlo standard error of the mean.
    pub mcse_mean: f64,
}

impl SummaryRow {
    /// The smaller of the effective sample sizes.
    pub(crate) fn ess(&self) -> f64 {
        self.ess_bulk.min(self.ess_tail)
    }
}

impl Posterior {
    /// One row a number, in the order of the model.
    pub(crate) fn rows(&self, identifiability: &[Identifiability]) -> Vec<SummaryRow> {
        let contraction: BTreeMap<&str, f64> =
            identifiability.iter().map(|i| (i.name.as_str(), i.contraction())).collect();
        let group = &self.posterior;
        // half the draws of a chain, twice as many halves as chains
        let scores = Scores::new(2 * (group.draws / 2) * group.chains);
        let numbers = group.variables.iter().flat_map(|values| {
            let variable = self.layout.variables.iter().find(|v| v.name == values.name);
            let places = values.elements();
            let names = variable.map_or_else(|| places.clone(), |v| self.layout.labelled(v));
            let named = places.into_iter().zip(names).enumerate();
            named.map(move |(index, (place, name))| (values, index, place, name))
        });
        let numbers: Vec<_> = numbers.collect();
        numbers
            .into_par_iter()
            .map(|(values, index, place, name)| {
                let draws = group.column(values, index);
                let chains: Vec<&[f64]> = draws.chunks(group.draws.max(1)).collect();
                let digest = Digest::new(&chains, &scores);
                let [q05, q50, q95] = digest.quantiles;
                SummaryRow {
                    mean: digest.mean,
                    sd: digest.sd,
                    q05,
                    q50,
                    q95,
                    rhat: digest.rhat,
                    ess_bulk: digest.ess_bulk,
                    ess_tail: digest.ess_tail,
                    contraction: contraction.get(place.as_str()).copied(),
                    mcse_mean: digest.mcse_mean,
                    name,
                    place,
                }
            })
            .collect()
    }
}
