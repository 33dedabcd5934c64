//! Rows as a loop tells them, and what stands for them.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector};

use super::{Group, Rows};
use crate::dot::Numbers;

/// An observation: where its unknowns stand, their coefficients, and its datum.
#[derive(Debug, Default)]
pub struct NewRow {
    /// Indices of unknowns.
    place: Vec<usize>,
    numbers: Vec<f64>,
    /// What the mean has besides.
    offset: f64,
    refused: bool,
}

impl NewRow {
    /// An index of an unknown; `usize::MAX` for what cannot tell groups apart.
    pub fn index(&mut self, index: usize) {
        self.refused |= index == usize::MAX;
        self.place.push(index);
    }

    /// The next coefficient; NaN for what is no number.
    pub fn coefficient(&mut self, coefficient: f64) {
        self.numbers.push(coefficient);
    }

    /// The coefficients of these unknowns.
    pub fn dot(&mut self, factor: f64, data: &[f64], unknowns: &(impl Numbers + ?Sized)) {
        self.refused |= data.len() != unknowns.numbers().len();
        self.numbers.extend(data.iter().map(|number| factor * number));
    }

    /// A part of the mean without unknowns.
    pub fn offset(&mut self, offset: f64) {
        self.offset += offset;
    }

    /// The datum, as written to a record: one number.
    pub(crate) fn datum(&mut self, datum: &[f64]) {
        match datum {
            &[datum] => self.numbers.push(datum - self.offset),
            _ => self.refused = true,
        }
    }
}

/// The rows that a loop has told so far.
#[derive(Debug, Default)]
pub(crate) struct Collected {
    /// Numbers in a row, once there is one.
    width: usize,
    /// Groups by the places of their unknowns.
    found: HashMap<Vec<usize>, usize>,
    groups: Vec<Gathered>,
    observed: usize,
    /// What rows can no longer tell of Σ x².
    squares: f64,
    refused: bool,
}

#[derive(Debug)]
struct Gathered {
    /// The iteration that came first.
    first: usize,
    numbers: Vec<f64>,
}

impl Collected {
    /// Nothing can stand for the observations of this loop.
    pub(crate) fn refuse(&mut self) {
        self.refused = true;
    }

    pub(crate) fn push(&mut self, row: NewRow) {
        let width = row.numbers.len();
        if self.observed == 0 {
            self.width = width;
        }
        self.refused |= row.refused || width != self.width;
        self.refused |= row.numbers.iter().any(|number| !number.is_finite());
        if self.refused {
            return;
        }
        let first = self.observed;
        self.observed += 1;
        let number = *self.found.entry(row.place).or_insert(self.groups.len());
        if number == self.groups.len() {
            self.groups.push(Gathered { first, numbers: Vec::new() });
        }
        let numbers = &mut self.groups[number].numbers;
        numbers.extend(row.numbers);
        if numbers.len() > 8 * width * (width + 8) {
            self.squares += compress(numbers, width);
        }
    }

    /// What stands for all rows, if it is much less.
    pub(crate) fn finish(mut self) -> Option<Rows> {
        if self.refused || self.observed == 0 {
            return None;
        }
        let (mut groups, mut all, mut next) = (Vec::new(), Vec::new(), 0);
        for Gathered { first, numbers } in &mut self.groups {
            self.squares += compress(numbers, self.width);
            if numbers.is_empty() {
                continue;
            }
            groups.push(Group { gap: *first - next, rows: numbers.len() / self.width });
            next = *first + 1;
            all.append(numbers);
        }
        let (rows, observed) = ((all.len() / self.width) as f64, self.observed as f64);
        (rows < 0.7 * observed).then(|| Rows {
            width: self.width,
            groups: groups.into(),
            numbers: all.into(),
            rest: [observed - rows, 0.0, self.squares],
        })
    }
}

