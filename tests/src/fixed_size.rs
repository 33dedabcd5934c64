//! The paper's calibration with all sizes known at compile time: the reference for the speed and the density of
//! `models::calibration_on`, whose sizes come from data.

use models::Prior;
use ppl::prelude::*;

ppl::model! {
    /// Matrix parameters of a bonded granular material from specimen QoIs.
    ///
    /// θ = (E, Gc, ξ) has independent priors; every specimen's QoIs are normal around
    /// `forward(θ)` with one covariance diag(sd) R diag(sd): R ~ LKJ(3), sd ~ Normal(0.15, 0.25)
    /// above zero. QoIs are relative to their experimental means, so 0.15 is 15 % scatter.
    ///
    /// # Reference
    /// Paper, section "Quantities of Interest", equations of the likelihood.
    pub fn calibration<F: Differentiable<3, 3>>(
        forward: &F,
        qois: &[[f64; 3]],
        priors: &[Prior; 3],
    ) {
        let young_mpa          ~ priors[0];
        let toughness_n_per_mm ~ priors[1];
        let viscosity_mpa_s    ~ priors[2];

        let sd   ~ Normal(0.15, 0.25).truncate(0.0..).array::<3>();
        let corr ~ LkjCholesky::<3>(3.0);
        let chol = corr.scale_rows(sd);

        #[track] let mean = forward.at([young_mpa, toughness_n_per_mm, viscosity_mpa_s]);
        for y in qois {
            y ~ MvNormalCholesky(mean, chol);
        }
        #[predict] let new_specimen ~ MvNormalCholesky(mean, chol);
    }
}
