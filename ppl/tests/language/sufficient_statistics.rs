//! Sufficient statistics: a model whose observations share their parameters equals the same model with one parameter
//! per datum.

use std::sync::atomic::{AtomicUsize, Ordering};

use ppl::prelude::*;
use ppl::{Bound, CholeskyFactor, Model, Workspace};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

ppl::model! {
    fn pooled(y: &[f64], waits: &[f64], counts: &[u64], flags: &[bool], pairs: &[[f64; 2]]) {
        let mean ~ Normal(0.0, 3.0).array::<2>();
        let sd ~ HalfNormal(2.0).array::<2>();
        let corr ~ LkjCholesky::<2>(2.0);
        let rate ~ Gamma(2.0, 1.0);
        let share ~ Beta(2.0, 2.0);
        for y in y {
            y ~ Normal(mean[0] + 1.0, sd[0]);
        }
        for wait in waits.iter() {
            wait ~ Exponential(rate * 2.0);
        }
        for count in counts {
            count ~ Poisson(rate);
        }
        for flag in flags {
            flag ~ Bernoulli(share);
        }
        let chol = corr.scale_rows(sd);
        for pair in pairs {
            pair ~ MvNormalCholesky(mean, chol);
        }
    }

    fn one_by_one(y: &[f64], waits: &[f64], counts: &[u64], flags: &[bool], pairs: &[[f64; 2]]) {
        let mean ~ Normal(0.0, 3.0).array::<2>();
        let sd ~ HalfNormal(2.0).array::<2>();
        let corr ~ LkjCholesky::<2>(2.0);
        let rate ~ Gamma(2.0, 1.0);
        let share ~ Beta(2.0, 2.0);
        for i in 0..y.len() {
            y[i] ~ Normal(mean[0] + 1.0, sd[0]);
        }
        for i in 0..waits.len() {
            waits[i] ~ Exponential(rate * 2.0);
        }
        for i in 0..counts.len() {
            counts[i] ~ Poisson(rate);
        }
        for i in 0..flags.len() {
            flags[i] ~ Bernoulli(share);
        }
        let chol = corr.scale_rows(sd);
        for i in 0..pairs.len() {
            pairs[i] ~ MvNormalCholesky(mean, chol);
        }
    }

    fn pooled_shapes(sizes: &[f64], shares: &[f64], lives: &[f64]) {
        let mean ~ Normal(0.0, 3.0);
        let shape ~ Gamma(2.0, 0.5).array::<2>();
        let rate ~ Gamma(2.0, 1.0);
        for size in sizes {
            size ~ LogNormal(mean, rate);
        }
        for share in shares {
            share ~ Beta(shape[0], shape[1]);
        }
        for life in lives {
            life ~ Gamma(shape[0], rate);
        }
    }

    fn shapes_one_by_one(sizes: &[f64], shares: &[f64], lives: &[f64]) {
        let mean ~ Normal(0.0, 3.0);
        let shape ~ Gamma(2.0, 0.5).array::<2>();
        let rate ~ Gamma(2.0, 1.0);
        for i in 0..sizes.len() {
            sizes[i] ~ LogNormal(mean, rate);
        }
        for i in 0..shares.len() {
            shares[i] ~ Beta(shape[0], shape[1]);
        }
        for i in 0..lives.len() {
            lives[i] ~ Gamma(shape[0], rate);
        }
    }

    /// Data at the ends of a support, where the density is positive if the shape is 1.
    fn pooled_ends(shares: &[f64], lives: &[f64]) {
        let rate ~ Gamma(2.0, 1.0);
        for share in shares {
            share ~ Beta(1.0, rate);
        }
        for other in shares {
            other ~ Beta(rate, 1.0).censor(0.5..);
        }
        for life in lives {
            life ~ Gamma(1.0, rate);
        }
    }

    fn ends_one_by_one(shares: &[f64], lives: &[f64]) {
        let rate ~ Gamma(2.0, 1.0);
        for i in 0..shares.len() {
            shares[i] ~ Beta(1.0, rate);
        }
        for other in shares {
            other ~ Beta(rate, 1.0).censor(0.5..);
        }
        for i in 0..lives.len() {
            lives[i] ~ Gamma(1.0, rate);
        }
    }

    fn counting(ys: &Counted) {
        let mean ~ Normal(0.0, 3.0);
        for y in ys.iter() {
            y ~ Normal(mean, 1.0);
        }
    }

    fn counting_about_a_sum(ys: &Counted) {
        let parts ~ Normal(0.0, 3.0).array::<3>();
        for y in ys.iter() {
            y ~ Normal(parts.iter().map(|part| *part * 0.5).sum::<Real<_>>(), 1.0);
        }
    }

    fn known_factor(chol: &CholeskyFactor<f64, 2>, pairs: &[[f64; 2]]) {
        let mean ~ Normal(0.0, 3.0).array::<2>();
        for pair in pairs {
            pair ~ MvNormalCholesky(mean, chol);
        }
    }

    fn known_factor_one_by_one(chol: &CholeskyFactor<f64, 2>, pairs: &[[f64; 2]]) {
        let mean ~ Normal(0.0, 3.0).array::<2>();
        for i in 0..pairs.len() {
            pairs[i] ~ MvNormalCholesky(mean, chol);
        }
    }
}

