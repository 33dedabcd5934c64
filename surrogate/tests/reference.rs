//! Reference values of part 2.6 of the project's definitions: Ishigami function and Sobol g-function.

use std::f64::consts::PI;

use approx::assert_relative_eq;
use surrogate::{Dataset, DesignMethod, FitOptions, Input, OrderRule, Pce};

const VARIANCE: f64 = 13.844587940719254;
const FIRST: [f64; 3] = [0.31390519114781146, 0.4424111447900409, 0.0];
const S13: f64 = 0.2436836640621477;
const T1: f64 = 0.5575888552099592;

fn ishigami(x: &[f64]) -> f64 {
    x[0].sin() + 7.0 * x[1].sin().powi(2) + 0.1 * x[2].powi(4) * x[0].sin()
}

fn angles() -> [Input; 3] {
    ["x1", "x2", "x3"].map(|name| Input::new(name, -PI, PI).unwrap())
}

fn dataset(design: impl IntoIterator<Item = Vec<f64>>) -> Dataset {
    let mut data = Dataset::new(angles().into(), vec!["f".into()], "Ishigami, a 7, b 0.1").unwrap();
    for x in design {
        data.push(&x, &[ishigami(&x)]).unwrap();
    }
    data
}

/// Design of points in part 2.6 of the definitions: an additive recurrence with the root g of g⁴ = g + 1.
fn fixture() -> Dataset {
    let g = 1.2207440846057596f64;
    dataset((1..=200).map(|i| {
        (1..=3).map(|j| PI * (2.0 * (0.5 + f64::from(i) * g.powi(-j)).fract() - 1.0)).collect()
    }))
}

#[test]
fn the_fixture_has_its_leave_one_out_errors_and_orders() {
    let plain = [1.0101, 0.83387, 0.86224, 0.64222, 0.39178, 0.32530, 0.067367, 0.082245, 0.015806];
    let corrected = [1.0202, 0.86797, 0.95440, 0.79149, 0.57711, 0.65255, 0.25290, 1.3801, 8.3664];
    let report = Pce::<3, 1>::fit(&fixture(), &FitOptions::default()).unwrap().report;
    assert!(report.logarithmic.is_empty(), "angles and outputs have both signs");
    for ((o, plain), corrected) in report.orders.iter().zip(plain).zip(corrected) {
        let loo = o.loo.as_ref().unwrap();
        assert_relative_eq!(loo.plain[0], plain, max_relative = 6e-5);
        assert_relative_eq!(loo.corrected[0], corrected, max_relative = 6e-5);
    }
    assert_eq!((report.order, report.order_by_split), (6, 6));
    let best = report.orders.iter().min_by(|a, b| {
        let plain = |o: &surrogate::OrderReport| o.loo.as_ref().unwrap().plain[0];
        plain(a).total_cmp(&plain(b))
    });
    assert_eq!(best.unwrap().order, 8);
    // 140 training rows do not determine the 165 terms of order 8
    assert_eq!(report.train_rows, 140);
    assert!(report.orders[7].split.is_some() && report.orders[8].split.is_none());
    assert!(report.to_string().contains("not estimable with 140 training rows"));
}

/// Independent implementation of Legendre polynomials, orthonormal for the density ½.
fn psi(k: usize, t: f64) -> f64 {
    let (mut before, mut now) = (0.0, 1.0);
    for i in 0..k {
        (before, now) = (now, ((2 * i + 1) as f64 * t * now - i as f64 * before) / (i + 1) as f64);
    }
    now * ((2 * k + 1) as f64).sqrt()
}

/// Computes ½ ∫ f ψ_k over [−1, 1] by Simpson's rule, as the mean of f ψ_k over [`from`, 1]. `from` is −1, or 0 if f
/// ψ_k is even.
fn project(f: impl Fn(f64) -> f64, k: usize, from: f64) -> f64 {
    let n = 4000;
    let h = (1.0 - from) / f64::from(n);
    let integrand = |t: f64| f(t) * psi(k, t);
    let sum: f64 = (0..n)
        .map(|i| {
            let t = from + h * f64::from(i);
            integrand(t) + 4.0 * integrand(t + h / 2.0) + integrand(t + h)
        })
        .sum();
    sum * h / 6.0 / (1.0 - from)
}

/// Returns the exact projection of the Ishigami function onto the polynomials of a total degree.
fn projection(degree: usize) -> Pce<3, 1> {
    let list =
        |f: &dyn Fn(f64) -> f64| (0..=degree).map(|k| project(f, k, -1.0)).collect::<Vec<_>>();
    let sine = list(&|t| (PI * t).sin());
    let square = list(&|t| 7.0 * (PI * t).sin().powi(2));
    let quartic = list(&|t| 1.0 + 0.1 * (PI * t).powi(4));
    let mut terms = Vec::new();
    for i in 0..=degree {
        for j in 0..=degree - i {
            terms.push((
                [i as u8, 0, j as u8],
                [sine[i] * quartic[j] + f64::from(i + j == 0) * square[0]],
            ));
        }
        if i > 0 {
            terms.push(([0, i as u8, 0], [square[i]]));
        }
    }
    Pce::from_terms(angles(), ["f".into()], terms).unwrap()
}

