//! Fits: order rules, errors, leverage, and rejected inputs.

use approx::assert_relative_eq;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::{
    Dataset, DesignMethod, FitOptions, Holdout, Input, OrderRule, Pce, Scales, SurrogateError,
    Truncation,
};

fn inputs(d: usize) -> Vec<Input> {
    (0..d).map(|i| Input::new(format!("x{i}"), -1.0, 3.0 + i as f64).unwrap()).collect()
}

fn runs(
    d: usize,
    outputs: &[&str],
    n: usize,
    seed: u64,
    f: impl Fn(&[f64]) -> Vec<f64>,
) -> Dataset {
    let names = outputs.iter().map(|s| (*s).to_owned()).collect();
    let mut data = Dataset::new(inputs(d), names, "closed form").unwrap();
    for x in DesignMethod::LatinHypercube.sample(&inputs(d), n, seed).unwrap() {
        data.push(&x, &f(&x)).unwrap();
    }
    data
}

/// Two smooth outputs that are not polynomials.
fn smooth(x: &[f64]) -> Vec<f64> {
    vec![(0.5 * x[0] - 0.3 * x[1]).exp(), 1.0 / (6.0 + x[0] + x[1] * x[1])]
}

#[test]
fn the_reported_errors_are_those_of_refits_without_each_row() {
    let data = runs(2, &["f", "g"], 30, 1, smooth);
    let fixed = |order| FitOptions {
        rule: OrderRule::Fixed(order),
        scales: Scales::Linear,
        ..FitOptions::default()
    };
    for order in [0, 2, 4] {
        let fit = Pce::<2, 2>::fit(&data, &fixed(order)).unwrap();
        let mut residuals = Vec::new();
        for left_out in 0..data.len() {
            let mut rest = Dataset::new(inputs(2), data.outputs().to_vec(), "").unwrap();
            for (x, y) in data.rows().enumerate().filter(|(i, _)| *i != left_out).map(|(_, r)| r) {
                rest.push(x, y).unwrap();
            }
            let pce = Pce::<2, 2>::fit(&rest, &fixed(order)).unwrap().pce;
            let (x, y) = data.row(left_out);
            let f = pce.value(&[x[0], x[1]]).unwrap();
            residuals.push([y[0] - f[0], y[1] - f[1]]);
        }
        let n = residuals.len() as f64;
        let loo = fit.report.orders[order].loo.as_ref().unwrap();
        let error = fit.report.lack_of_fit(&[1.0, 1.0]).unwrap();
        let mean = |m: usize| residuals.iter().map(|r| r[m]).sum::<f64>() / n;
        for m in 0..2 {
            let average = data.rows().map(|(_, y)| y[m]).sum::<f64>() / n;
            let variance = data.rows().map(|(_, y)| (y[m] - average).powi(2)).sum::<f64>() / n;
            let square = residuals.iter().map(|r| r[m] * r[m]).sum::<f64>() / n / variance;
            assert_relative_eq!(loo.plain[m], square, max_relative = 1e-12);
            for k in 0..2 {
                let covariance =
                    residuals.iter().map(|r| (r[m] - mean(m)) * (r[k] - mean(k))).sum::<f64>()
                        / (n - 1.0);
                assert_relative_eq!(error[m][k], covariance, max_relative = 1e-10, epsilon = 1e-16);
            }
        }
    }
}

#[test]
fn leverages_sum_to_the_terms_and_peak_at_a_corner() {
    let data = runs(2, &["f", "g"], 40, 2, smooth);
    let fit =
        Pce::<2, 2>::fit(&data, &FitOptions { rule: OrderRule::Fixed(3), ..FitOptions::default() })
            .unwrap();
    let leverages: Vec<f64> =
        data.rows().map(|(x, _)| fit.leverage(&[x[0], x[1]]).unwrap()).collect();
    assert_relative_eq!(leverages.iter().sum::<f64>(), 10.0, max_relative = 1e-12);
    let largest = leverages.iter().copied().fold(0.0, f64::max);
    assert_relative_eq!(fit.report.largest_leverage, largest, max_relative = 1e-12);
    let corners =
        [[-1.0, -1.0], [-1.0, 4.0], [3.0, -1.0], [3.0, 4.0]].map(|x| fit.leverage(&x).unwrap());
    let corner = corners.into_iter().fold(0.0, f64::max);
    assert_relative_eq!(fit.report.largest_corner_leverage.unwrap(), corner, max_relative = 1e-12);
    assert!(fit.leverage(&[9.0, 0.0]).is_err());
}

/// Checks that the variance of repeated fits at a point is the leverage h(x) times the variance of the noise, within 4
/// standard errors.
#[test]
fn leverage_is_the_variance_of_the_fit() {
    let (repeats, sd) = (400, 0.1);
    let x = [2.9, -0.9];
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
    let mut noise = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
    let options = FitOptions { rule: OrderRule::Fixed(2), ..FitOptions::default() };
    let mut errors = Vec::new();
    let mut leverage = 0.0;
    for _ in 0..repeats {
        let mut data = Dataset::new(inputs(2), vec!["f".into()], "").unwrap();
        for p in DesignMethod::Sobol.sample(&inputs(2), 32, 1).unwrap() {
            data.push(&p, &[p[0] * p[1] + sd * noise()]).unwrap();
        }
        let fit = Pce::<2, 1>::fit(&data, &options).unwrap();
        errors.push(fit.pce.value(&x).unwrap()[0] - x[0] * x[1]);
        leverage = fit.leverage(&x).unwrap();
    }
    let variance = errors.iter().map(|e| e * e).sum::<f64>() / f64::from(repeats);
    let expected = leverage * sd * sd;
    assert!(
        (variance - expected).abs() < 4.0 * expected * (2.0 / f64::from(repeats)).sqrt(),
        "{variance} {expected}"
    );
}

