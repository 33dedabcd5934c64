//! Independent numerical methods for the tests.

use ppl::{Joined, Scalar, Unknown};

/// Returns the value of an unknown at the next coordinates, and its log density.
pub(crate) fn constrained<R: Scalar, D: Unknown<R>>(
    distribution: &D,
    mut next: impl FnMut() -> R,
    jacobian: bool,
) -> (D::Value, R) {
    Joined::with(|terms| distribution.constrain(&mut next, jacobian, terms))
}

/// Derivative of `f` at `x` by central differences with the steps h, h/2, h/4, …, extrapolated to step 0 (Ridders
/// 1982). The result is the table entry that agrees best with its neighbours.
pub(crate) fn derivative(f: impl Fn(f64) -> f64, x: f64, h: f64) -> f64 {
    extrapolated(&f, x, h)
}

// the argument of this function and of the quadratures below is a trait object, so that they are compiled once
fn extrapolated(f: &dyn Fn(f64) -> f64, x: f64, h: f64) -> f64 {
    const LEVELS: usize = 7;
    let mut tableau = [[0.0f64; LEVELS]; LEVELS];
    let (mut best, mut error) = (f64::NAN, f64::INFINITY);
    for i in 0..LEVELS {
        let h = h / f64::from(1 << i);
        let (above, below) = (x + h, x - h);
        tableau[i][0] = (f(above) - f(below)) / (above - below);
        for j in 1..=i {
            let factor = f64::from(4u32.pow(j as u32));
            let (this, coarser) = (tableau[i][j - 1], tableau[i - 1][j - 1]);
            tableau[i][j] = (factor * this - coarser) / (factor - 1.0);
            let spread = (tableau[i][j] - this).abs().max((tableau[i][j] - coarser).abs());
            if spread < error {
                (best, error) = (tableau[i][j], spread);
            }
        }
    }
    best
}

/// Computes ∫ f over ℝ by the trapezoid rule, with the substitution y = centre + scale · sinh t.
pub(crate) fn integral(f: impl Fn(f64) -> f64, centre: f64, scale: f64) -> f64 {
    trapezoid(&f, centre, scale)
}

fn trapezoid(f: &dyn Fn(f64) -> f64, centre: f64, scale: f64) -> f64 {
    const STEP: f64 = 0.01;
    (-3500..=3500)
        .map(|i| {
            let t = f64::from(i) * STEP;
            let weight = scale * t.cosh() * STEP;
            let value = f(centre + scale * t.sinh());
            if value == 0.0 { 0.0 } else { weight * value }
        })
        .sum()
}

/// Kolmogorov–Smirnov statistic √n sup |Fₙ − F|.
pub(crate) fn kolmogorov_smirnov(draws: &[f64], cdf: impl Fn(f64) -> f64) -> f64 {
    let mut sorted = draws.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len() as f64;
    let distance = sorted.iter().enumerate().fold(0.0f64, |d, (i, &x)| {
        let p = cdf(x);
        d.max(p - i as f64 / n).max((i + 1) as f64 / n - p)
    });
    n.sqrt() * distance
}

/// Critical value of √n sup |Fₙ − F| at the probability α = 10⁻⁴: √(½ ln(2/α)).
pub(crate) const KOLMOGOROV_SMIRNOV_LIMIT: f64 = 2.225;

/// Returns sample mean and variance.
pub(crate) fn moments(draws: &[f64]) -> (f64, f64) {
    let n = draws.len() as f64;
    let mean = draws.iter().sum::<f64>() / n;
    let variance = draws.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, variance)
}

/// Panics unless the numbers agree up to the relative or the absolute tolerance.
#[track_caller]
pub(crate) fn assert_close(got: f64, expected: f64, relative: f64, absolute: f64, what: &str) {
    let error = (got - expected).abs();
    assert!(
        error <= relative * expected.abs() + absolute,
        "{what}: {got:e} against {expected:e}, error {error:.1e}"
    );
}

/// Panics if the draws do not follow the given masses. χ² test at α = 10⁻⁴; counts with fewer than 20 expected draws
/// form one cell.
pub(crate) fn assert_chi_squared(draws: &[u64], masses: &[f64], what: &str) {
    let n = draws.len() as f64;
    let mut seen = vec![0.0; masses.len()];
    for &k in draws {
        let k = usize::try_from(k).unwrap();
        assert!(k < masses.len() && masses[k] > 0.0, "{what}: impossible draw {k}");
        seen[k] += 1.0;
    }
    let (mut statistic, mut cells, mut rest) = (0.0, 0, (n, n));
    for (seen, p) in seen.iter().zip(masses).filter(|(_, p)| *p * n >= 20.0) {
        statistic += (seen - n * p).powi(2) / (n * p);
        rest = (rest.0 - seen, rest.1 - n * p);
        cells += 1;
    }
    if rest.1 > 1.0 {
        statistic += (rest.0 - rest.1).powi(2) / rest.1;
        cells += 1;
    }
    // the 1 − 10⁻⁴ quantile of χ² with (number of cells − 1) degrees of freedom (Wilson–Hilferty)
    let degrees = f64::from(cells - 1);
    let ninth = 2.0 / (9.0 * degrees.max(1.0));
    let limit = degrees * (1.0 - ninth + 3.719 * ninth.sqrt()).powi(3);
    assert!(cells > 1 && statistic < limit, "{what}: {statistic} against {limit}");
}
