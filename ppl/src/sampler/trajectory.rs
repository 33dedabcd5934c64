//! One transition of the no-U-turn sampler.
//!
//! Multinomial NUTS as in Betancourt, *A Conceptual Introduction to Hamiltonian Monte Carlo*,
//! arXiv 1701.02434, appendix A, with the generalised criterion and the two checks between
//! neighbouring subtrees that Stan added. All memory is taken once, in [`Trajectory::new`].

use std::{mem, ops::ControlFlow};

use rand::Rng;

use super::{
    chains::DrawStats,
    hamiltonian::{Hamiltonian, Phase, Point},
    rejections::Stop,
};
use crate::density::LogDensity;

/// Energy error beyond which a trajectory is said to diverge.
const DIVERGENCE: f64 = 1000.0;

/// Why a subtree is discarded.
enum Discard {
    Turning,
    Diverging,
    Stop(Stop),
}

/// Momentum and velocity at one end of a subtree.
#[derive(Clone, Debug)]
struct End {
    p: Vec<f64>,
    velocity: Vec<f64>,
}

impl End {
    fn new(dim: usize) -> Self {
        Self { p: vec![0.0; dim], velocity: vec![0.0; dim] }
    }

    fn copy_from(&mut self, phase: &Phase) {
        self.p.copy_from_slice(&phase.p);
        self.velocity.copy_from_slice(&phase.velocity);
    }
}

/// A stretch of the trajectory; `first` and `last` in the order in which it was integrated.
#[derive(Clone, Debug)]
struct Subtree {
    first: End,
    last: End,
    /// Sum of the momenta, both ends included.
    rho: Vec<f64>,
    /// ln Σ e^(H₀−H).
    log_weight: f64,
    proposal: Point,
    /// Energy of the proposal.
    energy: f64,
}

impl Subtree {
    fn new(dim: usize) -> Self {
        Self {
            first: End::new(dim),
            last: End::new(dim),
            rho: vec![0.0; dim],
            log_weight: f64::NEG_INFINITY,
            proposal: Point::new(dim),
            energy: f64::INFINITY,
        }
    }

    /// Becomes the tree of one state with weight e^(−`error`).
    fn plant(&mut self, phase: &Phase, energy: f64, error: f64) {
        self.first.copy_from(phase);
        self.last.copy_from(phase);
        self.rho.copy_from_slice(&phase.p);
        self.log_weight = -error;
        self.proposal.copy_from(&phase.point);
        self.energy = energy;
    }

    /// The generalised U-turn checks for `self` followed by `next`: over both, over `self` with the
    /// first state of `next`, and over the last state of `self` with `next`.
    fn turns_into(&self, next: &Self) -> bool {
        let mut checks = [0.0; 6];
        for i in 0..self.rho.len() {
            let (rho, start, end) =
                (self.rho[i] + next.rho[i], self.first.velocity[i], next.last.velocity[i]);
            checks[0] += start * rho;
            checks[1] += end * rho;
            let rho = self.rho[i] + next.first.p[i];
            checks[2] += start * rho;
            checks[3] += next.first.velocity[i] * rho;
            let rho = self.last.p[i] + next.rho[i];
            checks[4] += self.last.velocity[i] * rho;
            checks[5] += end * rho;
        }
        !checks.iter().all(|&c| c > 0.0)
    }

    /// Appends `next`, with its proposal if `take`.
    fn append(&mut self, next: &mut Self, take: bool) {
        mem::swap(&mut self.last, &mut next.last);
        for (rho, other) in self.rho.iter_mut().zip(&next.rho) {
            *rho += other;
        }
        self.log_weight = log_add(self.log_weight, next.log_weight);
        if take {
            mem::swap(&mut self.proposal, &mut next.proposal);
            self.energy = next.energy;
        }
    }

    /// Time runs the other way.
    fn reverse(&mut self) {
        mem::swap(&mut self.first, &mut self.last);
    }
}

/// ln(eᵃ + eᵇ).
fn log_add(a: f64, b: f64) -> f64 {
    let (low, high) = if a < b { (a, b) } else { (b, a) };
    if high == f64::NEG_INFINITY { high } else { high + (low - high).exp().ln_1p() }
}

/// The trajectory of one transition and the memory it grows in.
#[derive(Clone, Debug)]
pub(super) struct Trajectory {
    /// States at the backward and the forward end.
    ends: [Phase; 2],
    whole: Subtree,
    /// The two subtrees being joined at every level.
    levels: Vec<[Subtree; 2]>,
    /// Last position before a divergence, and its energy error.
    pub(super) divergence: (Vec<f64>, f64),
}

impl Trajectory {
    pub(super) fn new(dim: usize, max_depth: u32) -> Self {
        Self {
            ends: [Phase::new(dim), Phase::new(dim)],
            whole: Subtree::new(dim),
            levels: vec![[Subtree::new(dim), Subtree::new(dim)]; max_depth as usize],
            divergence: (vec![0.0; dim], 0.0),
        }
    }

