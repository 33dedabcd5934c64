//! Submodels: names, shapes, densities, predictions.

use ppl::prelude::*;
use ppl::{Bound, Model, Rejection, Role, Workspace, check};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

ppl::model! {
    /// A submodel for group offsets around a level, which may be an unknown or a number.
    fn offsets(level: Real, scale: f64, groups: usize) -> Vec<Real> {
        let spread ~ HalfNormal(scale);
        let z ~ Normal(0.0, 1.0).iid(groups);
        #[track] let offset: Vec<_> = z.iter().map(|z| level + spread * *z).collect();
        offset
    }

    /// A submodel that calls another submodel twice and declares an unknown `level`.
    fn two_ways(rows: usize, columns: usize) -> (Vec<Real>, Vec<Real>) {
        let level ~ Normal(0.0, 5.0);
        let row ~ offsets(level, 1.0, rows);
        let column ~ offsets(0.0, 2.0, columns);
        (row, column)
    }

    fn table(rows: usize, columns: usize, cells: &[(usize, usize, f64)]) {
        let effect ~ two_ways(rows, columns);
        let sd ~ HalfNormal(1.0);
        for (r, c, y) in cells {
            *y ~ Normal(effect.0[*r] + effect.1[*c], sd);
        }
    }

    /// The model `table` without submodels.
    fn table_at_length(rows: usize, columns: usize, cells: &[(usize, usize, f64)]) {
        let level ~ Normal(0.0, 5.0);
        let spread_1 ~ HalfNormal(1.0);
        let z_1 ~ Normal(0.0, 1.0).iid(rows);
        let spread_2 ~ HalfNormal(2.0);
        let z_2 ~ Normal(0.0, 1.0).iid(columns);
        let sd ~ HalfNormal(1.0);
        for (r, c, y) in cells {
            *y ~ Normal(level + spread_1 * z_1[*r] + spread_2 * z_2[*c], sd);
        }
    }

    /// One specimen: an unknown, its observations, a prediction, and a result that depends on the data.
    fn specimen(mean: Real, tau: Real, ys: &[f64]) -> Real {
        let theta ~ Normal(mean, tau);
        for y in ys {
            y ~ Normal(theta, 1.0);
        }
        #[predict] let again ~ Normal(theta, 1.0);
        if ys.is_empty() {
            Real::from(0.0)
        } else {
            let twice = 2.0 * theta;
            twice
        }
    }

    fn laboratory(specimens: &[&[f64]]) {
        let mu ~ Normal(0.0, 2.0);
        for ys in specimens {
            #[track] let each ~ specimen(mu, 0.5, ys);
        }
        #[predict] let other ~ specimen(mu, 0.5, specimens[0]);
    }

    /// A submodel without a result.
    fn noise<const K: usize>(ys: &[[f64; K]], sd: Real) -> () {
        for y in ys {
            y ~ Normal(0.0, sd).array::<K>();
        }
    }

    fn noisy(ys: &[[f64; 2]]) {
        let sd ~ HalfNormal(1.0);
        let first ~ noise(ys, sd);
        let second ~ noise(ys, 2.0);
    }

    fn limited(limit: f64) -> Real {
        let x ~ Normal(0.0, 1.0);
        if x > limit {
            reject!("{x} is above {limit}");
        }
        x
    }

    fn guarded() {
        let part ~ limited(1.0);
        factor(-part.square());
    }
}

/// An ordinary function that returns a distribution.
fn wide(scale: f64) -> Normal<f64, f64> {
    Normal(0.0, 10.0 * scale)
}

ppl::model! {
    fn by_function(y: f64) {
        let x ~ wide(0.3);
        y ~ Normal(x, 1.0);
        #[predict] let k ~ counts(2.0);
    }
}

fn counts(rate: f64) -> Poisson<f64> {
    Poisson(rate)
}

fn names(model: &Bound<impl Model>) -> Vec<(&str, &[usize], Role)> {
    let layout = model.layout().unwrap();
    layout.variables.iter().map(|v| (v.name.as_str(), v.shape.as_slice(), v.role)).collect()
}

