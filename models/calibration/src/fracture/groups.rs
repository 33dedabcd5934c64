//! Joint calibration of groups of specimens: several microstructures, several temperatures, one covariance of the
//! specimens.
//!
//! A group consists of specimens of one microstructure that were tested at one temperature. Each group has the
//! surrogate of its microstructure. All groups share the material, whose parameters are constant or depend on the
//! temperature. All groups also share the covariance of the specimens relative to the means of their group. Thus twelve
//! specimens at four temperatures determine one covariance, whereas separate calibrations would estimate each of four
//! covariances from three specimens.

use ppl::Posterior;
use ppl::prelude::*;
use surrogate::{DynPce, Input};

use super::likelihood::of_specimens;
use super::within_box::{deviated, exponential_within};
use super::{CalibrationError, Evidence, Specimens, relative_to_means, short_name, unknown_inputs};
use crate::prior::Prior;

/// Specimens of one microstructure, tested at one temperature.
#[derive(Clone, Debug)]
pub struct TestGroup {
    /// Name of the group in messages.
    pub name: String,
    /// Temperature of the tests in °C.
    pub temperature_c: f64,
    /// Surrogate of the microstructure. The box of the surrogate must be the same in all groups.
    pub forward: DynPce,
    /// Experimental data of the specimens. A group may have a single specimen if another group has
    /// several specimens.
    pub evidence: Evidence,
}

/// Dependence of a parameter on the temperature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trend {
    /// The parameter does not depend on the temperature.
    Constant,
    /// The logarithm of the parameter is a linear function of the temperature plus the deviations of
    /// [`Pooling::deviation`].
    LogLinear,
}

/// Dependence of the parameters of all groups on the temperature.
#[derive(Clone, Debug, PartialEq)]
pub struct Pooling {
    /// Trend of each parameter, in the order of the surrogates' inputs.
    pub trends: Vec<Trend>,
    /// Scale of the half-normal prior for the standard deviation δ: at each temperature, the logarithm of a parameter
    /// deviates from the line by a normal error with standard deviation δ. 0: no deviations.
    pub deviation: f64,
}

/// Groups of specimens, prepared for the likelihood.
#[derive(Clone, Debug)]
pub struct Groups {
    inputs: Vec<Input>,
    priors: Vec<Prior>,
    trends: Vec<Trend>,
    deviation: f64,
    quantities: usize,
    /// Temperatures in ascending order, each with its relative position between the lowest (0) and the highest (1).
    levels: Vec<(f64, f64)>,
    groups: Vec<Group>,
}

/// Group of specimens, with quantities relative to the means of its specimens.
#[derive(Clone, Debug)]
struct Group {
    level: usize,
    forward: DynPce,
    specimens: Specimens,
}

