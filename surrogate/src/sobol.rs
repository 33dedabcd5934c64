//! Moments and Sobol indices of an expansion, in closed form.

use crate::dyn_pce::DynPce;

/// Fractions of each output's variance that inputs and pairs of inputs cause.
///
/// With V = Σ_(a≠0) c_a² and inputs uniform on the box. An output without variance has NaN here.
///
/// References: Sobol', Math. Comput. Simul. 55 (2001) 271, doi:10.1016/S0378-4754(00)00270-6;
/// Sudret, Reliab. Eng. Syst. Saf. 93 (2008) 964, doi:10.1016/j.ress.2007.04.002.
#[derive(Clone, Debug, PartialEq)]
pub struct SobolIndices {
    /// `first[m][i]`: terms in input i alone.
    pub first: Vec<Vec<f64>>,
    /// `total[m][i]`: all terms in which input i takes part.
    pub total: Vec<Vec<f64>>,
    /// `second[m][i][j]`: terms in i and j alone; symmetric, 0 on the diagonal.
    pub second: Vec<Vec<Vec<f64>>>,
}

impl DynPce {
    /// The mean of each output over the box: c_0.
    pub fn mean(&self) -> Vec<f64> {
        let constant = self.terms().iter().find(|(index, _)| is_constant(index));
        constant.map_or_else(|| vec![0.0; self.outputs().len()], |(_, c)| c.clone())
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
    pub fn variance(&self) -> Vec<f64> {
        let mut variance = vec![0.0; self.outputs().len()];
        for (_, c) in self.terms().iter().filter(|(index, _)| !is_constant(index)) {
            variance.iter_mut().zip(c).for_each(|(v, c)| *v += c * c);
        }
        variance
    }

    /// First-order, total and second-order Sobol indices of each output.
    pub fn sobol(&self) -> SobolIndices {
        let (d, m) = (self.inputs().len(), self.outputs().len());
        let mut indices = SobolIndices {
            first: vec![vec![0.0; d]; m],
            total: vec![vec![0.0; d]; m],
            second: vec![vec![vec![0.0; d]; d]; m],
        };
        for (index, c) in self.terms() {
            let active: Vec<usize> = (0..d).filter(|&i| index[i] > 0).collect();
            for (m, c) in c.iter().enumerate() {
                let fraction = c * c;
                for &i in &active {
                    indices.total[m][i] += fraction;
                }
                match active[..] {
                    [i] => indices.first[m][i] += fraction,
                    [i, j] => {
                        indices.second[m][i][j] += fraction;
                        indices.second[m][j][i] += fraction;
                    }
                    _ => {}
                }
            }
        }
        for (m, variance) in self.variance().into_iter().enumerate() {
            let pairs = indices.second[m].iter_mut().flatten();
            for fraction in indices.first[m].iter_mut().chain(&mut indices.total[m]).chain(pairs) {
                *fraction /= variance;
            }
        }
        indices
    }
}

fn is_constant(index: &[u8]) -> bool {
    index.iter().all(|&a| a == 0)
}
