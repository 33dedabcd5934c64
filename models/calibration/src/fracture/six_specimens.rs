//! Specimens, a forward model and posteriors that several tests share.

use std::sync::LazyLock;

use ppl::{Nuts, Posterior};
use surrogate::{DynPce, Input};

use super::{Calibration, Evidence, Specimens, calibrate, calibration_on};
use crate::prior::Prior;

/// Two quantities of six specimens, with means of 1. The last specimen is far from the other
/// specimens.
pub(super) const QOIS: [[f64; 2]; 6] =
    [[0.97, 0.99], [1.00, 0.95], [0.95, 0.97], [1.02, 1.01], [0.98, 1.00], [1.08, 1.08]];

/// Forward model of one parameter: over the box, the first quantity grows from 0.8 to 1.2 and the second from 0.9 to
/// 1.1.
pub(super) fn forward() -> DynPce {
    let x = Input::new("matrix.young_mpa", 250.0, 300.0).unwrap();
    let slopes = [0.2, 0.1].map(|s| s / 3f64.sqrt()).to_vec();
    let outputs = ["slope_N_per_mm", "peak_force_N"].map(str::to_owned).to_vec();
    DynPce::from_terms(vec![x], outputs, [(vec![0], vec![1.0; 2]), (vec![1], slopes)]).unwrap()
}

pub(super) fn priors() -> Vec<Prior> {
    Prior::uniform_on(forward().inputs())
}

/// Covariance of the errors that all specimens share.
pub(super) fn shared() -> Vec<Vec<f64>> {
    vec![vec![4e-4, 1e-4], vec![1e-4, 3e-4]]
}

/// Sampler with 16 000 draws, so that the standard error of the Pareto shape k̂ is about 0.05.
pub(super) fn sampler() -> Nuts<'static> {
    Nuts::default().chains(2).draws(8000).seed(3)
}

/// The calibration to all specimens.
pub(super) static CALIBRATED: LazyLock<Calibration> = LazyLock::new(|| {
    let qois = QOIS.map(Vec::from).to_vec();
    let evidence = Evidence { qois, shared: shared(), ..Evidence::default() };
    calibrate(&forward(), &priors(), &evidence, &sampler(), 3).unwrap()
});

/// Posteriors without the first specimen, without the second, and so on. These posteriors are sampled with other random
/// numbers than [`CALIBRATED`].
pub(super) static WITHOUT_EACH: LazyLock<Vec<Posterior>> = LazyLock::new(|| {
    let without = |k: usize| {
        let mut others = QOIS.map(Vec::from).to_vec();
        others.remove(k);
        let others = Specimens::new(&others).unwrap().sharing(shared()).unwrap();
        let (pce, priors) = (forward(), priors());
        let model = calibration_on(&pce, &priors, &others);
        let chains = sampler().seed(11).run(&model).unwrap();
        Posterior::from_chains(&model, chains, 3).unwrap()
    };
    (0..QOIS.len()).map(without).collect()
});
