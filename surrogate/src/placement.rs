//! Where more runs help most: near places that matter, such as draws of a posterior.

use crate::coefficients::{CoefficientPosterior, dot};
use crate::error::SurrogateError;

impl CoefficientPosterior {
    /// `count` of the places, as indices, at which further runs leave the least of the fit's variance,
    /// averaged over all places; the first is the best alone, each next one the best beside those before.
    ///
    /// A run at x takes (ψᵀAψ_x)²/(1 + h(x)) from the leverage ψᵀAψ, A = (ΨᵀΨ)⁻¹ (Cohn, *Neural
    /// networks* 9 (1996) 1071, doi:10.1016/0893-6080(95)00137-9). Where places are draws of a posterior, the
    /// average is over it: runs lie where it lives, and apart, since one makes others beside it
    /// worth less. A place is chosen once.
    ///
    /// # Errors
    /// A place outside the box by more than the tolerance.
    ///
    /// ```
    /// use surrogate::{Dataset, DynPce, FitOptions, Input, OrderRule};
    /// let mut runs = Dataset::new(vec![Input::new("a", -1.0, 1.0)?], vec!["f".into()], "")?;
    /// for x in [-0.5, -0.1, 0.0, 0.1] {
    ///     runs.push(&[x], &[x * x])?;
    /// }
    /// let line = FitOptions { rule: OrderRule::Fixed(1), ..FitOptions::default() };
    /// let fit = DynPce::fit(&runs, &line)?;
    /// // where a line is to be known at the right, its right end is known worst
    /// let places: Vec<Vec<f64>> = (0..=10).map(|i| vec![0.1 * f64::from(i)]).collect();
    /// assert_eq!(fit.coefficients.placement(&places, 1)?, [10]);
    /// # Ok::<(), surrogate::SurrogateError>(())
    /// ```
    pub fn placement(
        &self,
        places: &[Vec<f64>],
        count: usize,
    ) -> Result<Vec<usize>, SurrogateError> {
        // w = Fᵀψ: leverages and covariances are products of these
        let mut w: Vec<Vec<f64>> =
            places.iter().map(|x| self.projection(x)).collect::<Result<_, _>>()?;
        let mut chosen: Vec<usize> = Vec::new();
        while chosen.len() < count.min(places.len()) {
            let gains = moments(&w).map(|moments| {
                let of = |w: &Vec<f64>| quadratic(&moments, w) / (1.0 + dot(w, w));
                w.iter().map(of).collect::<Vec<f64>>()
            });
            let Some(gains) = gains else { break };
            let free = (0..places.len()).filter(|place| !chosen.contains(place));
            // the first of equals
            let best = free.rev().max_by(|&a, &b| gains[a].total_cmp(&gains[b]));
            let Some(best) = best else { break };
            chosen.push(best);
            // A − Aψψᵀ A/(1 + h) has the factor F (I − κ w wᵀ) with (1 − κ h)² = 1/(1 + h)
            let own = w[best].clone();
            let h = dot(&own, &own);
            let shrink = if h > 0.0 { (1.0 - (1.0 + h).sqrt().recip()) / h } else { 0.0 };
            for w in &mut w {
                let along = shrink * dot(w, &own);
                w.iter_mut().zip(&own).for_each(|(w, own)| *w -= along * own);
            }
        }
        Ok(chosen)
    }
}

/// Σ w wᵀ over the places; none without places.
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
