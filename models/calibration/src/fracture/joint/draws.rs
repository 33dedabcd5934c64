//! Draws of the joint posterior for each test: the parameters of the test, its scatter and its correlations. All results
//! of a single test are computed from these draws.

use std::ops::Range;

use ppl::prelude::*;
use ppl::{Group, Posterior, Record, Values};
use serde::{Deserialize, Serialize};
use surrogate::{DynPce, Input};

use super::correlation::factor_of;
use super::prepared::{JointTests, PreparedTest};
use crate::fracture::likelihood::ln_density_of;
use crate::fracture::{
    Calibration, CalibrationError, Evidence, calibration_on, label, relative_to_means,
    unknown_inputs,
};
use crate::prior::Prior;

/// Draws of the sampled variables of one test from a joint posterior, in the order of the draws of
/// all chains.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TestDraws {
    /// Number of chains.
    pub chains: usize,
    /// Number of draws per chain.
    pub draws: usize,
    /// Parameters in the order of the surrogate's inputs, one row per draw.
    pub theta: Vec<f64>,
    /// Standard deviations of the quantities between specimens, relative to the means of the specimens, one row per
    /// draw.
    pub sd: Vec<f64>,
    /// Cholesky factor of the correlation matrix, row-major, one matrix per draw.
    pub corr: Vec<f64>,
    /// Parameters at the mode of the joint posterior.
    pub map: Vec<f64>,
}

/// Values of the sampled variables of the joint model at one draw, or at the mode.
struct Unknowns<'a> {
    theta: &'a [f64],
    spread: &'a [f64],
    unit: &'a [f64],
    sd: &'a [f64],
    partial: &'a [f64],
}

impl<'a> Unknowns<'a> {
    /// Creates the values from a function that returns the values of a variable by its name. The
    /// function returns an empty slice for a variable without values.
    fn of(values: impl Fn(&str) -> &'a [f64]) -> Self {
        Self {
            theta: values("theta"),
            spread: values("spread"),
            unit: values("unit"),
            sd: values("sd"),
            partial: values("partial"),
        }
    }
}

/// Positions of the sampled variables of one test among the variables of all tests.
struct Places {
    units: Range<usize>,
    sds: Range<usize>,
    partials: Range<usize>,
}

impl Places {
    /// Returns the positions for each test, in the order of the tests.
    fn of_each(tests: &JointTests) -> Vec<Self> {
        let (mut units, mut sds, mut partials) = (0, 0, 0);
        let next = |from: &mut usize, length: usize| {
            let range = *from..*from + length;
            *from = range.end;
            range
        };
        let places = tests.tests.iter().map(|test| Self {
            units: next(&mut units, tests.varying.len()),
            sds: next(&mut sds, test.quantities.len()),
            partials: next(&mut partials, test.shapes.len()),
        });
        places.collect()
    }
}

impl TestDraws {
    /// Returns the draws for each test, from the draws of the joint model and the values at its
    /// mode.
    ///
    /// # Errors
    /// If the draws have no correlation matrix.
    pub(super) fn of_each(
        tests: &JointTests,
        draws: &Group,
        mode: &Record,
    ) -> Result<Vec<Self>, CalibrationError> {
        let count = draws.chains * draws.draws;
        let at_draw = |draw: usize| {
            Unknowns::of(|name| {
                let Some(values) = draws.get(name) else { return &[] };
                let size = values.data.len() / count.max(1);
                &values.data[draw * size..(draw + 1) * size]
            })
        };
        let mut all = Vec::with_capacity(tests.tests.len());
        for (test, places) in tests.tests.iter().zip(Places::of_each(tests)) {
            let mut own = Self { chains: draws.chains, draws: draws.draws, ..Self::default() };
            for unknowns in (0..count).map(at_draw) {
                own.theta.extend(point_within(test, &places, &unknowns));
                own.sd.extend(&unknowns.sd[places.sds.clone()]);
                let factor =
                    factor_of(test.quantities.len(), &unknowns.partial[places.partials.clone()])
                        .map_err(|error| CalibrationError::Group {
                            group: test.name.clone(),
                            problem: format!("has a draw without correlations: {error}"),
                        })?;
                own.corr.extend(factor.rows().concat());
            }
            let mode = Unknowns::of(|name| mode.values(name).unwrap_or_default());
            own.map = point_within(test, &places, &mode);
            all.push(own);
        }
        Ok(all)
    }
}

