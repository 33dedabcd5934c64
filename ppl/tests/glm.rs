//! Generalised linear models: a statement over all data, which summarises the data when they are bound, equals the loop
//! over the data in value and gradient, for every way of differentiating.

use ppl::prelude::*;
use ppl::{Bound, Model, Workspace};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

ppl::model! {
    fn line(x: &[[f64; 2]], y: &[f64]) {
        let level ~ Normal(0.0, 1.0);
        let slope ~ Normal(0.0, 1.0).array::<2>();
        let sd ~ HalfNormal(1.0);
        y ~ NormalGlm(x, level, slope, sd);
    }

    fn line_by_loop(x: &[[f64; 2]], y: &[f64]) {
        let level ~ Normal(0.0, 1.0);
        let slope ~ Normal(0.0, 1.0).array::<2>();
        let sd ~ HalfNormal(1.0);
        for (x, y) in x.iter().zip(y) {
            y ~ Normal(level + slope[0] * x[0] + slope[1] * x[1], sd);
        }
    }

    /// A number of slopes that is known at run time, and an intercept that is computed.
    fn wide(x: &[Vec<f64>], y: &[f64], slopes: usize) {
        let level ~ Normal(0.0, 1.0).array::<2>();
        let slope ~ Normal(0.0, 1.0).iid(slopes);
        let sd ~ HalfNormal(1.0);
        y ~ NormalGlm(x, 0.5 * level[0] - level[1], &slope, sd);
    }

    fn wide_by_loop(x: &[Vec<f64>], y: &[f64], slopes: usize) {
        let level ~ Normal(0.0, 1.0).array::<2>();
        let slope ~ Normal(0.0, 1.0).iid(slopes);
        let sd ~ HalfNormal(1.0);
        for (x, y) in x.iter().zip(y) {
            y ~ Normal(0.5 * level[0] - level[1] + dot(x, &slope), sd);
        }
    }

    fn groups(group: &[usize], x: &[[f64; 2]], y: &[f64]) {
        let mean ~ Normal(0.0, 1.0);
        let z ~ Normal(0.0, 1.0).array::<4>();
        let level = z.map(|z| mean + 0.3 * z);
        let slope ~ Normal(0.0, 1.0).array::<2>();
        let sd ~ HalfNormal(1.0);
        y ~ NormalGlm(x, ByGroup(level, group), slope, sd);
    }

    fn groups_by_loop(group: &[usize], x: &[[f64; 2]], y: &[f64]) {
        let mean ~ Normal(0.0, 1.0);
        let z ~ Normal(0.0, 1.0).array::<4>();
        let slope ~ Normal(0.0, 1.0).array::<2>();
        let sd ~ HalfNormal(1.0);
        for i in 0..y.len() {
            let level = mean + 0.3 * z[group[i]];
            y[i] ~ Normal(level + slope[0] * x[i][0] + slope[1] * x[i][1], sd);
        }
    }

    /// One statement per specimen, and a last statement with one predictor and a known scale.
    fn specimens(specimens: &[Specimen]) {
        let slope ~ Normal(0.0, 1.0).array::<1>();
        for specimen in specimens {
            let level ~ Normal(0.0, 1.0);
            specimen.force ~ NormalGlm(&specimen.stretch, level, slope, 0.2);
        }
    }

    fn specimens_by_loop(specimens: &[Specimen]) {
        let slope ~ Normal(0.0, 1.0).array::<1>();
        for specimen in specimens {
            let level ~ Normal(0.0, 1.0);
            for (stretch, force) in specimen.stretch.iter().zip(&specimen.force) {
                force ~ Normal(level + slope[0] * stretch, 0.2);
            }
        }
    }

    fn counts(group: &[usize], x: &[[f64; 2]], k: &[u64], flags: &[bool]) {
        let level ~ Normal(0.0, 1.0).array::<4>();
        let slope ~ Normal(0.0, 1.0).array::<2>();
        k ~ PoissonLogGlm(x, ByGroup(&level, group), slope);
        flags ~ BernoulliLogitGlm(x, level[1], slope);
    }

    fn counts_by_loop(group: &[usize], x: &[[f64; 2]], k: &[u64], flags: &[bool]) {
        let level ~ Normal(0.0, 1.0).array::<4>();
        let slope ~ Normal(0.0, 1.0).array::<2>();
        for i in 0..k.len() {
            let eta = level[group[i]] + slope[0] * x[i][0] + slope[1] * x[i][1];
            k[i] ~ PoissonLog(eta);
        }
        for (flag, x) in flags.iter().zip(x) {
            flag ~ BernoulliLogit(level[1] + slope[0] * x[0] + slope[1] * x[1]);
        }
    }

    fn known_spread(x: &[[f64; 3]], y: &[f64]) {
        let level ~ Normal(0.0, 2.0);
        let slope ~ Normal(0.0, 2.0).array::<3>();
        y ~ NormalGlm(x, level, slope, 0.5);
    }

    /// Predictors that depend on an unknown, so that no sums can be computed beforehand.
    fn moved(x: &[f64], y: &[f64]) {
        let origin ~ Normal(0.0, 1.0);
        let slope ~ Normal(0.0, 1.0).array::<1>();
        let x: Vec<f64> = x.iter().map(|x| x - plain(origin)).collect();
        y ~ NormalGlm(&x, 0.0, slope, 1.0);
    }
}

