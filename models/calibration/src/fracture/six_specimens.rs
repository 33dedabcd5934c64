//! Specimens and a forward model that several tests share.

use surrogate::{DynPce, Input};

/// Two quantities of six specimens, with means of 1. The last specimen is far from the others.
pub(super) const QOIS: [[f64; 2]; 6] =
    [[0.97, 0.99], [1.00, 0.95], [0.95, 0.97], [1.02, 1.01], [0.98, 1.00], [1.08, 1.08]];

/// Forward model of one parameter: the quantities grow from 0.8 to 1.2 and from 0.9 to 1.1.
pub(super) fn forward() -> DynPce {
    let x = Input::new("matrix.young_mpa", 250.0, 300.0).unwrap();
    let slopes = [0.2, 0.1].map(|s| s / 3f64.sqrt()).to_vec();
    let outputs = ["slope_N_per_mm", "peak_force_N"].map(str::to_owned).to_vec();
    DynPce::from_terms(vec![x], outputs, [(vec![0], vec![1.0; 2]), (vec![1], slopes)]).unwrap()
}
