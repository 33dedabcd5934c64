//! Metal plasticity from tension tests: an example of a calibration in which specimens have
//! different parameters, to be copied for other materials.
//!
//! Each specimen has its own parameters, drawn from an unknown population. The mean of the population is "the
//! material", its covariance is the scatter between specimens, and both predict a new specimen. A law is defined by
//! its flow stress ([`HardeningLaw`], about ten lines). Voce and Swift are implemented, and leaving out specimens
//! ([`loo_by_specimen`]) estimates which law predicts a new specimen better:
//!
//! ```no_run
//! use breccia_calibration::tension::{Unloading, Voce, calibrate, read_tension_tests};
//! use ppl::Nuts;
//!
//! let tests = read_tension_tests("tension.csv".as_ref(), 200_000.0, Unloading::default())?;
//! let posterior = calibrate::<Voce>(&tests, &Nuts::default().seed(1))?;
//! println!("{}", posterior.summary());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Run `cargo run --release -p models --example tension` for eight specimens of 304L steel.

mod error;
mod experiment;
mod law;
mod loo;

use std::marker::PhantomData;

use ppl::Posterior;
use ppl::prelude::*;

pub use error::TensionError;
pub use experiment::{HardeningPoint, TensionTest, Unloading, read_tension_tests};
pub(crate) use experiment::{MPA_PER_KSI, read_engineering_curves};
pub use law::{HardeningLaw, REFERENCE_STRAIN, Swift, Voce};
pub use loo::loo_by_specimen;

ppl::model! {
    /// Hierarchical model: the parameters of specimen k are ln θ_k ~ N(μ, diag(s) R diag(s)), and its stresses are σ ~
    /// N(law(θ_k), sd).
    ///
    /// `sd` in MPa includes the noise of a curve and the misfit of the law. The parametrisation is centred, because
    /// each curve determines the parameters of its specimen well.
    pub fn hardening<L: HardeningLaw>(_law: PhantomData<L>, tests: &[TensionTest]) {
        let mut mean: Vec<Real> = Vec::new();
        #[dims(parameter)]
        for [prior, width] in L::LN_PRIOR {
            let ln_mean ~ Normal(prior, width);
            mean.push(ln_mean);
        }
        let mean = [mean[0], mean[1], mean[2]];
        #[dims(parameter)] let scatter ~ HalfNormal(0.2).array::<3>();
        let corr ~ LkjCholesky::<3>(2.0);
        let chol = corr.scale_rows(scatter);
        let sd ~ HalfNormal(30.0);
        #[dims(specimen)]
        for test in tests {
            #[dims(parameter)] let ln_own ~ MvNormalCholesky(mean, chol);
            let parameters = ln_own.map(|x| x.exp());
            for point in &test.points {
                point.true_stress_mpa ~ Normal(L::stress_mpa(&parameters, point.plastic_strain), sd);
            }
        }
        #[dims(parameter)] #[predict] let ln_new ~ MvNormalCholesky(mean, chol);
    }
}

/// Samples [`hardening`], and labels parameters and specimens.
///
/// # Errors
/// If the sampler cannot start, or two specimens have the same name.
pub fn calibrate<L: HardeningLaw>(
    tests: &[TensionTest],
    sampler: &Nuts<'_>,
) -> Result<Posterior, TensionError> {
    let mut posterior = sampler.sample(&hardening(PhantomData::<L>, tests))?;
    let specimens: Vec<&str> = tests.iter().map(|test| test.specimen.as_str()).collect();
    posterior.label("ln_mean", 0, &L::PARAMETERS)?;
    posterior.label("ln_own", 0, &specimens)?;
    Ok(posterior)
}

#[cfg(test)]
mod tests;
