//! Sequential design: chooses further runs that reduce the error of the fit most at given points, such as
//! posterior draws.

use crate::coefficients::posterior::{CoefficientPosterior, dot};
use crate::error::SurrogateError;

impl CoefficientPosterior {
    /// Chooses `count` of the points `places` for further runs and returns their indices. Each choice minimises the
    /// variance of the fit, averaged over all points, given the points that have already been chosen. A point is
    /// chosen at most once.
    ///
    /// A run at x reduces the leverage ψᵀAψ at another point by (ψᵀAψ_x)²/(1 + h(x)), with A = (ΨᵀΨ)⁻¹, where ψ and
    /// ψ_x are the values of the basis polynomials at the other point and at x (Cohn, *Neural networks* 9 (1996)
    /// 1071, doi:10.1016/0893-6080(95)00137-9). If the points are draws from a posterior, the average is over the
    /// posterior: runs are chosen where the posterior has most of its mass. The chosen points are not close to each
    /// other, because, after a run, a second run at a nearby point is less useful.
    ///
    /// # Errors
    /// If a point lies outside the box by more than the tolerance.
    ///
    /// ```
    /// use surrogate::{Dataset, DynPce, FitOptions, Input, OrderRule};
    /// let mut runs = Dataset::new(vec![Input::new("a", -1.0, 1.0)?], vec!["f".into()], "")?;
    /// for x in [-0.5, -0.1, 0.0, 0.1] {
    ///     runs.push(&[x], &[x * x])?;
    /// }
    /// let line = FitOptions { rule: OrderRule::Fixed(1), ..FitOptions::default() };
    /// let fit = DynPce::fit(&runs, &line)?;
    /// // the variance of the fitted line is largest at the right end of the interval, far from the runs
    /// let places: Vec<Vec<f64>> = (0..=10).map(|i| vec![0.1 * f64::from(i)]).collect();
    /// assert_eq!(fit.coefficients.placement(&places, 1)?, [10]);
    /// # Ok::<(), surrogate::SurrogateError>(())
    /// ```
    pub fn placement(
        &self,
        places: &[Vec<f64>],
        count: usize,
    ) -> Result<Vec<usize>, SurrogateError> {
        // w = Fᵀψ at each point, with the factor F of the posterior and the values ψ of the basis polynomials;
        // leverages and covariances are products of these vectors
        let mut w: Vec<Vec<f64>> =
            places.iter().map(|x| self.projection(x)).collect::<Result<_, _>>()?;
        let mut chosen: Vec<usize> = Vec::new();
        while chosen.len() < count.min(places.len()) {
            let gains = moments(&w).map(|moments| {
                let gain = |w: &Vec<f64>| quadratic(&moments, w) / (1.0 + dot(w, w));
                w.iter().map(gain).collect::<Vec<f64>>()
            });
            let Some(gains) = gains else { break };
            let free = (0..places.len()).filter(|point| !chosen.contains(point));
            // `max_by` returns the last of several equal gains; because of `rev`, this is the gain with the smallest
            // index
            let best = free.rev().max_by(|&a, &b| gains[a].total_cmp(&gains[b]));
            let Some(best) = best else { break };
            chosen.push(best);
            // a further run with w = Fᵀψ and the leverage h = |w|² changes A = F Fᵀ to A − Aψψᵀ A/(1 + h). The factor
            // of the new matrix is F (I − κ w wᵀ) with (1 − κ h)² = 1/(1 + h)
            let w_best = w[best].clone();
            let h = dot(&w_best, &w_best);
            let shrink = if h > 0.0 { (1.0 - (1.0 + h).sqrt().recip()) / h } else { 0.0 };
            for w in &mut w {
                let along = shrink * dot(w, &w_best);
                w.iter_mut().zip(&w_best).for_each(|(w, b)| *w -= along * b);
            }
        }
        Ok(chosen)
    }
}

/// Returns Σ w wᵀ over all vectors; None if there are no vectors.
fn moments(w: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let size = w.first()?.len();
    let mut sum = vec![vec![0.0; size]; size];
    for w in w {
        for (row, a) in sum.iter_mut().zip(w) {
            row.iter_mut().zip(w).for_each(|(entry, b)| *entry += a * b);
        }
    }
    Some(sum)
}

fn quadratic(matrix: &[Vec<f64>], x: &[f64]) -> f64 {
    matrix.iter().zip(x).map(|(row, x_i)| x_i * dot(row, x)).sum()
}
