//! Summary table of a posterior.

use std::fmt;

use crate::diagnostics::{mean_and_variance, quantile};
use crate::judgement::warnings::{Warning, warnings};
use crate::model::start::StartKind;
use crate::posterior::{Posterior, SummaryRow};
use crate::quantity::format::{cell, list};
use crate::quantity::record::Role;

/// Moments, quantiles and diagnostics of every parameter and tracked quantity, quantiles of the predictions, and
/// warnings.
///
/// `println!("{}", posterior.summary())` prints the table and the warnings. The diagnostics of a constant quantity are
/// NaN, printed as `–`.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// One row per number, in the order of the model. Constant numbers of a quantity whose other numbers vary are
    /// omitted, such as the zeros of a Cholesky factor.
    pub rows: Vec<SummaryRow>,
    /// One row per number of the `#[predict]` quantities, in the order of the model. Draws at which a prediction was
    /// rejected are omitted.
    pub predictions: Vec<PredictionRow>,
    /// Warnings with advice; empty if no problem was found.
    pub warnings: Vec<Warning>,
    /// Number of chains.
    pub chains: usize,
    /// Number of draws per chain.
    pub draws: usize,
    /// Indices of the chains that started at a draw from the prior, because every uniform starting point was rejected.
    pub prior_starts: Vec<usize>,
}

/// Quantiles of one predicted number.
#[derive(Clone, Debug, PartialEq)]
pub struct PredictionRow {
    /// Name with indices, or with labels if the dimension has labels.
    pub name: String,
    /// Mean of the predictive distribution.
    pub mean: f64,
    /// Standard deviation of the predictive distribution.
    pub sd: f64,
    /// 5 % quantile.
    pub q05: f64,
    /// Median.
    pub q50: f64,
    /// 95 % quantile.
    pub q95: f64,
}

impl Posterior {
    /// Rows of the `#[predict]` quantities.
    fn prediction_rows(&self) -> Vec<PredictionRow> {
        let mut rows = Vec::new();
        for variable in self.layout.with_role(Role::Predicted) {
            let Some(values) = self.predictive.get(&variable.name) else { continue };
            for (index, name) in self.layout.labelled(variable).into_iter().enumerate() {
                let mut draws = self.predictive.column(values, index);
                draws.retain(|x| !x.is_nan());
                let (mean, variance) = mean_and_variance(draws.iter().copied());
                let [q05, q50, q95] = [0.05, 0.5, 0.95].map(|p| quantile(&draws, p));
                rows.push(PredictionRow { name, mean, sd: variance.sqrt(), q05, q50, q95 });
            }
        }
        rows
    }

    /// Computes the table of moments, quantiles and diagnostics, with warnings.
    pub fn summary(&self) -> Summary {
        let identifiability = self.identifiability();
        let rows = self.rows(&identifiability);
        let warnings = warnings(self, &rows, &identifiability);
        let chains = self.chains.chains.iter().enumerate();
        let started = chains.filter(|(_, chain)| chain.warmup.start_kind == StartKind::PriorDraw);
        Summary {
            rows,
            predictions: self.prediction_rows(),
            warnings,
            chains: self.posterior.chains,
            draws: self.posterior.draws,
            prior_starts: started.map(|(number, _)| number).collect(),
        }
    }
}

impl Summary {
    /// Returns the row of the named number, such as `young` or `sd[0]`. A row can also be named by a label, as in
    /// `sd[north]`; if the text is also a valid index, the index has precedence.
    pub fn row(&self, name: &str) -> Option<&SummaryRow> {
        let by_place = self.rows.iter().find(|row| row.place == name);
        by_place.or_else(|| self.rows.iter().find(|row| row.name == name))
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.tables())?;
        if self.warnings.is_empty() {
            writeln!(f, "Nothing wrong was found.")?;
        }
        for warning in &self.warnings {
            writeln!(f, "! {warning}.")?;
        }
        Ok(())
    }
}

/// The tables of a summary, without its warnings; returned by [`Summary::tables`].
#[derive(Clone, Copy, Debug)]
pub struct SummaryTables<'a>(&'a Summary);

impl Summary {
    /// Returns the tables as text, without the warnings.
    pub fn tables(&self) -> SummaryTables<'_> {
        SummaryTables(self)
    }
}

impl fmt::Display for SummaryTables<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(summary) = self;
        let count = |x: f64| if x.is_nan() { "–".into() } else { format!("{x:.0}") };
        let ratio = |x: f64| if x.is_nan() { "–".into() } else { format!("{x:.3}") };
        let mut table: Vec<Vec<String>> = vec![
            ["", "mean", "sd", "q05", "q50", "q95", "mcse", "rhat", "ess_bulk", "ess_tail"]
                .map(str::to_owned)
                .to_vec(),
        ];
        table.extend(summary.rows.iter().map(|r| {
            let mut cells = vec![r.name.clone()];
            cells.extend([r.mean, r.sd, r.q05, r.q50, r.q95].map(cell));
            cells.push(if r.mcse_mean.is_nan() {
                "–".into()
            } else {
                format!("{:.1e}", r.mcse_mean)
            });
            cells.extend([ratio(r.rhat), count(r.ess_bulk), count(r.ess_tail)]);
            cells
        }));
        write_table(f, &table)?;
        if !summary.predictions.is_empty() {
            let head = ["predicted", "mean", "sd", "q05", "q50", "q95"].map(str::to_owned).to_vec();
            let rows = summary.predictions.iter().map(|r| {
                let statistics = [r.mean, r.sd, r.q05, r.q50, r.q95].map(cell);
                std::iter::once(r.name.clone()).chain(statistics).collect()
            });
            write_table(f, &std::iter::once(head).chain(rows).collect::<Vec<_>>())?;
        }
        writeln!(f, "{} chains of {} draws", summary.chains, summary.draws)?;
        if !summary.prior_starts.is_empty() {
            let chain_list = list(summary.prior_starts.iter().map(usize::to_string));
            writeln!(
                f,
                "Chains that started at a draw from the prior, because every uniform starting \
                 point was rejected: {chain_list}"
            )?;
        }
        Ok(())
    }
}

/// Writes a table: the first column is left-aligned, all other columns are right-aligned.
fn write_table(f: &mut fmt::Formatter<'_>, table: &[Vec<String>]) -> fmt::Result {
    let width = |k: usize| table.iter().map(|row| row[k].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..table[0].len()).map(width).collect();
    for row in table {
        write!(f, "{:<1$}", row[0], widths[0])?;
        for (cell, width) in row.iter().zip(&widths).skip(1) {
            write!(f, "  {cell:>width$}")?;
        }
        writeln!(f)?;
    }
    Ok(())
}
