//! The regression problem of a dataset: values of the basis polynomials, and outputs on their linear or logarithmic
//! scales.

use faer::Mat;

use crate::dataset::{Dataset, check_count};
use crate::dyn_pce::axes;
use crate::error::SurrogateError;
use crate::fit::regression::NestedLeastSquares;
use crate::legendre::{basis_row, basis_slopes};
use crate::multi_index::Truncation;
use crate::scale::{Axis, Scale};

/// Data and candidate terms of a fit, before scales and order are chosen.
pub(crate) struct Regression<'a> {
    pub(crate) data: &'a Dataset,
    /// Outputs in their units, runs × outputs.
    pub(crate) y: Mat<f64>,
    /// Variance of each output over the runs.
    pub(crate) variance: Vec<f64>,
    /// Number of terms of order 0, 1, …
    pub(crate) counts: Vec<usize>,
    /// Multi-indices of the terms of the highest order that has at most `most` terms. The terms of each lower order
    /// are a prefix of this list.
    pub(crate) columns: Vec<Vec<u8>>,
    /// Largest number of terms of an order that can be fitted: the number of least squares rows of all runs except
    /// one.
    pub(crate) most: usize,
    pub(crate) truncation: Truncation,
}

/// Rows of a least squares problem. The first rows are the values, one row per run. With derivatives, the
/// rows of the derivatives with respect to the inputs' coordinates t ∈ [−1, 1] follow, run after run.
pub(crate) struct Equations {
    /// Values and derivatives of the basis, rows × terms.
    pub(crate) rows: Vec<Vec<f64>>,
    /// Right-hand sides of the least squares problem (outputs on a scale, and their derivatives), rows × targets.
    pub(crate) targets: Mat<f64>,
    /// Number of derivatives of each target per run.
    slopes: usize,
}

impl<'a> Regression<'a> {
    /// Collects the data and the candidate terms up to `max_order`.
    ///
    /// # Errors
    /// If there are fewer than two rows, or an output has the same value in all rows.
    pub(crate) fn new(
        data: &'a Dataset,
        truncation: Truncation,
        max_order: usize,
    ) -> Result<Self, SurrogateError> {
        let (n, d) = (data.len(), data.inputs().len());
        if n < 2 {
            return Err(SurrogateError::Count { what: "or more rows", expected: 2, found: n });
        }
        let y = Mat::from_fn(n, data.outputs().len(), |i, m| data.row(i).1[m]);
        let mut variance = Vec::new();
        for (name, y) in data.outputs().iter().zip(y.col_iter()) {
            if y.iter().all(|value| *value == y[0]) {
                return Err(SurrogateError::ConstantOutput { output: name.clone(), value: y[0] });
            }
            let mean = y.iter().sum::<f64>() / n as f64;
            variance.push(y.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / n as f64);
        }
        let counts: Vec<usize> = (0..=max_order).map(|p| truncation.count(d, p)).collect();
        let most = (n - 1) * (1 + data.inputs_with_derivatives());
        let estimable = counts.iter().take_while(|&&terms| terms <= most).count();
        let columns = truncation.nested(d, estimable - 1);
        Ok(Self { data, y, variance, counts, columns, most, truncation })
    }

    /// Returns the regression problem with all terms of one order in the given truncation, even if the runs do not
    /// determine all coefficients. None if there are more than `limit` terms.
    pub(crate) fn with_order(
        &self,
        truncation: Truncation,
        order: usize,
        limit: usize,
    ) -> Option<Self> {
        let d = self.data.inputs().len();
        (truncation.count(d, order) <= limit).then(|| Self {
            data: self.data,
            y: self.y.clone(),
            variance: self.variance.clone(),
            counts: Vec::new(),
            columns: truncation.nested(d, order),
            most: self.most,
            truncation,
        })
    }

    /// Returns the rows of the least squares problem, with inputs and outputs on the given scales.
    ///
    /// # Errors
    /// The errors of [`axes`], and an error if the number of scales is wrong or an output on a logarithmic scale is
    /// not above 0 in some row.
    pub(crate) fn equations(
        &self,
        inputs: &[Scale],
        outputs: &[Scale],
    ) -> Result<Equations, SurrogateError> {
        check_count("scales of outputs", self.y.ncols(), outputs.len())?;
        for (m, name) in self.data.outputs().iter().enumerate() {
            let least = self.least(m);
            if outputs[m] == Scale::Log && least <= 0.0 {
                return Err(SurrogateError::Logarithm { name: name.clone(), value: least });
            }
        }
        let targets: Vec<(usize, Scale)> = outputs.iter().copied().enumerate().collect();
        self.equations_for(inputs, &targets)
    }

