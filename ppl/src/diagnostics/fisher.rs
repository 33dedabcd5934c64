//! Which combinations of parameters do the outputs of an experiment see?

use std::fmt;

use nalgebra::DMatrix;

/// A Fisher matrix that cannot be decomposed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum IdentifiabilityError {
    /// Sizes do not fit.
    #[error("Fisher information: {what} has size {got}, expected {expected}")]
    Size {
        /// The argument.
        what: &'static str,
        /// Its size.
        got: usize,
        /// The size needed.
        expected: usize,
    },
    /// The covariance of the outputs has no Cholesky factor.
    #[error("the covariance of the outputs is not positive definite")]
    Covariance,
}

/// Eigenvectors of the Fisher information JᵀΣ⁻¹J in prior units: which combinations of parameters
/// the outputs see, best first.
///
/// With parameters in units of their prior standard deviation, an eigenvalue λ means that along
/// its direction one experiment has √λ prior standard deviations per standard error; below 1 the
/// prior says more than the experiment.
#[derive(Clone, Debug, PartialEq)]
pub struct FisherDirections {
    /// Parameters, in the order of the directions' components.
    pub names: Vec<String>,
    /// Eigenvalues, largest first.
    pub eigenvalues: Vec<f64>,
    /// Unit vectors in prior units, `directions[k][parameter]`; the largest component is positive.
    pub directions: Vec<Vec<f64>>,
}

impl FisherDirections {
    /// From the Jacobian J (outputs × parameters), the covariance Σ of the outputs and the prior
    /// standard deviations of the parameters.
    ///
    /// # Errors
    /// [`IdentifiabilityError`] if sizes do not fit or Σ is not positive definite.
    ///
    /// ```
    /// use nalgebra::{DMatrix, dmatrix};
    /// use ppl::diagnostics::FisherDirections;
    /// // one output sees only the sum of two parameters
    /// let jacobian = dmatrix![1.0, 1.0];
    /// let names = ["a".to_string(), "b".to_string()];
    /// let found = FisherDirections::new(&names, &jacobian, &dmatrix![0.01], &[1.0, 1.0])?;
    /// assert!((found.eigenvalues[0] - 200.0).abs() < 1e-9);
    /// assert!(found.eigenvalues[1].abs() < 1e-9, "the difference is invisible");
    /// # Ok::<(), ppl::diagnostics::IdentifiabilityError>(())
    /// ```
    pub fn new(
        names: &[String],
        jacobian: &DMatrix<f64>,
        covariance: &DMatrix<f64>,
        prior_sd: &[f64],
    ) -> Result<Self, IdentifiabilityError> {
        let (outputs, parameters) = jacobian.shape();
        let require = |what, got, expected| {
            if got == expected {
                Ok(())
            } else {
                Err(IdentifiabilityError::Size { what, got, expected })
            }
        };
        require("names", names.len(), parameters)?;
        require("prior_sd", prior_sd.len(), parameters)?;
        require("covariance", covariance.nrows(), outputs)?;
        require("covariance", covariance.ncols(), outputs)?;

        let mut scaled = jacobian.clone();
        for (mut column, sd) in scaled.column_iter_mut().zip(prior_sd) {
            column *= *sd;
        }
        let factor = covariance.clone().cholesky().ok_or(IdentifiabilityError::Covariance)?;
        let fisher = scaled.transpose() * factor.solve(&scaled);
        let eigen = fisher.symmetric_eigen();

        let mut order: Vec<usize> = (0..parameters).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let directions = order.iter().map(|&k| {
            let column = eigen.eigenvectors.column(k);
            let sign = column[column.icamax()].signum();
            column.iter().map(|v| sign * v).collect()
        });
        Ok(Self {
            names: names.to_vec(),
            directions: directions.collect(),
            eigenvalues: order.iter().map(|&k| eigen.eigenvalues[k]).collect(),
        })
    }
}

impl fmt::Display for FisherDirections {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "Fisher information in prior units, best seen direction first:")?;
        for (value, direction) in self.eigenvalues.iter().zip(&self.directions) {
            write!(f, "{value:>12.3e} ")?;
            for (name, component) in self.names.iter().zip(direction) {
                write!(f, " {component:+.2} {name}")?;
            }
            writeln!(f, "{}", if *value < 1.0 { "  (less than the prior knows)" } else { "" })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::dmatrix;

    #[test]
    fn two_by_two_fisher_matrix_by_hand() {
        // J = diag(2, 1), Σ = diag(4, 1), prior sd (1, 3): F = diag(1, 9)
        let names = ["a".to_string(), "b".to_string()];
        let found = FisherDirections::new(
            &names,
            &dmatrix![2.0, 0.0; 0.0, 1.0],
            &dmatrix![4.0, 0.0; 0.0, 1.0],
            &[1.0, 3.0],
        )
        .expect("sizes fit");
        assert!((found.eigenvalues[0] - 9.0).abs() < 1e-12);
        assert!((found.eigenvalues[1] - 1.0).abs() < 1e-12);
        assert!((found.directions[0][1] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn wrong_sizes_and_covariances_are_named() {
        let names = ["a".to_string()];
        let jacobian = dmatrix![1.0; 2.0];
        let bad = FisherDirections::new(&names, &jacobian, &dmatrix![1.0], &[1.0]);
        assert_eq!(
            bad,
            Err(IdentifiabilityError::Size { what: "covariance", got: 1, expected: 2 })
        );
        let singular = dmatrix![1.0, 1.0; 1.0, 1.0];
        let bad = FisherDirections::new(&names, &jacobian, &singular, &[1.0]);
        assert_eq!(bad, Err(IdentifiabilityError::Covariance));
    }
}
