//! Posterior of the coefficients: coverage of its intervals, and the choice of points for further runs.

use approx::assert_relative_eq;
use ppl::DynDifferentiable;
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::{
    CoefficientPosterior, Dataset, DesignMethod, DynPce, FitOptions, Input, OrderRule, PceFit,
    Scale, Scales, SurrogateError, Terms,
};

fn inputs(d: usize) -> Vec<Input> {
    (0..d).map(|i| Input::new(format!("x{i}"), 1.0, 2.0 + i as f64).unwrap()).collect()
}

/// Two outputs that are quadratic in two inputs.
fn response(x: &[f64]) -> [f64; 2] {
    [3.0 + x[0] * x[1] - 0.3 * x[1] * x[1], 2.0 * x[0] - x[1] + 0.2 * x[0] * x[0]]
}

/// Returns runs of [`response`] with correlated noise, whose standard deviations are 0.1 and 0.2.
fn noisy(n: usize, outputs: usize, rng: &mut Xoshiro256PlusPlus) -> Dataset {
    let names = ["f", "g"].map(str::to_owned)[..outputs].to_vec();
    let mut data = Dataset::new(inputs(2), names, "").unwrap();
    for x in DesignMethod::LatinHypercube.sample(&inputs(2), n, rng.random()).unwrap() {
        let z: [f64; 2] = [0, 1].map(|_| rng.sample(StandardNormal));
        let [f, g] = response(&x);
        let y = [f + 0.1 * z[0], g + 0.2 * (0.6 * z[0] + 0.8 * z[1])];
        data.push(&x, &y[..outputs]).unwrap();
    }
    data
}

fn fixed(order: usize) -> FitOptions {
    let scales = Scales::Given { inputs: vec![Scale::Linear; 2], outputs: vec![Scale::Linear; 2] };
    FitOptions { rule: OrderRule::Fixed(order), scales, ..FitOptions::default() }
}

/// Squared Mahalanobis distance (f − f̂)ᵀ (s² h)⁻¹ (f − f̂) of two outputs.
fn squared_distance(posterior: &CoefficientPosterior, x: &[f64], f: &[f64]) -> f64 {
    let estimate = posterior.estimate().value(x).unwrap();
    let s = posterior.error(x, &estimate).unwrap();
    let [a, b] = [f[0] - estimate[0], f[1] - estimate[1]];
    let determinant = s[0][0] * s[1][1] - s[0][1] * s[1][0];
    (a * a * s[1][1] - 2.0 * a * b * s[0][1] + b * b * s[0][0]) / determinant
}

/// Checks that the ranks of the truth among 19 draws are uniform, at one random point of each of many datasets. For one
/// output, the value is ranked; for two outputs, the distance from the estimate. Both ranks are exactly uniform (t and
/// Hotelling's T²), even for few runs.
#[test]
fn draws_are_as_wide_as_the_estimate_is_wrong() {
    let (repeats, bins) = (600, 20);
    for outputs in [1, 2] {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(outputs as u64);
        let mut counts = vec![0.0; bins];
        for _ in 0..repeats {
            let options = match outputs {
                1 => FitOptions {
                    scales: Scales::Given {
                        inputs: vec![Scale::Linear; 2],
                        outputs: vec![Scale::Linear],
                    },
                    ..fixed(2)
                },
                _ => fixed(2),
            };
            let fit = DynPce::fit(&noisy(12, outputs, &mut rng), &options).unwrap();
            let posterior = &fit.coefficients;
            assert_eq!(posterior.freedom(), 6.0);
            let x = [rng.random_range(1.0..2.0), rng.random_range(1.0..3.0)];
            let statistic = |f: &[f64]| match outputs {
                1 => f[0],
                _ => squared_distance(posterior, &x, f),
            };
            let truth = statistic(&response(&x)[..outputs]);
            let below = (1..bins)
                .filter(|_| {
                    statistic(&posterior.draw(&mut rng).unwrap().value(&x).unwrap()) < truth
                })
                .count();
            counts[below] += 1.0;
        }
        let expected = f64::from(repeats) / bins as f64;
        let chi: f64 = counts.iter().map(|c| (c - expected).powi(2) / expected).sum();
        // χ² with 19 degrees of freedom exceeds 43.8 with probability 0.001
        assert!(chi < 43.8, "{outputs}: {chi} {counts:?}");
    }
}