    /// Returns the rows of the least squares problem for any list of targets. Each target is the index of an output
    /// and its scale.
    ///
    /// # Errors
    /// The errors of [`axes`].
    pub(crate) fn equations_for(
        &self,
        inputs: &[Scale],
        targets: &[(usize, Scale)],
    ) -> Result<Equations, SurrogateError> {
        let (n, axes) = (self.data.len(), axes(self.data.inputs(), inputs)?);
        let slopes = self.data.inputs_with_derivatives();
        let unit: Vec<Vec<f64>> = self
            .data
            .rows()
            .map(|(x, _)| axes.iter().zip(x).map(|(axis, &x)| axis.to_unit(x)).collect())
            .collect();
        let mut rows: Vec<Vec<f64>> = unit.iter().map(|t| basis_row(&self.columns, t)).collect();
        if slopes > 0 {
            rows.extend(
                unit.iter().flat_map(|t| basis_slopes(&self.columns, t).into_iter().take(slopes)),
            );
        }
        let targets = Mat::from_fn(rows.len(), targets.len(), |row, k| {
            let (m, scale) = targets[k];
            match row.checked_sub(n) {
                None => scale.coordinate(self.y[(row, m)]),
                Some(row) => self.slope(&axes, scale, row / slopes, m, row % slopes),
            }
        });
        Ok(Equations { rows, targets, slopes })
    }

    /// Returns the derivative dz/dt = (∂y/∂x) / (dy/dz · dt/dx), where z is the output y on its scale and t ∈ [−1, 1]
    /// is the coordinate of the input x.
    fn slope(&self, axes: &[Axis], scale: Scale, run: usize, output: usize, input: usize) -> f64 {
        let slopes = self.data.derivatives(run).unwrap_or_default();
        let x = self.data.row(run).0[input];
        let by = scale.slope_at(self.y[(run, output)]) * axes[input].slope_at(x);
        slopes[output * self.data.inputs_with_derivatives() + input] / by
    }

    /// The smallest value of an output.
    pub(crate) fn least(&self, output: usize) -> f64 {
        self.y.col(output).iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// Returns the number of terms of each order whose coefficients the runs determine. This number is at most the rank
    /// of the factorisation of all rows, and at most the number of rows of all runs except one.
    pub(crate) fn sizes(&self, fit: &NestedLeastSquares) -> Vec<usize> {
        let determined = |terms: &usize| *terms <= self.most && *terms <= fit.rank();
        self.counts.iter().copied().filter(determined).collect()
    }
}

impl Equations {
    pub(crate) fn runs(&self) -> usize {
        self.rows.len() / (1 + self.slopes)
    }

    /// Computes the QR factorisation of the rows of the chosen runs. If there are more columns than rows, the last
    /// columns are dropped.
    pub(crate) fn least_squares(&self, chosen: &[usize], weights: &[f64]) -> NestedLeastSquares {
        let (mut psi, targets) = self.weighted(chosen, weights);
        psi.truncate(psi.nrows(), psi.ncols().min(psi.nrows()));
        NestedLeastSquares::new(psi, targets, chosen.len())
    }

    /// Returns the basis matrix and the targets at the rows of the chosen runs. The row of a derivative is multiplied
    /// by the weight of the input of the derivative.
    pub(crate) fn weighted(&self, chosen: &[usize], weights: &[f64]) -> (Mat<f64>, Mat<f64>) {
        let (all, n) = (self.runs(), chosen.len());
        let count = n * (1 + self.slopes);
        let source = |row: usize| match row.checked_sub(n) {
            None => (chosen[row], 1.0),
            Some(row) => {
                let (run, input) = (chosen[row / self.slopes], row % self.slopes);
                (all + run * self.slopes + input, weights[input])
            }
        };
        let sources: Vec<(usize, f64)> = (0..count).map(source).collect();
        let terms = self.rows[0].len();
        let psi = Mat::from_fn(count, terms, |i, j| sources[i].1 * self.rows[sources[i].0][j]);
        let targets = Mat::from_fn(count, self.targets.ncols(), |i, m| {
            sources[i].1 * self.targets[(sources[i].0, m)]
        });
        (psi, targets)
    }

    /// Returns the rows with only the given columns, in the given order.
    pub(crate) fn with_columns(&self, columns: &[usize]) -> Self {
        let row = |row: &Vec<f64>| columns.iter().map(|&j| row[j]).collect();
        let rows = self.rows.iter().map(row).collect();
        Self { rows, targets: self.targets.clone(), slopes: self.slopes }
    }

    /// Variance of each target over the runs.
    pub(crate) fn variances(&self) -> Vec<f64> {
        let n = self.runs();
        let variance = |m: usize| {
            let values = || (0..n).map(|i| self.targets[(i, m)]);
            let mean = values().sum::<f64>() / n as f64;
            values().map(|z| (z - mean).powi(2)).sum::<f64>() / n as f64
        };
        (0..self.targets.ncols()).map(variance).collect()
    }

    /// Returns, for the coordinate of each input with derivatives, the ratio of the standard deviation of the targets
    /// to the root mean square of their derivatives. Squares are averaged over the targets, as fractions of each
    /// target's variance. The ratio is 1 for an input on which no target depends. The result is empty without
    /// derivatives.
    pub(crate) fn values_per_slope(&self, variances: &[f64]) -> Vec<f64> {
        let n = self.runs();
        let ratio = |j: usize| {
            let square = |i: usize, m: usize| self.targets[(n + i * self.slopes + j, m)].powi(2);
            let relative = |(m, v): (usize, &f64)| (0..n).map(|i| square(i, m)).sum::<f64>() / v;
            let sum: f64 = variances.iter().enumerate().map(relative).sum();
            if sum > 0.0 { ((n * variances.len()) as f64 / sum).sqrt() } else { 1.0 }
        };
        (0..self.slopes).map(ratio).collect()
    }
}
