//! Virtual specimens with a known truth, scatter and measurement noise.
//!
//! Every specimen has a separate packing, separate parameters, which scatter around the truth, and readings with
//! noise. All specimens share the truth, which the calibration should recover.

use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::case::{ByParameter, NoiseCase};
use crate::experiment::TestCurve;

/// Properties of one virtual specimen.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct VirtualSpecimen {
    /// Name of the specimen, such as `V-01`.
    pub(crate) id: String,
    /// Seed of the packing; differs from the packing seed of the simulations for the surrogate.
    pub(crate) packing_seed: u64,
    /// Parameters of the specimen, in the order of the true parameters.
    pub(crate) parameters: Vec<f64>,
    /// State of the random numbers for the measurement noise.
    noise: Xoshiro256PlusPlus,
}

impl VirtualSpecimen {
    /// Draws `specimens` specimens. No specimen gets the packing seed `surrogate_packing_seed`.
    ///
    /// Parameters are truth · exp(s z), where z is standard normal and s is the scatter of the parameter, so that the
    /// truth is the median. Specimen k depends only on the seed and on k.
    pub(crate) fn draw(
        specimens: usize,
        seed: u64,
        truth: &ByParameter<f64>,
        scatter: &ByParameter<f64>,
        surrogate_packing_seed: Option<u64>,
    ) -> Vec<Self> {
        let mut streams = Xoshiro256PlusPlus::seed_from_u64(seed);
        (1..=specimens)
            .map(|k| {
                let mut rng = streams.clone();
                streams.jump();
                let mut packing_seed = u64::from(rng.random::<u32>());
                while Some(packing_seed) == surrogate_packing_seed {
                    packing_seed = u64::from(rng.random::<u32>());
                }
                let parameters = truth.iter().map(|(parameter, truth)| {
                    let z: f64 = rng.sample(StandardNormal);
                    truth * (scatter.get(parameter).copied().unwrap_or(0.0) * z).exp()
                });
                let parameters = parameters.collect();
                Self { id: format!("V-{k:02}"), packing_seed, parameters, noise: rng }
            })
            .collect()
    }

    /// Adds measurement noise to a curve: every displacement and every force has an independent error; times are exact.
    pub(crate) fn measure(&self, exact: &TestCurve, noise: &NoiseCase) -> TestCurve {
        let mut rng = self.noise.clone();
        let mut read = |values: &[f64], sd: f64| -> Vec<f64> {
            values.iter().map(|x| x + sd * rng.sample::<f64, _>(StandardNormal)).collect()
        };
        TestCurve {
            displacement_mm: read(&exact.displacement_mm, noise.displacement_mm),
            force_n: read(&exact.force_n, noise.force_n),
            time_s: exact.time_s.clone(),
            // branches must be determined again from the readings with noise
            branches: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{CaseFile, VirtualCase};

    fn case() -> VirtualCase {
        CaseFile::default_case().case.experiments.unwrap().virtual_specimens.unwrap()
    }

    fn draw(specimens: usize, seed: u64, avoided: Option<u64>) -> Vec<VirtualSpecimen> {
        let VirtualCase { truth, scatter, .. } = case();
        VirtualSpecimen::draw(specimens, seed, &truth, &scatter, avoided)
    }

    #[test]
    fn specimens_scatter_around_the_truth_as_asked() {
        let n = 4000;
        let VirtualCase { truth, mut scatter, .. } = case();
        for parameter in truth.parameters() {
            let sd = if parameter.to_string() == "matrix.young_mpa" { 0.03 } else { 0.2 };
            scatter.insert(parameter.clone(), sd);
        }
        let specimens = VirtualSpecimen::draw(n, 5, &truth, &scatter, Some(1));
        for (i, (parameter, truth)) in truth.iter().enumerate() {
            let s = *scatter.get(parameter).unwrap();
            let logs: Vec<f64> = specimens.iter().map(|v| (v.parameters[i] / truth).ln()).collect();
            let mean = logs.iter().sum::<f64>() / n as f64;
            let sd = (logs.iter().map(|x| x * x).sum::<f64>() / n as f64).sqrt();
            // four standard errors of a normal sample's mean and standard deviation
            assert!(mean.abs() < 4.0 * s / (n as f64).sqrt(), "mean {mean} of log {i}");
            assert!((sd / s - 1.0).abs() < 4.0 / (2.0 * n as f64).sqrt(), "sd {sd} of log {i}");
        }
    }

    #[test]
    fn microstructures_are_the_specimens_own() {
        let specimens = draw(8, 5, None);
        let avoided = specimens[3].packing_seed;
        let again = draw(8, 5, Some(avoided));
        assert!(again.iter().all(|v| v.packing_seed != avoided));
        let mut seeds: Vec<u64> = again.iter().map(|v| v.packing_seed).collect();
        seeds.sort_unstable();
        seeds.dedup();
        assert_eq!(seeds.len(), 8);
    }

    #[test]
    fn a_specimen_does_not_depend_on_how_many_follow() {
        let few = draw(3, 9, Some(1));
        let many = draw(12, 9, Some(1));
        assert_eq!(few[..], many[..3]);
        assert_ne!(few, draw(3, 10, Some(1)));
    }

    #[test]
    fn readings_carry_the_stated_noise_and_repeat() {
        let specimen = &draw(1, 9, Some(1))[0];
        let n = 20_000;
        let exact = TestCurve::new(vec![0.1; n], vec![50.0; n]);
        let noise = NoiseCase { force_n: 0.5, displacement_mm: 0.001 };
        let record = specimen.measure(&exact, &noise);
        for (values, centre, s) in
            [(&record.force_n, 50.0, 0.5), (&record.displacement_mm, 0.1, 0.001)]
        {
            let sd =
                (values.iter().map(|x| (x - centre) * (x - centre)).sum::<f64>() / n as f64).sqrt();
            assert!((sd / s - 1.0).abs() < 4.0 / (2.0 * n as f64).sqrt(), "{sd}");
        }
        assert_eq!(record, specimen.measure(&exact, &noise));
    }
}
