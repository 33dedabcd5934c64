//! Expected benefit of a further test: posterior variances that can be expected before the test is made.
//!
//! The approximation is linear and Gaussian at each draw of the present posterior. J contains the derivatives of the
//! test's quantities with respect to the parameters, Σ is the covariance of the quantities between specimens, and S is
//! the covariance of the error that all specimens share. Then n specimens add the Fisher information
//!
//! I(n) = Jᵀ (Σ/n + S)⁻¹ J.
//!
//! With the covariance P of the present posterior, which includes the prior, the expected posterior
//! covariance is V = (P⁻¹ + I(n))⁻¹, averaged over the draws. No linear estimator of the parameters has smaller
//! variances. If all distributions are Gaussian, no estimator has smaller variances.

mod alike;

use nalgebra::{Cholesky, DMatrix, Dyn};

use crate::budget::matrix;
use crate::further_test::alike::{MeanResponse, gained, information, precision_of};
use crate::prior::Prior;

/// Number of specimens that represents the limit of infinitely many specimens.
const MANY: usize = 1_000_000;

/// Half width of the central 90 % interval of a normal distribution, in standard deviations.
const HALF_90: f64 = 1.644_853_626_951_472_2;

/// Error that prevents the prediction of a further test.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FurtherTestError {
    /// The sizes of vectors or matrices do not match.
    #[error("{what} has {found} entries, expected {expected}")]
    Size {
        /// Name of the vector or matrix.
        what: &'static str,
        /// Expected number of entries.
        expected: usize,
        /// Actual number of entries.
        found: usize,
    },
    /// The covariance of the draws is not positive definite: there are too few draws, or some combination of parameters
    /// has the same value in all draws.
    #[error(
        "the covariance of {0} draws of the posterior is not positive definite: draw more samples"
    )]
    Draws(usize),
    /// The scatter between specimens plus the shared error is not a positive definite covariance.
    #[error(
        "the sum of the scatter between specimens and the shared error is not positive definite"
    )]
    Covariance,
}

/// Present posterior of the parameters, with covariances in units of the prior standard deviations.
#[derive(Clone, Debug)]
pub struct Belief {
    /// Standard deviations of the priors.
    prior_sd: Vec<f64>,
    /// Cholesky factor L of the covariance P = L Lᵀ of the draws, in units of `prior_sd`.
    factor: DMatrix<f64>,
    /// Widths of the central 90 % intervals of the draws, in the parameters' units.
    width90: Vec<f64>,
}

