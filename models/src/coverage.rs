//! Do the intervals hold what they promise? Virtual experiments drawn anew on the surrogate.

use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::DynPce;

use crate::case::{ByParameter, MaterialParameter};
use crate::fracture::{CalibrationError, calibrate};

/// A study of how often the calibration's 90 % intervals cover the truth.
///
/// Each repeat draws a truth uniformly from the middle of the prior box, specimens with
/// lognormal scatter around it, their QoIs from the surrogate with relative noise, and calibrates.
#[derive(Clone, Debug)]
pub struct CoverageStudy {
    /// Repeats.
    pub repeats: usize,
    /// Specimens of each.
    pub specimens: usize,
    /// Fraction of each side of the prior box, around its middle, that truths are drawn from.
    pub inner: f64,
    /// Scatter of the parameters between specimens; the usual one where none is given.
    pub scatter: ByParameter<f64>,
    /// Relative standard deviation of each QoI beside that: microstructure and measurement.
    pub noise: f64,
    /// Covariance of the error that the specimens of an experiment share, relative to their means;
    /// empty for none.
    pub shared: Vec<Vec<f64>>,
    /// Sampler of every calibration; its seed is replaced.
    pub sampler: ppl::Nuts<'static>,
    /// Seed of everything.
    pub seed: u64,
}

impl Default for CoverageStudy {
    fn default() -> Self {
        Self {
            repeats: 40,
            specimens: 8,
            inner: 0.8,
            scatter: ByParameter::default(),
            noise: 0.01,
            shared: Vec::new(),
            sampler: ppl::Nuts::default()
                .chains(2)
                .warmup(400)
                .draws(1000)
                .target_accept(0.95)
                .threads(2),
            seed: 1,
        }
    }
}

/// What a study found, parameter by parameter in the order of the surrogate's inputs.
#[derive(Clone, Debug, PartialEq)]
pub struct Coverage {
    /// Fraction of the repeats whose 90 % interval holds the truth.
    pub covered: Vec<f64>,
    /// Mean contraction 1 − var(posterior)/var(prior).
    pub contraction: Vec<f64>,
    /// Repeats.
    pub repeats: usize,
}

impl Coverage {
    /// 90 % less two binomial standard errors: what honest intervals reach in 97 or 98 of 100 studies.
    pub fn least(&self) -> f64 {
        0.9 - 2.0 * (0.9 * 0.1 / self.repeats as f64).sqrt()
    }
}

impl CoverageStudy {
    /// Runs the study on a surrogate, whose box is the prior's; `told` is called after each repeat with
    /// the number done.
    ///
    /// # Errors
    /// What stops a calibration.
    pub fn run(
        &self,
        pce: &DynPce,
        mut told: impl FnMut(usize),
    ) -> Result<Coverage, CalibrationError> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let n = self.repeats as f64;
        let none = || vec![0.0; pce.inputs().len()];
        let mut found = Coverage { covered: none(), contraction: none(), repeats: self.repeats };
        for repeat in 0..self.repeats {
            let middle = pce.inputs().iter().map(|input| {
                let place = 0.5 + self.inner * (rng.random::<f64>() - 0.5);
                input.lower + place * (input.upper - input.lower)
            });
            let truth: Vec<f64> = middle.collect();
            let specimens: Vec<Vec<f64>> =
                (0..self.specimens).map(|_| self.specimen(pce, &truth, &mut rng)).collect();
            let seed = self.seed.wrapping_add(repeat as u64);
            let result = calibrate(
                pce,
                &specimens,
                &self.shared_or_none(pce),
                &self.sampler.clone().seed(seed),
                seed,
            )?;
            let summary = result.posterior.summary();
            for (i, truth) in truth.iter().enumerate() {
                let Some(row) = summary.row(&format!("theta[{i}]")) else { continue };
                let held = (row.q05..=row.q95).contains(truth);
                found.covered[i] += f64::from(u8::from(held)) / n;
                found.contraction[i] += row.contraction.unwrap_or(f64::NAN) / n;
            }
            told(repeat + 1);
        }
        Ok(found)
    }

    /// The covariance of the shared error; zeros where none is given.
    fn shared_or_none(&self, pce: &DynPce) -> Vec<Vec<f64>> {
        let size = pce.outputs().len();
        if self.shared.is_empty() { vec![vec![0.0; size]; size] } else { self.shared.clone() }
    }

    /// QoIs of one specimen; parameters that scatter out of the surrogate's box are drawn again.
    fn specimen<R: Rng>(&self, pce: &DynPce, truth: &[f64], rng: &mut R) -> Vec<f64> {
        let scatter = |name: &str| {
            let parameter = name.parse::<MaterialParameter>().ok()?;
            let usual = parameter.property.usual_scatter();
            Some(self.scatter.get(&parameter).copied().unwrap_or(usual))
        };
        let scatter: Vec<f64> =
            pce.inputs().iter().map(|input| scatter(&input.name).unwrap_or(0.0)).collect();
        let mut normal = || rng.sample::<f64, _>(StandardNormal);
        let mut value = vec![f64::NAN; pce.outputs().len()];
        for _ in 0..1000 {
            let drawn = truth.iter().zip(&scatter).map(|(truth, sd)| truth * (sd * normal()).exp());
            let parameters: Vec<f64> = drawn.collect();
            if let Ok(inside) = pce.value(&parameters) {
                value = inside;
                break;
            }
        }
        value.into_iter().map(|q| q * (1.0 + self.noise * normal())).collect()
    }
}

#[cfg(test)]
mod tests {
    use surrogate::{Dataset, DesignMethod, FitOptions};

    use super::*;
    use crate::case::{CaseFile, PriorCase};
    use crate::qoi::Quantity;

    /// The viscous limit of definitions 3.3: m ~ E, F ~ E^(2/3) ξ^(1/3), d ~ (ξ/E)^(1/3), no Gc.
    fn viscous_limit(prior: &PriorCase) -> DynPce {
        let inputs = prior.inputs().unwrap();
        let points = DesignMethod::Sobol.sample(&inputs, 128, 1).unwrap();
        let outputs = Quantity::OF_THE_PAPER.map(|q| q.column().to_owned()).to_vec();
        let mut data = Dataset::new(inputs, outputs, "closed form").unwrap();
        for x in points {
            let (young, viscosity) = (x[0], x[2]);
            let place = (viscosity / young).cbrt();
            data.push(&x, &[5.0 * young, 4.0 * young * place, place]).unwrap();
        }
        DynPce::fit(&data, &FitOptions::default()).unwrap().pce
    }

    #[test]
    fn ninety_per_cent_intervals_cover_the_truth_and_only_stiffness_and_viscosity_are_learnt() {
        let prior = CaseFile::default_case().case.prior.unwrap();
        let study = CoverageStudy {
            repeats: 24,
            sampler: ppl::Nuts::default().chains(2).warmup(200).draws(300).threads(2),
            ..CoverageStudy::default()
        };
        let found = study.run(&viscous_limit(&prior), |_| ()).unwrap();
        for i in [0, 2] {
            assert!(found.covered[i] >= found.least(), "{found:?}");
            assert!(found.contraction[i] > 0.5, "{found:?}");
        }
        assert!(found.contraction[1].abs() < 0.1, "nothing depends on Gc here: {found:?}");
    }
}
