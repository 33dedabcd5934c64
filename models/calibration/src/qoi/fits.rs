//! Least-squares polynomials.

/// Least-squares polynomial, expanded in the polynomials φ₀ = 1, φ₁ = x − a₀, φₖ₊₁ = (x − aₖ) φₖ − bₖ φₖ₋₁, which are
/// orthogonal over the points, so that each coefficient is computed by one projection.
///
/// # References
/// Forsythe, Generation and use of orthogonal polynomials for data-fitting with a digital computer (1957).
pub(super) struct Polynomial {
    /// Coefficients aₖ and bₖ of the three-term recurrence of the orthogonal polynomials, for k = 0
    /// … degree − 1.
    recurrence: Vec<[f64; 2]>,
    /// Σ φₖ² over the points.
    norms: Vec<f64>,
    coefficients: Vec<f64>,
}

/// Value and first two derivatives of a polynomial at one point.
#[derive(Clone, Copy)]
pub(super) struct Jet {
    pub(super) value: f64,
    pub(super) slope: f64,
    pub(super) curvature: f64,
}

impl Polynomial {
    /// Fits a polynomial of this degree to points (x, y).
    pub(super) fn of(points: &[(f64, f64)], degree: usize) -> Self {
        let n = points.len();
        let (mut before, mut now) = (vec![0.0; n], vec![1.0; n]);
        let mut polynomials =
            Self { recurrence: Vec::new(), norms: Vec::new(), coefficients: Vec::new() };
        for k in 0..=degree {
            let (mut norm, mut centre, mut projection) = (0.0, 0.0, 0.0);
            for ((x, y), phi) in points.iter().zip(&now) {
                norm += phi * phi;
                centre += x * phi * phi;
                projection += y * phi;
            }
            let b = polynomials.norms.last().map_or(0.0, |previous| norm / previous);
            let a = centre / norm;
            polynomials.norms.push(norm);
            polynomials.coefficients.push(projection / norm);
            if k < degree {
                polynomials.recurrence.push([a, b]);
                for ((x, _), (before, now)) in points.iter().zip(before.iter_mut().zip(&mut now)) {
                    (*before, *now) = (*now, (x - a) * *now - b * *before);
                }
            }
        }
        polynomials
    }

    /// Values and derivatives of φ₀ … φ_degree at x.
    fn basis(&self, x: f64) -> impl Iterator<Item = Jet> {
        let zero = Jet { value: 0.0, slope: 0.0, curvature: 0.0 };
        let first = Jet { value: 1.0, ..zero };
        let next = move |state: &mut (Jet, Jet), [a, b]: [f64; 2]| {
            let (before, now) = *state;
            let value = (x - a) * now.value - b * before.value;
            let slope = now.value + (x - a) * now.slope - b * before.slope;
            let curvature = 2.0 * now.slope + (x - a) * now.curvature - b * before.curvature;
            *state = (now, Jet { value, slope, curvature });
            Some(state.1)
        };
        let further = self.recurrence.iter().copied().scan((zero, first), next);
        std::iter::once(first).chain(further)
    }

    /// Value and derivatives at x.
    pub(super) fn jet(&self, x: f64) -> Jet {
        let mut sum = Jet { value: 0.0, slope: 0.0, curvature: 0.0 };
        for (phi, c) in self.basis(x).zip(&self.coefficients) {
            sum.value += c * phi.value;
            sum.slope += c * phi.slope;
            sum.curvature += c * phi.curvature;
        }
        sum
    }

    pub(super) fn degree(&self) -> usize {
        self.recurrence.len()
    }

    /// Value at x.
    pub(super) fn at(&self, x: f64) -> f64 {
        self.jet(x).value
    }

    /// Variances of value, slope and curvature at x, if each y has the variance 1.
    pub(super) fn variances(&self, x: f64) -> Jet {
        let mut sum = Jet { value: 0.0, slope: 0.0, curvature: 0.0 };
        for (phi, norm) in self.basis(x).zip(&self.norms) {
            sum.value += phi.value * phi.value / norm;
            sum.slope += phi.slope * phi.slope / norm;
            sum.curvature += phi.curvature * phi.curvature / norm;
        }
        sum
    }

    /// Maximum to which Newton's method converges from `start`. `None` if an iterate leaves the interval `ends` or has
    /// a curvature that is not negative.
    pub(super) fn maximum(&self, start: f64, ends: [f64; 2]) -> Option<f64> {
        let longest_step = 0.2 * (ends[1] - ends[0]);
        let mut x = start;
        for _ in 0..50 {
            let Jet { slope, curvature, .. } = self.jet(x);
            if curvature.is_nan() || curvature >= 0.0 {
                return None;
            }
            let exact = -slope / curvature;
            let is_parabola = self.degree() == 2;
            let step = if is_parabola { exact } else { exact.clamp(-longest_step, longest_step) };
            x += step;
            if !(ends[0] <= x && x <= ends[1]) {
                return None;
            }
            if step.abs() <= 1e-14 * (ends[1] - ends[0]) {
                break;
            }
        }
        Some(x)
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    /// Tests the fit to values of x⁴ − 2x³ − 3x² at unequally spaced points, and compares a line
    /// through three points with the textbook formulas of its slope and variances.
    #[test]
    fn polynomials_are_recovered_with_their_derivatives() {
        let y = |x: f64| x.powi(4) - 2.0 * x.powi(3) - 3.0 * x * x;
        let points: Vec<_> =
            [-1.0, -0.7, -0.1, 0.05, 0.4, 0.9, 1.3].into_iter().map(|x: f64| (x, y(x))).collect();
        let Jet { value, slope, curvature } = Polynomial::of(&points, 4).jet(0.3);
        assert_relative_eq!(value, y(0.3), max_relative = 1e-12);
        assert_relative_eq!(slope, 4.0 * 0.027 - 6.0 * 0.09 - 1.8, max_relative = 1e-12);
        assert_relative_eq!(curvature, 12.0 * 0.09 - 3.6 - 6.0, max_relative = 1e-12);
        let line = Polynomial::of(&[(0.0, 1.0), (1.0, 2.0), (2.0, 6.0)], 1);
        assert_relative_eq!(line.jet(7.0).slope, 2.5, max_relative = 1e-14);
        // variance of the slope 1/Σ(x − x̄)², of the value 1/n + (x − x̄)²/Σ(x − x̄)²
        let Jet { value, slope, .. } = line.variances(3.0);
        assert_relative_eq!(slope, 0.5, max_relative = 1e-14);
        assert_relative_eq!(value, 1.0 / 3.0 + 2.0, max_relative = 1e-14);
    }

    /// 1 − (x − 0.2)⁴ − (x − 0.2)² has its maximum at 0.2; x³ has no maximum in [0.5, 1].
    #[test]
    fn a_maximum_is_found_within_its_bounds_or_none() {
        let points = |y: fn(f64) -> f64, from: f64| -> Vec<(f64, f64)> {
            (0..=20).map(|i| from + f64::from(i) * 0.025).map(|x| (x, y(x))).collect()
        };
        let hill = points(|x| 1.0 - (x - 0.2).powi(4) - (x - 0.2).powi(2), 0.0);
        let hill = Polynomial::of(&hill, 4);
        assert_relative_eq!(hill.maximum(0.4, [0.0, 0.5]).unwrap(), 0.2, max_relative = 1e-9);
        assert_eq!(hill.maximum(0.4, [0.3, 0.5]), None);
        assert_eq!(Polynomial::of(&points(|x| x.powi(3), 0.5), 3).maximum(0.7, [0.5, 1.0]), None);
    }
}
