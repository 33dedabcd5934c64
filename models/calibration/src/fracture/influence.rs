//! Influence of each specimen on the posterior of the parameters.

use ppl::diagnostics::{ess_mean, pareto_smooth};
use ppl::{Nuts, Posterior, SampleError};

use super::loo::ln_conditionals;
use super::specimens::Specimens;
use super::{Calibration, CalibrationError, calibration_on, leave_out};

/// Comparison of two calibrations: to all specimens except one, and to all specimens.
#[derive(Clone, Debug, PartialEq)]
pub struct WithoutSpecimen {
    /// Log density log p(y_k | y_−k) of the omitted specimen k, given the other specimens.
    pub elpd: f64,
    /// Shape of the Pareto tail of the importance weights.
    pub pareto_k: f64,
    /// Shift of the posterior mean of each parameter, as a multiple of its posterior standard deviation.
    pub shifts: Vec<f64>,
    /// Whether the posterior without the specimen was sampled, and not estimated by importance weights.
    pub is_sampled: bool,
    /// Whether the importance weights are reliable, or the posterior without the specimen was sampled.
    pub is_reliable: bool,
}

impl Calibration {
    /// Compares the calibration without each specimen with the calibration to all specimens. The posterior without a
    /// specimen is computed by Pareto-smoothed importance weights, or sampled again if the shape k of these weights is
    /// above the threshold of PSIS (0.7 for 2200 draws and more). The draws of a joint calibration of several tests are
    /// never sampled again.
    ///
    /// # Errors
    /// If there are fewer than 25 draws, a specimen has no density at some draw, or the model rejects every starting
    /// point.
    ///
    /// # Reference
    /// Vehtari, Gelman & Gabry (2017), doi:10.1007/s11222-016-9696-4, for the weights;
    /// [`Calibration::loo`] for the density of the omitted specimen.
    pub fn without_each(
        &self,
        sampler: &Nuts<'_>,
        burn_in: usize,
        seed: u64,
    ) -> Result<Vec<WithoutSpecimen>, CalibrationError> {
        let loo = self.loo()?;
        let rows = ln_conditionals(&self.posterior, &self.forward, &self.specimens);
        let theta = theta_draws(&self.posterior);
        let all = moments(&theta, &vec![(theta.len() as f64).recip(); theta.len()]);
        let unreliable = loo.unreliable();
        let mut found = Vec::with_capacity(self.specimens.len());
        for (k, point) in loo.points.iter().enumerate() {
            // draws of a joint calibration cannot be replaced by draws of this test alone
            let are_weights_reliable = !unreliable.contains(&k);
            let is_sampled = !are_weights_reliable && self.mode.is_some();
            let (without, elpd) = match is_sampled {
                true => self.sampled_without(k, sampler, burn_in, seed)?,
                false => {
                    let column = rows.iter().skip(k).step_by(self.specimens.len()).copied();
                    let weights =
                        weights(&column.collect::<Vec<_>>(), self.posterior.posterior.draws);
                    (moments(&theta, &weights), point.elpd)
                }
            };
            let shift = |(all, without): (&[f64; 2], &[f64; 2])| (without[0] - all[0]) / all[1];
            let shifts = all.iter().zip(&without).map(shift).collect();
            found.push(WithoutSpecimen {
                elpd,
                pareto_k: point.pareto_k,
                shifts,
                is_sampled,
                is_reliable: are_weights_reliable || is_sampled,
            });
        }
        Ok(found)
    }

    /// Moments of the parameters, and log p(y_k | y_−k) of specimen k given the other specimens, from a posterior
    /// that was sampled without specimen k.
    fn sampled_without(
        &self,
        k: usize,
        sampler: &Nuts<'_>,
        burn_in: usize,
        seed: u64,
    ) -> Result<(Vec<[f64; 2]>, f64), CalibrationError> {
        let others = without(&self.specimens, k)?;
        let model = calibration_on(&self.forward, &self.priors, &others);
        let mut chains = sampler.run(&model).map_err(SampleError::from)?;
        leave_out(&mut chains, burn_in);
        let posterior = Posterior::from_chains(&model, chains, seed)?;
        let theta = theta_draws(&posterior);
        let rows = ln_conditionals(&posterior, &self.forward, &self.specimens);
        let own: Vec<f64> = rows.iter().skip(k).step_by(self.specimens.len()).copied().collect();
        let top = own.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mean = own.iter().map(|l| (l - top).exp()).sum::<f64>() / own.len() as f64;
        let equal = vec![(theta.len() as f64).recip(); theta.len()];
        Ok((moments(&theta, &equal), top + mean.ln()))
    }
}

/// Returns all specimens except specimen k.
///
/// # Errors
/// If no specimen remains.
fn without(all: &Specimens, k: usize) -> Result<Specimens, CalibrationError> {
    let mut rows = all.rows.clone();
    rows.remove(k);
    let mut others = Specimens::new(&rows)?.sharing(all.shared.clone())?;
    if all.known_inputs() > 0 {
        let mut inputs = all.inputs.iter().cloned();
        let mut own = |is_known: &bool| if *is_known { inputs.next() } else { None };
        let mut known: Vec<Option<Vec<f64>>> = all.is_known.iter().map(&mut own).collect();
        known.remove(k);
        others = others.knowing(&known, all.population.clone())?;
    }
    others.open.clone_from(&all.open);
    Ok(others)
}

