//! What a further test would teach: the posterior that is to be expected before it is made.
//!
//! Linear and Gaussian at each draw of the present posterior: with J the derivatives of the test's
//! quantities by the parameters there, Σ their scatter between specimens and S the covariance of the error
//! that all specimens share, n specimens carry the information
//!
//! I(n) = Jᵀ (Σ/n + S)⁻¹ J,
//!
//! and with P the covariance of the present posterior, which knows of the prior's box, the variance to be
//! expected is that of V = (P⁻¹ + I(n))⁻¹, averaged over the draws. No linear estimate of the parameters
//! does better, and where all is Gaussian no estimate does.

use nalgebra::{Cholesky, DMatrix, Dyn};

use crate::budget::matrix;

/// As good as any number of specimens.
const MANY: usize = 1_000_000;

/// Half of a central 90 % interval in standard deviations of a normal.
const HALF_90: f64 = 1.644_853_626_951_472_2;

/// Why nothing can be expected of a test.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FurtherTestError {
    /// Rows or columns do not fit together.
    #[error("{what} has {found} entries, expected {expected}")]
    Size {
        /// Of what.
        what: &'static str,
        /// How many there should be.
        expected: usize,
        /// How many there are.
        found: usize,
    },
    /// Draws that do not vary in all directions.
    #[error("{0} draws of the posterior have no covariance: sample more")]
    Draws(usize),
    /// A covariance that is none.
    #[error("the scatter between specimens and the shared error make no covariance")]
    Covariance,
}

/// What is known of the parameters now: the present posterior, in units of the prior's widths.
#[derive(Clone, Debug)]
pub struct Belief {
    /// Standard deviations of the uniform priors.
    prior_sd: Vec<f64>,
    /// L of the covariance P = L Lᵀ of the draws over those.
    factor: DMatrix<f64>,
    /// Widths of the central 90 % intervals of the draws.
    width90: Vec<f64>,
}

impl Belief {
    /// From draws (one row a draw) of a posterior whose prior is uniform between these bounds.
    ///
    /// # Errors
    /// Rows of another length, or draws that have no covariance.
    pub fn of_draws(prior: &[[f64; 2]], draws: &[Vec<f64>]) -> Result<Self, FurtherTestError> {
        let (size, count) = (prior.len(), draws.len());
        if let Some(row) = draws.iter().find(|row| row.len() != size) {
            return Err(FurtherTestError::Size {
                what: "a draw",
                expected: size,
                found: row.len(),
            });
        }
        let prior_sd: Vec<f64> =
            prior.iter().map(|[low, high]| (high - low) / 12f64.sqrt()).collect();
        let mean = |i: usize| draws.iter().map(|row| row[i]).sum::<f64>() / count as f64;
        let means: Vec<f64> = (0..size).map(mean).collect();
        let scaled = DMatrix::from_fn(count, size, |k, i| (draws[k][i] - means[i]) / prior_sd[i]);
        let covariance = scaled.transpose() * &scaled / (count as f64 - 1.0);
        let factor = Cholesky::new(covariance).ok_or(FurtherTestError::Draws(count))?;
        let width = |i: usize| {
            let mut values: Vec<f64> = draws.iter().map(|row| row[i]).collect();
            values.sort_by(f64::total_cmp);
            let at = |p: f64| values[(p * (count - 1) as f64).round() as usize];
            at(0.95) - at(0.05)
        };
        Ok(Self { factor: factor.l(), width90: (0..size).map(width).collect(), prior_sd })
    }

    /// What is known of each parameter without any further test.
    pub fn now(&self) -> Vec<Expected> {
        let variances = (&self.factor * self.factor.transpose()).diagonal();
        let expected = |(variance, &width90): (&f64, &f64)| {
            let contraction = 1.0 - variance;
            Expected { contraction, range: [contraction; 2], width90 }
        };
        variances.iter().zip(&self.width90).map(expected).collect()
    }

