//! Products of scales that overflow or underflow.

use super::*;

fn taken(values: &[f64]) -> f64 {
    let (mut one, mut other) = (Settled::new(), Settled::new());
    for (i, &x) in values.iter().enumerate() {
        let terms = if i % 2 == 0 { &mut one } else { &mut other };
        let rest = Accumulator::<f64>::minus_ln(terms, x);
        Accumulator::<f64>::add_number(terms, rest);
    }
    one.add_all(other);
    one.total()
}

/// Compares the logarithm of a product, which overflows or underflows, with the sum of the logarithms.
#[test]
fn a_product_that_leaves_its_range_is_taken_in_parts() {
    let wide = [1e150, 1e149, 3e-150, 1e-160, 7.0, 1e-170, 1e180, 1e300, 1e-300, 1e-310];
    for n in 0..wide.len() {
        let expected: f64 = wide[..n].iter().map(|x| -x.ln()).sum();
        // the sum contains logarithms of up to 700
        approx::assert_abs_diff_eq!(taken(&wide[..n]), expected, epsilon = 1e-12);
    }
}

#[test]
fn what_has_no_logarithm_is_seen() {
    assert_eq!(taken(&[2.0, 0.0, 3.0]), f64::INFINITY);
    assert_eq!(taken(&[2.0, f64::INFINITY, 3.0]), f64::NEG_INFINITY);
    assert!(taken(&[2.0, -1.0, -1.0]).is_nan());
    assert!(taken(&[f64::NAN, 2.0]).is_nan());
}