impl Belief {
    /// Computes covariance and intervals from draws of a posterior, one row per draw. `priors` are the priors of the
    /// parameters.
    ///
    /// # Errors
    /// If a row does not have one value per parameter, or the covariance of the draws is not positive definite.
    pub fn of_draws(priors: &[Prior], draws: &[Vec<f64>]) -> Result<Self, FurtherTestError> {
        let (size, count) = (priors.len(), draws.len());
        if let Some(row) = draws.iter().find(|row| row.len() != size) {
            return Err(FurtherTestError::Size {
                what: "a draw",
                expected: size,
                found: row.len(),
            });
        }
        let prior_sd: Vec<f64> = priors.iter().map(Prior::sd).collect();
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

    /// Returns the contraction and interval width of each parameter in the present posterior.
    pub fn now(&self) -> Vec<Expected> {
        let variances = (&self.factor * self.factor.transpose()).diagonal();
        let expected = |(variance, &width90): (&f64, &f64)| {
            let contraction = 1.0 - variance;
            Expected { contraction, range: [contraction; 2], width90 }
        };
        variances.iter().zip(&self.width90).map(expected).collect()
    }

    /// Returns the posterior covariance after `information` is added. Covariance and information are in units of the
    /// prior standard deviations.
    fn after(&self, information: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        // (P⁻¹ + I)⁻¹ = L (1 + Lᵀ I L)⁻¹ Lᵀ with the information I and P = L Lᵀ: P is not inverted
        let size = self.prior_sd.len();
        let within =
            DMatrix::identity(size, size) + self.factor.transpose() * information * &self.factor;
        Some(&self.factor * Cholesky::new(within)?.solve(&self.factor.transpose()))
    }
}

/// Linearisation of a test at one draw of the present posterior.
#[derive(Clone, Debug)]
pub struct TestAtDraw {
    /// Derivatives of the test's quantities with respect to the parameters, quantities × parameters.
    pub jacobian: Vec<Vec<f64>>,
    /// Covariance Σ of the quantities between specimens, quantities × quantities.
    pub scatter: Vec<Vec<f64>>,
}

impl TestAtDraw {
    /// Derivatives with respect to the parameters in units of the prior standard deviations.
    fn scaled_jacobian(&self, belief: &Belief) -> DMatrix<f64> {
        DMatrix::from_fn(self.jacobian.len(), belief.prior_sd.len(), |m, i| {
            self.jacobian[m][i] * belief.prior_sd[i]
        })
    }
}

/// A test that could be made on further specimens.
///
/// # Example
/// ```
/// use breccia_calibration::{Belief, FurtherTest, Goal, Prior, TestAtDraw};
///
/// // the present posterior of a parameter is its prior; a quantity measures the parameter with an error of 1
/// let width = 12.0_f64.sqrt();
/// let draws: Vec<Vec<f64>> = (0..10_001).map(|i| vec![width * f64::from(i) / 1e4]).collect();
/// let belief = Belief::of_draws(&[Prior::uniform(0.0, width)], &draws)?;
/// let draw = TestAtDraw { jacobian: vec![vec![1.0]], scatter: vec![vec![1.0]] };
/// let test = FurtherTest { draws: vec![draw], shared: vec![vec![0.0]], seen: Vec::new(), alike: None };
///
/// // n specimens reduce the variance by the fraction n/(n + 1)
/// assert!((test.expected(&belief, 4)?[0].contraction - 0.8).abs() < 1e-3);
/// assert_eq!(test.specimens_for(&belief, 0, Goal::Contraction(0.901))?.specimens, Some(10));
/// # Ok::<(), breccia_calibration::FurtherTestError>(())
/// ```
///
/// # References
/// Chaloner & Verdinelli (1995), *Bayesian Experimental Design: A Review*, doi:10.1214/ss/1177009939.
#[derive(Clone, Debug)]
pub struct FurtherTest {
    /// The quantities of the test, linearised at draws of the present posterior. Expected values are
    /// means over these draws.
    pub draws: Vec<TestAtDraw>,
    /// Covariance S of the error that all specimens of the test share, quantities × quantities. This error does not
    /// decrease with the number of specimens.
    pub shared: Vec<Vec<f64>>,
    /// Specimens of the same test that the present posterior already includes: the indices of the recorded quantities of
    /// each specimen. These specimens share one error with further specimens.
    pub seen: Vec<Vec<usize>>,
    /// The present test, if this test is another test with the same mesh, specimen and quantities: the errors of both
    /// tests are then similar. The expected variances are computed under two assumptions: the errors of both tests are
    /// independent, or all specimens of both tests have the error of the present test. The larger variance of each
    /// parameter is used.
    pub alike: Option<AlikeTest>,
}

/// The present test, whose error a further test may share.
#[derive(Clone, Debug)]
pub struct AlikeTest {
    /// The quantities of the present test, linearised at the same draws as the further test.
    pub draws: Vec<TestAtDraw>,
    /// Covariance S of the error that all specimens share, quantities × quantities.
    pub shared: Vec<Vec<f64>>,
    /// Tested specimens: the indices of the recorded quantities of each specimen.
    pub seen: Vec<Vec<usize>>,
    /// Index in the present test of each quantity of the further test.
    pub quantities: Vec<usize>,
}

impl AlikeTest {
    /// Returns the information of `specimens` specimens of the further test `other` at the draw `k`.
    fn gained(
        &self,
        k: usize,
        other: &TestAtDraw,
        belief: &Belief,
        specimens: usize,
    ) -> Option<DMatrix<f64>> {
        let draw = self.draws.get(k)?;
        let precision = precision_of(&matrix(&draw.scatter), &self.seen)?;
        let present = MeanResponse { jacobian: draw.scaled_jacobian(belief), precision };
        let precision = Cholesky::new(matrix(&other.scatter))?.inverse() * specimens as f64;
        let other = MeanResponse { jacobian: other.scaled_jacobian(belief), precision };
        gained(&present, &other, &matrix(&self.shared), &self.quantities)
    }

    fn check(&self, draws: usize, quantities: usize) -> Result<(), FurtherTestError> {
        let sized = |what, expected: usize, found: usize| match expected == found {
            true => Ok(()),
            false => Err(FurtherTestError::Size { what, expected, found }),
        };
        sized("the list of draws of the present test", draws, self.draws.len())?;
        sized("the list of common quantities", quantities, self.quantities.len())?;
        let most = self.shared.len();
        let largest = self.quantities.iter().chain(self.seen.iter().flatten()).max();
        if let Some(largest) = largest.filter(|largest| **largest >= most) {
            return sized("the shared error of the present test", largest + 1, most);
        }
        self.shared.iter().try_for_each(|row| sized("the shared error", most, row.len()))?;
        for draw in &self.draws {
            sized("the jacobian of the present test", most, draw.jacobian.len())?;
            sized("the scatter of the present test", most, draw.scatter.len())?;
            draw.scatter.iter().try_for_each(|row| sized("the scatter", most, row.len()))?;
        }
        Ok(())
    }
}

/// Expected posterior of one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// Expected contraction: mean over the draws of 1 − posterior variance / prior variance.
    pub contraction: f64,
    /// 5 % and 95 % quantiles of the contraction over the draws; each draw has different parameters and a different
    /// scatter.
    pub range: [f64; 2],
    /// Expected width of the central 90 % interval, in the parameter's unit.
    pub width90: f64,
}

