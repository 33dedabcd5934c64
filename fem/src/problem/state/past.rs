//! Extrapolation of past equilibria to the initial guess of the next increment, by a cubic polynomial in time through
//! the last four equilibria.
//!
//! The polynomial has Newton's form, and terms are added as long as they decrease. After a jump or a kink the terms do
//! not decrease: the equilibria are then not a smooth function of time, and a polynomial of higher order would
//! oscillate.

use serde::{Deserialize, Serialize};

use crate::fields::Fields;
use crate::problem::control::is_later;

/// Number of equilibria, in addition to the last equilibrium, that define the extrapolating polynomial.
const MOST: usize = 3;
/// Largest allowed ratio of a term of the extrapolating polynomial to the previous term. For ratios between 0.3 and 1,
/// the number of Newton iterations of a run varies by less than a tenth. With a ratio of 1, a jump would be
/// extrapolated as a smooth curve.
const FALL: f64 = 0.75;

/// Changes of the fields over the last increments, and the increments of the clock (fractions of the duration).
/// Both lists begin with the newest increment.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Past {
    changes: Vec<Fields>,
    steps: Vec<f64>,
}

impl Past {
    /// Adds the change of the fields over an increment of the clock.
    pub(crate) fn add(&mut self, change: Fields, step: f64) {
        self.changes.insert(0, change);
        self.steps.insert(0, step);
        self.changes.truncate(MOST);
        self.steps.truncate(MOST);
    }

    /// Returns the last increment of the clock; `None` before the first increment.
    pub(crate) fn step(&self) -> Option<f64> {
        self.steps.first().copied()
    }

    /// Returns the change of the fields over the last increment; `None` before the first increment.
    pub(crate) fn change(&self) -> Option<&Fields> {
        self.changes.first()
    }

    /// Applies a function to the changes of all increments, for example to select the nodes of one rank.
    pub(crate) fn map(&self, convert: impl Fn(&Fields) -> Fields) -> Self {
        Self { changes: self.changes.iter().map(convert).collect(), steps: self.steps.clone() }
    }

    /// Extrapolates `fields`, the last equilibrium, by an increment `ahead` of the clock. Only increments after the
    /// last change of speed of the load (corner) are used. `since_corner` is the time from this corner to the last
    /// equilibrium. `size` returns the norms of the displacement and of the damage in a term of the extrapolating
    /// polynomial.
    pub(crate) fn continue_by(
        &self,
        ahead: f64,
        since_corner: f64,
        fields: &mut Fields,
        size: impl Fn(&Fields) -> [f64; 2],
    ) {
        // do not use increments before the last change of direction of the clock either
        let mut passed = 0.0;
        let is_smooth = |step: &&f64| {
            passed += **step;
            **step * ahead > 0.0 && !is_later(passed, since_corner)
        };
        let onwards = self.steps.iter().take_while(is_smooth).count();
        let steps = &self.steps[..onwards.max(1).min(self.steps.len())];
        let mut last = [f64::INFINITY; 2];
        for multiples in terms(steps, ahead) {
            let mut term = Fields::zero(fields.damage.len());
            for (change, multiple) in self.changes.iter().zip(multiples) {
                term.add_scaled(multiple, change);
            }
            let size = size(&term);
            if size[0] > FALL * last[0] || size[1] > FALL * last[1] {
                break;
            }
            last = size;
            fields.add_scaled(1.0, &term);
        }
    }
}

/// Returns the terms of Newton's polynomial. Each term is a linear combination of the changes of the fields over
/// `steps`, and is given by its coefficients.
fn terms(steps: &[f64], ahead: f64) -> Vec<Vec<f64>> {
    let slope = |k: usize| (0..steps.len()).map(|j| f64::from(j == k) / steps[k]).collect();
    let mut differences: Vec<Vec<f64>> = (0..steps.len()).map(slope).collect();
    let (mut reach, mut factor, mut out) = (ahead, ahead, Vec::new());
    for order in 1..=steps.len() {
        out.push(differences[0].iter().map(|difference| factor * difference).collect());
        let next = |(k, pair): (usize, &[Vec<f64>])| {
            let span: f64 = steps[k..=k + order].iter().sum();
            pair[0].iter().zip(&pair[1]).map(|(new, old)| (new - old) / span).collect()
        };
        differences = differences.windows(2).enumerate().map(next).collect();
        reach += steps[order - 1];
        factor *= reach;
    }
    out
}

#[cfg(test)]
#[path = "../../../tests/unit/past.rs"]
mod tests;
