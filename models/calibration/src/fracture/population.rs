//! Population of the inputs of the forward model that are unknown for some specimens, and the response of these
//! specimens.
//!
//! A specimen without an image has an unknown stiffness ratio k. The ratio k comes from a population with N known
//! members: k ~ N(μ, s²) and μ ~ N(k̄, s²/N), where k̄ is the mean of the known members. Neither k nor μ has to be
//! sampled. To second order in s, the response m(θ, k) is normal. The mean of the response is the average of m over the
//! population. The covariance of the response is b bᵀ, where b is the change of the response if k changes by s. All
//! specimens with unknown k share the error of k̄, which has the covariance b bᵀ/N.

use ppl::prelude::*;

use super::CalibrationError;

/// Population of unknown inputs: independent normal distributions that are estimated from known members.
#[derive(Clone, Debug, PartialEq)]
pub struct Population {
    mean: Vec<f64>,
    sd: Vec<f64>,
    count: f64,
}

impl Population {
    /// Estimates the population from known members, one row per member.
    ///
    /// Given the mean k̄ and the variance s² of N members, a further member follows Student's distribution with N − 1
    /// degrees of freedom. A normal distribution with the same variances replaces Student's distribution: a member has
    /// the variance s² (N − 1)/(N − 3) about the mean of the population, and the mean has 1/N of this variance.
    ///
    /// # Errors
    /// If there are fewer than four members, so that the spread cannot be estimated, or the rows have different
    /// lengths.
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

    /// Creates a population with the mean and standard deviation of each input. `count` is the number of members from
    /// which mean and standard deviation were estimated; infinity means that both are exact.
    pub fn normal(mean: Vec<f64>, sd: Vec<f64>, count: f64) -> Self {
        Self { mean, sd, count }
    }

    /// Mean of each input.
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// Standard deviation of each input between members.
    pub fn sd(&self) -> &[f64] {
        &self.sd
    }

    /// Number of members from which the population was estimated.
    pub fn count(&self) -> f64 {
        self.count
    }

    /// Points at which the response is evaluated, two for each input. The box of the forward model must contain these
    /// points.
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

    /// Mean and spread of the response at the parameters `point`, computed from 2d evaluations for d inputs. The
    /// evaluations are at k̄ ± √d s_i e_i, with the mean k̄ of the population, the standard deviation s_i of input i
    /// and its unit vector e_i. The mean is exact if the response is a polynomial of second order in k; the spread is
    /// exact for first order.
    ///
    /// # Reference
    /// Julier & Uhlmann (2004), doi:10.1109/JPROC.2003.823141, for the choice of the points.
    pub(super) fn response<R: Scalar>(
        &self,
        forward: &impl DynDifferentiable,
        point: &[R],
    ) -> Spread<R> {
        let at = |place: &Vec<f64>| {
            let inputs: Vec<R> =
                point.iter().copied().chain(place.iter().map(|&x| R::from(x))).collect();
            forward.at(&inputs)
        };
        let responses: Vec<Vec<R>> = self.places().iter().map(at).collect();
        let (response_count, reach) = (responses.len() as f64, (self.mean.len() as f64).sqrt());
        let mean = (0..responses[0].len())
            .map(|m| responses.iter().map(|y| y[m]).sum::<R>() * response_count.recip())
            .collect();
        let column = |pair: &[Vec<R>]| {
            pair[0].iter().zip(&pair[1]).map(|(&a, &b)| (a - b) * (0.5 / reach)).collect()
        };
        Spread { mean, columns: responses.chunks(2).map(column).collect(), count: self.count }
    }
}

/// Response of a specimen with unknown inputs: mean and spread over the population.
#[derive(Clone, Debug)]
pub(super) struct Spread<R> {
    pub(super) mean: Vec<R>,
    /// Change of the response for a change of each input by one standard deviation.
    columns: Vec<Vec<R>>,
    count: f64,
}

impl<R: Scalar> Spread<R> {
    /// Entry (i, j) of the covariance of the response of one specimen due to the spread of its unknown inputs.
    pub(super) fn between(&self, i: usize, j: usize) -> R {
        self.columns.iter().map(|column| column[i] * column[j]).sum()
    }

    /// Entry (i, j) of the covariance that all specimens with unknown inputs share, because the mean of the population
    /// is not known exactly.
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
        // sample variance 0.013, times (N − 1)/(N − 3) = 4/2
        assert!((found.sd()[0] - 0.026f64.sqrt()).abs() < 1e-12, "{found:?}");
        assert_eq!(found.count(), 5.0);
        assert!(Population::of(&members[..3]).is_err());
        assert!(Population::of(&[vec![1.0], vec![], vec![1.0], vec![2.0]]).is_err());
    }
}
