//! Models of every kind of statement, and their data.

use ppl::prelude::*;
use ppl::{Differentiable, DomainError};

/// A function from three parameters to three quantities, defined for a > 1.
pub(crate) struct Curve;

impl Differentiable<3, 3> for Curve {
    fn value_and_jacobian(
        &self,
        &[a, b, c]: &[f64; 3],
    ) -> Result<([f64; 3], [[f64; 3]; 3]), DomainError> {
        if a <= 1.0 {
            return Err(DomainError::new(format!("a must be above 1, got {a}")));
        }
        let value = [a * b, a.ln() + c, b * c * c];
        let jacobian = [[b, a, 0.0], [1.0 / a, 0.0, 1.0], [0.0, c * c, 2.0 * b * c]];
        Ok((value, jacobian))
    }
}

pub(crate) const EFFECTS: [f64; 8] = [28.0, 8.0, -3.0, 7.0, -1.0, 1.0, 18.0, 12.0];
pub(crate) const ERRORS: [f64; 8] = [15.0, 10.0, 16.0, 11.0, 9.0, 11.0, 10.0, 18.0];

ppl::model! {
    /// A model of the form of the calibration in the project's paper.
    pub(crate) fn calibration(forward: &Curve, qois: &[[f64; 3]]) {
        let young     ~ Uniform(2.5, 3.0);
        let toughness ~ Uniform(0.1, 0.5);
        let viscosity ~ Uniform(0.5, 1.5);

        let sd   ~ Normal(0.15, 0.25).truncate(0.0..).array::<3>();
        let corr ~ LkjCholesky::<3>(3.0);
        let chol = corr.scale_rows(sd);

        #[track] let mean = forward.at([young, toughness, viscosity]);
        for y in qois {
            y ~ MvNormalCholesky(mean, chol);
        }
        #[predict] let new_specimen ~ MvNormalCholesky(mean, chol);
    }

    pub(crate) fn schools_centred(effects: &[f64; 8], errors: &[f64; 8]) {
        let mu ~ Normal(0.0, 5.0);
        let tau ~ HalfCauchy(5.0);
        let theta ~ Normal(mu, tau).array::<8>();
        for j in 0..8 {
            effects[j] ~ Normal(theta[j], errors[j]);
        }
    }

    pub(crate) fn schools(effects: &[f64; 8], errors: &[f64; 8]) {
        let mu ~ Normal(0.0, 5.0);
        let tau ~ HalfCauchy(5.0);
        let z ~ Normal(0.0, 1.0).array::<8>();
        #[track] let theta = z.map(|z| mu + tau * z);
        for ((y, sd), theta) in effects.iter().zip(errors).zip(theta) {
            y ~ Normal(theta, sd);
        }
    }

    /// Eight schools with the unknowns `theta` declared in a plate.
    pub(crate) fn schools_in_a_plate(effects: &[f64; 8], errors: &[f64; 8]) {
        let mu ~ Normal(0.0, 5.0);
        let tau ~ HalfCauchy(5.0);
        for (y, sd) in effects.iter().zip(errors) {
            let theta ~ Normal(mu, tau);
            y ~ Normal(theta, sd);
        }
    }

    pub(crate) fn regression<const D: usize>(x: &[[f64; D]], y: &[f64]) {
        let intercept ~ Normal(0.0, 10.0);
        let slope ~ StudentT(4.0, 0.0, 2.5).array::<D>();
        let sd ~ Exponential(1.0);
        for (row, y) in x.iter().zip(y) {
            let mut mean = intercept;
            for d in 0..D {
                mean += slope[d] * row[d];
            }
            y ~ Normal(mean, sd);
        }
        #[predict] for row in x {
            let mut mean = intercept;
            for d in 0..D {
                mean += slope[d] * row[d];
            }
            #[track] let fitted = mean;
            let y_new ~ Normal(fitted, sd);
        }
    }

    /// Groups by index, with sizes known at run time and data passed by value.
    pub(crate) fn hierarchy(groups: usize, group: Vec<usize>, count: Vec<u64>) {
        let level ~ Normal(0.0, 1.0);
        let spread ~ HalfNormal(1.0);
        let offset ~ Normal(level, spread).iid(groups);
        for (g, k) in group.iter().zip(count) {
            let rate = offset[*g].exp();
            k ~ Poisson(rate);
        }
    }

    /// Branches on data, with and without a result.
    pub(crate) fn branches(robust: bool, prior: Option<f64>, kind: u8, ys: &[f64]) {
        let mean ~ Normal(0.0, 2.0);
        let sd = if let Some(scale) = prior {
            let free ~ Normal(0.0, scale).truncate(0.0..);
            free
        } else {
            Real::from(1.0)
        };
        let shift = match kind {
            0 => Real::from(0.0),
            1 | 2 if robust => {
                let heavy ~ StudentT(3.0, 0.0, 1.0);
                heavy
            }
            _ => {
                let light ~ Normal(0.0, 1.0);
                light
            }
        };
        for (i, y) in ys.iter().enumerate() {
            if y.is_nan() {
                continue;
            }
            if robust && i > 0 {
                y ~ StudentT(5.0, mean + shift, sd);
            } else {
                y ~ Normal(mean + shift, sd);
            }
        }
    }

    /// A mixture by hand, in addition to a factor without unknowns and a factor with unknowns.
    pub(crate) fn mixture(ys: &[f64], weight: f64) {
        let share ~ Beta(2.0, 2.0);
        let centre ~ Normal(0.0, 1.0).array::<2>();
        factor(weight);
        factor(-0.5 * (centre[0] + centre[1]).square());
        for y in ys {
            let first = Normal(centre[0], 1.0).ln_density(&Real::from(*y)) + share.ln();
            let second = Normal(centre[1], 2.0).ln_density(&Real::from(*y)) + (1.0 - share).ln();
            factor(first + (second - first).softplus());
        }
    }

    /// Observations of fields, tuple entries and dereferenced arguments; a block.
    pub(crate) fn places(pair: &(f64, f64), specimens: &[Specimen], flag: &bool) {
        let a ~ Gamma(2.0, 3.0);
        let p ~ Uniform(0.0, 1.0);
        pair.0 ~ LogNormal(0.0, a);
        {
            let b = 2.0 * a;
            pair.1 ~ Normal(b, 1.0);
        }
        for s in specimens {
            s.slope ~ Normal(a, 0.5);
            s.peak[1] ~ Normal(a * a, 0.5);
        }
        *flag ~ Bernoulli(p);
    }

    pub(crate) fn generic<'a, F>(f: &'a F, y: [f64; 3])
    where
        F: Differentiable<3, 3> + 'a,
    {
        let x ~ Uniform(1.5, 2.5).array::<3>();
        let value = f.try_at(x)?;
        y ~ Normal(0.0, 1.0).array::<3>();
        factor(-value[0].square());
    }

    pub(crate) fn limited(f: &Curve, limit: f64) {
        let x ~ Normal(1.0, 1.0);
        if x > limit {
            reject!("{x} is above {limit}");
        }
        let value = f.try_at([x, x, x])?[1];
        factor(-value.square());
    }

    /// An inner loop that continues the outer loop; the outer loop passes a state from iteration to
    /// iteration.
    pub(crate) fn jumps(rows: &[[f64; 3]]) {
        let mu ~ Normal(0.0, 1.0);
        let sd ~ HalfNormal(1.0);
        let mut state = Real::from(0.0);
        'rows: for row in rows {
            state = state * 0.5 + mu.sin();
            for y in row {
                if *y > 2.0 {
                    continue 'rows;
                }
                y ~ Normal(2.0 * mu, sd);
            }
            factor(-state.square());
        }
    }

    /// Maxima and minima of unknowns, literals and formulas.
    pub(crate) fn bent(ys: &[f64]) {
        let knot ~ Normal(0.0, 1.0);
        let slope ~ Normal(0.0, 1.0).array::<2>();
        for (i, y) in ys.iter().enumerate() {
            let x = i as f64 - 1.5;
            let mean = slope[0] * (x - knot).max(0.0) + (slope[1] * x).min(knot).max(slope[0]);
            y ~ Normal(mean, 0.5);
        }
    }

    /// A state that a loop passes from datum to datum.
    pub(crate) fn walk(ys: &[f64]) {
        let phi ~ Uniform(-1.0, 1.0);
        let sd ~ HalfNormal(1.0);
        let mut state = Real::from(0.0);
        for y in ys {
            let step ~ Normal(0.0, sd);
            state = phi * state + step;
            y ~ Normal(state, 0.5);
        }
        #[track] let last = state;
        #[predict] let next ~ Normal(phi * last, sd);
        #[predict] let change = next - last;
    }
}

pub(crate) struct Specimen {
    pub(crate) slope: f64,
    pub(crate) peak: [f64; 2],
}

pub(crate) const SPECIMENS: [Specimen; 2] =
    [Specimen { slope: 0.4, peak: [9.0, 1.0] }, Specimen { slope: 0.7, peak: [8.0, 1.2] }];
pub(crate) const QOIS: [[f64; 3]; 2] = [[1.0, 2.0, 0.5], [1.1, 1.9, 0.4]];
pub(crate) const ROWS: [[f64; 2]; 3] = [[0.0, 1.0], [1.0, -0.5], [2.0, 0.3]];