struct Specimen {
    stretch: Vec<f64>,
    force: Vec<f64>,
}

/// The value of a number without its derivative.
fn plain<S: Scalar>(x: S) -> f64 {
    x.value()
}

fn wave(i: usize, k: usize) -> f64 {
    (0.3 + i as f64 * (0.9 + 0.37 * k as f64)).sin()
}

/// Predictors far from zero, where sums of squares would lose digits.
fn rows<const K: usize>(n: usize) -> Vec<[f64; K]> {
    (0..n).map(|i| std::array::from_fn(|k| 40.0 * k as f64 + wave(i, k))).collect()
}

fn responses(n: usize) -> Vec<f64> {
    (0..n).map(|i| 3.0 + wave(i, 7)).collect()
}

/// Asserts that values and gradients of two models agree at draws from the prior.
fn assert_same(a: &Bound<impl Model>, b: &Bound<impl Model>) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
    let dim = a.layout().expect("a model").dim;
    assert_eq!(dim, b.layout().expect("a model").dim);
    let (mut w, mut v) = (Workspace::default(), Workspace::default());
    for _ in 0..20 {
        let y = b.draw_prior(&mut rng).expect("a model").unconstrained;
        let mut gradients: [Vec<f64>; 4] = std::array::from_fn(|_| vec![0.0; dim]);
        let [ours, theirs, dual, tape] = &mut gradients;
        let value = a.gradient(&y, ours, &mut w).expect("inside");
        let expected = b.forward_gradient(&y, theirs).expect("inside");
        let by_dual = a.forward_gradient(&y, dual).expect("inside");
        let by_tape = a.tape_gradient(&y, tape, &mut v).expect("inside");
        let alone = a.log_density(&y, &mut w).expect("inside");
        for found in [value, by_dual, by_tape, alone] {
            approx::assert_relative_eq!(found, expected, max_relative = 1e-12);
        }
        let size = theirs.iter().fold(1.0f64, |size, g| size.max(g.abs()));
        for found in [&*ours, dual, tape] {
            for (f, e) in found.iter().zip(&*theirs) {
                assert!((f - e).abs() <= 1e-11 * size, "{found:?} {theirs:?}");
            }
        }
    }
}

#[test]
fn a_statement_is_the_loop_over_its_data() {
    for n in [0, 1, 2, 30] {
        assert_same(&line(&rows(n), &responses(n)), &line_by_loop(&rows(n), &responses(n)));
    }
}

#[test]
fn predictors_may_be_as_many_as_a_file_says() {
    for (n, slopes) in [(12, 0), (12, 1), (12, 11), (5, 9)] {
        let x: Vec<Vec<f64>> = (0..n).map(|i| (0..slopes).map(|k| wave(i, k)).collect()).collect();
        let y = responses(n);
        assert_same(&wide(&x, &y, slopes), &wide_by_loop(&x, &y, slopes));
    }
}

#[test]
fn groups_have_their_own_intercepts() {
    // the third group is empty
    let group: Vec<usize> = (0..40).map(|i| [0, 1, 3, 1, 0][i % 5]).collect();
    let (x, y) = (rows(40), responses(40));
    assert_same(&groups(&group, &x, &y), &groups_by_loop(&group, &x, &y));
    let (k, flags): (Vec<_>, Vec<_>) = (0..40).map(|i| (i as u64 % 7, i % 3 == 0)).unzip();
    let x: Vec<[f64; 2]> = (0..40).map(|i| [wave(i, 0), wave(i, 1)]).collect();
    assert_same(&counts(&group, &x, &k, &flags), &counts_by_loop(&group, &x, &k, &flags));
}

#[test]
fn statements_stack_in_a_plate() {
    let specimen =
        |n: usize| Specimen { stretch: (0..n).map(|i| wave(i, n)).collect(), force: responses(n) };
    let specimens = [specimen(4), specimen(4), specimen(4)];
    let model = self::specimens(&specimens);
    assert_same(&model, &specimens_by_loop(&specimens));
    let record = model.draw_prior(&mut Xoshiro256PlusPlus::seed_from_u64(1)).expect("proper");
    let force = record.get("specimen.force").expect("observed");
    assert_eq!((force.log_likelihood.len(), &force.variable.shape[..]), (12, &[3, 4][..]));
}