impl Groups {
    /// Checks that the groups are consistent, and prepares them for the likelihood. `priors` are the priors of the
    /// parameters, in the order of the surrogates' inputs.
    ///
    /// # Errors
    /// - There are fewer than two specimens in total.
    /// - The ranges of the priors are not the surrogates' box.
    /// - Groups have different parameters or quantities.
    /// - A temperature or the deviation is not finite, or the deviation is negative.
    /// - The number of trends differs from the number of parameters.
    /// - A parameter depends on the temperature although there is only one temperature.
    /// - A parameter depends on the temperature although its lower bound is not above 0.
    pub fn new(
        groups: &[TestGroup],
        priors: &[Prior],
        pooling: &Pooling,
    ) -> Result<Self, CalibrationError> {
        let specimens = groups.iter().map(|group| group.evidence.qois.len()).sum();
        let [first, ..] = groups else { return Err(CalibrationError::TooFew(0)) };
        if specimens < 2 {
            return Err(CalibrationError::TooFew(specimens));
        }
        let inputs = unknown(first).to_vec();
        unknown_inputs(&first.forward, priors, first.evidence.known_inputs())?;
        let mut temperatures: Vec<f64> = groups.iter().map(|group| group.temperature_c).collect();
        temperatures.sort_by(f64::total_cmp);
        temperatures.dedup();
        let wrong = |group: &str, problem: String| {
            Err(CalibrationError::Group { group: group.to_owned(), problem })
        };
        for group in groups {
            if unknown(group) != inputs {
                return wrong(
                    &group.name,
                    format!("does not have the parameters of {}", first.name),
                );
            }
            if group.forward.outputs() != first.forward.outputs() {
                return wrong(
                    &group.name,
                    format!("does not have the quantities of {}", first.name),
                );
            }
            if !group.temperature_c.is_finite() {
                return wrong(&group.name, format!("was tested at {} °C", group.temperature_c));
            }
        }
        let Pooling { trends, deviation } = pooling;
        if trends.len() != inputs.len() {
            let (found, expected) = (trends.len(), inputs.len());
            return wrong("pooling", format!("has {found} trends for {expected} parameters"));
        }
        if !(*deviation >= 0.0 && deviation.is_finite()) {
            return wrong(
                "pooling",
                format!("has a deviation of {deviation}, which must be finite and at least 0"),
            );
        }
        for (input, _) in inputs.iter().zip(trends).filter(|(_, t)| **t == Trend::LogLinear) {
            if temperatures.len() < 2 {
                return wrong(
                    &input.name,
                    "has a trend with temperature, but all groups have the same temperature".into(),
                );
            }
            if input.lower <= 0.0 {
                let problem = format!("has no logarithm at its lower bound {}", input.lower);
                return wrong(&input.name, problem);
            }
        }
        let (low, high) = (temperatures[0], temperatures[temperatures.len() - 1]);
        let place = |t: f64| if high > low { (t - low) / (high - low) } else { 0.0 };
        let prepared = groups.iter().map(|group| {
            let (forward, specimens) = relative_to_means(&group.forward, &group.evidence)?;
            let level = temperatures.partition_point(|&t| t < group.temperature_c);
            Ok(Group { level, forward, specimens })
        });
        Ok(Self {
            priors: priors.to_vec(),
            trends: trends.clone(),
            deviation: *deviation,
            quantities: first.forward.outputs().len(),
            levels: temperatures.iter().map(|&t| (t, place(t))).collect(),
            groups: prepared.collect::<Result<_, CalibrationError>>()?,
            inputs,
        })
    }

    /// Iterates over the priors of the parameters that depend on the temperature.
    fn priors_of_following(&self) -> impl Iterator<Item = &Prior> {
        let with_trends = self.priors.iter().zip(&self.trends);
        with_trends.filter(|(_, trend)| **trend == Trend::LogLinear).map(|(prior, _)| prior)
    }

    /// Iterates over the parameters that depend on the temperature.
    fn following(&self) -> impl Iterator<Item = &Input> {
        let with_trends = self.inputs.iter().zip(&self.trends);
        with_trends.filter(|(_, trend)| **trend == Trend::LogLinear).map(|(input, _)| input)
    }

    /// Returns the parameters at a temperature. `place` is the position of the temperature between the lowest (0) and
    /// the highest (1). Constant parameters have the values `lowest`. For the other parameters, the logarithm is
    /// interpolated linearly between `lowest` and `highest` and then changed by the deviation `off` ([`deviated`]).
    fn parameters<R: Scalar>(&self, place: f64, lowest: &[R], highest: &[R], off: &[R]) -> Vec<R> {
        let mut following = highest.iter().enumerate();
        let parameter = |((input, trend), &low): ((&Input, &Trend), &R)| {
            let Some((k, &high)) = (*trend == Trend::LogLinear).then(|| following.next()).flatten()
            else {
                return low;
            };
            let line = low.ln() * (1.0 - place) + high.ln() * place;
            let bounds = [input.lower, input.upper];
            match off.get(k) {
                Some(&off) => deviated(line, off, bounds),
                None => exponential_within(line, bounds),
            }
        };
        self.inputs.iter().zip(&self.trends).zip(lowest).map(parameter).collect()
    }
}

/// Returns the parameters of a group: the inputs of the surrogate that are not known for the
/// specimens.
fn unknown(group: &TestGroup) -> &[Input] {
    let inputs = group.forward.inputs();
    &inputs[..inputs.len().saturating_sub(group.evidence.known_inputs())]
}