/// Returns the draws of the parameters, one row per draw.
fn theta_draws(posterior: &Posterior) -> Vec<&[f64]> {
    let group = &posterior.posterior;
    let theta = group.variables.iter().find(|variable| variable.name == "theta");
    let values = theta.map_or(&[][..], |values| &values.data);
    let size = values.len() / (group.chains * group.draws).max(1);
    values.chunks(size.max(1)).collect()
}

/// Returns normalised importance weights of the draws for the posterior without one observation. `ln_density`
/// contains the log density of this observation at each draw; `draws` is the number of draws per chain.
fn weights(ln_density: &[f64], draws: usize) -> Vec<f64> {
    let top = ln_density.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let density: Vec<f64> = ln_density.iter().map(|l| (l - top).exp()).collect();
    let traces: Vec<&[f64]> = density.chunks(draws.max(1)).collect();
    let relative = ess_mean(&traces) / density.len() as f64;
    let mut weights: Vec<f64> = ln_density.iter().map(|l| -l).collect();
    pareto_smooth(&mut weights, if relative.is_nan() { 1.0 } else { relative });
    weights.into_iter().map(f64::exp).collect()
}

/// Returns the weighted mean and standard deviation of each column. The sum of the weights is 1.
fn moments(rows: &[&[f64]], weights: &[f64]) -> Vec<[f64; 2]> {
    let columns = rows.first().map_or(0, |row| row.len());
    let mean = |f: &dyn Fn(&[f64]) -> f64| -> f64 {
        rows.iter().zip(weights).map(|(row, weight)| weight * f(row)).sum()
    };
    let moments = |i: usize| {
        let first = mean(&|row| row[i]);
        [first, mean(&|row| (row[i] - first).powi(2)).sqrt()]
    };
    (0..columns).map(moments).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fracture::Population;
    use crate::fracture::six_specimens::{CALIBRATED, WITHOUT_EACH, sampler};

    /// Without a mode, as in a joint calibration, the last specimen is not left out by sampling, and its weights are
    /// marked as unreliable.
    #[test]
    fn unreliable_weights_of_a_joint_calibration_are_marked() {
        let joint = Calibration { mode: None, ..CALIBRATED.clone() };
        let found = joint.without_each(&sampler(), 0, 3).unwrap();
        let marks: Vec<[bool; 2]> =
            found.iter().map(|one| [one.is_sampled, one.is_reliable]).collect();
        let expected = [[false, true]; 5].into_iter().chain([[false, false]]).collect::<Vec<_>>();
        assert_eq!(marks, expected);
    }

    /// For the last specimen, the posterior without the specimen is sampled, because importance weights fail. The
    /// shift of each specimen agrees with the difference between two calibrations, one with all specimens and one
    /// without the specimen.
    #[test]
    fn shifts_are_those_of_calibrations_without_the_specimen() {
        let found = CALIBRATED.without_each(&sampler(), 0, 3).unwrap();
        let is_sampled: Vec<bool> = found.iter().map(|one| one.is_sampled).collect();
        assert_eq!(is_sampled, [false, false, false, false, false, true]);
        assert!(found.iter().all(|one| one.is_reliable));
        let all = CALIBRATED.posterior.trace("theta[matrix.young_mpa]").unwrap().concat();
        let mean = |draws: &[f64]| draws.iter().sum::<f64>() / draws.len() as f64;
        let sd = |draws: &[f64]| {
            let m = mean(draws);
            (draws.iter().map(|x| (x - m).powi(2)).sum::<f64>() / draws.len() as f64).sqrt()
        };
        // both calibrations use quantities relative to the means of all specimens, which are 1
        for (k, (one, posterior)) in found.iter().zip(WITHOUT_EACH.iter()).enumerate() {
            let without = theta_draws(posterior).concat();
            let expected = (mean(&without) - mean(&all)) / sd(&all);
            // 0.1 is four standard errors of the difference of two means that are computed from about 3000
            // effective draws each; importance weights add an error
            let within = if one.is_sampled { 0.1 } else { 0.2 };
            assert!((one.shifts[0] - expected).abs() < within, "{k}: {one:?}, not {expected}");
        }
        // the specimen that is far from the other specimens shifts the mean most
        let largest = found.iter().map(|one| one.shifts[0].abs()).fold(0.0, f64::max);
        assert_eq!(found[5].shifts[0].abs(), largest, "{found:?}");
    }

    #[test]
    fn the_other_specimens_keep_what_is_known_of_them() {
        let rows = vec![vec![1.0], vec![2.0], vec![3.0], vec![4.0]];
        let known = [Some(vec![0.1]), None, Some(vec![0.3]), None];
        let population = Population::of(&[0.0, 0.1, 0.2, 0.3].map(|k| vec![k])).unwrap();
        let all = Specimens::new(&rows).unwrap().sharing(vec![vec![0.5]]).unwrap();
        let all = all.knowing(&known, Some(population)).unwrap();
        let others = without(&all, 0).unwrap();
        assert_eq!(others.rows, [[2.0], [3.0], [4.0]]);
        assert_eq!(others.is_known, [false, true, false]);
        assert_eq!(others.inputs, [[0.3]]);
        assert_eq!((others.shared[0][0], others.known_inputs()), (0.5, 1));
    }
}
