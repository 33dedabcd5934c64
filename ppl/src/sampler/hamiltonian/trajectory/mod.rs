//! One transition of the no-U-turn sampler.
//!
//! Multinomial NUTS as in Betancourt, *A Conceptual Introduction to Hamiltonian Monte Carlo*, arXiv 1701.02434,
//! appendix A, with the generalised U-turn criterion. Stan's two additional checks between neighbouring subtrees are
//! included. All memory is allocated in [`Trajectory::new`].

mod weight;

use std::{
    mem,
    ops::{ControlFlow, RangeInclusive},
};

use rand::Rng;

use crate::sampler::draws::report::DrawStats;
use crate::sampler::hamiltonian::system::{Hamiltonian, Phase, Position};
use crate::sampler::run::stop::StopReason;
use weight::Weight;

/// Allowed values of the largest number of doublings.
pub(crate) const DEPTHS: RangeInclusive<u32> = 1..=20;

/// Energy error above which a trajectory is divergent.
const DIVERGENCE: f64 = 1000.0;

/// Reason for discarding a new subtree and ending the trajectory.
enum Discard {
    Turning,
    Diverging,
    Stop(StopReason),
}

/// Momentum and velocity at one end of a subtree.
#[derive(Clone, Debug)]
struct Endpoint {
    p: Vec<f64>,
    velocity: Vec<f64>,
}

impl Endpoint {
    fn new(dim: usize) -> Self {
        Self { p: vec![0.0; dim], velocity: vec![0.0; dim] }
    }

    fn copy_from(&mut self, phase: &Phase) {
        self.p.copy_from_slice(&phase.p);
        self.velocity.copy_from_slice(&phase.velocity);
    }
}

/// A contiguous part of the trajectory. `first` and `last` are its ends in the order of integration.
#[derive(Clone, Debug)]
struct Subtree {
    first: Endpoint,
    last: Endpoint,
    /// Sum of the momenta of all states in the subtree.
    rho: Vec<f64>,
    weight: Weight,
    proposal: Position,
    /// Energy of the proposal.
    energy: f64,
}

impl Subtree {
    fn new(dim: usize) -> Self {
        Self {
            first: Endpoint::new(dim),
            last: Endpoint::new(dim),
            rho: vec![0.0; dim],
            weight: Weight::NONE,
            proposal: Position::new(dim),
            energy: f64::INFINITY,
        }
    }

    /// Resets the subtree to a single state.
    fn plant(&mut self, phase: &Phase, energy: f64, weight: Weight) {
        self.first.copy_from(phase);
        self.last.copy_from(phase);
        self.rho.copy_from_slice(&phase.p);
        self.weight = weight;
        self.proposal.copy_from(&phase.point);
        self.energy = energy;
    }

    /// Evaluates the generalised U-turn criterion for `self` followed by `next`. Three spans are checked: both
    /// subtrees, `self` plus the first state of `next`, and the last state of `self` plus `next`.
    fn turns_into(&self, next: &Self) -> bool {
        let n = self.rho.len();
        let (rho, next_rho) = (&self.rho[..n], &next.rho[..n]);
        let (start, end) = (&self.first.velocity[..n], &next.last.velocity[..n]);
        // the last state of `self` and the first state of `next`
        let (left, left_velocity) = (&self.last.p[..n], &self.last.velocity[..n]);
        let (right, right_velocity) = (&next.first.p[..n], &next.first.velocity[..n]);
        let mut checks = [0.0; 6];
        for i in 0..n {
            let both = rho[i] + next_rho[i];
            checks[0] += start[i] * both;
            checks[1] += end[i] * both;
            let with_right = rho[i] + right[i];
            checks[2] += start[i] * with_right;
            checks[3] += right_velocity[i] * with_right;
            let with_left = left[i] + next_rho[i];
            checks[4] += left_velocity[i] * with_left;
            checks[5] += end[i] * with_left;
        }
        !checks.iter().all(|&c| c > 0.0)
    }

    /// Evaluates the U-turn criterion of a subtree of two states, and sets the sum of their momenta.
    fn turns_as_pair(&mut self) -> bool {
        let n = self.rho.len();
        let (start, end) = (&self.first.velocity[..n], &self.last.velocity[..n]);
        let (left, right) = (&self.first.p[..n], &self.last.p[..n]);
        let mut checks = [0.0; 2];
        for i in 0..n {
            let both = left[i] + right[i];
            checks[0] += start[i] * both;
            checks[1] += end[i] * both;
            self.rho[i] = both;
        }
        !checks.iter().all(|&c| c > 0.0)
    }

    /// Appends the subtree `next` to this subtree. `weight` is the total weight of both subtrees. If `takes_proposal` is
    /// true, the proposal of `next` becomes the proposal of the joined subtree.
    fn append(&mut self, next: &mut Self, weight: Weight, takes_proposal: bool) {
        mem::swap(&mut self.last, &mut next.last);
        for (rho, other) in self.rho.iter_mut().zip(&next.rho) {
            *rho += other;
        }
        self.weight = weight;
        if takes_proposal {
            mem::swap(&mut self.proposal, &mut next.proposal);
            self.energy = next.energy;
        }
    }

    /// Reverses the direction of integration.
    fn reverse(&mut self) {
        mem::swap(&mut self.first, &mut self.last);
    }
}

/// Result of one leapfrog step: the index of the end at which the trajectory was extended, and the energy and the
/// weight of the new state.
struct Advance {
    end: usize,
    energy: f64,
    weight: Weight,
}