impl TestDraws {
    /// Log likelihood of the specimens of the test at each draw; NaN at draws where it cannot be computed.
    pub(super) fn ln_likelihoods(&self, test: &PreparedTest) -> Vec<f64> {
        let size = test.quantities.len();
        let rows = self.theta.chunks(test.inputs.len()).zip(self.sd.chunks(size));
        let at_draw = |((theta, sd), corr): ((&[f64], &[f64]), &[f64])| {
            let row = |(row, sd): (&[f64], &f64)| row.iter().map(|x| sd * x).collect();
            let factor: Vec<Vec<f64>> = corr.chunks(size).zip(sd).map(row).collect();
            let factor = DynCholeskyFactor::new(&factor)?;
            let expected = test.specimens.expected(&test.forward, theta)?;
            ln_density_of(&test.specimens, &expected, &factor)
        };
        let rows = rows.zip(self.corr.chunks(size * size));
        rows.map(|draw| at_draw(draw).unwrap_or(f64::NAN)).collect()
    }

    /// Mean squared difference of each input of the surrogate from its value without deviations in the test. `theta` has the
    /// parameters of the joint model, one row per draw.
    pub(super) fn variances_about(&self, test: &PreparedTest, theta: &[&[f64]]) -> Vec<f64> {
        let mut sums = vec![0.0; test.inputs.len()];
        for (own, parameters) in self.theta.chunks(test.inputs.len()).zip(theta) {
            let centre = test.point(parameters, &[]);
            for &place in &test.varying {
                sums[place] += (own[place] - centre[place]).powi(2);
            }
        }
        sums.into_iter().map(|sum| sum / theta.len().max(1) as f64).collect()
    }
}

/// Returns the values of the surrogate's inputs of a test, moved inside their box if necessary: rounding can set a
/// value to a bound, where its prior has zero density.
fn point_within(test: &PreparedTest, places: &Places, unknowns: &Unknowns<'_>) -> Vec<f64> {
    let units = unknowns.unit[places.units.clone()].iter();
    let deviations: Vec<f64> = units.zip(unknowns.spread).map(|(z, sd)| z * sd).collect();
    within(test, test.point(unknowns.theta, &deviations))
}

/// Moves values of the surrogate's inputs inside their box.
pub(super) fn within(test: &PreparedTest, point: Vec<f64>) -> Vec<f64> {
    let within = |(value, input): (f64, &Input)| {
        let margin = 1e-12 * (input.upper - input.lower);
        value.clamp(input.lower + margin, input.upper - margin)
    };
    point.into_iter().zip(&test.inputs).map(within).collect()
}

/// Returns the calibration of one test with the draws of a joint posterior. Predictions, misfits and leave-one-out
/// densities of the test are then based on all tests.
///
/// # Errors
/// The errors of [`calibrate`](crate::calibrate), and an error if the draws do not suit the test.
pub fn calibration_of_draws(
    pce: &DynPce,
    priors: &[Prior],
    evidence: &Evidence,
    draws: &TestDraws,
) -> Result<Calibration, CalibrationError> {
    let (forward, specimens) = relative_to_means(pce, evidence)?;
    unknown_inputs(pce, priors, specimens.known_inputs())?;
    let model = calibration_on(&forward, priors, &specimens);
    let (parameters, size) = (priors.len(), forward.outputs().len());
    let values = |name: &str, shape: Vec<usize>, data: &[f64]| Values {
        name: name.to_owned(),
        shape,
        data: data.to_vec(),
    };
    let group = Group {
        chains: draws.chains,
        draws: draws.draws,
        variables: vec![
            values("theta", vec![parameters], &draws.theta),
            values("sd", vec![size], &draws.sd),
            values("corr", vec![size, size], &draws.corr),
        ],
    };
    let mut posterior = Posterior::from_draws(&model, &group)?;
    label(&mut posterior, pce, parameters)?;
    drop(model);
    let map = draws.map.clone();
    Ok(Calibration { posterior, map, mode: None, specimens, forward, priors: priors.to_vec() })
}
