//! Moments and Sobol indices of an expansion: closed forms on linear scales, quadrature on logarithmic
//! scales.

use crate::dyn_pce::DynPce;
use crate::quadrature::{MAX_POINTS, TensorGrid};

/// Sobol indices: fractions of each output's variance that are due to inputs and pairs of inputs.
///
/// The inputs are independent and uniform on the box. The variance is always the variance of the output in its unit,
/// even if the output is on a logarithmic scale. If all scales are linear, the indices are sums of squared
/// coefficients c_a², divided by the variance. Otherwise the indices are integrals, computed by Gauss–Legendre
/// quadrature; all indices are NaN if more than ten inputs occur in the terms, because the quadrature has too many
/// points. The indices of an output with zero variance are NaN.
///
/// References: Sobol', Math. Comput. Simul. 55 (2001) 271, doi:10.1016/S0378-4754(00)00270-6;
/// Sudret, Reliab. Eng. Syst. Saf. 93 (2008) 964, doi:10.1016/j.ress.2007.04.002.
#[derive(Clone, Debug, PartialEq)]
pub struct SobolIndices {
    /// `first[m][i]`: fraction of the variance of output m that is due to input i alone.
    pub first: Vec<Vec<f64>>,
    /// `total[m][i]`: fraction of the variance of output m that is due to input i alone or in an interaction with
    /// other inputs.
    pub total: Vec<Vec<f64>>,
    /// `second[m][i][j]`: fraction of the variance of output m that is due to the interaction of the inputs i and j;
    /// symmetric, 0 on the diagonal.
    pub second: Vec<Vec<Vec<f64>>>,
}

impl DynPce {
    /// Returns the mean of each output over the box, for uniform inputs. If all scales are linear, this is the
    /// coefficient c_0 of the constant term.
    pub fn mean(&self) -> Vec<f64> {
        if !self.is_linear() {
            return TensorGrid::new(self, MAX_POINTS)
                .map_or_else(|| self.unknown(), |grid| grid.mean());
        }
        let constant = self.terms().iter().find(|(index, _)| is_constant(index));
        constant.map_or_else(|| vec![0.0; self.outputs().len()], |(_, c)| c.clone())
    }

    /// Returns the variance of each output over the box, for uniform inputs. If all scales are linear, this is
    /// Σ_(a≠0) c_a² over the coefficients of all terms except the constant term.
    ///
    /// ```
    /// use surrogate::{Input, Pce};
    /// // f = t on [−1, 1] has the variance 1/3
    /// let t = Input::new("t", -1.0, 1.0)?;
    /// let pce = Pce::from_terms([t], ["f".into()], [([1], [1.0 / 3f64.sqrt()])])?;
    /// assert!((pce.variance()[0] - 1.0 / 3.0).abs() < 1e-15);
    /// # Ok::<(), surrogate::SurrogateError>(())
    /// ```
    pub fn variance(&self) -> Vec<f64> {
        if !self.is_linear() {
            let all: Vec<usize> = (0..self.inputs().len()).collect();
            return TensorGrid::new(self, MAX_POINTS)
                .map_or_else(|| self.unknown(), |grid| grid.variance_by(&all));
        }
        let mut variance = vec![0.0; self.outputs().len()];
        for (_, c) in self.terms().iter().filter(|(index, _)| !is_constant(index)) {
            variance.iter_mut().zip(c).for_each(|(v, c)| *v += c * c);
        }
        variance
    }

    /// First-order, total and second-order Sobol indices of each output.
    pub fn sobol(&self) -> SobolIndices {
        self.sobol_with(MAX_POINTS)
    }

    /// Version of [`Self::sobol`] with at most `most_points` quadrature points.
    pub(crate) fn sobol_with(&self, most_points: usize) -> SobolIndices {
        let (d, m) = (self.inputs().len(), self.outputs().len());
        let mut indices = SobolIndices {
            first: vec![vec![0.0; d]; m],
            total: vec![vec![0.0; d]; m],
            second: vec![vec![vec![0.0; d]; d]; m],
        };
        let variance = if self.is_linear() {
            self.sums_of_squares(&mut indices);
            self.variance()
        } else if let Some(grid) = TensorGrid::new(self, most_points) {
            conditional_variances(&grid, d, &mut indices)
        } else {
            self.unknown()
        };
        for (m, variance) in variance.into_iter().enumerate() {
            let pairs = indices.second[m].iter_mut().flatten();
            for fraction in indices.first[m].iter_mut().chain(&mut indices.total[m]).chain(pairs) {
                *fraction /= variance;
            }
        }
        indices
    }

    /// Computes the contributions of inputs and pairs of inputs to the variance from the coefficients, and adds them to
    /// `contributions`.
    fn sums_of_squares(&self, contributions: &mut SobolIndices) {
        for (index, c) in self.terms() {
            let active: Vec<usize> = (0..index.len()).filter(|&i| index[i] > 0).collect();
            for (m, c) in c.iter().enumerate() {
                let contribution = c * c;
                for &i in &active {
                    contributions.total[m][i] += contribution;
                }
                match active[..] {
                    [i] => contributions.first[m][i] += contribution,
                    [i, j] => {
                        contributions.second[m][i][j] += contribution;
                        contributions.second[m][j][i] += contribution;
                    }
                    _ => {}
                }
            }
        }
    }

    /// Returns one NaN per output, the result for quantities that cannot be computed.
    fn unknown(&self) -> Vec<f64> {
        vec![f64::NAN; self.outputs().len()]
    }
}

/// Computes the contributions of inputs and pairs of inputs to the variance from conditional variances Var E[f | some
/// inputs], and writes them to `contributions`. Returns the total variance of each output.
fn conditional_variances(
    grid: &TensorGrid,
    d: usize,
    contributions: &mut SobolIndices,
) -> Vec<f64> {
    let all: Vec<usize> = (0..d).collect();
    let variance = grid.variance_by(&all);
    for i in 0..d {
        let others: Vec<usize> = all.iter().copied().filter(|&j| j != i).collect();
        let (alone, without) = (grid.variance_by(&[i]), grid.variance_by(&others));
        for m in 0..variance.len() {
            contributions.first[m][i] = alone[m];
            contributions.total[m][i] = variance[m] - without[m];
        }
    }
    for i in 0..d {
        for j in i + 1..d {
            for (m, both) in grid.variance_by(&[i, j]).into_iter().enumerate() {
                let contribution = both - contributions.first[m][i] - contributions.first[m][j];
                contributions.second[m][i][j] = contribution;
                contributions.second[m][j][i] = contribution;
            }
        }
    }
    variance
}

fn is_constant(index: &[u8]) -> bool {
    index.iter().all(|&a| a == 0)
}
