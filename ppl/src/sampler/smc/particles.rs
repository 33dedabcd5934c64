//! The particles of one run: tempering, resampling, moving.

use std::collections::BTreeMap;

use nalgebra::{Cholesky, DMatrix, DVector};
use rand::Rng;
use rand_distr::StandardNormal;

use super::Stage;
use crate::{
    density::{Place, Rejection},
    sampler::{
        chains::{Chain, Covariance, DrawStats, WarmupReport},
        error::SampleError,
        random_walk::{Scatter, first_scale, target_acceptance},
        rejections::{Rejections, Stop},
        run::Stream,
    },
    tempered::{Parts, Tempered},
};

/// Rejected prior draws in a row that end the search for particles.
const TRIES: u32 = 10_000;
/// Most sweeps at one temperature.
const SWEEPS: usize = 2000;
/// How fast the scale follows the acceptance: ln s changes by this for every unit.
const GAIN: f64 = 2.0;

pub(super) struct Particles<'a> {
    density: &'a dyn Tempered,
    rng: Stream,
    pub(super) temperature: f64,
    /// Row-major.
    points: Vec<f64>,
    parts: Vec<Parts>,
    /// Cholesky factor of the particles' covariance.
    factor: DMatrix<f64>,
    scale: f64,
    start: Vec<f64>,
    rejected_draws: BTreeMap<Place, u64>,
    rejections: Rejections,
}

impl<'a> Particles<'a> {
    /// Draws the particles from the prior; also the log share of prior draws that were accepted,
    /// which belongs to the evidence.
    pub(super) fn draw(
        density: &'a dyn Tempered,
        count: usize,
        run: usize,
        rng: Stream,
    ) -> Result<(Self, f64), SampleError> {
        let dim = density.unknowns();
        let mut own = Self {
            density,
            rng,
            temperature: 0.0,
            points: Vec::with_capacity(count * dim),
            parts: Vec::with_capacity(count),
            factor: DMatrix::identity(dim, dim),
            scale: first_scale(dim),
            start: Vec::new(),
            rejected_draws: BTreeMap::new(),
            rejections: Rejections::default(),
        };
        let (mut draws, mut in_a_row) = (0.0, 0);
        while own.parts.len() < count {
            draws += 1.0;
            let drawn = density.draw(&mut own.rng);
            match drawn.and_then(|y| Ok((finite(density.parts(&y)?)?, y))) {
                Ok((parts, y)) => {
                    own.points.extend(y);
                    own.parts.push(parts);
                    in_a_row = 0;
                }
                Err(rejection) => {
                    if let Err(Stop(message)) = own.rejections.count(&rejection) {
                        let message = density.explain_rejection().unwrap_or(message);
                        return Err(SampleError::Fatal { chain: run, message });
                    }
                    in_a_row += 1;
                    if in_a_row == TRIES {
                        return Err(SampleError::Initialisation {
                            chain: run,
                            tries: TRIES,
                            rejections: own.rejections.take(),
                            last: Box::new(rejection),
                            detail: density.explain_rejection(),
                        });
                    }
                }
            }
        }
        own.start = own.points[..dim].to_vec();
        own.rejected_draws = own.rejections.take();
        // unbiased for a count of draws until a given number of successes
        let count = count as f64;
        let share = if draws > count { (count - 1.0) / (draws - 1.0) } else { 1.0 };
        Ok((own, share.ln()))
    }

    pub(super) fn scale(&self) -> f64 {
        self.scale
    }

    /// Raises β until the weights' effective size falls to `fraction`, and resamples. Returns the
    /// log of the mean weight and the effective size.
    pub(super) fn temper(&mut self, fraction: f64) -> Result<(f64, f64), Stop> {
        let ln: Vec<f64> = self.parts.iter().map(|p| p.ln_likelihood).collect();
        let largest = ln.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let wanted = fraction * ln.len() as f64;
        let left = 1.0 - self.temperature;
        let mut step = left;
        if effective_size(&ln, largest, step) < wanted {
            while effective_size(&ln, largest, step) < wanted {
                step *= 0.5;
            }
            // between `step` and twice it
            let mut above = 2.0 * step;
            for _ in 0..30 {
                let middle = 0.5 * (step + above);
                if effective_size(&ln, largest, middle) < wanted {
                    above = middle;
                } else {
                    step = middle;
                }
            }
        }
        let next = if step == left { 1.0 } else { self.temperature + step };
        if next == self.temperature {
            return Err(Stop("the likelihood is too sharp for any step of the temperature".into()));
        }
        let weights: Vec<f64> = ln.iter().map(|ln| (step * (ln - largest)).exp()).collect();
        let sum: f64 = weights.iter().sum();
        self.temperature = next;
        self.resample(&weights, sum);
        let ess = effective_size(&ln, largest, step);
        Ok((step * largest + (sum / ln.len() as f64).ln(), ess))
    }

