//! Runs in groups, compared with the analysis of variance and with simulations.

use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::{
    Dataset, DesignMethod, DynPce, FitOptions, GroupedRuns, Input, OrderRule, PceFit, Scale, Scales,
};

fn inputs() -> Vec<Input> {
    vec![Input::new("a", 0.0, 1.0).unwrap(), Input::new("k", -1.0, 1.0).unwrap()]
}

fn fit(data: &Dataset, order: usize) -> PceFit {
    let scales = Scales::Given { inputs: vec![Scale::Linear; 2], outputs: vec![Scale::Linear; 2] };
    let rule = OrderRule::Fixed(order);
    DynPce::fit(data, &FitOptions { max_order: order, rule, scales, ..FitOptions::default() })
        .unwrap()
}

fn dataset() -> Dataset {
    Dataset::new(inputs(), vec!["p".into(), "q".into()], "simulated").unwrap()
}

/// Cholesky factors of B and W.
const BETWEEN: [[f64; 2]; 2] = [[0.3, 0.0], [0.12, 0.16]];
const WITHIN: [[f64; 2]; 2] = [[0.1, 0.0], [-0.06, 0.08]];

fn normal(rng: &mut impl Rng, factor: &[[f64; 2]; 2]) -> [f64; 2] {
    let z: [f64; 2] = [rng.sample(StandardNormal), rng.sample(StandardNormal)];
    factor.map(|row| row[0] * z[0] + row[1] * z[1])
}

fn square(factor: &[[f64; 2]; 2], i: usize, j: usize) -> f64 {
    factor[i][0] * factor[j][0] + factor[i][1] * factor[j][1]
}

/// Simulates runs whose groups alternate. The input k has one value per group, and the response is linear in both
/// inputs.
fn simulated(design: &[Vec<f64>], groups: &[usize], k: &[f64], rng: &mut impl Rng) -> Dataset {
    let deviations: Vec<[f64; 2]> = k.iter().map(|_| normal(rng, &BETWEEN)).collect();
    let mut data = dataset();
    for (x, &group) in design.iter().zip(groups) {
        let (b, e, k) = (deviations[group], normal(rng, &WITHIN), k[group]);
        let mean = [2.0 + x[0] + 0.5 * k, 1.0 - x[0] + 0.2 * k];
        data.push(&[x[0], k], &[mean[0] + b[0] + e[0], mean[1] + b[1] + e[1]]).unwrap();
    }
    data
}

#[test]
fn groups_of_one_size_about_a_mean_are_the_analysis_of_variance() {
    let values = [[1.0, 4.0], [1.4, 4.4], [0.9, 4.9], [2.0, 3.0], [2.6, 3.1], [2.3, 3.8]];
    let groups = [0, 0, 0, 7, 7, 7];
    let mut data = dataset();
    for (i, value) in values.iter().enumerate() {
        data.push(&[0.1 * i as f64, 0.3], value).unwrap();
    }
    let errors = GroupedRuns::of(&fit(&data, 0), &data, &groups).unwrap();
    let at = [1.0, 1.0];
    let (within, between) =
        (errors.within.scatter(&at).unwrap(), errors.between.scatter(&at).unwrap());
    let mean = |rows: &[[f64; 2]], m: usize| {
        rows.iter().map(|row| row[m]).sum::<f64>() / rows.len() as f64
    };
    let all: [f64; 2] = [0, 1].map(|m| mean(&values, m));
    let (mut msw, mut msb) = ([[0.0; 2]; 2], [[0.0; 2]; 2]);
    for group in values.chunks(3) {
        let group_mean = [0, 1].map(|m| mean(group, m));
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            msb[i][j] += 3.0 * (group_mean[i] - all[i]) * (group_mean[j] - all[j]);
            msw[i][j] +=
                group.iter().map(|y| (y[i] - group_mean[i]) * (y[j] - group_mean[j])).sum::<f64>()
                    / 4.0;
        }
    }
    for (i, j) in [(0, 0), (0, 1), (1, 1)] {
        assert!((within[i][j] - msw[i][j]).abs() < 1e-12, "{within:?} {msw:?}");
    }
    // for two outputs and one degree of freedom, B has a negative eigenvalue; the estimate is the nearest semidefinite
    // matrix
    let raw = |i: usize, j: usize| (msb[i][j] - msw[i][j]) / 3.0;
    assert!(raw(0, 0) * raw(1, 1) < raw(0, 1).powi(2));
    let determinant = between[0][0] * between[1][1] - between[0][1].powi(2);
    assert!(determinant.abs() < 1e-12 && between[0][0] >= raw(0, 0), "{between:?}");
    assert!((errors.between.leverage(&[0.2, 0.0]).unwrap() - 0.5).abs() < 1e-12);
    assert_eq!(errors.between.freedom(), 1.0);
    assert_eq!(errors.within.freedom(), 4.0);
}

