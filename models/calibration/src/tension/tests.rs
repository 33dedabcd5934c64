//! Compares the hierarchical model with closed forms.

use std::sync::LazyLock;

use ppl::check;
use ppl::rand::SeedableRng;
use ppl::rand_xoshiro::Xoshiro256PlusPlus;

use super::loo::{fit_of, ln_density, populations};
use super::*;

/// Law σ = 100 (ln a + ε ln b + ε² ln c). The logarithms of the parameters are normal and σ is linear in them, so that
/// curves are normal.
struct Parabola;

impl HardeningLaw for Parabola {
    const PARAMETERS: [&'static str; 3] = ["a", "b", "c"];
    const LN_PRIOR: [[f64; 2]; 3] = [[3.0, 0.5], [4.0, 0.5], [-2.0, 0.5]];

    fn stress_mpa<S: Scalar>(&[a, b, c]: &[S; 3], strain: f64) -> S {
        (a.ln() + b.ln() * strain + c.ln() * (strain * strain)) * 100.0
    }

    fn uniform_strain<S: Scalar>(_: &[S; 3]) -> S {
        S::from(0.0)
    }
}

fn strains() -> impl Iterator<Item = f64> {
    (0..12).map(|i| 0.04 * f64::from(i))
}

/// Draws a specimen of a population: the logarithms have means of 3, 4, −2 and a standard deviation of 0.1; the noise
/// is 5 MPa.
fn specimen(name: usize, rng: &mut Xoshiro256PlusPlus) -> TensionTest {
    let mut normal = || -> f64 { Normal(0.0, 1.0).draw(rng) };
    let own = [3.0, 4.0, -2.0].map(|mean: f64| (mean + 0.1 * normal()).exp());
    let point = |plastic_strain: f64| HardeningPoint {
        plastic_strain,
        true_stress_mpa: Parabola::stress_mpa(&own, plastic_strain) + 5.0 * normal(),
    };
    let points = strains().map(point).collect();
    TensionTest { specimen: format!("S{name}"), uniform_strain: 0.5, points, unloading: Vec::new() }
}

fn specimens() -> Vec<TensionTest> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(12);
    (0..6).map(|k| specimen(k, &mut rng)).collect()
}

fn sampler() -> Nuts<'static> {
    Nuts::default().chains(4).warmup(400).draws(1000).target_accept(0.95).seed(2)
}

/// Calibration to all specimens, used by two tests.
static CALIBRATED: LazyLock<Posterior> =
    LazyLock::new(|| calibrate::<Parabola>(&specimens(), &sampler()).unwrap());

#[test]
fn gradients_are_derivatives() {
    let tests = &specimens()[..2];
    check::gradient(&hardening(PhantomData::<Voce>, tests), 1);
    check::gradient(&hardening(PhantomData::<Swift>, tests), 2);
}

/// Compares with the marginal density N(A μ, A Σ Aᵀ + sd² I) of a curve whose law is linear with the matrix A.
#[test]
fn a_curve_has_its_marginal_density() {
    let tests = specimens();
    let posterior = &CALIBRATED;
    let fit = fit_of::<Parabola>(posterior, 1, &tests[1]).unwrap();
    let rows: Vec<[f64; 3]> = strains().map(|e| [100.0, 100.0 * e, 100.0 * e * e]).collect();
    let y: Vec<f64> = tests[1].points.iter().map(|p| p.true_stress_mpa).collect();
    for population in populations(posterior).unwrap().iter().step_by(80) {
        let scatter = population.factor.covariance();
        let mean: Vec<f64> =
            rows.iter().map(|a| (0..3).map(|i| a[i] * population.mean[i]).sum()).collect();
        let entry = |m: usize, n: usize| {
            let pairs = (0..9).map(|k| rows[m][k / 3] * scatter[k / 3][k % 3] * rows[n][k % 3]);
            pairs.sum::<f64>() + if m == n { population.sd_mpa.powi(2) } else { 0.0 }
        };
        let covariance: Vec<Vec<f64>> =
            (0..y.len()).map(|m| (0..y.len()).map(|n| entry(m, n)).collect()).collect();
        let factor = DynCholeskyFactor::of_covariance(&covariance).unwrap();
        let exact: f64 = MvNormalCholesky(mean, factor).ln_density(&y);
        let found = ln_density(&fit, population).unwrap();
        assert!((found - exact).abs() < 1e-5 * exact.abs(), "{found} {exact}");
    }
}

