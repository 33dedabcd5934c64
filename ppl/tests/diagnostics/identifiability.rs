//! What the data said of a parameter.

use ppl::diagnostics::{Identifiability, Identification, Marginal, boundary_mass};

#[test]
fn labels_follow_the_contraction() {
    let prior = Marginal { mean: 0.0, sd: 1.0 };
    let with_sd = |sd: f64| {
        // two draws whose standard deviation is sd
        let half = sd / 2_f64.sqrt();
        Identifiability::new("x", prior, &[0.5 - half, 0.5 + half], None)
    };
    assert_eq!(with_sd(0.2).label(), Identification::Identified);
    assert_eq!(with_sd(0.8).label(), Identification::Weakly);
    assert_eq!(with_sd(0.99).label(), Identification::Not);
    assert_eq!(with_sd(1.3).label(), Identification::Not);
    assert_eq!(with_sd(f64::NAN).label(), Identification::Not);
    assert!((with_sd(0.5).contraction() - 0.75).abs() < 1e-12);
}

#[test]
fn mass_at_a_bound_is_counted_on_both_sides() {
    let draws = [0.005, 0.5, 0.5, 0.995];
    assert_eq!(boundary_mass(&draws, (0.0, 1.0)), 0.5);
    let row = Identifiability::new("x", Marginal { mean: 0.5, sd: 0.29 }, &draws, Some((0.0, 1.0)));
    assert!(row.truncated());
    assert!(
        row.to_string().contains("25 % at its lower end 0 and 25 % at its upper end 1.000"),
        "{row}"
    );
}

/// A prior with mass at its ends, Beta(½, ½), is no cut where the data say nothing, and is one where
/// they push against an end.
#[test]
fn a_prior_may_pile_up_at_its_own_bounds() {
    let at = |of: &dyn Fn(f64) -> f64| -> Vec<f64> {
        (0..2000).map(|i| of((f64::from(i) + 0.5) / 2000.0)).collect()
    };
    let arcsine = at(&|p| (std::f64::consts::FRAC_PI_2 * p).sin().powi(2));
    let pushed = at(&|p| 1.0 + 0.02 * (-p).ln_1p());
    let row = |after: &[f64]| Identifiability::of_draws("x", &arcsine, after, Some((0.0, 1.0)));
    assert!(boundary_mass(&arcsine, (0.0, 1.0)) > 0.1);
    assert!(!row(&arcsine).truncated());
    assert!(row(&pushed).to_string().contains("% at its upper end 1.000"));
    // towards zero, where a share ends by itself
    let away: Vec<f64> = pushed.iter().map(|x| 1.0 - x).collect();
    assert!(!row(&away).truncated());
}

/// Draws whose variance overflows, or that do so themselves, are judged by their central halves.
#[test]
fn overflowing_priors_are_compared_all_the_same() {
    for steepness in [100.0, 400.0] {
        let wild = |n: u32| -> Vec<f64> {
            let p = |i| (f64::from(i) + 0.5) / f64::from(n);
            (0..n).map(|i| (steepness * (2.0 * p(i) - 1.0).powi(9)).exp()).collect()
        };
        let (before, after) = (wild(2000), wild(1000));
        let row = Identifiability::of_draws("x", &before, &after, None);
        assert!(row.contraction().abs() < 0.02, "{row}");
        assert!(row.to_string().len() < 160, "{row}");
        let narrow: Vec<f64> = (0..1000).map(|i| 1.0 + 1e-4 * f64::from(i).sin()).collect();
        let row = Identifiability::of_draws("x", &before, &narrow, None);
        assert_eq!(row.label(), Identification::Identified);
    }
}

/// An exponential posterior is cut off at the bound, a gamma one on the same scale is not, however
/// wide the prior.
#[test]
fn a_wide_prior_is_no_bound_by_itself() {
    let quantiles = |of: &dyn Fn(f64) -> f64| -> Vec<f64> {
        (0..1000).map(|i| of((f64::from(i) + 0.5) / 1000.0)).collect()
    };
    let exponential = quantiles(&|p| -(-p).ln_1p());
    let narrow = quantiles(&|p| 0.2 + 0.1 * (p / (1.0 - p)).ln().tanh());
    for width in [20.0, 100.0, 1e4] {
        assert!(boundary_mass(&exponential, (0.0, width)) > 0.15);
        assert_eq!(boundary_mass(&narrow, (0.0, width)), 0.0);
    }
}
