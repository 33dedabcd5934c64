//! Models whose posterior moments are known exactly, by enumeration, conjugacy or quadrature in two dimensions.
//!
//! The models are written as users of Stan write them, for data from the literature. The priors are proper and differ
//! from the priors of the literature.

use ppl::prelude::*;

use super::regression::Trial;

ppl::model! {
    /// Coal mining disasters: two rates, and an unknown year in which the rate changes. The year is summed out (Stan
    /// User's Guide, change points).
    pub fn disasters(counts: &[u64]) {
        let early ~ Exponential(1.0);
        let late ~ Exponential(1.0);
        // the sum begins with the change before the first year, so that all years have the late rate; each further year
        // moves one year from the late to the early rate
        let mut path = 0.0;
        for k in counts {
            path += Poisson(late).ln_density(k);
        }
        let mut paths = Vec::new();
        for k in counts {
            paths.push(path);
            path += Poisson(early).ln_density(k) - Poisson(late).ln_density(k);
        }
        let total = ln_sum_exp(&paths);
        factor(total);
        #[track] let change = paths
            .iter()
            .enumerate()
            .map(|(t, path)| t as f64 * (*path - total).exp())
            .sum::<Real<_>>();
    }

    /// Annual flow of the Nile: the level is a random walk that is observed with noise (Durbin & Koopman 2012, ch. 2).
    pub fn nile(flow: &[f64]) {
        let step ~ HalfNormal(100.0);
        let noise ~ HalfNormal(200.0);
        let mut last = 0.0;
        for (t, y) in flow.iter().enumerate() {
            let level ~ Normal(
                if t == 0 { Real::from(1000.0) } else { last },
                if t == 0 { Real::from(300.0) } else { step },
            );
            y ~ Normal(level, noise);
            last = level;
        }
        #[track] let now = last;
    }

    /// Tumours in groups of rats: the rates of the groups share one beta distribution (Gelman et al. 2013, ch. 5).
    pub fn tumours(tumours: &[u64], rats: &[u64]) {
        let mean ~ Uniform(0.0, 1.0);
        let size ~ LogNormal(2.5, 1.0);
        for (y, n) in tumours.iter().zip(rats) {
            let rate ~ Beta(size * mean, size * (1.0 - mean));
            y ~ Binomial(n, rate);
        }
    }

    /// Learning of dogs: each earlier trial multiplies the probability of a shock by a factor (Kéry & Schaub 2012;
    /// posteriordb dogs_log).
    pub fn dogs_log(trials: &[Trial]) {
        let beta ~ Uniform(0.0, 1.0).array::<2>();
        for t in trials {
            // the first trial is always a shock
            if t.avoided + t.shocks > 0.0 {
                let shocked = t.shock == 1.0;
                shocked ~ Bernoulli(beta[0].powf(t.avoided) * beta[1].powf(t.shocks));
            }
        }
    }

    /// Deaths of animals at four doses (Gelman et al. 2013, ch. 3.7).
    pub fn bioassay(ln_dose: &[f64], animals: u64, deaths: &[u64]) {
        let alpha ~ Normal(0.0, 2.0);
        let beta ~ Normal(10.0, 10.0);
        for (x, y) in ln_dose.iter().zip(deaths) {
            y ~ BinomialLogit(animals, alpha + beta * x);
        }
    }

    /// Number of captures of each animal. Some of the animals may not exist (Kéry & Schaub 2012, model M0).
    pub fn captures(captures: &[u64], occasions: u64) {
        let exists ~ Uniform(0.0, 1.0);
        let p ~ Uniform(0.0, 1.0);
        for y in captures {
            let caught = exists.ln() + Binomial(occasions, p).ln_density(y);
            if *y > 0 {
                factor(caught);
            } else {
                factor(ln_sum_exp(&[caught, (1.0 - exists).ln()]));
            }
        }
    }

    /// Durations of remissions; a remission that has not ended is a censored observation.
    pub fn remissions(weeks: &[f64], over: &[bool]) {
        let shape ~ HalfNormal(3.0);
        let scale ~ LogNormal(3.0, 1.0);
        for (t, over) in weeks.iter().zip(over) {
            if *over {
                t ~ Weibull(shape, scale);
            } else {
                let at_least = t;
                at_least ~ Weibull(shape, scale).censor(..*t);
            }
        }
    }

    /// Hidden Markov model with two states, which the forward algorithm sums out. The probability of staying in each
    /// state is unknown.
    pub fn two_states(y: &[f64], means: &[f64; 2]) {
        let stay ~ Beta(3.0, 2.0).array::<2>();
        let mut forward = means.map(|m| Normal(m, 1.0).ln_density(&Real::from(y[0])) + 0.5f64.ln());
        for t in 1..y.len() {
            let mut next = forward;
            for k in 0..2 {
                let from_here = forward[k] + stay[k].ln();
                let from_there = forward[1 - k] + (1.0 - stay[1 - k]).ln();
                let emission = Normal(means[k], 1.0).ln_density(&Real::from(y[t]));
                next[k] = emission + ln_sum_exp(&[from_here, from_there]);
            }
            forward = next;
        }
        factor(ln_sum_exp(&forward));
    }
}

