//! Logarithmic scales: fits, values, gradients, files, moments, and the errors reported for them.

use approx::assert_relative_eq;
use ppl::{Differentiable, Dual};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::{
    BoxPosition, Dataset, DesignMethod, DynPce, FitOptions, Input, OrderRule, Pce, PceFit, Scale,
    Scales, SurrogateError,
};

/// Prior box of the default case: E (MPa), Gc (N/mm), ξ (MPa s).
fn inputs() -> Vec<Input> {
    [("young", 250.0, 300.0), ("toughness", 1e-5, 5e-3), ("viscosity", 0.05, 0.55)]
        .map(|(name, lower, upper)| Input::new(name, lower, upper).unwrap())
        .into()
}

/// Power laws: slope ~ E, peak force ~ E^(2/3) ξ^(1/3), displacement at peak ~ (ξ/E)^(1/3).
fn power_laws(x: &[f64]) -> Vec<f64> {
    vec![7.0 * x[0], x[0].powf(2.0 / 3.0) * x[2].cbrt(), (x[2] / x[0]).cbrt()]
}

/// Version of [`power_laws`] that is not exactly a power law.
fn bent(x: &[f64]) -> Vec<f64> {
    let [a, b, c] = power_laws(x)[..] else { unreachable!("three outputs") };
    let mild = 1.0 + 0.05 * (x[1] / 5e-3) * x[2];
    vec![a * (1.0 + 2.0 * x[2] / x[0]), b * mild, c / mild]
}

fn runs(n: usize, f: impl Fn(&[f64]) -> Vec<f64>) -> Dataset {
    let outputs = ["slope", "peak", "displacement"].map(str::to_owned).into();
    let mut data = Dataset::new(inputs(), outputs, "closed form").unwrap();
    for x in DesignMethod::Sobol.sample(&inputs(), n, 3).unwrap() {
        data.push(&x, &f(&x)).unwrap();
    }
    data
}

fn fit(data: &Dataset, options: &FitOptions) -> PceFit<Pce<3, 3>> {
    Pce::fit(data, options).unwrap()
}

fn given(inputs: [Scale; 3], outputs: [Scale; 3], order: usize) -> FitOptions {
    FitOptions {
        scales: Scales::Given { inputs: inputs.into(), outputs: outputs.into() },
        rule: OrderRule::Fixed(order),
        ..FitOptions::default()
    }
}

#[test]
fn power_laws_are_found_and_exact_at_order_one() {
    for n in [100, 30] {
        let fit = fit(&runs(n, power_laws), &FitOptions::default());
        let report = &fit.report;
        assert_eq!(report.order, 1, "{report}");
        assert_eq!(report.logarithmic[..2], ["young", "viscosity"], "{report}");
        assert!(report.logarithmic.iter().any(|name| name == "peak"), "{report}");
        assert!(report.linear_error.unwrap() > 1e-12, "{report}");
        assert!(report.to_string().contains("logarithmic: young, viscosity"), "{report}");
        for x in DesignMethod::MonteCarlo.sample(&inputs(), 50, 9).unwrap() {
            let values = fit.pce.value(&[x[0], x[1], x[2]]).unwrap();
            for (found, expected) in values.iter().zip(power_laws(&x)) {
                assert_relative_eq!(*found, expected, max_relative = 1e-12);
            }
        }
    }
}

#[test]
fn the_choice_is_never_worse_by_leave_one_out_and_repeats() {
    for f in [bent, power_laws] {
        let data = runs(40, f);
        let best = |scales| {
            let options = FitOptions { scales, ..FitOptions::default() };
            let report = fit(&data, &options).report;
            let corrected = &report.chosen().unwrap().loo.as_ref().unwrap().corrected;
            (corrected.iter().sum::<f64>() / 3.0, report)
        };
        let ((auto, report), (linear, plain)) = (best(Scales::Auto), best(Scales::Linear));
        assert!(auto <= linear, "{report}");
        assert_relative_eq!(report.linear_error.unwrap(), linear.max(1e-24), max_relative = 1e-9);
        assert!(plain.logarithmic.is_empty() && plain.linear_error.is_none());
        assert_eq!(report, best(Scales::Auto).1);
    }
    // a polynomial is fitted on linear scales
    let data = runs(40, |x| vec![x[0] * x[2], 10.0 + x[2] * x[2], 1.0 + x[1] - x[2]]);
    assert!(fit(&data, &FitOptions::default()).report.logarithmic.is_empty());
}

