//! Experimental designs, the points at which to run the computer model: random, stratified and
//! low-discrepancy.

use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::dataset::Input;
use crate::error::SurrogateError;
use crate::sobol_sequence::{MAX_DIMENSION, ScrambledSobol};

/// A method that distributes `n` points over a box.
///
/// - `MonteCarlo`: independent uniform points.
/// - `LatinHypercube`: for each input, one point in each of `n` equal intervals, at a uniformly distributed
///   position in the interval (McKay, Beckman & Conover 1979, doi:10.1080/00401706.1979.10489755).
/// - `Sobol`: the first `n` points of a Sobol sequence (direction numbers of Joe & Kuo 2008,
///   doi:10.1137/070709359), randomised by a linear matrix scramble and a digital shift (Matoušek 1998,
///   doi:10.1006/jcom.1998.0489). Best if `n` is a power of two.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DesignMethod {
    /// Independent uniform points.
    MonteCarlo,
    /// One point in each of `n` equal intervals of each input.
    LatinHypercube,
    /// Scrambled Sobol points.
    Sobol,
}

impl DesignMethod {
    /// Draws `n` points in the inputs' units; the coordinates of a point are in the order of `inputs`. The
    /// same seed gives the same points.
    ///
    /// # Errors
    /// If bounds are invalid, or if `Sobol` has more than 21 inputs.
    ///
    /// ```
    /// use surrogate::{DesignMethod, Input};
    /// let inputs = [Input::new("young_mpa", 250.0, 300.0)?, Input::new("poisson", 0.2, 0.3)?];
    /// let points = DesignMethod::Sobol.sample(&inputs, 64, 7)?;
    /// assert!(points.iter().all(|p| inputs[0].contains(p[0]) && inputs[1].contains(p[1])));
    /// # Ok::<(), surrogate::SurrogateError>(())
    /// ```
    pub fn sample(
        self,
        inputs: &[Input],
        n: usize,
        seed: u64,
    ) -> Result<Vec<Vec<f64>>, SurrogateError> {
        for input in inputs {
            input.check()?;
        }
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut sample = self.sample_unit(inputs.len(), n, &mut rng)?;
        for point in &mut sample {
            for (x, input) in point.iter_mut().zip(inputs) {
                // because of rounding, the sum can be slightly above the upper bound
                *x = (input.lower + (input.upper - input.lower) * *x).min(input.upper);
            }
        }
        Ok(sample)
    }

    /// Draws `n` points in the unit cube [0, 1)^`dimension` with the random number generator `rng`.
    ///
    /// # Errors
    /// If `Sobol` has more than 21 dimensions.
    pub fn sample_unit<R: Rng>(
        self,
        dimension: usize,
        n: usize,
        rng: &mut R,
    ) -> Result<Vec<Vec<f64>>, SurrogateError> {
        match self {
            Self::MonteCarlo => {
                Ok((0..n).map(|_| (0..dimension).map(|_| rng.random()).collect()).collect())
            }
            Self::LatinHypercube => Ok(latin_hypercube(dimension, n, rng)),
            Self::Sobol if dimension > MAX_DIMENSION => Err(SurrogateError::Option {
                option: "inputs of a Sobol design",
                value: dimension.to_string(),
                allowed: format!("at most {MAX_DIMENSION}; use a Latin hypercube"),
            }),
            Self::Sobol => Ok(ScrambledSobol::new(dimension, rng).take(n).collect()),
        }
    }
}

