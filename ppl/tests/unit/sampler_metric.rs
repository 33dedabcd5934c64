//! Mass matrices, compared with the covariances to which they are fitted.

use approx::assert_relative_eq;
use nalgebra::DMatrix;
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{dense::geometric_mean, *};

/// Returns independent draws of Normal(0, Σ) with their scores, for Σ = D (I + (λ − 1) u uᵀ) D with u ∝ (1, −1, 1, …)
/// and D from 10⁻² to 10².
fn normal(dim: usize, lambda: f64, n: usize, seed: u64) -> (Sample, DMatrix<f64>) {
    let u = |i: usize| (if i.is_multiple_of(2) { 1.0 } else { -1.0 }) / (dim as f64).sqrt();
    let sd = |i: usize| 10_f64.powf(4.0 * i as f64 / (dim - 1) as f64 - 2.0);
    let covariance = DMatrix::from_fn(dim, dim, |i, j| {
        let identity = if i == j { 1.0 } else { 0.0 };
        (identity + (lambda - 1.0) * u(i) * u(j)) * sd(i) * sd(j)
    });
    let cholesky = covariance.clone().cholesky().expect("positive definite");
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut sample = Sample::new(dim);
    for _ in 0..n {
        let z = nalgebra::DVector::from_fn(dim, |_, _| rng.sample(StandardNormal));
        let draw = cholesky.l() * z;
        sample.add(draw.as_slice(), (-cholesky.solve(&draw)).as_slice());
    }
    (sample, covariance)
}

/// Variances computed by hand: the mean is 4 and the sum of squares 9 + 4 + 0 + 25 = 38; the mean score is −8.25.
#[test]
fn variances_by_hand() {
    let mut sample = Sample::new(1);
    for (x, g) in [(1.0, -2.0), (2.0, -4.5), (4.0, -8.0), (9.0, -18.5)] {
        sample.add(&[x], &[g]);
    }
    let var_x: f64 = 38.0 / 3.0;
    let var_g = (6.25f64.powi(2) + 3.75f64.powi(2) + 0.25f64.powi(2) + 10.25f64.powi(2)) / 3.0;
    let stan = 4.0 / 9.0 * var_x + 1e-3 * 5.0 / 9.0;
    assert_relative_eq!(sample.all().shrunk_variance(0), stan, max_relative = 1e-14);
    let fisher = (var_x / var_g).sqrt();
    assert_relative_eq!(sample.all().fisher_variance(0), fisher, max_relative = 1e-14);
    sample.keep_last(2);
    assert_relative_eq!(sample.all().fisher_variance(0), 5.0 / 10.5, max_relative = 1e-14);
}

/// For a normal with variance s², the score is −x/s², so that two draws determine the variance exactly.
#[test]
fn the_diagonal_map_is_exact_for_a_normal() {
    let mut sample = Sample::new(1);
    let variance = 3e-4;
    for x in [0.7, -0.1] {
        sample.add(&[x], &[-x / variance]);
    }
    assert_relative_eq!(sample.all().fisher_variance(0), variance, max_relative = 1e-12);
}

#[test]
fn a_coordinate_that_never_moved_keeps_its_scale() {
    let mut sample = Sample::new(2);
    for k in 0..12 {
        let x = f64::from(k) - 3.0;
        sample.add(&[x, 5.0], &[-x / 4.0, 3.0]);
    }
    let choice = choose(&sample, &Metric::identity(2), false);
    let variances = choice.metric.expect("a new map").variances();
    assert_relative_eq!(variances[0], 4.0, max_relative = 1e-12);
    assert_eq!(variances[1], 1.0);
}

/// Checks the equation Σ B Σ = A by multiplication.
#[test]
fn the_geometric_mean_solves_its_equation() {
    let a = DMatrix::from_row_slice(3, 3, &[2.0, 0.3, 0.1, 0.3, 1.0, -0.4, 0.1, -0.4, 5.0]);
    let b = DMatrix::from_row_slice(3, 3, &[4.0, -1.0, 0.2, -1.0, 2.0, 0.5, 0.2, 0.5, 1.0]);
    let mean = geometric_mean(&a, b.clone()).expect("both are positive definite");
    assert_relative_eq!(&mean * &b * &mean, a, max_relative = 1e-12);
    assert!(geometric_mean(&a, -b).is_none());
}

