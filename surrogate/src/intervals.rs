//! Intervals of Sobol indices, from expansions that the runs allow.

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::coefficients::CoefficientPosterior;
use crate::error::SurrogateError;
use crate::sobol::SobolIndices;

/// Draws of the coefficients, and points of the quadrature on logarithmic scales for each of them: what
/// a quadrature errs by cancels, since draws and estimate have the same.
const DRAWS: usize = 400;
const MOST_POINTS: usize = 1 << 14;

/// The ends of intervals of Sobol indices, each as `[lower, upper]`.
///
/// An index is a sum of squares, which errors of coefficients make larger: that of the estimate once, those of
/// draws twice. An interval is therefore the estimate less what the draws differ from it by, cut
/// to 0 … 1 (the basic interval of Davison & Hinkley, *Bootstrap Methods and their Application*, 1997,
/// section 5.2): that the estimate is too large moves it down.
#[derive(Clone, Debug, PartialEq)]
pub struct SobolIntervals {
    /// `first[m][i]`: of output m by input i alone.
    pub first: Vec<Vec<[f64; 2]>>,
    /// `total[m][i]`: by all in which input i takes part.
    pub total: Vec<Vec<[f64; 2]>>,
}

impl CoefficientPosterior {
    /// Central intervals of a probability; the same seed gives the same ones. NaN where an index is.
    ///
    /// # Errors
    /// As [`Self::draw`]; a probability that is not between 0 and 1.
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
        let interval = |of: &dyn Fn(&SobolIndices) -> f64| {
            let mut moved: Vec<f64> = draws.iter().map(|draw| of(draw) - of(&alike)).collect();
            moved.sort_by(f64::total_cmp);
            let tail = 0.5 * (1.0 - probability) * (DRAWS - 1) as f64;
            let (low, high) = (moved[tail as usize], moved[DRAWS - 1 - tail as usize]);
            // a NaN stays one
            [of(&exact) - high, of(&exact) - low].map(|x| x.clamp(0.0, 1.0))
        };
        let (outputs, inputs) = (self.estimate().outputs().len(), self.estimate().inputs().len());
        let all = |of: &dyn Fn(&SobolIndices, usize, usize) -> f64| {
            let row = |m| (0..inputs).map(|i| interval(&|s| of(s, m, i))).collect();
            (0..outputs).map(row).collect()
        };
        Ok(SobolIntervals {
            first: all(&|s, m, i| s.first[m][i]),
            total: all(&|s, m, i| s.total[m][i]),
        })
    }
}
