//! Transforms the quantities of specimens with the same covariance into contrasts (the differences between specimens)
//! and a total (√n times the mean of n specimens).

use ppl::prelude::*;

/// Group of n specimens with the same covariance.
#[derive(Clone, Debug, Default)]
pub(super) struct Group {
    pub(super) rows: Vec<Vec<f64>>,
    /// The n − 1 contrasts between the specimens.
    pub(super) contrasts: Vec<Vec<f64>>,
    /// √n times the mean of the rows; empty if there are no specimens.
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

/// Applies Helmert's orthogonal transform to n rows. Returns two results: the n − 1 contrasts √(j/(j+1)) (m_j −
/// y_(j+1)), where y_j is row j and m_j the mean of the first j rows; and √n times the mean of all rows.
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
