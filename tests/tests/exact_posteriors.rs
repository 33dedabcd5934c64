//! Compares posteriors in `model!` with their exact moments, which are computed without `ppl`: sums over all discrete
//! states, conjugate integrals, and quadrature of the remaining integrals.

use std::ops::Range;

use breccia_tests::posteriors::exact::*;
use breccia_tests::posteriors::regression::dog_trials;
use ppl::{Bound, Model, Nuts, check};

/// Mean and second moment of one quantity, given the state or the parameters of the outer sum or integral.
type Moments = (f64, f64);

/// Moments of a quantity with a fixed value.
fn fixed(x: f64) -> Moments {
    (x, x * x)
}

/// Moments of a beta-distributed quantity.
fn beta(a: f64, b: f64) -> Moments {
    let mean = a / (a + b);
    (mean, mean * (a + 1.0) / (a + b + 1.0))
}

/// Moments of a gamma-distributed quantity.
fn gamma(shape: f64, rate: f64) -> Moments {
    (shape / rate, shape * (shape + 1.0) / rate.powi(2))
}

/// Mean and standard deviation of each quantity over states with these log weights.
fn average<const Q: usize>(states: &[(f64, [Moments; Q])]) -> [(f64, f64); Q] {
    let largest = states.iter().map(|s| s.0).fold(f64::NEG_INFINITY, f64::max);
    let weight = |ln: f64| (ln - largest).exp();
    let total: f64 = states.iter().map(|s| weight(s.0)).sum();
    std::array::from_fn(|q| {
        let mean = states.iter().map(|s| weight(s.0) * s.1[q].0).sum::<f64>() / total;
        let square = states.iter().map(|s| weight(s.0) * s.1[q].1).sum::<f64>() / total;
        (mean, (square - mean * mean).sqrt())
    })
}

/// Mean and standard deviation of each quantity over two parameters, by the midpoint rule. For smooth densities that
/// vanish at the bounds of the box, the error is far below a standard error.
fn integrate<const Q: usize>(
    a: Range<f64>,
    b: Range<f64>,
    density: impl Fn(f64, f64) -> (f64, [Moments; Q]),
) -> [(f64, f64); Q] {
    const POINTS: usize = 160;
    let point = |range: &Range<f64>, i: usize| {
        range.start + (range.end - range.start) * (i as f64 + 0.5) / POINTS as f64
    };
    let points = (0..POINTS).flat_map(|i| (0..POINTS).map(move |j| (i, j)));
    let states: Vec<_> = points.map(|(i, j)| density(point(&a, i), point(&b, j))).collect();
    average(&states)
}

/// Samples the model and compares means and standard deviations, to 4 Monte Carlo standard errors.
fn assert_exact<const Q: usize>(
    model: &Bound<impl Model>,
    names: [&str; Q],
    exact: [(f64, f64); Q],
) {
    assert_exact_after(600, model, names, exact);
}

/// Version of [`assert_exact`] with a given number of draws, for chains that mix slowly.
fn assert_exact_after<const Q: usize>(
    draws: usize,
    model: &Bound<impl Model>,
    names: [&str; Q],
    exact: [(f64, f64); Q],
) {
    let sampler = Nuts::default().warmup(500).draws(draws).target_accept(0.9).seed(17);
    let posterior = sampler.sample(model).expect("the model samples");
    for (name, (mean, sd)) in names.into_iter().zip(exact) {
        println!("{name}: {mean:.5} ± {sd:.5}");
        check::mean(&posterior, name, mean).within_mcse(4.0);
        check::sd(&posterior, name, sd).within_mcse(4.0);
    }
    check::gradient(model, 18);
}

fn ln_normal(x: f64, mean: f64, sd: f64) -> f64 {
    -0.5 * ((x - mean) / sd).powi(2) - sd.ln()
}

/// Σ ln (a + i) for i below n: ln Γ(a + n) − ln Γ(a).
fn ln_rising(a: f64, n: u64) -> f64 {
    (0..n).map(|i| (a + i as f64).ln()).sum()
}