    /// A phase to work with between transitions.
    pub(super) fn scratch(&mut self) -> &mut Phase {
        &mut self.ends[0]
    }

    /// Moves `current` by one transition that leaves the density invariant.
    pub(super) fn transition<D: LogDensity, R: Rng + ?Sized>(
        &mut self,
        hamiltonian: &mut Hamiltonian<'_, D>,
        current: &mut Point,
        step: f64,
        rng: &mut R,
    ) -> Result<DrawStats, Stop> {
        let [backward, forward] = &mut self.ends;
        forward.point.copy_from(current);
        hamiltonian.refresh(forward, rng);
        backward.copy_from(forward);
        let energy = forward.energy();
        self.whole.plant(forward, energy, 0.0);

        let mut growth = Growth {
            ends: &mut self.ends,
            levels: &mut self.levels,
            divergence: &mut self.divergence,
            hamiltonian,
            rng,
            start_energy: energy,
            forward: true,
            step,
            leapfrogs: 0,
            acceptance: 0.0,
        };
        let max_depth = growth.levels.len();
        let (mut depth, mut divergent) = (0, false);
        while depth < max_depth {
            growth.forward = growth.rng.random();
            match growth.grow(depth, 0) {
                ControlFlow::Continue(()) => {}
                ControlFlow::Break(Discard::Turning) => break,
                ControlFlow::Break(Discard::Diverging) => {
                    divergent = true;
                    break;
                }
                ControlFlow::Break(Discard::Stop(stop)) => return Err(stop),
            }
            let new = &mut growth.levels[depth][0];
            if !growth.forward {
                self.whole.reverse();
            }
            let turning = self.whole.turns_into(new);
            // biased towards the new half, so that the draw moves far
            let take = growth.rng.random::<f64>() < (new.log_weight - self.whole.log_weight).exp();
            self.whole.append(new, take);
            if !growth.forward {
                self.whole.reverse();
            }
            depth += 1;
            if turning {
                break;
            }
        }
        let (leapfrogs, acceptance) = (growth.leapfrogs, growth.acceptance);
        mem::swap(current, &mut self.whole.proposal);
        Ok(DrawStats {
            log_density: current.log_density,
            energy: self.whole.energy,
            acceptance: acceptance / f64::from(leapfrogs),
            step_size: step,
            depth: depth as u32,
            leapfrogs,
            divergent,
            tuning: false,
        })
    }
}

/// The recursion that doubles a trajectory.
struct Growth<'t, 'a, D: LogDensity, R: ?Sized> {
    ends: &'t mut [Phase; 2],
    levels: &'t mut [[Subtree; 2]],
    divergence: &'t mut (Vec<f64>, f64),
    hamiltonian: &'t mut Hamiltonian<'a, D>,
    rng: &'t mut R,
    start_energy: f64,
    forward: bool,
    step: f64,
    leapfrogs: u32,
    acceptance: f64,
}

impl<D: LogDensity, R: Rng + ?Sized> Growth<'_, '_, D, R> {
    /// Grows a subtree of `2^level` states into `levels[level][place]`.
    fn grow(&mut self, level: usize, place: usize) -> ControlFlow<Discard> {
        if level == 0 {
            return self.leaf(place);
        }
        self.grow(level - 1, 0)?;
        self.grow(level - 1, 1)?;
        let (below, above) = self.levels.split_at_mut(level);
        let [first, second] = &mut below[level - 1];
        let turning = first.turns_into(second);
        // uniform over the states of a new subtree
        let share = (second.log_weight - log_add(first.log_weight, second.log_weight)).exp();
        first.append(second, self.rng.random::<f64>() < share);
        mem::swap(&mut above[0][place], first);
        if turning { ControlFlow::Break(Discard::Turning) } else { ControlFlow::Continue(()) }
    }

    /// One leapfrog step at the growing end.
    fn leaf(&mut self, place: usize) -> ControlFlow<Discard> {
        let (end, step) = if self.forward { (1, self.step) } else { (0, -self.step) };
        let phase = &mut self.ends[end];
        self.divergence.0.copy_from_slice(&phase.point.y);
        let energy = match self.hamiltonian.leapfrog(phase, step) {
            Ok(energy) => energy,
            Err(stop) => return ControlFlow::Break(Discard::Stop(stop)),
        };
        let error = energy - self.start_energy;
        self.leapfrogs += 1;
        self.acceptance += (-error).exp().min(1.0);
        if error > DIVERGENCE {
            self.divergence.1 = error;
            return ControlFlow::Break(Discard::Diverging);
        }
        self.levels[0][place].plant(phase, energy, error);
        ControlFlow::Continue(())
    }
}