fn gradient(model: &Bound<impl Model>, y: &[f64]) -> (f64, Vec<f64>) {
    let mut gradient = vec![0.0; y.len()];
    let value = model.gradient(y, &mut gradient, &mut Workspace::default()).unwrap();
    (value, gradient)
}

const CELLS: [(usize, usize, f64); 4] = [(0, 0, 1.0), (0, 1, 0.4), (1, 2, -0.3), (1, 0, 2.0)];

#[test]
fn names_have_those_of_the_submodels_in_front() {
    use Role::{Observed, Parameter, Predicted, Tracked};
    assert_eq!(
        names(&table(2, 3, &CELLS)),
        [
            ("effect.level", &[][..], Parameter),
            ("effect.row.spread", &[], Parameter),
            ("effect.row.z", &[2], Parameter),
            ("effect.row.offset", &[2], Tracked),
            ("effect.column.spread", &[], Parameter),
            ("effect.column.z", &[3], Parameter),
            ("effect.column.offset", &[3], Tracked),
            ("sd", &[], Parameter),
            ("y", &[4], Observed),
        ]
    );
    let (a, b): (&[f64], &[f64]) = (&[0.1, 0.2], &[0.3]);
    assert_eq!(
        names(&laboratory(&[a, b])),
        [
            ("mu", &[][..], Parameter),
            ("each.theta", &[2], Parameter),
            ("each.y", &[3], Observed),
            ("each.again", &[2], Predicted),
            ("each", &[2], Tracked),
            ("other.theta", &[], Predicted),
            ("other.y", &[2], Predicted),
            ("other.again", &[], Predicted),
        ]
    );
    assert_eq!(
        names(&noisy(&[[0.1, 0.2]])),
        [
            ("sd", &[][..], Parameter),
            ("first.y", &[1, 2], Observed),
            ("second.y", &[1, 2], Observed)
        ]
    );
    assert_eq!(names(&by_function(1.0))[0], ("x", &[][..], Parameter));
}

/// A submodel has the same density as its statements written in the calling model, and the same gradient by
/// tape and by dual numbers.
#[test]
fn densities_are_those_of_the_statements() {
    let (of_statements, whole) = (table(2, 3, &CELLS), table_at_length(2, 3, &CELLS));
    let y: Vec<f64> = (0..9).map(|i| 0.2 * f64::from(i) - 0.7).collect();
    let mut forward = vec![0.0; 9];
    let value = of_statements.forward_gradient(&y, &mut forward).unwrap();
    for (by_tape, reverse) in [gradient(&of_statements, &y), gradient(&whole, &y)] {
        approx::assert_relative_eq!(value, by_tape, max_relative = 1e-14);
        for (a, b) in forward.iter().zip(reverse) {
            approx::assert_relative_eq!(*a, b, max_relative = 1e-12);
        }
    }
}

#[test]
fn values_predictions_and_likelihoods() {
    let (a, b): (&[f64], &[f64]) = (&[0.1, 0.2], &[0.3]);
    let specimens = [a, b];
    let model = laboratory(&specimens);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let record = model.constrain(&[0.4, 1.0, -0.5], &mut rng).unwrap();
    assert_eq!(record.values("each.theta").unwrap(), [1.0, -0.5]);
    assert_eq!(record.values("each").unwrap(), [2.0, -1.0]);
    let observed = record.get("each.y").unwrap();
    let expected: Vec<f64> = [(0.1, 1.0), (0.2, 1.0), (0.3, -0.5)]
        .map(|(y, theta): (f64, f64)| Normal(theta, 1.0).ln_density(&y))
        .to_vec();
    assert_eq!(observed.log_likelihood, expected);

    // mean and variance over many draws of a new specimen at this point: θ ~ N(0.4, 0.5), y ~ N(θ, 1)
    let n = 4000;
    let (mut theta, mut y) = (0.0, 0.0);
    for _ in 0..n {
        let record = model.constrain(&[0.4, 1.0, -0.5], &mut rng).unwrap();
        theta += record.values("other.theta").unwrap()[0];
        y += (record.values("other.y").unwrap()[0] - 0.4).powi(2);
    }
    let n = f64::from(n);
    assert!((theta / n - 0.4).abs() < 4.0 * 0.5 / n.sqrt());
    // the variance is 1.25, and the variance of its estimate is 2 · 1.25²/n
    assert!((y / n - 1.25).abs() < 4.0 * 1.25 * (2.0 / n).sqrt());
}