/// Disasters in British coal mines, 1851 to 1962 (Jarrett 1979, doi:10.1093/biomet/66.1.191).
pub const DISASTERS: [u64; 112] = [
    4, 5, 4, 1, 0, 4, 3, 4, 0, 6, 3, 3, 4, 0, 2, 6, 3, 3, 5, 4, 5, 3, 1, 4, 4, 1, 5, 5, 3, 4, 2, 5,
    2, 2, 3, 4, 2, 1, 3, 2, 2, 1, 1, 1, 1, 3, 0, 0, 1, 0, 1, 1, 0, 0, 3, 1, 0, 3, 2, 2, 0, 1, 1, 1,
    0, 1, 0, 1, 0, 0, 0, 2, 1, 0, 0, 0, 1, 1, 0, 2, 3, 3, 1, 1, 2, 1, 1, 1, 1, 2, 4, 2, 0, 0, 0, 1,
    4, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 1,
];

/// Flow of the Nile at Aswan, 1871 to 1970, in 10⁸ m³.
pub const NILE: [f64; 100] = [
    1120.0, 1160.0, 963.0, 1210.0, 1160.0, 1160.0, 813.0, 1230.0, 1370.0, 1140.0, 995.0, 935.0,
    1110.0, 994.0, 1020.0, 960.0, 1180.0, 799.0, 958.0, 1140.0, 1100.0, 1210.0, 1150.0, 1250.0,
    1260.0, 1220.0, 1030.0, 1100.0, 774.0, 840.0, 874.0, 694.0, 940.0, 833.0, 701.0, 916.0, 692.0,
    1020.0, 1050.0, 969.0, 831.0, 726.0, 456.0, 824.0, 702.0, 1120.0, 1100.0, 832.0, 764.0, 821.0,
    768.0, 845.0, 864.0, 862.0, 698.0, 845.0, 744.0, 796.0, 1040.0, 759.0, 781.0, 865.0, 845.0,
    944.0, 984.0, 897.0, 822.0, 1010.0, 771.0, 676.0, 649.0, 846.0, 812.0, 742.0, 801.0, 1040.0,
    860.0, 874.0, 848.0, 890.0, 744.0, 749.0, 838.0, 1050.0, 918.0, 986.0, 797.0, 923.0, 975.0,
    815.0, 1020.0, 906.0, 901.0, 1170.0, 912.0, 746.0, 919.0, 718.0, 714.0, 740.0,
];

/// Rats with tumours in 71 groups (Tarone 1982, doi:10.2307/2530301).
pub const TUMOURS: [u64; 71] = [
    0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 2, 2, 1,
    5, 2, 5, 3, 2, 7, 7, 3, 3, 2, 9, 10, 4, 4, 4, 4, 4, 4, 4, 10, 4, 4, 4, 5, 11, 12, 5, 5, 6, 5,
    6, 6, 6, 6, 16, 15, 15, 9, 4,
];

/// Number of rats in each group.
pub const RATS: [u64; 71] = [
    20, 20, 20, 20, 20, 20, 20, 19, 19, 19, 19, 18, 18, 17, 20, 20, 20, 20, 19, 19, 18, 18, 25, 24,
    23, 20, 20, 20, 20, 20, 20, 10, 49, 19, 46, 27, 17, 49, 47, 20, 20, 13, 48, 50, 20, 20, 20, 20,
    20, 20, 20, 48, 19, 19, 19, 22, 46, 49, 20, 20, 23, 19, 22, 20, 20, 20, 52, 46, 47, 24, 14,
];

/// Logarithms of four doses in g/ml.
pub const LN_DOSE: [f64; 4] = [-0.86, -0.30, -0.05, 0.73];

/// Number of deaths at each dose, among five animals.
pub const DEATHS: [u64; 4] = [0, 1, 3, 5];

/// Numbers of snowshoe hares that were caught once, twice, … six times on six occasions (Otis et al. 1978).
pub const HARES: [usize; 6] = [25, 22, 13, 5, 1, 2];

/// Number of captures of each hare, and of 60 further animals that were never caught and may not exist.
pub fn hares() -> Vec<u64> {
    let caught = (1..).zip(HARES).flat_map(|(times, n)| vec![times; n]);
    caught.chain(vec![0; 60]).collect()
}

/// Weeks of remission under 6-mercaptopurine, and whether the remission has ended (Gehan 1965,
/// doi:10.1093/biomet/52.1-2.203).
pub const REMISSIONS: [(f64, bool); 21] = [
    (6.0, true),
    (6.0, true),
    (6.0, true),
    (6.0, false),
    (7.0, true),
    (9.0, false),
    (10.0, true),
    (10.0, false),
    (11.0, false),
    (13.0, true),
    (16.0, true),
    (17.0, false),
    (19.0, false),
    (20.0, false),
    (22.0, true),
    (23.0, true),
    (25.0, false),
    (32.0, false),
    (32.0, false),
    (34.0, false),
    (35.0, false),
];

/// Twelve observations of [`two_states`] with means 0 and 2.5.
pub const STATES: [f64; 12] = [0.3, -0.8, 0.5, 2.2, 3.4, 1.3, 2.9, 0.1, -1.1, 1.0, 0.4, 2.7];
