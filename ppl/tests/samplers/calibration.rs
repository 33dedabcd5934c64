//! Every sampler of the crate under simulation-based calibration and Geweke's test, and wrong
//! ones that both must find. Each assertion about a right sampler has a false-alarm rate of
//! 1e-4; the wrong ones must be found with p below 1e-6.

use ppl::check::{self, CheckError, Draws, GewekeReport, Sampler, SbcReport, Transition};
use ppl::prelude::*;
use ppl::rand::{Rng, SeedableRng};
use ppl::rand_xoshiro::Xoshiro256PlusPlus;
use ppl::{Bound, Model, Rejection, Workspace};
use rand_distr::StandardNormal;

const FALSE_ALARMS: f64 = 1e-4;
const FOUND: f64 = 1e-6;

ppl::model! {
    /// Level and scale, neither normal: the posterior is skewed and its two unknowns depend on each
    /// other.
    fn measured(y: &[f64]) {
        let level ~ Normal(0.5, 1.0);
        let sd ~ LogNormal(-0.3, 0.5);
        for y in y {
            y ~ Normal(level, sd);
        }
    }
}

const SHAPE: [f64; 4] = [0.0; 4];

fn calibrate(sampler: impl Sampler) -> SbcReport {
    let sbc = check::sbc(11).replications(200).ranked_draws(39).sampler(sampler);
    let report = sbc.run(|trial| {
        let truth = measured(&SHAPE).draw_prior(&mut trial.rng)?;
        let data = truth.replicate("y").unwrap_or_default();
        trial.rank(&measured(data), &truth)
    });
    report.expect("the sampler runs")
}

fn joint(seed: u64, kernel: impl Transition) -> GewekeReport {
    let report = check::geweke(seed, kernel).run(&measured(&SHAPE), |joint| {
        let data = joint.replicate("y");
        joint.update(&measured(&data))
    });
    report.expect("the kernel runs")
}

/// Data that a prior draw would give, for tuning.
fn typical() -> Vec<f64> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let truth = measured(&SHAPE).draw_prior(&mut rng).expect("a prior draw");
    truth.replicate("y").expect("observed").to_vec()
}

#[test]
fn nuts() {
    calibrate(Nuts::default().chains(1).warmup(300).draws(156)).assert_uniform(FALSE_ALARMS);

    let data = typical();
    let nuts = Nuts::default().chains(1).warmup(300);
    let pilot = nuts.clone().draws(1).run(&measured(&data)).expect("runs");
    joint(7, nuts.warm_start(&pilot)).assert_equal(FALSE_ALARMS);
}

#[test]
fn metropolis() {
    let sampler = Metropolis::default().chains(1).warmup(1000).draws(39).thin(25);
    calibrate(sampler).assert_uniform(FALSE_ALARMS);
    joint(1, Metropolis::default()).assert_equal(FALSE_ALARMS);
}

#[test]
fn componentwise() {
    let sampler = ComponentwiseMetropolis::default().chains(1).warmup(400).draws(39).thin(15);
    calibrate(sampler).assert_uniform(FALSE_ALARMS);
    joint(2, ComponentwiseMetropolis::default()).assert_equal(FALSE_ALARMS);
}

#[test]
fn differential_evolution() {
    let sampler = DifferentialEvolution::default().chains(1).warmup(500).draws(39).thin(40);
    calibrate(sampler.population(5)).assert_uniform(FALSE_ALARMS);

    let data = typical();
    let pilot = Metropolis::default().chains(1).draws(50).thin(20).run(&measured(&data));
    let pilot = pilot.expect("runs");
    let archive = pilot.chains[0].draws.chunks_exact(2).map(<[f64]>::to_vec);
    let frozen = DifferentialEvolution::default().archive(archive.collect());
    joint(3, frozen).assert_equal(FALSE_ALARMS);
}

/// Screened by a density that is too wide and pulled aside.
struct Screened(DelayedAcceptance<'static>);

struct Biased<'a, D>(&'a D);

