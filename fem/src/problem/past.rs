//! The equilibria before the last one, and what they foretell: the next increment is started where a cubic
//! in time through the last four leads.
//!
//! The polynomial is Newton's, whose terms are added as long as they fall. Where they do not, as behind a
//! jump or a kink, the equilibria are no smooth function of time and a higher order would only swing.

use serde::{Deserialize, Serialize};

use crate::fields::Fields;

/// Equilibria beside the last that the polynomial goes through.
const MOST: usize = 3;
/// The most that a term is of the one before it. From 0.3 to 1 iterations differ by less than a tenth; with 1
/// a jump would be taken for a curve.
const FALL: f64 = 0.75;

/// Changes of the fields over the last increments, and these increments of the clock; the newest first.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Past {
    changes: Vec<Fields>,
    steps: Vec<f64>,
}

impl Past {
    /// Takes up the change over one more increment.
    pub(super) fn add(&mut self, change: Fields, step: f64) {
        self.changes.insert(0, change);
        self.steps.insert(0, step);
        self.changes.truncate(MOST);
        self.steps.truncate(MOST);
    }

    /// The last increment; `None` before the first.
    pub(super) fn step(&self) -> Option<f64> {
        self.steps.first().copied()
    }

    /// The same of other nodes.
    pub(super) fn map(&self, of: impl Fn(&Fields) -> Fields) -> Self {
        Self { changes: self.changes.iter().map(of).collect(), steps: self.steps.clone() }
    }

    /// Moves the fields, those of the last equilibrium, to where they are `ahead` of it; `size` tells the
    /// size of displacement and damage in a term.
    pub(super) fn continue_by(
        &self,
        ahead: f64,
        fields: &mut Fields,
        size: impl Fn(&Fields) -> [f64; 2],
    ) {
        // from where the clock has turned on there is no function of time
        let onwards = self.steps.iter().take_while(|&step| step * ahead > 0.0).count();
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

/// The terms of Newton's polynomial, each as multiples of the changes over these steps.
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
#[path = "../../tests/unit/past.rs"]
mod tests;