/// With a normal prior and a known scale σ the posterior is normal: its precision is Cᵀ C/σ² + 1/τ², with C = [1 x],
/// and its mean solves the normal equations.
#[test]
fn the_posterior_of_a_conjugate_regression_is_exact() {
    use nalgebra::{DMatrix, DVector};
    let (n, spread, prior) = (60, 0.5f64, 2.0f64);
    let x: Vec<[f64; 3]> = (0..n).map(|i| [wave(i, 0), wave(i, 1), 2.0 - wave(i, 2)]).collect();
    let y = responses(n);
    let c = DMatrix::from_fn(n, 4, |i, k| if k == 0 { 1.0 } else { x[i][k - 1] });
    let precision = c.transpose() * &c / spread.powi(2) + DMatrix::identity(4, 4) / prior.powi(2);
    let right = c.transpose() * DVector::from_row_slice(&y) / spread.powi(2);
    let mean = precision.clone().lu().solve(&right).expect("positive definite");

    let model = known_spread(&x, &y);
    let mut w = Workspace::default();
    let mut gradient = |at: &DVector<f64>| {
        let mut gradient = vec![0.0; 4];
        model.gradient(at.as_slice(), &mut gradient, &mut w).expect("inside");
        DVector::from_vec(gradient)
    };
    assert!(gradient(&mean).amax() < 1e-9, "{}", gradient(&mean));
    for k in 0..4 {
        let mut away = mean.clone();
        away[k] += 1.0;
        approx::assert_relative_eq!(
            gradient(&away),
            -precision.column(k).into_owned(),
            epsilon = 1e-9
        );
    }
}

/// In the results, every datum has a separate log-likelihood and a separate replicate.
#[test]
fn data_are_told_apart_in_results() {
    let (x, y) = (rows::<2>(5), responses(5));
    let record =
        line(&x, &y).draw_prior(&mut Xoshiro256PlusPlus::seed_from_u64(2)).expect("proper");
    let (value, level, slope, sd) = {
        let number = |name: &str| record.values(name).expect("declared").to_vec();
        (record.get("y").expect("observed"), number("level"), number("slope"), number("sd"))
    };
    assert_eq!(value.replicate.len(), 5);
    for i in 0..5 {
        let mean = level[0] + slope[0] * x[i][0] + slope[1] * x[i][1];
        let expected: f64 = Normal(mean, sd[0]).ln_density(&y[i]);
        approx::assert_relative_eq!(value.log_likelihood[i], expected, max_relative = 1e-12);
    }
}

/// Replicates are normal around the predictor: the standardised residuals have mean 0 and mean square 1.
#[test]
fn replicates_are_about_the_predictor() {
    let (n, draws) = (4, 2000);
    let (x, y) = (rows::<2>(n), responses(n));
    let (model, mut rng) = (line(&x, &y), Xoshiro256PlusPlus::seed_from_u64(11));
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..draws {
        let record = model.draw_prior(&mut rng).expect("proper");
        let number = |name: &str| record.values(name).expect("declared").to_vec();
        let (level, slope, sd) = (number("level"), number("slope"), number("sd"));
        for (x, y) in x.iter().zip(record.replicate("y").expect("observed")) {
            let z = (y - level[0] - slope[0] * x[0] - slope[1] * x[1]) / sd[0];
            sum += z;
            squares += z * z;
        }
    }
    // 4 standard errors: 1/√N for the mean, √2/√N for the mean square
    let n = (n * draws) as f64;
    assert!((sum / n).abs() < 4.0 / n.sqrt(), "{}", sum / n);
    assert!((squares / n - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{}", squares / n);
}

/// Predictors that depend on an unknown are read at every point; sums from another point would be wrong.
#[test]
fn predictors_that_follow_an_unknown_are_read_at_every_point() {
    let (x, y) = ([0.3, -0.8, 1.9], [0.1, 0.4, -1.2]);
    let model = moved(&x, &y);
    let mut w = Workspace::default();
    for at in [[0.0, 1.0], [0.7, -0.4], [-2.0, 1.5]] {
        let each = |(x, y): (&f64, &f64)| -> f64 { Normal(at[1] * (x - at[0]), 1.0).ln_density(y) };
        let data: f64 = x.iter().zip(&y).map(each).sum();
        let prior: f64 = at.iter().map(|z| -> f64 { Normal(0.0, 1.0).ln_density(z) }).sum();
        let value = model.log_density(&at, &mut w).expect("inside");
        approx::assert_relative_eq!(value, data + prior, max_relative = 1e-12);
    }
}

#[test]
fn what_does_not_fit_is_said() {
    let (x, y) = (rows::<2>(4), responses(4));
    let ragged = [vec![1.0, 2.0], vec![1.0]];
    let unknown_number = [[0.0, f64::NAN]];
    let cases = [
        (said(&line(&x[..3], &y)), "x has 3 rows but there are 4 data"),
        (said(&wide(&ragged, &y[..2], 2)), "row 1 of x has 1 predictors but there are 2 slopes"),
        (
            said(&groups(&[0, 1, 4, 1], &x, &y)),
            "datum 2 belongs to group 4, but there are 4 intercepts",
        ),
        (said(&groups(&[0, 1, 1], &x, &y)), "3 data have a group but x has 4 rows"),
        (said(&line(&unknown_number, &y[..1])), "x[0][1]"),
    ];
    for (message, expected) in cases {
        assert!(message.contains(expected), "{message}");
    }
}

/// The error message of a model, or an empty string.
fn said(model: &Bound<impl Model>) -> String {
    model.layout().err().map_or(String::new(), |error| error.to_string())
}
