//! The modified Bessel functions I₀ and I₁, as directional statistics needs them.

/// From here on the asymptotic series is exact to the last digit.
const ASYMPTOTIC: f64 = 25.0;

/// ln(e⁻ˣ I₀(x)) for x ≥ 0.
///
/// # References
/// NIST Digital Library of Mathematical Functions, 10.25.2 (series) and 10.40.1 (asymptotic).
pub fn ln_bessel_i0_scaled(x: f64) -> f64 {
    if x < ASYMPTOTIC {
        let (less_one, _) = series(x);
        less_one.ln_1p() - x
    } else {
        let (less_one, _) = asymptotic(x);
        less_one.ln_1p() - 0.5 * (2.0 * std::f64::consts::PI * x).ln()
    }
}

/// 1 − I₁(x)/I₀(x) for x ≥ 0, accurate where the ratio is close to 1.
pub fn one_minus_bessel_ratio(x: f64) -> f64 {
    let (less_one, difference) = if x < ASYMPTOTIC { series(x) } else { asymptotic(x) };
    difference / (1.0 + less_one)
}

/// I₀(x) − 1 and I₀(x) − I₁(x), from the power series.
fn series(x: f64) -> (f64, f64) {
    let half = 0.5 * x;
    let quarter_square = half * half;
    // (x²/4)ᵏ/k!² and (x²/4)ᵏ x/(2 k! (k + 1)!)
    let (mut zero, mut sum, mut first_sum) = (1.0, 0.0, half);
    let mut k = 0.0;
    while zero > 0.1 * f64::EPSILON * sum {
        k += 1.0;
        zero *= quarter_square / (k * k);
        sum += zero;
        first_sum += zero * half / (k + 1.0);
    }
    (sum, 1.0 + sum - first_sum)
}

/// The same, both divided by eˣ/√(2πx) in leading order, from the asymptotic series; the ones of
/// I₀ and I₁ cancel on paper.
fn asymptotic(x: f64) -> (f64, f64) {
    let eighth = (8.0 * x).recip();
    let (mut zero, mut one, mut sum, mut difference) = (1.0, 1.0, 0.0, 0.0);
    for k in 1..30 {
        let k = f64::from(k);
        let odd = (2.0 * k - 1.0) * (2.0 * k - 1.0);
        zero *= odd * eighth / k;
        one *= (odd - 4.0) * eighth / k;
        if zero.abs() < 0.01 * f64::EPSILON {
            break;
        }
        sum += zero;
        difference += zero - one;
    }
    (sum, difference)
}
