//! What did the data say about each parameter, and what about none of them alone?

use std::fmt;

use nalgebra::DMatrix;

use super::mean_and_variance;

/// Mean and standard deviation of one parameter, prior or posterior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Marginal {
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub sd: f64,
}

impl Marginal {
    /// Of draws; the standard deviation with n − 1.
    pub fn of(draws: &[f64]) -> Self {
        let (mean, variance) = mean_and_variance(draws.iter().copied());
        Self { mean, sd: variance.sqrt() }
    }
}

/// How far the data narrowed a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Identification {
    /// Contraction below 0.1: the posterior is the prior.
    Not,
    /// Contraction from 0.1 to 0.5.
    Weakly,
    /// Contraction of at least 0.5.
    Identified,
}

impl Identification {
    /// The label of a contraction; one that is not a number counts as nothing learned.
    pub fn of(contraction: f64) -> Self {
        match contraction {
            c if c >= 0.5 => Self::Identified,
            c if c >= 0.1 => Self::Weakly,
            _ => Self::Not,
        }
    }
}

impl fmt::Display for Identification {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Not => "not identified",
            Self::Weakly => "weakly identified",
            Self::Identified => "identified",
        })
    }
}

/// What the data did to one parameter.
///
/// ```
/// use ppl::diagnostics::{Identifiability, Identification, Marginal};
/// let prior = Marginal { mean: 275.0, sd: 14.4 };
/// let draws: Vec<f64> = (0..1000).map(|i| 280.0 + (i as f64).sin()).collect();
/// let row = Identifiability::new("young", prior, &draws, Some((250.0, 300.0)));
/// assert_eq!(row.label(), Identification::Identified);
/// assert!(row.contraction() > 0.99);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Identifiability {
    /// Name with indices, as `sd[0]`.
    pub name: String,
    /// Before the data.
    pub prior: Marginal,
    /// After the data.
    pub posterior: Marginal,
    /// [`boundary_mass`]; `None` for a prior without two bounds.
    pub boundary_mass: Option<f64>,
    /// Known truth, where the data are simulated.
    pub truth: Option<f64>,
    /// Largest total Sobol index of any output, where a surrogate gives one.
    pub sensitivity: Option<f64>,
}

impl Identifiability {
    /// From posterior draws; `bounds` are the prior's, if it has two.
    pub fn new(
        name: impl Into<String>,
        prior: Marginal,
        draws: &[f64],
        bounds: Option<(f64, f64)>,
    ) -> Self {
        Self {
            name: name.into(),
            prior,
            posterior: Marginal::of(draws),
            boundary_mass: bounds.map(|bounds| boundary_mass(draws, bounds)),
            truth: None,
            sensitivity: None,
        }
    }

    /// c = 1 − var(posterior)/var(prior): 1 all learned, 0 nothing, negative if the data widened it.
    pub fn contraction(&self) -> f64 {
        1.0 - (self.posterior.sd / self.prior.sd).powi(2)
    }

    /// z = |posterior mean − truth| / posterior sd, where the truth is known.
    pub fn z_score(&self) -> Option<f64> {
        self.truth.map(|truth| (self.posterior.mean - truth).abs() / self.posterior.sd)
    }

    /// The contraction in words.
    pub fn label(&self) -> Identification {
        Identification::of(self.contraction())
    }

    /// More than 5 % of the draws lie at a prior bound: the prior cuts the posterior.
    pub fn truncated(&self) -> bool {
        self.boundary_mass.is_some_and(|mass| mass > 0.05)
    }
}

impl fmt::Display for Identifiability {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}: {} (contraction {:.2}; prior {:.4} ± {:.4}, posterior {:.4} ± {:.4}",
            self.name,
            self.label(),
            self.contraction(),
            self.prior.mean,
            self.prior.sd,
            self.posterior.mean,
            self.posterior.sd
        )?;
        if let Some(z) = self.z_score() {
            write!(f, "; {z:.2} sd from the truth")?;
        }
        if let Some(sensitivity) = self.sensitivity {
            write!(f, "; largest total Sobol index {sensitivity:.2}")?;
        }
        write!(f, ")")?;
        match self.boundary_mass {
            Some(mass) if self.truncated() => {
                write!(f, "; truncated by its prior: {:.0} % at a bound", 100.0 * mass)
            }
            _ => Ok(()),
        }
    }
}

/// Share of draws within 1 % of the width of the box from either bound, and within a fifth of their
/// own standard deviation: a wide prior does not cut off what is far from its bound on the scale of
/// the posterior.
pub fn boundary_mass(draws: &[f64], (lower, upper): (f64, f64)) -> f64 {
    let margin = (0.01 * (upper - lower)).min(0.2 * Marginal::of(draws).sd);
    super::mean(draws.iter().map(|&x| f64::from(x < lower + margin || x > upper - margin)))
}

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
    fn labels_follow_the_contraction() {
        let prior = Marginal { mean: 0.0, sd: 1.0 };
        let with_sd = |sd: f64| Identifiability {
            name: "x".into(),
            prior,
            posterior: Marginal { mean: 0.5, sd },
            boundary_mass: None,
            truth: Some(1.5),
            sensitivity: None,
        };
        assert_eq!(with_sd(0.2).label(), Identification::Identified);
        assert_eq!(with_sd(0.8).label(), Identification::Weakly);
        assert_eq!(with_sd(0.99).label(), Identification::Not);
        assert_eq!(with_sd(1.3).label(), Identification::Not);
        assert_eq!(with_sd(f64::NAN).label(), Identification::Not);
        assert_eq!(with_sd(0.5).z_score(), Some(2.0));
        assert!((with_sd(0.5).contraction() - 0.75).abs() < 1e-15);
    }

    #[test]
    fn mass_at_a_bound_is_counted_on_both_sides() {
        let draws = [0.005, 0.5, 0.5, 0.995];
        assert_eq!(boundary_mass(&draws, (0.0, 1.0)), 0.5);
        let row =
            Identifiability::new("x", Marginal { mean: 0.5, sd: 0.29 }, &draws, Some((0.0, 1.0)));
        assert!(row.truncated());
        assert!(row.to_string().contains("truncated by its prior: 50 %"), "{row}");
    }

    /// An exponential posterior is cut off at the bound, a gamma one on the same scale is not, however
    /// wide the prior.
    #[test]
    fn a_wide_prior_is_no_bound_by_itself() {
        let quantiles = |of: &dyn Fn(f64) -> f64| -> Vec<f64> {
            (0..1000).map(|i| of((f64::from(i) + 0.5) / 1000.0)).collect()
        };
        let exponential = quantiles(&|p| -(-p).ln_1p());
        let narrow = quantiles(&|p| 0.2 + 0.1 * (p / (1.0 - p)).ln().tanh());
        for width in [20.0, 100.0, 1e4] {
            assert!(boundary_mass(&exponential, (0.0, width)) > 0.15);
            assert_eq!(boundary_mass(&narrow, (0.0, width)), 0.0);
        }
    }

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
