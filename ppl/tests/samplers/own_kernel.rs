//! A sampler with a user-defined kernel: draws, adaptation, rejections, streams.

use ppl::prelude::*;
use ppl::rand::{Rng, RngCore};
use ppl::{ChainState, FatalError, Kernel, Mcmc, Rejection, RunError, Step, StopReason};

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
            state.move_to(&there, after)?;
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

/// A kernel that passes a point or a gradient of the wrong length to one method of the state.
#[derive(Clone, Copy, Debug)]
enum Careless {
    Evaluates,
    Differentiates,
    Gradient,
    Moves,
}

impl Kernel for Careless {
    fn transition(
        &mut self,
        state: &mut ChainState<'_>,
        _: &mut dyn RngCore,
    ) -> Result<Step, StopReason> {
        let (short, long) = ([], [0.5, 0.5]);
        match self {
            Self::Evaluates => state.evaluate(&long).map(|_| ())?,
            Self::Differentiates => state.gradient(&long, &mut [0.0; 2]).map(|_| ())?,
            Self::Gradient => state.gradient(&[0.5], &mut [0.0; 3]).map(|_| ())?,
            Self::Moves => state.move_to(&short, -1.0)?,
        }
        Ok(Step::default())
    }
}

/// The chain stops at the first wrong length, with both lengths, and keeps its position.
#[test]
fn vectors_of_the_wrong_length_are_refused_at_once() {
    for (kernel, expected) in [
        (Careless::Evaluates, FatalError::PointLength { point: 2, dim: 1 }),
        (Careless::Differentiates, FatalError::PointLength { point: 2, dim: 1 }),
        (Careless::Gradient, FatalError::GradientLength { gradient: 3, point: 1 }),
        (Careless::Moves, FatalError::PointLength { point: 0, dim: 1 }),
    ] {
        let sampler = Mcmc::with_kernel(|_| kernel).chains(1).warmup(0).draws(5).seed(2);
        let run = sampler.run(&Exponent).unwrap();
        let stopped = run.chains[0].stopped.clone();
        assert_eq!(stopped, Some(StopReason::Fatal(Box::new(expected))), "{kernel:?}");
        assert!(run.chains[0].draws.is_empty(), "{kernel:?}");
        assert_eq!(run.evaluations(), 0, "{kernel:?}");
    }
}

/// A density that returns numbers that are not finite instead of rejections: the value is NaN for y > 1, and the
/// gradient is infinite for y < −1.
struct Silent;

impl LogDensity for Silent {
    type Workspace = ();

    fn dim(&self) -> usize {
        1
    }

    fn log_density(&self, y: &[f64], _: &mut ()) -> Result<f64, Rejection> {
        Ok(if y[0] > 1.0 { f64::NAN } else { -y[0] * y[0] })
    }

    fn gradient(&self, y: &[f64], g: &mut [f64], w: &mut ()) -> Result<f64, Rejection> {
        g[0] = if y[0] < -1.0 { f64::INFINITY } else { -2.0 * y[0] };
        self.log_density(y, w)
    }
}

/// A kernel that stays at its position and evaluates the gradient at three points.
struct Looking;

impl Kernel for Looking {
    fn transition(
        &mut self,
        state: &mut ChainState<'_>,
        _: &mut dyn RngCore,
    ) -> Result<Step, StopReason> {
        let mut slope = [7.0];
        for y in [1.5, -1.5] {
            assert_eq!(state.gradient(&[y], &mut slope)?, f64::NEG_INFINITY);
            assert_eq!(slope, [0.0]);
        }
        assert_eq!(state.gradient(&[0.5], &mut slope)?, -0.25);
        assert_eq!(slope, [-1.0]);
        Ok(Step { acceptance: 1.0, scale: 1.0 })
    }
}

#[test]
fn gradients_that_are_not_finite_are_counted_as_rejections() {
    let sampler = Mcmc::with_kernel(|_| Looking).chains(1).warmup(0).draws(10).seed(2);
    let sampler = sampler.init_points(vec![vec![0.0]]);
    let run = sampler.run(&Silent).unwrap();
    assert_eq!(run.chains[0].stopped, None);
    assert_eq!(run.chains[0].rejections.values().sum::<u64>(), 20);
}
