//! Moments and Sobol indices of an expansion, in closed form.

use crate::pce::Pce;

/// Shares of each output's variance that inputs and pairs of inputs cause.
///
/// With V = Σ_(a≠0) c_a² and inputs uniform on the box. An output without variance has NaN here.
///
/// References: Sobol', Math. Comput. Simul. 55 (2001) 271, doi:10.1016/S0378-4754(00)00270-6;
/// Sudret, Reliab. Eng. Syst. Saf. 93 (2008) 964, doi:10.1016/j.ress.2007.04.002.
#[derive(Clone, Debug, PartialEq)]
pub struct SobolIndices<const D: usize, const M: usize> {
    /// `first[m][i]`: terms in input i alone.
    pub first: [[f64; D]; M],
    /// `total[m][i]`: all terms in which input i takes part.
    pub total: [[f64; D]; M],
    /// `second[m][i][j]`: terms in i and j alone; symmetric, 0 on the diagonal.
    pub second: [[[f64; D]; D]; M],
}

impl<const D: usize, const M: usize> Pce<D, M> {
    /// The mean of each output over the box: c_0.
    pub fn mean(&self) -> [f64; M] {
        self.terms().iter().find(|(a, _)| *a == [0; D]).map_or([0.0; M], |(_, c)| *c)
    }

    /// The variance of each output over the box: Σ_(a≠0) c_a².
    ///
    /// ```
    /// use surrogate::{Input, Pce};
    /// // f = t on [−1, 1] has the variance 1/3
    /// let t = Input::new("t", -1.0, 1.0)?;
    /// let pce = Pce::from_terms([t], ["f".into()], [([1], [1.0 / 3f64.sqrt()])])?;
    /// assert!((pce.variance()[0] - 1.0 / 3.0).abs() < 1e-15);
    /// # Ok::<(), surrogate::SurrogateError>(())
    /// ```
    pub fn variance(&self) -> [f64; M] {
        let mut variance = [0.0; M];
        for (_, c) in self.terms().iter().filter(|(a, _)| *a != [0; D]) {
            for m in 0..M {
                variance[m] += c[m] * c[m];
            }
        }
        variance
    }

    /// First-order, total and second-order Sobol indices of each output.
    pub fn sobol(&self) -> SobolIndices<D, M> {
        let mut indices =
            SobolIndices { first: [[0.0; D]; M], total: [[0.0; D]; M], second: [[[0.0; D]; D]; M] };
        for (a, c) in self.terms() {
            let active: Vec<usize> = (0..D).filter(|&d| a[d] > 0).collect();
            for m in 0..M {
                let share = c[m] * c[m];
                for &i in &active {
                    indices.total[m][i] += share;
                }
                match active[..] {
                    [i] => indices.first[m][i] += share,
                    [i, j] => {
                        indices.second[m][i][j] += share;
                        indices.second[m][j][i] += share;
                    }
                    _ => {}
                }
            }
        }
        for (m, variance) in self.variance().into_iter().enumerate() {
            let pairs = indices.second[m].iter_mut().flatten();
            for share in indices.first[m].iter_mut().chain(&mut indices.total[m]).chain(pairs) {
                *share /= variance;
            }
        }
        indices
    }
}