ppl::model! {
    /// Model with the paper's likelihood for groups of specimens that share one covariance,
    /// relative to the means of each group.
    ///
    /// The prior of each parameter holds at the lowest temperature. A parameter that depends on the temperature has the
    /// same prior at the highest temperature, and its logarithm is linear in the temperature. If deviations are
    /// allowed, the logarithm deviates from this line at each temperature by a normal error with standard deviation
    /// `deviation`. `theta` contains the parameters at each temperature.
    pub fn calibration_over_groups(groups: &Groups) {
        let mut lowest: Vec<Real> = Vec::new();
        #[dims(parameter)]
        for prior in &groups.priors {
            let at_lowest ~ *prior;
            lowest.push(at_lowest);
        }
        let mut highest: Vec<Real> = Vec::new();
        #[dims(following)]
        for prior in groups.priors_of_following() {
            let at_highest ~ *prior;
            highest.push(at_highest);
        }
        let mut spread: Vec<Real> = Vec::new();
        if groups.deviation > 0.0 {
            #[dims(following)] let deviation ~ HalfNormal(groups.deviation).iid(highest.len());
            spread = deviation;
        }
        let mut at_level: Vec<Vec<Real>> = Vec::new();
        #[dims(temperature)]
        for level in &groups.levels {
            let unit ~ Normal(0.0, 1.0).iid(spread.len());
            let off: Vec<Real> = unit.iter().zip(&spread).map(|(z, s)| *z * *s).collect();
            #[dims(parameter)]
            #[track] let theta = groups.parameters(level.1, &lowest, &highest, &off);
            at_level.push(theta);
        }

        #[dims(quantity)]
        let sd ~ Normal(0.15, 0.25).truncate(0.0..).iid(groups.quantities);
        let corr ~ LkjCholesky::of(groups.quantities, 3.0);
        let chol = corr.scale_rows(&sd)?;
        for group in &groups.groups {
            let specimens = &group.specimens;
            let expected = specimens.expected(&group.forward, &at_level[group.level])?;
            let data ~ of_specimens(specimens, &expected, &chol);
        }
    }
}

/// Samples [`calibration_over_groups`], and labels parameters and temperatures.
///
/// # Errors
/// The errors of [`Groups::new`], and an error if the surrogates reject every starting point.
///
/// # Example
/// ```no_run
/// use breccia_calibration::{Pooling, Prior, TestGroup, Trend, calibrate_groups};
/// use ppl::Nuts;
///
/// # fn all(groups: Vec<TestGroup>) -> Result<(), breccia_calibration::CalibrationError> {
/// // E and ξ follow the temperature, Gc does not
/// let trends = vec![Trend::LogLinear, Trend::Constant, Trend::LogLinear];
/// let pooling = Pooling { trends, deviation: 0.02 };
/// let priors = Prior::uniform_on(groups[0].forward.inputs());
/// let posterior = calibrate_groups(&groups, &priors, &pooling, &Nuts::default().seed(7))?;
/// println!("{}", posterior.summary());
/// # Ok(()) }
/// ```
pub fn calibrate_groups(
    groups: &[TestGroup],
    priors: &[Prior],
    pooling: &Pooling,
    sampler: &Nuts<'_>,
) -> Result<Posterior, CalibrationError> {
    let prepared = Groups::new(groups, priors, pooling)?;
    let mut posterior = sampler.sample(&calibration_over_groups(&prepared))?;
    let names = |inputs: &mut dyn Iterator<Item = &Input>| -> Vec<String> {
        inputs.map(|input| input.name.clone()).collect()
    };
    let temperatures: Vec<String> =
        prepared.levels.iter().map(|(t, _)| format!("{t} °C")).collect();
    let quantities: Vec<String> =
        groups[0].forward.outputs().iter().map(|name| short_name(name)).collect();
    let parameters = names(&mut prepared.inputs.iter());
    let following = names(&mut prepared.following());
    let mut label = |name: &str, axis: usize, labels: &[String]| {
        let labels: Vec<&str> = labels.iter().map(String::as_str).collect();
        posterior.label(name, axis, &labels)
    };
    label("theta", 0, &temperatures)?;
    label("theta", 1, &parameters)?;
    label("at_lowest", 0, &parameters)?;
    if !following.is_empty() {
        label("at_highest", 0, &following)?;
    }
    label("sd", 0, &quantities)?;
    Ok(posterior)
}

#[cfg(test)]
mod tests;
