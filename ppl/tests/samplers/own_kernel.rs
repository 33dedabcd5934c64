//! A sampler with a user-defined kernel: draws, adaptation, rejections, streams.

use ppl::prelude::*;
use ppl::rand::{Rng, RngCore};
use ppl::{ChainState, Kernel, Mcmc, Rejection, RunError, Step, StopReason};

/// A random walk whose scale is adapted to an acceptance rate of 0.4.
struct Walk {
    scale: f64,
    transitions: f64,
}

impl Kernel for Walk {
    fn transition(
        &mut self,
        state: &mut ChainState<'_>,
        mut rng: &mut dyn RngCore,
    ) -> Result<Step, StopReason> {
        let noise = Normal(0.0, self.scale);
        let there: Vec<f64> = state.position().iter().map(|y| y + noise.sample(&mut rng)).collect();
        let after = state.evaluate(&there)?;
        let acceptance = (after - state.log_density()).exp().min(1.0);
        if rng.random::<f64>() < acceptance {
            state.move_to(&there, after);
        }
        Ok(Step { acceptance, scale: self.scale })
    }

    fn adapt(
        &mut self,
        _: &mut ChainState<'_>,
        step: &Step,
        _: &mut dyn RngCore,
    ) -> Result<(), StopReason> {
        self.transitions += 1.0;
        self.scale *= ((step.acceptance - 0.4) / self.transitions.sqrt()).exp();
        Ok(())
    }
}

/// An exponential distribution; points below 0 are rejected.
struct Exponent;

impl LogDensity for Exponent {
    type Workspace = ();

    fn dim(&self) -> usize {
        1
    }

    fn log_density(&self, y: &[f64], _: &mut ()) -> Result<f64, Rejection> {
        match y[0] > 0.0 {
            true => Ok(-y[0]),
            false => Err(ppl::DomainError::new("y must be positive").into()),
        }
    }

    fn gradient(&self, y: &[f64], g: &mut [f64], w: &mut ()) -> Result<f64, Rejection> {
        g[0] = -1.0;
        self.log_density(y, w)
    }
}

#[test]
fn a_kernel_samples_a_density() {
    let sampler = Mcmc::with_kernel(|_| Walk { scale: 100.0, transitions: 0.0 })
        .chains(2)
        .warmup(1000)
        .draws(5000)
        .seed(8);
    let run = sampler.run(&Exponent).unwrap();
    let draws = run.traces(0);
    let chains: Vec<&[f64]> = draws.iter().map(Vec::as_slice).collect();
    let ess = ppl::diagnostics::ess_bulk(&chains);
    let mean = draws.concat().iter().sum::<f64>() / 10_000.0;
    // mean and standard deviation 1
    assert!((mean - 1.0).abs() < 4.0 / ess.sqrt(), "{mean}, effective draws {ess}");
    let chain = &run.chains[0];
    let acceptance = chain.stats.iter().map(|s| s.acceptance).sum::<f64>() / 5000.0;
    assert!((0.3..0.5).contains(&acceptance), "{acceptance}");
    assert!(chain.rejections.values().sum::<u64>() > 0);
    assert_eq!(run.evaluations(), 2 * 6000);

    let again = sampler.clone().threads(1).run(&Exponent).unwrap();
    assert_eq!(again.chains[1].draws, run.chains[1].draws);
    let error = sampler.resume(&Exponent, run).unwrap_err();
    assert!(matches!(&error, RunError::Resume { .. }), "{error}");
}
