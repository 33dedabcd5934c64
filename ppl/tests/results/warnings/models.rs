//! Models that must give particular warnings, and models that must give none.

use ppl::prelude::*;

ppl::model! {
    /// Four unknowns with heavy tails that no datum touches.
    pub(crate) fn untouched(y: &[f64]) {
        let mu ~ Normal(0.0, 10.0);
        let half ~ HalfCauchy(1.0);
        let whole ~ StudentT(1.0, 0.0, 1.0);
        let wide ~ LogNormal(0.0, 3.0);
        let student ~ StudentT(2.5, 0.0, 1.0);
        for y in y {
            y ~ Normal(mu, 1.0);
        }
    }

    /// Data where a Cauchy prior has less than a thousandth of its mass, with a likelihood that is almost flat.
    pub(crate) fn far_out(y: &[f64]) {
        let mu ~ StudentT(1.0, 0.0, 1.0);
        for y in y {
            y ~ Normal(mu, 800.0);
        }
    }

    /// The scale of one coefficient of a horseshoe; a hundredth of the prior mass lies in the region that the
    /// datum favours.
    pub(crate) fn local_scale(coefficient: f64) {
        let lambda ~ HalfCauchy(1.0);
        coefficient ~ Normal(0.0, 0.1 * lambda);
    }

    pub(crate) fn mean(y: &[f64]) {
        let mu ~ Normal(0.0, 10.0);
        let sd ~ HalfNormal(5.0);
        #[track] let still = 0.1;
        for y in y {
            y ~ Normal(mu, sd);
        }
    }

    pub(crate) fn sum(y: &[f64]) {
        let a ~ Normal(0.0, 10.0);
        let b ~ Normal(0.0, 10.0);
        for y in y {
            y ~ Normal(a + b, 1.0);
        }
    }

    pub(crate) fn difference(y: &[f64]) {
        let a ~ Normal(0.0, 10.0);
        let b ~ Normal(0.0, 10.0);
        for y in y {
            y ~ Normal(a - b, 1.0);
        }
    }

    pub(crate) fn product(y: &[f64]) {
        let a ~ LogNormal(0.0, 1.0);
        let b ~ LogNormal(0.0, 1.0);
        for y in y {
            y ~ Normal(a * b, 0.1);
        }
    }

    pub(crate) fn free_levels(k: &[u64]) {
        let a ~ Normal(0.0, 5.0).array::<2>();
        for k in k {
            k ~ PoissonLog(a[0] - a[1]);
        }
    }

    pub(crate) fn intercepts(y: &[f64]) {
        let a ~ Normal(0.0, 10.0);
        let b ~ Normal(0.0, 10.0).array::<3>();
        for i in 0..y.len() {
            y[i] ~ Normal(a + b[i % 3], 1.0);
        }
    }

    /// A regression whose covariates are far from zero, so that intercept and slope are correlated.
    pub(crate) fn regression(x: &[f64], y: &[f64]) {
        let a ~ Normal(0.0, 10.0);
        let b ~ Normal(0.0, 10.0);
        let sd ~ HalfNormal(5.0);
        for (x, y) in x.iter().zip(y) {
            y ~ Normal(a + b * x, sd);
        }
    }

    pub(crate) fn schools(y: &[f64], sd: &[f64]) {
        let mu ~ Normal(0.0, 5.0);
        let tau ~ HalfCauchy(5.0);
        let z ~ Normal(0.0, 1.0).array::<8>();
        for i in 0..8 {
            y[i] ~ Normal(mu + tau * z[i], sd[i]);
        }
    }

    /// Well measured groups in non-centred form, whose effects `z` are correlated with the mean.
    pub(crate) fn groups(y: &[f64]) {
        let mu ~ Normal(0.0, 10.0);
        let tau ~ HalfNormal(2.0);
        let z ~ Normal(0.0, 1.0).array::<4>();
        for i in 0..y.len() {
            y[i] ~ Normal(mu + tau * z[i % 4], 1.0);
        }
    }

    /// Groups with little data, tied together by their prior.
    pub(crate) fn weak_groups(y: &[f64], count: usize) {
        let mu ~ Normal(0.0, 10.0);
        let tau ~ HalfNormal(2.0);
        let m ~ Normal(mu, tau).iid(count);
        for i in 0..y.len() {
            y[i] ~ Normal(m[i % count], 2.0);
        }
    }

    pub(crate) fn correlated(y: &[[f64; 2]]) {
        let mu ~ Normal(0.0, 5.0).array::<2>();
        let sd ~ HalfNormal(3.0).array::<2>();
        let factor ~ LkjCholesky::<2>(2.0);
        for y in y {
            y ~ MvNormalCholesky(mu, factor.scale_rows(sd));
        }
    }

    /// A two-way table in which one cell is measured.
    pub(crate) fn table(rows: &[&str], columns: &[&str], y: &[f64]) {
        let mut last = Real::from(0.0);
        #[dims(row = rows)]
        for row in rows.iter() {
            #[dims(column = columns)]
            for column in columns.iter() {
                let cell ~ Normal(0.0, 5.0);
                if (*row, *column) == ("b", "x") {
                    last = cell;
                }
            }
        }
        for y in y {
            y ~ Normal(last, 1.0);
        }
    }

    pub(crate) fn above(y: &[f64]) {
        let mu ~ Normal(0.0, 5.0).truncate(1.0..);
        for y in y {
            y ~ Normal(mu, 1.0);
        }
    }

    pub(crate) fn below(y: &[f64]) {
        let mu ~ Normal(0.0, 5.0).truncate(..2.0);
        for y in y {
            y ~ Normal(mu, 1.0);
        }
    }

    /// Scales whose posterior lies near zero, the lower bound of every scale.
    pub(crate) fn scales(y: f64, other: f64) {
        let a ~ HalfNormal(5.0);
        let b ~ Normal(0.0, 5.0).truncate(0.0..);
        y ~ Normal(a, 0.3);
        other ~ Normal(b, 0.3);
    }

    /// Intervals that differ between the entries of `x`: draws of one entry lie outside the bounds of the next
    /// entry.
    pub(crate) fn own_bounds(y: &[f64]) {
        for (i, y) in y.iter().enumerate() {
            let centre = 10.0 * i as f64;
            let x ~ Uniform(centre - 5.0, centre + 5.0);
            y ~ Normal(x, 0.1);
        }
    }

    /// Priors with mass near their bounds, for shares that at most one datum informs.
    pub(crate) fn shares(k: u64) {
        let rho ~ Beta(0.5, 0.5);
        let stick ~ Beta(1.0, 6.0).array::<3>();
        let small ~ Normal(0.0, 0.1).truncate(0.0..10.0);
        k ~ Binomial(1u64, rho);
    }

    /// A hierarchical prior under which draws of `a` overflow.
    pub(crate) fn overflowing(y: &[f64]) {
        let sd ~ HalfCauchy(5.0);
        let a ~ LogNormal(0.0, sd).array::<4>();
        let m ~ Normal(0.0, 1.0);
        for y in y {
            y ~ Normal(m, 0.1);
        }
    }

    /// Two components that may exchange their labels.
    pub(crate) fn labels(y: &[f64]) {
        let mu ~ Normal(0.0, 2.0).array::<2>();
        for y in y {
            y ~ Mixture([0.5, 0.5], [Normal(mu[0], 1.0), Normal(mu[1], 1.0)]);
        }
    }

    /// One mode with a tail that narrows, in which chains stick.
    pub(crate) fn tail() {
        let x ~ HalfCauchy(1.0);
        let z ~ Normal(0.0, 1.0);
        let product = z * x / (1.0 + 1e-4 * x.square()).sqrt();
        factor(-0.5 * ((product - 3.0) / 0.3).square());
    }

    /// Three kinds of data, any of which may be missing.
    pub(crate) fn kinds(y: &[f64], x: &[f64], groups: &[&[f64]]) {
        let mu ~ Normal(0.0, 10.0);
        for y in y {
            y ~ Normal(mu, 1.0);
        }
        for x in x {
            let fx = 2.0 * x;
            fx ~ Normal(mu * x, 1.0);
        }
        for group in groups {
            for v in group.iter() {
                v ~ Normal(mu, 1.0);
            }
        }
    }

    pub(crate) fn no_data() {
        let p ~ Beta(0.3, 0.4);
        let x ~ Normal(0.0, 1.0);
    }

    pub(crate) fn rejecting(y: f64) {
        let x ~ Normal(0.0, 1.0);
        if x > 1.0 {
            reject!("x must not be above 1, it is {x:?}");
        }
        y ~ Normal(x, 1.0);
    }

    /// Counts with a log-linear trend over large inputs, whose likelihood falls off steeply around its maximum.
    pub(crate) fn counts(k: &[u64], x: &[f64]) {
        let alpha ~ Normal(0.0, 10.0);
        let beta ~ Normal(0.0, 10.0);
        for i in 0..k.len() {
            k[i] ~ PoissonLog(alpha + beta * x[i]);
        }
        k[0] ~ Poisson(alpha.exp());
    }

    /// A bounded unknown whose second mode has a mass near zero, and an independent unknown; draws from that mode would
    /// cause false warnings about both.
    pub(crate) fn heaps(height: f64) {
        let x ~ Uniform(-20.0, 60.0);
        let y ~ Normal(0.0, 1.0);
        factor(ln_sum_exp(&[-0.5 * x.square(), height - 0.5 * (x - 50.0).square()]));
    }

    /// Two modes of equal mass; in each of twelve unknowns, one mode is a hundred times as wide as
    /// the other mode.
    pub(crate) fn wide_and_narrow() {
        let x ~ Normal(0.0, 100.0).array::<12>();
        let narrow = x.iter().map(|x| -0.5 * (10.0 * x).square() + 10.0_f64.ln());
        let wide = x.iter().map(|x| -0.5 * ((x - 100.0) / 10.0).square() - 10.0_f64.ln());
        factor(ln_sum_exp(&[narrow.sum::<Real>(), wide.sum::<Real>()]));
    }

    pub(crate) fn funnel() {
        let v ~ Normal(0.0, 3.0);
        let x ~ Normal(0.0, (0.5 * v).exp()).array::<9>();
    }

    pub(crate) fn centred(y: &[f64], sd: &[f64]) {
        let mu ~ Normal(0.0, 5.0);
        let tau ~ HalfCauchy(5.0);
        for i in 0..y.len() {
            let theta ~ Normal(mu, tau);
            y[i] ~ Normal(theta, sd[i]);
        }
    }

    /// A scale and a real unknown under uniform priors, whose upper bounds the data exceed.
    pub(crate) fn flat_scale(y: f64, other: f64) {
        let sigma ~ Uniform(0.0, 100.0);
        let cut ~ Uniform(-10.0, 2.0);
        y ~ Normal(sigma, 0.3);
        other ~ Normal(cut, 0.3);
    }

    /// A scale whose prior allows negative values.
    pub(crate) fn free_scale(y: &[f64]) {
        let mu ~ Normal(0.0, 5.0);
        let s ~ Normal(0.0, 1.0);
        for y in y {
            y ~ Normal(mu, s);
        }
    }
}