#[test]
fn ishigami_moments_and_indices_converge_to_the_closed_form() {
    for (degree, least) in
        [(3, 0.527), (5, 0.151), (7, 8.66e-3), (9, 1.54e-4), (11, 1.14e-6), (13, 4.09e-9)]
    {
        let fraction = 1.0 - projection(degree).variance()[0] / VARIANCE;
        assert_relative_eq!(fraction, least, max_relative = 6e-3);
    }
    let pce = projection(15);
    assert_relative_eq!(pce.mean()[0], 3.5, max_relative = 1e-12);
    assert_relative_eq!(pce.variance()[0], VARIANCE, max_relative = 1e-10);
    let sobol = pce.sobol();
    for d in 0..3 {
        assert_relative_eq!(sobol.first[0][d], FIRST[d], epsilon = 1e-10);
    }
    assert_relative_eq!(sobol.second[0][0][2], S13, epsilon = 1e-10);
    assert_relative_eq!(sobol.second[0][2][0], S13, epsilon = 1e-10);
    assert_relative_eq!(sobol.total[0][0], T1, epsilon = 1e-10);
    assert_relative_eq!(sobol.total[0][2], S13, epsilon = 1e-10);
}

#[test]
fn a_fit_comes_close_to_the_best_polynomial_of_its_degree() {
    let data = dataset(DesignMethod::Sobol.sample(&angles(), 4096, 3).unwrap());
    for (order, least) in [(7, 8.66e-3), (11, 1.14e-6)] {
        let options =
            FitOptions { max_order: 11, rule: OrderRule::Fixed(order), ..FitOptions::default() };
        let fit = Pce::<3, 1>::fit(&data, &options).unwrap();
        let loo = fit.report.chosen().unwrap().loo.as_ref().unwrap().plain[0];
        assert!(loo > least && loo < 3.0 * least, "{order} {loo}");
        let sobol = fit.pce.sobol();
        assert_relative_eq!(fit.pce.mean()[0], 3.5, epsilon = 10.0 * least.sqrt());
        assert_relative_eq!(sobol.first[0][1], FIRST[1], epsilon = least.sqrt());
        assert_relative_eq!(sobol.total[0][0], T1, epsilon = least.sqrt());
    }
}

/// The function Π_j (|4 u_j − 2| + a_j)/(1 + a_j) is a product, so that its projection is a product of one-dimensional
/// projections.
#[test]
fn sobol_g_indices_converge_to_the_closed_form() {
    let a = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 500.0];
    let variance = 0.1380266621063697;
    let first = [0.603748088, 0.268332484, 0.067083121, 0.019958615, 0.005476173];
    let total = [0.634229004, 0.294463466, 0.075641991, 0.022651036, 0.006227324];
    // |4u − 2| = 2|t| is even in t
    let ridge: Vec<f64> =
        (0..=12).map(|k| if k % 2 == 0 { project(|t| 2.0 * t, k, 0.0) } else { 0.0 }).collect();
    let inputs: [Input; 8] =
        std::array::from_fn(|j| Input::new(format!("u{j}"), 0.0, 1.0).unwrap());
    let mut error = f64::INFINITY;
    for degree in [2usize, 4, 8, 12] {
        let mut terms = vec![([0u8; 8], 1.0)];
        for j in 0..8 {
            terms = terms
                .iter()
                .flat_map(|&(index, c)| {
                    let left = degree - index.iter().map(|&k| usize::from(k)).sum::<usize>();
                    (0..=left).step_by(2).map(move |k| (index, c, k))
                })
                .map(|(mut index, c, k)| {
                    index[j] = k as u8;
                    (index, if k == 0 { c } else { c * ridge[k] / (1.0 + a[j]) })
                })
                .collect();
        }
        let terms = terms.into_iter().map(|(index, c)| (index, [c]));
        let pce = Pce::from_terms(inputs.clone(), ["g".into()], terms).unwrap();
        assert_relative_eq!(pce.mean()[0], 1.0);
        let sobol = pce.sobol();
        let now = (0..5)
            .map(|j| (sobol.first[0][j] - first[j]).abs().max((sobol.total[0][j] - total[j]).abs()))
            .fold(1.0 - pce.variance()[0] / variance, f64::max);
        assert!(now > 0.0 && now < 0.6 * error, "{degree}: {now}");
        error = now;
    }
    assert!(error < 3e-3, "{error}");
}