/// Accuracy that is required of one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// Least expected contraction.
    Contraction(f64),
    /// Largest expected width of the central 90 % interval, in the parameter's unit.
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

/// Number of specimens that a goal requires.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Needed {
    /// Smallest number of further specimens; `None` if [`FurtherTest::MOST`] specimens are not enough.
    pub specimens: Option<usize>,
    /// Contraction or interval width (depending on the goal) that is expected for infinitely many
    /// further specimens.
    pub limit: f64,
}

impl FurtherTest {
    /// Largest number of further specimens that is considered.
    pub const MOST: usize = 1000;

    /// Expected posterior of each parameter after the given number of further specimens. The contraction never
    /// decreases with this number.
    ///
    /// # Errors
    /// If the sizes of matrices do not match, or a covariance is not positive definite.
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
        for (k, draw) in self.draws.iter().enumerate() {
            let after = |gained: Option<DMatrix<f64>>| {
                let after = gained.and_then(|gained| belief.after(&gained));
                after.map(|after| after.diagonal()).ok_or(FurtherTestError::Covariance)
            };
            let mut variances = after(self.gained(draw, &shared, belief, specimens))?;
            if let Some(alike) = &self.alike {
                let sharing = after(alike.gained(k, draw, belief, specimens))?;
                variances = variances.zip_map(&sharing, f64::max);
            }
            for (i, &variance) in variances.iter().enumerate() {
                contractions[i].push(1.0 - variance);
                let width = 2.0 * HALF_90 * belief.prior_sd[i] * variance.sqrt();
                // a posterior that fills the bounds of the prior is not normal: its interval is narrower than the
                // interval of a normal distribution with the same variance
                widths[i] += width.min(belief.width90[i]) / self.draws.len() as f64;
            }
        }
        let expectation = |(mut values, width90): (Vec<f64>, f64)| {
            values.sort_by(f64::total_cmp);
            let at = |p: f64| values[(p * (values.len() - 1) as f64).round() as usize];
            let contraction = values.iter().sum::<f64>() / values.len() as f64;
            Expected { contraction, range: [at(0.05), at(0.95)], width90 }
        };
        Ok(contractions.into_iter().zip(widths).map(expectation).collect())
    }

    /// Finds the smallest number of further specimens that meets a goal for the parameter with this index.
    ///
    /// # Errors
    /// The errors of [`Self::expected`].
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

    /// Returns the information that further specimens add to the specimens already tested, in units of the
    /// prior standard deviations.
    fn gained(
        &self,
        draw: &TestAtDraw,
        shared: &DMatrix<f64>,
        belief: &Belief,
        specimens: usize,
    ) -> Option<DMatrix<f64>> {
        let jacobian = draw.scaled_jacobian(belief);
        let scatter = matrix(&draw.scatter);
        let complete =
            self.seen.iter().filter(|recorded| recorded.len() == scatter.nrows()).count();
        let incomplete = self.seen.iter().filter(|recorded| recorded.len() < scatter.nrows());
        let incomplete = precision_of(&scatter, &incomplete.cloned().collect::<Vec<_>>())?;
        let information = |n: usize| -> Option<DMatrix<f64>> {
            if complete == self.seen.len() {
                let covariance: Cholesky<f64, Dyn> = Cholesky::new(&scatter / n as f64 + shared)?;
                return Some(jacobian.transpose() * covariance.solve(&jacobian));
            }
            let precision = &incomplete + Cholesky::new(scatter.clone())?.inverse() * n as f64;
            information(&jacobian, &precision, shared)
        };
        let all = information(complete + specimens)?;
        if self.seen.is_empty() { Some(all) } else { Some(all - information(complete)?) }
    }

    fn check(&self, belief: &Belief) -> Result<(), FurtherTestError> {
        let (quantities, parameters) = (self.shared.len(), belief.prior_sd.len());
        let sized = |what, expected: usize, actual: usize| match expected == actual {
            true => Ok(()),
            false => Err(FurtherTestError::Size { what, expected, found: actual }),
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
        self.alike.as_ref().map_or(Ok(()), |alike| alike.check(self.draws.len(), quantities))
    }
}

#[cfg(test)]
mod nested;
#[cfg(test)]
mod tests;