/// Compares the errors of outputs on logarithmic scales, and their covariance, with refits without each row.
#[test]
fn leave_one_out_on_scales_is_that_of_refits() {
    let data = runs(30, bent);
    use Scale::{Linear, Log};
    let options = given([Linear, Log, Log], [Linear, Log, Log], 2);
    let whole = fit(&data, &options);
    let n = data.len();
    let (mut errors, mut on_scale) = (Vec::new(), Vec::new());
    for left_out in 0..n {
        let mut rest = Dataset::new(inputs(), data.outputs().to_vec(), "").unwrap();
        for (_, (x, y)) in data.rows().enumerate().filter(|(i, _)| *i != left_out) {
            rest.push(x, y).unwrap();
        }
        let (x, y) = data.row(left_out);
        let f = fit(&rest, &options).pce.value(&[x[0], x[1], x[2]]).unwrap();
        errors.push([y[0] - f[0], y[1] - f[1], y[2] - f[2]]);
        on_scale.push([y[0] - f[0], (y[1] / f[1]).ln(), (y[2] / f[2]).ln()]);
    }
    let at = [1900.0, 30.0, 0.1];
    let covariance = whole.report.lack_of_fit(&at).unwrap();
    let unit = [1.0, at[1], at[2]];
    let loo = whole.report.chosen().unwrap().loo.as_ref().unwrap();
    for m in 0..3 {
        let mean = data.rows().map(|(_, y)| y[m]).sum::<f64>() / n as f64;
        let variance = data.rows().map(|(_, y)| (y[m] - mean).powi(2)).sum::<f64>();
        let squares = errors.iter().map(|e| e[m] * e[m]).sum::<f64>();
        assert_relative_eq!(loo.plain[m], squares / variance, max_relative = 1e-9);
        for k in 0..3 {
            let average = |j: usize| on_scale.iter().map(|r| r[j]).sum::<f64>() / n as f64;
            let product =
                on_scale.iter().map(|r| (r[m] - average(m)) * (r[k] - average(k))).sum::<f64>();
            let expected = product / (n - 1) as f64 * unit[m] * unit[k];
            let scale = (covariance[m][m] * covariance[k][k]).sqrt();
            assert_relative_eq!(covariance[m][k], expected, epsilon = 1e-8 * scale);
        }
    }
    assert!(matches!(whole.report.lack_of_fit(&[1.0]), Err(SurrogateError::Count { .. })));
}

