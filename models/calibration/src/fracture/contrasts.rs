//! Groups of specimens with the same covariance, whose quantities are transformed into contrasts (the differences
//! between specimens) and a total (√n times the mean of n specimens).

use ppl::prelude::*;

/// Whether the inputs of a specimen are known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Known,
    Unknown,
}

/// Group of n specimens with the same covariance: specimens of one kind with the same recorded quantities.
#[derive(Clone, Debug)]
pub(super) struct Group {
    pub(super) kind: Kind,
    /// Indices of the recorded quantities, in ascending order.
    pub(super) recorded: Vec<usize>,
    /// Positions of the specimens among all specimens of their kind.
    pub(super) places: Vec<usize>,
    /// Recorded quantities, one row per specimen.
    pub(super) rows: Vec<Vec<f64>>,
    /// The n − 1 contrasts between the specimens.
    pub(super) contrasts: Vec<Vec<f64>>,
    /// √n times the mean of the rows.
    pub(super) total: Vec<f64>,
}

impl Group {
    /// Splits specimens into groups, in the order of the first specimen of each group; specimens with known inputs come
    /// first. `rows` are the quantities of the specimens; a quantity that was not recorded is NaN. A specimen without
    /// recorded quantities belongs to no group.
    pub(super) fn of_each(rows: &[Vec<f64>], is_known: &[bool]) -> Vec<Self> {
        let mut groups: Vec<Self> = Vec::new();
        for kind in [Kind::Known, Kind::Unknown] {
            let of_kind = rows.iter().zip(is_known).filter(|(_, own)| Kind::of(**own) == kind);
            for (place, (row, _)) in of_kind.enumerate() {
                let recorded = recorded(row);
                if recorded.is_empty() {
                    continue;
                }
                let values = recorded.iter().map(|&m| row[m]).collect();
                let same = |group: &&mut Self| group.kind == kind && group.recorded == recorded;
                match groups.iter_mut().find(same) {
                    Some(group) => {
                        group.places.push(place);
                        group.rows.push(values);
                    }
                    None => groups.push(Self {
                        kind,
                        recorded,
                        places: vec![place],
                        rows: vec![values],
                        contrasts: Vec::new(),
                        total: Vec::new(),
                    }),
                }
            }
        }
        for group in &mut groups {
            (group.contrasts, group.total) = helmert(&group.rows);
        }
        groups
    }

    pub(super) fn len(&self) -> usize {
        self.rows.len()
    }

    /// Returns the components of `values` that are recorded.
    pub(super) fn part<R: Copy>(&self, values: &[R]) -> Vec<R> {
        self.recorded.iter().map(|&m| values[m]).collect()
    }
}

impl Kind {
    pub(super) fn of(is_known: bool) -> Self {
        if is_known { Self::Known } else { Self::Unknown }
    }
}

/// Indices of the quantities of a specimen that were recorded.
pub(super) fn recorded(row: &[f64]) -> Vec<usize> {
    (0..row.len()).filter(|&m| !row[m].is_nan()).collect()
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