/// Checks that every matrix is consistent with its covariance: `M⁻¹` column by column, momenta against the inverse, and
/// the matrix restored from the stored form bit for bit.
#[test]
fn maps_agree_with_their_covariance() {
    let dim = 6;
    let (sample, _) = normal(dim, 9.0, 40, 1);
    let centred = sample.all();
    let diagonal = Diagonal::renewed(vec![1.0; dim], |i| centred.fisher_variance(i));
    let maps = [
        Metric::Diagonal(diagonal.clone()),
        Metric::Dense(Dense::fitted(&centred, &diagonal).expect("moves")),
        Metric::LowRank(LowRank::fitted(&centred, &diagonal).expect("moves")),
    ];
    for map in maps {
        let full = DMatrix::from_row_slice(dim, dim, &map.covariance().matrix());
        let mut column = vec![0.0; dim];
        for j in 0..dim {
            let unit: Vec<f64> = (0..dim).map(|i| if i == j { 1.0 } else { 0.0 }).collect();
            map.apply(&unit, &mut column);
            for i in 0..dim {
                let scale = (full[(i, i)] * full[(j, j)]).sqrt();
                assert!((column[i] - full[(i, j)]).abs() < 1e-12 * scale, "{:?}", map.kind());
            }
            assert_relative_eq!(map.variances()[j], full[(j, j)], max_relative = 1e-12);
        }
        // pᵀ M⁻¹ p of a momentum p has a χ² distribution with `dim` degrees of freedom: mean dim, variance 2 dim
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
        let (mut p, mut total) = (vec![0.0; dim], 0.0);
        const N: usize = 4000;
        for _ in 0..N {
            map.draw_momentum(&mut rng, &mut p);
            map.apply(&p, &mut column);
            total += p.iter().zip(&column).map(|(p, v)| p * v).sum::<f64>();
        }
        let error = (2.0 * dim as f64 / N as f64).sqrt();
        assert!((total / N as f64 - dim as f64).abs() < 4.0 * error, "{:?}", map.kind());

        let stored = Metric::from_covariance(&map.covariance(), dim).expect("its own");
        let (mut a, mut b) = (vec![0.0; dim], vec![0.0; dim]);
        map.draw_momentum(&mut Xoshiro256PlusPlus::seed_from_u64(5), &mut a);
        stored.draw_momentum(&mut Xoshiro256PlusPlus::seed_from_u64(5), &mut b);
        assert_eq!(a, b);
        map.apply(&p, &mut a);
        stored.apply(&p, &mut b);
        assert_eq!(a, b);
    }
}

/// The divergence is zero for the true covariance, and positive for another matrix.
#[test]
fn the_fisher_divergence_vanishes_at_the_covariance_of_a_normal() {
    let (sample, covariance) = normal(5, 30.0, 30, 2);
    let truth = Metric::Dense(Dense::new(covariance.as_slice().to_vec(), 5).expect("positive"));
    assert!(truth.divergence(&sample.all()) < 1e-20);
    // independent computation: the sum of |σ g + x/σ|² over the coordinates
    let identity = Metric::identity(5).divergence(&sample.all());
    let centred = sample.all();
    let by_hand = (&centred.draws + &centred.scores).norm_squared() / (29.0 * 5.0);
    assert_relative_eq!(identity, by_hand, max_relative = 1e-12);
}

/// A matrix with correlations is chosen if the density has correlations, and it is close to the covariance.
#[test]
fn the_better_kind_is_chosen() {
    let choice = choose(&normal(8, 50.0, 60, 3).0, &Metric::identity(8), false);
    assert_eq!(choice.metric.expect("a new map").kind(), MapKind::Dense);

    let (sample, covariance) = normal(80, 50.0, 60, 3);
    let map = choose(&sample, &Metric::identity(80), false).metric.expect("a new map");
    let MapKind::LowRank { rank: 1.. } = map.kind() else { panic!("{:?}", map.kind()) };
    // eigenvalues of M⁻¹ in units of the true covariance; they determine the step size
    let cholesky = covariance.cholesky().expect("positive definite").l();
    let mut inner = DMatrix::from_row_slice(80, 80, &map.covariance().matrix());
    cholesky.solve_lower_triangular_mut(&mut inner);
    let inner = cholesky.solve_lower_triangular(&inner.transpose()).expect("positive");
    let spectrum = inner.symmetric_eigenvalues();
    let condition = spectrum.max() / spectrum.min();
    assert!(condition < 8.0, "condition {condition}, 50 with the best diagonal");
}

/// The current matrix is kept if it is better than every matrix that is fitted to the window; otherwise it is
/// replaced.
#[test]
fn a_good_map_is_kept() {
    let (sample, covariance) = normal(8, 50.0, 12, 6);
    let truth = Metric::Dense(Dense::new(covariance.as_slice().to_vec(), 8).expect("positive"));
    assert!(choose(&sample, &truth, true).metric.is_none());
    assert!(choose(&sample, &truth, false).metric.is_some());
    assert!(choose(&sample, &Metric::identity(8), true).metric.is_some());
}