/// Data that count how often a model reads a datum.
struct Counted {
    values: Vec<f64>,
    looks: AtomicUsize,
}

impl Counted {
    fn iter(&self) -> impl Iterator<Item = &f64> {
        self.values.iter().inspect(|_| {
            self.looks.fetch_add(1, Ordering::Relaxed);
        })
    }
}

fn assert_same(a: &Bound<impl Model>, b: &Bound<impl Model>) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(9);
    let dim = a.layout().unwrap().dim;
    let mut w = Workspace::default();
    let [mut ours, mut theirs] = [vec![0.0; dim], vec![0.0; dim]];
    for _ in 0..20 {
        let y = a.draw_prior(&mut rng).unwrap().unconstrained;
        let value = a.gradient(&y, &mut ours, &mut w).unwrap();
        let expected = b.gradient(&y, &mut theirs, &mut w).unwrap();
        approx::assert_relative_eq!(value, expected, max_relative = 1e-12);
        approx::assert_relative_eq!(
            a.log_density(&y, &mut w).unwrap(),
            value,
            max_relative = 1e-13
        );
        let size = theirs.iter().fold(1.0f64, |size, g| size.max(g.abs()));
        for (a, b) in ours.iter().zip(&theirs) {
            assert!((a - b).abs() < 1e-12 * size, "{a} and {b}");
        }
        // the complete density, with the constants of the data
        let value = a.log_density_without_jacobian(&y, &mut w).unwrap();
        let expected = b.log_density_without_jacobian(&y, &mut w).unwrap();
        approx::assert_relative_eq!(value, expected, max_relative = 1e-12);
    }
}

#[test]
fn sums_suffice() {
    let y = [1.3, -0.4, 2.2, 0.9];
    let (waits, counts, flags) = ([0.3, 1.7, 0.2], [0, 4, 2, 11], [true, false, true]);
    let pairs = [[0.2, 1.4], [-0.7, 0.9], [1.1, 2.0]];
    assert_same(
        &pooled(&y, &waits, &counts, &flags, &pairs),
        &one_by_one(&y, &waits, &counts, &flags, &pairs),
    );
    assert_same(&pooled(&[], &[], &[], &[], &[]), &one_by_one(&[], &[], &[], &[], &[]));
    let chol = CholeskyFactor::new([[1.2, 0.0], [-0.4, 0.7]]).unwrap();
    assert_same(&known_factor(&chol, &pairs), &known_factor_one_by_one(&chol, &pairs));
}

#[test]
fn sums_of_logarithms_suffice() {
    let (sizes, shares, lives) = ([1.3, 0.01, 20.0], [0.2, 0.9, 1e-9, 0.5], [3.0, 1e-3, 0.7, 5.0]);
    assert_same(
        &pooled_shapes(&sizes, &shares, &lives),
        &shapes_one_by_one(&sizes, &shares, &lives),
    );
    assert_same(&pooled_shapes(&[], &[], &[]), &shapes_one_by_one(&[], &[], &[]));
    for lives in [&[0.0, 1.2, 0.0][..], &[0.0], &[0.4]] {
        for shares in [&[0.0, 0.3][..], &[0.0], &[0.2]] {
            assert_same(&pooled_ends(shares, lives), &ends_one_by_one(shares, lives));
        }
    }
}

/// An evaluation reads no data, so its cost does not depend on their number.
#[test]
fn data_are_gone_through_when_they_are_bound() {
    let data = Counted { values: vec![0.4, 1.1, -0.3], looks: AtomicUsize::new(0) };
    let model = counting(&data);
    let bound = data.looks.load(Ordering::Relaxed);
    assert!(bound > 0);
    let (mut gradient, mut w) = ([0.0], Workspace::default());
    let value = model.gradient(&[0.2], &mut gradient, &mut w).unwrap();
    assert_eq!(value, model.log_density(&[0.2], &mut w).unwrap());
    approx::assert_relative_eq!(gradient[0], 1.2 - 3.0 * 0.2 - 0.2 / 9.0, max_relative = 1e-14);
    assert_eq!(data.looks.load(Ordering::Relaxed), bound);

    let model = counting_about_a_sum(&data);
    let bound = data.looks.load(Ordering::Relaxed);
    let mut gradient = [0.0; 3];
    model.gradient(&[0.2, 0.1, -0.4], &mut gradient, &mut w).unwrap();
    approx::assert_relative_eq!(
        gradient[1],
        0.5 * (1.2 - 3.0 * -0.05) - 0.1 / 9.0,
        max_relative = 1e-14
    );
    assert_eq!(data.looks.load(Ordering::Relaxed), bound);
}

