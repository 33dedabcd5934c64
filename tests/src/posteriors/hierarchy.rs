//! Hierarchical models: rates and groups that share a distribution.

use ppl::prelude::*;

use super::Data;

ppl::model! {
    /// Two rates, ten trials each (Lee & Wagenmakers 2014, ch. 3).
    pub fn two_rates(first: &[bool], second: &[bool]) {
        let theta ~ Beta(1.0, 1.0).array::<2>();
        for i in 0..10 {
            first[i] ~ Bernoulli(theta[0]);
            second[i] ~ Bernoulli(theta[1]);
        }
    }

    /// One rate for all trials.
    pub fn common_rate(flags: &[bool]) {
        let theta ~ Beta(1.0, 1.0);
        for flag in flags {
            flag ~ Bernoulli(theta);
        }
    }

    /// Failures of pumps with gamma-distributed rates.
    pub fn pumps(failures: &[u64], time: &[f64]) {
        let alpha ~ Exponential(1.0);
        let beta ~ Gamma(0.1, 1.0);
        let theta ~ Gamma(alpha, beta).array::<10>();
        for i in 0..10 {
            failures[i] ~ Poisson(theta[i] * time[i]);
        }
    }

    /// Growth curves of rats; the time axis is centred on day 22.
    pub fn rats(day: &[f64], weight: &[[f64; 5]]) {
        let alpha_c ~ Normal(0.0, 1000.0);
        let beta_c ~ Normal(0.0, 1000.0);
        let tau_alpha ~ Gamma(0.001, 0.001);
        let tau_beta ~ Gamma(0.001, 0.001);
        let tau ~ Gamma(0.001, 0.001);
        #[track] let sigma = tau.sqrt().recip();
        #[track] let alpha0 = alpha_c - 22.0 * beta_c;
        let alpha ~ Normal(alpha_c, tau_alpha.sqrt().recip()).iid(weight.len());
        let beta ~ Normal(beta_c, tau_beta.sqrt().recip()).iid(weight.len());
        for (rat, weights) in weight.iter().enumerate() {
            for (day, y) in day.iter().zip(weights) {
                y ~ Normal(alpha[rat] + beta[rat] * (day - 22.0), sigma);
            }
        }
    }

    /// Mortality in hospitals: logits that share a normal distribution. The binomial density is written as a function
    /// of the logit, without its constant.
    pub fn surgical(deaths: &[f64], operations: &[f64]) {
        let mu ~ Normal(0.0, 1000.0);
        let tau ~ Gamma(0.001, 0.001);
        #[track] let sigma = tau.sqrt().recip();
        #[track] let pop_mean = mu.logistic();
        let b ~ Normal(mu, sigma).array::<12>();
        #[track] let p = b.map(|b| b.logistic());
        for i in 0..12 {
            factor(deaths[i] * b[i] - operations[i] * b[i].softplus());
        }
    }

    /// Germination of seeds on 21 plates: the logit includes a random effect of the plate.
    pub fn seeds(plates: &[Plate]) {
        let alpha0 ~ Normal(0.0, 1000.0);
        let alpha1 ~ Normal(0.0, 1000.0);
        let alpha2 ~ Normal(0.0, 1000.0);
        let alpha12 ~ Normal(0.0, 1000.0);
        let tau ~ Gamma(0.001, 0.001);
        #[track] let sigma = tau.sqrt().recip();
        let z ~ Normal(0.0, 1.0).array::<21>();
        for (plate, z) in plates.iter().zip(z) {
            let [x1, x2] = plate.factors;
            let logit = alpha0 + alpha1 * x1 + alpha2 * x2 + alpha12 * (x1 * x2) + sigma * z;
            factor(plate.germinated * logit - plate.seeds * logit.softplus());
        }
    }

    /// Log radon: each county has its own intercept of a regression on the floor and the uranium of the soil (Gelman &
    /// Hill 2007, ch. 12; posteriordb radon_hierarchical_intercept_noncentered).
    pub fn radon_hierarchical(houses: &Houses) {
        let mu_alpha ~ Normal(0.0, 10.0);
        let sigma_alpha ~ HalfNormal(1.0);
        let sigma ~ HalfNormal(1.0);
        let beta ~ Normal(0.0, 10.0).array::<2>();
        let alpha ~ Normal(mu_alpha, sigma_alpha).non_centered().iid(houses.counties);
        houses.log_radon ~ NormalGlm(&houses.x, ByGroup(&alpha, &houses.county), beta, sigma);
    }
}

/// Seeds of one plate.
#[derive(Debug)]
pub struct Plate {
    /// Number of seeds that germinated.
    pub germinated: f64,
    /// Number of seeds on the plate.
    pub seeds: f64,
    /// Indicators (0 or 1) of the seed variety and the root extract.
    pub factors: [f64; 2],
}

/// Measurements in houses.
#[derive(Debug)]
pub struct Houses {
    /// Number of counties.
    pub counties: usize,
    /// Index of the county of each house.
    pub county: Vec<usize>,
    /// For each house: ln of the county's uranium in ppm; floor of the measurement (0: basement, 1: ground floor).
    pub x: Vec<[f64; 2]>,
    /// ln(activity + 0.1), activity in pCi/L.
    pub log_radon: Vec<f64>,
}

/// `trials` flags, of which the first `successes` are true.
pub fn flags(successes: usize, trials: usize) -> Vec<bool> {
    (0..trials).map(|i| i < successes).collect()
}

/// Data of [`pumps`]: failures, and operating time in 1000 h.
pub fn pump_data() -> (Vec<u64>, Vec<f64>) {
    let data = Data::parse(include_str!("../../fixtures/posteriors/pumps.json"));
    (data.counts("failures"), data.column("time"))
}

/// Data of [`rats`]: days, and weights in g.
///
/// # Panics
/// If the fixture is damaged.
pub fn rat_data() -> (Vec<f64>, Vec<[f64; 5]>) {
    let data = Data::parse(include_str!("../../fixtures/posteriors/rats.json"));
    (data.column("day"), data.list("weight").iter().map(crate::numbers::<5>).collect())
}

/// Data of [`surgical`]: deaths and operations.
pub fn surgical_data() -> (Vec<f64>, Vec<f64>) {
    let data = Data::parse(include_str!("../../fixtures/posteriors/surgical.json"));
    (data.column("deaths"), data.column("operations"))
}

/// Data of [`seeds`].
pub fn seed_plates() -> Vec<Plate> {
    let data = Data::parse(include_str!("../../fixtures/posteriors/seeds.json"));
    let [germinated, seeds, x1, x2] =
        ["germinated", "seeds", "aegyptiaca", "cucumber"].map(|name| data.column(name));
    let plate =
        |i: usize| Plate { germinated: germinated[i], seeds: seeds[i], factors: [x1[i], x2[i]] };
    (0..germinated.len()).map(plate).collect()
}

/// Data of [`radon_hierarchical`]: 919 houses in Minnesota.
pub fn houses() -> Houses {
    let data = Data::parse(include_str!("../../fixtures/posteriors/radon.json"));
    let (activity, floor) = (data.column("activity"), data.column("floor"));
    let uranium = data.column("uranium_ppm");
    let county: Vec<usize> = data.counts("county").iter().map(|&county| county as usize).collect();
    Houses {
        counties: uranium.len(),
        x: county.iter().zip(&floor).map(|(&c, &floor)| [uranium[c].ln(), floor]).collect(),
        county,
        log_radon: activity.iter().map(|activity| (activity + 0.1).ln()).collect(),
    }
}
