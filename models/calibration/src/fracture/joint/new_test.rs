//! Draws of the joint posterior for a test that was not calibrated.

use std::collections::BTreeMap;

use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::JointCalibration;
use super::draws::within;
use super::prepared::InputValue;

impl JointCalibration {
    /// Draws of the inputs of the surrogate in a test that was not calibrated, one row per draw. The test is like the
    /// calibrated test at the index `like`: it has the shared parameters and the parameters of this test alone. A varying
    /// parameter has a new value about its centre or trend. A trend is evaluated at the value `at` of its variable, by the name
    /// of the parameter; values beyond the calibrated tests extrapolate the trend within the range of the prior.
    pub fn draws_in_new_test(
        &self,
        like: usize,
        at: &BTreeMap<String, f64>,
        seed: u64,
    ) -> Vec<Vec<f64>> {
        let mut test = self.model.tests[like].clone();
        for (value, input) in test.values.iter_mut().zip(&test.inputs) {
            let known = self.model.trends.get(&input.name).zip(at.get(&input.name));
            if let (InputValue::Trend(_, position), Some((trend, &value))) = (value, known) {
                *position = trend.position(value);
            }
        }
        let group = &self.posterior.posterior;
        let count = group.chains * group.draws;
        let rows = |name: &str| {
            let data = group.get(name).map_or(&[][..], |values| &values.data);
            (0..count).map(move |draw| {
                let size = data.len() / count.max(1);
                &data[draw * size..(draw + 1) * size]
            })
        };
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut draw = |(theta, spread): (&[f64], &[f64])| {
            let deviations: Vec<f64> =
                spread.iter().map(|sd| sd * rng.sample::<f64, _>(StandardNormal)).collect();
            within(&test, test.point(theta, &deviations))
        };
        rows("theta").zip(rows("spread")).map(&mut draw).collect()
    }
}
