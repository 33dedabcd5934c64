//! Inputs of the forward model that are not known of a specimen: what they may be, and what the response is then.
//!
//! Every specimen without an image has a stiffness ratio k of its own, a member of a population of which
//! others are known: k ~ N(μ, s²), and μ ~ N(k̄, s²/N) from N of them. Neither has to be sampled. To second order in s
//! the response m(θ, k) is normal with the mean of m over the population and the covariance b bᵀ, where b is
//! what one s of k does to it; the error of k̄ moves all such specimens together, by b bᵀ/N.

use ppl::prelude::*;
use surrogate::DynPce;

use super::CalibrationError;

/// What is known of inputs of specimens from other members of their population: independent normals.
#[derive(Clone, Debug, PartialEq)]
pub struct Population {
    mean: Vec<f64>,
    sd: Vec<f64>,
    count: f64,
}

impl Population {
    /// From members, one row each.
    ///
    /// With their mean k̄ and variance s² one more member has Student's distribution of N − 1 degrees of freedom;
    /// here it is the normal one with that variance, s² (N − 1)/(N − 3) beside that of the mean.
    ///
    /// # Errors
    /// Fewer than four members, whose spread says too little; rows of different lengths.
    pub fn of(members: &[Vec<f64>]) -> Result<Self, CalibrationError> {
        let width = members.first().map_or(0, Vec::len);
        if members.len() < 4 || members.iter().any(|row| row.len() != width) {
            return Err(CalibrationError::Population { found: members.len() });
        }
        let n = members.len() as f64;
        let mean: Vec<f64> =
            (0..width).map(|i| members.iter().map(|row| row[i]).sum::<f64>() / n).collect();
        let sd = |(i, mean): (usize, &f64)| {
            let squares: f64 = members.iter().map(|row| (row[i] - mean).powi(2)).sum();
            (squares / (n - 3.0)).sqrt()
        };
        let sd = mean.iter().enumerate().map(sd).collect();
        Ok(Self { mean, sd, count: n })
    }

    /// From mean and standard deviation of each input, and how many members these are known from; with infinity
    /// they are exact.
    pub fn normal(mean: Vec<f64>, sd: Vec<f64>, count: f64) -> Self {
        Self { mean, sd, count }
    }

    /// The mean of each input.
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// The standard deviation of each input between members.
    pub fn sd(&self) -> &[f64] {
        &self.sd
    }

    /// How many members it is known from.
    pub fn count(&self) -> f64 {
        self.count
    }

    /// The places at which the response is taken, two for each input; the box of the forward model has to hold
    /// them.
    pub fn places(&self) -> Vec<Vec<f64>> {
        let reach = (self.mean.len() as f64).sqrt();
        let both = (0..self.mean.len()).flat_map(|i| [(i, reach), (i, -reach)]);
        let place = |(i, by): (usize, f64)| {
            let mut place = self.mean.clone();
            place[i] += by * self.sd[i];
            place
        };
        both.map(place).collect()
    }

    /// Mean and spread of the response at parameters `point`: the moments of the 2d points k̄ ± √d s_i e_i for d
    /// inputs, which are exact for polynomials of second (mean) and first order (spread).
    ///
    /// # Reference
    /// Julier & Uhlmann (2004), doi:10.1109/JPROC.2003.823141, of the points.
    pub(super) fn response<R: Scalar>(&self, forward: &DynPce, point: &[R]) -> Spread<R> {
        let at = |place: &Vec<f64>| {
            let inputs: Vec<R> =
                point.iter().copied().chain(place.iter().map(|&x| R::from(x))).collect();
            forward.at(&inputs)
        };
        let responses: Vec<Vec<R>> = self.places().iter().map(at).collect();
        let (points, reach) = (responses.len() as f64, (self.mean.len() as f64).sqrt());
        let mean = (0..responses[0].len())
            .map(|m| responses.iter().map(|y| y[m]).sum::<R>() * points.recip())
            .collect();
        let column = |pair: &[Vec<R>]| {
            pair[0].iter().zip(&pair[1]).map(|(&a, &b)| (a - b) * (0.5 / reach)).collect()
        };
        Spread { mean, columns: responses.chunks(2).map(column).collect(), count: self.count }
    }
}

/// The response of a specimen whose inputs are those of some member of a population.
#[derive(Clone, Debug)]
pub(super) struct Spread<R> {
    pub(super) mean: Vec<R>,
    /// What one standard deviation of each input does.
    columns: Vec<Vec<R>>,
    count: f64,
}

impl<R: Scalar> Spread<R> {
    /// An entry of the covariance between specimens.
    pub(super) fn between(&self, i: usize, j: usize) -> R {
        self.columns.iter().map(|column| column[i] * column[j]).sum()
    }

    /// An entry of the covariance of what all of them share, since the mean input is not known exactly.
    pub(super) fn shared(&self, i: usize, j: usize) -> R {
        self.between(i, j) * self.count.recip()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_have_a_mean_and_the_variance_of_one_more() {
        let members: Vec<Vec<f64>> = [1.4, 1.5, 1.5, 1.6, 1.7].map(|k| vec![k]).to_vec();
        let found = Population::of(&members).unwrap();
        assert!((found.mean()[0] - 1.54).abs() < 1e-12);
        // s² = 0.013, times 4/2
        assert!((found.sd()[0] - 0.026f64.sqrt()).abs() < 1e-12, "{found:?}");
        assert_eq!(found.count(), 5.0);
        assert!(Population::of(&members[..3]).is_err());
        assert!(Population::of(&[vec![1.0], vec![], vec![1.0], vec![2.0]]).is_err());
    }
}