    /// The posterior covariance, in units of the priors' variances, after more information in the same.
    fn after(&self, information: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        // (P⁻¹ + I)⁻¹ without an inverse of P
        let size = self.prior_sd.len();
        let within =
            DMatrix::identity(size, size) + self.factor.transpose() * information * &self.factor;
        Some(&self.factor * Cholesky::new(within)?.solve(&self.factor.transpose()))
    }
}

/// A test at one draw of the present posterior.
#[derive(Clone, Debug)]
pub struct TestAtDraw {
    /// Derivatives of its quantities by the parameters, quantities × parameters.
    pub jacobian: Vec<Vec<f64>>,
    /// Σ, their covariance between specimens, quantities × quantities.
    pub scatter: Vec<Vec<f64>>,
}

/// A test that could be made on further specimens.
///
/// # Example
/// ```
/// use breccia_calibration::{Belief, FurtherTest, Goal, TestAtDraw};
///
/// // a parameter known no better than its prior, which a quantity measures with an error of 1
/// let prior = [[0.0, 12.0_f64.sqrt()]];
/// let draws: Vec<Vec<f64>> = (0..10_001).map(|i| vec![prior[0][1] * f64::from(i) / 1e4]).collect();
/// let belief = Belief::of_draws(&prior, &draws)?;
/// let draw = TestAtDraw { jacobian: vec![vec![1.0]], scatter: vec![vec![1.0]] };
/// let test = FurtherTest { draws: vec![draw], shared: vec![vec![0.0]], seen: 0 };
///
/// // n/(n + 1) of the variance
/// assert!((test.expected(&belief, 4)?[0].contraction - 0.8).abs() < 1e-3);
/// assert_eq!(test.specimens_for(&belief, 0, Goal::Contraction(0.901))?.specimens, Some(10));
/// # Ok::<(), breccia_calibration::FurtherTestError>(())
/// ```
///
/// # References
/// Chaloner & Verdinelli (1995), *Bayesian Experimental Design: A Review*, doi:10.1214/ss/1177009939.
#[derive(Clone, Debug)]
pub struct FurtherTest {
    /// The test at draws of the present posterior, over which is averaged.
    pub draws: Vec<TestAtDraw>,
    /// S, the covariance of the error that all its specimens share, quantities × quantities: more of them
    /// do not average it away.
    pub shared: Vec<Vec<f64>>,
    /// How many specimens of this very test the present posterior knows already: they and further ones
    /// share one error.
    pub seen: usize,
}

/// What is to be expected of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// 1 − posterior variance / prior variance, the mean over the draws.
    pub contraction: f64,
    /// Its 5 and 95 % quantiles over the draws: where the truth and the scatter may be.
    pub range: [f64; 2],
    /// Width of the central 90 % interval, in the parameter's unit.
    pub width90: f64,
}

/// What shall be known of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// An expected contraction of at least this.
    Contraction(f64),
    /// A 90 % interval that is expected to be at most so wide, in the parameter's unit.
    Width90(f64),
}

impl Goal {
    fn is_met_by(self, expected: &Expected) -> bool {
        match self {
            Self::Contraction(least) => expected.contraction >= least,
            Self::Width90(most) => expected.width90 <= most,
        }
    }

    fn of(self, expected: &Expected) -> f64 {
        match self {
            Self::Contraction(_) => expected.contraction,
            Self::Width90(_) => expected.width90,
        }
    }
}

/// How many specimens a goal takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Needed {
    /// The smallest number of further specimens; none where [`FurtherTest::MOST`] do not suffice.
    pub specimens: Option<usize>,
    /// What any number of them would give, in place of the goal's value.
    pub limit: f64,
}

impl FurtherTest {
    /// More specimens than this no laboratory tests.
    pub const MOST: usize = 1000;