/// The trajectory of one transition, with preallocated memory.
#[derive(Clone, Debug)]
pub(crate) struct Trajectory {
    /// States at the backward and the forward end.
    ends: [Phase; 2],
    whole: Subtree,
    /// For each level of the recursion, the two subtrees that are joined.
    levels: Vec<[Subtree; 2]>,
    /// Last position before a divergence, and the energy error of the divergence.
    pub(crate) divergence: (Vec<f64>, f64),
}

impl Trajectory {
    pub(crate) fn new(dim: usize, max_depth: u32) -> Self {
        Self {
            ends: [Phase::new(dim), Phase::new(dim)],
            whole: Subtree::new(dim),
            levels: vec![[Subtree::new(dim), Subtree::new(dim)]; max_depth as usize],
            divergence: (vec![0.0; dim], 0.0),
        }
    }

    /// Scratch space for use between transitions.
    pub(crate) fn scratch(&mut self) -> &mut Phase {
        &mut self.ends[0]
    }

    /// Runs one transition from `current` and updates `current`. The transition leaves the density invariant.
    pub(crate) fn transition<R: Rng + ?Sized>(
        &mut self,
        hamiltonian: &mut Hamiltonian<'_>,
        current: &mut Position,
        step: f64,
        rng: &mut R,
    ) -> Result<DrawStats, StopReason> {
        let [backward, forward] = &mut self.ends;
        forward.point.copy_from(current);
        hamiltonian.refresh(forward, rng);
        backward.copy_from(forward);
        let energy = forward.energy();
        self.whole.plant(forward, energy, Weight::from_error(0.0));

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
            let (weight, fraction) = self.whole.weight.join(new.weight);
            // biased progressive sampling: accepting the new subtree with probability w_new / w_old favours draws far
            // from the start
            let takes_proposal = growth.rng.random::<f64>() * (1.0 - fraction) < fraction;
            self.whole.append(new, weight, takes_proposal);
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

/// State of the recursion that doubles the trajectory.
struct Growth<'t, 'a, R: ?Sized> {
    ends: &'t mut [Phase; 2],
    levels: &'t mut [[Subtree; 2]],
    divergence: &'t mut (Vec<f64>, f64),
    hamiltonian: &'t mut Hamiltonian<'a>,
    rng: &'t mut R,
    start_energy: f64,
    forward: bool,
    step: f64,
    leapfrogs: u32,
    acceptance: f64,
}

impl<R: Rng + ?Sized> Growth<'_, '_, R> {
    /// Builds a subtree of `2^level` states in `levels[level][slot]`.
    fn grow(&mut self, level: usize, slot: usize) -> ControlFlow<Discard> {
        match level {
            0 => {
                let Advance { end, energy, weight } = self.advance()?;
                self.levels[0][slot].plant(&self.ends[end], energy, weight);
                return ControlFlow::Continue(());
            }
            1 => return self.pair(slot),
            _ => {}
        }
        self.grow(level - 1, 0)?;
        self.grow(level - 1, 1)?;
        let (below, above) = self.levels.split_at_mut(level);
        let [first, second] = &mut below[level - 1];
        let turning = first.turns_into(second);
        let (weight, fraction) = first.weight.join(second.weight);
        // multinomial sampling within the new subtree
        first.append(second, weight, self.rng.random::<f64>() < fraction);
        mem::swap(&mut above[0][slot], first);
        if turning { ControlFlow::Break(Discard::Turning) } else { ControlFlow::Continue(()) }
    }

    /// Builds a subtree of two states. Half of all subtrees have two states, so this special case is optimised: it
    /// copies less than the general case, and it evaluates one U-turn check, because the three checks are identical.
    fn pair(&mut self, slot: usize) -> ControlFlow<Discard> {
        let first = self.advance()?;
        let (tree, phase) = (&mut self.levels[1][slot], &self.ends[first.end]);
        tree.first.copy_from(phase);
        tree.proposal.copy_from(&phase.point);
        tree.energy = first.energy;
        let second = self.advance()?;
        let (tree, phase) = (&mut self.levels[1][slot], &self.ends[second.end]);
        tree.last.copy_from(phase);
        let turning = tree.turns_as_pair();
        let (weight, fraction) = first.weight.join(second.weight);
        tree.weight = weight;
        if self.rng.random::<f64>() < fraction {
            tree.proposal.copy_from(&phase.point);
            tree.energy = second.energy;
        }
        if turning { ControlFlow::Break(Discard::Turning) } else { ControlFlow::Continue(()) }
    }

    /// Makes one leapfrog step at the end of the trajectory that is being extended.
    fn advance(&mut self) -> ControlFlow<Discard, Advance> {
        let (end, step) = if self.forward { (1, self.step) } else { (0, -self.step) };
        let phase = &mut self.ends[end];
        let energy = match self.hamiltonian.leapfrog(phase, step) {
            Ok(energy) => energy,
            Err(stop) => return ControlFlow::Break(Discard::Stop(stop)),
        };
        let error = energy - self.start_energy;
        self.leapfrogs += 1;
        let weight = Weight::from_error(error);
        self.acceptance += weight.acceptance();
        if error > DIVERGENCE {
            self.divergence.0.copy_from_slice(&phase.before);
            self.divergence.1 = error;
            return ControlFlow::Break(Discard::Diverging);
        }
        ControlFlow::Continue(Advance { end, energy, weight })
    }
}

#[cfg(test)]
#[path = "../../../../tests/unit/sampler_trajectory.rs"]
mod tests;
