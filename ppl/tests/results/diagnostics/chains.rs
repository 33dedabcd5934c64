//! R-hat, effective sample sizes, Monte Carlo standard errors, E-BFMI.

use ppl::diagnostics::{
    e_bfmi, ess_bulk, ess_mean, ess_sd, ess_tail, mcse_mean, mcse_quantile, mcse_sd, rhat,
};
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::borrow;

/// The autocorrelation time of an AR(1) chain with coefficient ρ is τ = (1 + ρ)/(1 − ρ).
#[test]
fn autoregressive_chains_give_their_known_size() {
    for rho in [-0.5_f64, 0.0, 0.5, 0.9] {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(20210716);
        let chains: Vec<Vec<f64>> = (0..4)
            .map(|_| {
                let mut x: f64 = rng.sample(StandardNormal);
                (0..20_000)
                    .map(|_| {
                        let step: f64 = rng.sample(StandardNormal);
                        x = rho * x + (1.0 - rho * rho).sqrt() * step;
                        x
                    })
                    .collect()
            })
            .collect();
        let expected = 80_000.0 * (1.0 - rho) / (1.0 + rho);
        // the relative standard error of the estimator is √(8 P/S) ≲ 4 % here, where P is the mean number of
        // autocorrelation pairs that it sums
        let got = ess_mean(&borrow(&chains));
        assert!((got / expected - 1.0).abs() < 0.12, "ρ = {rho}: {got}, expected {expected}");
    }
}

#[test]
fn sizes_of_nothing_are_nan() {
    let constant = [3.0; 40];
    assert!(ess_bulk(&[&constant, &constant]).is_nan());
    assert!(ess_tail(&[&constant, &constant]).is_nan());
    assert!(ess_mean(&[&[1.0, f64::INFINITY, 2.0, 3.0]]).is_nan());
    assert!(ess_sd(&[]).is_nan());
}

#[test]
fn rhat_of_nothing_is_nan() {
    assert!(rhat(&[]).is_nan());
    assert!(rhat(&[&[1.0, 2.0, 3.0]]).is_nan(), "too short");
    assert!(rhat(&[&[2.0; 50], &[2.0; 50]]).is_nan(), "never moved");
    assert!(rhat(&[&[1.0, 2.0, f64::NAN, 3.0, 4.0]]).is_nan());
}

#[test]
fn chains_stuck_at_different_places_are_far_apart() {
    assert!(rhat(&[&[1.0; 50], &[2.0; 50]]) > 1e6);
}

#[test]
fn a_difference_in_spread_alone_is_seen() {
    let narrow: Vec<f64> = (0..200).map(|i| (i as f64 * 0.7).sin()).collect();
    let wide: Vec<f64> = narrow.iter().map(|x| 10.0 * x).collect();
    assert!(rhat(&[&narrow, &narrow]) < 1.01);
    assert!(rhat(&[&narrow, &wide]) > 1.2);
}

/// For S independent normal draws the MCSEs of the mean, the sd and the median are σ/√S, σ/√(2S) and 1.2533 σ/√S; at S
/// = 20 000 their estimates are within a few per cent, the median's with the largest error.
#[test]
fn independent_normal_draws_have_known_errors() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
    let chains: Vec<Vec<f64>> = (0..4)
        .map(|_| (0..5000).map(|_| 3.0 * rng.sample::<f64, _>(StandardNormal)).collect())
        .collect();
    let chains: Vec<&[f64]> = chains.iter().map(Vec::as_slice).collect();
    let unit = 3.0 / 20_000_f64.sqrt();
    assert!((mcse_mean(&chains) / unit - 1.0).abs() < 0.08);
    assert!((mcse_sd(&chains) / (unit / 2_f64.sqrt()) - 1.0).abs() < 0.08);
    assert!((mcse_quantile(&chains, 0.5) / (1.2533 * unit) - 1.0).abs() < 0.2);
}

#[test]
fn degenerate_energies_are_nan() {
    assert!(e_bfmi(&[]).is_nan());
    assert!(e_bfmi(&[1.0]).is_nan());
    assert!(e_bfmi(&[0.1; 10]).is_nan());
}

#[test]
fn small_example_by_hand() {
    // mean 3.5; squared steps 1 + 4 + 9; squared deviations 6.25 + 2.25 + 0.25 + 12.25
    assert!((e_bfmi(&[1.0, 2.0, 4.0, 7.0]) - 14.0 / 21.0).abs() < 1e-15);
}
