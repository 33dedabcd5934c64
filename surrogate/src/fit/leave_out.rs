//! Leave-one-run-out errors from a single fit. All rows of a run are left out together.

use faer::Mat;

/// Smallest accepted pivot in the factorisation of I − H_bb, where H_bb is the block of the hat matrix of one run. A
/// smaller pivot is mostly rounding error and means that the other runs alone do not determine the coefficients.
const DETERMINED: f64 = 1e-10;

/// The least squares fit of the first `terms` columns of the basis to the rows of all runs. The first `runs`
/// rows are the values; the rows of the derivatives follow, run after run.
pub(crate) struct Prefix {
    pub(crate) terms: usize,
    pub(crate) runs: usize,
    /// Residuals y − f of the fit f to the targets y, with the weights of the rows; rows × outputs.
    pub(crate) residuals: Mat<f64>,
    /// Block H_bb = Q_b Q_bᵀ of the hat matrix for each run b, where Q_b contains the rows of run b of the orthonormal
    /// factor Q of the basis matrix. Within a block, the derivatives are first and the value is last.
    pub(crate) hat: Vec<f64>,
    /// Trace of (ΨᵀΨ)⁻¹ for the basis matrix Ψ. With the factorisation Ψ = Q R, the trace equals
    /// |R⁻¹|²_F.
    pub(crate) trace: f64,
}

/// Returns the index, among all rows, of one row of a run. A run has `block` rows: the rows of its derivatives, and
/// last the row of its value. `row_in_block` is the position of the row among the rows of the run.
#[inline]
pub(crate) fn row_of(runs: usize, block: usize, run: usize, row_in_block: usize) -> usize {
    if row_in_block + 1 == block { run } else { runs + run * (block - 1) + row_in_block }
}

impl Prefix {
    /// Number of rows per run.
    fn block(&self) -> usize {
        self.residuals.nrows() / self.runs
    }

    /// Returns the sum, over all runs, of the leverage of row `row_in_block` of the run.
    pub(crate) fn leverage_at(&self, row_in_block: usize) -> f64 {
        let block = self.block();
        self.hat.chunks(block * block).map(|hat| hat[row_in_block * (block + 1)]).sum()
    }

    /// Iterates over the leverages h_i of the value rows, one per run.
    pub(crate) fn leverages(&self) -> impl Iterator<Item = f64> {
        let size = self.block().pow(2);
        self.hat.chunks(size).map(move |hat| hat[size - 1])
    }

    /// Degrees of freedom of the residuals of the value rows (not of the derivatives): N − P for N runs and P terms
    /// without derivatives. With derivatives, the degrees of freedom are N minus the sum of the leverages of the
    /// values, because the derivatives determine a part of the coefficients.
    pub(crate) fn freedom(&self) -> f64 {
        match self.block() {
            1 => (self.runs - self.terms) as f64,
            block => self.runs as f64 - self.leverage_at(block - 1),
        }
    }

    /// Returns the residuals of the value rows, runs × outputs.
    pub(crate) fn value_residuals(&self) -> Mat<f64> {
        self.residuals.get(..self.runs, ..).to_owned()
    }

    /// Returns the leave-one-run-out residuals (rows × outputs): the residuals of each run b in the fit to all other
    /// runs. These residuals are (I − H_bb)⁻¹ r_b with the residuals r_b of run b in the fit to all runs and the block
    /// H_bb of the hat matrix. None if a single run alone determines a coefficient.
    pub(crate) fn left_out(&self) -> Option<Mat<f64>> {
        let (block, outputs) = (self.block(), self.residuals.ncols());
        let mut left_out = self.residuals.clone();
        let mut factor = vec![0.0; block * block];
        for (run, hat) in self.hat.chunks(block * block).enumerate() {
            factorise(hat, block, &mut factor)?;
            let row = |row_in_block| row_of(self.runs, block, run, row_in_block);
            for m in 0..outputs {
                for a in 0..block {
                    for b in 0..a {
                        left_out[(row(a), m)] -= factor[a * block + b] * left_out[(row(b), m)];
                    }
                }
                for a in (0..block).rev() {
                    left_out[(row(a), m)] /= factor[a * block + a];
                    for b in a + 1..block {
                        left_out[(row(a), m)] -= factor[b * block + a] * left_out[(row(b), m)];
                    }
                }
            }
        }
        Some(left_out)
    }

    /// Returns the leave-one-run-out residuals of the value rows, runs × outputs.
    pub(crate) fn loo_residuals(&self) -> Option<Mat<f64>> {
        Some(self.left_out()?.get(..self.runs, ..).to_owned())
    }

    /// Chapelle's correction factor N/(N − P) · (1 + tr (ΨᵀΨ)⁻¹) of the leave-one-out error for N runs, P terms and the
    /// basis matrix Ψ. N − P is [`Self::freedom`].
    pub(crate) fn correction(&self) -> f64 {
        self.runs as f64 / self.freedom() * (1.0 + self.trace)
    }
}

/// Factorises I − H = L D Lᵀ for the block H = `hat` of one run. Writes L below the diagonal and D on the diagonal of
/// `factor`. None if a pivot is below [`DETERMINED`].
fn factorise(hat: &[f64], block: usize, factor: &mut [f64]) -> Option<()> {
    for a in 0..block {
        for b in 0..=a {
            let identity = if a == b { 1.0 } else { 0.0 };
            let subtracted: f64 = (0..b)
                .map(|c| factor[a * block + c] * factor[b * block + c] * factor[c * block + c])
                .sum();
            let entry = identity - hat[a * block + b] - subtracted;
            if a > b {
                factor[a * block + b] = entry / factor[b * block + b];
            } else if entry > DETERMINED {
                factor[a * block + a] = entry;
            } else {
                return None;
            }
        }
    }
    Some(())
}