    /// Systematic resampling: copies of one particle stay neighbours.
    fn resample(&mut self, weights: &[f64], sum: f64) {
        let (count, dim) = (weights.len(), self.density.unknowns());
        let offset: f64 = self.rng.random();
        let (mut passed, mut chosen) = (weights[0], 0);
        let mut points = Vec::with_capacity(self.points.len());
        let mut parts = Vec::with_capacity(count);
        for k in 0..count {
            let mark = (k as f64 + offset) / count as f64 * sum;
            while passed < mark && chosen + 1 < count {
                chosen += 1;
                passed += weights[chosen];
            }
            points.extend_from_slice(&self.points[chosen * dim..][..dim]);
            parts.push(self.parts[chosen]);
        }
        self.points = points;
        self.parts = parts;
    }

    /// Random-walk Metropolis at the current temperature until a particle has made `jumps`
    /// accepted moves on average; `after` hears of every sweep and may stop.
    pub(super) fn wander(
        &mut self,
        jumps: usize,
        mut after: impl FnMut(f64) -> Result<(), Stop>,
    ) -> Result<Stage, Stop> {
        let (count, dim) = (self.parts.len(), self.density.unknowns());
        let mut scatter = Scatter::new(dim);
        self.points.chunks_exact(dim.max(1)).for_each(|y| scatter.add(y));
        // particles that agree in a coordinate have no covariance: keep the one before
        if let Some(factor) = Cholesky::new(scatter.covariance()) {
            self.factor = factor.unpack();
        }
        let (mut accepted, mut sweeps) = (0, 0);
        while accepted < jumps * count && sweeps < SWEEPS {
            let now = self.sweep()?;
            accepted += now;
            sweeps += 1;
            let acceptance = now as f64 / count as f64;
            self.scale *= (GAIN * (acceptance - target_acceptance(dim))).exp();
            after(self.scale)?;
        }
        Ok(Stage {
            temperature: self.temperature,
            ess: f64::NAN,
            acceptance: accepted as f64 / (sweeps * count) as f64,
            sweeps,
            scale: self.scale,
        })
    }

    /// One proposal for every particle; how many were accepted.
    fn sweep(&mut self) -> Result<usize, Stop> {
        let dim = self.density.unknowns();
        let mut noise = DVector::zeros(dim);
        let mut proposal = DVector::zeros(dim);
        let mut accepted = 0;
        for (k, parts) in self.parts.iter_mut().enumerate() {
            let y = &mut self.points[k * dim..][..dim];
            noise.iter_mut().for_each(|z| *z = self.rng.sample(StandardNormal));
            proposal.copy_from_slice(y);
            proposal.gemv(self.scale, &self.factor, &noise, 1.0);
            let uniform: f64 = self.rng.random();
            match self.density.parts(proposal.as_slice()).and_then(finite) {
                Ok(new) => {
                    let tempered = |p: &Parts| p.ln_prior + self.temperature * p.ln_likelihood;
                    if uniform < (tempered(&new) - tempered(parts)).exp() {
                        y.copy_from_slice(proposal.as_slice());
                        *parts = new;
                        accepted += 1;
                    }
                }
                Err(rejection) => self.rejections.count(&rejection)?,
            }
        }
        Ok(accepted)
    }

    /// The particles as a chain.
    pub(super) fn into_chain(mut self, evaluations: usize, last: Option<&Stage>) -> Chain {
        let acceptance = last.map_or(0.0, |stage| stage.acceptance);
        let stats = self.parts.iter().map(|parts| {
            let log_density = parts.ln_prior + parts.ln_likelihood;
            DrawStats::walk(log_density, acceptance, self.scale, evaluations as u32)
        });
        let covariance = &self.factor * self.factor.transpose();
        let warmup = WarmupReport {
            step_size: self.scale,
            target_acceptance: target_acceptance(self.factor.nrows()),
            covariance: Covariance::Dense(covariance.as_slice().to_vec()),
            rejections: self.rejected_draws,
            ..WarmupReport::at(self.start)
        };
        Chain {
            stats: stats.collect(),
            draws: self.points,
            rejections: self.rejections.take(),
            ..Chain::new(warmup)
        }
    }
}

/// (Σ w)²/Σ w² of the weights `e^{step · ln}`.
fn effective_size(ln: &[f64], largest: f64, step: f64) -> f64 {
    let (sum, squares) = ln.iter().fold((0.0, 0.0), |(sum, squares), ln| {
        let weight = (step * (ln - largest)).exp();
        (sum + weight, squares + weight * weight)
    });
    sum * sum / squares
}

/// Parts that are not finite are a rejection, whoever wrote the density.
fn finite(parts: Parts) -> Result<Parts, Rejection> {
    let value = parts.ln_prior + parts.ln_likelihood;
    if value.is_finite() {
        Ok(parts)
    } else {
        Err(Rejection::NotFinite { place: Place::unknown(), value })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn effective_size_by_hand() {
        // weights 1 and 1/2: (3/2)² / (5/4)
        let ln = [0.0, 0.5f64.ln()];
        approx::assert_relative_eq!(effective_size(&ln, 0.0, 1.0), 1.8, max_relative = 1e-14);
        approx::assert_relative_eq!(effective_size(&ln, 0.0, 0.0), 2.0, max_relative = 1e-14);
    }
}