/// Fits a setting as in the paper: a cubic response with 2 % noise, 100 runs, three inputs.
#[test]
fn both_rules_find_the_order_of_a_noisy_cubic() {
    let (mut by_loo, mut by_split) = (0, 0);
    for seed in 0..20 {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut data = Dataset::new(inputs(3), vec!["f".into()], "").unwrap();
        for x in DesignMethod::Sobol.sample(&inputs(3), 100, seed).unwrap() {
            let t = [(x[0] - 1.0) / 2.0, (x[1] - 1.5) / 2.5, (x[2] - 2.0) / 3.0];
            let f = 1.0 + 0.3 * t[0] + 0.2 * t[1] * t[2] - 0.2 * t[0] * t[0] * t[2]
                + 0.15 * t[1].powi(3);
            data.push(&x, &[f * (1.0 + 0.02 * 12f64.sqrt() * (rng.random::<f64>() - 0.5))])
                .unwrap();
        }
        let report = Pce::<3, 1>::fit(&data, &FitOptions::default()).unwrap().report;
        by_loo += u32::from(report.order_by_loo == 3);
        by_split += u32::from(report.order_by_split == 3);
        assert!(report.orders[7].loo.is_none(), "120 terms, 100 rows");
    }
    assert!(by_loo >= 19 && by_split >= 18, "{by_loo} {by_split}");
}

#[test]
fn exact_polynomials_are_recovered_at_their_own_order() {
    let cubic = |x: &[f64]| vec![1.0 + x[0] * x[1] * x[2] - 2.0 * x[0].powi(3)];
    let data = runs(3, &["f"], 60, 3, cubic);
    for rule in [OrderRule::CorrectedLoo, OrderRule::Split] {
        let fit = Pce::<3, 1>::fit(&data, &FitOptions { rule, ..FitOptions::default() }).unwrap();
        assert_eq!(fit.report.order, 3);
        let x = [0.3, 2.2, -0.4];
        assert_relative_eq!(fit.pce.value(&x).unwrap()[0], cubic(&x)[0], max_relative = 1e-11);
    }
    // a sum of functions of one input each has few terms in a hyperbolic truncation
    let ridge = runs(3, &["f"], 60, 5, |x| vec![x[0].powi(6) + x[2]]);
    let options =
        FitOptions { truncation: Truncation::Hyperbolic { q: 0.5 }, ..FitOptions::default() };
    let fit = Pce::<3, 1>::fit(&ridge, &options).unwrap();
    assert_eq!(fit.report.order, 6);
    assert_relative_eq!(fit.pce.value(&[2.0, 0.0, 1.0]).unwrap()[0], 65.0, max_relative = 1e-10);
}

#[test]
fn a_seed_fixes_the_split() {
    let data = runs(2, &["f", "g"], 40, 6, smooth);
    let report = |seed| {
        let split = Holdout { seed, ..Holdout::default() };
        Pce::<2, 2>::fit(&data, &FitOptions { split, ..FitOptions::default() }).unwrap().report
    };
    assert_eq!(report(1), report(1));
    assert_ne!(report(1).orders[2].split, report(2).orders[2].split);
    assert_eq!(report(1).orders[2].loo, report(2).orders[2].loo);
}

#[test]
fn repeated_rows_leave_orders_without_an_estimate() {
    let mut data = Dataset::new(inputs(1), vec!["f".into()], "").unwrap();
    for i in 0..12 {
        let x = f64::from(i % 3);
        data.push(&[x], &[x * x + 0.1 * f64::from(i)]).unwrap();
    }
    // runs at three points determine a parabola and no higher order
    let report = Pce::<1, 1>::fit(&data, &FitOptions::default()).unwrap().report;
    assert!(report.orders[2].loo.is_some() && report.orders[3].loo.is_none());
    let fixed = FitOptions { rule: OrderRule::Fixed(3), ..FitOptions::default() };
    assert!(matches!(
        Pce::<1, 1>::fit(&data, &fixed),
        Err(SurrogateError::NotEstimable { order: 3, terms: 4, rows: 12 })
    ));
}

#[test]
fn unusable_data_and_options_are_refused() {
    let fit = |data: &Dataset, options: &FitOptions| {
        Pce::<2, 2>::fit(data, options).map(|f| f.report.order).unwrap_err()
    };
    let data = runs(2, &["f", "g"], 20, 1, smooth);
    let defaults = FitOptions::default();
    for options in [
        FitOptions { max_order: 17, ..FitOptions::default() },
        FitOptions { rule: OrderRule::Fixed(9), ..FitOptions::default() },
        FitOptions { truncation: Truncation::Hyperbolic { q: 0.0 }, ..FitOptions::default() },
        FitOptions { truncation: Truncation::Hyperbolic { q: f64::NAN }, ..FitOptions::default() },
        FitOptions {
            split: Holdout { train_fraction: 1.0, ..Holdout::default() },
            ..FitOptions::default()
        },
        FitOptions {
            split: Holdout { tolerance: -1.0, ..Holdout::default() },
            ..FitOptions::default()
        },
    ] {
        assert!(matches!(fit(&data, &options), SurrogateError::Option { .. }), "{options:?}");
    }
    let constant = runs(2, &["f", "g"], 20, 1, |x| vec![x[0], 4.0]);
    assert!(fit(&constant, &defaults).to_string().contains("`g` is 4 in every row"));
    assert!(matches!(
        fit(&runs(2, &["f", "g"], 1, 1, smooth), &defaults),
        SurrogateError::Count { .. }
    ));
    assert!(matches!(
        fit(&runs(3, &["f", "g"], 20, 1, smooth), &defaults),
        SurrogateError::Count { .. }
    ));
}