/// The exact moments are sums over all change points, with gamma posteriors of both rates.
#[test]
fn disasters_in_mines() {
    let model = disasters(&DISASTERS);
    let rate = |counts: &[u64]| (1 + counts.iter().sum::<u64>(), 1.0 + counts.len() as f64);
    let states: Vec<_> = (0..DISASTERS.len())
        .map(|change| {
            let (early, late) = DISASTERS.split_at(change);
            let ((a, b), (c, d)) = (rate(early), rate(late));
            let ln_integral =
                |shape: u64, rate: f64| ln_rising(1.0, shape - 1) - shape as f64 * rate.ln();
            let weight = ln_integral(a, b) + ln_integral(c, d);
            (weight, [gamma(a as f64, b), gamma(c as f64, d), fixed(change as f64)])
        })
        .collect();
    let [early, late, change] = average(&states);
    assert_exact(&model, ["early", "late"], [early, late]);
    // the model tracks the conditional mean of the change point at every draw: only its mean is known exactly
    let posterior =
        Nuts::default().warmup(300).draws(500).seed(4).sample(&model).expect("it samples");
    check::mean(&posterior, "change", change.0).within_mcse(4.0);
}

/// The exact moments are computed by the Kalman filter and quadrature over both standard deviations.
#[test]
fn level_of_the_nile() {
    let exact = integrate(0.0..250.0, 40.0..260.0, |step, noise| {
        let (mut mean, mut variance) = (1000.0, 300f64.powi(2));
        let mut ln_density = -0.5 * ((step / 100.0).powi(2) + (noise / 200.0).powi(2));
        for (t, y) in NILE.iter().enumerate() {
            variance += if t == 0 { 0.0 } else { step * step };
            let total = variance + noise * noise;
            ln_density += ln_normal(*y, mean, total.sqrt());
            let gain = variance / total;
            mean += gain * (y - mean);
            variance *= 1.0 - gain;
        }
        (ln_density, [fixed(step), fixed(noise), (mean, mean * mean + variance)])
    });
    assert_exact_after(4000, &nile(&NILE), ["step", "noise", "now"], exact);
}

/// The rates are integrated out, and quadrature is used for the two parameters of the rates' distribution.
#[test]
fn tumours_of_rats() {
    let exact = integrate(0.08..0.24, 0.5..5.5, |mean, ln_size| {
        let (a, b) = (mean * ln_size.exp(), (1.0 - mean) * ln_size.exp());
        let mut ln_density = ln_normal(ln_size, 2.5, 1.0);
        for (&y, &n) in TUMOURS.iter().zip(&RATS) {
            ln_density += ln_rising(a, y) + ln_rising(b, n - y) - ln_rising(a + b, n);
        }
        let rate = |i: usize| beta(a + TUMOURS[i] as f64, b + (RATS[i] - TUMOURS[i]) as f64);
        (ln_density, [fixed(mean), fixed(ln_size.exp()), rate(0), rate(66)])
    });
    let names = ["mean", "size", "rate[0]", "rate[66]"];
    assert_exact(&tumours(&TUMOURS, &RATS), names, exact);
}

#[test]
fn learning_of_dogs() {
    let trials = dog_trials();
    let later: Vec<_> = trials.iter().filter(|t| t.avoided + t.shocks > 0.0).collect();
    let exact = integrate(0.68..0.9, 0.86..0.98, |a, b| {
        let ln = (a.ln(), b.ln());
        let term = |t: &&breccia_tests::posteriors::regression::Trial| {
            let ln_p = t.avoided * ln.0 + t.shocks * ln.1;
            if t.shock == 1.0 { ln_p } else { (-ln_p.exp()).ln_1p() }
        };
        (later.iter().map(term).sum(), [fixed(a), fixed(b)])
    });
    assert_exact(&dogs_log(&trials), ["beta[0]", "beta[1]"], exact);
}

