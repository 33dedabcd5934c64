//! Rows of a summary: moments, quantiles and diagnostics of each number.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::Serialize;

use super::Posterior;
use crate::diagnostics::{
    Identifiability, ess_bulk, ess_tail, mcse_mean, mean_and_variance, quantile, rhat,
};
use crate::quantity::draws::{Group, Values};

/// Summary of one number of the posterior, in the unit of the quantity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SummaryRow {
    /// Name with indices, such as `sd[0]`, or with labels if the dimension has labels, such as `sd[north]`.
    #[serde(skip)]
    pub name: String,
    /// Name with indices, such as `sd[0]`, even if the dimension has labels. Exported files contain this name.
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
    /// Contraction 1 − var(posterior)/var(prior); `None` for quantities that are not parameters.
    pub contraction: Option<f64>,
    /// Monte Carlo standard error of the mean.
    pub mcse_mean: f64,
}

impl SummaryRow {
    /// Smaller of bulk and tail effective sample size.
    pub(crate) fn ess(&self) -> f64 {
        self.ess_bulk.min(self.ess_tail)
    }
}

impl Posterior {
    /// Computes one row per number, in the order of the model. Numbers that are constant by construction, such as the
    /// zeros of a Cholesky factor, are omitted.
    pub(crate) fn rows(&self, identifiability: &[Identifiability]) -> Vec<SummaryRow> {
        let contraction: BTreeMap<&str, f64> =
            identifiability.iter().map(|i| (i.name.as_str(), i.contraction())).collect();
        let group = &self.posterior;
        let elements = group.variables.iter().flat_map(|values| {
            let variable = self.layout.variables.iter().find(|v| v.name == values.name);
            let places = values.elements();
            let names = variable.map_or_else(|| places.clone(), |v| self.layout.labelled(v));
            let moving = self.moving(values);
            let named = places.into_iter().zip(names).enumerate();
            let named = named.filter(move |(index, _)| moving[*index]);
            named.map(move |(index, (element, name))| (values, index, element, name))
        });
        let elements: Vec<_> = elements.collect();
        elements
            .into_par_iter()
            .map(|(values, index, element, name)| {
                let draws = group.column(values, index);
                let chains: Vec<&[f64]> = draws.chunks(group.draws.max(1)).collect();
                let (mean, variance) = mean_and_variance(draws.iter().copied());
                let [q05, q50, q95] = [0.05, 0.5, 0.95].map(|p| quantile(&draws, p));
                SummaryRow {
                    mean,
                    sd: variance.sqrt(),
                    q05,
                    q50,
                    q95,
                    rhat: rhat(&chains),
                    ess_bulk: ess_bulk(&chains),
                    ess_tail: ess_tail(&chains),
                    contraction: contraction.get(element.as_str()).copied(),
                    mcse_mean: mcse_mean(&chains),
                    name,
                    place: element,
                }
            })
            .collect()
    }

    /// Returns, for each number of a quantity, whether the number varies between the draws of the posterior or of the
    /// prior. If no number varies, as for a quantity that the model sets to a constant, all values are true.
    fn moving(&self, values: &Values) -> Vec<bool> {
        let prior = self.prior.as_ref().and_then(|prior| Some((prior, prior.get(&values.name)?)));
        let moving = (0..values.size()).map(|index| {
            let differ = |group: &Group, values: &Values| {
                let column = group.column(values, index);
                column.iter().any(|x| *x != column[0])
            };
            // without prior draws, a constant posterior does not imply that the model fixes the number
            differ(&self.posterior, values)
                || prior.is_none_or(|(group, values)| differ(group, values))
        });
        let moving: Vec<bool> = moving.collect();
        if moving.contains(&true) { moving } else { vec![true; moving.len()] }
    }
}