/// θ_j ~ N(μ, ½), y ~ N(θ_j, 1) and μ ~ N(0, 2): the posterior is normal with known moments.
#[test]
fn a_posterior_through_submodels() {
    let (a, b): (&[f64], &[f64]) = (&[1.5], &[2.5]);
    let posterior = Nuts::default().seed(3).sample(&laboratory(&[a, b])).unwrap();
    let precision = 0.25 + 2.0 / 1.25;
    check::mean(&posterior, "mu", (4.0 / 1.25) / precision).within_mcse(4.0);
    check::sd(&posterior, "mu", precision.powf(-0.5)).within_mcse(4.0);
    check::mean(&posterior, "other.y[0]", (4.0 / 1.25) / precision).within_mcse(4.0);
    assert_eq!(posterior.loo().unwrap().points.len(), 2);
}

#[test]
fn rejections_in_a_submodel_have_their_place() {
    let error = guarded().log_density(&[2.0], &mut Workspace::default()).unwrap_err();
    let Rejection::Reject { location, message } = error else { panic!("not a rejection: {error}") };
    assert_eq!(message, "2 is above 1");
    assert_eq!(location.statement, r#"reject!("{x} is above {limit}")"#);
}

ppl::model! {
    fn measured(level: Real, scale: Real, ys: &[f64]) -> Real {
        let sd ~ HalfNormal(1.0);
        for y in ys {
            y ~ Normal(level * 2.0 + 0.5, sd * scale + 0.1);
        }
        level + sd
    }

    fn with_a_submodel(ys: &[f64], zs: &[f64]) {
        let level ~ Normal(0.0, 2.0);
        let first ~ measured(level, 1.0, ys);
        for z in zs {
            z ~ Normal(first, 1.0);
        }
    }

    fn in_place(ys: &[f64], zs: &[f64]) {
        let level ~ Normal(0.0, 2.0);
        let sd ~ HalfNormal(1.0);
        for y in ys {
            y ~ Normal(level * 2.0 + 0.5, sd * 1.0 + 0.1);
        }
        for z in zs {
            z ~ Normal(level + sd, 1.0);
        }
    }

    /// A submodel whose statements depend on the value of an unknown.
    fn one_of_two(x: Real, ys: &[f64], zs: &[f64]) -> Real {
        if x > 0.0 {
            for y in ys {
                y ~ Normal(x, 1.0);
            }
        } else {
            for z in zs {
                z ~ Normal(2.0 * x, 0.5);
            }
        }
        x
    }

    /// A submodel whose statements differ only where draws from the prior hardly ever are.
    fn one_of_two_beyond_six(x: Real, ys: &[f64], zs: &[f64]) -> Real {
        if x < 6.0 {
            for y in ys {
                y ~ Normal(x, 1.0);
            }
        } else {
            for z in zs {
                z ~ Normal(2.0 * x, 0.5);
            }
        }
        x
    }

    fn with_a_rarely_varying_submodel(ys: &[f64], zs: &[f64]) {
        let x ~ Normal(0.0, 1.0);
        let same ~ one_of_two_beyond_six(x, ys, zs);
        factor(-0.1 * same.square());
    }

    fn with_a_varying_submodel(ys: &[f64], zs: &[f64]) {
        let x ~ Normal(0.0, 1.0);
        let same ~ one_of_two(x, ys, zs);
        factor(-0.1 * same.square());
    }
}

/// A submodel has the density and the gradient of its body.
#[test]
fn a_submodel_has_the_density_of_its_body() {
    let (ys, zs) = ([0.3, 1.2, -0.4, 2.0], [0.1, 0.9]);
    let (part, whole) = (with_a_submodel(&ys, &zs), in_place(&ys, &zs));
    check::gradient(&part, 3);
    for y in [[0.2, -0.5], [-1.0, 0.7], [1.5, 0.1]] {
        let ((a, da), (b, db)) = (gradient(&part, &y), gradient(&whole, &y));
        assert!((a - b).abs() < 1e-11, "{a} and {b}");
        assert!(da.iter().zip(&db).all(|(a, b)| (a - b).abs() < 1e-12), "{da:?} and {db:?}");
    }
}

/// A submodel that runs different statements at different points is evaluated at every point, without precomputed sums.
#[test]
fn a_varying_submodel_is_evaluated_at_every_point() {
    let (ys, zs) = ([0.3, 1.2], [0.1, 0.9, -0.4]);
    let model = with_a_varying_submodel(&ys, &zs);
    let ln_normal = |x: f64, mean: f64, sd: f64| -> f64 { Normal(mean, sd).ln_density(&x) };
    for x in [0.8, -0.8, 1.7, -0.1] {
        let data: f64 = match x > 0.0 {
            true => ys.iter().map(|y| ln_normal(*y, x, 1.0)).sum(),
            false => zs.iter().map(|z| ln_normal(*z, 2.0 * x, 0.5)).sum(),
        };
        let expected = ln_normal(x, 0.0, 1.0) + data - 0.1 * x * x;
        let found = gradient(&model, &[x]).0;
        assert!((found - expected).abs() < 1e-12, "{found} instead of {expected} at {x}");
    }
}

/// Draws from the prior do not show that the statements vary: the code of the submodel does.
#[test]
fn a_submodel_that_varies_where_no_draw_is_has_no_precomputed_sums() {
    let (ys, zs) = ([0.3, 1.2], [0.1, 0.9, -0.4]);
    let model = with_a_rarely_varying_submodel(&ys, &zs);
    let ln_normal = |x: f64, mean: f64, sd: f64| -> f64 { Normal(mean, sd).ln_density(&x) };
    for x in [0.8, 6.5] {
        let data: f64 = match x < 6.0 {
            true => ys.iter().map(|y| ln_normal(*y, x, 1.0)).sum(),
            false => zs.iter().map(|z| ln_normal(*z, 2.0 * x, 0.5)).sum(),
        };
        let expected = ln_normal(x, 0.0, 1.0) + data - 0.1 * x * x;
        let found = gradient(&model, &[x]).0;
        assert!((found / expected - 1.0).abs() < 1e-12, "{found} instead of {expected} at {x}");
    }
}

ppl::model! {
    /// Observations of a plane; all sizes of the arrays are known at compile time.
    fn around_plane<const D: usize>(
        x: &[[f64; D]],
        y: &[f64],
        slope: &[Real; D],
        sd: Real,
    ) -> () {
        for (row, y) in x.iter().zip(y) {
            y ~ Normal(0.5 + dot(row, slope), sd);
        }
    }

    /// Observations of a plane whose number of slopes is known at run time.
    fn around_slopes(x: &[[f64; 2]], y: &[f64], slope: &[Real], sd: Real) -> () {
        for (row, y) in x.iter().zip(y) {
            y ~ Normal(0.5 + dot(row, slope), sd);
        }
    }

    fn plane(x: &[[f64; 2]], y: &[f64]) {
        let slope ~ Normal(0.0, 2.0).array::<2>();
        let sd ~ HalfNormal(1.0);
        let data ~ around_plane(x, y, &slope, sd);
    }

    fn slopes(x: &[[f64; 2]], y: &[f64]) {
        let slope ~ Normal(0.0, 2.0).iid(2);
        let sd ~ HalfNormal(1.0);
        let data ~ around_slopes(x, y, &slope, sd);
    }

    fn plane_in_place(x: &[[f64; 2]], y: &[f64]) {
        let slope ~ Normal(0.0, 2.0).array::<2>();
        let sd ~ HalfNormal(1.0);
        for (row, y) in x.iter().zip(y) {
            y ~ Normal(0.5 + dot(row, &slope), sd);
        }
    }

    /// A submodel whose generic argument can hold unknowns: the observed data depend on this argument.
    fn chosen<P: Parameter>(mean: P, low: &[f64], high: &[f64]) -> () {
        let mean = mean.number();
        if mean < 0.0 {
            for y in low {
                y ~ Normal(-1.0, 1.0);
            }
        } else {
            for y in high {
                y ~ Normal(2.0, 1.0);
            }
        }
    }

    fn with_a_generic_argument(low: &[f64], high: &[f64]) {
        let x ~ Normal(0.0, 1.0);
        let data ~ chosen(x, low, high);
    }

    /// A static submodel that runs a submodel whose statements depend on the value of an unknown.
    fn outer(x: Real, ys: &[f64], zs: &[f64]) -> Real {
        let inner ~ one_of_two(x, ys, zs);
        inner
    }

    fn with_a_nested_varying_submodel(ys: &[f64], zs: &[f64]) {
        let x ~ Normal(0.0, 1.0);
        let same ~ outer(x, ys, zs);
        factor(-0.1 * same.square());
    }
}

/// Formulas, plates and linear predictors of a submodel have the same derivatives as the statements
/// of the submodel written in the calling model.
#[test]
fn plates_of_a_submodel_are_those_of_its_body() {
    let x = [[0.3, 1.0], [-0.7, 2.0], [1.1, -1.0], [0.2, 0.4]];
    let y = [0.3, 1.2, -0.4, 2.0];
    let (fixed, free, whole) = (plane(&x, &y), slopes(&x, &y), plane_in_place(&x, &y));
    check::gradient(&fixed, 5);
    check::gradient(&free, 5);
    for at in [[0.2, -0.5, 0.1], [-1.0, 0.7, -0.8], [1.5, 0.1, 0.9]] {
        let (b, db) = gradient(&whole, &at);
        for (a, da) in [gradient(&fixed, &at), gradient(&free, &at)] {
            assert!((a - b).abs() < 1e-11, "{a} and {b}");
            assert!(da.iter().zip(&db).all(|(a, b)| (a - b).abs() < 1e-12), "{da:?} and {db:?}");
        }
    }
}

/// Submodels that are not static make the model not static, through generic arguments and other submodels.
#[test]
fn submodels_that_vary_are_found_through_arguments_and_submodels() {
    let (ys, zs) = ([0.3, 1.2], [0.1, 0.9, -0.4]);
    let ln_normal = |x: f64, mean: f64, sd: f64| -> f64 { Normal(mean, sd).ln_density(&x) };
    let (generic, nested) =
        (with_a_generic_argument(&ys, &zs), with_a_nested_varying_submodel(&ys, &zs));
    for x in [0.8, -0.8, 1.7, -0.1] {
        let data: f64 = match x < 0.0 {
            true => ys.iter().map(|y| ln_normal(*y, -1.0, 1.0)).sum(),
            false => zs.iter().map(|z| ln_normal(*z, 2.0, 1.0)).sum(),
        };
        let (expected, found) = (ln_normal(x, 0.0, 1.0) + data, gradient(&generic, &[x]).0);
        assert!((found - expected).abs() < 1e-12, "{found} instead of {expected} at {x}");
        let data: f64 = match x > 0.0 {
            true => ys.iter().map(|y| ln_normal(*y, x, 1.0)).sum(),
            false => zs.iter().map(|z| ln_normal(*z, 2.0 * x, 0.5)).sum(),
        };
        let expected = ln_normal(x, 0.0, 1.0) + data - 0.1 * x * x;
        let found = gradient(&nested, &[x]).0;
        assert!((found - expected).abs() < 1e-12, "{found} instead of {expected} at {x}");
    }
}