fn latin_hypercube<R: Rng>(dimension: usize, n: usize, rng: &mut R) -> Vec<Vec<f64>> {
    let mut sample = vec![vec![0.0; dimension]; n];
    let mut strata: Vec<usize> = (0..n).collect();
    for d in 0..dimension {
        strata.shuffle(rng);
        for (point, &stratum) in sample.iter_mut().zip(&strata) {
            point[d] = (stratum as f64 + rng.random::<f64>()) / n as f64;
        }
    }
    sample
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit(design: DesignMethod, dimension: usize, n: usize, seed: u64) -> Vec<Vec<f64>> {
        design.sample_unit(dimension, n, &mut Xoshiro256PlusPlus::seed_from_u64(seed)).unwrap()
    }

    const ALL: [DesignMethod; 3] =
        [DesignMethod::MonteCarlo, DesignMethod::LatinHypercube, DesignMethod::Sobol];

    #[test]
    fn latin_hypercube_has_one_point_in_each_stratum() {
        let n = 37;
        for d in 0..5 {
            let mut strata: Vec<usize> = unit(DesignMethod::LatinHypercube, 5, n, 3)
                .iter()
                .map(|p| (p[d] * n as f64) as usize)
                .collect();
            strata.sort_unstable();
            assert_eq!(strata, (0..n).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_seed_fixes_the_points_and_another_changes_them() {
        for design in ALL {
            assert_eq!(unit(design, 4, 50, 11), unit(design, 4, 50, 11));
            assert_ne!(unit(design, 4, 50, 11), unit(design, 4, 50, 12));
        }
    }

    /// Compares one point per method with a stored value. If the random numbers of a seed changed, stored designs
    /// could not be reproduced.
    #[test]
    fn the_points_of_a_seed_are_pinned() {
        let pinned = [
            [0.11424123768787475, 0.17196814066247745],
            [0.965488386904567, 0.6371595306117492],
            [0.5815199789888357, 0.8772907065533391],
        ];
        for (design, point) in ALL.into_iter().zip(pinned) {
            assert_eq!(unit(design, 2, 8, 7)[5], point, "{design:?}");
        }
    }

    /// Kolmogorov–Smirnov test: √n D exceeds 1.95 with probability 0.001 for independent draws, and with a
    /// smaller probability for stratified draws. The seeds are fixed, so the result is always the same.
    #[test]
    fn every_margin_is_uniform() {
        let n = 1000;
        for design in ALL {
            let sample = unit(design, 6, n, 5);
            for d in 0..6 {
                let mut x: Vec<f64> = sample.iter().map(|p| p[d]).collect();
                x.sort_by(f64::total_cmp);
                let distance = (0..n)
                    .map(|i| (x[i] - i as f64 / n as f64).max((i + 1) as f64 / n as f64 - x[i]))
                    .fold(0.0, f64::max);
                assert!(distance * (n as f64).sqrt() < 1.95, "{design:?} {d} {distance}");
            }
        }
    }

    /// Squared L2 star discrepancy by Warnock's formula.
    fn discrepancy(sample: &[Vec<f64>]) -> f64 {
        let n = sample.len() as f64;
        let dimension = sample[0].len() as i32;
        let single: f64 =
            sample.iter().map(|p| p.iter().map(|x| (1.0 - x * x) / 2.0).product::<f64>()).sum();
        let double: f64 = sample
            .iter()
            .flat_map(|p| sample.iter().map(move |q| (p, q)))
            .map(|(p, q)| p.iter().zip(q).map(|(a, b)| 1.0 - a.max(*b)).product::<f64>())
            .sum();
        3f64.powi(-dimension) - 2.0 / n * single + double / (n * n)
    }

    /// For n independent points in d dimensions, the expected squared discrepancy is exactly (2^−d − 3^−d)/n. The
    /// squared discrepancy of Sobol points must be far smaller.
    #[test]
    fn discrepancies_are_those_of_the_kind() {
        let (d, n, repeats) = (3, 256, 40);
        let expected = (0.5f64.powi(d) - 3f64.powi(-d)) / f64::from(n);
        let samples = |design| -> Vec<f64> {
            (0..repeats)
                .map(|seed| discrepancy(&unit(design, d as usize, n as usize, seed)) / expected)
                .collect()
        };
        let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
        let random = samples(DesignMethod::MonteCarlo);
        let variance =
            random.iter().map(|x| (x - mean(&random)).powi(2)).sum::<f64>() / (repeats - 1) as f64;
        assert!((mean(&random) - 1.0).abs() < 4.0 * (variance / repeats as f64).sqrt());
        assert!(mean(&samples(DesignMethod::LatinHypercube)) < 1.0);
        assert!(mean(&samples(DesignMethod::Sobol)) < 0.05);
    }

    #[test]
    fn a_scrambled_net_integrates_without_bias_and_better_than_random() {
        // the integral of Π_i (1 + (u_i − ½)) over the unit cube is 1; at one random point the variance is (13/12)^d −
        // 1
        let (d, n, repeats) = (4, 256, 200u64);
        let means: Vec<f64> = (0..repeats)
            .map(|seed| {
                let sample = unit(DesignMethod::Sobol, d, n, seed);
                sample.iter().map(|p| p.iter().map(|u| 0.5 + u).product::<f64>()).sum::<f64>()
                    / n as f64
            })
            .collect();
        let mean = means.iter().sum::<f64>() / repeats as f64;
        let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (repeats - 1) as f64;
        let random = ((13.0f64 / 12.0).powi(d as i32) - 1.0) / n as f64;
        assert!((mean - 1.0).abs() < 4.0 * (variance / repeats as f64).sqrt(), "{mean} {variance}");
        assert!(variance < random / 100.0, "{variance} {random}");
    }

    #[test]
    fn points_stay_in_the_box_and_bad_boxes_are_refused() {
        let inputs = [Input::new("a", -3.0, -2.9).unwrap(), Input::new("b", 1e-5, 5e-3).unwrap()];
        for design in ALL {
            for p in design.sample(&inputs, 200, 1).unwrap() {
                assert!(inputs[0].contains(p[0]) && inputs[1].contains(p[1]));
            }
        }
        let reversed = [Input { name: "a".into(), lower: 1.0, upper: 0.0 }];
        assert!(matches!(
            DesignMethod::Sobol.sample(&reversed, 2, 1),
            Err(SurrogateError::Bounds { .. })
        ));
        let many: Vec<Input> =
            (0..22).map(|i| Input::new(format!("x{i}"), 0.0, 1.0).unwrap()).collect();
        assert!(DesignMethod::Sobol.sample(&many, 2, 1).is_err());
        assert!(DesignMethod::LatinHypercube.sample(&many, 2, 1).is_ok());
    }
}
