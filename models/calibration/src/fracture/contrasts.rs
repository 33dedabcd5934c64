//! Rows of specimens that scatter alike, taken apart into what differs between them and what they share.

use ppl::prelude::*;

/// Specimens with one covariance.
#[derive(Clone, Debug, Default)]
pub(super) struct Group {
    pub(super) rows: Vec<Vec<f64>>,
    /// n − 1 contrasts between them.
    pub(super) contrasts: Vec<Vec<f64>>,
    /// √n times their mean; empty without specimens.
    pub(super) total: Vec<f64>,
}

impl Group {
    pub(super) fn of(rows: Vec<Vec<f64>>) -> Self {
        let (contrasts, total) = helmert(&rows);
        Self { rows, contrasts, total }
    }

    pub(super) fn len(&self) -> usize {
        self.rows.len()
    }
}

/// Helmert's orthogonal transform of rows: contrasts √(j/(j+1)) (mean of the first j − row j + 1), and
/// √n times the mean.
pub(super) fn helmert<R: Scalar>(rows: &[Vec<R>]) -> (Vec<Vec<R>>, Vec<R>) {
    let Some((first, others)) = rows.split_first() else { return (Vec::new(), Vec::new()) };
    let mut mean = first.clone();
    let mut contrasts = Vec::with_capacity(others.len());
    for (j, row) in (1..).zip(others) {
        let j = f64::from(j);
        let weight = (j / (j + 1.0)).sqrt();
        contrasts.push(mean.iter().zip(row).map(|(&m, &x)| (m - x) * weight).collect());
        mean.iter_mut().zip(row).for_each(|(m, &x)| *m = *m + (x - *m) / (j + 1.0));
    }
    let root = (rows.len() as f64).sqrt();
    (contrasts, mean.iter().map(|&m| m * root).collect())
}
