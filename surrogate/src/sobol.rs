//! Moments and Sobol indices of an expansion: in closed form on linear scales, by quadrature on others.

use crate::dyn_pce::DynPce;
use crate::quadrature::{MAX_POINTS, TensorGrid};

/// Fractions of each output's variance that inputs and pairs of inputs cause.
///
/// The inputs are independent and uniform on the box, and an output is the number itself, whatever
/// the scales: on linear scales these are sums of c_a², otherwise integrals by Gauss–Legendre quadrature.
/// An output without variance has NaN here, and so have all on logarithmic scales with more than ten
/// inputs, for which that quadrature has too many points.
///
/// References: Sobol', Math. Comput. Simul. 55 (2001) 271, doi:10.1016/S0378-4754(00)00270-6;
/// Sudret, Reliab. Eng. Syst. Saf. 93 (2008) 964, doi:10.1016/j.ress.2007.04.002.
#[derive(Clone, Debug, PartialEq)]
pub struct SobolIndices {
    /// `first[m][i]`: by input i alone.
    pub first: Vec<Vec<f64>>,
    /// `total[m][i]`: by all in which input i takes part.
    pub total: Vec<Vec<f64>>,
    /// `second[m][i][j]`: by i and j together beyond each alone; symmetric, 0 on the diagonal.
    pub second: Vec<Vec<Vec<f64>>>,
}

impl DynPce {
    /// The mean of each output over the box, inputs uniform: c_0 on linear scales.
    pub fn mean(&self) -> Vec<f64> {
        if !self.is_linear() {
            return TensorGrid::new(self, MAX_POINTS)
                .map_or_else(|| self.unknown(), |grid| grid.mean());
        }
        let constant = self.terms().iter().find(|(index, _)| is_constant(index));
        constant.map_or_else(|| vec![0.0; self.outputs().len()], |(_, c)| c.clone())
    }

    /// The variance of each output over the box, inputs uniform: Σ_(a≠0) c_a² on linear scales.
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

    /// The same by a quadrature of not more than so many points, where there is need of one.
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

    /// Parts of the variance, from the coefficients.
    fn sums_of_squares(&self, parts: &mut SobolIndices) {
        for (index, c) in self.terms() {
            let active: Vec<usize> = (0..index.len()).filter(|&i| index[i] > 0).collect();
            for (m, c) in c.iter().enumerate() {
                let part = c * c;
                for &i in &active {
                    parts.total[m][i] += part;
                }
                match active[..] {
                    [i] => parts.first[m][i] += part,
                    [i, j] => {
                        parts.second[m][i][j] += part;
                        parts.second[m][j][i] += part;
                    }
                    _ => {}
                }
            }
        }
    }

    /// NaN for each output.
    fn unknown(&self) -> Vec<f64> {
        vec![f64::NAN; self.outputs().len()]
    }
}

/// Parts of the variance from Var E[f | some inputs]; returns the whole variance.
fn conditional_variances(grid: &TensorGrid, d: usize, parts: &mut SobolIndices) -> Vec<f64> {
    let all: Vec<usize> = (0..d).collect();
    let variance = grid.variance_by(&all);
    for i in 0..d {
        let others: Vec<usize> = all.iter().copied().filter(|&j| j != i).collect();
        let (alone, without) = (grid.variance_by(&[i]), grid.variance_by(&others));
        for m in 0..variance.len() {
            parts.first[m][i] = alone[m];
            parts.total[m][i] = variance[m] - without[m];
        }
    }
    for i in 0..d {
        for j in i + 1..d {
            for (m, both) in grid.variance_by(&[i, j]).into_iter().enumerate() {
                let part = both - parts.first[m][i] - parts.first[m][j];
                parts.second[m][i][j] = part;
                parts.second[m][j][i] = part;
            }
        }
    }
    variance
}

fn is_constant(index: &[u8]) -> bool {
    index.iter().all(|&a| a == 0)
}
