//! Simulation-based calibration of every sampler of the crate, and of faulty samplers that it must detect. Each
//! assertion about a right sampler has a false-alarm rate of 1e-4; a faulty sampler must give p below 1e-6.

use ppl::check::{self, CheckError, Draws, Sampler, SbcReport};
use ppl::prelude::*;
use ppl::rand::{Rng, SeedableRng};
use ppl::rand_xoshiro::Xoshiro256PlusPlus;
use ppl::{Bound, Model, Rejection, Workspace};
use rand_distr::StandardNormal;

const FALSE_ALARMS: f64 = 1e-4;
const FOUND: f64 = 1e-6;

ppl::model! {
    /// A level and a scale. The prior of the scale is not normal, so that the posterior is skewed and
    /// correlated.
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
    trials(200, sampler)
}

fn trials(count: usize, sampler: impl Sampler) -> SbcReport {
    let sbc = check::sbc(11).replications(count).ranked_draws(39).sampler(sampler);
    let report = sbc.run(|trial| {
        let truth = measured(&SHAPE).draw_prior(&mut trial.rng)?;
        let data = truth.replicate("y").unwrap_or_default();
        trial.rank(&measured(data), &truth)
    });
    report.expect("the sampler runs")
}

#[test]
fn nuts() {
    calibrate(Nuts::default().chains(1).warmup(300).draws(156)).assert_uniform(FALSE_ALARMS);
}

#[test]
fn metropolis() {
    let sampler = Metropolis::default().chains(1).warmup(1000).draws(39).thin(25);
    calibrate(sampler).assert_uniform(FALSE_ALARMS);
}

/// Delayed acceptance whose screening density is too wide and shifted.
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
        Err(Rejection::fatal("delayed acceptance needs no gradient"))
    }
}

impl Sampler for Screened {
    fn draws<M: Model>(&self, model: &Bound<M>, seed: u64) -> Result<Draws, CheckError> {
        Draws::of_chains(&self.0.clone().seed(seed).run(&Biased(model), model)?)
    }
}

#[test]
fn delayed_acceptance() {
    for steps in [1, 4] {
        let sampler = DelayedAcceptance::default().screening_steps(steps);
        let sampler = sampler.chains(1).warmup(1000).draws(39).thin(30);
        calibrate(Screened(sampler)).assert_uniform(FALSE_ALARMS);
    }
}

/// Random-walk Metropolis without the crate's kernel, with optional faults.
#[derive(Clone, Copy)]
struct ByHand {
    /// Exponent of the acceptance probability `min(1, ratio^power)`; 1 is right.
    power: f64,
    /// Mean of the proposed jump, which the acceptance ignores; 0 is right.
    drift: f64,
    /// Whether the density of the unconstrained coordinates includes the Jacobian.
    jacobian: bool,
}

const RIGHT: ByHand = ByHand { power: 1.0, drift: 0.0, jacobian: true };

impl ByHand {
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
        let mut draws = Vec::new();
        for step in 0..1200 {
            self.transition(model, &mut y, &mut rng)?;
            if step >= 420 && step % 20 == 0 {
                draws.extend_from_slice(&y);
            }
        }
        Ok(Draws { points: draws, divergences: 0 })
    }
}

#[test]
fn faults_in_a_kernel_are_found() {
    calibrate(RIGHT).assert_uniform(FALSE_ALARMS);
    for fault in [ByHand { power: 0.5, ..RIGHT }, ByHand { drift: 0.5, ..RIGHT }] {
        let report = calibrate(fault);
        assert!(report.p_value() < FOUND, "{report}");
    }
    // this fault shifts one unknown by a third of its standard deviation, and needs more trials
    let report = trials(1000, ByHand { jacobian: false, ..RIGHT });
    assert!(report.p_value() < FOUND, "{report}");
}

/// A sampler that draws from the prior, whatever the data.
struct Prior;

impl Sampler for Prior {
    fn draws<M: Model>(&self, model: &Bound<M>, seed: u64) -> Result<Draws, CheckError> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut draws = Vec::new();
        for _ in 0..39 {
            draws.extend(model.draw_prior(&mut rng)?.unconstrained);
        }
        Ok(Draws { points: draws, divergences: 0 })
    }
}

/// A sampler that ignores the data is calibrated in every parameter; only the log likelihood, or another quantity that
/// depends on the data, detects it (Modrák et al. 2023).
#[test]
fn ignoring_the_data_is_found_by_the_likelihood() {
    let report = calibrate(Prior);
    for quantity in &report.quantities {
        let p = quantity.chi_square_p().min(quantity.ecdf_p());
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