/// With sufficient statistics too, every datum has a separate log-likelihood and a separate
/// replicate.
#[test]
fn records_are_not_pooled() {
    let y = [1.3, -0.4];
    let model = pooled(&y, &[], &[], &[], &[]);
    let record = model.draw_prior(&mut Xoshiro256PlusPlus::seed_from_u64(2)).unwrap();
    assert_eq!(record.get("y").unwrap().log_likelihood.len(), 2);
    assert_eq!(record.replicate("y").unwrap().len(), 2);
}

/// Data outside the support are rejected, with or without sufficient statistics.
#[test]
fn what_is_impossible_is_rejected() {
    let model = pooled(&[], &[-1.0, 2.0], &[], &[], &[]);
    let dim = model.layout().map_or(0, |layout| layout.dim);
    let mut w = Workspace::default();
    let rejection = model.log_density(&vec![0.1; dim], &mut w).unwrap_err();
    assert!(rejection.to_string().contains("wait ~ Exponential"), "{rejection}");
    let shapes: [[&[f64]; 3]; 7] = [
        [&[1.0, -2.0], &[], &[]],
        [&[0.0], &[], &[]],
        [&[], &[-0.5], &[]],
        [&[], &[1.5, 2.0], &[]],
        [&[], &[0.0], &[]],
        [&[], &[], &[-0.1]],
        [&[], &[], &[2.0, -0.1]],
    ];
    for [sizes, shares, lives] in shapes {
        let model = pooled_shapes(sizes, shares, lives);
        assert!(model.log_density(&[0.1, 0.9, 0.8, 0.3], &mut w).is_err());
    }
}

ppl::model! {
    fn rows(rows: &[Vec<f64>], quantities: usize) {
        let mean ~ Normal(0.0, 3.0).iid(quantities);
        let sd ~ HalfNormal(2.0).iid(quantities);
        let corr ~ LkjCholesky::of(quantities, 2.0);
        let chol = corr.scale_rows(&sd)?;
        for row in rows {
            row ~ MvNormalCholesky(&mean, &chol);
        }
    }

    fn rows_one_by_one(rows: &[Vec<f64>], quantities: usize) {
        let mean ~ Normal(0.0, 3.0).iid(quantities);
        let sd ~ HalfNormal(2.0).iid(quantities);
        let corr ~ LkjCholesky::of(quantities, 2.0);
        let chol = corr.scale_rows(&sd)?;
        for i in 0..rows.len() {
            rows[i] ~ MvNormalCholesky(&mean, &chol);
        }
    }
}

/// Sums over rows whose length is known only at run time are also computed once; rows of different lengths are
/// rejected.
#[test]
fn rows_of_a_size_known_at_run_time_are_summed_up() {
    let data: Vec<Vec<f64>> = (0..7)
        .map(|i| (0..3).map(|j| (1.3 * f64::from(i) + 0.7 * f64::from(j)).sin()).collect())
        .collect();
    let (pooled, single) = (rows(&data, 3), rows_one_by_one(&data, 3));
    ppl::check::gradient(&pooled, 2);
    let y: Vec<f64> = (0..9).map(|i| 0.2 * f64::from(i) - 0.7).collect();
    let (mut a, mut b) = (vec![0.0; 9], vec![0.0; 9]);
    let value = pooled.gradient(&y, &mut a, &mut Workspace::default()).unwrap();
    let expected = single.gradient(&y, &mut b, &mut Workspace::default()).unwrap();
    approx::assert_relative_eq!(value, expected, max_relative = 1e-12);
    for (a, b) in a.iter().zip(&b) {
        approx::assert_relative_eq!(*a, *b, max_relative = 1e-11, epsilon = 1e-12);
    }
    for wrong in [vec![vec![0.1; 3], vec![0.1; 2]], vec![vec![0.1; 2]; 2], vec![vec![0.1; 4]]] {
        let model = rows(&wrong, 3);
        let error = model.layout().unwrap_err().to_string();
        assert!(error.contains("length of x must be equal to the number of rows"), "{error}");
        // the density of an invalid model is zero, not a panic
        let density = model.log_density(&y, &mut Workspace::default());
        assert!(density.is_err(), "{density:?}");
    }
    assert!(rows(&[], 3).log_density(&y, &mut Workspace::default()).is_ok());
}