/// Replaces rows by as many as their coefficients have dimensions; returns what the squares of
/// the data lose by that.
fn compress(numbers: &mut Vec<f64>, width: usize) -> f64 {
    let (count, unknowns) = (numbers.len() / width, width - 1);
    let mut coefficients = DMatrix::from_fn(count, unknowns, |i, k| numbers[i * width + k]);
    let mut data = DVector::from_fn(count, |i, _| numbers[i * width + unknowns]);
    // in units of the columns: what depends on the others is seen whatever their sizes
    let mut sizes = vec![1.0; unknowns];
    for (mut column, size) in coefficients.column_iter_mut().zip(&mut sizes) {
        let norm = column.norm();
        if norm > 0.0 {
            *size = norm;
            column /= norm;
        }
    }
    let factors = coefficients.col_piv_qr();
    factors.q_tr_mul(&mut data);
    let mut rows = factors.r();
    let least = count.max(unknowns) as f64 * f64::EPSILON * rows.get(0).map_or(0.0, |r| r.abs());
    let rank = (0..rows.nrows()).take_while(|&i| rows[(i, i)].abs() > least).count();
    factors.p().inv_permute_columns(&mut rows);
    numbers.clear();
    for (row, datum) in rows.row_iter().zip(data.iter()).take(rank) {
        numbers.extend(row.iter().zip(&sizes).map(|(number, size)| number * size));
        numbers.push(*datum);
    }
    data.rows(rank, count - rank).norm_squared()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ‖y − C u‖² before and after, with columns that depend on one another and more rows than are
    /// kept at a time.
    #[test]
    fn squares_of_residuals_are_the_same() {
        let (width, count) = (5, 1000);
        let wave = |i: usize, k: usize| (0.3 + i as f64 * (0.9 + 0.37 * k as f64)).sin();
        let row = |i: usize| {
            [1.0, wave(i, 0), 2.0 - 3.0 * wave(i, 0), 1e-18 * wave(i, 1), 50.0 + wave(i, 2)]
        };
        let mut collected = Collected::default();
        for i in 0..count {
            let [a, b, c, d, y] = row(i);
            let mut new = NewRow::default();
            new.coefficient(a);
            new.dot(2.0, &[b / 2.0, c / 2.0], &[crate::Real(0.0), crate::Real(0.0)]);
            new.coefficient(d);
            new.offset(0.5);
            new.offset(1.5);
            new.datum(&[y + 2.0]);
            collected.push(new);
        }
        let rows = collected.finish().expect("all that is needed");
        let u = [48.0, 0.7, 1.1, -4e17];
        let residual =
            |row: &[f64]| row[width - 1] - row.iter().zip(&u).map(|(c, u)| c * u).sum::<f64>();
        let expected: f64 = (0..count).map(|i| residual(&row(i)).powi(2)).sum();
        let found: f64 = rows.numbers.chunks(width).map(|row| residual(row).powi(2)).sum();
        let [rest, mean, squares] = rows.rest;
        assert_eq!((rows.numbers.len() / width, rest, mean), (3, 997.0, 0.0));
        approx::assert_relative_eq!(found + squares, expected, max_relative = 1e-12);
    }

    #[test]
    fn groups_are_told_apart_and_found_again() {
        let mut collected = Collected::default();
        for (index, y) in [(4, 1.0), (2, 2.0), (4, 5.0), (2, 4.0), (2, 6.0), (7, 0.0)] {
            let mut new = NewRow::default();
            new.index(index);
            new.coefficient(1.0);
            new.datum(&[y]);
            collected.push(new);
        }
        let rows = collected.finish().expect("half the rows");
        let gaps: Vec<_> = rows.groups.iter().map(|group| (group.gap, group.rows)).collect();
        assert_eq!(gaps, [(0, 1), (0, 1), (3, 1)]);
        // a mean of 3 twice, of 4 three times, of 0 once
        let means = rows.numbers.chunks(2).map(|row| (row[0].powi(2), row[1] / row[0]));
        for ((n, mean), (count, expected)) in means.zip([(2.0, 3.0), (3.0, 4.0), (1.0, 0.0)]) {
            approx::assert_relative_eq!(n, count, max_relative = 1e-14);
            approx::assert_relative_eq!(mean, expected, max_relative = 1e-14);
        }
        approx::assert_relative_eq!(rows.rest[2], 8.0 + 8.0, max_relative = 1e-14);
    }

    #[test]
    fn rows_that_cannot_be_read_or_spare_nothing_are_left_alone() {
        let tell = |coefficients: &[f64]| {
            let mut collected = Collected::default();
            for (i, &coefficient) in coefficients.iter().enumerate() {
                let mut new = NewRow::default();
                new.index(i / 5);
                new.coefficient(coefficient);
                new.datum(&[1.0]);
                collected.push(new);
            }
            collected.finish()
        };
        assert!(tell(&[1.0; 10]).is_some());
        assert!(tell(&[1.0, 1.0, f64::NAN, 1.0, 1.0]).is_none());
        assert!(tell(&[1.0]).is_none() && tell(&[]).is_none());
        let mut wrong = NewRow::default();
        wrong.dot(1.0, &[1.0, 2.0], &[crate::Real(0.0)]);
        wrong.datum(&[1.0]);
        let mut collected = Collected::default();
        collected.push(wrong);
        assert!(collected.finish().is_none());
    }
}