/// Compares the sample covariance of many draws at a point with the covariance s² h ν/(ν − M − 1) of a multivariate t
/// distribution.
#[test]
fn draws_have_the_covariance_of_their_t_distribution() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let fit = DynPce::fit(&noisy(40, 2, &mut rng), &fixed(2)).unwrap();
    let (posterior, x, draws) = (&fit.coefficients, [1.1, 2.7], 4000);
    let estimate = fit.pce.value(&x).unwrap();
    let error = posterior.error(&x, &estimate).unwrap();
    let mut sample = [[0.0; 2]; 2];
    for _ in 0..draws {
        let f = posterior.draw(&mut rng).unwrap().value(&x).unwrap();
        for (m, row) in sample.iter_mut().enumerate() {
            for (k, entry) in row.iter_mut().enumerate() {
                *entry += (f[m] - estimate[m]) * (f[k] - estimate[k]) / f64::from(draws);
            }
        }
    }
    let wider = posterior.freedom() / (posterior.freedom() - 3.0);
    for m in 0..2 {
        for k in 0..2 {
            let scale = wider * (error[m][m] * error[k][k]).sqrt();
            // with 33 degrees of freedom, the tails increase the variance of the second moment only a little
            let tolerance = 4.0 * scale * (2.2 / f64::from(draws)).sqrt();
            assert!((sample[m][k] - wider * error[m][k]).abs() < tolerance, "{sample:?} {error:?}");
        }
    }
}

/// Checks intervals of ±1.645 standard errors for fits whose terms were selected with the data. The intervals contain
/// the truth in 90 % of the repeats, up to four standard errors of the count. Intervals from the variance of the
/// residuals would contain it less often.
#[test]
fn chosen_terms_do_not_flatter() {
    let (repeats, runs) = (120, 30);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(9);
    let f = |x: &[f64]| 2.0 * x[0] - x[1] + 0.5 * x[2];
    let (mut held, mut flattered) = (0, 0);
    for _ in 0..repeats {
        let mut data = Dataset::new(inputs(5), vec!["f".into()], "").unwrap();
        for x in DesignMethod::LatinHypercube.sample(&inputs(5), runs, rng.random()).unwrap() {
            data.push(&x, &[f(&x) + 0.5 * rng.sample::<f64, _>(StandardNormal)]).unwrap();
        }
        let scales = Scales::Given { inputs: vec![Scale::Linear; 5], outputs: vec![Scale::Linear] };
        let options =
            FitOptions { terms: Terms::Sparse, max_order: 2, scales, ..FitOptions::default() };
        let fit = DynPce::fit(&data, &options).unwrap();
        let x: Vec<f64> = inputs(5).iter().map(|i| rng.random_range(i.lower..i.upper)).collect();
        let value = fit.pce.value(&x).unwrap();
        let missed = (value[0] - f(&x)).abs();
        let h = fit.leverage(&x).unwrap();
        let variance = fit.report.scatter(&value).unwrap()[0][0];
        held +=
            u32::from(missed < 1.645 * fit.coefficients.error(&x, &value).unwrap()[0][0].sqrt());
        flattered += u32::from(missed < 1.645 * (variance * h).sqrt());
    }
    let least = 0.9 - 4.0 * (0.09 / f64::from(repeats)).sqrt();
    println!("{held} and {flattered} of {repeats}");
    assert!(f64::from(held) / f64::from(repeats) > least, "{held}");
    assert!(flattered < held, "{flattered}");
}

