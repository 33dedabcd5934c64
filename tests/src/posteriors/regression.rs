//! Linear and logistic regressions.

use ppl::prelude::*;

use super::{Data, rows};

ppl::model! {
    /// Linear regression with a half-Cauchy prior of the scale and flat priors of the coefficients (posteriordb
    /// kidscore_*).
    pub fn kidscore<const D: usize>(x: &[[f64; D]], score: &[f64]) {
        let beta ~ Normal(0.0, 1e5).array::<D>();
        let sigma ~ HalfCauchy(2.5);
        score ~ NormalGlm(x, 0.0, beta, sigma);
    }

    /// Linear regression with flat priors of all parameters (posteriordb mesquite-* and kidscore_interaction_c, c2, z).
    pub fn flat_regression<const D: usize>(x: &[[f64; D]], y: &[f64]) {
        let beta ~ Normal(0.0, 1e5).array::<D>();
        let sigma ~ HalfNormal(1e5);
        y ~ NormalGlm(x, 0.0, beta, sigma);
    }

    /// Regression of log radon on the floor of the measurement, with one line for all counties.
    pub fn radon_pooled(floor: &[f64], log_radon: &[f64]) {
        let alpha ~ Normal(0.0, 10.0);
        let beta ~ Normal(0.0, 10.0);
        let sigma ~ HalfNormal(1.0);
        log_radon ~ NormalGlm(floor, alpha, [beta], sigma);
    }

    /// Learning of dogs: the logit of the probability of a shock is linear in the numbers of earlier avoided and
    /// received shocks. The Bernoulli density is a function of the logit, because 1 − p would lose digits.
    pub fn dogs(trials: &[Trial]) {
        let beta ~ Normal(0.0, 100.0).array::<3>();
        for t in trials {
            let logit = beta[0] + beta[1] * t.avoided + beta[2] * t.shocks;
            factor(t.shock * logit - logit.softplus());
        }
    }
}

/// One trial of one dog.
#[derive(Debug)]
pub struct Trial {
    /// Number of shocks that the dog avoided before this trial.
    pub avoided: f64,
    /// Number of shocks that the dog received before this trial.
    pub shocks: f64,
    /// 1 if the dog received a shock in this trial, else 0.
    pub shock: f64,
}

/// Returns the trials of all 30 dogs.
///
/// # Panics
/// If the fixture is damaged.
pub fn dog_trials() -> Vec<Trial> {
    let data = Data::parse(include_str!("../../fixtures/posteriors/dogs.json"));
    let mut trials = Vec::new();
    for dog in data.list("trials") {
        let (mut avoided, mut shocks) = (0.0, 0.0);
        for outcome in dog.as_str().expect("a row of digits").bytes() {
            let shock = f64::from(outcome - b'0');
            trials.push(Trial { avoided, shocks, shock });
            shocks += shock;
            avoided += 1.0 - shock;
        }
    }
    trials
}

/// Children's test scores with their mother's schooling and IQ.
#[derive(Debug)]
pub struct Kidiq {
    /// Score of the child.
    pub score: Vec<f64>,
    /// 1 if the mother finished high school.
    pub school: Vec<f64>,
    /// IQ of the mother.
    pub iq: Vec<f64>,
}

impl Kidiq {
    /// Reads the fixture.
    pub fn load() -> Self {
        let data = Data::parse(include_str!("../../fixtures/posteriors/kidiq.json"));
        let [score, school, iq] = ["kid_score", "mom_hs", "mom_iq"].map(|c| data.column(c));
        Self { score, school, iq }
    }

    /// Rows (1, s, q, s q) with the standardised schooling s and IQ q. `school` and `iq` contain the value to subtract
    /// and the divisor.
    pub fn interaction(&self, school: (f64, f64), iq: (f64, f64)) -> Vec<[f64; 4]> {
        let row = |(s, q): (&f64, &f64)| {
            let (s, q) = ((s - school.0) / school.1, (q - iq.0) / iq.1);
            [1.0, s, q, s * q]
        };
        self.school.iter().zip(&self.iq).map(row).collect()
    }
}

/// Mesquite bushes: leaf weights, and the predictors of the original data.
#[derive(Debug)]
pub struct Mesquite(Data);

impl Mesquite {
    /// Reads the fixture.
    pub fn load() -> Self {
        Self(Data::parse(include_str!("../../fixtures/posteriors/mesquite.json")))
    }

    /// A column as measured.
    pub fn column(&self, name: &str) -> Vec<f64> {
        self.0.column(name)
    }

    /// The logarithm of a column.
    pub fn log(&self, name: &str) -> Vec<f64> {
        self.column(name).into_iter().map(f64::ln).collect()
    }

    /// Rows of 1, the five measures, and the group. `of` returns the column of a measure.
    pub fn design(&self, of: impl Fn(&str) -> Vec<f64>) -> Vec<[f64; 7]> {
        let one = vec![1.0; 46];
        let [a, b, c, d, e] =
            ["diam1", "diam2", "canopy_height", "total_height", "density"].map(of);
        rows([&one, &a, &b, &c, &d, &e, &self.column("group")])
    }

    /// Logarithms of canopy volume and canopy area.
    pub fn canopy(&self) -> (Vec<f64>, Vec<f64>) {
        let [a, b, c] = ["diam1", "diam2", "canopy_height"].map(|name| self.log(name));
        let area: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a + b).collect();
        (area.iter().zip(&c).map(|(area, c)| area + c).collect(), area)
    }
}
