//! How much the data inform a parameter: contraction and mass at the bounds.

use ppl::diagnostics::{Identifiability, Identification};

#[test]
fn labels_follow_the_contraction() {
    // two draws whose standard deviation is sd
    let pair = |sd: f64| [0.5 - sd / 2_f64.sqrt(), 0.5 + sd / 2_f64.sqrt()];
    let prior: Vec<f64> = pair(1.0).repeat(500);
    let with_sd = |sd: f64| Identifiability::of_draws("x", &prior, &pair(sd).repeat(500), None);
    assert_eq!(with_sd(0.2).label(), Identification::Identified);
    assert_eq!(with_sd(0.8).label(), Identification::Weakly);
    assert_eq!(with_sd(0.99).label(), Identification::Not);
    assert_eq!(with_sd(1.3).label(), Identification::Not);
    assert_eq!(with_sd(f64::NAN).label(), Identification::Not);
    assert!((with_sd(0.5).contraction() - 0.75).abs() < 1e-12);
}

/// 2000 evenly spaced points in (0, 1).
fn even() -> Vec<f64> {
    (0..2000).map(|i| (f64::from(i) + 0.5) / 2000.0).collect()
}

#[test]
fn mass_at_a_bound_is_counted_on_both_sides() {
    let draws = [10.005, 10.5, 10.5, 10.995];
    let prior: Vec<f64> = even().iter().map(|p| 10.0 + p).collect();
    let row = Identifiability::of_draws("x", &prior, &draws, Some((10.0, 11.0)));
    assert_eq!(row.boundary_mass, Some(0.5));
    assert!(row.truncated());
    let said = row.to_string();
    assert!(said.contains("25 % at its lower end 10.00 and 25 % at its upper end 11.00"), "{said}");
}

/// A prior whose density is largest at its bounds, Beta(½, ½), does not count as truncation where the posterior equals
/// the prior, and does where the data push against the upper bound.
#[test]
fn a_prior_may_pile_up_at_its_own_bounds() {
    let at = |of: &dyn Fn(f64) -> f64| -> Vec<f64> {
        (0..2000).map(|i| of((f64::from(i) + 0.5) / 2000.0)).collect()
    };
    let arcsine = at(&|p| (std::f64::consts::FRAC_PI_2 * p).sin().powi(2));
    let pushed = at(&|p| 1.0 + 0.02 * (-p).ln_1p());
    let row = |after: &[f64]| Identifiability::of_draws("x", &arcsine, after, Some((0.0, 1.0)));
    assert!(!row(&arcsine).truncated());
    assert!(row(&pushed).to_string().contains("% at its upper end 1.000"));
    // draws near zero, the natural bound of a share, do not count
    let away: Vec<f64> = pushed.iter().map(|x| 1.0 - x).collect();
    assert!(!row(&away).truncated());
}

/// Priors whose draws or whose variance overflow are compared by the central half of the draws.
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

/// A posterior that decreases exponentially from the lower bound is truncated there; a posterior without mass at the
/// bound does not count as truncated, however wide the prior is.
#[test]
fn a_wide_prior_is_no_bound_by_itself() {
    let quantiles = |of: &dyn Fn(f64) -> f64| -> Vec<f64> {
        (0..1000).map(|i| of((f64::from(i) + 0.5) / 1000.0)).collect()
    };
    let exponential = quantiles(&|p| -(-p).ln_1p());
    let narrow = quantiles(&|p| 0.2 + 0.1 * (p / (1.0 - p)).ln().tanh());
    for width in [20.0, 100.0, 1e4] {
        let prior: Vec<f64> = even().iter().map(|p| 1.0 + width * p).collect();
        let mass = |draws: &[f64]| {
            let draws: Vec<f64> = draws.iter().map(|x| 1.0 + x).collect();
            let row = Identifiability::of_draws("x", &prior, &draws, Some((1.0, 1.0 + width)));
            row.boundary_mass
        };
        assert!(mass(&exponential).is_some_and(|mass| mass > 0.15));
        assert_eq!(mass(&narrow), None);
    }
}