/// Checks that intervals of Sobol indices contain the exact indices, also for an input without influence.
#[test]
fn intervals_of_sobol_indices_cover() {
    // a = x0 − 1 and b = (x1 − 1)/2 are uniform on [0, 1]; f = a + 2b + ab, and x2 has no influence
    let f = |x: &[f64]| {
        let (a, b) = (x[0] - 1.0, 0.5 * (x[1] - 1.0));
        a + 2.0 * b + a * b
    };
    // in deviations α, β from the means ½: 1.5 α + 2.5 β + α β, where α and β have the variance 1/12
    let variances = [2.25 / 12.0, 6.25 / 12.0, 1.0 / 144.0];
    let whole: f64 = variances.iter().sum();
    let total = [(variances[0] + variances[2]) / whole, (variances[1] + variances[2]) / whole, 0.0];
    let (repeats, mut held) = (100, [0; 3]);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(21);
    for seed in 0..repeats {
        let mut data = Dataset::new(inputs(3), vec!["f".into()], "").unwrap();
        for x in DesignMethod::LatinHypercube.sample(&inputs(3), 40, rng.random()).unwrap() {
            data.push(&x, &[f(&x) + 0.2 * rng.sample::<f64, _>(StandardNormal)]).unwrap();
        }
        let scales = Scales::Given { inputs: vec![Scale::Linear; 3], outputs: vec![Scale::Linear] };
        let options =
            FitOptions { rule: OrderRule::Fixed(2), scales, max_order: 2, ..FitOptions::default() };
        let fit = DynPce::fit(&data, &options).unwrap();
        let intervals = fit.coefficients.sobol_intervals(0.9, seed).unwrap();
        for (i, held) in held.iter_mut().enumerate() {
            let [low, high] = intervals.total[0][i];
            *held += u32::from(low <= total[i] && total[i] <= high);
        }
    }
    println!("{held:?} of {repeats}");
    let least = 0.9 - 4.0 * (0.09 / repeats as f64).sqrt();
    assert!(held.iter().all(|&held| f64::from(held) / repeats as f64 > least), "{held:?}");
}

/// Checks that the interval contains the index on logarithmic scales too.
#[test]
fn intervals_on_logarithmic_scales_hold_the_index() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
    let mut data = Dataset::new(inputs(3), vec!["f".into()], "").unwrap();
    for x in DesignMethod::Sobol.sample(&inputs(3), 64, 1).unwrap() {
        let noise = 0.01 * rng.sample::<f64, _>(StandardNormal);
        data.push(&x, &[x[0].powi(2) * x[1].sqrt() * noise.exp()]).unwrap();
    }
    let scales = Scales::Given { inputs: vec![Scale::Log; 3], outputs: vec![Scale::Log] };
    let fit = DynPce::fit(&data, &FitOptions { scales, ..FitOptions::default() }).unwrap();
    let (indices, intervals) = (fit.pce.sobol(), fit.coefficients.sobol_intervals(0.9, 1).unwrap());
    for i in 0..2 {
        let [low, high] = intervals.first[0][i];
        assert!(low <= indices.first[0][i] && indices.first[0][i] <= high, "{intervals:?}");
        assert!(high - low < 0.05 && high > low, "{intervals:?}");
    }
    assert!(intervals.total[0][2][1] < 0.01, "{intervals:?}");
    assert!(fit.coefficients.sobol_intervals(1.0, 1).is_err());
}

/// Compares the leverage of the posterior with the leverage of the fit, and the derivatives of the leverage with finite
/// differences, on linear and logarithmic scales.
#[test]
fn the_leverage_is_a_function_with_slopes() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let data = noisy(30, 2, &mut rng);
    let scales = Scales::Given {
        inputs: vec![Scale::Log, Scale::Linear],
        outputs: vec![Scale::Log, Scale::Linear],
    };
    let options = FitOptions { terms: Terms::Sparse, scales, max_order: 4, ..fixed(2) };
    for options in [fixed(3), FitOptions { rule: OrderRule::CorrectedLoo, ..options }] {
        let fit = DynPce::fit(&data, &options).unwrap();
        let (posterior, x) = (&fit.coefficients, [1.3, 2.2]);
        let (value, slopes) = DynDifferentiable::value_and_jacobian(posterior, &x).unwrap();
        assert_relative_eq!(value[0], fit.leverage(&x).unwrap(), max_relative = 1e-13);
        for i in 0..2 {
            let at = |step: f64| {
                let mut x = x;
                x[i] += step;
                posterior.leverage(&x).unwrap()
            };
            let difference = (at(1e-5) - at(-1e-5)) / 2e-5;
            assert_relative_eq!(slopes[0][i], difference, max_relative = 1e-7);
        }
        assert!(DynDifferentiable::value_and_jacobian(posterior, &[9.0, 2.0]).is_err());
    }
}