impl<D: LogDensity> LogDensity for Biased<'_, D> {
    type Workspace = D::Workspace;

    fn dim(&self) -> usize {
        self.0.dim()
    }

    fn log_density(&self, y: &[f64], w: &mut D::Workspace) -> Result<f64, Rejection> {
        Ok(0.6 * self.0.log_density(y, w)? + 0.5 * y[0] - 0.3 * y[1])
    }

    fn gradient(&self, _: &[f64], _: &mut [f64], _: &mut D::Workspace) -> Result<f64, Rejection> {
        Err(Rejection::Fatal { message: "delayed acceptance needs no gradient".into() })
    }
}

impl Sampler for Screened {
    fn draws<M: Model>(&self, model: &Bound<M>, seed: u64) -> Result<Draws, CheckError> {
        Draws::of_chains(&self.0.clone().seed(seed).run(&Biased(model), model)?)
    }
}

impl Transition for Screened {
    fn transition<M: Model>(
        &self,
        model: &Bound<M>,
        y: &mut Vec<f64>,
        rng: &mut Xoshiro256PlusPlus,
    ) -> Result<(), CheckError> {
        let one = self.0.clone().chains(1).warmup(0).draws(1).init_points(vec![y.clone()]);
        *y = Draws::of_chains(&one.seed(rng.random()).run(&Biased(model), model)?)?.points;
        Ok(())
    }
}

#[test]
fn delayed_acceptance() {
    for steps in [1, 4] {
        let sampler = DelayedAcceptance::default().screening_steps(steps);
        joint(4, Screened(sampler.clone())).assert_equal(FALSE_ALARMS);
        let sampler = sampler.chains(1).warmup(1000).draws(39).thin(30);
        calibrate(Screened(sampler)).assert_uniform(FALSE_ALARMS);
    }
}

#[test]
fn tempered() {
    calibrate(Smc::default().runs(2).particles(200)).assert_uniform(FALSE_ALARMS);
}

/// Random-walk Metropolis by hand, with faults to choose.
#[derive(Clone, Copy)]
struct ByHand {
    /// Acceptance `min(1, ratio^power)`.
    power: f64,
    /// Mean of the jump, ignored by the acceptance.
    drift: f64,
    /// Whether the density of unconstrained coordinates has its Jacobian.
    jacobian: bool,
}

const RIGHT: ByHand = ByHand { power: 1.0, drift: 0.0, jacobian: true };

impl Transition for ByHand {
    fn transition<M: Model>(
        &self,
        model: &Bound<M>,
        y: &mut Vec<f64>,
        rng: &mut Xoshiro256PlusPlus,
    ) -> Result<(), CheckError> {
        let mut workspace = Workspace::default();
        let mut at = |y: &[f64]| {
            if self.jacobian {
                model.log_density(y, &mut workspace)
            } else {
                model.log_density_without_jacobian(y, &mut workspace)
            }
        };
        let mut jump = || self.drift + 0.7 * rng.sample::<f64, _>(StandardNormal);
        let proposal: Vec<f64> = y.iter().map(|y| y + jump()).collect();
        let gain = at(&proposal)? - at(y)?;
        if rng.random::<f64>() < (self.power * gain).exp() {
            *y = proposal;
        }
        Ok(())
    }
}

impl Sampler for ByHand {
    fn draws<M: Model>(&self, model: &Bound<M>, seed: u64) -> Result<Draws, CheckError> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut y = model.draw_prior(&mut rng)?.unconstrained;
        let mut points = Vec::new();
        for step in 0..1200 {
            self.transition(model, &mut y, &mut rng)?;
            if step >= 420 && step % 20 == 0 {
                points.extend_from_slice(&y);
            }
        }
        Ok(Draws { points, divergences: 0 })
    }
}

#[test]
fn faults_in_a_kernel_are_found_by_both() {
    joint(5, RIGHT).assert_equal(FALSE_ALARMS);
    calibrate(RIGHT).assert_uniform(FALSE_ALARMS);
    for fault in [ByHand { power: 0.5, ..RIGHT }, ByHand { drift: 0.5, ..RIGHT }] {
        let report = joint(5, fault);
        assert!(report.p_value() < FOUND, "{report}");
        let report = calibrate(fault);
        assert!(report.p_value() < FOUND, "{report}");
    }
    // a fault that shifts one unknown by a third of its standard deviation: 8000 transitions see
    // what 200 trials do not
    let report = joint(5, ByHand { jacobian: false, ..RIGHT });
    assert!(report.p_value() < FOUND, "{report}");
}

