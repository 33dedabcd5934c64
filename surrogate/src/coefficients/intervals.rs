//! Intervals of Sobol indices from draws of the coefficients.

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::coefficients::posterior::CoefficientPosterior;
use crate::error::SurrogateError;
use crate::sobol::SobolIndices;

/// Number of draws of the coefficients from their posterior.
const DRAWS: usize = 400;
/// Largest number of quadrature points per draw on logarithmic scales. Draws and estimate use the same
/// quadrature points, so that the quadrature error cancels in their difference.
const MOST_POINTS: usize = 1 << 14;

/// Intervals of Sobol indices, each as `[lower, upper]`.
///
/// A Sobol index is a sum of squares of coefficients, which is biased upwards by errors of the coefficients. The
/// index of the estimated expansion contains these errors once. The index of an expansion that is drawn from the
/// posterior contains these errors twice. The interval is therefore the basic interval (Davison & Hinkley, *Bootstrap
/// Methods and their Application*, 1997, section 5.2): the estimate minus the quantiles of draw − estimate, clamped
/// to [0, 1]. An upward bias of the estimate moves the interval down.
#[derive(Clone, Debug, PartialEq)]
pub struct SobolIntervals {
    /// `first[m][i]`: first-order index of output m and input i.
    pub first: Vec<Vec<[f64; 2]>>,
    /// `total[m][i]`: total index of output m and input i.
    pub total: Vec<Vec<[f64; 2]>>,
}

impl CoefficientPosterior {
    /// Computes central intervals of the given probability for all Sobol indices. The same seed gives the same
    /// intervals. If an index is NaN, its interval is NaN.
    ///
    /// # Errors
    /// The errors of [`Self::draw`], and an error if the probability is not between 0 and 1.
    ///
    /// ```
    /// use surrogate::{Dataset, DesignMethod, DynPce, FitOptions, Input};
    /// let inputs = vec![Input::new("a", 0.0, 1.0)?, Input::new("b", 0.0, 1.0)?];
    /// let mut runs = Dataset::new(inputs.clone(), vec!["f".into()], "closed form")?;
    /// for x in DesignMethod::Sobol.sample(&inputs, 32, 1)? {
    ///     runs.push(&x, &[(x[0] + x[1]).exp()])?;
    /// }
    /// let fit = DynPce::fit(&runs, &FitOptions::default())?;
    /// let intervals = fit.coefficients.sobol_intervals(0.9, 1)?;
    /// let [low, high] = intervals.first[0][0];
    /// let index = fit.pce.sobol().first[0][0];
    /// assert!(low <= index && index <= high && high - low < 0.01);
    /// # Ok::<(), surrogate::SurrogateError>(())
    /// ```
    pub fn sobol_intervals(
        &self,
        probability: f64,
        seed: u64,
    ) -> Result<SobolIntervals, SurrogateError> {
        if !(probability > 0.0 && probability < 1.0) {
            let (option, value) = ("probability of an interval", probability.to_string());
            return Err(SurrogateError::Option {
                option,
                value,
                allowed: "between 0 and 1".into(),
            });
        }
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let draws = (0..DRAWS)
            .map(|_| Ok(self.draw(&mut rng)?.sobol_with(MOST_POINTS)))
            .collect::<Result<Vec<SobolIndices>, SurrogateError>>()?;
        let (exact, alike) = (self.estimate().sobol(), self.estimate().sobol_with(MOST_POINTS));
        let interval = |index: &dyn Fn(&SobolIndices) -> f64| {
            let mut moved: Vec<f64> =
                draws.iter().map(|draw| index(draw) - index(&alike)).collect();
            moved.sort_by(f64::total_cmp);
            let tail = 0.5 * (1.0 - probability) * (DRAWS - 1) as f64;
            let (low, high) = (moved[tail as usize], moved[DRAWS - 1 - tail as usize]);
            // `clamp` keeps NaN
            [index(&exact) - high, index(&exact) - low].map(|x| x.clamp(0.0, 1.0))
        };
        let (outputs, inputs) = (self.estimate().outputs().len(), self.estimate().inputs().len());
        let all = |index: &dyn Fn(&SobolIndices, usize, usize) -> f64| {
            let row = |m| (0..inputs).map(|i| interval(&|s| index(s, m, i))).collect();
            (0..outputs).map(row).collect()
        };
        Ok(SobolIntervals {
            first: all(&|s, m, i| s.first[m][i]),
            total: all(&|s, m, i| s.total[m][i]),
        })
    }
}