#[test]
fn deaths_by_dose() {
    let exact = integrate(-6.0..9.0, -15.0..60.0, |a, b| {
        let mut ln_density = ln_normal(a, 0.0, 2.0) + ln_normal(b, 10.0, 10.0);
        for (x, y) in LN_DOSE.iter().zip(DEATHS) {
            let p = 1.0 / (1.0 + (-a - b * x).exp());
            ln_density += y as f64 * p.ln() + (5 - y) as f64 * (1.0 - p).max(1e-300).ln();
        }
        (ln_density, [fixed(a), fixed(b)])
    });
    assert_exact(&bioassay(&LN_DOSE, 5, &DEATHS), ["alpha", "beta"], exact);
}

/// The exact moments are sums over the unknown number of animals that were never caught.
#[test]
fn captures_of_hares() {
    let caught: usize = HARES.iter().sum();
    let times: usize = (1..).zip(HARES).map(|(times, n)| times * n).sum();
    let states: Vec<_> = (0..=60u64)
        .map(|unseen| {
            // C(60, m) B(caught + m + 1, 60 − m + 1) B(times + 1, 6 (caught + m) − times + 1)
            let (existing, misses) =
                (caught as u64 + unseen, 6 * (caught as u64 + unseen) - times as u64);
            let factorial = |n: u64| ln_rising(1.0, n);
            let ln_choices = factorial(60) - factorial(unseen) - factorial(60 - unseen);
            let ln_beta = |a: u64, b: u64| factorial(a) + factorial(b) - factorial(a + b + 1);
            let weight =
                ln_choices + ln_beta(existing, 60 - unseen) + ln_beta(times as u64, misses);
            let exists = beta(existing as f64 + 1.0, (60 - unseen) as f64 + 1.0);
            (weight, [exists, beta(times as f64 + 1.0, misses as f64 + 1.0)])
        })
        .collect();
    assert_exact(&captures(&hares(), 6), ["exists", "p"], average(&states));
}

#[test]
fn remissions_that_go_on() {
    let exact = integrate(0.2..4.5, 1.5..7.0, |shape, ln_scale| {
        let mut ln_density = -0.5 * (shape / 3.0).powi(2) + ln_normal(ln_scale, 3.0, 1.0);
        for (t, over) in REMISSIONS {
            let z = t.ln() - ln_scale;
            let hazard = (shape * z).exp();
            ln_density +=
                if over { shape.ln() + (shape - 1.0) * z - ln_scale } else { 0.0 } - hazard;
        }
        (ln_density, [fixed(shape), fixed(ln_scale.exp())])
    });
    let (weeks, over): (Vec<f64>, Vec<bool>) = REMISSIONS.into_iter().unzip();
    assert_exact(&remissions(&weeks, &over), ["shape", "scale"], exact);
}

/// The exact moments are sums over all 2¹² paths, with beta posteriors of both probabilities of staying in a state.
#[test]
fn paths_through_two_states() {
    let means = [0.0, 2.5];
    let states: Vec<_> = (0..1usize << STATES.len())
        .map(|path| {
            let state = |t: usize| path >> t & 1;
            let emission = |t: usize| ln_normal(STATES[t], means[state(t)], 1.0);
            let mut weight: f64 = (0..STATES.len()).map(emission).sum();
            let mut moves = [[0u64; 2]; 2]; // stayed and left, by state
            for t in 1..STATES.len() {
                moves[state(t - 1)][usize::from(state(t) != state(t - 1))] += 1;
            }
            let stay = moves.map(|[stayed, left]| {
                weight +=
                    ln_rising(3.0, stayed) + ln_rising(2.0, left) - ln_rising(5.0, stayed + left);
                beta(3.0 + stayed as f64, 2.0 + left as f64)
            });
            (weight, stay)
        })
        .collect();
    assert_exact(&two_states(&STATES, &means), ["stay[0]", "stay[1]"], average(&states));
}