/// If every group has only one run, the error is the error of independent runs.
#[test]
fn groups_of_one_run_are_runs() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
    let design = DesignMethod::LatinHypercube.sample(&inputs(), 20, 3).unwrap();
    let groups: Vec<usize> = (0..20).collect();
    let k: Vec<f64> = design.iter().map(|x| x[1]).collect();
    let data = simulated(&design, &groups, &k, &mut rng);
    let fit = fit(&data, 1);
    let errors = GroupedRuns::of(&fit, &data, &groups).unwrap();
    let point = [0.8, -0.4];
    let expected = fit.coefficients.error(&point, &[1.0; 2]).unwrap();
    let between = errors.between.error(&point, &[1.0; 2]).unwrap();
    for (a, b) in expected.iter().flatten().zip(between.iter().flatten()) {
        assert!((a - b).abs() < 1e-12 * expected[0][0], "{expected:?} {between:?}");
    }
    assert!(errors.within.error(&point, &[1.0; 2]).unwrap().iter().flatten().all(|c| *c == 0.0));
    let (mean, independent) = (
        errors.between.mean_error(&[1.0; 2]).unwrap()[0][0],
        fit.report.mean_error(&[1.0; 2]).unwrap()[0][0],
    );
    assert!((mean / independent - 1.0).abs() < 1e-12);
}

/// Compares the estimated components and the covariance of the fit with many simulated datasets, for an input that all
/// runs of a group share and for groups of different sizes.
#[test]
fn components_and_the_error_of_the_fit_are_those_of_simulated_runs() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let design = DesignMethod::LatinHypercube.sample(&inputs(), 26, 9).unwrap();
    let groups: Vec<usize> = (0..26).map(|i| if i < 20 { i % 5 } else { 0 }).collect();
    let k = [-0.9, -0.3, 0.1, 0.5, 0.8];
    let (point, truth) = ([0.9, 0.7], [2.0 + 0.9 + 0.35, 1.0 - 0.9 + 0.14]);
    let replicates = 3000;
    let (mut within, mut between, mut error) = (Vec::new(), Vec::new(), Vec::new());
    let mut expected = Vec::new();
    for replicate in 0..replicates {
        let data = simulated(&design, &groups, &k, &mut rng);
        let fit = fit(&data, 1);
        let errors = GroupedRuns::of(&fit, &data, &groups).unwrap();
        within.push(errors.within.scatter(&[1.0; 2]).unwrap());
        between.push(errors.between.scatter(&[1.0; 2]).unwrap());
        let off = fit.pce.value(&point).unwrap();
        let off = [off[0] - truth[0], off[1] - truth[1]];
        error.push(vec![vec![off[0] * off[0], off[0] * off[1]], vec![0.0, off[1] * off[1]]]);
        if replicate == 0 {
            let [h, g] =
                [&errors.within, &errors.between].map(|error| error.leverage(&point).unwrap());
            expected = vec![h, g];
            assert_eq!(errors.between.freedom(), 3.0);
            // the constant term and the term of the shared input are determined by groups, not by runs
            assert!(g > 0.2 && h < 0.25, "{h} {g}");
        }
    }
    let check = |what: &str, found: &[Vec<Vec<f64>>], (i, j): (usize, usize), expected: f64| {
        let n = found.len() as f64;
        let mean = found.iter().map(|c| c[i][j]).sum::<f64>() / n;
        let variance = found.iter().map(|c| (c[i][j] - mean).powi(2)).sum::<f64>() / n;
        let error = (variance / n).sqrt();
        assert!((mean - expected).abs() < 4.0 * error, "{what} {i}{j}: {mean} {expected} {error}");
    };
    for (i, j) in [(0, 0), (0, 1), (1, 1)] {
        let (w, b) = (square(&WITHIN, i, j), square(&BETWEEN, i, j));
        check("W", &within, (i, j), w);
        check("B", &between, (i, j), b);
        check("error", &error, (i, j), w * expected[0] + b * expected[1]);
    }
}

#[test]
fn groups_that_tell_nothing_are_refused() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
    let design = DesignMethod::LatinHypercube.sample(&inputs(), 12, 3).unwrap();
    let groups: Vec<usize> = (0..12).map(|i| i % 2).collect();
    let data = simulated(&design, &groups, &[-0.5, 0.5], &mut rng);
    let refused = |order: usize, groups: &[usize]| {
        GroupedRuns::of(&fit(&data, order), &data, groups).unwrap_err().to_string()
    };
    assert!(refused(0, &groups[..11]).contains("groups of runs"));
    assert!(refused(0, &[4; 12]).contains("or more groups of runs"));
    // the input k explains all differences between two groups
    assert!(refused(1, &groups).contains("degrees of freedom between groups"));
    assert!(GroupedRuns::of(&fit(&data, 0), &data, &groups).is_ok());
}