/// Checks the choice of points by brute force: adding a run at the first point reduces the mean leverage most, and a
/// run at the second point reduces it most after that.
#[test]
fn runs_are_placed_where_they_take_the_most() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
    let mut data = noisy(15, 2, &mut rng);
    let places: Vec<Vec<f64>> =
        (0..12).map(|_| vec![rng.random_range(1.5..1.8), rng.random_range(1.0..3.0)]).collect();
    let mean = |fit: &PceFit| {
        places.iter().map(|x| fit.leverage(x).unwrap()).sum::<f64>() / places.len() as f64
    };
    let fit = |data: &Dataset| DynPce::fit(data, &fixed(2)).unwrap();
    let chosen = fit(&data).coefficients.placement(&places, 4).unwrap();
    for (k, &place) in chosen.iter().enumerate() {
        let after: Vec<f64> = places
            .iter()
            .map(|x| {
                let mut more = data.clone();
                more.push(x, &response(x)).unwrap();
                mean(&fit(&more))
            })
            .collect();
        let free = (0..places.len()).filter(|place| !chosen[..k].contains(place));
        let best = free.min_by(|&a, &b| after[a].total_cmp(&after[b])).unwrap();
        assert_eq!(best, place, "{k}: {after:?}");
        data.push(&places[place], &response(&places[place])).unwrap();
    }
    let all = fit(&data).coefficients.placement(&places, 99).unwrap();
    assert_eq!(all.len(), 12, "a place is chosen once");
    assert_eq!(fit(&data).coefficients.placement(&[], 3).unwrap(), Vec::<usize>::new());
    assert!(fit(&data).coefficients.placement(&[vec![7.0, 1.0]], 1).is_err());
}

/// Compares the error at some rows with the leave-one-out residuals of these rows.
#[test]
fn the_error_about_some_rows_is_theirs() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(8);
    let data = noisy(24, 2, &mut rng);
    let fit = DynPce::fit(&data, &fixed(2)).unwrap();
    let rows = [1, 4, 9, 16];
    let mut expected = [[0.0; 2]; 2];
    for row in rows {
        let mut others = Dataset::new(inputs(2), data.outputs().to_vec(), "").unwrap();
        for (i, (x, y)) in data.rows().enumerate() {
            if i != row {
                others.push(x, y).unwrap();
            }
        }
        let (x, y) = data.row(row);
        let predicted = DynPce::fit(&others, &fixed(2)).unwrap().pce.value(x).unwrap();
        let missed = [y[0] - predicted[0], y[1] - predicted[1]];
        for (m, line) in expected.iter_mut().enumerate() {
            line.iter_mut().zip(missed).for_each(|(entry, r)| *entry += missed[m] * r / 4.0);
        }
    }
    let reported = fit.about(&rows).unwrap().lack_of_fit(&[1.0, 1.0]).unwrap();
    for (found, expected) in reported.iter().flatten().zip(expected.as_flattened()) {
        assert_relative_eq!(*found, *expected, max_relative = 1e-9);
    }
    assert!(fit.about(&[]).is_err() && fit.about(&[24]).is_err());
}

/// Checks that the posterior can be written to a file and read, and that a file with a missing row is rejected.
#[test]
fn it_is_kept_in_a_file() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(6);
    let fit = DynPce::fit(&noisy(20, 2, &mut rng), &fixed(2)).unwrap();
    let text = serde_json::to_string(&fit.coefficients).unwrap();
    let back: CoefficientPosterior = serde_json::from_str(&text).unwrap();
    assert_eq!(back, fit.coefficients);
    let mut damaged: serde_json::Value = serde_json::from_str(&text).unwrap();
    damaged["factor"].as_array_mut().unwrap().pop();
    let error = serde_json::from_value::<CoefficientPosterior>(damaged).unwrap_err();
    assert!(error.to_string().contains("rows of the factor"), "{error}");
}

/// With one degree of freedom, no covariance of two outputs can be drawn.
#[test]
fn too_few_runs_have_no_draws() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let fit = DynPce::fit(&noisy(7, 2, &mut rng), &fixed(2)).unwrap();
    let draw = fit.coefficients.draw(&mut rng);
    assert!(matches!(draw, Err(SurrogateError::Count { expected: 2, found: 1, .. })), "{draw:?}");
}