/// For a nonlinear law, compares the density of a curve with sums over a grid of the three parameters.
#[test]
fn a_curve_of_voce_has_its_marginal_density() {
    let (own, sd) = ([5.56f64, 6.18, 0.5], 9.0);
    let point = |i: u32| {
        let strain = 0.008 * f64::from(i) + 0.002;
        let off = sd * (f64::from(i) * 2.4).sin();
        let stress: f64 = Voce::stress_mpa(&own.map(f64::exp), strain);
        HardeningPoint { plastic_strain: strain, true_stress_mpa: stress + off }
    };
    let points: Vec<HardeningPoint> = (0..60).map(point).collect();
    let test =
        TensionTest { specimen: "V".into(), uniform_strain: 0.48, points, unloading: Vec::new() };
    let posterior = calibrate::<Voce>(std::slice::from_ref(&test), &sampler()).unwrap();
    let fit = fit_of::<Voce>(&posterior, 0, &test).unwrap();
    let mut population = populations(&posterior).unwrap().remove(0);
    let scatter = [[0.03, 0.0, 0.0], [0.01, 0.025, 0.0], [0.05, 0.02, 0.17]];
    population.factor = CholeskyFactor::new(scatter).unwrap();
    (population.mean, population.sd_mpa) = ([5.54, 6.2, 0.6], sd);
    let prior = MvNormalCholesky(population.mean, population.factor);
    let steps = |middle: f64, half: f64| {
        (-15..=15).map(move |i| middle + half * f64::from(i) / 15.0).collect::<Vec<f64>>()
    };
    // half widths of the grid: at least five standard deviations. With steps of a third of a standard deviation, the sum
    // over a bell-shaped density is exact to far less than the tolerance
    let halves = [0.06, 0.05, 0.45];
    let mut terms = Vec::new();
    for a in steps(own[0], halves[0]) {
        for b in steps(own[1], halves[1]) {
            for c in steps(own[2], halves[2]) {
                let law = [a, b, c].map(f64::exp);
                let ln_fit = |p: &HardeningPoint| {
                    let mean: f64 = Voce::stress_mpa(&law, p.plastic_strain);
                    Normal(mean, sd).ln_density(&p.true_stress_mpa)
                };
                let fits: f64 = test.points.iter().map(ln_fit).sum();
                terms.push(fits + prior.ln_density(&[a, b, c]));
            }
        }
    }
    let cell: f64 = halves.iter().map(|half| half / 15.0).product();
    let exact = ln_sum_exp(&terms) + cell.ln();
    let found = ln_density(&fit, &population).unwrap();
    assert!((found - exact).abs() < 0.03, "{found} {exact}");
}

/// For every second specimen, reweighted draws give the density of a calibration without the specimen.
#[test]
fn smoothed_weights_do_what_refits_do() {
    let tests = specimens();
    let posterior = &CALIBRATED;
    let loo = loo_by_specimen::<Parabola>(posterior, &tests, &sampler()).unwrap();
    assert!(loo.unreliable().is_empty() && loo.points.len() == 6, "{loo}");
    let weighted: Vec<usize> =
        (0..6).filter(|&k| loo.points[k].pareto_k > f64::NEG_INFINITY).collect();
    assert!(!weighted.is_empty(), "{loo:?}");
    for k in weighted.into_iter().step_by(2) {
        let mut others = tests.clone();
        others.remove(k);
        let refit = calibrate::<Parabola>(&others, &sampler()).unwrap();
        let fit = fit_of::<Parabola>(posterior, k, &tests[k]).unwrap();
        let terms: Vec<f64> = populations(&refit)
            .unwrap()
            .iter()
            .map(|population| ln_density(&fit, population).unwrap())
            .collect();
        let n = terms.len() as f64;
        let exact = ln_sum_exp(&terms) - n.ln();
        // standard error of the difference of two mean densities; the effective number of draws is about half the
        // number of draws
        let squares: f64 = terms.iter().map(|t| ((t - exact).exp() - 1.0).powi(2)).sum();
        let error = (2.0 * 2.0 * squares).sqrt() / n;
        let gap = (loo.points[k].elpd - exact).abs();
        assert!(error < 0.3 && gap < 4.0 * error, "{k}: {gap} ± {error}, {:?}", loo.points[k]);
    }
}

/// Ranks of truths drawn from the prior are uniform among the draws of the posterior.
#[test]
fn ranks_are_uniform() {
    let shape: Vec<TensionTest> = specimens().into_iter().take(3).collect();
    let quick = Nuts::default().chains(1).warmup(300).draws(200).target_accept(0.9);
    let report = check::sbc(5).replications(60).ranked_draws(19).sampler(quick).run(|trial| {
        let truth = hardening(PhantomData::<Parabola>, &shape).draw_prior(&mut trial.rng)?;
        let stresses = truth.replicate("point.true_stress_mpa").unwrap_or_default();
        let mut tests = shape.clone();
        let points = tests.iter_mut().flat_map(|test| &mut test.points);
        points.zip(stresses).for_each(|(point, stress)| point.true_stress_mpa = *stress);
        trial.rank(&hardening(PhantomData::<Parabola>, &tests), &truth)
    });
    report.unwrap().assert_uniform(1e-3);
}
