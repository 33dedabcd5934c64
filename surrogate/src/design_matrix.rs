//! A dataset as a regression: values of the basis and of the outputs on their scales.

use faer::Mat;

use crate::dataset::{Dataset, check_count};
use crate::dyn_pce::axes;
use crate::error::SurrogateError;
use crate::legendre::basis_row;
use crate::multi_index::Truncation;
use crate::regression::NestedLeastSquares;
use crate::scale::Scale;

/// What a fit knows before scales and order are chosen.
pub(crate) struct Regression<'a> {
    pub(crate) data: &'a Dataset,
    /// rows × outputs, in their units
    pub(crate) y: Mat<f64>,
    /// Of each output over the rows.
    pub(crate) variance: Vec<f64>,
    /// Number of terms of order 0, 1, …
    pub(crate) counts: Vec<usize>,
    /// Multi-indices of the orders that the rows may determine, nested.
    pub(crate) columns: Vec<Vec<u8>>,
}

impl<'a> Regression<'a> {
    /// # Errors
    /// Fewer than two rows; an output that is the same in all of them.
    pub(crate) fn new(
        data: &'a Dataset,
        truncation: Truncation,
        max_order: usize,
    ) -> Result<Self, SurrogateError> {
        let (n, d) = (data.len(), data.inputs().len());
        if n < 2 {
            return Err(SurrogateError::Count { what: "rows, at least", expected: 2, found: n });
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
        // leaving one row out must leave at least as many rows as terms
        let estimable = counts.iter().take_while(|&&terms| terms < n).count();
        let columns = truncation.nested(d, estimable - 1);
        Ok(Self { data, y, variance, counts, columns })
    }

    /// ψ of every row and column, with the inputs on their scales.
    ///
    /// # Errors
    /// As [`axes`].
    pub(crate) fn basis(&self, inputs: &[Scale]) -> Result<Vec<Vec<f64>>, SurrogateError> {
        let axes = axes(self.data.inputs(), inputs)?;
        let row = |(x, _): (&[f64], &[f64])| {
            let t: Vec<f64> = axes.iter().zip(x).map(|(axis, &x)| axis.to_unit(x)).collect();
            basis_row(&self.columns, &t)
        };
        Ok(self.data.rows().map(row).collect())
    }

    /// The outputs on their scales, rows × outputs.
    ///
    /// # Errors
    /// Another number of scales; the logarithm of an output that is not above 0 in some row.
    pub(crate) fn targets(&self, outputs: &[Scale]) -> Result<Mat<f64>, SurrogateError> {
        check_count("scales of outputs", self.y.ncols(), outputs.len())?;
        for (m, name) in self.data.outputs().iter().enumerate() {
            let least = self.least(m);
            if outputs[m] == Scale::Log && least <= 0.0 {
                return Err(SurrogateError::Logarithm { name: name.clone(), value: least });
            }
        }
        Ok(Mat::from_fn(self.y.nrows(), self.y.ncols(), |i, m| {
            outputs[m].coordinate(self.y[(i, m)])
        }))
    }

    /// The least value of an output.
    pub(crate) fn least(&self, output: usize) -> f64 {
        self.y.col(output).iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// The numbers of terms that a factorisation of all rows determines, with a row to spare.
    pub(crate) fn sizes(&self, fit: &NestedLeastSquares) -> Vec<usize> {
        let determined = |terms: &usize| *terms < self.data.len() && *terms <= fit.rank();
        self.counts.iter().copied().filter(determined).collect()
    }
}

/// The design matrix of the chosen rows.
pub(crate) fn select(rows: &[Vec<f64>], chosen: &[usize]) -> Mat<f64> {
    Mat::from_fn(chosen.len(), rows[0].len(), |i, j| rows[chosen[i]][j])
}
