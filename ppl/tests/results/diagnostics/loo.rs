//! Comparison of models by cross-validation.

use ppl::diagnostics::{Loo, LooError, LooPoint, loo_compare};

fn loo(elpds: &[f64]) -> Loo {
    let points: Vec<LooPoint> =
        elpds.iter().map(|&elpd| LooPoint { elpd, p_loo: 0.1, pareto_k: 0.2 }).collect();
    Loo {
        elpd: elpds.iter().sum(),
        se: 1.0,
        p_loo: 1.0,
        threshold: 0.7,
        points,
        data: None,
        has_factors: false,
    }
}

#[test]
fn difference_and_its_error_by_hand() {
    let a = loo(&[-1.0, -2.0, -3.0]);
    let b = loo(&[-2.0, -4.0, -9.0]);
    let table = loo_compare(&[("b", &b), ("a", &a)]).expect("same data");
    assert_eq!(table.rows[0].name, "a");
    assert_eq!((table.rows[0].difference, table.rows[0].difference_se), (0.0, 0.0));
    // pointwise differences −1, −2, −6: sum −9, variance 7
    assert!((table.rows[1].difference + 9.0).abs() < 1e-12);
    assert!((table.rows[1].difference_se - 21_f64.sqrt()).abs() < 1e-12);
    assert!(table.to_string().contains("within two standard errors"), "{table}");
}

#[test]
fn other_numbers_are_told() {
    let with = |data| Loo { data: Some(data), ..loo(&[-1.0, -2.0]) };
    let (a, b, c) = (with(1), with(1), with(2));
    let unknown = Loo { data: None, ..with(3) };
    let same = loo_compare(&[("a", &a), ("b", &b), ("unknown", &unknown)]).expect("as many");
    assert!(same.other_data.is_empty());
    let table = loo_compare(&[("a", &a), ("c", &c)]).expect("as many");
    assert_eq!(table.other_data.len(), 1);
    assert!(table.to_string().contains("Compare models of the same data only"), "{table}");
}

#[test]
fn different_data_cannot_be_compared() {
    let (a, b) = (loo(&[-1.0, -2.0]), loo(&[-1.0]));
    assert!(matches!(loo_compare(&[("a", &a), ("b", &b)]), Err(LooError::DifferentData { .. })));
    assert_eq!(loo_compare(&[]), Err(LooError::NoObservations));
}