    /// What is to be expected of each parameter after so many further specimens. Never falls with their number.
    ///
    /// # Errors
    /// Matrices that do not fit together, or that are no covariances.
    pub fn expected(
        &self,
        belief: &Belief,
        specimens: usize,
    ) -> Result<Vec<Expected>, FurtherTestError> {
        if specimens == 0 {
            return Ok(belief.now());
        }
        self.check(belief)?;
        let shared = matrix(&self.shared);
        let mut contractions: Vec<Vec<f64>> = vec![Vec::new(); belief.prior_sd.len()];
        let mut widths = vec![0.0; belief.prior_sd.len()];
        for draw in &self.draws {
            let gained = self.gained(draw, &shared, belief, specimens);
            let after = gained.and_then(|gained| belief.after(&gained));
            let variances = after.ok_or(FurtherTestError::Covariance)?.diagonal();
            for (i, &variance) in variances.iter().enumerate() {
                contractions[i].push(1.0 - variance);
                let width = 2.0 * HALF_90 * belief.prior_sd[i] * variance.sqrt();
                // a posterior that fills its box is no normal, and its interval is the narrower one
                widths[i] += width.min(belief.width90[i]) / self.draws.len() as f64;
            }
        }
        let of = |(mut values, width90): (Vec<f64>, f64)| {
            values.sort_by(f64::total_cmp);
            let at = |p: f64| values[(p * (values.len() - 1) as f64).round() as usize];
            let contraction = values.iter().sum::<f64>() / values.len() as f64;
            Expected { contraction, range: [at(0.05), at(0.95)], width90 }
        };
        Ok(contractions.into_iter().zip(widths).map(of).collect())
    }

    /// The smallest number of further specimens from which on a goal is met.
    ///
    /// # Errors
    /// As [`Self::expected`].
    pub fn specimens_for(
        &self,
        belief: &Belief,
        parameter: usize,
        goal: Goal,
    ) -> Result<Needed, FurtherTestError> {
        let met = |n: usize| Ok(goal.is_met_by(&self.expected(belief, n)?[parameter]));
        let limit = goal.of(&self.expected(belief, MANY)?[parameter]);
        if met(0)? {
            return Ok(Needed { specimens: Some(0), limit });
        }
        if !met(Self::MOST)? {
            return Ok(Needed { specimens: None, limit });
        }
        let (mut short, mut enough) = (0, Self::MOST);
        while enough - short > 1 {
            let middle = short + (enough - short) / 2;
            if met(middle)? { enough = middle } else { short = middle }
        }
        Ok(Needed { specimens: Some(enough), limit })
    }

    /// The information of further specimens beside those seen, in units of the priors' widths.
    fn gained(
        &self,
        draw: &TestAtDraw,
        shared: &DMatrix<f64>,
        belief: &Belief,
        specimens: usize,
    ) -> Option<DMatrix<f64>> {
        let jacobian = DMatrix::from_fn(draw.jacobian.len(), belief.prior_sd.len(), |m, i| {
            draw.jacobian[m][i] * belief.prior_sd[i]
        });
        let scatter = matrix(&draw.scatter);
        let of = |n: usize| -> Option<DMatrix<f64>> {
            let covariance: Cholesky<f64, Dyn> = Cholesky::new(&scatter / n as f64 + shared)?;
            Some(jacobian.transpose() * covariance.solve(&jacobian))
        };
        let all = of(self.seen + specimens)?;
        if self.seen == 0 { Some(all) } else { Some(all - of(self.seen)?) }
    }

    fn check(&self, belief: &Belief) -> Result<(), FurtherTestError> {
        let (quantities, parameters) = (self.shared.len(), belief.prior_sd.len());
        let sized = |what, expected: usize, found: usize| match expected == found {
            true => Ok(()),
            false => Err(FurtherTestError::Size { what, expected, found }),
        };
        if self.draws.is_empty() {
            return Err(FurtherTestError::Draws(0));
        }
        self.shared.iter().try_for_each(|row| sized("the shared error", quantities, row.len()))?;
        for draw in &self.draws {
            sized("the jacobian", quantities, draw.jacobian.len())?;
            sized("the scatter", quantities, draw.scatter.len())?;
            let rows = &draw.jacobian;
            rows.iter().try_for_each(|row| sized("the jacobian", parameters, row.len()))?;
            draw.scatter.iter().try_for_each(|row| sized("the scatter", quantities, row.len()))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod nested;
#[cfg(test)]
mod tests;
