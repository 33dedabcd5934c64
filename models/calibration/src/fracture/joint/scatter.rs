//! Scatter of quantities between specimens in a joint model: one covariance for each test, or one for all tests.

use ppl::DomainError;
use ppl::prelude::*;

use super::correlation;

/// Concentration of the LKJ prior of the correlations between the quantities.
const ETA: f64 = 3.0;

/// Quantities with one covariance between specimens, relative to the means of the specimens.
#[derive(Clone, Debug)]
pub(super) struct Scatter {
    /// The test whose specimens scatter; `None` for the specimens of all tests.
    test: Option<String>,
    pub(super) quantities: Vec<String>,
    /// Shapes of the beta distributions of the partial correlations.
    pub(super) shapes: Vec<f64>,
}

impl Scatter {
    /// Creates the scatter of one test, or of all tests (`None`).
    pub(super) fn new(test: Option<String>, quantities: Vec<String>) -> Self {
        let shapes = correlation::shapes(quantities.len(), ETA);
        Self { test, quantities, shapes }
    }

    /// Names of the quantities, with the name of the test.
    pub(super) fn quantity_names(&self) -> impl Iterator<Item = String> {
        self.quantities.iter().map(|name| self.named(name))
    }

    /// Names of the pairs of quantities, in the order of the entries below the diagonal.
    pub(super) fn pair_names(&self) -> impl Iterator<Item = String> {
        self.quantities.iter().enumerate().flat_map(move |(row, first)| {
            let others = self.quantities[..row].iter();
            others.map(move |other| self.named(&format!("{first} {other}")))
        })
    }

    fn named(&self, name: &str) -> String {
        match &self.test {
            Some(test) => format!("{name} ({test})"),
            None => name.to_owned(),
        }
    }
}

/// Place of the quantities of a test in the covariances of the joint model.
#[derive(Clone, Debug)]
pub(super) struct PartOfScatter {
    /// Index of the covariance.
    pub(super) scatter: usize,
    /// Rows of the test's quantities in the covariance.
    pub(super) rows: Vec<usize>,
}

impl PartOfScatter {
    /// Returns the Cholesky factor of the test's rows and columns of a covariance, from the factor of the covariance.
    ///
    /// # Errors
    /// If the part is not positive definite.
    pub(super) fn of<R: Scalar>(
        &self,
        whole: &DynCholeskyFactor<R>,
    ) -> Result<DynCholeskyFactor<R>, DomainError> {
        if self.rows.iter().copied().eq(0..whole.size()) {
            return Ok(whole.clone());
        }
        let covariance = whole.covariance();
        let row = |&i: &usize| self.rows.iter().map(|&j| covariance[i][j]).collect();
        let rows: Vec<Vec<R>> = self.rows.iter().map(row).collect();
        DynCholeskyFactor::of_covariance(&rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_has_the_entries_of_its_rows() {
        let covariance =
            [[4.0, 1.0, -0.5], [1.0, 9.0, 2.0], [-0.5, 2.0, 1.0]].map(Vec::from).to_vec();
        let whole = DynCholeskyFactor::<f64>::of_covariance(&covariance).unwrap();
        for rows in [vec![0, 1, 2], vec![2, 0], vec![1]] {
            let part = PartOfScatter { scatter: 0, rows: rows.clone() }.of(&whole).unwrap();
            for (entries, &i) in part.covariance().iter().zip(&rows) {
                for (entry, &j) in entries.iter().zip(&rows) {
                    assert!((entry - covariance[i][j]).abs() < 1e-12, "{rows:?}: {entry}");
                }
            }
        }
    }

    #[test]
    fn names_have_the_test_of_a_scatter() {
        let quantities = || ["slope", "peak-force"].map(str::to_owned).to_vec();
        let fast = Scatter::new(Some("fast".into()), quantities());
        assert_eq!(
            fast.quantity_names().collect::<Vec<_>>(),
            ["slope (fast)", "peak-force (fast)"]
        );
        assert_eq!(fast.pair_names().collect::<Vec<_>>(), ["peak-force slope (fast)"]);
        let pooled = Scatter::new(None, quantities());
        assert_eq!(pooled.pair_names().collect::<Vec<_>>(), ["peak-force slope"]);
    }
}