/// For runs that scatter by 3 %, s² estimates the variance of the scatter, and s² times the mean leverage estimates the
/// variance of the mean.
#[test]
fn scatter_and_the_error_of_the_mean_are_told_apart() {
    let (repeats, sd, n) = (200, 0.03, 30);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(8);
    let normal =
        |rng: &mut Xoshiro256PlusPlus| (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
    let options = given([Scale::Log; 3], [Scale::Log; 3], 1);
    let places: Vec<Vec<f64>> = DesignMethod::Sobol.sample_unit(3, 64, &mut rng).unwrap();
    let on_log = |u: &[f64]| -> [f64; 3] {
        std::array::from_fn(|d| {
            let Input { lower, upper, .. } = inputs()[d];
            lower * (upper / lower).powf(u[d])
        })
    };
    let at = power_laws(&[275.0, 1e-3, 0.2]);
    let (mut scatter, mut claimed, mut errors) = (0.0, 0.0, Vec::new());
    for _ in 0..repeats {
        let mut data = runs(n, power_laws);
        let clean: Vec<_> = data.rows().map(|(x, y)| (x.to_vec(), y.to_vec())).collect();
        data = Dataset::new(inputs(), data.outputs().to_vec(), "").unwrap();
        for (x, y) in clean {
            let y: Vec<f64> = y.iter().map(|y| y * (sd * normal(&mut rng)).exp()).collect();
            data.push(&x, &y).unwrap();
        }
        let fit = fit(&data, &options);
        scatter += fit.report.scatter(&at).unwrap()[1][1] / at[1].powi(2) / f64::from(repeats);
        claimed += fit.report.mean_error(&at).unwrap()[1][1] / at[1].powi(2) / f64::from(repeats);
        let squares = places.iter().map(|u| {
            let x = on_log(u);
            (fit.pce.value(&x).unwrap()[1] / power_laws(&x)[1]).ln().powi(2)
        });
        errors.push(squares.sum::<f64>() / 64.0);
    }
    let mean = errors.iter().sum::<f64>() / f64::from(repeats);
    let variance = errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / f64::from(repeats);
    let standard_error = (variance / f64::from(repeats)).sqrt();
    // s² has 26 degrees of freedom per repeat
    let of_scatter = sd * sd * (2.0 / (26.0 * f64::from(repeats))).sqrt();
    assert!((scatter - sd * sd).abs() < 4.0 * of_scatter, "{scatter}");
    assert!((mean - claimed).abs() < 4.0 * standard_error, "{mean} {claimed} {standard_error}");
}

#[test]
fn gradients_are_exact_and_both_expansions_agree() {
    use Scale::{Linear, Log};
    let data = runs(60, bent);
    for (ins, outs) in [([Log; 3], [Log; 3]), ([Linear, Log, Linear], [Log, Linear, Log])] {
        let pce = fit(&data, &given(ins, outs, 3)).pce;
        let run_time: &DynPce = &pce;
        for x in DesignMethod::MonteCarlo.sample(&inputs(), 20, 4).unwrap() {
            let x = [x[0], x[1], x[2]];
            let (value, jacobian) = pce.value_and_jacobian(&x).unwrap();
            assert_eq!(pce.value(&x).unwrap(), value);
            let (dynamic, slopes) = run_time.value_and_jacobian(&x).unwrap();
            let dual = pce.at(Dual::<3>::variables(x));
            for m in 0..3 {
                assert_relative_eq!(dynamic[m], value[m], max_relative = 1e-12);
                assert_relative_eq!(run_time.value(&x).unwrap()[m], value[m], max_relative = 1e-12);
                assert_eq!(dual[m].gradient(), jacobian[m]);
                for d in 0..3 {
                    let size = value[m] / x[d];
                    assert_relative_eq!(slopes[m][d], jacobian[m][d], epsilon = 1e-11 * size);
                    let h = 1e-4 * x[d];
                    let at = |h: f64| {
                        let mut x = x;
                        x[d] += h;
                        pce.value(&x)
                    };
                    let Ok([a, b, c, e]) = [at(2.0 * h), at(h), at(-h), at(-2.0 * h)]
                        .into_iter()
                        .collect::<Result<Vec<_>, _>>()
                        .map(|v| [v[0][m], v[1][m], v[2][m], v[3][m]])
                    else {
                        continue;
                    };
                    let difference = (8.0 * (b - c) - (a - e)) / (12.0 * h);
                    assert_relative_eq!(jacobian[m][d], difference, epsilon = 1e-9 * size);
                }
            }
        }
    }
}

#[test]
fn files_units_and_the_guard_know_the_scales() {
    let pce = fit(&runs(60, bent), &given([Scale::Log; 3], [Scale::Log; 3], 2)).pce;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("surrogate.json");
    pce.write(&path).unwrap();
    let back = Pce::<3, 3>::read(&path).unwrap();
    let x = [260.0, 2e-4, 0.1];
    assert_eq!(back.value_and_jacobian(&x).unwrap(), pce.value_and_jacobian(&x).unwrap());
    assert_eq!(back.logarithmic(), pce.logarithmic());
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replace("\"young\",\n    \"tough", "\"yuong\",\n    \"tough"))
        .unwrap();
    let message = Pce::<3, 3>::read(&path).unwrap_err().to_string();
    assert!(message.contains("`yuong` is neither"), "{message}");

    let scaled = (*pce).clone().scale_outputs(&[2.0, 0.5, 1e-3]).unwrap();
    let (value, jacobian) = pce.value_and_jacobian(&x).unwrap();
    let (scaled_value, slopes) = scaled.value_and_jacobian(&x).unwrap();
    for (m, factor) in [2.0, 0.5, 1e-3].into_iter().enumerate() {
        assert_relative_eq!(scaled_value[m], factor * value[m], max_relative = 1e-12);
        assert_relative_eq!(slopes[m][2], factor * jacobian[m][2], max_relative = 1e-10);
    }
    assert!(matches!(
        (*pce).clone().scale_outputs(&[1.0, -1.0, 1.0]),
        Err(SurrogateError::Option { .. })
    ));

    // 1 % of ln 500 below the lower bound of the toughness; 1 % of the linear width below it would be negative
    assert_eq!(pce.position(&[275.0, 0.95e-5, 0.3]).unwrap(), BoxPosition::Near);
    for toughness in [0.93e-5, 0.0, -1e-5, f64::NAN] {
        assert!(pce.value(&[275.0, toughness, 0.3]).is_err());
    }
    let zero = Dataset::new(vec![Input::new("a", 0.0, 1.0).unwrap()], vec!["f".into()], "");
    let mut zero = zero.unwrap();
    (0..9).for_each(|i| zero.push(&[f64::from(i) / 8.0], &[f64::from(i)]).unwrap());
    for (ins, outs) in [(Scale::Log, Scale::Linear), (Scale::Linear, Scale::Log)] {
        let scales = Scales::Given { inputs: vec![ins], outputs: vec![outs] };
        let options = FitOptions { scales, ..FitOptions::default() };
        let refused = DynPce::fit(&zero, &options);
        assert!(matches!(refused, Err(SurrogateError::Logarithm { .. })));
    }
    assert!(DynPce::fit(&zero, &FitOptions::default()).unwrap().report.logarithmic.is_empty());
}