/// Draws from the prior, whatever the data.
struct Prior;

impl Sampler for Prior {
    fn draws<M: Model>(&self, model: &Bound<M>, seed: u64) -> Result<Draws, CheckError> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut points = Vec::new();
        for _ in 0..39 {
            points.extend(model.draw_prior(&mut rng)?.unconstrained);
        }
        Ok(Draws { points, divergences: 0 })
    }
}

impl Transition for Prior {
    fn transition<M: Model>(
        &self,
        model: &Bound<M>,
        y: &mut Vec<f64>,
        rng: &mut Xoshiro256PlusPlus,
    ) -> Result<(), CheckError> {
        *y = model.draw_prior(rng)?.unconstrained;
        Ok(())
    }
}

/// A sampler that ignores the data is calibrated in every parameter: only the log likelihood, or
/// another quantity that knows the data, gives it away (Modrák et al. 2023).
#[test]
fn ignoring_the_data_is_found_by_the_likelihood() {
    let report = calibrate(Prior);
    for quantity in &report.quantities {
        let p = quantity.chi_square_p().min(quantity.ecdf_p());
        assert_eq!(p < FOUND, quantity.name == "log likelihood", "{report}");
    }
    let report = joint(6, Prior);
    for quantity in &report.quantities {
        let p = quantity.shift_p.min(quantity.spread_p);
        assert_eq!(p < FOUND, quantity.name == "log likelihood", "{report}");
    }

    let sbc = check::sbc(12).ranked_draws(39).sampler(Prior);
    let report = sbc.run(|trial| {
        let truth = measured(&SHAPE).draw_prior(&mut trial.rng)?;
        let data = truth.replicate("y").unwrap_or_default().to_vec();
        let mean = data.iter().sum::<f64>() / data.len() as f64;
        trial.rank_with(&measured(&data), &truth, |at| {
            let level = at.values("level").unwrap_or_default();
            level.iter().map(|level| ("distance".to_owned(), (level - mean).abs())).collect()
        })
    });
    let report = report.expect("runs");
    let quantity = report.quantities.iter().find(|q| q.name == "distance").expect("ranked");
    assert!(quantity.chi_square_p() < FOUND, "{report}");
}

/// The stated rate of false alarms: p-values of 120 tests of a right kernel below 0.1 are
/// Binomial(n, 0.1), for every quantity and both tests; ± 4 standard deviations.
#[test]
fn false_alarms_come_at_the_stated_rate() {
    let (mut alarms, mut tests) = (0.0, 0.0);
    for seed in 0..120 {
        let geweke = check::geweke(seed, RIGHT).chains(40).steps(10);
        let report = geweke.run(&measured(&SHAPE), |joint| {
            let data = joint.replicate("y");
            joint.update(&measured(&data))
        });
        for quantity in report.expect("runs").quantities {
            for p in [quantity.shift_p, quantity.spread_p] {
                tests += 1.0;
                alarms += f64::from(u8::from(p < 0.1));
            }
        }
    }
    // the six tests of one run are correlated: count them as two
    let error = (0.1 * 0.9 / (tests / 3.0_f64)).sqrt();
    assert!((alarms / tests - 0.1).abs() < 4.0 * error, "{alarms} of {tests}");
}

#[test]
fn too_few_chains_are_refused() {
    let run = |geweke: check::Geweke<ByHand>| geweke.run(&measured(&SHAPE), |_| Ok(()));
    for (geweke, name) in [
        (check::geweke(1, RIGHT).chains(19), "chains"),
        (check::geweke(1, RIGHT).steps(0), "steps"),
    ] {
        let error = run(geweke).expect_err(name);
        assert!(matches!(error, CheckError::Setting { setting, .. } if setting == name), "{error}");
    }
    let report = run(check::geweke(1, RIGHT).chains(20)).expect("runs");
    assert!(report.quantities.is_empty(), "nothing was updated");
}
