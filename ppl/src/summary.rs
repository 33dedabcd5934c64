//! The table that a person reads.

use std::collections::BTreeMap;
use std::fmt;
use std::io;
use std::path::Path;

use rayon::prelude::*;
use serde::Serialize;

use crate::diagnostics::{Digest, Scores};
use crate::findings::{Finding, find};
use crate::posterior::Posterior;

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

/// Moments, quantiles and diagnostics of every parameter and tracked quantity, with what is wrong
/// in words.
///
/// `println!("{}", posterior.summary())` prints the table and the findings. A quantity that never
/// moves has NaN diagnostics, shown as `–`.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// One row a number, in the order of the model.
    pub rows: Vec<SummaryRow>,
    /// What is wrong and what to try; empty if nothing was found.
    pub findings: Vec<Finding>,
    /// Number of chains.
    pub chains: usize,
    /// Draws per chain.
    pub draws: usize,
}

impl SummaryRow {
    /// The smaller of the effective sample sizes.
    pub(crate) fn ess(&self) -> f64 {
        self.ess_bulk.min(self.ess_tail)
    }
}

impl Posterior {
    /// The table of moments, quantiles and diagnostics, with warnings in words.
    pub fn summary(&self) -> Summary {
        let identifiability = self.identifiability();
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
        let rows: Vec<SummaryRow> = numbers
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
            .collect();
        let findings = find(self, &rows, &identifiability);
        Summary { rows, findings, chains: self.posterior.chains, draws: self.posterior.draws }
    }
}

impl Summary {
    /// The row of this name, as `young` or `sd[0]`; where there are labels also `sd[north]`, if no
    /// row is called so by its index.
    pub fn row(&self, name: &str) -> Option<&SummaryRow> {
        let by_place = self.rows.iter().find(|row| row.place == name);
        by_place.or_else(|| self.rows.iter().find(|row| row.name == name))
    }

    /// Writes the rows as CSV with the header
    /// `parameter,mean,sd,q05,q50,q95,rhat,ess_bulk,ess_tail,contraction,mcse_mean`.
    ///
    /// # Errors
    /// An error of the file system, with the path in its words.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> io::Result<()> {
        let path = path.as_ref();
        let named = |error: csv::Error| {
            io::Error::other(format!("cannot write {}: {error}", path.display()))
        };
        let mut writer = csv::Writer::from_path(path).map_err(named)?;
        for row in &self.rows {
            writer.serialize(row).map_err(named)?;
        }
        writer.flush()
    }
}

/// Four or five significant digits, and `–` where there is nothing to show.
pub(crate) fn cell(x: f64) -> String {
    match x.abs() {
        size if size.is_nan() => "–".into(),
        0.0 => "0".into(),
        size if !(1e-3..1e5).contains(&size) => format!("{x:.3e}"),
        size => {
            let decimals = (3 - size.log10().floor() as i32).clamp(0, 6) as usize;
            format!("{x:.decimals$}")
        }
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = |x: f64| if x.is_nan() { "–".into() } else { format!("{x:.0}") };
        let ratio = |x: f64| if x.is_nan() { "–".into() } else { format!("{x:.3}") };
        let mut table: Vec<Vec<String>> = vec![
            ["", "mean", "sd", "q05", "q50", "q95", "mcse", "rhat", "ess_bulk", "ess_tail"]
                .map(str::to_owned)
                .to_vec(),
        ];
        table.extend(self.rows.iter().map(|r| {
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
        let width = |k: usize| table.iter().map(|row| row[k].chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..table[0].len()).map(width).collect();
        for row in &table {
            write!(f, "{:<1$}", row[0], widths[0])?;
            for (cell, width) in row.iter().zip(&widths).skip(1) {
                write!(f, "  {cell:>width$}")?;
            }
            writeln!(f)?;
        }
        writeln!(f, "{} chains of {} draws", self.chains, self.draws)?;
        if self.findings.is_empty() {
            writeln!(f, "Nothing wrong was found.")?;
        }
        for finding in &self.findings {
            writeln!(f, "! {finding}.")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::cell;

    #[test]
    fn cells_keep_four_digits() {
        assert_eq!(cell(275.1234), "275.1");
        assert_eq!(cell(0.0012345), "0.001234");
        assert_eq!(cell(-1.5e-7), "-1.500e-7");
        assert_eq!(cell(0.0), "0");
        assert_eq!(cell(f64::NAN), "–");
        assert_eq!(cell(12345.678), "12346");
    }
}
