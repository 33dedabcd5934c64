//! Maps of intervals: derivative, inverse, and intersection.

use super::*;
use crate::number::dual::Dual;

fn cases() -> [Support<f64>; 4] {
    [Support::Real, Support::Above(-1.5), Support::Below(2.0), Support::Between(-1.0, 3.0)]
}

#[test]
fn jacobian_is_the_derivative_and_the_inverse_inverts() {
    for support in cases() {
        for y in [-30.0, -2.0, 0.0, 0.3, 5.0, 30.0] {
            let [v] = Dual::variables([y]);
            let lifted = match support {
                Support::Real => Support::Real,
                Support::Above(a) => Support::Above(Dual::from(a)),
                Support::Below(b) => Support::Below(Dual::from(b)),
                Support::Between(a, b) => Support::Between(Dual::from(a), Dual::from(b)),
            };
            let (x, log_jacobian) = lifted.constrain(v);
            approx::assert_relative_eq!(
                x.gradient()[0].abs().ln(),
                log_jacobian.value(),
                max_relative = 1e-13,
                epsilon = 1e-13
            );
            if y.abs() < 10.0 {
                // the sign of the derivative is checked separately, because the log-Jacobian does not depend on it
                let quotient = (support.point(y + 1e-5) - support.point(y - 1e-5)) / 2e-5;
                approx::assert_relative_eq!(x.gradient()[0], quotient, max_relative = 1e-6);
                approx::assert_relative_eq!(
                    support.unconstrain(x.value()),
                    y,
                    max_relative = 1e-12,
                    epsilon = 1e-12
                );
            }
            assert!(support.contains(x.value()));
        }
    }
}

#[test]
fn truncation_keeps_the_tighter_end() {
    assert_eq!(Support::Real.within(0.0, f64::INFINITY), Support::Above(0.0));
    assert_eq!(Support::Above(1.0).within(0.0, 5.0), Support::Between(1.0, 5.0));
    assert_eq!(Support::Between(0.0, 1.0).within(0.5, 9.0), Support::Between(0.5, 1.0));
    assert_eq!(Support::<f64>::Real.within(f64::NEG_INFINITY, f64::INFINITY), Support::Real);
}

#[test]
fn only_the_real_line_contains_infinity() {
    for support in cases() {
        for x in [f64::NEG_INFINITY, f64::INFINITY] {
            assert_eq!(support.contains(x), support == Support::Real, "{support:?} {x}");
        }
        assert!(!support.contains(f64::NAN), "{support:?}");
    }
}