/// Compares moments of E^a ξ^b for uniform inputs with products of (u^(a+1) − l^(a+1))/((a+1)(u − l)).
#[test]
fn moments_are_those_of_uniform_inputs() {
    let moment = |input: &Input, power: f64| {
        let Input { lower, upper, .. } = input;
        (upper.powf(power + 1.0) - lower.powf(power + 1.0)) / ((power + 1.0) * (upper - lower))
    };
    let pce = fit(&runs(30, power_laws), &given([Scale::Log; 3], [Scale::Log; 3], 1)).pce;
    let [young, _, viscosity] = &inputs()[..] else { unreachable!("three inputs") };
    let (a, b) = (2.0 / 3.0, 1.0 / 3.0);
    let [e1, e2] = [1.0, 2.0].map(|k| moment(young, k * a));
    let [x1, x2] = [1.0, 2.0].map(|k| moment(viscosity, k * b));
    let variance = e2 * x2 - (e1 * x1).powi(2);
    assert_relative_eq!(pce.mean()[1], e1 * x1, max_relative = 1e-11);
    assert_relative_eq!(pce.variance()[1], variance, max_relative = 1e-9);
    let sobol = pce.sobol();
    let by_young = (e2 - e1 * e1) * x1 * x1 / variance;
    let by_viscosity = (x2 - x1 * x1) * e1 * e1 / variance;
    assert_relative_eq!(sobol.first[1][0], by_young, epsilon = 1e-9);
    assert_relative_eq!(sobol.first[1][2], by_viscosity, epsilon = 1e-9);
    assert_relative_eq!(sobol.second[1][0][2], 1.0 - by_young - by_viscosity, epsilon = 1e-9);
    assert_relative_eq!(sobol.total[1][0], 1.0 - by_viscosity, epsilon = 1e-9);
    assert_relative_eq!(sobol.total[1][1], 0.0, epsilon = 1e-9);

    // a linear function on a logarithmic scale, compared with its closed form on the linear scale
    let plain = |x: &[f64]| vec![x[0], 3.0 * x[2] + 0.01 * x[0], x[2]];
    let data = runs(200, plain);
    use Scale::{Linear, Log};
    let curved = fit(&data, &given([Linear, Linear, Log], [Linear; 3], 8)).pce;
    let straight = fit(&data, &given([Linear; 3], [Linear; 3], 1)).pce;
    assert_relative_eq!(curved.mean()[1], straight.mean()[1], max_relative = 1e-5);
    assert_relative_eq!(curved.variance()[1], straight.variance()[1], max_relative = 1e-4);
}
