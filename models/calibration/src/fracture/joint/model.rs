//! The joint model of several tests of one material.

use ppl::prelude::*;

use super::correlation::{below_diagonal, factor_of};
use super::prepared::JointTests;
use crate::fracture::likelihood::ln_density_of;

ppl::model! {
    /// The likelihood of `calibration_on` for several tests of one material. Each test has its own forward model,
    /// quantities, covariance between specimens and shared errors, all independent of the other tests.
    ///
    /// `theta` contains the parameters that all tests share, the parameters of one test, and the values at the ends of
    /// trends. A varying parameter has a centre, which is in `theta` or on a trend, the standard deviation `spread` of
    /// its logarithm between tests, and the value `in_test` in each test.
    pub fn calibration_over_tests(tests: &JointTests) {
        let mut parameters: Vec<Real> = Vec::new();
        #[dims(parameter)]
        for prior in &tests.priors {
            let theta ~ *prior;
            parameters.push(theta);
        }
        let mut spreads: Vec<Real> = Vec::new();
        #[dims(varying)]
        for varying in &tests.varying {
            let spread ~ HalfNormal(varying.scale);
            spreads.push(spread);
        }
        for test in &tests.tests {
            let mut units: Vec<Real> = Vec::new();
            #[dims(varying_in_test)]
            for _ in 0..tests.varying.len() {
                let unit ~ Normal(0.0, 1.0);
                units.push(unit);
            }
            let deviations: Vec<Real> = units.iter().zip(&spreads).map(|(z, s)| *z * *s).collect();
            let point = test.point(&parameters, &deviations);
            #[dims(varying_in_test)]
            for value in test.varying_values(&point) {
                #[track] let in_test = value;
            }
            let mut sds: Vec<Real> = Vec::new();
            #[dims(quantity)]
            for _ in 0..test.quantities.len() {
                let sd ~ Normal(0.15, 0.25).truncate(0.0..);
                sds.push(sd);
            }
            let mut partials: Vec<Real> = Vec::new();
            #[dims(pair)]
            for shape in &test.shapes {
                let partial ~ Beta(*shape, *shape);
                partials.push(partial);
            }
            let corr = factor_of(test.quantities.len(), &partials)?;
            #[dims(pair)]
            for entry in below_diagonal(&corr) {
                #[track] let correlation = entry;
            }
            let chol = corr.scale_rows(&sds)?;
            let expected = test.specimens.expected(&test.forward, &point)?;
            factor(ln_density_of(&test.specimens, &expected, &chol)?);
        }
    }
}
