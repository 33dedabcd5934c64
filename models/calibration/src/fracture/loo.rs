//! Leave-one-out cross-validation over the specimens.

use ppl::diagnostics::{Loo, LooError};
use ppl::prelude::*;
use ppl::{DomainError, Posterior};
use surrogate::DynPce;

use super::specimens::Specimens;
use super::{Calibration, given_others};

impl Calibration {
    /// Computes leave-one-out cross-validation over the specimens. A specimen's result is its log density as predicted
    /// by the calibration to all other specimens, and its influence on the posterior (Pareto k). Quantities are
    /// relative to the means of all specimens.
    ///
    /// Specimens that share an error are not independent given the parameters. Therefore the density of specimen k is
    /// p(y_k | y_−k, θ), in which the other specimens y_−k inform about the shared error. [`Posterior::loo`] would
    /// leave out contrasts instead of specimens.
    ///
    /// # Errors
    /// If there are fewer than 25 draws, or a specimen has no density at some draw.
    ///
    /// # Reference
    /// Bürkner, Gabry & Vehtari (2021), doi:10.1007/s00180-020-01045-4, for normal models that do not
    /// factorise.
    pub fn loo(&self) -> Result<Loo, LooError> {
        let group = &self.posterior.posterior;
        let rows = ln_conditionals(&self.posterior, &self.forward, &self.specimens);
        Loo::new(group.chains, group.draws, self.specimens.len(), &rows)
    }
}

/// Returns [`Specimens::ln_conditionals`] at every draw, one row per draw; NaN at draws where the
/// densities cannot be computed.
pub(super) fn ln_conditionals(
    posterior: &Posterior,
    forward: &DynPce,
    specimens: &Specimens,
) -> Vec<f64> {
    let at_draw = |theta: &[f64], factor: &DynCholeskyFactor<f64>| {
        given_others::ln_conditionals(specimens, &specimens.expected(forward, theta)?, factor)
    };
    let conditionals = draws_of(posterior, forward.outputs().len()).flat_map(|(theta, factor)| {
        factor
            .and_then(|factor| at_draw(theta, &factor))
            .unwrap_or_else(|_| vec![f64::NAN; specimens.len()])
    });
    conditionals.collect()
}

/// Parameters and Cholesky factor of the covariance between specimens at each draw of a posterior of `size` quantities.
pub(super) fn draws_of(
    posterior: &Posterior,
    size: usize,
) -> impl Iterator<Item = (&[f64], Result<DynCholeskyFactor<f64>, DomainError>)> {
    let group = &posterior.posterior;
    let values = |name: &str| group.get(name).map_or(&[][..], |values| &values.data);
    let (theta, sd, corr) = (values("theta"), values("sd"), values("corr"));
    let inputs = (theta.len() / (group.chains * group.draws).max(1)).max(1);
    let draws = theta.chunks(inputs).zip(sd.chunks(size)).zip(corr.chunks(size * size));
    draws.map(move |((theta, sd), corr)| {
        let row = |(row, sd): (&[f64], &f64)| row.iter().map(|x| sd * x).collect();
        let factor: Vec<Vec<f64>> = corr.chunks(size).zip(sd).map(row).collect();
        (theta, DynCholeskyFactor::new(&factor))
    })
}

#[cfg(test)]
mod tests {
    use ppl::Nuts;

    use super::*;
    use crate::fracture::six_specimens::{CALIBRATED, QOIS, WITHOUT_EACH, forward, priors, shared};
    use crate::fracture::{Calibration, Evidence, calibrate, calibrate_after};

    /// Compares log p(y_k | y_−k) from importance weights with the log mean of p(y_k | y_−k, θ) over posteriors that
    /// were sampled without specimen k.
    #[test]
    fn smoothed_weights_do_what_refits_do() {
        let loo = CALIBRATED.loo().unwrap();
        assert_eq!(loo.points.len(), 6);
        let qois: Vec<Vec<f64>> = QOIS.map(Vec::from).to_vec();
        let all = Specimens::new(&qois).unwrap().sharing(shared()).unwrap();
        let pce = forward();
        for (k, (point, posterior)) in loo.points.iter().zip(WITHOUT_EACH.iter()).enumerate() {
            let rows = ln_conditionals(posterior, &pce, &all);
            let mean = rows.iter().skip(k).step_by(6).map(|l| l.exp()).sum::<f64>() / 16000.0;
            // importance weights are inaccurate for the last specimen: the posterior without it differs too much
            let reliable = k < 5;
            assert_eq!(point.pareto_k < loo.threshold, reliable, "{k}: {point:?}");
            let gap = (point.elpd - mean.ln()).abs();
            assert!(gap < if reliable { 0.15 } else { 1.0 }, "{k}: {point:?} {}", mean.ln());
        }
        assert_eq!(loo.unreliable(), [5]);
        let least = loo.points.iter().map(|p| p.elpd).fold(f64::INFINITY, f64::min);
        assert_eq!(loo.points[5].elpd, least, "{:?}", loo.points);
    }

    /// A calibration with burn-in has the same chains as a calibration without burn-in, except for the first draws.
    #[test]
    fn a_burn_in_leaves_out_the_first_draws() {
        let evidence = Evidence { qois: QOIS.map(Vec::from).to_vec(), ..Evidence::default() };
        let sampler = Nuts::default().chains(2).draws(120).seed(5);
        let whole = calibrate(&forward(), &priors(), &evidence, &sampler, 5).unwrap();
        let late = calibrate_after(&forward(), &priors(), &evidence, &sampler, 50, 5).unwrap();
        let traces =
            |result: &Calibration| result.posterior.trace("theta[matrix.young_mpa]").unwrap();
        for (whole, late) in traces(&whole).iter().zip(traces(&late)) {
            assert_eq!(whole[50..], late);
        }
        assert_eq!(late.posterior.chains.len(), 70);
        assert_eq!(late.map, whole.map);
    }
}
