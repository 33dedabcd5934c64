//! Hamiltonian dynamics with the negative log density as potential energy.

use rand::Rng;

use crate::density::Rejection;
use crate::model::erased::{ErasedDensity, Evaluator};
use crate::sampler::hamiltonian::dot::dot;
use crate::sampler::hamiltonian::metric::Metric;
use crate::sampler::run::rejections::Rejections;
use crate::sampler::run::stop::StopReason;

/// A position with its log density and score (gradient of the log density).
#[derive(Clone, Debug)]
pub(crate) struct Position {
    pub(crate) y: Vec<f64>,
    pub(crate) gradient: Vec<f64>,
    pub(crate) log_density: f64,
}

impl Position {
    pub(crate) fn new(dim: usize) -> Self {
        Self { y: vec![0.0; dim], gradient: vec![0.0; dim], log_density: f64::NEG_INFINITY }
    }

    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.y.copy_from_slice(&other.y);
        self.gradient.copy_from_slice(&other.gradient);
        self.log_density = other.log_density;
    }
}

/// A point in phase space: position, momentum `p`, velocity `M⁻¹p` and acceleration `M⁻¹∇ln p`.
#[derive(Clone, Debug)]
pub(crate) struct Phase {
    pub(crate) point: Position,
    pub(crate) p: Vec<f64>,
    pub(crate) velocity: Vec<f64>,
    acceleration: Vec<f64>,
    /// Position before the most recent leapfrog step.
    pub(crate) before: Vec<f64>,
}

impl Phase {
    pub(crate) fn new(dim: usize) -> Self {
        let zeros = vec![0.0; dim];
        Self {
            point: Position::new(dim),
            p: zeros.clone(),
            velocity: zeros.clone(),
            acceleration: zeros.clone(),
            before: zeros,
        }
    }

    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.point.copy_from(&other.point);
        self.p.copy_from_slice(&other.p);
        self.velocity.copy_from_slice(&other.velocity);
        self.acceleration.copy_from_slice(&other.acceleration);
    }

    /// Hamiltonian `H = −ln p(y) + ½ pᵀM⁻¹p`.
    pub(crate) fn energy(&self) -> f64 {
        0.5 * dot(&self.p, &self.velocity) - self.point.log_density
    }
}

/// Updates the momentum p with the score g, and the velocity v with the acceleration a, over the time `time`. Returns
/// the new kinetic energy ½ pᵀM⁻¹p.
// the arguments are slices, which cannot overlap: the compiler can therefore use SIMD registers
#[inline]
fn kick(p: &mut [f64], v: &mut [f64], g: &[f64], a: &[f64], time: f64) -> f64 {
    let (p, p_rest) = p.as_chunks_mut::<4>();
    let (v, v_rest) = v.as_chunks_mut::<4>();
    let (g, g_rest) = g.as_chunks::<4>();
    let (a, a_rest) = a.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for (((p, v), g), a) in p.iter_mut().zip(v).zip(g).zip(a) {
        for k in 0..4 {
            p[k] += time * g[k];
            v[k] += time * a[k];
            sums[k] += p[k] * v[k];
        }
    }
    let mut rest = 0.0;
    for (((p, v), g), a) in p_rest.iter_mut().zip(v_rest).zip(g_rest).zip(a_rest) {
        *p += time * g;
        *v += time * a;
        rest += *p * *v;
    }
    0.5 * ((sums[0] + sums[1]) + (sums[2] + sums[3]) + rest)
}

/// The log density, the mass matrix, and the number of rejected points per location.
pub(crate) struct Hamiltonian<'a> {
    density: Box<dyn Evaluator + 'a>,
    pub(crate) metric: Metric,
    pub(crate) rejections: Rejections,
}

impl<'a> Hamiltonian<'a> {
    pub(crate) fn new(density: &'a dyn ErasedDensity) -> Self {
        Self {
            density: density.evaluator(),
            metric: Metric::identity(density.dim()),
            rejections: Rejections::default(),
        }
    }

    pub(crate) fn explain(&self, y: &[f64]) -> Option<String> {
        self.density.explain(y)
    }

    /// Evaluates log density and score at `point.y`.
    pub(crate) fn evaluate(&mut self, point: &mut Position) -> Result<(), Rejection> {
        point.log_density = self.density.gradient(&point.y, &mut point.gradient)?;
        Ok(())
    }

    /// Draws a new momentum.
    pub(crate) fn refresh<R: Rng + ?Sized>(&self, phase: &mut Phase, rng: &mut R) {
        self.metric.draw_momentum(rng, &mut phase.p);
        self.metric.apply(&phase.p, &mut phase.velocity);
        self.metric.apply(&phase.point.gradient, &mut phase.acceleration);
    }

    /// One leapfrog step of size `step`; a negative step goes backwards in time. Returns the energy after the step,
    /// or +∞ if the density rejects the new point.
    ///
    /// The velocities are updated together with the momenta, so that a step multiplies by the mass matrix once instead
    /// of twice. Within one trajectory, velocities and momenta differ by rounding errors only.
    pub(crate) fn leapfrog(&mut self, phase: &mut Phase, step: f64) -> Result<f64, StopReason> {
        let n = phase.p.len();
        let (p, v) = (&mut phase.p[..n], &mut phase.velocity[..n]);
        let (y, g) = (&mut phase.point.y[..n], &phase.point.gradient[..n]);
        let (a, before) = (&phase.acceleration[..n], &mut phase.before[..n]);
        let half = 0.5 * step;
        for i in 0..n {
            p[i] += half * g[i];
            v[i] += half * a[i];
            let old = y[i];
            y[i] = old + step * v[i];
            before[i] = old;
        }
        if let Err(rejection) = self.evaluate(&mut phase.point) {
            self.rejections.count(&rejection)?;
            return Ok(f64::INFINITY);
        }
        self.metric.apply(&phase.point.gradient, &mut phase.acceleration);
        let Phase { point, p, velocity, acceleration, .. } = phase;
        let energy = kick(p, velocity, &point.gradient, acceleration, half) - point.log_density;
        Ok(if energy.is_nan() { f64::INFINITY } else { energy })
    }

    /// Doubles or halves `step` until the acceptance probability of one leapfrog step from `start` crosses 0.8 (Hoffman
    /// & Gelman 2014, algorithm 4, with Stan's threshold). `phase` is scratch space.
    pub(crate) fn search_step<R: Rng + ?Sized>(
        &mut self,
        start: &Position,
        phase: &mut Phase,
        mut step: f64,
        rng: &mut R,
    ) -> Result<f64, StopReason> {
        let mut growing = None;
        // the loop is bounded, because on a flat density or without unknowns every step is accepted
        for _ in 0..SEARCHES {
            phase.point.copy_from(start);
            self.refresh(phase, rng);
            let before = phase.energy();
            let accepted = before - self.leapfrog(phase, step)? > 0.8_f64.ln();
            let grow = *growing.get_or_insert(accepted);
            if accepted != grow {
                break;
            }
            step *= if grow { 2.0 } else { 0.5 };
        }
        Ok(step)
    }
}

/// Largest number of doublings or halvings in the step search: factors from 10⁻¹⁵ to 10¹⁵.
const SEARCHES: usize = 50;

#[cfg(test)]
#[path = "../../../tests/unit/sampler_hamiltonian.rs"]
mod tests;
